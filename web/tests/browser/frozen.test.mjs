// The frozen page, in Chromium, from disk, with the network off.
import assert from 'node:assert/strict';
import {readFile} from 'node:fs/promises';
import {after, before, test} from 'node:test';
import {drivenPage, failedPage, fitPage, planarPage, sphericalPage} from '../fixture.mjs';
import {kPatience_ms, launch, without} from './chromium.mjs';
import {compareTimes, html, openFile, ranges, settled, until, writeReport, zooming} from './open.mjs';

const skip = without;
let browser;
before(async () => { if (!skip) browser = await launch(); });
after(async () => { await browser?.close(); });

// Opens a fixture, runs `steps`, and expects no request and no complaint.
async function visit(name, document, steps, options) {
  const view = await openFile(browser, writeReport(name, document), options);
  try {
    await steps(view.page, view);
    assert.deepEqual(view.requests, [], 'requests');
    assert.deepEqual(view.complaints, [], 'complaints');
  } finally {
    await view.context.close();
  }
}

const kPanels = ['verdict', 'compare', 'mechanism', 'where', 'which', 'add', 'parameters', 'take-away'];
const text = (page, selector) => page.$eval(selector, e => e.innerText);
const choose = (page, label, option) => page.locator('.controls').getByLabel(label, {exact: true}).selectOption({label: option});

test('the page without data is small', () => {
  assert.ok(Buffer.byteLength(html) < 1.2e6, `${Buffer.byteLength(html)} bytes`);
});

test('nothing in the page names another place to load from', () => {
  assert.doesNotMatch(html, /<link[^>]*href="(?!data:)/);
  assert.doesNotMatch(html, /<script[^>]*src=/);
  assert.doesNotMatch(html, /sourceMappingURL|url\((?!["']?(data:|#))/);
});

test('every panel has a heading and says how to read it', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    for (const id of kPanels) {
      assert.equal(await page.locator(`#${id} h2`).count(), 1, id);
      assert.ok((await text(page, `#${id} .how`)).length > 40, id);
    }
    assert.equal(await page.locator('h1').count(), 1);
    assert.match(await page.title(), /pendulum2_planar/);
  }));

test('the verdict has its numbers, the worst joint and what cannot be told apart', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const verdict = await text(page, '#verdict');
    for (const part of [/An effect is missing/, /44\.\d × noise/, /coulomb_friction@joint2/, /→ 1\.04 × noise/, /joint2/,
      /coulomb_friction@joint2 is indistinguishable from stribeck_friction@joint2/,
      /link1.mass and link2.mass are not separately identifiable/]) {
      assert.match(verdict, part);
    }
    await page.getByRole('button', {name: 'Show it'}).click();
    await settled(page);
    assert.match(await text(page, '.zoom-range'), /^\d+ s to \d+ s$/);
    assert.equal(await page.locator('.controls select').first().evaluate(e => e.selectedOptions[0].textContent.includes('run_')), true);
  }));

test('what makes a fit unreliable comes before the verdict, and says so', {skip}, () =>
  visit('failed.html', failedPage(), async page => {
    const verdict = await text(page, '#verdict');
    const at = part => { const i = verdict.search(part); assert.ok(i >= 0, `${part} in ${verdict}`); return i; };
    assert.ok(at(/Unreliable fit/) < at(/An effect is missing/));
    assert.ok(at(/link1\.inertia_scale ended at its bound\./) < at(/An effect is missing/));
    assert.equal(verdict.match(/link1\.mass/g).length, 1, 'once');
    await choose(page, 'Model', '+ coulomb_friction@joint2');
    await settled(page);
    assert.doesNotMatch(await text(page, '#verdict'), /Unreliable fit/);
  }));

test('a parameter at its bound is distrusted also where no diagnosis says so', {skip}, () => {
  const document = fitPage();
  document.models[0].parameters[0].atBound = true;
  return visit('bound.html', document, async page =>
    assert.match(await text(page, '#verdict .distrust'), /link1\.length ended at its bound\./));
});

test('the page opens with what is true at the end', {skip}, () =>
  visit('failed.html', failedPage(), async page => {
    const end = await text(page, '#verdict .end');
    assert.match(end, /^In the end it still fails.*8\.75 times the noise/s);
    assert.match(await text(page, '#verdict .tiles'), /over segments of 2 s, each from its own state/);
    await page.getByRole('button', {name: 'Show the final model'}).click();
    await settled(page);
    assert.match(await text(page, '#compare .how'), /as one trajectory/);
    assert.match(await text(page, '#verdict .tiles'), /8\.75 × noise\s+of one trajectory over each run/);
  }));

test('a candidate that promises no fall has no prediction, and says why', {skip}, () =>
  visit('failed.html', failedPage(), async page => {
    assert.match(await text(page, '#which'), /No prediction \(–\): the model is too far from this data/);
    assert.match(await text(page, '#verdict'), /no prediction: the model is too far/);
    assert.match(await text(page, '#add'), /no prediction: the model is too far/);
    for (const id of ['verdict', 'which', 'add']) assert.doesNotMatch(await text(page, `#${id}`), /→ –/, id);
    assert.match(await page.$eval('#which tbody tr', e => e.innerText), /accepted.*1\s+the refit decides/s);
  }));

test('a rejected candidate says so, and why, unasked', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const row = page.locator('#which tbody tr').filter({hasText: 'viscous_damping'}).first();
    assert.match(await row.innerText(), /rejected\s.*the held-out error falls less/s);
  }));

