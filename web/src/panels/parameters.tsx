// Panel 7: what was estimated, how well, and how the solvers got there.
import {useState} from 'preact/hooks';
import {diverging, kOkabeIto} from '../colors';
import {fmt, list, unitText} from '../format';
import type {ModelData, PageData, ParameterData} from '../page_data';
import {XyChart} from '../plots/xy_chart';
import {current, useStore} from '../state';
import {Choice, DataTable, Empty, Panel, type Column} from './panel';

const kHow = 'Where the interval is narrow, the data determine the parameter. One at its bound was stopped by it. Two parameters whose correlation is near 1 or -1 can be exchanged for each other: only their combination is known.';

const kColumns: Column<ParameterData>[] = [
  {key: 'name', name: 'parameter', sort: p => p.name, cell: p => <>{p.name}{p.ofEffect && <span class="law">of {p.ofEffect}</span>}</>},
  {key: 'unit', name: 'unit', cell: p => unitText(p.unit) || '–'},
  {key: 'initial', name: 'start', number: true, sort: p => p.initial, cell: p => fmt(p.initial)},
  {key: 'value', name: 'value', number: true, sort: p => p.value, cell: p => fmt(p.value, 6)},
  {key: 'std', name: 'standard error', number: true, sort: p => p.stdError, cell: p => fmt(p.stdError, 2)},
  {key: 'ci', name: '95 % interval', number: true, cell: p => p.ci95[0] === null && p.ci95[1] === null ? '–' : `${fmt(p.ci95[0], 6)} to ${fmt(p.ci95[1], 6)}`},
  {key: 'bounds', name: 'bounds', number: true, cell: p => bounds(p)},
  {key: 'state', name: 'remark', cell: p => [
    p.atBound && 'at its bound', !p.identifiable && 'not determined by the data'].filter(Boolean).join(', ') || '–'},
];

function bounds(p: ParameterData): string {
  if (p.lower === null && p.upper === null) return 'none';
  if (p.lower === null) return `up to ${fmt(p.upper)}`;
  return p.upper === null ? `from ${fmt(p.lower)}` : `${fmt(p.lower)} to ${fmt(p.upper)}`;
}

export function Parameters({page}: {page: PageData}) {
  const model = page.models[useStore(current)];
  return (
    <Panel id="parameters" title="7 Parameters" how={kHow} wide>
      {model.parameters.length
        ? <DataTable caption={`Parameters; model: ${model.title}`} columns={kColumns} rows={model.parameters} rowKey={p => p.name} />
        : <Empty>Nothing was free in this fit: --free names what to fit.</Empty>}
      {model.notIdentifiable.map(g => <p class="doubt" key={g.join()}>The data do not tell {list(g)} {g.length > 1 ? 'apart: only a combination of them is known' : 'at all'}.</p>)}
      <div class="grid-of-charts">
        <Correlation model={model} />
        <Convergence model={model} />
      </div>
    </Panel>
  );
}

function Correlation({model}: {model: ModelData}) {
  const names = model.correlationNames;
  if (names.length < 2) return <Empty>A correlation needs two parameters that the data determine.</Empty>;
  return (
    <div class="table-scroll"><table class="matrix">
      <caption>Correlation of the estimates (no unit; blue negative, orange positive)</caption>
      <thead><tr><td />{names.map(n => <th scope="col" key={n}><span>{n}</span></th>)}</tr></thead>
      <tbody>{names.map((n, i) => <tr key={n}>
        <th scope="row">{n}</th>
        {names.map((other, k) => {
          const v = model.correlation[i]?.[k] ?? null;
          return <td key={other} title={`${n} and ${other}: ${fmt(v, 3)}`}
            style={v === null ? {} : {background: diverging(v), color: v < -0.55 ? '#fff' : '#000'}}>{v === null ? '–' : v.toFixed(2)}</td>;
        })}
      </tr>)}</tbody>
    </table></div>
  );
}

function Convergence({model}: {model: ModelData}) {
  const [over, setOver] = useState<'iteration' | 'time_s'>('iteration');
  const histories = model.histories.filter(h => h.points.length > 0);
  if (!histories.length) return <Empty>The course of the fit was not kept.</Empty>;
  const solvers = histories.map(h => h.solver);
  return (
    <div>
      <Choice label="Over" value={over} onChange={setOver} options={[
        {value: 'iteration', text: 'iterations'}, {value: 'time_s', text: 'time'}]} />
      <XyChart title={`Convergence: ${list(solvers)}`} logY
        xLabel={over === 'iteration' ? 'iteration' : 'time, s'} yLabel="cost, no unit"
        layers={histories.map((h, i) => ({
          label: h.solver, color: kOkabeIto[i % kOkabeIto.length], kind: 'line' as const, dash: i ? `${4 + 3 * i} 3` : undefined,
          x: h.points.map(p => p[over]), y: h.points.map(p => p.cost),
        }))}>
        <p class="note">{model.termination}{solvers.length < 2 && ' sysid_compare runs Adam beside it.'}</p>
      </XyChart>
    </div>
  );
}
