import assert from 'node:assert/strict';
import test from 'node:test';
import {crossValidation, planarPage, undecidedPage} from '../fixture.mjs';
import {load} from '../load.mjs';

const cv = await load('cross_validation.ts');

const of = errors => crossValidation(errors.map((error, i) => ({trajectory: 'run.csv', t_start: i, t_end: i + 1, error})));

test('two models are compared stretch by stretch', () => {
  const ratio = cv.compareStretches(of([2, 20, null, 0.2]), of([1, 10, 3, 0.1]));
  assert.ok(Math.abs(ratio.log - Math.log(2)) < 1e-12);
  assert.ok(ratio.stdError < 1e-12);
  assert.equal(ratio.lower, 3);
  assert.equal(ratio.of, 3);
  assert.equal(cv.factorOf(ratio), '2 (2 to 2)');
  assert.equal(cv.compareStretches(of([1, 2, 3, 4]), of([1, 2])), null);
  assert.equal(cv.compareStretches(null, of([1, 2])), null);
  assert.equal(cv.compareStretches(of([1]), of([2])), null, 'no standard error of one');
});

test('the interval of a factor is that of its logarithm', () => {
  assert.equal(cv.factorOf({log: Math.log(3), stdError: 0.1, lower: 9, of: 10}), '3 (2.39 to 3.76)');
  // One or two stretches say little.
  assert.equal(cv.factorOf({log: Math.log(3), stdError: 0.1, lower: 2, of: 2}), '3 (0.842 to 10.7)');
  assert.ok(Math.abs(cv.student(19) - 2.093) < 0.005);
});

test('a path has a model once for each length of segments', () => {
  const page = undecidedPage();
  const {points, edges} = cv.pathOf(page, page.steps);
  assert.deepEqual(points.map(p => [p.model, p.effects, p.segment_s]), [[0, 0, 2], [1, 1, 2], [1, 1, 4], [2, 2, 4]]);
  assert.deepEqual(edges.map(e => [points.indexOf(e.from), points.indexOf(e.to), e.longer]), [[0, 1, false], [1, 2, true], [2, 3, false]]);
});

test('what speaks for an effect is its step, over the same segments', () => {
  const page = undecidedPage();
  const found = cv.evidenceOf(page, page.models[2], page.steps);
  assert.deepEqual(found.map(e => e.effects), [['coulomb_friction@joint2'], ['viscous_damping@joint1']]);
  assert.equal(found[1].without, page.steps[1].crossValidationBefore);
  assert.equal(found[1].with, page.models[2].crossValidation);
  assert.deepEqual(found.map(e => e.parameters.map(p => p.name)), [['joint2.friction'], ['joint1.damping']]);
  assert.deepEqual(found.map(e => e.instead), [[], []]);
  // Over other segments there is nothing to compare.
  page.models[2].segment_s = 8;
  assert.equal(cv.evidenceOf(page, page.models[2], page.steps)[1].with, null);
});

test('what speaks for an effect is the model in which the search ended, without it', () => {
  const page = undecidedPage();
  const [friction, damping] = page.models[2].effects;
  page.leftOut = {effects: [damping, friction], with: of([1, 2]), without: [{effect: damping, crossValidation: of([3, 4])}]};
  const found = cv.evidenceOf(page, page.models[2], page.steps);
  assert.deepEqual(found.map(e => e.effects), [[friction], [damping]], 'what was not tried without is told by its step');
  assert.equal(found[1].without, page.leftOut.without[0].crossValidation);
  assert.equal(found[1].with, page.leftOut.with);
  assert.deepEqual(found[1].parameters.map(p => p.name), ['joint1.damping']);
  // Of another model it says nothing.
  page.leftOut.effects = [damping];
  assert.equal(cv.evidenceOf(page, page.models[2], page.steps)[1].without, page.steps[1].crossValidationBefore);
});

test('where nothing was added, what speaks for the first candidate is its refit', () => {
  const page = planarPage();
  const [one, ...more] = cv.evidenceOf(page, page.models[0], []);
  assert.deepEqual(more, []);
  assert.deepEqual(one.effects, ['coulomb_friction@joint2']);
  assert.equal(one.with, page.models[1].crossValidation);
  page.models[0].candidates[0].accepted = false;
  assert.deepEqual(cv.evidenceOf(page, page.models[0], []), []);
});
