// Numbers as text.

// `x` with `digits` significant digits, "–" where there is none.
export function fmt(x: number | null | undefined, digits = 4): string {
  if (x === null || x === undefined || !Number.isFinite(x)) return '–';
  if (x === 0) return '0';
  const size = Math.abs(x);
  if (size < 1e-3 || size >= 1e5) {
    const [m, e] = x.toExponential(digits - 1).split('e');
    return `${Number(m)}e${e.replace('+', '')}`;
  }
  return String(Number(x.toPrecision(digits)));
}

// With the unit, without one for "-" and "".
export function fmtUnit(x: number | null | undefined, unit: string, digits = 4): string {
  const text = fmt(x, digits);
  return text === '–' || unit === '' || unit === '-' ? text : `${text} ${unitText(unit)}`;
}

// With real exponents: "m/s^2" is m/s². Nothing for no unit, "-".
export function unitText(unit: string): string {
  return unit === '-' ? '' : unit.replaceAll('^2', '²').replaceAll('^3', '³');
}

// Of an axis: a joint's force is a torque where its unit is.
export const forceLabel = (unit: string): string => `${unit === 'N m' ? 'torque' : 'force'}, ${unitText(unit)}`;

// An error as a multiple of the noise, with its zeros: 1.00.
export function fmtError(x: number | null | undefined): string {
  if (x === null || x === undefined || !Number.isFinite(x)) return '–';
  return x >= 0.01 && x < 1000 ? x.toPrecision(3) : fmt(x, 3);
}

export function fmtTimes(x: number | null | undefined): string {
  const text = fmtError(x);
  return text === '–' ? text : `${text} × noise`;
}

export function fmtPercent(x: number | null | undefined): string {
  return x === null || x === undefined || !Number.isFinite(x) ? '–' : `${x.toPrecision(3)} %`;
}

// Below 1e-12 only rounding is left.
export function fmtP(p: number | null): string {
  if (p === null || !Number.isFinite(p)) return '–';
  return p < 1e-12 ? '< 1e-12' : fmt(p, 2);
}

// A time of a run in s, to the millisecond.
export function fmtTime(t: number): string {
  return Number.isFinite(t) ? String(Number(t.toFixed(3))) : '–';
}

// Two times with as many places as their distance asks for, and three at least.
export function fmtRange(from: number, to: number): string {
  const places = Math.min(9, Math.max(3, 2 - Math.floor(Math.log10(to - from || 1))));
  return [from, to].map(t => `${Number(t.toFixed(places))} s`).join(' to ');
}

// What a program says, as a sentence of its own.
export function sentence(text: string): string {
  const whole = text.trim();
  if (!whole) return '';
  // Names stay as they are: link1.mass, coulomb_friction@joint1.
  const first = /^[a-z]+( |$)/.test(whole) ? whole[0].toUpperCase() : whole[0];
  return first + whole.slice(1) + (/[.!?]$/.test(whole) ? '' : '.');
}

// Ticks with as many places as tell them apart, and tell each of them exactly: a
// step of 0.25 has two.
export function fmtTicks(ticks: number[]): string[] {
  if (ticks.length < 2) return ticks.map(t => fmt(t));
  const step = Math.abs(ticks[1] - ticks[0]);
  const largest = Math.max(...ticks.map(Math.abs));
  if (!(step > 0) || (largest < 1e-3 || step >= 1e5)) return ticks.map(t => fmt(t, 3));
  let places = Math.min(9, Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)));
  const most = Math.min(9, places + 2);
  while (places < most && ticks.some(t => Math.abs(Number(t.toFixed(places)) - t) > 1e-6 * step)) ++places;
  return ticks.map(t => String(Number(t.toFixed(places))));
}

// A time that passes.
export function fmtSeconds(s: number): string {
  return s < 60 ? `${s.toFixed(1)} s`
                : `${Math.floor(s / 60)} min ${Math.floor(s % 60)} s`;
}

// "a", "a and b", "a, b and c".
export function list(names: string[]): string {
  if (names.length < 2) return names.join('');
  return `${names.slice(0, -1).join(', ')} and ${names[names.length - 1]}`;
}
