// A small chart of points and lines (SVG): prints sharply, follows the theme.
import type {ComponentChildren} from 'preact';
import {useEffect, useRef, useState} from 'preact/hooks';
import {fmt, fmtTicks} from '../format';
import {scaleOf} from './axes';

export interface Layer {
  label: string; // "" stays out of the legend
  color: string;
  x: ArrayLike<number>;
  y: ArrayLike<number>;
  kind: 'line' | 'points';
  size?: number;
  dash?: string;
  error?: ArrayLike<number>; // half length of vertical bars
  opacity?: number;
  barOpacity?: number; // of the vertical bars
}

// A text beside a point.
export interface Mark {
  x: number;
  y: number;
  text: string;
}

export interface Rule {
  y: number;
  label: string;
}

// A value with its interval, across the chart.
export interface Level {
  value: number;
  low: number;
  high: number;
}

export interface XyChartProps {
  title: string;
  of?: string; // what is drawn, where the title does not say it
  bad?: boolean; // what it shows is a problem
  xLabel: string;
  yLabel: string;
  layers: Layer[];
  rules?: Rule[];
  marks?: Mark[];
  level?: Level;
  rangeY?: number[]; // what y spans, whatever the layers have
  whole?: boolean; // x are whole numbers
  logX?: boolean;
  logY?: boolean;
  height?: number;
  ground?: boolean; // of its own: for colours that tell amounts
  children?: ComponentChildren; // below the chart
}

const kLeastLeft = 66, kRight = 12, kTop = 10, kBottom = 42;
const kYLabel = 30, kDigit = 6.8; // px: of the label of y, and of a digit of its ticks

// The width of an element as it changes.
export function useWidth(initial: number) {
  const ref = useRef<HTMLDivElement>(null);
  const [width, setWidth] = useState(initial);
  useEffect(() => {
    const observer = new ResizeObserver(entries => {
      const w = Math.floor(entries[0].contentRect.width);
      if (w > 0) setWidth(w);
    });
    observer.observe(ref.current!);
    return () => observer.disconnect();
  }, []);
  return {ref, width};
}

export function XyChart(props: XyChartProps) {
  const {ref, width} = useWidth(480);
  const height = props.height ?? 260;
  const sx = scaleOf(all(props.layers, 'x'), !!props.logX, props.whole ? beside(props.layers) : []);
  const sy = scaleOf(props.rangeY ?? all(props.layers, 'y'), !!props.logY, props.rules?.map(r => r.y));
  const h = height - kTop - kBottom;
  const yTicks = thin(sy.ticks, Math.max(2, Math.floor(h / 24)));
  const yNames = names(yTicks, sy.log);
  const margin = Math.max(kLeastLeft, kYLabel + kDigit * Math.max(...yNames.map(n => n.length)));
  const w = width - margin - kRight;
  const px = (x: number) => margin + sx.at(x) * w;
  const py = (y: number) => kTop + (1 - sy.at(y)) * h;
  const xTicks = thin(props.whole ? sx.ticks.filter(Number.isInteger) : sx.ticks, Math.max(2, Math.floor(w / 58)));
  const xNames = names(xTicks, sx.log);
  return (
    <figure class={props.bad ? 'chart bad' : 'chart'}>
      <figcaption>{props.title}</figcaption>
      <Legend layers={props.layers} />
      <div ref={ref}>
        <svg width={width} height={height} viewBox={`0 0 ${width} ${height}`} role="img"
          aria-label={`${props.of ? `${props.of}. ` : ''}${props.title}: ${props.yLabel} against ${props.xLabel}`}>
          {props.ground && <rect class="ground" x={margin} y={kTop} width={w} height={h} />}
          {xTicks.map((t, i) => <g key={t}>
            <line class="grid" x1={px(t)} x2={px(t)} y1={kTop} y2={kTop + h} />
            <text x={px(t)} y={kTop + h + 16} text-anchor="middle">{xNames[i]}</text>
          </g>)}
          {yTicks.map((t, i) => <g key={t}>
            <line class="grid" x1={margin} x2={margin + w} y1={py(t)} y2={py(t)} />
            <text x={margin - 6} y={py(t) + 4} text-anchor="end">{yNames[i]}</text>
          </g>)}
          <text x={margin + w / 2} y={height - 6} text-anchor="middle">{props.xLabel}</text>
          <text transform={`translate(14 ${kTop + h / 2}) rotate(-90)`} text-anchor="middle">{props.yLabel}</text>
          <svg x={margin} y={kTop} width={w} height={h} viewBox={`${margin} ${kTop} ${w} ${h}`}>
            {props.level && <>
              <rect class="level-band" x={margin} y={py(props.level.high)} width={w} height={Math.max(0, py(props.level.low) - py(props.level.high))} />
              <line class="level" x1={margin} x2={margin + w} y1={py(props.level.value)} y2={py(props.level.value)} />
            </>}
            {props.layers.map((l, i) => <LayerMarks key={i} layer={l} px={px} py={py} />)}
          </svg>
          {props.marks?.map((m, i) => {
            const left = px(m.x) > margin + 0.6 * w;
            return <text class="mark" key={i} x={px(m.x) + (left ? -9 : 9)} y={py(m.y) + (left ? -9 : 4)} text-anchor={left ? 'end' : 'start'}>{m.text}</text>;
          })}
          {props.rules?.map(r => <g key={r.label}>
            <line class="rule" x1={margin} x2={margin + w} y1={py(r.y)} y2={py(r.y)} />
            <text class="rule-label" x={margin + w - 4} y={py(r.y) - 4} text-anchor="end">{r.label}</text>
          </g>)}
        </svg>
      </div>
      {props.children}
    </figure>
  );
}

