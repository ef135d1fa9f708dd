// Colours that the colour-blind can tell apart: Okabe and Ito for things,
// cividis for amounts, blue to orange for signed amounts.

export const kOkabeIto = [
  '#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9', '#7F6A00',
];

const kCividis: [number, number, number][] = [
  [0, 34, 78], [18, 53, 112], [59, 73, 108], [87, 93, 109], [112, 113, 115],
  [138, 134, 120], [165, 156, 116], [195, 179, 105], [225, 204, 85],
  [254, 232, 56],
];

// f in [0, 1]; NaN is 0.
export function cividisRgb(f: number): [number, number, number] {
  const x = Math.min(Math.max(Number.isFinite(f) ? f : 0, 0), 1) *
      (kCividis.length - 1);
  const i = Math.min(Math.floor(x), kCividis.length - 2);
  const mix = (k: number) =>
      Math.round(kCividis[i][k] + (x - i) * (kCividis[i + 1][k] - kCividis[i][k]));
  return [mix(0), mix(1), mix(2)];
}

export function cividis(f: number): string {
  return `rgb(${cividisRgb(f).join(',')})`;
}

// f in [-1, 1]: blue, white, orange.
export function diverging(f: number): string {
  const x = Math.min(Math.max(f, -1), 1);
  const end = x < 0 ? [0, 114, 178] : [213, 94, 0];
  return `rgb(${end.map(c => Math.round(255 + Math.abs(x) * (c - 255))).join(',')})`;
}

// Where an error stands between `min` (0), the noise floor or more, and `max`
// (1), by its logarithm.
export function errorFraction(error: number, max: number, min = 1): number {
  if (!(error > min)) return 0;
  return Math.log(error / min) / Math.log(Math.max(max / min, 2));
}