test('a refit says what it is of only where that is more than the candidate over these segments', {skip}, () => {
  const data = planarPage();
  Object.assign(data.models[0].candidates[1].confirmed, {togetherWith: ['gravity_tilt@base'], segment_s: 4});
  return visit('refits.html', data, async page => {
    await page.getByRole('button', {name: 'Show all pictures'}).click();
    const words = await text(page, '#which');
    assert.match(words, /After the refit: joint2\.friction 0\.04998 N m\./);
    assert.match(words, /After the refit: joint2\.damping 0\.018 N m s\/rad, together with gravity_tilt@base, over segments of 4 s\./);
  });
});

test('effects that are added together are offered once, by what their refit left', {skip}, () => {
  const data = planarPage();
  const [first, second] = data.models[0].candidates;
  Object.assign(first.confirmed, {togetherWith: ['viscous_damping@joint2'], segment_s: 4});
  Object.assign(second.confirmed, {...first.confirmed, togetherWith: ['coulomb_friction@joint2']});
  return visit('together.html', data, async page => {
    const offers = await text(page, '#add .offers');
    assert.match(offers, /Add coulomb_friction@joint2,viscous_damping@joint2; after a refit: 1\.00 × noise, held out 1\.01 × noise, over segments of 4 s/);
    assert.doesNotMatch(offers, /Add viscous_damping@joint2,coulomb/);
    assert.match(offers, /Add quadratic_drag@joint2; predicted/);
  });
});

test('a step that was not predicted has no mark of it', {skip}, () => {
  const data = planarPage();
  data.steps[0].predicted = null;
  return visit('unpredicted.html', data, async page => {
    assert.doesNotMatch(await page.locator('#add figure').last().innerText(), /predicted/);
  });
});

test('the error against the horizon stands beside what noise makes of it', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const where = await text(page, '#where');
    assert.match(where, /as given: what noise alone would make/);
    assert.match(where, /A complete model stays near it/);
    assert.doesNotMatch(where, /one that stays there, of a complete model/);
  }));

test('what the model misses stands beside the noise, as a random force, where it misses anything', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    assert.match(await text(page, '#where .discrepancy'), /joint2\s+0\.001 rad\s+0\.0471 N m\s+0\.32/);
    await page.locator('.controls').getByLabel('Model', {exact: true}).selectOption({index: 1});
    await settled(page);
    assert.equal(await page.locator('#where .discrepancy').count(), 0);
  }));

