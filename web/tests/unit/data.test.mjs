import assert from 'node:assert/strict';
import test from 'node:test';
import {fitPage, planarPage, series, sphericalPage} from '../fixture.mjs';
import {load} from '../load.mjs';

const data = await load('data.ts');

test('decodes base64 float32 with missing values', () => {
  const values = data.decode(series([1.5, NaN, -2]));
  assert.deepEqual([...values], [1.5, NaN, -2]);
});

test('decodes steps of what is only drawn', () => {
  assert.deepEqual([...data.decode({u16: 'AAD///9//v8=', step: 2 / 65534, offset: -1})], [-1, NaN, 0, 1]);
});

test('decodes nothing to nothing', () => {
  assert.equal(data.decode({f32: ''}).length, 0);
});

test('adds the offset in double precision', () => {
  const values = data.decode({...series([0, 0.01]), offset: 1700000000});
  assert.equal(values[1] - values[0] > 0.009, true);
  assert.equal(values[0], 1700000000);
});

test('decodes a series once', () => {
  const s = series([1]);
  assert.equal(data.decode(s), data.decode(s));
});

test('finds the nearest sample', () => {
  const t = Float32Array.from([0, 1, 2, 4]);
  for (const [at, index] of [[-1, 0], [0.4, 0], [0.6, 1], [2.9, 2], [3.1, 3], [9, 3]]) {
    assert.equal(data.nearest(t, at), index, `at ${at}`);
  }
});

test('takes no document from an empty element', () => {
  assert.equal(data.inlined(''), null);
  assert.equal(data.inlined(' \n'), null);
});

test('refuses a document of another schema by name', () => {
  assert.throws(() => data.inlined('{"schema": "sysid.page/9"}'), /reads sysid.page\/1.*sysid.page\/9/);
});

test('a curve is taken to other times along its lines, and not across gaps or beyond its ends', () => {
  const at = data.interpolated([0, 1, 2, 3], [0, 10, NaN, 30], Float64Array.from([-1, 0, 0.25, 1, 1.5, 3, 4]));
  assert.deepEqual([...at], [NaN, 0, 2.5, 10, NaN, 30, NaN]);
});

test('the error map has the rms of each piece', () => {
  const page = planarPage();
  const one = data.errorMap(page, 0, 0, 1);
  const residual = data.decode(page.models[0].predictions[0].channels[1].residual[0]).filter(v => !Number.isNaN(v));
  const rms = Math.sqrt(residual.reduce((s, v) => s + v * v, 0) / residual.length);
  assert.ok(Math.abs(one.cells[1][0] / rms - 1) < 1e-6);
  assert.deepEqual(one.rows, ['joint1', 'joint2']);
});

test('the error map tells where nothing was measured', () => {
  const map = data.errorMap(planarPage(), 0, 0, 370);
  assert.ok(Number.isNaN(map.cells[1][19])); // holds samples 42 and 43, which are missing
  assert.ok(Number.isFinite(map.cells[0][19]));
});

test('the error of a joint joins its components', () => {
  const page = sphericalPage();
  const error = data.jointError(page, 0, 0, 'joint1');
  const parts = page.models[0].predictions[0].channels[0].residual.map(data.decode);
  const expected = Math.sqrt(parts.reduce((s, p) => s + p[150] ** 2, 0) / 3);
  assert.ok(Math.abs(error[150] - expected) < 1e-5);
  assert.ok(data.jointError(page, 0, 0, 'joint2').every(Number.isNaN));
});

test('the tilt of a quaternion is the angle between the z axes', () => {
  assert.ok(Math.abs(data.tilt(Math.sin(0.35), 0) - 0.7) < 1e-9);
  assert.equal(data.tilt(0, 0), 0);
});

test('each effect is drawn against what its law depends on', () => {
  for (const [effect, quantity] of [['coulomb_friction', 'velocity'], ['quadratic_drag', 'velocity'], ['spring', 'position'], ['cogging', 'position'], ['effort_gain', 'effort']]) {
    assert.equal(data.lawQuantity(effect), quantity, effect);
  }
});

test('names the worst channel and segment', () => {
  const model = fitPage().models[0];
  assert.equal(data.worstChannel(model).name, 'joint2');
  assert.equal(data.worstSegment(model).normalized_rms, Math.max(...model.segments.map(s => s.normalized_rms)));
});

test('the colours of errors begin where nearly all are', () => {
  assert.equal(data.leastError([0.2, 0.9, 5]), 1);
  assert.equal(data.leastError([NaN]), 1);
  assert.equal(data.leastError(Float32Array.from({length: 100}, (_, i) => 50 + i)), 55);
});

test('runs are named by their files, and by folders only where they must be', () => {
  assert.deepEqual(data.runLabels(['/a/b/one.csv', '/a/b/two.csv']), ['one.csv', 'two.csv']);
  assert.deepEqual(data.runLabels(['a/x/one.csv', 'a/y/one.csv', 'two.csv']), ['x/one.csv', 'y/one.csv', 'two.csv']);
  assert.deepEqual(data.runLabels(['one.csv', 'a/one.csv']), ['one.csv', 'a/one.csv']);
  assert.deepEqual(data.runLabels(['one.csv', 'one.csv']), ['one.csv', 'one.csv']);
});

test('the way to a model goes by those that it came of', () => {
  const page = planarPage();
  page.steps.push({...page.steps[0], title: 'b', model: 3, from: 0}, {...page.steps[0], title: 'c', model: 4, from: 1});
  assert.deepEqual(data.wayTo(page, 4).map(s => s.title), ['+ coulomb_friction@joint2', 'c']);
  assert.deepEqual(data.wayTo(page, 3).map(s => s.title), ['b']);
  assert.deepEqual(data.wayTo(page, 0), []);
});

test('a cost that rises begins another stage of Levenberg-Marquardt, and none of Adam', () => {
  const points = [9, 4, 4, 80, 70].map((cost, iteration) => ({iteration, cost, time_s: iteration}));
  assert.deepEqual(data.inStages('lm', points).map(p => p.cost), [9, 4, 4, NaN, 80, 70]);
  assert.equal(data.inStages('Adam', points), points);
});
