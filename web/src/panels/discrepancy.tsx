// Of panel 4: the two sources of error, the sensors' noise and what the model
// misses.
import {fmt, fmtUnit} from '../format';
import type {ModelData, PageData} from '../page_data';
import {DataTable, type Column} from './panel';

type Row = ModelData['discrepancy'][number];

export function Discrepancy({page, model}: {page: PageData; model: ModelData}) {
  if (!model.discrepancy.length) return null;
  const unitOf = (joint: string) => page.mechanism.joints.find(j => j.name === joint)?.unit ?? 'rad';
  const noiseOf = (joint: string) => model.channels.find(c => c.name === joint);
  const columns: Column<Row>[] = [
    {key: 'joint', name: 'joint', sort: d => d.joint, cell: d => d.joint},
    {key: 'noise', name: 'noise', number: true, sort: d => noiseOf(d.joint)?.noise ?? null, cell: d => {
      const channel = noiseOf(d.joint);
      return channel ? fmtUnit(channel.noise, channel.unit, 3) : '';
    }},
    {key: 'force', name: 'random force', number: true, sort: d => d.force_std, cell: d => fmtUnit(d.force_std, unitOf(d.joint) === 'm' ? 'N' : 'N m', 3)},
    {key: 'time', name: 'correlated over', unit: 's', number: true, sort: d => d.correlation_time_s, cell: d => fmt(d.correlation_time_s, 2)},
  ];
  return (
    <div class="discrepancy">
      <h3>Noise and discrepancy</h3>
      <p class="how">What the noise does not explain acts like a random force of this standard deviation. The standard errors of the parameters count both.</p>
      <DataTable caption={`Standard deviations; model: ${model.title}`} columns={columns} rows={model.discrepancy} rowKey={d => d.joint} />
    </div>
  );
}
