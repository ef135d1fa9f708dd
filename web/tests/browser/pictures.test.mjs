// Layout at the widths and on the paper that people use; with SYSID_PICTURES
// the pictures are kept. SYSID_REPORT is a report.html of a real program.
import assert from 'node:assert/strict';
import {statSync} from 'node:fs';
import {after, before, test} from 'node:test';
import {drivenPage, failedPage, fitPage, planarPage, sphericalPage, standInPage, undecidedPage} from '../fixture.mjs';
import {launch, pictureFile, without} from './chromium.mjs';
import {openFile, settled, until, writeReport} from './open.mjs';

const skip = without;
const report = process.env.SYSID_REPORT;
let browser;
before(async () => { if (!skip) browser = await launch(); });
after(async () => { await browser?.close(); });

// As people name their files: nowhere to break, and a long model's title.
function longNames() {
  const text = JSON.stringify(planarPage()).replaceAll(/run_(\d|a|b)\.csv/g, 'data/recordings/2026-11-20T14:03:11_hidden_friction_$1.csv');
  return JSON.parse(text);
}

const kFixtures = {planar: planarPage, driven: drivenPage, fit: fitPage, failed: failedPage, undecided: undecidedPage, standIn: standInPage, spherical: sphericalPage, long: longNames};
const files = report ? {report} : null;
const file = name => files?.[name] ?? writeReport(`${name}.html`, kFixtures[name]());

// What sticks out of the page or of its own box, and texts that cover others.
function misplaced() {
  const found = [];
  const name = e => `${e.tagName} ${e.className?.baseVal ?? e.className} "${e.textContent.slice(0, 40)}"`;
  if (document.documentElement.scrollWidth > innerWidth) found.push(`the page is ${document.documentElement.scrollWidth} wide`);
  for (const e of document.querySelectorAll('.panel h2, .panel p, .tile dd, .tile dt, .legend li, .choice, td, th, caption, figcaption')) {
    if (e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0 && getComputedStyle(e).display !== 'inline') found.push(`cut: ${name(e)}`);
  }
  // A correlation matrix may scroll that is larger than the page's width.
  for (const e of document.querySelectorAll('.table-scroll')) {
    if (e.scrollWidth > e.clientWidth + 1 && e.querySelectorAll('.matrix tbody tr').length <= 8) found.push(`scrolls: ${name(e)}`);
  }
  for (const svg of document.querySelectorAll('.chart svg[role=img]')) {
    const outer = svg.getBoundingClientRect();
    const boxes = [...svg.querySelectorAll('text')].map(t => ({t, b: t.getBoundingClientRect()})).filter(x => x.b.width > 0);
    boxes.forEach(({t, b}, i) => {
      if (b.left < outer.left - 1 || b.right > outer.right + 1 || b.bottom > outer.bottom + 1) found.push(`outside: ${name(t)}`);
      for (const o of boxes.slice(i + 1)) {
        if (b.left < o.b.right - 1 && o.b.left < b.right - 1 && b.top < o.b.bottom - 2 && o.b.top < b.bottom - 2 &&
            !t.classList.contains('rule-label') && !o.t.classList.contains('rule-label')) found.push(`${name(t)} covers ${name(o.t)}`);
      }
    });
  }
  return found;
}

// The plots follow the width when the browser has measured it: what is still
// misplaced after a while is.
async function nothingMisplaced(page) {
  let found = await page.evaluate(misplaced);
  for (const end = Date.now() + 20000; found.length && Date.now() < end;) {
    await settled(page);
    found = await page.evaluate(misplaced);
  }
  assert.deepEqual(found, []);
}

async function pictures(page, name) {
  if (!process.env.SYSID_PICTURES) return;
  // Else it lies over what is taken.
  await page.addStyleTag({content: '.top, #mechanism { position: static !important }'});
  await page.screenshot({path: pictureFile(`${name}.png`), fullPage: true});
  for (const id of await page.$$eval('.panel', list => list.map(e => e.id))) {
    await page.locator(`#${id}`).screenshot({path: pictureFile(`${name}_${id}.png`)});
  }
}

for (const name of report ? ['report'] : Object.keys(kFixtures)) {
  for (const width of [1280, 2560]) {
    for (const colorScheme of ['light', 'dark']) {
      test(`${name}: nothing is cut or covered at ${width} px, ${colorScheme}`, {skip}, async () => {
        const {page, context, requests, complaints} = await openFile(browser, file(name), {width, height: 1000, colorScheme});
        try {
          await nothingMisplaced(page);
          assert.deepEqual(requests, []);
          assert.deepEqual(complaints, []);
          await pictures(page, `${name}_${width}_${colorScheme}`);
        } finally {
          await context.close();
        }
      });
    }
  }

  test(`${name}: on a telephone no more than the tables scroll sideways`, {skip}, async () => {
    const {page, context} = await openFile(browser, file(name), {width: 390, height: 800});
    try {
      await until(() => page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
      await pictures(page, `${name}_390`);
    } finally {
      await context.close();
    }
  });

  test(`${name}: on paper nothing is cut, and it is light`, {skip}, async () => {
    const {page, context} = await openFile(browser, file(name), {width: 1280, colorScheme: 'dark'});
    try {
      const pdf = await page.pdf({preferCSSPageSize: true, printBackground: true, path: pictureFile(`${name}.pdf`) ?? undefined});
      assert.ok(pdf.length > 10000);
      await page.setViewportSize({width: 700, height: 1000});
      await page.emulateMedia({media: 'print', colorScheme: 'dark'});
      await page.waitForFunction(() => document.documentElement.classList.contains('printing'));
      await settled(page);
      assert.equal(await page.evaluate(() => getComputedStyle(document.body).backgroundColor), 'rgb(255, 255, 255)');
      assert.equal(await page.locator('.controls').isVisible(), false);
      await nothingMisplaced(page);
      await pictures(page, `${name}_print`);
    } finally {
      await context.close();
    }
  });
}

test('the report of a real program has a verdict and stays below 3 MB', {skip: skip || !report && 'SYSID_REPORT names no report'}, async () => {
  assert.ok(statSync(report).size < 3e6, `${statSync(report).size} bytes`);
  const {page, context} = await openFile(browser, report);
  assert.ok((await page.locator('.sentence').first().innerText()).length > 20);
  assert.match(await page.locator('#verdict').innerText(), /× noise/);
  await context.close();
});