test('correlations of the errors are drawn in their bands, the farthest outside first', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const title = () => page.locator('#where .residuals figcaption').allInnerTexts();
    assert.deepEqual(await title(), ['Autocorrelation of the errors of joint2: as given',
      'Correlation of the errors of joint1 with the effort of joint2: as given']);
    const charts = page.locator('#where .residuals svg[role=img]');
    assert.equal(await charts.count(), 2);
    assert.match(await text(page, '#where .residuals'), /99 % of white noise/);
    await page.locator('#where .residuals').getByLabel('Channel', {exact: true}).selectOption({label: 'joint1'});
    assert.match((await title())[0], /errors of joint1/);
    await page.locator('.controls').getByLabel('Model', {exact: true}).selectOption({index: 1});
    await settled(page);
    assert.match((await title())[0], /coulomb_friction@joint2$/);
  }));

const efforts = page => text(page, '#where .efforts');

test('what the inverse dynamics leave of the efforts is said and drawn, joint by joint', {skip}, () =>
  visit('driven.html', drivenPage(), async page => {
    const said = await efforts(page);
    assert.match(said, /Efforts by the inverse dynamics/);
    assert.match(said, /low-pass filter whose cut-off \(-3 dB\) is 3\.31 Hz\./);
    assert.match(said, /joint2\s+0\.28 N m\s+35\.8\s+35\.2\s+0\.9/, 'rms, left, held out, by the compared model');
    assert.equal(await page.locator('#where .efforts figure').count(), 2);
    const labels = await page.$$eval('#where .efforts .time-plot', list => list.map(e => e.getAttribute('aria-label')));
    assert.equal(labels.length, 4);
    assert.match(labels[2], /^Effort of joint2 over time, measured and predicted/);
    assert.match(labels[3], /^What is left of the effort of joint2/);
    await page.locator('.time-plot').first().focus();
    await page.keyboard.press('Home');
    await settled(page);
    assert.match(await text(page, '#where .efforts figure .readout'),
      /^at 0\.2 s: measured .* N m; as given .* N m \(left .* N m\); \+ coulomb_friction@joint2 .* N m \(left .* N m\)$/);
  }));

test('the efforts of a held-out run have the filter of the held-out runs', {skip}, () =>
  visit('driven.html', drivenPage(), async page => {
    await page.locator('.controls').getByLabel('Run', {exact: true}).selectOption({index: 1});
    await settled(page);
    assert.match(await efforts(page), /is 4\.31 Hz\./);
    assert.match(await efforts(page), /run_2\.csv, held out/);
  }));

test('where no efforts were measured nothing is said of them', {skip}, async () => {
  await visit('planar.html', planarPage(), async page => assert.equal(await page.locator('.efforts').count(), 0));
  const old = planarPage(); // of a session that was saved before there were any
  for (const m of old.models) {
    delete m.efforts;
    delete m.holdoutEfforts;
    for (const p of m.predictions) delete p.efforts;
  }
  await visit('old.html', old, async page => {
    assert.equal(await page.locator('.efforts').count(), 0);
    assert.equal(await page.locator('.warning').count(), 0);
  });
});

test('a run without efforts to compare says so', {skip}, () => {
  const document = drivenPage();
  document.models[0].predictions[0].efforts = null;
  return visit('short.html', document, async page => {
    assert.match(await efforts(page), /No efforts of this run can be compared/);
    assert.match(await efforts(page), /joint1/);
  });
});

test('the cost of another stage is drawn as another line', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    assert.match(await text(page, '#parameters'), /The line breaks where the next stage begins/);
    const lines = await page.$$eval('#parameters svg[aria-label^="Convergence"] svg path[fill=none]', list => list.map(e => e.getAttribute('d').match(/M/g).length));
    assert.deepEqual(lines, [2, 1], 'Levenberg-Marquardt in two stages, Adam in one');
    assert.match(await text(page, '#parameters'), /The cost no longer falls\. sysid_compare|The cost no longer falls\./);
  }));

test('the URDF and its specification are saved together', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const names = [];
    page.on('download', d => names.push(d.suggestedFilename()));
    await page.getByRole('button', {name: 'Save the URDF and its YAML'}).first().click();
    await until(() => names.length === 2);
    assert.deepEqual(names.sort(), ['identified.sysid.yaml', 'identified.urdf']);
    assert.match(await text(page, '#take-away'), /The two belong together/);
  }));

