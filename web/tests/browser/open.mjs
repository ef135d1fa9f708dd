// Opens the page in Chromium and watches what it asks for and complains of.
import assert from 'node:assert/strict';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join} from 'node:path';
import {fileURLToPath, pathToFileURL} from 'node:url';
import {freeze} from '../fixture.mjs';
import {kPatience_ms} from './chromium.mjs';

const web = join(dirname(fileURLToPath(import.meta.url)), '..', '..');
export const html = readFileSync(process.env.SYSID_PAGE ?? join(web, 'dist', 'page.html'), 'utf8');
const folder = mkdtempSync(join(tmpdir(), 'sysid-page-'));
process.on('exit', () => rmSync(folder, {recursive: true, force: true}));

export function writeReport(name, document) {
  const file = join(folder, name);
  writeFileSync(file, freeze(html, document));
  return file;
}

// Until `holds`, which is asked often.
export async function until(holds) {
  for (const end = Date.now() + kPatience_ms; Date.now() < end;) {
    if (await holds()) return;
    await new Promise(resolve => setTimeout(resolve, 20));
  }
  throw new Error(`in vain: ${holds}`);
}

// `requests` are those beyond the file itself; `work_ms()` is the processor time
// of the page's thread so far.
export async function openFile(browser, file, {width = 1280, height = 900, colorScheme = 'light'} = {}) {
  const context = await browser.newContext({viewport: {width, height}, colorScheme, offline: true, acceptDownloads: true});
  context.setDefaultTimeout(kPatience_ms);
  const page = await context.newPage();
  const requests = [], complaints = watch(page);
  const url = pathToFileURL(file).href;
  page.on('request', r => { if (r.url() !== url && !/^(data|blob):/.test(r.url())) requests.push(r.url()); });
  const session = await context.newCDPSession(page);
  await session.send('Performance.enable', {timeDomain: 'threadTicks'});
  const work_ms = async () => {
    const {metrics} = await session.send('Performance.getMetrics');
    return 1000 * metrics.find(m => m.name === 'TaskDuration').value;
  };
  await page.goto(url);
  await page.waitForSelector('#take-away');
  await settled(page);
  return {page, context, requests, complaints, work_ms};
}

// A report in the page, without complaints whatever `steps` does with it.
export async function visitReport(browser, name, document, steps, options) {
  const {page, context, complaints} = await openFile(browser, writeReport(name, document), options);
  try {
    await steps(page);
    assert.deepEqual(complaints, [], 'complaints');
  } finally {
    await context.close();
  }
}

export const text = (page, selector) => page.$eval(selector, e => e.innerText);

export function watch(page) {
  const complaints = [];
  page.on('pageerror', e => complaints.push(e.stack));
  page.on('console', m => {
    // The driver's remark on reading the picture back.
    if (['error', 'warning'].includes(m.type()) && !/GL Driver Message/.test(m.text())) complaints.push(m.text());
  });
  return complaints;
}

// Two frames on: effects have run, plots are drawn.
export function settled(page) {
  return page.evaluate(() => new Promise(done =>
    requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 30)))));
}

export const ranges = page => page.$$eval('.time-plot .uplot', plots => plots.map(p => p.dataset.range));

// Milliseconds of the processor (`work_ms` of the page) that zooming in and out by
// the keyboard takes, each time drawn.
export async function zooming(page, work_ms) {
  const begun = await work_ms();
  await page.evaluate(async () => {
    const plot = document.querySelector('.time-plot');
    for (const key of ['+', '+', '+', '-', '-', '-', '+', '0']) {
      plot.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true}));
      await new Promise(requestAnimationFrame);
    }
  });
  return await work_ms() - begun;
}

// Paint and zoom of a page of 1,000 samples and of one of 100,000, in processor
// time: medians of what `look(name)` returns for "short" and "long". The bounds
// are generous; a page that draws every sample needs 100 times as much.
export async function compareTimes(what, look) {
  const kRepeats = 3, kMostPaint = 30, kMostZoom = 15;
  const times = {short: {paint: [], zoom: []}, long: {paint: [], zoom: []}};
  for (let i = 0; i < kRepeats; ++i) {
    for (const name of ['short', 'long']) {
      const {paint, zoom} = await look(name);
      times[name].paint.push(paint);
      times[name].zoom.push(zoom);
    }
  }
  const median = list => [...list].sort((a, b) => a - b)[list.length >> 1];
  const ratio = key => median(times.long[key]) / median(times.short[key]);
  console.log(`${what}, 100,000 against 1,000 samples: first paint ${ratio('paint').toFixed(1)} times, zoom ${ratio('zoom').toFixed(1)} times as much work`);
  assert.ok(ratio('zoom') < kMostZoom && ratio('paint') < kMostPaint, JSON.stringify(times));
}
