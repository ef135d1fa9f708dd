// Of panel 7: the confidence region of a pair of parameters.
import {useState} from 'preact/hooks';
import {modelColor} from '../colors';
import {fmt, unitText} from '../format';
import type {ModelData, PageData} from '../page_data';
import {XyChart, type Layer} from '../plots/xy_chart';
import {Choice} from './panel';

const kHow = 'Both parameters together are within the ellipse at 95 % confidence (the dot is the estimate). A long and narrow one says that only a combination of them is known.';
const kRadius = Math.sqrt(5.991); // chi-square, two degrees of freedom, 95 %
const kPoints = 360;
const kCut = 'It is cut at the bounds, which the estimates cannot leave.';

interface Axis {
  name: string;
  unit: string;
  value: number;
  std: number;
  lower: number;
  upper: number;
}

interface Pair {
  x: Axis;
  y: Axis;
  correlation: number;
}

// Of the parameters that the data determine, those with an interval.
function pairOf(model: ModelData, names: [string, string]): Pair | null {
  const [i, k] = names.map(n => model.correlationNames.indexOf(n));
  const correlation = i < 0 || k < 0 ? null : model.correlation[i]?.[k] ?? null;
  const [x, y] = names.map(name => {
    const p = model.parameters.find(q => q.name === name);
    return p && p.value !== null && p.stdError !== null && p.stdError > 0
      ? {name, unit: p.unit, value: p.value, std: p.stdError, lower: p.lower ?? -Infinity, upper: p.upper ?? Infinity} : null;
  });
  return x && y && correlation !== null ? {x, y, correlation} : null;
}

// The strongest correlation first.
export function pairsOf(model: ModelData): [string, string][] {
  const names = model.correlationNames, pairs: {names: [string, string]; size: number}[] = [];
  names.forEach((a, i) => names.slice(i + 1).forEach(b => {
    const pair = pairOf(model, [a, b]);
    if (pair) pairs.push({names: [a, b], size: Math.abs(pair.correlation)});
  }));
  return pairs.sort((a, b) => b.size - a.size).map(p => p.names);
}

// Its part within the bounds, closed (Sutherland and Hodgman 1974: one bound after the other).
export function ellipse({x, y, correlation}: Pair): {x: number[]; y: number[]; cut: boolean} {
  const across = Math.sqrt(Math.max(0, 1 - correlation * correlation));
  let points = Array.from({length: kPoints}, (_, i) => {
    const t = 2 * Math.PI * i / kPoints;
    return [x.value + kRadius * x.std * Math.cos(t),
      y.value + kRadius * y.std * (correlation * Math.cos(t) + across * Math.sin(t))];
  });
  let cut = false;
  const sides = [[0, 1, x.lower], [0, -1, -x.upper], [1, 1, y.lower], [1, -1, -y.upper]];
  for (const [axis, sign, bound] of sides) {
    const room = (p: number[]) => sign * p[axis] - bound;
    if (points.every(p => room(p) >= 0)) continue;
    cut = true;
    points = points.flatMap((p, i) => {
      const before = points.at(i - 1)!, [a, b] = [room(before), room(p)];
      const crossing = a >= 0 === b >= 0 ? [] : [p.map((_, k) =>
        k === axis ? sign * bound : before[k] + (p[k] - before[k]) * a / (a - b))];
      return b >= 0 ? [...crossing, p] : crossing;
    });
  }
  const closed = [...points, ...points.slice(0, 1)];
  return {x: closed.map(p => p[0]), y: closed.map(p => p[1]), cut};
}

// `models`: the one that is seen, and that which it is compared with.
export function Ellipses({page, models}: {page: PageData; models: number[]}) {
  const model = page.models[models[0]];
  const pairs = pairsOf(model);
  const [chosen, setChosen] = useState('');
  if (!pairs.length) return null;
  const label = (names: [string, string]) => names.join(' and ');
  const names = pairs.find(p => label(p) === chosen) ?? pairs[0];
  const layers: Layer[] = models.flatMap((index, k) => {
    const pair = pairOf(page.models[index], names);
    const color = `var(${modelColor(index, models[0])})`;
    const region = pair && ellipse(pair);
    return pair && region ? [
      {label: page.models[index].title, color, kind: 'line' as const, dash: k ? '5 4' : undefined, x: region.x, y: region.y},
      {label: '', color, kind: 'points' as const, x: [pair.x.value], y: [pair.y.value]},
    ] : [];
  });
  const pair = pairOf(model, names)!;
  const axis = (p: Axis) => unitText(p.unit) ? `${p.name}, ${unitText(p.unit)}` : p.name;
  return (
    <div class="ellipses">
      <Choice label="Parameters" value={label(names)} onChange={setChosen} options={pairs.map(p => ({value: label(p), text: label(p)}))} />
      <XyChart title={`95 % confidence region of ${label(names)}`} xLabel={axis(pair.x)} yLabel={axis(pair.y)} layers={layers}>
        <p class="note">Their correlation is {fmt(pair.correlation, 2)}. {kHow}{ellipse(pair).cut && ` ${kCut}`}</p>
      </XyChart>
    </div>
  );
}
