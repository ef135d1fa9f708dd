import assert from 'node:assert/strict';
import test from 'node:test';
import {planarPage} from '../fixture.mjs';
import {load} from '../load.mjs';

const {ellipse, pairsOf} = await load('panels/ellipses.tsx');
const {modelColor} = await load('colors.ts');

test('the ellipse is where the normalised distance is that of 95 %', () => {
  const pair = {x: {value: 1, std: 0.1}, y: {value: -2, std: 3}, correlation: -0.8};
  const {x, y} = ellipse(pair);
  x.forEach((_, i) => {
    const u = (x[i] - 1) / 0.1, v = (y[i] + 2) / 3, r = -0.8;
    assert.ok(Math.abs((u * u - 2 * r * u * v + v * v) / (1 - r * r) - 5.991) < 1e-9);
  });
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
