// Panel 2: measured against predicted, and the residual below it.
import {useEffect, useMemo, useRef} from 'preact/hooks';
import {modelColor} from '../colors';
import {channelLabel, decode, nearest, runLabel, type Numbers} from '../data';
import {fmt, fmtTime, fmtUnit} from '../format';
import type {PageData} from '../page_data';
import {compared, current, cursor, run, useStore} from '../state';
import {TimePlot, type Curve} from '../plots/time_plot';
import {Legend} from '../plots/xy_chart';
import {Empty, Panel} from './panel';

const how = (joined: boolean) => `Above: what was measured and what the model predicts, ${joined
  ? 'as one trajectory (the segments of its fit, which are joined, are shaded in turn)' : 'each segment from a state of its own (segments are shaded in turn)'}. `
  + 'Below: the residual in units of the noise; a good model stays within the band of ± 2. '
  + 'Drag over a curve to zoom all of them, double-click for the whole run, Ctrl and wheel zooms.';

const kHeading = 'z_x, z_y and z_z are the parts of a link’s heading: of the unit vector along it, in the axes of its joint. They have no unit.';

export function Compare({page}: {page: PageData}) {
  const r = useStore(run), m = useStore(current), c = useStore(compared);
  const pair = useMemo(() => [m, ...(c !== null && c !== m ? [c] : [])], [m, c]);
  const shown = page.runs[r];
  const legend = [
    {label: 'measured', color: 'var(--measured)'},
    {label: page.models[m].title, color: `var(${modelColor(m)})`},
    ...(pair.length > 1 ? [{label: page.models[pair[1]].title, color: `var(${modelColor(pair[1], m)})`, dash: '5 4'}] : []),
  ];
  const missing = pair.some(i => !page.models[i].predictions[r]);
  return (
    <Panel id="compare" title="2 Compare" how={how(page.models[m].joined)}>
      <p class="shown"><strong>{runLabel(page, r)}</strong>{shown.heldOut ? ', held out' : ', fitted'}</p>
      {shown.channels.some(x => x.components[0] === 'z_x') && <p class="note">{kHeading}</p>}
      <Legend layers={legend} />
      {missing ? <Empty>This model has no prediction of {shown.name}: fit it again with {page.program} --out.</Empty>
        : shown.channels.map((channel, i) => channel.components.map((component, k) => (
          <Channel key={`${r}/${i}/${k}`} page={page} r={r} pair={pair} channel={i} component={k}
            name={channel.components.length > 1 ? `${channelLabel(channel)} ${component}` : channelLabel(channel)}
            last={i === shown.channels.length - 1 && k === channel.components.length - 1} />
        )))}
    </Panel>
  );
}

const kDash = [undefined, [5, 4]];

function Channel({page, r, pair, channel, component, name, last}: {
  page: PageData; r: number; pair: number[]; channel: number; component: number; name: string; last: boolean;
}) {
  const data = useMemo(() => {
    const source = page.runs[r].channels[channel];
    const parts = pair.map(i => page.models[i].predictions[r].channels[channel]);
    const predicted: Curve[] = parts.map((p, i) => ({
      label: page.models[pair[i]].title, color: modelColor(pair[i], pair[0]), dash: kDash[i],
      values: decode(p.predicted[component]),
    }));
    const residual: Curve[] = parts.map((p, i) => ({
      label: `residual of ${page.models[pair[i]].title}`, color: modelColor(pair[i], pair[0]),
      values: decode(p.residual[component]), width: 1,
    }));
    return {
      times: decode(page.runs[r].t),
      cuts: page.models[pair[0]].predictions[r].cuts,
      values: [
        {label: 'measured', color: '--measured', values: decode(source.measured[component]), dots: true, width: 2},
        ...predicted,
      ] as Curve[],
      residual: [...residual].reverse(),
    };
  }, [page, r, pair, channel, component]);
  const unit = page.runs[r].channels[channel].unit;
  return (
    <div class="channel">
      <h3>{name}</h3>
      <Readout data={data} unit={unit} />
      <TimePlot label={unit === '-' ? 'value, no unit' : `value, ${unit}`} times={data.times} curves={data.values} cuts={data.cuts}
        height={150} timeAxis={false} description={`${name} over time, measured and predicted`} />
      <TimePlot label="residual, × noise" times={data.times} curves={data.residual} cuts={data.cuts} band={2}
        height={last ? 146 : 116} timeAxis={last} description={`Residual of ${name} over time, in units of the noise`} />
    </div>
  );
}

// The numbers at the cursor, as text.
function Readout({data, unit}: {
  data: {times: Numbers; values: Curve[]; residual: Curve[]}; unit: string;
}) {
  const ref = useRef<HTMLParagraphElement>(null);
  useEffect(() => {
    const write = () => {
      const i = nearest(data.times, cursor.value);
      const n = data.residual.length;
      const parts = data.values.map((c, k) => {
        const value = fmtUnit(c.values[i], unit, 4);
        if (k === 0) return `measured ${value}`;
        return `${c.label} ${value} (${fmt(data.residual[n - k].values[i], 3)} × noise)`;
      });
      if (ref.current) ref.current.textContent = `at ${fmtTime(data.times[i])} s: ${parts.join('; ')}`;
    };
    write();
    return cursor.subscribe(write);
  }, [data]);
  return <p class="readout" ref={ref} />;
}
