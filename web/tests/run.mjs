// Builds the page and runs all its tests: node tests/run.mjs [unit|browser].
import {spawnSync} from 'node:child_process';
import {mkdtempSync, readdirSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {without} from './browser/chromium.mjs';

const here = dirname(fileURLToPath(import.meta.url));
const kinds = process.argv[2] ? [process.argv[2]] : ['unit', 'browser'];
const folder = mkdtempSync(join(tmpdir(), 'sysid-page-'));
const built = join(folder, 'page.html');

function run(args) {
  const {status} = spawnSync(process.execPath, args, {stdio: 'inherit', env: {SYSID_PAGE: built, ...process.env}});
  if (status !== 0) process.exitCode = status || 1;
}

if (!process.env.SYSID_PAGE) run([join(here, '..', 'build.mjs'), '--out', built]);
for (const kind of kinds) {
  if (kind === 'browser' && without) console.error(`The browser tests are skipped. ${without}.`);
  const files = readdirSync(join(here, kind)).filter(f => f.endsWith('.test.mjs')).map(f => join(here, kind, f));
  run(['--test', ...files]);
}
rmSync(folder, {recursive: true, force: true});
