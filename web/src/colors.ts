// Colours that the colour-blind can tell apart: Okabe and Ito for things,
// cividis for amounts, blue to orange for signed amounts.

export const kOkabeIto = [
  '#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9', '#7F6A00',
];

const kModelColors = 6; // --model-0, ... of style.css; no grey, what was measured is black

// The variable of a model's colour, the same whatever else is shown; of two
// models the second has another one where they would share it.
export function modelColor(index: number, beside?: number): string {
  const own = index % kModelColors;
  const taken = beside !== undefined && beside !== index && beside % kModelColors === own;
  return `--model-${taken ? (own + 1) % kModelColors : own}`;
}

const kCividis: [number, number, number][] = [
  [0, 34, 78], [18, 53, 112], [59, 73, 108], [87, 93, 109], [112, 113, 115],
  [138, 134, 120], [165, 156, 116], [195, 179, 105], [225, 204, 85],
  [254, 232, 56],
];

// On a dark ground, where the dark half of cividis is not seen.
const kOnDark: [number, number, number][] = [
  [74, 134, 214], [122, 150, 190], [168, 168, 150], [212, 198, 104], [254, 232, 56],
];

// f in [0, 1]; NaN is 0.
export function cividisRgb(f: number, dark = false): [number, number, number] {
  const map = dark ? kOnDark : kCividis;
  const x = Math.min(Math.max(Number.isFinite(f) ? f : 0, 0), 1) *
      (map.length - 1);
  const i = Math.min(Math.floor(x), map.length - 2);
  const mix = (k: number) =>
      Math.round(map[i][k] + (x - i) * (map[i + 1][k] - map[i][k]));
  return [mix(0), mix(1), mix(2)];
}

export function cividis(f: number, dark = false): string {
  return `rgb(${cividisRgb(f, dark).join(',')})`;
}

// f in [-1, 1]: blue, the ground (white, or nearly black), orange.
export function diverging(f: number, dark = false): string {
  const x = Math.min(Math.max(f, -1), 1);
  const end = x < 0 ? [0, 114, 178] : [213, 94, 0], ground = dark ? [27, 32, 39] : [255, 255, 255];
  return `rgb(${end.map((c, i) => Math.round(ground[i] + Math.abs(x) * (c - ground[i]))).join(',')})`;
}

// Where an error stands between `min` (0), the noise floor or more, and `max`
// (1), by its logarithm.
export function errorFraction(error: number, max: number, min = 1): number {
  if (!(error > min)) return 0;
  return Math.log(error / min) / Math.log(Math.max(max / min, 2));
}
