// Of panel 5: formulas for a force that no effect of the catalogue explains.
import {fmt, fmtError, fmtUnit, list, unitText} from '../format';
import type {ModelData, ProposalData} from '../page_data';
import {Command, DataTable, type Column} from './panel';

const kHow = 'No effect of the catalogue explains what is missing, but these formulas of what was measured do. They are read off the data and say nothing of a cause: look for a physical law of such a shape.';

const kColumns: Column<ProposalData>[] = [
  {key: 'formula', name: 'formula', cell: p => <ul class="plain">{p.effects.map(e => <li key={e}><code>{e}</code></li>)}</ul>},
  {key: 'values', name: 'values', unit: '± 95 %', cell: p => <ul class="plain">{p.parameters.map(v => <li key={v.name}>{v.name} {fmt(v.value)}{' '}
    <span class="whole">{v.stdError !== null && `± ${fmt(1.96 * v.stdError, 2)} `}{unitText(v.unit)}</span></li>)}</ul>},
  {key: 'error', name: 'error', unit: '× noise', number: true, sort: p => p.crossValidatedError, cell: p => fmtError(p.crossValidatedError)},
  {key: 'holdout', name: 'held out', unit: '× noise', number: true, sort: p => p.holdoutError, cell: p => fmtError(p.holdoutError)},
];

export function Proposals({model}: {model: ModelData}) {
  const proposals = model.proposals ?? [];
  if (!proposals.length) return null;
  const lengths = [...new Set(proposals.map(p => fmtUnit(p.segment_s, 's', 3)))];
  return (
    <div class="proposals">
      <h3>Formulas for what is missing</h3>
      <p class="how">{kHow}</p>
      <DataTable caption={`Formulas, the best first; errors of data that the values were not fitted to, over segments of ${list(lengths)}`}
        columns={kColumns} rows={proposals} rowKey={p => p.effects.join()} />
      <p>To try the first:</p>
      <Command text={proposals[0].command} label="command that adds the first formula" />
    </div>
  );
}
