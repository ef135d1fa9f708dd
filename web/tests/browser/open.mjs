// Opens the page in Chromium and watches what it asks for and complains of.
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join} from 'node:path';
import {fileURLToPath, pathToFileURL} from 'node:url';
import {freeze} from '../fixture.mjs';

const web = join(dirname(fileURLToPath(import.meta.url)), '..', '..');
export const html = readFileSync(process.env.SYSID_PAGE ?? join(web, 'dist', 'page.html'), 'utf8');
const folder = mkdtempSync(join(tmpdir(), 'sysid-page-'));
process.on('exit', () => rmSync(folder, {recursive: true, force: true}));

export function writeReport(name, document) {
  const file = join(folder, name);
  writeFileSync(file, freeze(html, document));
  return file;
}

// For a busy machine: what comes at all comes within it.
export const kPatience_ms = 120000;

// Until `holds`, which is asked often.
export async function until(holds) {
  for (const end = Date.now() + kPatience_ms; Date.now() < end;) {
    if (await holds()) return;
    await new Promise(resolve => setTimeout(resolve, 20));
  }
  throw new Error(`in vain: ${holds}`);
}

// `requests` are those beyond the file itself.
export async function openFile(browser, file, {width = 1280, height = 900, colorScheme = 'light'} = {}) {
  const context = await browser.newContext({viewport: {width, height}, colorScheme, offline: true, acceptDownloads: true});
  context.setDefaultTimeout(kPatience_ms);
  const page = await context.newPage();
  const requests = [], complaints = watch(page);
  const url = pathToFileURL(file).href;
  page.on('request', r => { if (r.url() !== url && !/^(data|blob):/.test(r.url())) requests.push(r.url()); });
  await page.goto(url);
  await page.waitForSelector('#take-away');
  await settled(page);
  return {page, context, requests, complaints};
}

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
