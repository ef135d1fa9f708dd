// What the frozen page shows of a search: its path, what speaks for each effect,
// the rivals, the stretches that were left out.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';
import {failedPage, planarPage, undecidedPage} from '../fixture.mjs';
import {launch, without} from './chromium.mjs';
import {settled, text, visitReport} from './open.mjs';

const skip = without;
let browser;
before(async () => { if (!skip) browser = await launch(); });
after(async () => { await browser?.close(); });

const visit = (...report) => visitReport(browser, ...report);
const choose = async (page, label, option) => {
  await page.locator('.controls').getByLabel(label, {exact: true}).selectOption({label: option});
  await settled(page);
};

test('the verdict says how sure each effect is', {skip}, () =>
  visit('undecided.html', undecidedPage(), async page => {
    const said = await text(page, '#verdict .evidence');
    assert.match(said, /What was added, and how sure that is/);
    assert.match(said, /coulomb_friction@joint2\s+joint2\.friction 0\.04998 ± 1\.7e-4 N m\s+41\.5 ± 5\.9 → 0\.995 ± 0\.0099\s+41\.7 \(31 to 56\.2\)\s+16 of 16 stretches/);
    assert.match(said, /viscous_damping@joint1.*1\.58 \(1\.58 to 1\.58\)/s);
  }));

test('what is proposed has the evidence of its refit', {skip}, () => {
  const document = planarPage();
  return visit('proposed.html', {...document, models: document.models.slice(0, 1), steps: [], compared: null}, async page => {
    const said = await text(page, '#verdict .evidence');
    assert.match(said, /What is missing, and how sure that is/);
    assert.match(said, /coulomb_friction@joint2.*41\.7 \(31 to 56\.2\)/s);
  });
});

test('rivals are named with what would tell them apart', {skip}, () =>
  visit('undecided.html', undecidedPage(), async page => {
    const said = await text(page, '#verdict .rivals');
    assert.match(said, /coulomb_friction@joint2 and viscous_damping@joint1\s*chosen/);
    assert.match(said, /coulomb_friction@joint2 and quadratic_drag@joint1.*They differ only in how they grow over both slow and fast motion/s);
    assert.match(said, /The next experiment: if one of the rivals is right.*0\.99.*sysid_simulate --model pendulum2_planar --tilt 1\.2/s);
    assert.match(said, /quadratic_drag@joint1\s+1\.24 ± 0\.047\s+1\.31\s+1\.03 \(/, 'its errors');
    assert.doesNotMatch(await text(page, '#verdict'), /does not explain it/);
  }));

test('the path has every model, and marks the one in which it ended', {skip}, () =>
  visit('undecided.html', undecidedPage(), async page => {
    const chart = page.locator('#add svg[aria-label^="Cross-validated error against the number of effects"]');
    assert.deepEqual(await chart.locator('.mark').allTextContents(), ['0', '1', '2']);
    const figure = await text(page, '#add figure');
    assert.match(figure, /0 as given; 1 \+ coulomb_friction@joint2; 2 \+ viscous_damping@joint1\./);
    assert.match(figure, /the model in which it ended/);
    assert.match(figure, /other effects that were tried/);
  }));

test('the stretches of two models are compared over the same segments only', {skip}, () =>
  visit('undecided.html', undecidedPage(), async page => {
    await choose(page, 'Compared with', '+ coulomb_friction@joint2');
    assert.equal(await page.locator('#where .folds circle[cx][r]').count() >= 32, true);
    assert.match(await text(page, '#where .folds'), /The error of \+ coulomb_friction@joint2 is 0\.024 \(0\.0178 to 0\.0323\) times that of as given/);
    await choose(page, 'Compared with', '+ viscous_damping@joint1');
    assert.match(await text(page, '#where .folds'), /Their segments differ, so that the errors cannot be compared/);
  }));

test('a model that was not cross-validated has no stretches', {skip}, () =>
  visit('failed.html', failedPage(), async page => {
    await choose(page, 'Model', 'final fit, whole runs');
    assert.equal(await page.locator('#where .folds').count(), 0);
  }));

test('documents that know of no cross-validation are shown without', {skip}, () => {
  const document = planarPage();
  for (const m of document.models) for (const key of ['crossValidation', 'rivals', 'open']) delete m[key];
  for (const s of document.steps) delete s.crossValidationBefore;
  for (const c of document.models[0].candidates) if (c.confirmed) delete c.confirmed.crossValidation;
  return visit('old.html', document, async page => {
    assert.equal(await page.locator('.rivals, .folds').count(), 0);
    assert.equal(await page.locator('main > .warning').count(), 0);
  });
});

for (const width of [1280, 1920]) {
  test(`what is shown is chosen in one row at ${width} px, with nothing cut off`, {skip}, () => {
    const document = JSON.parse(JSON.stringify(undecidedPage()).replaceAll('run_1.csv', 'data/recordings/2026-11-20T14:03:11_hidden_friction.csv'));
    return visit('controls.html', document, async page => {
      const boxes = await page.$$eval('.controls button, .controls select, .controls output, .controls input',
        list => list.map(e => ({name: e.outerHTML.slice(0, 60), ...e.getBoundingClientRect().toJSON()})));
      assert.ok(boxes.length > 10);
      for (const b of boxes) {
        assert.ok(b.left >= 0 && b.right <= width && b.width > 20, JSON.stringify(b));
        assert.ok(b.top < boxes[0].bottom && b.bottom > boxes[0].top, `another row: ${b.name}`);
      }
      boxes.sort((a, b) => a.left - b.left);
      boxes.slice(1).forEach((b, i) => assert.ok(b.left >= boxes[i].right - 1, `${b.name} covers ${boxes[i].name}`));
    }, {width});
  });
}

test('in dark colours nothing has a light ground', {skip}, () =>
  visit('dark.html', planarPage(), async page => {
    const grounds = await page.$$eval('.view canvas, .matrix td', list => list.map(e => getComputedStyle(e).backgroundColor));
    grounds.push(await page.$eval('.chart .ground', e => getComputedStyle(e).fill));
    for (const ground of grounds) {
      const [r, g, b] = ground.match(/\d+/g).map(Number);
      assert.ok(0.2126 * r + 0.7152 * g + 0.0722 * b < 130, ground);
    }
  }, {colorScheme: 'dark'}));

test('a pair of parameters has its confidence region, of both models', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const said = await text(page, '#parameters .ellipses');
    assert.match(said, /95 % confidence region of link1\.length and link2\.length/);
    assert.match(said, /Their correlation is -0\.82\./);
    assert.match(said, /as given\s+\+ coulomb_friction@joint2/);
  }));

