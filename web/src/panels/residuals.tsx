// Of panel 4: the correlations of the errors with themselves and with the
// efforts, as `resid` draws them.
import {useState} from 'preact/hooks';
import type {CorrelogramData, ModelData, ResidualsData} from '../page_data';
import {XyChart, type Layer} from '../plots/xy_chart';
import {Choice} from './panel';

const kHow = 'Each segment predicts from its own initial state. Of errors that are white noise, 99 of 100 values are between the dashed lines. '
  + 'Autocorrelation beyond them: the model misses something. Correlation with an effort: what it misses comes with that effort, such as its gain or a delay.';

export function Residuals({model}: {model: ModelData}) {
  const {residuals} = model;
  if (!residuals?.channels.length) return null;
  return <Correlations key={model.id} model={model} residuals={residuals} />;
}

function Correlations({model, residuals: {channels, inputs}}: {model: ModelData; residuals: ResidualsData}) {
  const [c, setChannel] = useState(farthest(channels));
  const [i, setInput] = useState(farthest(inputs));
  const channel = channels[c], input = inputs[i];
  return (
    <div class="residuals">
      <h3>Are the errors white noise?</h3>
      <p class="how">{kHow}</p>
      <div class="grid-of-charts">
        <div>
          <Choice label="Channel" value={c} onChange={setChannel} options={channels.map((x, k) => ({value: k, text: x.channel}))} />
          <Correlogram title={`Autocorrelation of the errors of ${channel.channel}: ${model.title}`} xLabel="lag, s" data={channel} />
        </div>
        {input && <div>
          <Choice label="Channel and effort" value={i} onChange={setInput}
            options={inputs.map((x, k) => ({value: k, text: `${x.channel}, effort of ${x.input}`}))} />
          <Correlogram title={`Correlation of the errors of ${input.channel} with the effort of ${input.input}: ${model.title}`}
            xLabel="effort before error, s" data={input} />
        </div>}
      </div>
    </div>
  );
}

function Correlogram({title, xLabel, data}: {title: string; xLabel: string; data: CorrelogramData}) {
  const numbers = (values: (number | null)[]) => values.map(v => v ?? NaN);
  const value = numbers(data.value), band = numbers(data.band);
  const layers: Layer[] = [
    {label: '99 % of white noise', color: 'var(--quiet)', kind: 'line', dash: '5 4', x: data.lag_s, y: band},
    {label: '', color: 'var(--quiet)', kind: 'line', dash: '5 4', x: data.lag_s, y: band.map(b => -b)},
    {label: '', color: 'var(--first)', kind: 'line', size: 1, x: data.lag_s, y: value},
    {label: '', color: 'var(--first)', kind: 'points', x: data.lag_s, y: value},
  ];
  return <XyChart title={title} xLabel={xLabel} yLabel="correlation" layers={layers} rules={[{y: 0, label: ''}]} height={220} />;
}

// The place of what is farthest out of its band.
function farthest(all: CorrelogramData[]): number {
  const most = all.map(a => Math.max(0, ...a.value.map((v, k) => Math.abs(v ?? 0) / (a.band[k] || Infinity))));
  return Math.max(0, most.indexOf(Math.max(...most)));
}
