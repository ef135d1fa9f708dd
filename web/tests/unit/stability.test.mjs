import assert from 'node:assert/strict';
import test from 'node:test';
import {split, standInPage} from '../fixture.mjs';
import {load} from '../load.mjs';

const stability = await load('stability.ts');
const {axisOf, constancyOf, leaves, mean, meaning, rangeOf, runsOf} = stability;

const inWords = one => stability.inWords(one).replaceAll('\u00a0', ' ');
const of = (values, stdError, more = {}, strata = 'speed') =>
  split('viscous_damping@joint2', 'joint2.damping', strata, [0, 4], values, values.map(() => stdError), more);

test('parameters of what stands in come first, then those whose values lie farthest apart', () => {
  const model = standInPage().models[0];
  assert.deepEqual(constancyOf(model).map(p => [p.parameter, p.standsIn, p.splits.map(s => s.strata)]), [
    ['joint2.damping', true, ['time', 'speed', 'position', 'run']],
    ['gravity_tilt_x', false, ['time', 'speed']]]);
  const far = {...of([1, 2, 1, 2], 0.1), parameter: 'far'}, near = {...of([1, 1.1, 1, 1.1], 0.1), parameter: 'near'};
  assert.deepEqual(constancyOf({...model, stability: [near, far], standIns: []}).map(p => p.parameter), ['far', 'near']);
});

test('what was not asked, or is known in one part only, is nothing to show', () => {
  const model = standInPage().models[0];
  assert.deepEqual(constancyOf({...model, stability: undefined, standIns: undefined}), []);
  const one = of([1, 2], 0.1);
  one.estimates[1].value = null;
  assert.deepEqual(constancyOf({...model, stability: [one]}), []);
});

test('the words say how constant a parameter is', () => {
  assert.equal(inWords(of([1, 1.01, 0.99, 1], 0.005, {spread: 0.02})), 'By speed: constant within 2 %');
  assert.equal(inWords(of([1, 1.01, 0.99, 1], 0.04, {spread: 0})), 'By speed: constant within 8 %');
  assert.equal(inWords(of([1, 1.1, 0.9, 1], 0.2, {spread: 0})), 'By speed: no change to be seen, each known to ± 39 %');
  assert.equal(inWords(of([1, 5, -3, 1], 2, {spread: 0})), 'By speed: cannot be told, the intervals are wider than the value');
  assert.equal(inWords(of([1, 1.4, 0.6, 1], 0.05, {spread: 0.3, least_spread: 0.2})), 'By speed: differs by 30 %, which matters little for the error');
  assert.equal(inWords(of([1, 1.4, 0.6, 1], 0.05, {spread: 0.3, least_spread: 0.1})), 'By speed: differs by 30 %, surely by 10 %');
  assert.equal(inWords(of([1, 1.4, 0.6, 1], 0.05, {spread: 0.3, least_spread: 0})), 'By speed: differs by 30 %, which may be chance');
});

test('the words say how a parameter changes, and what that says of the truth', () => {
  const changes = (values, trend, strata) => of(values, 0.01, {constant: false, spread: 0.5, least_spread: 0.4, trend}, strata);
  const rises = changes([1, 2, 3, 4], 'rises');
  assert.equal(inWords(rises), 'By speed: rises from slow to fast');
  assert.match(meaning(rises), /the true one is steeper/);
  const falls = changes([4, 3, 2, 1], 'falls', 'amplitude');
  assert.equal(inWords(falls), 'By amplitude: falls from small to large motions');
  assert.match(meaning(falls), /with the amplitude than this law: the true one is flatter/);
  assert.equal(inWords(changes([-4, -3, -2, -1], 'falls')), 'By speed: falls in size from slow to fast');
  assert.equal(inWords(changes([1, 3, 1, 3], 'none', 'position')), 'By position: changes up and down');
  assert.match(meaning(changes([1, 3], 'rises', 'run')), /from run to run/);
  assert.match(meaning(changes([1, 3], 'rises', 'time')), /warms up or drifts/);
  assert.equal(meaning(of([1, 1], 0.1)), '');
});

test('the mean is weighted', () => {
  assert.ok(Math.abs(mean(split('a', 'b', 'time', [0, 2], [1, 2], [0.1, 0.2])) - 1.2) < 1e-12);
});

test('the axis spans zero and what is known; what is hardly known leaves the panel', () => {
  const known = of([1, 1.1, 0.9, 1], 0.05), wild = split('a', 'b', 'position', [0, 4], [1, 50, 1, 1], [0.05, 30, 0.05, 0.05]);
  const range = rangeOf([known, wild]);
  assert.equal(Math.min(...range), 0);
  assert.ok(Math.max(...range) < 1.3);
  assert.equal(leaves(known, range), false);
  assert.equal(leaves(wild, range), true);
});

test('the axes have units of the joint, tilt for a spherical one', () => {
  const page = standInPage();
  const axes = ['time', 'speed', 'position', 'effort', 'amplitude', 'run'].map(strata => axisOf(page, of([1, 1], 0.1, {}, strata)));
  assert.deepEqual(axes, ['time, s', 'speed, rad/s', 'position, rad', 'effort, N m', 'amplitude, rad', 'run']);
  Object.assign(page.mechanism.joints[1], {type: 'prismatic', unit: 'm', effortUnit: 'N'});
  assert.equal(axisOf(page, of([1, 1], 0.1)), 'speed, m/s');
  assert.equal(axisOf(page, of([1, 1], 0.1, {}, 'effort')), 'effort, N');
  Object.assign(page.mechanism.joints[1], {type: 'spherical', unit: 'rad'});
  assert.equal(axisOf(page, of([1, 1], 0.1, {}, 'position')), 'tilt, rad');
});

test('a part of the runs ends before the next one begins', () => {
  const runs = split('a', 'b', 'run', [1, 4], [1, 1, 1], [0.1, 0.1, 0.1]);
  assert.deepEqual([0, 1, 2].map(i => runsOf(runs, i)), [[1, 1], [2, 2], [3, 4]]);
});
