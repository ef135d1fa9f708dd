import assert from 'node:assert/strict';
import test from 'node:test';
import {load} from '../load.mjs';

const f = await load('format.ts');
const {scaleOf} = await load('plots/axes.ts');
const {cividis, errorFraction} = await load('colors.ts');

test('numbers have four significant digits', () => {
  for (const [x, text] of [[0.123456, '0.1235'], [0, '0'], [12345.6, '12350'], [8.5e-5, '8.5e-5'], [1e6, '1e6'], [null, '–'], [NaN, '–'], [-2, '-2']]) {
    assert.equal(f.fmt(x), text);
  }
});

test('errors keep their zeros', () => {
  assert.equal(f.fmtTimes(1), '1.00 × noise');
  assert.equal(f.fmtTimes(16.23), '16.2 × noise');
  assert.equal(f.fmtTimes(null), '–');
});

test('units follow, and no unit does not', () => {
  assert.equal(f.fmtUnit(0.5, 'N m s^2/rad^2'), '0.5 N m s²/rad²');
  assert.equal(f.fmtUnit(0.5, '-'), '0.5');
  assert.equal(f.fmtUnit(null, 'm'), '–');
});

test('p-values end at 1e-12', () => {
  assert.equal(f.fmtP(0), '< 1e-12');
  assert.equal(f.fmtP(0.0213), '0.021');
});

test('ticks have the places that tell them apart', () => {
  assert.deepEqual(f.fmtTicks([1000.2, 1000.4, 1000.6]), ['1000.2', '1000.4', '1000.6']);
  assert.deepEqual(f.fmtTicks([0, 0.05, 0.1]), ['0', '0.05', '0.1']);
  assert.deepEqual(f.fmtTicks([-0.25, 0, 0.25, 0.5, 0.75]), ['-0.25', '0', '0.25', '0.5', '0.75']);
  assert.deepEqual(f.fmtTicks([0, 2.5, 5]), ['0', '2.5', '5']);
  assert.deepEqual(f.fmtTicks([-0.75, -0.25, 0.25]), ['-0.75', '-0.25', '0.25']);
  assert.deepEqual(f.fmtTicks([1700000000, 1700000002]), ['1700000000', '1700000002']);
});

test('lists read as English', () => {
  assert.equal(f.list(['a']), 'a');
  assert.equal(f.list(['a', 'b', 'c']), 'a, b and c');
});

test('scales hold their values', () => {
  for (const log of [false, true]) {
    const s = scaleOf([0.02, 3, 7], log);
    assert.ok(s.at(0.02) >= 0 && s.at(7) <= 1);
    assert.ok(s.ticks.length >= 2 && s.ticks.length <= 12);
  }
  assert.ok(Number.isFinite(scaleOf([], true).at(1)));
  assert.ok(Number.isFinite(scaleOf([2, 2], false).at(2)));
});

test('the noise floor is dark and the largest error bright', () => {
  assert.equal(cividis(errorFraction(0.8, 10)), 'rgb(0,34,78)');
  assert.equal(cividis(errorFraction(10, 10)), 'rgb(254,232,56)');
});

test('a range has as many places as its ends need', () => {
  assert.equal(f.fmtRange(0, 8), '0 s to 8 s');
  assert.equal(f.fmtRange(0.53011, 0.53042), '0.53011 s to 0.53042 s');
});

test('a sentence of a program has a capital and an end', () => {
  assert.equal(f.sentence('the last step gained nothing'), 'The last step gained nothing.');
  assert.equal(f.sentence('link1.mass ended at its bound'), 'link1.mass ended at its bound.');
  assert.equal(f.sentence('Are they?'), 'Are they?');
  assert.equal(f.sentence(''), '');
});

test('what has no unit is given none', () => {
  assert.equal(f.unitText('-'), '');
  assert.equal(f.fmtUnit(22, '-'), '22');
});
