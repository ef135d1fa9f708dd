// Ranges and ticks of the small charts.

export interface Scale {
  min: number;
  max: number;
  log: boolean;
  ticks: number[];
  // To [0, 1].
  at(x: number): number;
}

export function scaleOf(values: Iterable<number>, log: boolean, include: number[] = []): Scale {
  let min = Infinity, max = -Infinity;
  for (const list of [values, include]) {
    for (const v of list) {
      if (!Number.isFinite(v) || (log && v <= 0)) continue;
      if (v < min) min = v;
      if (v > max) max = v;
    }
  }
  if (min > max) [min, max] = log ? [0.1, 1] : [0, 1];
  return log ? logScale(min, max) : linearScale(min, max);
}

function linearScale(low: number, high: number): Scale {
  let [min, max] = [low, high];
  if (min === max) {
    const d = Math.abs(min) * 0.1 || 0.5;
    [min, max] = [min - d, max + d];
  }
  const margin = (max - min) * 0.04;
  if (min !== 0) min -= margin;
  if (max !== 0) max += margin;
  const step = niceStep((max - min) / 5);
  const ticks: number[] = [];
  for (let i = Math.ceil(min / step); i * step <= max; ++i) ticks.push(Number((i * step).toPrecision(12)));
  return {min, max, log: false, ticks, at: x => (x - min) / (max - min)};
}

function logScale(low: number, high: number): Scale {
  const min = low / 1.15, max = high * 1.15;
  const decades = Math.log10(max / min);
  const digits = decades < 1 ? [1, 1.5, 2, 3, 4, 5, 7] : decades < 2.5 ? [1, 2, 5] : [1];
  const every = Math.max(1, Math.ceil(decades / 6));
  const ticks: number[] = [];
  for (let e = Math.floor(Math.log10(min)); e <= Math.log10(max); e += digits.length > 1 ? 1 : every) {
    for (const d of digits) {
      const v = Number((d * 10 ** e).toPrecision(3));
      if (v >= min && v <= max) ticks.push(v);
    }
  }
  return {min, max, log: true, ticks, at: x => Math.log(x / min) / Math.log(max / min)};
}

export function niceStep(raw: number): number {
  const e = 10 ** Math.floor(Math.log10(raw));
  const f = raw / e;
  return (f <= 1 ? 1 : f <= 2 ? 2 : f <= 5 ? 5 : 10) * e;
}
