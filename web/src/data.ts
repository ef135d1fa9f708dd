// From the document to numbers: decoding, and what the panels derive from it.
import type {
  CandidateData, DrawnSeries, ForceData, ModelData, PageData, RunData, Series, StepData,
} from './page_data';
import {fmt, fmtError, fmtTimes} from './format';

export type Numbers = Float32Array | Float64Array;

const decoded = new WeakMap<Series | DrawnSeries, Numbers>();

// Decoded once, however often it is asked for.
export function decode(series: Series | DrawnSeries): Numbers {
  let values = decoded.get(series);
  if (!values) {
    values = 'u16' in series ? steps(series) : singles(series);
    decoded.set(series, values);
  }
  return values;
}

function singles(series: Series): Numbers {
  const values = new Float32Array(bytesOf(series.f32, 4).buffer);
  const offset = series.offset ?? 0;
  return offset === 0 ? values : Float64Array.from(values, v => v + offset);
}

function steps({u16, step, offset}: DrawnSeries): Numbers {
  const places = new Uint16Array(bytesOf(u16, 2).buffer);
  return Float32Array.from(places, place => place === 65535 ? NaN : offset + step * place);
}

// Of whole words, in the order of this machine.
function bytesOf(base64: string, word: number): Uint8Array<ArrayBuffer> {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length - text.length % word);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = text.charCodeAt(i);
  if (new Uint8Array(new Uint16Array([1]).buffer)[0] !== 1) {
    for (let i = 0; i < bytes.length; i += word) bytes.subarray(i, i + word).reverse();
  }
  return bytes;
}

// The inlined document, or null where the page has to ask a server.
export function inlined(text: string | null | undefined): PageData | null {
  if (!text || text.trim() === '') return null;
  return checked(JSON.parse(text));
}

export function checked(page: PageData): PageData {
  if (page.schema !== 'sysid.page/1') {
    throw new Error(`This page reads sysid.page/1, and the document is ${page.schema}.`);
  }
  return withOwnTitles(page);
}

// Models that have the same effects have one title: told apart by their place.
function withOwnTitles(page: PageData): PageData {
  const seen = new Map<string, number>();
  for (const model of page.models) {
    const before = seen.get(model.title) ?? 0;
    seen.set(model.title, before + 1);
    if (before) model.title += ` (model ${model.id + 1})`;
  }
  return page;
}

// Files' names, with as much of their folders as tells them apart.
export function runLabels(names: string[]): string[] {
  const parts = names.map(n => n.split('/').filter(p => p !== ''));
  const last = (i: number, k: number) => parts[i].slice(-k).join('/');
  return names.map((name, i) => {
    for (let k = 1; k < parts[i].length; ++k) {
      if (!names.some((other, j) => other !== name && last(j, k) === last(i, k))) return last(i, k);
    }
    return name;
  });
}

export function runLabel(page: PageData, run: number): string {
  return runLabels(page.runs.map(r => r.name))[run];
}

// The steps that led from the first model to one, in order.
export function wayTo(page: PageData, id: number): StepData[] {
  const way: StepData[] = [];
  for (let at: number | null = id; at !== null && way.length <= page.steps.length;) {
    const step: StepData | undefined = page.steps.find(s => s.model === at);
    if (!step) break;
    way.unshift(step);
    at = step.from;
  }
  return way;
}

// What a candidate promises, or why it promises nothing.
export function prediction(model: ModelData, c: CandidateData): string {
  return c.predictedError === null ? `no prediction: ${c.noPrediction || 'there is none'}`
    : `predicted: ${fmtError(model.trainError)} → ${fmtTimes(c.predictedError)}`;
}

// Over what the errors of a model are.
export function errorsOver(model: ModelData): string {
  return model.joined ? 'of one trajectory over each run'
    : `over segments of ${fmt(model.segment_s, 3)} s, each from its own initial state`;
}

// The index of the sample nearest to `t`; `times` increases.
export function nearest(times: Numbers, t: number): number {
  const i = lowerBound(times, t);
  if (i === 0) return 0;
  if (i === times.length) return times.length - 1;
  return t - times[i - 1] <= times[i] - t ? i - 1 : i;
}

// The first index with times[i] >= t.
export function lowerBound(times: ArrayLike<number>, t: number): number {
  let low = 0, high = times.length;
  while (low < high) {
    const mid = (low + high) >> 1;
    if (times[mid] < t) low = mid + 1; else high = mid;
  }
  return low;
}

// Of a curve at other times, on the lines between its samples; NaN beyond them.
export function interpolated(times: Numbers, values: Numbers, at: Numbers): Numbers {
  return Float64Array.from(at, t => {
    const i = lowerBound(times, t);
    if (times[i] === t) return values[i];
    if (i === 0 || i === times.length) return NaN;
    const f = (t - times[i - 1]) / (times[i] - times[i - 1]);
    return values[i - 1] + f * (values[i] - values[i - 1]);
  });
}

// Of what is there; 0 where nothing is.
export function meanSquare(series: Series): number {
  let sum = 0, n = 0;
  for (const v of decode(series)) {
    if (Number.isNaN(v)) continue;
    sum += v * v;
    n += 1;
  }
  return n ? sum / n : 0;
}

export function duration(run: RunData): [number, number] {
  const t = decode(run.t);
  return t.length === 0 ? [0, 1] : [t[0], t[t.length - 1]];
}

