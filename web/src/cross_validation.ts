// Errors by cross-validation: two models stretch by stretch, and the path of a
// search (docs/theory.md, section 7).
import {modelWithId, withOthers} from './data';
import {fmt} from './format';
import type {CrossValidationData, ModelData, PageData, ParameterData, StepData} from './page_data';

// Of the errors of two models over the same stretches.
export interface Ratio {
  log: number; // the mean of ln(error of a / error of b), (7.12)
  stdError: number;
  lower: number; // stretches in which b has the lower error
  of: number;
}

// Null where there are too few stretches for a standard error.
export function compareStretches(a: CrossValidationData | null | undefined, b: CrossValidationData | null | undefined): Ratio | null {
  if (!a || !b || a.stretches.length !== b.stretches.length) return null;
  const logs: number[] = [];
  a.stretches.forEach(({error}, i) => {
    const other = b.stretches[i].error;
    if (error !== null && other !== null && error > 0 && other > 0) logs.push(Math.log(error / other));
  });
  const n = logs.length;
  if (n < 2) return null;
  const mean = logs.reduce((x, y) => x + y, 0) / n;
  const squares = logs.reduce((x, y) => x + (y - mean) ** 2, 0);
  return {log: mean, stdError: Math.sqrt(squares / (n * (n - 1))), lower: logs.filter(l => l > 0).length, of: n};
}

// Of Student's distribution, two-sided 95 %, by the degrees of freedom; beyond
// the table to two digits.
const kStudent = [12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23];
export const student = (dof: number) => kStudent[dof - 1] ?? 1.96 + 2.5 / dof;

// How many times as large the error of a is, with its 95 % interval.
export function factorOf({log, stdError, of}: Ratio): string {
  const [low, high] = [-1, 1].map(side => Math.exp(log + side * student(of - 1) * stdError));
  return `${fmt(Math.exp(log), 3)} (${fmt(low, 3)} to ${fmt(high, 3)})`;
}

// 34.1 ± 2.2
export function fmtCrossValidation(cv: CrossValidationData | null | undefined): string {
  if (!cv) return '–';
  const error = fmt(cv.error, 3);
  return cv.stdError === null ? error : `${error} ± ${fmt(cv.stdError, 2)}`;
}

const kSame = 0.01; // of lengths of segments

export function sameSegments(a: number | null | undefined, b: number | null | undefined): boolean {
  return !!a && !!b && Math.abs(a - b) < kSame * b;
}

// The errors before and after a step over the same segments, null where there
// are none.
export function ofStep(page: PageData, step: StepData): {before: CrossValidationData | null; after: CrossValidationData | null} {
  const none = {before: null, after: null};
  const from = step.from === null ? undefined : modelWithId(page, step.from);
  const to = modelWithId(page, step.model);
  if (!to?.crossValidation) return none;
  if (step.crossValidationBefore && sameSegments(step.segment_s, to.segment_s)) {
    return {before: step.crossValidationBefore, after: to.crossValidation};
  }
  return from?.crossValidation && sameSegments(from.segment_s, to.segment_s)
    ? {before: from.crossValidation, after: to.crossValidation} : none;
}

export interface PathPoint {
  model: number; // id
  effects: number; // that were added
  segment_s: number;
  cv: CrossValidationData;
}

export interface PathEdge {
  from: PathPoint;
  to: PathPoint;
  longer: boolean; // the same model over other segments
}

// The steps of `way` as points and what joins them; each step is over one length
// of segments, and the same model stands once more where that changes.
export function pathOf(page: PageData, way: StepData[]): {points: PathPoint[]; edges: PathEdge[]} {
  const points: PathPoint[] = [], edges: PathEdge[] = [];
  const at = (model: ModelData | undefined, cv: CrossValidationData | null | undefined, segment_s: number): PathPoint | null => {
    if (!model || !cv) return null;
    const known = points.find(p => p.model === model.id && sameSegments(p.segment_s, segment_s));
    if (known) return known;
    const point = {model: model.id, effects: model.effects.length, segment_s, cv};
    const other = [...points].reverse().find(p => p.model === model.id);
    if (other) edges.push({from: other, to: point, longer: true});
    points.push(point);
    return point;
  };
  for (const step of way) {
    const from = step.from === null ? undefined : modelWithId(page, step.from), to = modelWithId(page, step.model);
    if (from) at(from, from.crossValidation, from.segment_s);
    const before = at(from, step.crossValidationBefore ?? from?.crossValidation, step.crossValidationBefore ? step.segment_s ?? 0 : from?.segment_s ?? 0);
    const after = at(to, to?.crossValidation, to?.segment_s ?? 0);
    if (before && after) edges.push({from: before, to: after, longer: !sameSegments(before.segment_s, after.segment_s)});
  }
  return {points, edges};
}

export const sameEffects = (a: string[], b: string[]): boolean => a.length === b.length && a.every(e => b.includes(e));

// What tells of an effect that it is there.
export interface Evidence {
  effects: string[]; // more than one where they were added together
  instead: string[]; // that were removed in the same step
  parameters: {name: string; unit: string; value: number | null; stdError: number | null}[];
  without: CrossValidationData | null;
  with: CrossValidationData | null;
}

// Of the effects of a model: by the model without it, where the search ended in
// that model; else by the last step that added it. Of a model to which nothing
// was added: of the candidate that was accepted.
export function evidenceOf(page: PageData, model: ModelData, way: StepData[]): Evidence[] {
  const found: Evidence[] = [];
  const estimates = (effects: string[]): ParameterData[] => model.parameters.filter(p => p.ofEffect !== null && effects.includes(p.ofEffect));
  const told = new Set<string>();
  const ended = page.leftOut && sameEffects(page.leftOut.effects, model.effects) ? page.leftOut : null;
  for (const {effect, crossValidation} of ended?.without ?? []) {
    told.add(effect);
    found.push({effects: [effect], instead: [], parameters: estimates([effect]), without: crossValidation, with: ended?.with ?? null});
  }
  for (const step of [...way].reverse()) {
    const to = modelWithId(page, step.model), from = step.from === null ? undefined : modelWithId(page, step.from);
    const effects = (to?.effects ?? []).filter(e => !from?.effects.includes(e) && model.effects.includes(e) && !told.has(e));
    if (!effects.length) continue;
    effects.forEach(e => told.add(e));
    const {before, after} = ofStep(page, step);
    found.unshift({effects, instead: (from?.effects ?? []).filter(e => !to?.effects.includes(e)), parameters: estimates(effects), without: before, with: after});
  }
  if (model.effects.length) return found;
  const first = model.candidates[0];
  if (!first?.accepted || !first.confirmed || way.length) return found;
  const {confirmed} = first;
  const own = confirmed.parameters.map(p => ({...p, stdError: first.expected.find(e => e.name === p.name)?.stdError ?? null}));
  return [{effects: withOthers(first),
    instead: [], parameters: own, without: model.crossValidation ?? null, with: confirmed.crossValidation ?? null}];
}
