// Panel 7: what was estimated, how well, and how the solvers got there.
import {useState} from 'preact/hooks';
import {diverging, kOkabeIto} from '../colors';
import {inStages} from '../data';
import {fmt, list, sentence, unitText} from '../format';
import type {ModelData, PageData, ParameterData} from '../page_data';
import {XyChart} from '../plots/xy_chart';
import {compared, current, theme, useStore} from '../state';
import {Ellipses} from './ellipses';
import {Choice, DataTable, Empty, Panel, type Column} from './panel';

const kHow = 'Where the interval is narrow, the data determine the parameter. One at its bound was stopped by it. Two parameters whose correlation is near 1 or -1 can be exchanged for each other: only their combination is known.';

const kColumns: Column<ParameterData>[] = [
  {key: 'name', name: 'parameter', sort: p => p.name, cell: p => <>{p.name}{p.ofEffect && <span class="law">of {p.ofEffect}</span>}</>},
  {key: 'unit', name: 'unit', cell: p => unitText(p.unit) || '–'},
  {key: 'initial', name: 'start', number: true, sort: p => p.initial, cell: p => fmt(p.initial)},
  {key: 'value', name: 'value', number: true, sort: p => p.value, cell: p => fmt(p.value, 6)},
  {key: 'std', name: 'standard error', number: true, sort: p => p.stdError, cell: p => fmt(p.stdError, 2)},
  {key: 'ci', name: '95 % interval', number: true, cell: p => interval(p)},
  {key: 'bounds', name: 'bounds', number: true, cell: p => bounds(p)},
  {key: 'state', name: 'remark', cell: p => [
    p.atBound && 'at its bound', !p.identifiable && 'not identifiable'].filter(Boolean).join(', ') || '–'},
];

// Within the bounds, which the estimate cannot leave.
export function interval({ci95: [low, high], lower, upper}: Pick<ParameterData, 'ci95' | 'lower' | 'upper'>) {
  if (low === null && high === null) return '–';
  const cutLow = low !== null && lower !== null && low < lower;
  const cutHigh = high !== null && upper !== null && high > upper;
  return <>{fmt(cutLow ? lower : low, 6)} to {fmt(cutHigh ? upper : high, 6)}
    {(cutLow || cutHigh) && <span class="note">cut at its bound{cutLow && cutHigh ? 's' : ''}</span>}</>;
}

function bounds(p: ParameterData): string {
  if (p.lower === null && p.upper === null) return 'none';
  if (p.lower === null) return `up to ${fmt(p.upper)}`;
  return p.upper === null ? `from ${fmt(p.lower)}` : `${fmt(p.lower)} to ${fmt(p.upper)}`;
}

export function Parameters({page}: {page: PageData}) {
  const m = useStore(current), c = useStore(compared);
  const model = page.models[m];
  return (
    <Panel id="parameters" title="7 Parameters" how={kHow} wide>
      {model.parameters.length
        ? <DataTable caption={`Parameters; model: ${model.title}`} columns={kColumns} rows={model.parameters} rowKey={p => p.name} />
        : <Empty>Nothing was free in this fit: --free names what to fit.</Empty>}
      {model.notIdentifiable.map(g => <p class="doubt" key={g.join()}>{list(g)} {g.length > 1 ? 'are not separately identifiable from this data: only a combination of them is' : 'is not identifiable from this data'}.</p>)}
      <div class="grid-of-charts">
        <Correlation model={model} />
        <Ellipses page={page} models={[m, ...(c !== null && c !== m ? [c] : [])]} />
        <Convergence model={model} />
      </div>
    </Panel>
  );
}

const kMostBeside = 3; // more need the width of the page

function Correlation({model}: {model: ModelData}) {
  const names = model.correlationNames;
  const dark = useStore(theme) === 'dark';
  if (names.length < 2) return <Empty>A correlation needs two parameters that the data determine.</Empty>;
  return (
    <div class={names.length > kMostBeside ? 'table-scroll across' : 'table-scroll'}><table class="matrix">
      <caption>Correlation of the estimates (no unit; blue negative, orange positive)</caption>
      <thead><tr><td />{names.map(n => <th scope="col" key={n}><span>{n}</span></th>)}</tr></thead>
      <tbody>{names.map((n, i) => <tr key={n}>
        <th scope="row">{n}</th>
        {names.map((other, k) => {
          const v = model.correlation[i]?.[k] ?? null;
          return <td key={other} title={`${n} and ${other}: ${fmt(v, 3)}`}
            style={v === null ? {} : {background: diverging(v, dark), color: dark || v < -0.55 ? '#fff' : '#000'}}>{v === null ? '–' : v.toFixed(2)}</td>;
        })}
      </tr>)}</tbody>
    </table></div>
  );
}

const kStages = 'The line breaks where the next stage begins, of longer segments or of more tightly joined ones: its cost is another, and usually a higher one. Within a stage it falls.';

function Convergence({model}: {model: ModelData}) {
  const [over, setOver] = useState<'iteration' | 'time_s'>('iteration');
  const histories = model.histories.filter(h => h.points.length > 0);
  if (!histories.length) return <Empty>The course of the fit was not kept.</Empty>;
  const courses = histories.map(h => inStages(h.solver, h.points));
  const solvers = histories.map(h => h.solver);
  return (
    <div>
      <Choice label="Over" value={over} onChange={setOver} options={[
        {value: 'iteration', text: 'iterations'}, {value: 'time_s', text: 'time'}]} />
      <XyChart title={`Convergence: ${list(solvers)}`} logY
        xLabel={over === 'iteration' ? 'iteration' : 'time, s'} yLabel="cost, no unit"
        layers={courses.map((points, i) => ({
          label: histories[i].solver, color: kOkabeIto[i % kOkabeIto.length], kind: 'line' as const, dash: i ? `${4 + 3 * i} 3` : undefined,
          x: points.map(p => p[over]), y: points.map(p => p.cost),
        }))}>
        {courses.some((c, i) => c.length > histories[i].points.length) && <p class="note">{kStages}</p>}
        <p class="note">{sentence(model.termination)}{solvers.length < 2 && ' sysid_compare runs Adam beside it.'}</p>
      </XyChart>
    </div>
  );
}
