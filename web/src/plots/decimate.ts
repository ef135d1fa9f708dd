// Fewer samples with the same picture: the smallest and the largest value of
// every pixel, in the order in which they come.
import {lowerBound, type Numbers} from '../data';

// `x` and one array for each series; null is a gap.
export type Aligned = [number[], ...(number | null)[][]];

// Of x[i0, i1), with a sample more on each side so that lines leave the
// picture; at most 2 * buckets points.
export function decimate(x: Numbers, series: Numbers[], from: number,
                         to: number, buckets: number): Aligned {
  const i0 = Math.max(0, lowerBound(x, from) - 1);
  const i1 = Math.min(x.length, lowerBound(x, to) + 2);
  const n = i1 - i0;
  if (n <= 2 * buckets) {
    return [
      Array.from(x.subarray(i0, i1)),
      ...series.map(s => Array.from(s.subarray(i0, i1), gap)),
    ];
  }
  const xs: number[] = [];
  const ys: (number | null)[][] = series.map(() => []);
  for (let b = 0; b < buckets; ++b) {
    const a = i0 + Math.floor(n * b / buckets);
    const e = i0 + Math.floor(n * (b + 1) / buckets);
    xs.push(x[a], x[e - 1]);
    series.forEach((s, k) => {
      const [first, second] = extremes(s, a, e);
      ys[k].push(first, second);
    });
  }
  return [xs, ...ys];
}

function gap(v: number): number | null {
  return Number.isNaN(v) ? null : v;
}

function extremes(s: Numbers, a: number, e: number): [number | null, number | null] {
  let low = -1, high = -1;
  for (let i = a; i < e; ++i) {
    const v = s[i];
    if (Number.isNaN(v)) continue;
    if (low < 0 || v < s[low]) low = i;
    if (high < 0 || v > s[high]) high = i;
  }
  if (low < 0) return [null, null];
  return low <= high ? [s[low], s[high]] : [s[high], s[low]];
}
