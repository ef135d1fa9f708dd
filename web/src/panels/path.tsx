// Of panel 6: the path of models, their cross-validated error against the number
// of effects.
import {pathOf, sameSegments, type PathPoint} from '../cross_validation';
import {candidateName, modelWithId, withOthers} from '../data';
import type {CandidateData, ModelData, PageData, StepData} from '../page_data';
import {XyChart, type Layer, type Mark} from '../plots/xy_chart';

const kHow = 'The error of each model on data that its parameters were not fitted to (cross-validation), with its standard error. Each step compares both models over the same segments, from an initial state of their own. '
  + 'A dotted line is the same model over other segments: errors grow with the length of the segments, so that only what a solid line joins can be compared.';

const kNear = 5; // × noise

// `way`: the steps to the model that is shown; `end`: the model in which they end.
export function Path({page, way, end}: {page: PageData; way: StepData[]; end: ModelData}) {
  const {points, edges} = pathOf(page, way);
  if (points.length < 2) return null;
  const chosen = [...points].reverse().find(p => p.model === end.id);
  const others = otherRefits(page, way, points[0]);
  const line = (longer: boolean): Layer[] => edges.filter(e => e.longer === longer).map(e => ({
    label: '', color: 'var(--quiet)', kind: 'line' as const, dash: longer ? '2 4' : undefined,
    x: [e.from.effects, e.to.effects], y: [e.from.cv.error, e.to.cv.error]}));
  const dots = (label: string, color: string, of: {effects: number; cv: PathPoint['cv']}[], more: Partial<Layer> = {}): Layer => ({
    label, color, kind: 'points' as const, size: 8, x: of.map(p => p.effects), y: of.map(p => p.cv.error),
    error: of.map(p => p.cv.stdError ?? NaN), barOpacity: 1, ...more});
  const layers = [...line(true), ...line(false),
    ...(others.length ? [dots('other effects that were tried', 'var(--quiet)', others, {size: 6, opacity: 0.7, barOpacity: 0.5})] : []),
    dots('models of the search', 'var(--first)', points.filter(p => p !== chosen)),
    ...(chosen ? [dots('the model in which it ended', 'var(--second)', [chosen], {size: 12})] : [])];
  const marks: Mark[] = points.filter((p, i) => points.findIndex(o => o.model === p.model) === i)
    .map((p, i) => ({x: p.effects, y: p.cv.error, text: `${i}`}));
  const names = [...new Set(points.map(p => p.model))].map((id, i) => `${i} ${modelWithId(page, id)!.title}`);
  return (
    <XyChart title="Cross-validated error against the number of effects" xLabel="effects that were added" yLabel="error, × noise"
      layers={layers} marks={marks} rules={Math.min(...points.map(p => p.cv.error)) < kNear ? [{y: 1, label: 'noise'}] : []} logY whole>
      <p class="note">{names.join('; ')}.</p>
      <p class="note">{kHow}</p>
    </XyChart>
  );
}

// What the first step might have added instead, by the refits of its candidates.
function otherRefits(page: PageData, way: StepData[], start: PathPoint): {effects: number; cv: PathPoint['cv']}[] {
  const from = modelWithId(page, start.model)!, first = modelWithId(page, way[0].model);
  const count = (c: CandidateData) => from.effects.length + withOthers(c).length;
  return from.candidates.filter(c => c.confirmed?.crossValidation && sameSegments(c.confirmed.segment_s, from.segment_s) && !first?.effects.includes(candidateName(c)))
    .map(c => ({effects: count(c), cv: c.confirmed!.crossValidation!}));
}
