// The unexplained force of a joint against a quantity, with laws over it.
import {kOkabeIto} from '../colors';
import {candidateName, decode, forceName, quantityUnit, type Numbers, type Quantity} from '../data';
import type {CandidateData, ForceData, ModelData, PageData, Series} from '../page_data';
import type {Layer} from '../plots/xy_chart';

export const kQuantities: Quantity[] = ['position', 'velocity', 'effort'];

// Candidates that add a force at `place`, best first.
export function lawsOf(model: ModelData, place: string): CandidateData[] {
  return model.candidates.filter(c => c.force.length && model.force.some((f, i) =>
      forceName(f) === place && decode(c.force[i]).some(v => Math.abs(v) > 0)));
}

export function quantityName(page: PageData, model: ModelData, place: string, quantity: Quantity): string {
  const force = model.force.find(f => forceName(f) === place)!;
  const joint = page.mechanism.joints.find(j => j.name === force.joint);
  const name = quantity === 'position' && joint?.type === 'spherical' ? 'tilt' : quantity;
  return `${name}, ${quantityUnit(page, force.joint, quantity)}`;
}

// Null where the quantity was not recorded. `order` gives each law its colour.
export function forceLayers(model: ModelData, place: string, quantity: Quantity,
                            laws: CandidateData[], order: CandidateData[]): Layer[] | null {
  const of = model.force.map((f, i) => ({f, i})).filter(({f}) => forceName(f) === place);
  const join = (part: (f: ForceData, i: number) => Series) =>
      of.flatMap(({f, i}) => padded(decode(part(f, i)), decode(f.value).length));
  const x = join(f => f[quantity]);
  if (!x.some(Number.isFinite)) return null;
  const dots: Layer = {
    label: 'unexplained force', color: 'var(--measured)', kind: 'points', size: 4, opacity: 0.7,
    x, y: join(f => f.value), error: join(f => f.std),
  };
  // The dots last, over the laws.
  return [...laws.map(c => {
    const y = join((_, i) => c.force[i]);
    return lawLayer(c, x, y, kOkabeIto[(order.indexOf(c) + 1) % kOkabeIto.length]);
  }), dots];
}

// What one of several runs lacks is missing, and the others keep their places.
function padded(values: Numbers, n: number): number[] {
  return Array.from({length: n}, (_, i) => i < values.length ? values[i] : NaN);
}

const kCurvePoints = 120;

// Knots lie so close that a law that is steep between them (friction where the
// motion turns) would zigzag: the mean of each piece of the range.
function averaged(x: number[], y: number[]): [number[], number[]] {
  if (x.length < 2 * kCurvePoints) return [x, y];
  const low = x[0], width = (x[x.length - 1] - low) / kCurvePoints || 1;
  const ax: number[] = [], ay: number[] = [];
  for (let i = 0, next = 0; i < x.length; i = next) {
    const piece = Math.floor((x[i] - low) / width);
    let sumX = 0, sumY = 0;
    for (next = i; next < x.length && Math.floor((x[next] - low) / width) === piece; ++next) {
      sumX += x[next];
      sumY += y[next];
    }
    ax.push(sumX / (next - i));
    ay.push(sumY / (next - i));
  }
  return [ax, ay];
}

// A curve where the law is a function of x, else dots.
function lawLayer(c: CandidateData, x: number[], y: number[], color: string): Layer {
  const order = x.map((_, i) => i).filter(i => Number.isFinite(x[i]) && Number.isFinite(y[i]))
    .sort((a, b) => x[a] - x[b]);
  const sx = order.map(i => x[i]), sy = order.map(i => y[i]);
  let low = Infinity, high = -Infinity, way = 0;
  sy.forEach((v, i) => {
    low = Math.min(low, v);
    high = Math.max(high, v);
    if (i) way += Math.abs(v - sy[i - 1]);
  });
  const curve = way <= 6 * (high - low);
  const [x2, y2] = curve ? averaged(sx, sy) : [sx, sy];
  return {label: candidateName(c), color, x: x2, y: y2, kind: curve ? 'line' : 'points', size: curve ? 2.5 : 4, opacity: curve ? 1 : 0.6};
}