test('models of the same effects have titles of their own, and the bars are the way to one of them', {skip}, () => {
  const document = planarPage();
  const [given, added] = document.models;
  document.models.push({...given, id: 2});
  document.steps.push({...document.steps[0], title: '- coulomb_friction@joint2', model: 2, from: 1},
    {...document.steps[0], title: '+ quadratic_drag@joint2', model: 3, from: 0});
  document.models.push({...added, id: 3, title: '+ quadratic_drag@joint2'});
  return visit('siblings.html', document, async page => {
    const titles = await page.locator('.controls').getByLabel('Model', {exact: true}).evaluate(e => [...e.options].map(o => o.textContent));
    assert.deepEqual(titles, ['as given', '+ coulomb_friction@joint2', 'as given (model 3)', '+ quadratic_drag@joint2']);
    const bars = () => page.$$eval('#add figure svg > g > text > title', list => list.map(e => e.textContent));
    await choose(page, 'Model', 'as given (model 3)');
    await settled(page);
    assert.deepEqual(await bars(), ['as given', '+ coulomb_friction@joint2', '- coulomb_friction@joint2']);
    await choose(page, 'Model', '+ quadratic_drag@joint2');
    await settled(page);
    assert.deepEqual(await bars(), ['as given', '+ quadratic_drag@joint2']);
    assert.match(await text(page, '#add'), /the table has every step/);
  });
});

test('a frozen page gives the command of the studio, without what that does not take', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const commands = await page.$$eval('#add pre', list => list.map(e => e.innerText));
    assert.equal(commands.at(-1), 'sysid_studio --model pendulum2_planar --traj run_1.csv --holdout run_2.csv --out result');
  }));

test('on paper the heads of the candidates are text, and the run is named', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    await page.emulateMedia({media: 'print'});
    await page.waitForFunction(() => document.documentElement.classList.contains('printing'));
    await settled(page);
    assert.equal(await page.locator('#which thead button').count(), 0);
    assert.match(await text(page, '#which thead'), /effect.*predicted.*confirmed/s);
    assert.match(await text(page, '#compare .shown'), /run_1\.csv, fitted/);
    assert.equal(await page.$eval('.matrix td', e => getComputedStyle(e).printColorAdjust), 'exact');
  }));

test('an interval ends at the bound that the estimate cannot pass', {skip}, () => {
  const document = planarPage();
  Object.assign(document.models[0].parameters[0], {ci95: [-0.487, 2.446], lower: 0.01, upper: null});
  return visit('interval.html', document, async page =>
    assert.match(await text(page, '#parameters'), /0\.01 to 2\.446\s+cut at its bound\s+from 0\.01/));
});

test('choosing another model changes every panel', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    await choose(page, 'Model', '+ coulomb_friction@joint2');
    await settled(page);
    assert.match(await text(page, '#verdict'), /Adequate/);
    assert.match(await text(page, '#which .empty'), /nothing is missing that this data can show/);
    assert.match(await text(page, '#parameters'), /joint2\.friction/);
    await choose(page, 'Compared with', 'as given');
    await settled(page);
    assert.match(await text(page, '#compare .readout'), /as given/);
  }));

test('a drag zooms every curve alike, a double click shows the whole run', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const whole = await ranges(page);
    assert.equal(whole.length, 4);
    const first = page.locator('.time-plot .u-over').first();
    await first.scrollIntoViewIfNeeded();
    const box = await first.boundingBox();
    await page.mouse.move(box.x + box.width * 0.25, box.y + 40);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width * 0.5, box.y + 40, {steps: 4});
    await page.mouse.up();
    await settled(page);
    const zoomed = await ranges(page);
    assert.equal(new Set(zoomed).size, 1);
    const [a, b] = zoomed[0].split(' ').map(Number);
    assert.ok(Math.abs(a - 2) < 0.1 && Math.abs(b - 4) < 0.1, zoomed[0]);
    await page.locator('.time-plot .u-over').nth(2).dblclick();
    await settled(page);
    assert.deepEqual(await ranges(page), whole);
  }));

