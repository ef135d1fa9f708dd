import assert from 'node:assert/strict';
import test from 'node:test';
import {load} from '../load.mjs';

const {decimate} = await load('plots/decimate.ts');
const times = n => Float32Array.from({length: n}, (_, i) => i / 100);

test('few samples stay as they are, gaps as null', () => {
  const [x, y] = decimate(times(4), [Float32Array.from([1, NaN, 3, 4])], 0, 1, 100);
  assert.equal(x.length, 4);
  assert.deepEqual(y, [1, null, 3, 4]);
});

test('many samples become two for each bucket', () => {
  const n = 100000;
  const [x, y] = decimate(times(n), [times(n)], 0, 1000, 500);
  assert.equal(x.length, 1000);
  assert.equal(y.length, 1000);
  for (let i = 1; i < x.length; ++i) assert.ok(x[i] >= x[i - 1]);
});

test('a single spike survives, whichever way it points', () => {
  for (const spike of [50, -50]) {
    const v = new Float32Array(100000);
    v[54321] = spike;
    const [x, y] = decimate(times(v.length), [v], 0, 1000, 300);
    const at = y.indexOf(spike);
    assert.ok(at >= 0);
    assert.ok(Math.abs(x[at] - 543.21) < 1000 / 300);
  }
});

test('extremes keep their order', () => {
  const v = Float32Array.from({length: 10000}, (_, i) => i % 100 < 50 ? 1 : -1);
  const [, y] = decimate(times(v.length), [v], 0, 100, 100);
  assert.deepEqual(y.slice(2, 4), [1, -1]);
});

test('a zoom takes one sample more on each side', () => {
  const [x] = decimate(times(1000), [times(1000)], 2.005, 2.025, 100);
  assert.ok(x[0] <= 2.005 && x[x.length - 1] >= 2.025);
  assert.ok(x.length <= 6);
});

test('a bucket without data is a gap', () => {
  const v = new Float32Array(100000).fill(1);
  v.fill(NaN, 40000, 60000);
  const [, y] = decimate(times(v.length), [v], 0, 1000, 100);
  assert.equal(y[100], null);
  assert.equal(y[0], 1);
});
