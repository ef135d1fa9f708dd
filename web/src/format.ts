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
  return text === '–' || unit === '' || unit === '-' ? text : `${text} ${unit}`;
}

// An error as a multiple of the noise.
export function fmtTimes(x: number | null | undefined): string {
  const text = fmt(x, 3);
  return text === '–' ? text : `${text} × noise`;
}

// Below 1e-12 only rounding is left.
export function fmtP(p: number | null): string {
  if (p === null || !Number.isFinite(p)) return '–';
  return p < 1e-12 ? '< 1e-12' : fmt(p, 2);
}

export function fmtSeconds(s: number): string {
  return s < 60 ? `${s.toFixed(1)} s`
                : `${Math.floor(s / 60)} min ${Math.floor(s % 60)} s`;
}

// "a", "a and b", "a, b and c".
export function list(names: string[]): string {
  if (names.length < 2) return names.join('');
  return `${names.slice(0, -1).join(', ')} and ${names[names.length - 1]}`;
}
