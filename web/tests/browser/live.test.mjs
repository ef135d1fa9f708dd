// The live page against a stand-in for sysid_studio.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';
import {planarPage} from '../fixture.mjs';
import {kPatience_ms, launch, without} from './chromium.mjs';
import {html, settled, until, watch} from './open.mjs';
import {startStudio} from './studio.mjs';

const skip = without;
let browser;
before(async () => { if (!skip) browser = await launch({webgl: false}); });
after(async () => { await browser?.close(); });

const kProgress = {type: 'progress', title: '+ coulomb_friction@joint2', doing: 'refitting', iteration: 3, of: 50, error: 12.3, elapsed_s: 4.2};

function withModels(n) {
  const page = planarPage({live: true});
  return {...page, models: page.models.slice(0, n), steps: page.steps.slice(0, n - 1), compared: null};
}

async function session(steps, models = 1) {
  const state = {models};
  const studio = await startStudio(html, () => withModels(state.models));
  const context = await browser.newContext({viewport: {width: 1280, height: 900}});
  context.setDefaultTimeout(kPatience_ms);
  const page = await context.newPage();
  const complaints = watch(page);
  try {
    await page.goto(studio.url);
    await page.waitForSelector(models ? '#take-away' : '#first-title');
    await page.waitForFunction(() => document.title !== 'sysid');
    await studio.followed();
    await steps(page, studio, state, complaints);
  } finally {
    await context.close();
    await studio.goAway().catch(() => undefined);
  }
}

const offer = page => page.getByRole('button', {name: 'Add coulomb_friction@joint2'});

test('a click adds the effect, and the error falls', {skip}, () =>
  session(async (page, studio, state, complaints) => {
    await offer(page).click();
    await until(() => studio.posts.length);
    assert.deepEqual(studio.posts, [{url: '/api/add', body: {model: 0, effect: 'coulomb_friction@joint2'}, type: 'application/json'}]);
    studio.say(kProgress);
    await page.getByText('iteration 3 of at most 50').waitFor();
    assert.match(await page.locator('.progress').innerText(), /refitting, \d+\.\d s.*error 12\.3 × noise/s);
    assert.equal(await offer(page).isDisabled(), true);
    state.models = 2;
    studio.say({type: 'done', model: 1});
    await page.getByText('Adequate').first().waitFor();
    assert.equal(await page.getByRole('button', {name: 'Remove coulomb_friction@joint2'}).isEnabled(), true);
    assert.match(await page.locator('#compare .legend').innerText(), /\+ coulomb_friction@joint2\s+as given/);
    await page.getByRole('button', {name: 'Remove coulomb_friction@joint2'}).click();
    await until(() => studio.posts.length > 1);
    assert.deepEqual(studio.posts[1].body, {model: 1, effect: 'coulomb_friction@joint2'});
    assert.deepEqual(complaints, []);
  }));

test('any other effect and a typed law can be added', {skip}, () =>
  session(async (page, studio, state, complaints) => {
    const field = page.getByLabel('Another effect, or a law of your own');
    const submit = page.getByRole('button', {name: 'Screen it and add it'});
    assert.equal(await submit.isDisabled(), true);
    await field.fill('custom@joint1: -k*q^3');
    await field.press('Enter');
    await until(() => studio.posts.length);
    assert.deepEqual(studio.posts[0], {url: '/api/add', body: {model: 0, effect: 'custom@joint1: -k*q^3'}, type: 'application/json'});
    studio.say(kProgress);
    await page.getByText('iteration 3 of at most 50').waitFor();
    assert.equal(await submit.isDisabled(), true);
    assert.deepEqual(complaints, []);
  }));

test('a button stands beside its candidate, and the progress above everything', {skip}, () =>
  session(async (page, studio) => {
    assert.equal(await page.locator('#which').getByRole('button', {name: /^Add /}).count(), 5);
    assert.equal(await page.locator('#add').getByRole('button', {name: /^Add /}).count(), 0);
    await offer(page).scrollIntoViewIfNeeded();
    studio.say(kProgress);
    await page.locator('.top .progress').waitFor();
    const box = await page.locator('.top .progress').boundingBox();
    assert.ok(box.y >= 0 && box.y + box.height < 900, JSON.stringify(box));
  }));

test('the clock runs though nothing is reported, and no bound is passed', {skip}, () =>
  session(async (page, studio) => {
    const seconds = async () => Number((await page.locator('.progress p').innerText()).match(/, ([\d.]+) s/)[1]);
    studio.say({...kProgress, iteration: 26, of: 10});
    await page.getByText('iteration 26').waitFor();
    assert.doesNotMatch(await page.locator('.progress').innerText(), /at most/);
    assert.equal(await page.$eval('.progress progress', e => e.hasAttribute('value')), false);
    const first = await seconds();
    await until(async () => await seconds() > first);
  }));

