// Curves over time (uPlot): zoom and cursor are shared by all of them.
import {useEffect, useRef} from 'preact/hooks';
import uPlot from 'uplot';
import {
  cursor, panBy, playing, printing, setCursor, setZoom, shownRange, theme,
  timeKey, zoom, zoomBy,
} from '../state';
import type {Numbers} from '../data';
import {fmtTicks} from '../format';
import {decimate} from './decimate';

export interface Curve {
  label: string;
  color: string; // a colour, or a CSS variable "--name"
  values: Numbers;
  width?: number;
  dash?: number[];
  dots?: boolean; // the samples, where they are few enough to be seen
}

export interface TimePlotProps {
  label: string; // for the axis: "q, rad"
  description: string; // for a screen reader
  times: Numbers;
  curves: Curve[];
  cuts: number[];
  band?: number; // shades -band..band
  height: number;
  timeAxis: boolean;
}

const kAxisWidth = 78;

export function css(name: string): string {
  return name.startsWith('--')
      ? getComputedStyle(document.documentElement).getPropertyValue(name).trim() : name;
}

export function TimePlot(props: TimePlotProps) {
  const host = useRef<HTMLDivElement>(null);
  const {times, curves, cuts} = props;
  useEffect(() => {
    // Kept: observers may still report once the reference is empty.
    const element = host.current!;
    let plot = make(element, props);
    const again = () => {
      plot.destroy();
      plot = make(element, props);
    };
    const observer = new ResizeObserver(() => {
      const width = element.clientWidth;
      if (width && width !== plot.width) again();
    });
    observer.observe(element);
    const stop = [
      zoom.subscribe(() => refill(plot, props)),
      cursor.subscribe(() => placeCursor(plot)),
      theme.subscribe(again),
      printing.subscribe(again),
    ];
    return () => {
      observer.disconnect();
      stop.forEach(f => f());
      plot.destroy();
    };
  }, [times, curves, cuts, props.height, props.label]);
  return (
    <div class="time-plot" ref={host} tabIndex={0} role="group" onKeyDown={timeKey}
      aria-label={`${props.description}. Arrow keys move the time cursor, plus and minus zoom, 0 shows the whole run.`} />
  );
}

function make(host: HTMLElement, props: TimePlotProps): uPlot {
  const color = css('--ink'), grid = css('--grid');
  const axis = {stroke: color, grid: {stroke: grid, width: 1}, ticks: {stroke: grid, width: 1}};
  const plot = new uPlot({
    width: Math.max(200, host.clientWidth),
    height: props.height,
    legend: {show: false},
    cursor: {
      drag: {x: true, y: false, setScale: false},
      points: {show: false},
      x: false,
      y: false,
      bind: {dblclick: () => () => { setZoom(null); return null; }},
    },
    scales: {x: {time: false}},
    axes: [
      {...axis, label: props.timeAxis ? 't, s' : undefined, labelSize: 18, labelGap: 0,
       size: props.timeAxis ? 30 : 0, font: '12px sans-serif', labelFont: '12px sans-serif',
       values: (_: uPlot, v: number[]) => props.timeAxis ? fmtTicks(v) : v.map(() => '')},
      {...axis, label: props.label, size: kAxisWidth - 18, labelSize: 18, labelGap: 0,
       font: '12px sans-serif', labelFont: '12px sans-serif', space: 20,
       values: (_: uPlot, v: number[]) => fmtTicks(v)},
    ],
    series: [
      {},
      ...props.curves.map(c => ({
        label: c.label,
        stroke: css(c.color),
        width: c.width ?? 1.5,
        dash: c.dash,
        points: {show: false},
        spanGaps: false,
        ...(c.dots ? dots(c) : {}),
      })),
    ],
    padding: [6, 8, props.timeAxis ? 0 : 6, 0],
    hooks: {
      drawClear: [u => shade(u, props)],
      ready: [placeCursor],
      setSelect: [u => {
        if (u.select.width < 4) return;
        const range: [number, number] = [
          u.posToVal(u.select.left, 'x'), u.posToVal(u.select.left + u.select.width, 'x'),
        ];
        u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
        setZoom(range);
      }],
    },
  }, data(props, host.clientWidth), host);
  const line = document.createElement('div');
  line.className = 'cursor-line';
  plot.over.append(line);
  refill(plot, props);
  listenToPointer(plot);
  return plot;
}

// Samples as dots while they stand apart, else a line.
function dots(c: Curve): Partial<uPlot.Series> {
  return {points: {show: u => {
    const [a, b] = shownRange();
    const n = u.data[0].filter(t => t >= a && t <= b).length;
    return n < u.over.clientWidth / 6;
  }, size: 4, fill: css(c.color)}};
}

function data(props: TimePlotProps, width: number): uPlot.AlignedData {
  const [a, b] = shownRange();
  const pixels = Math.max(100, width - kAxisWidth - 8);
  return decimate(props.times, props.curves.map(c => c.values), a, b, pixels) as uPlot.AlignedData;
}

function refill(plot: uPlot, props: TimePlotProps) {
  const [min, max] = shownRange();
  plot.batch(() => {
    plot.setData(data(props, plot.width), false);
    plot.setScale('x', {min, max});
  });
  placeCursor(plot);
  // What tests read.
  plot.root.dataset.range = `${min} ${max}`;
  plot.root.dataset.points = String(plot.data[0].length);
}

function placeCursor(plot: uPlot) {
  const line = plot.over.querySelector<HTMLElement>('.cursor-line');
  if (!line) return;
  const x = plot.valToPos(cursor.value, 'x');
  line.style.display = x >= -1 && x <= plot.over.clientWidth + 1 ? '' : 'none';
  line.style.transform = `translateX(${x}px)`;
}

// Every other segment is shaded; the noise is a band around zero.
function shade(u: uPlot, props: TimePlotProps) {
  const {ctx, bbox} = u;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.fillStyle = css('--segment');
  const [a, b] = shownRange();
  const pixel = (b - a) / Math.max(1, bbox.width);
  for (let i = 0; i + 1 < props.cuts.length; i += 2) {
    const [t0, t1] = [props.cuts[i], props.cuts[i + 1]];
    if (t1 < a || t0 > b || t1 - t0 < 3 * pixel) continue;
    const x0 = u.valToPos(t0, 'x', true), x1 = u.valToPos(t1, 'x', true);
    ctx.fillRect(x0, bbox.top, x1 - x0, bbox.height);
  }
  if (props.band) {
    ctx.fillStyle = css('--band');
    const y0 = u.valToPos(props.band, 'y', true), y1 = u.valToPos(-props.band, 'y', true);
    ctx.fillRect(bbox.left, y0, bbox.width, y1 - y0);
  }
  ctx.restore();
}

// The pointer carries the cursor unless it plays; with Ctrl the wheel zooms,
// with Shift it moves along.
function listenToPointer(plot: uPlot) {
  plot.over.addEventListener('pointermove', e => {
    if (playing.value || e.buttons) return;
    setCursor(plot.posToVal(e.offsetX, 'x'));
  });
  plot.over.addEventListener('click', e => setCursor(plot.posToVal(e.offsetX, 'x')));
  plot.over.addEventListener('wheel', e => {
    if (!e.ctrlKey && !e.shiftKey) return;
    e.preventDefault();
    if (e.ctrlKey) zoomBy(e.deltaY > 0 ? 1.25 : 0.8);
    else panBy((e.deltaY || e.deltaX) > 0 ? 0.1 : -0.1);
  }, {passive: false});
}