export interface ErrorMap {
  rows: string[]; // channels
  edges: number[]; // s, one more than there are columns
  cells: number[][]; // [row][column]: rms in units of the noise, NaN: no data
  min: number; // that nearly all exceed, at least 1: where colours begin
  max: number;
}

// What all but a twentieth of the errors exceed, and at least the noise.
export function leastError(errors: Iterable<number>): number {
  const sorted = Array.from(errors).filter(Number.isFinite).sort((a, b) => a - b);
  return Math.max(1, sorted[Math.floor(sorted.length / 20)] ?? 1);
}

// The rms of the residual over equal pieces of time, channel by channel.
export function errorMap(page: PageData, model: number, run: number, columns: number): ErrorMap {
  const [t0, t1] = duration(page.runs[run]);
  const times = decode(page.runs[run].t);
  const n = Math.max(1, Math.min(columns, times.length));
  const edges = Array.from({length: n + 1}, (_, i) => t0 + (t1 - t0) * i / n);
  const prediction = page.models[model].predictions[run];
  const cells = prediction.channels.map(channel => {
    const sum = new Float64Array(n), count = new Float64Array(n);
    for (const series of channel.residual) {
      const r = decode(series);
      for (let i = 0; i < r.length; ++i) {
        if (Number.isNaN(r[i])) continue;
        const c = Math.min(n - 1, Math.floor((times[i] - t0) / (t1 - t0 || 1) * n));
        sum[c] += r[i] * r[i];
        count[c] += 1;
      }
    }
    return Array.from(sum, (s, c) => count[c] ? Math.sqrt(s / count[c]) : NaN);
  });
  const finite = cells.flat().filter(Number.isFinite);
  return {
    rows: page.runs[run].channels.map(channelLabel),
    edges, cells, min: leastError(finite), max: finite.reduce((a, b) => Math.max(a, b), 1),
  };
}

export function channelLabel(c: {name: string; kind?: string}): string {
  return c.kind === 'velocity' || c.kind === 'angular_velocity'
      ? `${c.name} (velocity)` : c.name;
}

// |residual| at each sample over all channels that tell of `joint`.
export function jointError(page: PageData, model: number, run: number, joint: string): Numbers {
  const channels = page.runs[run].channels;
  const out = new Float32Array(decode(page.runs[run].t).length).fill(NaN);
  const count = new Uint16Array(out.length);
  channels.forEach((channel, c) => {
    if (channel.joint !== joint) return;
    for (const series of page.models[model].predictions[run].channels[c].residual) {
      const r = decode(series);
      for (let i = 0; i < r.length; ++i) {
        if (Number.isNaN(r[i])) continue;
        out[i] = (count[i] ? out[i] : 0) + r[i] * r[i];
        count[i] += 1;
      }
    }
  });
  return out.map((s, i) => count[i] ? Math.sqrt(s / count[i]) : NaN);
}

// How far a spherical joint leans: the angle between the child's z axis and
// the joint frame's.
export function tilt(x: number, y: number): number {
  return Math.acos(Math.min(1, Math.max(-1, 1 - 2 * (x * x + y * y))));
}

export function candidateName(c: CandidateData): string {
  return `${c.effect}@${c.target}`;
}

// The candidate and the effects that were added with it in its refit.
export const withOthers = (c: CandidateData): string[] => [candidateName(c), ...c.confirmed?.togetherWith ?? []];

export function forceName(f: ForceData): string {
  return f.component ? `${f.joint}, ${f.component}` : f.joint;
}

export type Quantity = 'position' | 'velocity' | 'effort';

// What a law is best drawn against.
export function lawQuantity(effect: string): Quantity {
  if (/effort_(gain|delay)/.test(effect)) return 'effort';
  return /friction|damping|drag|armature|effort_bias/.test(effect)
      ? 'velocity' : 'position';
}

export function quantityUnit(page: PageData, joint: string, quantity: Quantity): string {
  const j = page.mechanism.joints.find(x => x.name === joint);
  const unit = !j || j.type === 'spherical' ? 'rad' : j.unit;
  if (quantity === 'position') return unit;
  return quantity === 'velocity' ? `${unit}/s` : j?.effortUnit ?? 'N m';
}

// Positions of every joint in one unit, or the units that occur.
export function positionUnit(page: PageData): string {
  const units = new Set(page.mechanism.joints.map(j => j.type === 'spherical' ? 'rad' : j.unit));
  return [...units].join(' or ') || 'rad';
}

export function modelWithId(page: PageData, id: number): ModelData | undefined {
  return page.models.find(m => m.id === id);
}

export function worstChannel(model: ModelData) {
  return model.channels.reduce<ModelData['channels'][number] | null>(
      (worst, c) => !worst || c.normalized_rms > worst.normalized_rms ? c : worst, null);
}

export function worstSegment(model: ModelData) {
  return model.segments.reduce<ModelData['segments'][number] | null>(
      (worst, s) => !worst || s.normalized_rms > worst.normalized_rms ? s : worst, null);
}

type Course = ModelData['histories'][number]['points'];

// With a gap before each stage of Levenberg-Marquardt: no step of its own raises
// the cost, so that one that rises is that of the next, longer segments. (Of
// Adam the cost may rise by chance.)
export function inStages(solver: string, points: Course): Course {
  if (!/^(lm|levenberg)/i.test(solver)) return points;
  return points.flatMap((p, i) => i && p.cost > points[i - 1].cost * (1 + 1e-9)
    ? [{iteration: p.iteration, time_s: p.time_s, cost: NaN}, p] : [p]);
}