test('the keyboard moves the cursor and zooms', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    await page.locator('.time-plot').first().focus();
    for (let i = 0; i < 10; ++i) await page.keyboard.press('Shift+ArrowRight');
    assert.equal(await text(page, '.time'), '4.00 s');
    assert.match(await text(page, '.readout'), /^at 4 s: measured/);
    await page.keyboard.press('+');
    await settled(page);
    assert.deepEqual((await ranges(page))[0].split(' ').map(x => Number(x).toFixed(6)), ['2.000000', '6.000000']);
    await page.keyboard.press('0');
    await settled(page);
    assert.equal(await text(page, '.zoom-range'), '0 s to 8 s');
  }));

test('the first tab leads past the navigation, and focus is seen', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    await page.keyboard.press('Tab');
    assert.equal(await page.evaluate(() => document.activeElement.textContent), 'Skip to the content');
    await page.keyboard.press('Tab');
    const outline = await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle);
    assert.equal(outline, 'solid');
  }));

test('every control has a name', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const nameless = await page.$$eval('button, select, input, canvas[role], a, progress', list => list.filter(e =>
      !(e.getAttribute('aria-label') || e.textContent.trim() || e.closest('label')?.textContent.trim())).map(e => e.outerHTML));
    assert.deepEqual(nameless, []);
    const ids = await page.$$eval('[id]', list => list.map(e => e.id));
    assert.equal(new Set(ids).size, ids.length);
  }));

test('the candidates are sorted by their heads', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const first = () => page.$eval('#which tbody th', e => e.textContent.match(/^\w+@(joint\d|base)/)[0]);
    const head = page.locator('#which thead th').filter({hasText: 'predicted'});
    await head.getByRole('button').click();
    assert.equal(await head.getAttribute('aria-sort'), 'ascending');
    assert.equal(await first(), 'coulomb_friction@joint2');
    await head.getByRole('button').click();
    assert.equal(await head.getAttribute('aria-sort'), 'descending');
    assert.equal(await first(), 'sensor_offset@joint1');
    const last = await page.$$eval('#which tbody', list => list[list.length - 1].innerText);
    assert.match(last, /effort_delay@base/, 'what has no prediction comes last');
    await head.getByRole('button').click();
    assert.equal(await head.getAttribute('aria-sort'), 'none');
  }));

test('each candidate has its picture, or says why not', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    assert.equal(await page.locator('#which svg[role=img]').count(), 1);
    await page.getByRole('button', {name: 'Show all pictures'}).click();
    assert.equal(await page.locator('#which svg[role=img]').count(), 3);
    assert.equal(await page.locator('#which .detail .empty').count(), 2);
    const label = await page.locator('#which svg[role=img]').first().getAttribute('aria-label');
    assert.match(label, /torque, N m against velocity, rad\/s/);
  }));

test('the waterfall tells the step, predicted and achieved', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    assert.match(await text(page, '#add'), /\+ coulomb_friction@joint2\s+as given\s+1\.04\s+44\.\d\s+(0\.99\d|1\.0\d)/);
    await page.getByRole('button', {name: 'Show + coulomb_friction@joint2'}).click();
    await settled(page);
    assert.match(await text(page, '#verdict'), /Adequate/);
  }));

test('the URDF is saved as it is in the document', {skip}, () => {
  const document = planarPage();
  return visit('planar.html', document, async page => {
    const [download] = await Promise.all([
      page.waitForEvent('download'), page.locator('.files').first().getByRole('button', {name: /identified.urdf/}).click()]);
    assert.equal(download.suggestedFilename(), 'identified.urdf');
    assert.equal(await readFile(await download.path(), 'utf8'), document.models[0].files[0].text);
    assert.equal(await page.locator('.files').first().getByText('prediction.csv').count(), 0, 'a file without text');
    assert.match(await text(page, '#take-away'), /sysid_diagnose --model pendulum2_planar/);
  });
});

test('the theme follows the system, and the button', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const paper = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    const dark = await paper();
    await page.getByRole('button', {name: 'Light colours'}).click();
    await settled(page);
    assert.notEqual(await paper(), dark);
    assert.equal(await paper(), 'rgb(255, 255, 255)');
  }, {colorScheme: 'dark'}));

