// What all panels share: the run, the models, the time cursor.
import {duration, runLabels} from '../data';
import {fmtRange} from '../format';
import type {PageData} from '../page_data';
import {
  compared, current, cursor, panBy, playing, run, setCursor, setRun, setZoom,
  speed, useStore, zoom, zoomBy,
} from '../state';
import {Choice} from './panel';

export function Controls({page}: {page: PageData}) {
  const r = useStore(run), m = useStore(current), c = useStore(compared);
  const names = runLabels(page.runs.map(x => x.name));
  const models = page.models.map((model, i) => ({value: i, text: model.title}));
  return (
    <div class="controls" role="region" aria-label="What is shown">
      <Choice label="Run" value={r} onChange={setRun}
        options={page.runs.map((x, i) => ({value: i, text: x.heldOut ? `${names[i]} (held out)` : names[i], title: x.name}))} />
      <Choice label="Model" value={m} options={models} onChange={v => current.set(v)} />
      <Choice label="Compared with" short="and" value={c ?? -1} onChange={v => compared.set(v < 0 ? null : v)}
        options={[{value: -1, text: 'none'}, ...models]} />
      <Playback page={page} r={r} />
      <span class="buttons" role="group" aria-label="Zoom in time">
        <button type="button" onClick={() => zoomBy(0.5)} title="Zoom in around the cursor (+)" aria-label="Zoom in">+</button>
        <button type="button" onClick={() => zoomBy(2)} title="Zoom out (-)" aria-label="Zoom out">−</button>
        <button type="button" onClick={() => panBy(-0.5)} aria-label="Earlier">◀</button>
        <button type="button" onClick={() => panBy(0.5)} aria-label="Later">▶</button>
        <button type="button" onClick={() => setZoom(null)} title="The whole run (0)" aria-label="Whole run">All</button>
      </span>
      <ZoomRange page={page} r={r} />
    </div>
  );
}

function ZoomRange({page, r}: {page: PageData; r: number}) {
  const range = useStore(zoom) ?? duration(page.runs[r]);
  return <output class="zoom-range" aria-label="Times shown">{fmtRange(range[0], range[1])}</output>;
}

function Playback({page, r}: {page: PageData; r: number}) {
  const t = useStore(cursor), on = useStore(playing), v = useStore(speed);
  const [t0, t1] = duration(page.runs[r]);
  return (
    <span class="playback">
      <button type="button" onClick={() => playing.set(!on)} aria-pressed={on} class="play">{on ? 'Pause' : 'Play'}</button>
      <label class="choice slider"><span class="hidden">Time</span>
        <input type="range" min={t0} max={t1} step={(t1 - t0) / 1000 || 1} value={t}
          aria-valuetext={`${t.toFixed(2)} s`}
          onInput={e => setCursor(Number((e.currentTarget as HTMLInputElement).value))} />
      </label>
      <output class="time" aria-label="Time cursor">{t.toFixed(2)} s</output>
      <Choice label="Speed" short="" value={v} onChange={x => speed.set(x)}
        options={[0.1, 0.25, 0.5, 1, 2, 5, 20].map(x => ({value: x, text: `${x} ×`}))} />
    </span>
  );
}