function names(ticks: number[], log: boolean): string[] {
  return log ? ticks.map(t => fmt(t)) : fmtTicks(ticks);
}

function thin(ticks: number[], most: number): number[] {
  const every = Math.ceil(ticks.length / most);
  return ticks.filter((_, i) => i % every === 0);
}

// Room beside the first and the last of whole numbers.
function beside(layers: Layer[]): number[] {
  const x = [...all(layers, 'x')].filter(Number.isFinite);
  return x.length ? [Math.min(...x) - 0.5, Math.max(...x) + 0.5] : [];
}

function* all(layers: Layer[], key: 'x' | 'y') {
  for (const l of layers) {
    for (let i = 0; i < l[key].length; ++i) yield l[key][i];
  }
}

// One path for a layer, however many points it has.
function LayerMarks({layer, px, py}: {
  layer: Layer; px: (x: number) => number; py: (y: number) => number;
}) {
  let path = '', bars = '', pen = false;
  for (let i = 0; i < layer.x.length; ++i) {
    const x = px(layer.x[i]), y = py(layer.y[i]);
    if (!Number.isFinite(x) || !Number.isFinite(y)) {
      pen = false;
      continue;
    }
    const at = `${x.toFixed(1)} ${y.toFixed(1)}`;
    path += layer.kind === 'points' ? `M${at}h0` : `${pen ? 'L' : 'M'}${at}`;
    pen = true;
    const e = layer.error?.[i];
    if (e !== undefined && Number.isFinite(e)) {
      bars += `M${x.toFixed(1)} ${py(layer.y[i] - e).toFixed(1)}V${py(layer.y[i] + e).toFixed(1)}`;
    }
  }
  return <>
    {bars && <path d={bars} fill="none" stroke={layer.color} stroke-width={layer.barOpacity ? 1.5 : 1} opacity={layer.barOpacity ?? 0.3} />}
    <path d={path} fill="none" stroke={layer.color} opacity={layer.opacity ?? 1}
      stroke-width={layer.size ?? (layer.kind === 'points' ? 5 : 2)}
      stroke-dasharray={layer.dash} stroke-linecap={layer.dash ? 'butt' : 'round'} stroke-linejoin="round" />
  </>;
}

export function Legend({layers}: {layers: {label: string; color: string; kind?: string; dash?: string}[]}) {
  const named = layers.filter(l => l.label);
  if (!named.length) return null;
  return (
    <ul class="legend">
      {named.map(l => <li key={l.label}>
        <svg width="22" height="10" aria-hidden="true">
          {l.kind === 'points'
            ? <circle cx="11" cy="5" r="3.5" fill={l.color} />
            : <line x1="0" x2="22" y1="5" y2="5" stroke={l.color} stroke-width="2.5" stroke-dasharray={l.dash} />}
        </svg>
        {l.label}
      </li>)}
    </ul>
  );
}
