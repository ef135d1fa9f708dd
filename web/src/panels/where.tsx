// Panel 4: where the model fails: in time, in the phase plane, by horizon, and
// as a force.
import {useMemo, useState} from 'preact/hooks';
import {cividis, errorFraction, kOkabeIto, modelColor} from '../colors';
import {
  candidateName, decode, errorMap, forceName, jointError, leastError, meanSquare, positionUnit, prediction, runLabel, tilt,
} from '../data';
import {forceLabel, list} from '../format';
import type {ForceData, JointData, ModelData, PageData} from '../page_data';
import {ErrorScale, HeatMap} from '../plots/heat_map';
import {XyChart, type Layer} from '../plots/xy_chart';
import {compared, current, joint, run, theme, useStore} from '../state';
import {Discrepancy} from './discrepancy';
import {Efforts} from './efforts';
import {Folds} from './folds';
import {forceLayers, kQuantities, lawsOf, quantityName} from './force_layers';
import {Choice, Empty, Panel} from './panel';
import {Residuals} from './residuals';

const kMapColumns = 100, kPhasePoints = 3000, kPhaseBins = 12, kLawsAtFirst = 2;

const kHow = 'Blue is the noise floor, or the least error where all are above it; yellow is the largest error. An error that comes with a speed, a position or an effort, and not at random, tells of what is missing; '
  + 'so does the shape of the force that would explain it.';

export function Where({page}: {page: PageData}) {
  const r = useStore(run), m = useStore(current), c = useStore(compared);
  const model = page.models[m];
  const map = useMemo(() => model.predictions[r] ? errorMap(page, m, r, kMapColumns) : null, [page, m, r]);
  return (
    <Panel id="where" title="4 Where" how={kHow} wide>
      {map ? <HeatMap map={map} title={`Error of ${runLabel(page, r)} by channel and time: ${model.title}`} />
        : <Empty>This model has no prediction of {runLabel(page, r)}.</Empty>}
      <div class="grid-of-charts">
        {page.mechanism.joints.length > 0 && <Phase page={page} m={m} r={r} />}
        <Horizon page={page} models={[m, ...(c !== null && c !== m ? [c] : [])]} />
      </div>
      <Folds page={page} models={[m, ...(c !== null && c !== m ? [c] : [])]} />
      <Discrepancy page={page} model={model} />
      <Residuals model={model} />
      <Efforts page={page} r={r} models={[m, ...(c !== null && c !== m ? [c] : [])]} />
      <Force page={page} model={model} />
    </Panel>
  );
}

function JointChoice({page}: {page: PageData}) {
  const j = useStore(joint);
  return <Choice label="Joint" value={j} onChange={v => joint.set(v)}
    options={page.mechanism.joints.map((x, i) => ({value: i, text: x.name}))} />;
}

function Phase({page, m, r}: {page: PageData; m: number; r: number}) {
  const j = useStore(joint);
  const data = page.mechanism.joints[j];
  const dark = useStore(theme) === 'dark';
  const {layers, min, max} = useMemo(() => phaseLayers(page, m, r, data, dark), [page, m, r, data, dark]);
  const [x, y] = data.type === 'spherical'
    ? ['tilt, rad', 'angular speed, rad/s'] : [`position, ${data.unit}`, `velocity, ${data.unit}/s`];
  return (
    <div>
      <div class="row"><JointChoice page={page} /><ErrorScale min={min} max={max} /></div>
      {layers.length
        ? <XyChart title={`Phase portrait of ${data.name}, coloured by its error`} xLabel={x} yLabel={y} layers={layers} ground />
        : <Empty>{data.name} was not predicted in this run, so that it has no phase portrait.</Empty>}
    </div>
  );
}

// One layer for each colour, so that thousands of points are a dozen paths.
function phaseLayers(page: PageData, m: number, r: number, data: JointData, dark: boolean): {layers: Layer[]; min: number; max: number} {
  const shown = page.models[m].predictions[r];
  if (!shown || !shown.q.length) return {layers: [], min: 1, max: 1};
  const error = jointError(page, m, r, data.name);
  const n = error.length;
  const spherical = data.type === 'spherical';
  const q = shown.q.slice(data.q, data.q + (spherical ? 4 : 1)).map(decode);
  const qd = shown.qd.slice(data.v, data.v + (spherical ? 3 : 1)).map(decode);
  const min = leastError(error);
  let max = 1;
  for (const e of error) if (e > max) max = e;
  const bins = Array.from({length: kPhaseBins}, () => ({x: [] as number[], y: [] as number[]}));
  const grey = {x: [] as number[], y: [] as number[]};
  const every = Math.max(1, Math.ceil(n / kPhasePoints));
  for (let i = 0; i < n; i += every) {
    const x = spherical ? tilt(q[0][i], q[1][i]) : q[0][i];
    const y = spherical ? Math.hypot(qd[0][i], qd[1][i], qd[2][i]) : qd[0][i];
    const f = errorFraction(error[i], max, min);
    const bin = Number.isNaN(error[i]) ? grey : bins[Math.min(kPhaseBins - 1, Math.floor(f * kPhaseBins))];
    bin.x.push(x);
    bin.y.push(y);
  }
  const layers: Layer[] = bins.map((b, i) => ({
    label: '', color: cividis((i + 0.5) / kPhaseBins, dark), kind: 'points' as const, size: 4, ...b}));
  return {layers: [{label: '', color: '#999', kind: 'points' as const, size: 3, ...grey}, ...layers]
    .filter(l => l.x.length), min, max};
}

