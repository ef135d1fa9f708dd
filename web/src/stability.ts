// Whether each law is constant (docs/judgement.md, section 6): what the values
// of a parameter in parts of the data say, in words and as ranges to draw.
import {quantityUnit} from './data';
import {fmt} from './format';
import type {ModelData, PageData, StabilityData} from './page_data';

export interface ConstancyOfParameter {
  parameter: string;
  effect: string;
  unit: string;
  joint: string; // whose motion the data are split by
  standsIn: boolean; // the effect lowers the error without being constant
  splits: StabilityData[];
}

type Known = {from: number; to: number; value: number; std_error: number};

type Estimates = Pick<StabilityData, 'estimates'>;

export const known = (split: Estimates): Known[] => split.estimates.filter((e): e is Known =>
  e.from !== null && e.to !== null && e.value !== null && e.std_error !== null && e.std_error > 0);

// Those that are not constant and matter first, then by how far the values lie
// apart in their standard errors.
export function constancyOf(model: ModelData): ConstancyOfParameter[] {
  const found: ConstancyOfParameter[] = [];
  for (const split of model.stability ?? []) {
    if (known(split).length < 2) continue;
    const same = found.find(p => p.parameter === split.parameter && p.effect === split.effect);
    if (same) same.splits.push(split);
    else found.push({...split, standsIn: standsIn(model, split.effect), splits: [split]});
  }
  const order = (p: ConstancyOfParameter) => [Number(p.standsIn && p.splits.some(s => !s.constant)), Number(p.standsIn), Math.max(...p.splits.map(apart))];
  return found.map(p => ({p, key: order(p)}))
    .sort((a, b) => b.key.map((k, i) => k - a.key[i]).find(d => d !== 0) ?? 0).map(x => x.p);
}

export const standsIn = (model: ModelData, effect: string): boolean => (model.standIns ?? []).some(s => s.effect === effect);

// By which the values differ from their weighted mean, in standard errors (rms).
function apart(split: StabilityData): number {
  const estimates = known(split), value = mean(split);
  return Math.sqrt(estimates.reduce((sum, e) => sum + ((e.value - value) / e.std_error) ** 2, 0) / (estimates.length - 1));
}

// Weighted by what is known of each.
export function mean(split: Estimates): number {
  let weights = 0, sum = 0;
  for (const e of known(split)) {
    weights += e.std_error ** -2;
    sum += e.value * e.std_error ** -2;
  }
  return sum / weights;
}

// What the axis of a parameter spans: zero, and the intervals of the better known
// half at least, and all that are narrower than the value; others leave the panel.
const kTooWide = 3; // × the median
export function rangeOf(splits: StabilityData[]): number[] {
  const all = splits.flatMap(known), widths = all.map(e => e.std_error).sort((a, b) => a - b);
  const value = mean({estimates: all});
  const most = Math.max(kTooWide * widths[(widths.length - 1) >> 1], Math.abs(value) / 1.96);
  return [0, ...all.filter(e => e.std_error <= most).flatMap(interval)];
}

export const interval = (e: Known): [number, number] => [e.value - 1.96 * e.std_error, e.value + 1.96 * e.std_error];

export function leaves(split: StabilityData, range: number[]): boolean {
  const low = Math.min(...range), high = Math.max(...range);
  return known(split).some(e => interval(e)[0] < low || interval(e)[1] > high);
}

// What the data are split by: the parts from the first to the last, and what it
// says of the truth where the values rise, fall, or do something else.
const kWords = {
  time: {by: 'time', ends: 'from early to late'},
  speed: {by: 'speed', ends: 'from slow to fast'},
  position: {by: 'position', ends: 'from low to high positions'},
  effort: {by: 'effort', ends: 'from small to large efforts'},
  amplitude: {by: 'amplitude', ends: 'from small to large motions'},
  run: {by: 'run', ends: 'from the first to the last run'},
};

const kLittle = 0.15; // as judgement_constants.h: from where a law stands in for another

// In one piece.
const percent = (x: number) => `${fmt(100 * x, x < 0.1 ? 1 : 2)}\u00a0%`;

// "By speed: rises from slow to fast."
export function inWords(split: StabilityData): string {
  const {by, ends} = kWords[split.strata];
  const estimates = known(split), value = mean(split), spread = split.spread ?? 0;
  const widths = estimates.map(e => 1.96 * e.std_error / Math.abs(value)).sort((a, b) => a - b);
  const width = widths[widths.length >> 1];
  const start = `By ${by}: `;
  if (!split.constant) {
    if (split.trend === 'none') return `${start}changes up and down`;
    // Of what is below zero the size falls where the value rises.
    const up = estimates[estimates.length - 1].value > estimates[0].value;
    return `${start}${split.trend}${up === (split.trend === 'rises') ? '' : ' in size'} ${ends}`;
  }
  if (spread >= kLittle && spread > width) return `${start}differs by ${percent(spread)}${why(split.least_spread ?? 0)}`;
  if (!(width < 1)) return `${start}cannot be told, the intervals are wider than the value`;
  const within = Math.max(spread, width);
  return within < kLittle ? `${start}constant within ${percent(within)}` : `${start}no change to be seen, each known to ±\u00a0${percent(within)}`;
}

// Why what differs is taken for constant.
function why(surely: number): string {
  if (surely >= kLittle) return ', which matters little for the error';
  return surely > 0 ? `, surely by ${percent(surely)}` : ', which may be chance';
}

// What follows for the law that is true, where the values are not constant.
export function meaning(split: StabilityData): string {
  if (split.constant) return '';
  const {by} = kWords[split.strata];
  if (split.strata === 'run') return 'What is missing differs from run to run, as a load or a setting does.';
  if (split.strata === 'time') return 'What is missing changes in the course of the recording, as what warms up or drifts does.';
  if (split.strata === 'position' || split.trend === 'none') return `What is missing depends on the ${by} in another way than this law.`;
  return split.trend === 'rises' ? `What is missing grows faster with the ${by} than this law: the true one is steeper.`
    : `What is missing grows more slowly with the ${by} than this law: the true one is flatter.`;
}

export function axisOf(page: PageData, split: StabilityData): string {
  const joint = page.mechanism.joints.find(j => j.name === split.joint);
  const unit = (of: 'position' | 'velocity' | 'effort') => quantityUnit(page, split.joint, of);
  switch (split.strata) {
    case 'time': return 'time, s';
    case 'speed': return `speed, ${unit('velocity')}`;
    case 'position': return `${joint?.type === 'spherical' ? 'tilt' : 'position'}, ${unit('position')}`;
    case 'amplitude': return `amplitude, ${unit('position')}`;
    case 'effort': return `effort, ${unit('effort')}`;
    case 'run': return 'run';
  }
}

// The runs of the i-th part: all from one cut up to the next.
export function runsOf(split: StabilityData, i: number): [number, number] {
  const {from, to} = known(split)[i];
  return [from, i === known(split).length - 1 ? Math.max(from, to) : Math.max(from, to - 1)];
}