test('the files of a studio say of which fit they are, and its values', {skip}, () =>
  session(async page => {
    assert.match(await page.locator('#take-away').innerText(), /but of one more, of one trajectory over each whole run/);
    assert.match(await page.locator('#take-away').innerText(), /link1\.length\s+m\s+0\.50012\s+0\.50021/);
    assert.match(await page.locator('#verdict .end').innerText(), /61\.2 times the noise/);
  }));

test('a fit is cancelled, and said to be', {skip}, () =>
  session(async (page, studio) => {
    studio.say(kProgress);
    await page.getByRole('button', {name: 'Cancel'}).click();
    await until(() => studio.posts.length);
    assert.equal(studio.posts[0].url, '/api/cancel');
    studio.say({type: 'cancelled'});
    await page.getByText('The fit was cancelled').waitFor();
    assert.equal(await offer(page).isEnabled(), true);
    assert.equal(await page.evaluate(() => document.activeElement.id), 'top');
  }));

test('a fit that failed says why', {skip}, () =>
  session(async (page, studio) => {
    studio.say({type: 'failed', error: 'the problem is singular', hint: 'fix link1.mass'});
    await page.getByText('the problem is singular (fix link1.mass)').waitFor();
  }));

test('a reload during a fit shows that it runs', {skip}, () =>
  session(async (page, studio) => {
    studio.say(kProgress);
    await page.getByText('iteration 3 of at most 50').waitFor();
    await page.reload();
    await page.getByText('iteration 3 of at most 50').waitFor();
  }));

// Frames come late on a busy machine: the event then arrives before the panels
// listen.
test('an event is shown that comes before the page has drawn itself', {skip}, () =>
  session(async (page, studio) => {
    studio.say(kProgress);
    await page.getByText('iteration 3 of at most 50').waitFor();
    await page.addInitScript(() => {
      const frame = requestAnimationFrame.bind(window), later = setTimeout.bind(window);
      window.requestAnimationFrame = f => later(() => frame(f), 700);
      window.setTimeout = (f, ms, ...rest) => later(f, Math.max(ms ?? 0, 700), ...rest);
    });
    await page.reload();
    await page.getByText('iteration 3 of at most 50').waitFor();
  }));

test('a fit that ended between the document and the events is shown', {skip}, async () => {
  const models = [1, 2];
  const studio = await startStudio(html, () => withModels(models.length > 1 ? models.shift() : models[0]));
  const context = await browser.newContext();
  context.setDefaultTimeout(kPatience_ms);
  try {
    const page = await context.newPage();
    await page.goto(studio.url);
    await page.waitForFunction(() => document.querySelectorAll('.controls select')[1]?.options.length === 2);
  } finally {
    await context.close();
    await studio.goAway();
  }
});

test('a refused request is told with its hint', {skip}, () =>
  session(async (page, studio) => {
    // Another browser was faster.
    studio.refuse({error: 'a fit runs', hint: 'cancel it first'});
    await offer(page).click();
    await page.getByText('a fit runs (cancel it first)').waitFor();
  }));

test('the page outlives the server, and takes up again', {skip}, () =>
  session(async (page, studio, state) => {
    await studio.goAway();
    await page.getByText('The server does not answer; what is shown stays').waitFor();
    assert.match(await page.locator('#verdict').innerText(), /An effect is missing/);
    state.models = 2;
    await studio.comeBack();
    await page.getByText('The server does not answer; what is shown stays').waitFor({state: 'detached'});
    await page.waitForFunction(() => document.querySelectorAll('.controls select')[1].options.length === 2);
  }));

test('files come from the server', {skip}, () =>
  session(async page => {
    const link = page.locator('.files a').first();
    assert.equal(await link.getAttribute('href'), '/api/models/0/identified.urdf');
    assert.equal(await page.locator('.files a').count(), 4);
  }));

test('before the first model the page says what runs, and can start again', {skip}, () =>
  session(async (page, studio, state) => {
    studio.say({...kProgress, title: 'the model as given'});
    await page.getByText('the model as given:').or(page.locator('.progress')).first().waitFor();
    studio.say({type: 'cancelled'});
    await page.getByRole('button', {name: 'Fit the model as given'}).click();
    await until(() => studio.posts.length);
    assert.equal(studio.posts.at(-1).url, '/api/start');
    state.models = 1;
    studio.say({type: 'done', model: 0});
    await page.waitForSelector('#verdict');
    await settled(page);
    assert.match(await page.locator('#verdict').innerText(), /An effect is missing/);
  }, 0));
