import assert from 'node:assert/strict';
import test from 'node:test';
import {planarPage} from '../fixture.mjs';
import {load} from '../load.mjs';

const {ellipse, pairsOf} = await load('panels/ellipses.tsx');
const {modelColor} = await load('colors.ts');

const free = {lower: -Infinity, upper: Infinity};
const pair = {x: {value: 1, std: 0.1, ...free}, y: {value: -2, std: 3, ...free}, correlation: -0.8};
const distance = (x, y) => {
  const u = (x - 1) / 0.1, v = (y + 2) / 3, r = -0.8;
  return (u * u - 2 * r * u * v + v * v) / (1 - r * r);
};

test('the ellipse is where the normalised distance is that of 95 %', () => {
  const {x, y, cut} = ellipse(pair);
  assert.equal(cut, false);
  assert.ok(x.length > 90);
  x.forEach((_, i) => assert.ok(Math.abs(distance(x[i], y[i]) - 5.991) < 1e-9));
});

test('the ellipse ends at a bound', () => {
  const {x, y, cut} = ellipse({...pair, x: {...pair.x, lower: 0.9}});
  assert.equal(cut, true);
  assert.ok(Math.abs(Math.min(...x) - 0.9) < 1e-12 && Math.max(...x) > 1.2);
  x.forEach((_, i) => assert.ok(x[i] < 0.9 + 1e-12 ? distance(x[i], y[i]) < 5.992 : Math.abs(distance(x[i], y[i]) - 5.991) < 1e-9));
  assert.equal(x[0], x.at(-1));
  assert.equal(y[0], y.at(-1));
});

test('an ellipse that encloses its bounds leaves their rectangle', () => {
  const within = {lower: 0, upper: 1, value: 0.5, std: 1};
  const {x, y, cut} = ellipse({x: within, y: within, correlation: 0});
  assert.equal(cut, true);
  const corners = new Set(x.map((_, i) => `${x[i].toFixed(6)} ${y[i].toFixed(6)}`));
  for (const corner of ['0.000000 0.000000', '0.000000 1.000000', '1.000000 0.000000', '1.000000 1.000000']) assert.ok(corners.has(corner), corner);
});

test('the pair with the strongest correlation comes first, and one without any not at all', () => {
  assert.deepEqual(pairsOf(planarPage().models[1]), [['link1.length', 'link2.length'], ['link1.length', 'joint2.friction']]);
});

test('a model keeps its colour, and two that are compared never share one', () => {
  assert.equal(modelColor(0), modelColor(0, 3));
  assert.equal(modelColor(3, 0), modelColor(3));
  assert.notEqual(modelColor(7, 0), modelColor(0));
  assert.equal(modelColor(0, 0), modelColor(0));
});
