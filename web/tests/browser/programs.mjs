// Starts the real programs, of the folder SYSID_PROGRAMS, on the runs of the
// folder SYSID_RUNS; what is left of them ends with the tests.
import {spawn} from 'node:child_process';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

const programs = process.env.SYSID_PROGRAMS, runs = process.env.SYSID_RUNS;
export const withoutPrograms = programs && runs ? false
  : 'SYSID_PROGRAMS and SYSID_RUNS name no folders of the programs and of data/runs: tests/web/run does';

export const folder = mkdtempSync(join(tmpdir(), 'sysid-way-'));
const children = new Set();
process.on('exit', () => {
  for (const child of children) child.kill('SIGKILL');
  rmSync(folder, {recursive: true, force: true});
});
for (const signal of ['SIGINT', 'SIGTERM', 'SIGHUP']) process.once(signal, () => process.exit(1));

export const run = name => join(runs, `${name}.csv`);

function launch(program, args) {
  const child = spawn(join(programs, program), args, {stdio: ['ignore', 'pipe', 'pipe']});
  const said = {child, out: '', err: ''};
  children.add(child);
  child.stdout.setEncoding('utf8').on('data', text => { said.out += text; });
  child.stderr.setEncoding('utf8').on('data', text => { said.err += text; });
  said.ended = new Promise((resolve, reject) => {
    child.on('error', reject);
    child.on('close', (code, signal) => {
      children.delete(child);
      resolve(code ?? signal);
    });
  });
  return said;
}

// What it wrote to standard output, once it has done.
export async function ask(program, ...args) {
  const said = launch(program, args);
  const code = await said.ended;
  if (code !== 0) throw new Error(`${program} ended with ${code}: ${said.err}`);
  return said.out;
}

// A sysid_studio that listens: its `url`; `end(signal)` gives the exit code.
export async function studioOf(...args) {
  const said = launch('sysid_studio', ['--port', '0', ...args]);
  const url = await new Promise((resolve, reject) => {
    const look = () => {
      const found = said.out.match(/^http:\S+(?=\n)/);
      if (found) resolve(found[0]);
    };
    said.child.stdout.on('data', look);
    said.ended.then(code => reject(new Error(`sysid_studio ended with ${code}: ${said.err}`)), reject);
  });
  return {
    url,
    end(signal = 'SIGINT') {
      said.child.kill(signal);
      return said.ended;
    },
  };
}
