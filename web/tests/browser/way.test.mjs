// The user's way, with the real programs: from a model that is wrong to one
// that is right, and where it leads elsewhere.
import assert from 'node:assert/strict';
import {mkdtempSync, readdirSync, readFileSync, statSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {kPatience_ms, launch, without} from './chromium.mjs';
import {compareTimes, openFile, watch, zooming} from './open.mjs';
import {ask, folder, run, studioOf, withoutPrograms} from './programs.mjs';

const skip = without || withoutPrograms;
let browser;
before(async () => { if (!skip) browser = await launch({webgl: false}); });
after(async () => { await browser?.close(); });

const kMissing = 'coulomb_friction@joint2';
const flags = name => ['--model', 'pendulum2_planar',
  '--traj', `${run(`${name}_1`)},${run(`${name}_2`)}`, '--holdout', run(`${name}_3`)];
// So that a fit lasts long enough to be met, but the first one not too long.
const kSlow = ['--candidates', kMissing, '--step', '0.0005'];

const newFolder = () => mkdtempSync(join(folder, 'session-'));

// A studio, and a page of it that shows a model.
async function session(args, steps, {ends = false} = {}) {
  const studio = await studioOf(...args);
  const context = await browser.newContext({viewport: {width: 1280, height: 900}, acceptDownloads: true});
  context.setDefaultTimeout(kPatience_ms);
  const page = await context.newPage();
  const complaints = watch(page);
  try {
    await page.goto(studio.url);
    await page.waitForSelector('#take-away');
    await steps(page, studio);
    // Of a server that has gone, Chromium complains.
    if (!ends) assert.deepEqual(complaints, []);
  } finally {
    await context.close();
    await studio.end('SIGKILL');
  }
}

const text = (page, selector) => page.$eval(selector, e => e.innerText);
const offer = page => page.getByRole('button', {name: `Add ${kMissing}`});
const badge = (page, verdict) => page.waitForSelector(`#verdict .badge.${verdict}`);
const titles = page => page.locator('.controls').getByLabel('Model', {exact: true}).evaluate(e => [...e.options].map(o => o.textContent));
const savedModels = out => readdirSync(out).filter(f => /^model-\d+\.json$/.test(f)).sort();

function tile(page, name) {
  return page.$$eval('#verdict .tile', (tiles, wanted) => tiles.find(t => t.querySelector('dt').innerText === wanted)?.querySelector('dd').innerText, name);
}

// Of the fitted and of the held-out runs, in multiples of the noise.
async function errors(page) {
  const found = [await tile(page, 'Error of the fitted runs'), await tile(page, 'Error of the held-out runs')];
  return found.map(t => Number(t.match(/^([\d.]+) × noise/)[1]));
}

// Of the model that is shown: of several, its files come first.
async function download(page, name, model, where) {
  const link = page.locator(`.files a[download="${name}"]`).first();
  assert.equal(await link.getAttribute('href'), `/api/models/${model}/${name}`);
  const [got] = await Promise.all([page.waitForEvent('download'), link.click()]);
  assert.equal(got.suggestedFilename(), name);
  await got.saveAs(join(where, name));
  return join(where, name);
}

test('from a wrong model to a right one, and back to the command line', {skip}, () => {
  const out = newFolder();
  return session([...flags('hidden'), '--out', out], async page => {
    await badge(page, 'missing_effect');
    assert.match(await text(page, '#verdict .sentence'), new RegExp(`^An effect is missing.*${kMissing}`, 's'));
    assert.match(await tile(page, 'Worst channel'), /^joint2\b/);
    for (const error of await errors(page)) assert.ok(error > 3, `${error} × noise before`);

    assert.match(await page.$eval('#which tbody th', e => e.textContent), new RegExp(`^${kMissing}`));
    await offer(page).click();
    await badge(page, 'adequate');
    for (const error of await errors(page)) assert.ok(error < 1.1, `${error} × noise after`);
    assert.match(await text(page, '#add'), new RegExp(`\\+ ${kMissing}\\s+as given\\s+[01]\\.\\d+\\s+[3-9]\\.\\d+\\s+[01]\\.\\d+`));
    assert.deepEqual(await titles(page), ['as given', `+ ${kMissing}`]);

    const taken = newFolder();
    const urdf = await download(page, 'identified.urdf', 1, taken);
    await download(page, 'identified.sysid.yaml', 1, taken);
    const fit = JSON.parse(await ask('sysid_fit', ...flags('hidden').slice(2), '--model', urdf, '--json', '-'));
    assert.ok(fit.error.train.normalized_rms < 1.1, JSON.stringify(fit.error));
    assert.ok(fit.error.holdout.normalized_rms < 1.1, JSON.stringify(fit.error));
  });
});

test('a fit that is cancelled leaves nothing, and can be made again', {skip}, () => {
  const out = newFolder();
  return session([...flags('hidden'), ...kSlow, '--out', out], async page => {
    await offer(page).click();
    await page.getByRole('button', {name: 'Cancel'}).click();
    await page.getByText('The fit was cancelled').waitFor();
    assert.deepEqual(await titles(page), ['as given']);
    assert.deepEqual(savedModels(out), ['model-0.json']);
    assert.match(await text(page, '#verdict .sentence'), /^An effect is missing/);
    await offer(page).click();
    await badge(page, 'adequate');
    assert.deepEqual(await titles(page), ['as given', `+ ${kMissing}`]);
    assert.equal(savedModels(out).length, 2);
  });
});

test('a page that is loaded again during a fit follows it to its end', {skip}, () =>
  session([...flags('hidden'), ...kSlow, '--out', newFolder()], async page => {
    await offer(page).click();
    await page.waitForSelector('.progress');
    await page.reload();
    await page.getByRole('group', {name: 'Fit in progress'}).waitFor();
    assert.match(await text(page, '.progress'), new RegExp(kMissing.replace('_', '.')));
    assert.equal(await offer(page).isDisabled(), true);
    await badge(page, 'adequate');
    assert.equal(await page.locator('.progress').count(), 0);
    assert.deepEqual(await titles(page), ['as given', `+ ${kMissing}`]);
  }));

test('a model that is adequate has nothing to add', {skip}, () =>
  session([...flags('hidden'), '--add', kMissing, '--out', newFolder()], async page => {
    await badge(page, 'adequate');
    for (const error of await errors(page)) assert.ok(error < 1.1, `${error} × noise`);
    for (const id of ['which', 'add']) assert.match(await text(page, `#${id}`), /nothing is missing that this data can show/);
    assert.equal(await page.getByRole('button', {name: /^Add /}).count(), 0);
    await page.getByText('Add an effect all the same').click();
    assert.ok(await page.getByRole('button', {name: /^Add /}).count() > 0);
    assert.doesNotMatch(await text(page, '#verdict'), /indistinguishable/);
    assert.equal(await tile(page, 'First missing effect'), undefined);
  }));

// A sensor that wanders, differently in each run.
function wandering(n) {
  let seed = n, speed = 0, level = 0, rows = 0;
  const lines = readFileSync(run(`hidden_${n}`), 'utf8').trim().split('\n').map(line => {
    if (line.startsWith('#') || rows++ === 0) return line;
    seed = (seed * 48271) % 2147483647;
    speed = 0.97 * speed + 4e-4 * (seed / 2147483647 - 0.5);
    level += speed;
    const [t, first, ...rest] = line.split(',');
    return [t, (Number(first) + level).toFixed(9), ...rest].join(',');
  });
  const file = join(folder, `wandering_${n}.csv`);
  writeFileSync(file, `${lines.join('\n')}\n`);
  return file;
}

test('what no effect explains is said to be unexplained', {skip}, () =>
  session(['--model', 'pendulum2_planar', '--add', kMissing, '--traj', `${wandering(1)},${wandering(2)}`,
    '--holdout', wandering(3), '--out', newFolder()], async page => {
    await badge(page, 'unexplained');
    assert.match(await text(page, '#verdict .sentence'), /no effect of the catalogue explains it/);
    assert.match(await tile(page, 'Worst channel'), /^joint1\b/);
    assert.equal(await tile(page, 'First missing effect'), undefined);
    assert.equal(await page.locator('#which .badge.adequate').count(), 0, 'none is accepted');
  }));

test('Ctrl-C ends the studio, and its folder opens again as it was', {skip}, async () => {
  const args = [...flags('hidden'), ...kSlow, '--out', newFolder()], out = args.at(-1);
  const seen = {};
  const look = async page => ({titles: await titles(page), sentence: await text(page, '#verdict .sentence'), errors: await errors(page)});
  const saved = () => savedModels(out).map(f => [f, readFileSync(join(out, f), 'utf8'), statSync(join(out, f)).mtimeMs]);
  await session(args, async (page, studio) => {
    await offer(page).click();
    await badge(page, 'adequate');
    seen.before = await look(page);
    seen.saved = saved();
    assert.equal(seen.saved.length, 2);
    // One more, which Ctrl-C cuts off.
    await page.getByRole('button', {name: `Remove ${kMissing}`}).click();
    await page.waitForSelector('.progress');
    assert.equal(await studio.end(), 0);
    await page.getByText('The server does not answer').waitFor();
  }, {ends: true});
  await session(args, async (page, studio) => {
    const event = await page.evaluate(() => new Promise(resolve => {
      const source = new EventSource('/api/events');
      source.onmessage = m => { source.close(); resolve(JSON.parse(m.data)); };
    }));
    assert.equal(event.type, 'idle', 'nothing is fitted');
    seen.after = await look(page);
    assert.deepEqual(seen.after, seen.before);
    assert.deepEqual(saved(), seen.saved);
    assert.equal(await studio.end(), 0);
  }, {ends: true});
});

test('the report of 100,000 samples opens and zooms about as fast as one of 1,000', {skip}, async () => {
  const effects = ['viscous_damping@joint1', 'viscous_damping@joint2'];
  const out = {short: newFolder(), long: newFolder()};
  for (const [name, seconds] of [['short', 10], ['long', 1000]]) {
    const csv = join(folder, `${name}.csv`);
    await ask('sysid_simulate', '--model', 'pendulum2_planar', '--add', effects.map(e => `${e}=0.01`).join(','),
      '--duration', `${seconds}`, '--rate', '100', '--noise', '1e-3', '--out_csv', csv);
    await ask('sysid_fit', '--model', 'pendulum2_planar', '--add', effects.join(','), '--traj', csv, '--out', out[name]);
  }
  await compareTimes('real reports', async name => {
    const {page, context, complaints, work_ms} = await openFile(browser, join(out[name], 'report.html'));
    const paint = await work_ms();
    const zoom = await zooming(page, work_ms);
    assert.deepEqual(complaints, []);
    await context.close();
    return {paint, zoom};
  });
});
