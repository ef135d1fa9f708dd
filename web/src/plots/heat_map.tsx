// Where the error is: a row for each channel, a column for each piece of time.
import {cividis, errorFraction} from '../colors';
import type {ErrorMap} from '../data';
import {fmtTicks, fmtTime, fmtTimes} from '../format';
import {cursor, setCursor, theme, timeKey, useStore} from '../state';
import {scaleOf} from './axes';
import {useWidth} from './xy_chart';

const kRow = 30, kBottom = 40, kRight = 10;

export function HeatMap({map, title}: {map: ErrorMap; title: string}) {
  const {ref, width} = useWidth(600);
  const dark = useStore(theme) === 'dark';
  const longest = Math.max(...map.rows.map(r => r.length), 4);
  const left = Math.min(200, 20 + longest * 7.2);
  const w = width - left - kRight, h = map.rows.length * kRow;
  const [t0, t1] = [map.edges[0], map.edges[map.edges.length - 1]];
  const px = (t: number) => left + (t - t0) / (t1 - t0 || 1) * w;
  const time = (e: MouseEvent) => {
    const box = (e.currentTarget as Element).getBoundingClientRect();
    return t0 + (e.clientX - box.left) / box.width * (t1 - t0);
  };
  const ticks = scaleOf([t0, t1], false).ticks.filter(t => t >= t0 && t <= t1);
  const tickNames = fmtTicks(ticks);
  return (
    <figure class="chart">
      <figcaption>{title}</figcaption>
      <ErrorScale min={map.min} max={map.max} />
      <div ref={ref} tabIndex={0} role="group" onKeyDown={timeKey}
        aria-label={`${title}. Arrow keys move the time cursor.`}>
        <svg width={width} height={h + kBottom} viewBox={`0 0 ${width} ${h + kBottom}`} role="img" aria-label={title}>
          {map.cells.map((row, r) => <g key={r}>
            <text x={left - 6} y={r * kRow + kRow / 2 + 4} text-anchor="end">{map.rows[r]}</text>
            {row.map((v, c) => Number.isFinite(v) && (
              <rect key={c} x={px(map.edges[c])} y={r * kRow + 1} width={w / row.length + 0.5} height={kRow - 2}
                fill={cividis(errorFraction(v, map.max, map.min), dark)}>
                <title>{`${map.rows[r]}, ${fmtTime(map.edges[c])} s to ${fmtTime(map.edges[c + 1])} s: ${fmtTimes(v)}`}</title>
              </rect>
            ))}
          </g>)}
          {ticks.map((t, i) => <text key={t} x={px(t)} y={h + 16} text-anchor="middle">{tickNames[i]}</text>)}
          <text x={left + w / 2} y={h + 34} text-anchor="middle">t, s</text>
          <CursorMark px={px} height={h} />
          <rect class="catcher" x={left} y={0} width={w} height={h}
            onClick={e => setCursor(time(e))} />
        </svg>
      </div>
    </figure>
  );
}

function CursorMark({px, height}: {px: (t: number) => number; height: number}) {
  const x = px(useStore(cursor));
  return <line class="cursor-mark" x1={x} x2={x} y1={0} y2={height} />;
}

// The colours of errors, from the noise floor up, or from the least of them.
export function ErrorScale({min, max}: {min: number; max: number}) {
  const steps = Array.from({length: 24}, (_, i) => i / 23);
  const top = Math.max(max, 2 * min);
  const dark = useStore(theme) === 'dark';
  return (
    <p class="scale">
      <span>≤ {fmtTimes(min)}</span>
      <svg width="120" height="12" aria-hidden="true">
        {steps.map((f, i) => <rect key={i} x={i * 5} y={0} width={5.5} height={12} fill={cividis(f, dark)} />)}
      </svg>
      <span>{fmtTimes(top)} (logarithmic)</span>
    </p>
  );
}
