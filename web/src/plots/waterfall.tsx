// How the error falls from step to step, as bars: what is left, and above it,
// outlined, what the step took away. Logarithmic, so that a fall from 64 to 1
// leaves a bar.
import {fmt, fmtError} from '../format';
import {scaleOf} from './axes';
import {Legend, useWidth} from './xy_chart';

export interface Fall {
  title: string;
  train: number | null;
  holdout: number | null;
  predicted: number | null;
  trainBefore: number | null;
  holdoutBefore: number | null;
}

const kLeft = 58, kTop = 12, kHeight = 260, kBottom = 48;
const kBottomError = 0.5; // × noise, or below the smallest
const kTrain = '#0072B2', kHoldout = '#E69F00', kPredicted = 'var(--ink)';

export function Waterfall({falls}: {falls: Fall[]}) {
  const {ref, width} = useWidth(600);
  const values = falls.flatMap(f => [f.train, f.holdout, f.predicted, f.trainBefore, f.holdoutBefore])
    .filter((v): v is number => v !== null);
  const scale = scaleOf(values, true, [kBottomError, 2]);
  const h = kHeight - kTop - kBottom, w = width - kLeft - 12;
  const py = (v: number) => kTop + (1 - Math.max(0, scale.at(v))) * h;
  const foot = kTop + h;
  const slot = Math.min(w / falls.length, 220);
  const bar = Math.min(44, slot * 0.3);
  const column = (x: number, value: number | null, before: number | null, color: string, hatch: boolean) =>
    value !== null && <>
      {before !== null && before > value &&
        <rect x={x} y={py(before)} width={bar} height={py(value) - py(before)} fill="none" stroke={color} stroke-dasharray="4 3" />}
      <rect x={x} y={py(value)} width={bar} height={foot - py(value)} fill={color} />
      {hatch && <rect x={x} y={py(value)} width={bar} height={foot - py(value)} fill="url(#hatch)" />}
      <text x={x + bar / 2} y={py(value) - 4} text-anchor="middle">{fmtError(value)}</text>
    </>;
  return (
    <figure class="chart">
      <figcaption>Error after each step, × noise (logarithmic)</figcaption>
      <Legend layers={[
        {label: 'fitted runs', color: kTrain}, {label: 'held out (hatched)', color: kHoldout},
        ...(falls.some(f => f.predicted !== null) ? [{label: 'predicted before the refit', color: kPredicted, kind: 'points'}] : []),
      ]} />
      <div ref={ref}>
        <svg width={width} height={kHeight} viewBox={`0 0 ${width} ${kHeight}`} role="img"
          aria-label="Bars of the error after each step; the table below has the numbers">
          <defs>
            <pattern id="hatch" width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">
              <line x1="0" x2="0" y1="0" y2="6" stroke="#fff" stroke-width="2" />
            </pattern>
          </defs>
          {scale.ticks.map(t => <g key={t}>
            <line class="grid" x1={kLeft} x2={kLeft + w} y1={py(t)} y2={py(t)} />
            <text x={kLeft - 6} y={py(t) + 4} text-anchor="end">{fmt(t)}</text>
          </g>)}
          <line class="rule" x1={kLeft} x2={kLeft + w} y1={py(1)} y2={py(1)} />
          <text class="rule-label" x={kLeft + w - 2} y={py(1) - 4} text-anchor="end">noise floor</text>
          <text transform={`translate(14 ${kTop + h / 2}) rotate(-90)`} text-anchor="middle">error, × noise</text>
          {falls.map((f, i) => {
            const x = kLeft + i * slot + (slot - 2 * bar - 6) / 2;
            return <g key={i}>
              {column(x, f.train, f.trainBefore, kTrain, false)}
              {column(x + bar + 6, f.holdout, f.holdoutBefore, kHoldout, true)}
              {f.predicted !== null && <path d={`M${x - 9} ${py(f.predicted)}l5 -5l5 5l-5 5z`} fill={kPredicted} />}
              <StepName x={kLeft + (i + 0.5) * slot} y={kHeight - kBottom + 18} text={f.title} width={slot} />
            </g>;
          })}
        </svg>
      </div>
    </figure>
  );
}

// On two lines at the @ where it is long.
function StepName({x, y, text, width}: {x: number; y: number; text: string; width: number}) {
  const most = Math.max(6, Math.floor(width / 6.6));
  const cut = (s: string) => s.length > most ? s.slice(0, most - 1) + '…' : s;
  const at = text.indexOf('@');
  const lines = text.length > most && at > 0 ? [text.slice(0, at), text.slice(at)] : [text];
  return (
    <text x={x} y={y} text-anchor="middle">
      <title>{text}</title>
      {lines.map((l, i) => <tspan key={i} x={x} dy={i ? 15 : 0}>{cut(l)}</tspan>)}
    </text>
  );
}