test('the mechanism is drawn, and moves with the cursor', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    const picture = () => page.$eval('.view canvas', c => c.toDataURL());
    const before = await picture();
    await page.locator('.time-plot').first().focus();
    for (let i = 0; i < 5; ++i) await page.keyboard.press('Shift+ArrowRight');
    await settled(page);
    const later = await picture();
    assert.notEqual(later, before);
    await page.locator('.view canvas').focus();
    await page.keyboard.press('ArrowLeft');
    await settled(page);
    assert.notEqual(await picture(), later);
  }));

test('play moves the cursor, pause stops it', {skip}, () =>
  visit('planar.html', planarPage(), async page => {
    await page.getByRole('button', {name: 'Play'}).click();
    await page.waitForFunction(() => parseFloat(document.querySelector('.time').textContent) > 0.1);
    await page.getByRole('button', {name: 'Pause'}).click();
    await settled(page);
    const t = await text(page, '.time');
    for (let i = 0; i < 5; ++i) await settled(page);
    assert.equal(await text(page, '.time'), t);
  }));

test('spherical joints turn, also one that was not measured', {skip}, () =>
  visit('spherical.html', sphericalPage(), async page => {
    const picture = () => page.$eval('.view canvas', c => c.toDataURL());
    const before = await picture();
    await page.locator('.time-plot').first().focus();
    for (let i = 0; i < 5; ++i) await page.keyboard.press('Shift+ArrowRight');
    await settled(page);
    assert.notEqual(await picture(), before);
    assert.match(await text(page, '#compare'), /joint1 z_x/);
    assert.match(await page.locator('#where svg[aria-label^="Phase"]').getAttribute('aria-label'), /tilt, rad/);
  }));

test('a page of a fit says which command would fill the empty panels', {skip}, () =>
  visit('fit.html', fitPage(), async page => {
    for (const id of ['where', 'which', 'add']) assert.match(await text(page, `#${id}`), /sysid_diagnose/, id);
    assert.match(await text(page, '#verdict'), /nothing was held out/);
  }));

test('a document that cannot be read is named', {skip}, async () => {
  const file = writeReport('other.html', {...fitPage(), schema: 'sysid.page/2'});
  const context = await browser.newContext({offline: true});
  context.setDefaultTimeout(kPatience_ms);
  const page = await context.newPage();
  await page.goto(`file://${file}`);
  assert.match(await page.locator('[role=alert]').innerText(), /reads sysid.page\/1, and the document is sysid.page\/2/);
  await context.close();
});

test('a panel that fails says so, and the others stay', {skip}, async () => {
  const document = planarPage();
  document.models[0].correlationNames = null;
  const {page, context} = await openFile(browser, writeReport('broken.html', document));
  assert.match(await text(page, 'main'), /A panel cannot be shown/);
  assert.match(await text(page, '#verdict'), /44\.\d × noise/);
  await context.close();
});

test('without WebGL the mechanism says so, and the rest works', {skip}, async () => {
  const plain = await launch({webgl: false});
  try {
    const {page, context} = await openFile(plain, writeReport('planar.html', planarPage()));
    assert.match(await text(page, '#mechanism'), /no WebGL/);
    assert.equal((await ranges(page)).length, 4);
    await context.close();
  } finally {
    await plain.close();
  }
});

test('100,000 samples are drawn with as few points as pixels ask for', {skip}, async () => {
  const seconds = {short: 10, long: 1000};
  const files = {};
  for (const name of ['short', 'long']) files[name] = writeReport(`${name}.html`, planarPage({seconds: seconds[name]}));
  await compareTimes('a fixture', async name => {
    const {page, context, complaints, work_ms} = await openFile(browser, files[name]);
    const paint = await work_ms();
    const points = await page.$$eval('.time-plot .uplot', plots => plots.map(p => Number(p.dataset.points)));
    const width = await page.$eval('.time-plot', e => e.clientWidth);
    assert.ok(Math.max(...points) <= 2 * width, `${points} points on ${width} pixels`);
    const zoom = await zooming(page, work_ms);
    assert.deepEqual(complaints, []);
    await context.close();
    return {paint, zoom};
  });
});
