// Of panel 4: the error of each stretch that was left out of the fit.
import {compareStretches, factorOf, fmtCrossValidation, sameSegments} from '../cross_validation';
import {modelColor} from '../colors';
import {runLabel} from '../data';
import {fmt, fmtError, fmtRange} from '../format';
import type {ModelData, PageData} from '../page_data';
import {scaleOf} from '../plots/axes';
import {Legend, useWidth} from '../plots/xy_chart';

const kLeft = 58, kTop = 12, kHeight = 230, kBottom = 58, kRight = 12;

export function Folds({page, models}: {page: PageData; models: number[]}) {
  const shown = models.map(i => page.models[i]).filter(m => m.crossValidation);
  if (!shown.length || shown[0] !== page.models[models[0]]) return null;
  return (
    <div class="folds">
      <h3>Error of each stretch that was left out</h3>
      <p class="how">Cross-validation: the runs are cut into stretches of equal length, and each is predicted with the parameters that the other runs give (of a single run, the other stretches). A model that is right for one part of the motion only shows here.</p>
      <Bars page={page} models={shown} />
      <p class="note">{shown.map(m => `${m.title}: ${fmtCrossValidation(m.crossValidation)} × noise (geometric mean ± standard error), over segments of ${fmt(m.segment_s, 3)} s`).join('; ')}.
        {shown.length > 1 && ` ${inWords(shown[0], shown[1])}`}</p>
    </div>
  );
}

function inWords(a: ModelData, b: ModelData): string {
  if (!sameSegments(a.segment_s, b.segment_s)) return 'Their segments differ, so that the errors cannot be compared.';
  const ratio = compareStretches(b.crossValidation, a.crossValidation);
  return ratio ? `The error of ${b.title} is ${factorOf(ratio)} times that of ${a.title} (95 % interval); it is the larger one in ${ratio.lower} of ${ratio.of} stretches.` : '';
}

function Bars({page, models}: {page: PageData; models: ModelData[]}) {
  const {ref, width} = useWidth(600);
  const stretches = models[0].crossValidation!.stretches;
  const values = models.flatMap(m => m.crossValidation!.stretches.map(s => s.error)).filter((v): v is number => v !== null && v > 0);
  const scale = scaleOf(values, true, [1]);
  const w = width - kLeft - kRight, h = kHeight - kTop - kBottom;
  const py = (v: number) => kTop + (1 - scale.at(v)) * h;
  const slot = w / stretches.length, size = Math.min(5, slot / 4);
  const runs = runsOf(page, stretches);
  const color = (k: number) => `var(${modelColor(page.models.indexOf(models[k]), page.models.indexOf(models[0]))})`;
  return (
    <figure class="chart">
      <figcaption>Error of each stretch, × noise (logarithmic)</figcaption>
      <Legend layers={models.map((m, k) => ({label: m.title, color: color(k), kind: 'points'}))} />
      <div ref={ref}>
        <svg width={width} height={kHeight} viewBox={`0 0 ${width} ${kHeight}`} role="img" aria-label="Cross-validated error of each stretch of the runs">
          {scale.ticks.map(t => <g key={t}>
            <line class="grid" x1={kLeft} x2={kLeft + w} y1={py(t)} y2={py(t)} />
            <text x={kLeft - 6} y={py(t) + 4} text-anchor="end">{fmt(t)}</text>
          </g>)}
          <line class="rule" x1={kLeft} x2={kLeft + w} y1={py(1)} y2={py(1)} />
          <text class="rule-label" x={kLeft + w - 2} y={py(1) - 4} text-anchor="end">noise</text>
          <text transform={`translate(14 ${kTop + h / 2}) rotate(-90)`} text-anchor="middle">error, × noise</text>
          {runs.map(r => <g key={r.name}>
            <line class="rule" x1={kLeft + r.first * slot} x2={kLeft + r.first * slot} y1={kTop} y2={kTop + h + 8} />
            <text x={kLeft + (r.first + r.count / 2) * slot} y={kTop + h + 22} text-anchor="middle">
              <title>{r.name}</title>{cut(r.label, r.count * slot / 7)}{r.heldOut && r.count * slot > 150 ? ', held out' : ''}</text>
          </g>)}
          {[...models].reverse().map((m, k, all) => m.crossValidation!.stretches.map((s, i) => s.error !== null && s.error > 0 && (
            <circle key={`${k}/${i}`} cx={kLeft + (i + 0.5) * slot} cy={py(s.error)} r={size} fill={color(all.length - 1 - k)}>
              <title>{`${m.title}, ${s.trajectory}, ${fmtRange(s.t_start, s.t_end)}: ${fmtError(s.error)} × noise`}</title>
            </circle>
          )))}
          <text x={kLeft + w / 2} y={kHeight - 8} text-anchor="middle">stretches of the runs, in order of time</text>
        </svg>
      </div>
    </figure>
  );
}

function cut(text: string, most: number): string {
  return text.length > most ? `${text.slice(0, Math.max(1, Math.floor(most) - 1))}…` : text;
}

// Where the stretches of each run begin, and how many there are.
function runsOf(page: PageData, stretches: {trajectory: string}[]) {
  const runs: {name: string; label: string; heldOut: boolean; first: number; count: number}[] = [];
  stretches.forEach(({trajectory}, i) => {
    const last = runs.at(-1);
    if (last?.name === trajectory) return ++last.count;
    const at = page.runs.findIndex(r => r.name === trajectory);
    return runs.push({name: trajectory, label: at < 0 ? trajectory : runLabel(page, at), heldOut: at >= 0 && page.runs[at].heldOut, first: i, count: 1});
  });
  return runs;
}