test('a model keeps its colour when it is compared', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const colors = () => page.$$eval('#compare .legend li', list => Object.fromEntries(list.map(e => [e.innerText.trim(), e.querySelector('line').getAttribute('stroke')])));
    const before = await colors();
    await choose(page, 'Model', '+ coulomb_friction@joint2');
    await choose(page, 'Compared with', 'as given');
    assert.deepEqual(await colors(), before);
  }));

test('whole runs have one measure, fitted or held out', {skip}, () =>
  visit('failed.html', failedPage(), async page => {
    assert.doesNotMatch(await text(page, '#verdict .tiles'), /Prediction of whole runs/);
    await choose(page, 'Model', 'final fit, whole runs');
    const tiles = await text(page, '#verdict .tiles');
    assert.match(tiles, /Prediction of whole runs\s+joint1, fitted: 0\.12 rad, fit 88\.0 %/);
    assert.match(tiles, /joint2, held out: 0\.24 rad, fit 76\.0 %/);
    assert.match(tiles, /over segments of 2 s, each from its own state: not to be compared/);
  }));

test('panels fold, one or all, and a link unfolds its own', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const height = () => page.evaluate(() => document.documentElement.scrollHeight);
    const whole = await height();
    await page.getByRole('button', {name: 'Fold 4 Where'}).click();
    await settled(page);
    assert.equal(await page.locator('#where .how').count(), 0);
    assert.ok(await height() < whole - 1000);
    await page.getByRole('button', {name: 'Unfold all'}).click();
    await page.getByRole('button', {name: 'Fold all'}).click();
    await settled(page);
    assert.deepEqual(await page.$$eval('.panel', list => list.filter(e => e.querySelector('.how')).map(e => e.id)), ['verdict']);
    await page.reload();
    await page.waitForSelector('#take-away');
    assert.equal(await page.locator('#where .how').count(), 0, 'a reload keeps them');
    await page.locator('nav').getByRole('link', {name: 'Which'}).click();
    assert.equal(await page.locator('#which table').count(), 1);
    await page.emulateMedia({media: 'print'});
    await page.waitForFunction(() => document.querySelectorAll('.panel .how').length >= 8);
  }));
