// What the frozen page shows of whether each law is constant, and of formulas.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';
import {planarPage, split, standInPage} from '../fixture.mjs';
import {launch, without} from './chromium.mjs';
import {settled, text, visitReport} from './open.mjs';

const skip = without;
let browser;
before(async () => { if (!skip) browser = await launch(); });
after(async () => { await browser?.close(); });

const visit = (...report) => visitReport(browser, ...report);

test('each parameter has a panel for all that the data are split by, what stands in first', {skip}, () =>
  visit('stand_in.html', standInPage(), async page => {
    const heads = await page.locator('.stability h4').allInnerTexts();
    assert.match(heads[0], /^joint2\.damping\s+of viscous_damping@joint2\s+stands in for another law$/);
    assert.match(heads[1], /^gravity_tilt_x\s+of gravity_tilt@base; by the motion of joint1$/);
    assert.deepEqual((await page.locator('.stability figcaption').allInnerTexts()).map(t => t.replaceAll('\u00a0', ' ')), [
      'By time: constant within 5 %', 'By speed: falls from slow to fast', 'By position: constant within 9 %', 'By run: constant within 8 %',
      'By time: constant within 2 %', 'By speed: constant within 4 %']);
    assert.match(await text(page, '.stability'), /What is missing grows more slowly with the speed than this law: the true one is flatter\./);
    assert.match(await text(page, '.stability'), /Runs: 1 is run_1\.csv\./);
  }));

test('only what is not constant has the colour of problems', {skip}, () =>
  visit('stand_in.html', standInPage(), async page => {
    const bad = page.locator('.stability .chart.bad');
    assert.equal(await bad.count(), 1);
    assert.match(await bad.innerText(), /By speed: falls/);
    assert.ok(await bad.locator('path[stroke="var(--bad)"]').count() >= 2);
    assert.equal(await page.locator('.stability .chart:not(.bad) path[stroke="var(--bad)"]').count(), 0);
  }));

test('the panels of a parameter share the axis, have the line of all data and names that are read out', {skip}, () =>
  visit('stand_in.html', standInPage(), async page => {
    const charts = page.locator('.stability .small-charts').first().locator('svg[role=img]');
    const seen = await charts.evaluateAll(list => list.map(svg => ({
      ticks: [...svg.querySelectorAll('text[text-anchor=end]')].map(t => t.textContent).join(),
      line: svg.querySelector('.level').getAttribute('y1'), band: svg.querySelector('.level-band').getAttribute('height'), bottom: svg.getBoundingClientRect().bottom})));
    assert.equal(seen.length, 4);
    for (const key of ['ticks', 'line', 'band', 'bottom']) assert.equal(new Set(seen.map(s => s[key])).size, 1, key);
    assert.ok(Number(seen[0].band) > 0);
    assert.equal(await charts.nth(1).getAttribute('aria-label'), 'joint2.damping. By speed: falls from slow to fast: N m s/rad against speed, rad/s');
    assert.match(await page.locator('.stability figure').nth(2).innerText(), /Where a bar leaves the panel/);
  }));

test('the verdict leads to what is not constant, also where its panel is folded', {skip}, () =>
  visit('stand_in.html', standInPage(), async page => {
    assert.match(await text(page, '#verdict .evidence'), /viscous_damping@joint2: not constant, stands in for another law/);
    assert.equal(await page.locator('#verdict a.bad').count(), 1);
    assert.match(await page.locator('#which tbody tr').filter({hasText: 'viscous_damping'}).first().innerText(), /not constant/);
    await page.getByRole('button', {name: 'Fold Which effect'}).or(page.locator('#which .fold')).first().click();
    assert.equal(await page.locator('.stability').count(), 0);
    await page.locator('#verdict a.bad').click();
    await settled(page);
    assert.equal(await page.locator('.stability').isVisible(), true);
  }));

test('of many parameters the most telling are shown, and the others counted', {skip}, () => {
  const document = standInPage();
  for (const model of document.models) {
    model.standIns = [];
    model.stability = Array.from({length: 9}, (_, i) => split(`spring@joint${i}`, `joint${i}.stiffness`, 'time', [0, 8], [1, 1 + 0.01 * i], [0.01, 0.01]));
  }
  return visit('arm.html', document, async page => {
    assert.deepEqual((await page.locator('.stability h4').allInnerTexts()).map(t => t.split(/\s/)[0]),
      [8, 7, 6, 5, 4, 3].map(i => `joint${i}.stiffness`));
    assert.match(await text(page, '.stability'), /3 more parameters, .* are in the diagnosis\.json of sysid_diagnose, under stability\./);
  });
});

test('where nothing was asked there is nothing of it, also in older documents', {skip}, async () => {
  const old = planarPage();
  for (const m of old.models) for (const key of ['stability', 'standIns', 'proposals']) delete m[key];
  for (const document of [planarPage(), old]) {
    await visit('planar.html', document, async page => {
      assert.equal(await page.locator('.stability, .proposals, a.bad').count(), 0);
      assert.equal(await page.locator('[role=alert]').count(), 0);
    });
  }
});

test('formulas stand with their errors and the command that tries the first', {skip}, () =>
  visit('stand_in.html', standInPage(), async page => {
    const said = await text(page, '#which .proposals');
    assert.match(said, /custom@joint2: c1\*qd\/\(0\.01\+abs\(qd\)\)\s+joint2\.c1 -0\.0497 ± 2\.2e-4\s+1\.06\s+1\.09/);
    assert.match(said, /over segments of 2 s/);
    assert.match(said, /--add 'custom@joint2: c1\*qd/);
  }));
