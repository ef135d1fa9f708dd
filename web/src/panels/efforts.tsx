// Of panel 4: what the inverse dynamics leave of the measured efforts.
import {useEffect, useMemo, useRef} from 'preact/hooks';
import {modelColor} from '../colors';
import {decode, interpolated, nearest, runLabel, type Numbers} from '../data';
import {fmt, fmtTime, fmtUnit, unitText} from '../format';
import type {EffortCurvesData, ModelData, PageData} from '../page_data';
import {TimePlot, type Curve} from '../plots/time_plot';
import {Legend} from '../plots/xy_chart';
import {cursor} from '../state';
import {DataTable, Empty, type Column} from './panel';

const kDash = [undefined, [5, 4]];
const kNoCuts: number[] = []; // one and the same: another would be drawn anew

type Joint = NonNullable<ModelData['efforts']>['joints'][number];

// `models`: the one that is seen, and that which it is compared with.
export function Efforts({page, r, models}: {page: PageData; r: number; models: number[]}) {
  const [model, other] = models.map(i => page.models[i]);
  const heldOut = page.runs[r].heldOut;
  const said = (heldOut ? model.holdoutEfforts : model.efforts) ?? model.efforts;
  if (!said) return null;
  const shown = models.filter(i => page.models[i].predictions[r]?.efforts);
  const joints = shown[0] === models[0] ? page.models[shown[0]].predictions[r].efforts!.curves.map(c => c.joint) : [];
  return (
    <div class="efforts">
      <h3>Efforts by the inverse dynamics</h3>
      <p class="how">Above: the measured effort of a joint, and the one that its measured motion needs of the model, by the equations of motion; below: what is left of it; all behind a low-pass filter whose cut-off (-3 dB) is {fmt(said.cutOff_hz, 3)} Hz. Noise of the measured motion leaves its part, too.</p>
      <DataTable caption={`What is left, in % of the rms of the measured effort; model: ${model.title}`} columns={columns(model, other)} rows={model.efforts?.joints ?? []} rowKey={j => j.joint} />
      <p class="shown"><strong>{runLabel(page, r)}</strong>{heldOut ? ', held out' : ', fitted'}</p>
      {joints.length ? <>
        <Legend layers={[{label: 'measured', color: 'var(--measured)'}, ...shown.map((i, k) => (
          {label: page.models[i].title, color: `var(${modelColor(i, shown[0])})`, dash: k ? '5 4' : undefined}))]} />
        <div class="grid-of-charts">
          {joints.map(joint => <JointEffort key={joint} page={page} r={r} models={shown} joint={joint} />)}
        </div>
      </> : <Empty>No efforts of this run can be compared: it is shorter than the filter, or a joint was not measured in it.</Empty>}
    </div>
  );
}

function columns(model: ModelData, other: ModelData | undefined): Column<Joint>[] {
  const of = (efforts: ModelData['efforts'] | undefined, joint: string) => efforts?.joints.find(j => j.joint === joint)?.percent ?? null;
  const percent = (key: string, name: string, efforts: ModelData['efforts'] | undefined): Column<Joint>[] => efforts ? [{
    key, name, unit: '%', number: true, sort: j => of(efforts, j.joint), cell: j => fmt(of(efforts, j.joint), 3)}] : [];
  return [
    {key: 'joint', name: 'joint', sort: j => j.joint, cell: j => j.joint},
    {key: 'rms', name: 'left, rms', number: true, sort: j => j.rms, cell: j => fmtUnit(j.rms, j.unit, 3)},
    ...percent('percent', 'left', model.efforts),
    ...percent('holdout', 'left, held-out runs', model.holdoutEfforts),
    ...percent('other', `left by ${other?.title}`, other?.efforts),
  ];
}

interface Drawn {
  times: Numbers;
  unit: string;
  efforts: Curve[]; // measured, and predicted by each model
  left: Curve[]; // by each model
}

function JointEffort({page, r, models, joint}: {page: PageData; r: number; models: number[]; joint: string}) {
  const drawn = useMemo(() => draw(page, r, models, joint), [page, r, models.join(), joint]);
  const unit = unitText(drawn.unit);
  return (
    <figure class="chart">
      <figcaption>{joint}</figcaption>
      <Readout drawn={drawn} />
      <TimePlot label={`effort, ${unit}`} times={drawn.times} curves={drawn.efforts} cuts={kNoCuts} height={150} timeAxis={false}
        description={`Effort of ${joint} over time, measured and predicted by the inverse dynamics`} />
      <TimePlot label={`left, ${unit}`} times={drawn.times} curves={drawn.left} cuts={kNoCuts} height={130} timeAxis
        description={`What is left of the effort of ${joint} over time`} />
    </figure>
  );
}

// Each model has a filter of its own: the second is drawn at the first's times.
function draw(page: PageData, r: number, models: number[], joint: string): Drawn {
  const all = models.map(i => page.models[i].predictions[r].efforts!);
  const times = decode(all[0].t);
  const first = curveOf(all[0], joint)!;
  const drawn: Drawn = {times, unit: first.unit, left: [],
    efforts: [{label: 'measured', color: '--measured', values: decode(first.measured), width: 2}]};
  all.forEach((efforts, k) => {
    const curve = curveOf(efforts, joint);
    if (!curve) return;
    const at = (values: Numbers) => k ? interpolated(decode(efforts.t), values, times) : values;
    const measured = at(decode(curve.measured)), values = at(decode(curve.predicted));
    const {title} = page.models[models[k]];
    drawn.efforts.push({label: title, color: modelColor(models[k], models[0]), dash: kDash[k], values});
    drawn.left.unshift({label: `left by ${title}`, color: modelColor(models[k], models[0]), values: measured.map((v, i) => v - values[i]), width: 1});
  });
  return drawn;
}

function curveOf(efforts: EffortCurvesData, joint: string) {
  return efforts.curves.find(c => c.joint === joint);
}

// The numbers at the cursor, as text.
function Readout({drawn}: {drawn: Drawn}) {
  const ref = useRef<HTMLParagraphElement>(null);
  useEffect(() => {
    const write = () => {
      const i = nearest(drawn.times, cursor.value), n = drawn.left.length;
      const parts = drawn.efforts.map((c, k) => {
        const value = `${c.label} ${fmtUnit(c.values[i], drawn.unit, 3)}`;
        return k ? `${value} (left ${fmtUnit(drawn.left[n - k].values[i], drawn.unit, 3)})` : value;
      });
      if (ref.current) ref.current.textContent = `at ${fmtTime(drawn.times[i])} s: ${parts.join('; ')}`;
    };
    write();
    return cursor.subscribe(write);
  }, [drawn]);
  return <p class="readout" ref={ref} />;
}