const kNoiseHow = 'Noise is in the states from which the model predicts, too, and what is wrong with them grows with the motion’s own sensitivity, in chaos many times over. '
  + 'The dotted curve is what that alone would make of the error (estimated from a few draws). A complete model stays near it; what rises clearly above it tells of something missing.';
const kNoNoiseHow = 'Even a complete model rises above the noise, by the motion’s own sensitivity to the states from which it predicts: compare models, not one with the noise.';

function Horizon({page, models}: {page: PageData; models: number[]}) {
  const layers: Layer[] = [], without: string[] = [];
  models.forEach((index, k) => {
    const {title, horizon} = page.models[index];
    if (!horizon.length) return without.push(title);
    layers.push({
      label: title, color: `var(${modelColor(index, models[0])})`, kind: 'line', dash: k ? '6 4' : undefined,
      x: horizon.map(h => h.horizon_s), y: horizon.map(h => h.rms),
    });
  });
  const noise = page.models[models[0]].horizon.filter(h => h.noise_rms !== null && h.noise_rms !== undefined);
  if (layers.length && noise.length) {
    layers.push({label: `${page.models[models[0]].title}: what noise alone would make`, color: 'var(--quiet)', kind: 'line', dash: '2 3',
      x: noise.map(h => h.horizon_s), y: noise.map(h => h.noise_rms!)});
  }
  const gap = without.length > 0 && `There is no error against the horizon of ${list(without.map(t => `“${t}”`))}.`;
  if (!layers.length) return <Empty>{gap} sysid_diagnose and sysid_fit --out give it for the models with which they begin and end.</Empty>;
  return (
    <XyChart title="Error against how far ahead the model predicts" xLabel="horizon, s"
      yLabel={`rms error, ${positionUnit(page)}`} layers={layers} logX logY
      rules={[{y: page.noise, label: 'noise'}]}>
      <p class="note">{noise.length ? kNoiseHow : kNoNoiseHow}{gap && ` ${gap}`}</p>
    </XyChart>
  );
}

function Force({page, model}: {page: PageData; model: ModelData}) {
  const places = useMemo(() => [...new Set(model.force.map(forceName))], [model]);
  const [chosen, setChosen] = useState('');
  const preferred = strongest(model.force);
  const place = places.includes(chosen) ? chosen : preferred;
  const laws = useMemo(() => place ? lawsOf(model, place) : [], [model, place]);
  const [picked, setPicked] = useState<string[] | null>(null);
  if (!place) {
    return <Empty>The force that would explain the error was not asked for here: {page.program === 'sysid_fit'
      ? 'sysid_diagnose with the same flags finds it.' : 'sysid_diagnose finds it where the model fails.'}</Empty>;
  }
  const names = laws.map(candidateName);
  const on = (picked ?? names.slice(0, kLawsAtFirst)).filter(n => names.includes(n));
  const toggle = (name: string) =>
    setPicked(on.includes(name) ? on.filter(n => n !== name) : [...on, name]);
  return (
    <div>
      <h3>The force that would explain the error</h3>
      <p class="how">Dots are the generalised force that the model lacks, knot by knot of its smooth estimate (bars: one standard deviation); lines are what the chosen effects would add with their expected parameters. The right law lies on the dots.</p>
      <div class="row">
        <Choice label="Joint" value={place} onChange={setChosen} options={places.map(p => ({value: p, text: p}))} />
        <fieldset><legend>Laws</legend>
          {laws.map((c, i) => {
            const name = candidateName(c);
            return <label key={name}><input type="checkbox" checked={on.includes(name)} onChange={() => toggle(name)} />
              <span class="swatch" style={{background: kOkabeIto[(i + 1) % kOkabeIto.length]}} aria-hidden="true" />
              {name} <span class="note">{c.law}; {prediction(model, c)}</span></label>;
          })}
          {!laws.length && 'no candidate acts on this joint by a force'}
        </fieldset>
      </div>
      <div class="grid-of-charts">
        {kQuantities.map(quantity => {
          const layers = forceLayers(model, place, quantity, laws.filter(c => on.includes(candidateName(c))), laws);
          return layers
            ? <XyChart key={quantity} title={`Unexplained force of ${place} against ${quantity}`}
                xLabel={quantityName(page, model, place, quantity)} yLabel={forceLabel(unitOf(model, place))} layers={layers} rules={[{y: 0, label: ''}]} />
            : <Empty key={quantity}>No {quantity} of {place} was recorded, so that nothing can be drawn against it.</Empty>;
        })}
      </div>
    </div>
  );
}

function unitOf(model: ModelData, place: string): string {
  return model.force.find(f => forceName(f) === place)?.unit ?? '';
}

function strongest(force: ForceData[]): string | undefined {
  let best: string | undefined, most = -1;
  for (const f of force) {
    const power = meanSquare(f.value);
    if (power > most) [best, most] = [forceName(f), power];
  }
  return best;
}
