// Starts Debian's Chromium for the tests.
import {existsSync, mkdirSync} from 'node:fs';
import {join} from 'node:path';
import {chromium} from 'playwright-core';

// For what comes on any machine, however busy: only what hangs takes longer.
export const kPatience_ms = 900000;

const kPlaces = [process.env.SYSID_CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];

export const executable = kPlaces.find(p => p && existsSync(p));
export const without = executable ? false
  : 'Chromium is missing: install the Debian package chromium, or name it by SYSID_CHROMIUM';

export function launch({webgl = true} = {}) {
  return chromium.launch({
    executablePath: executable,
    timeout: kPatience_ms,
    args: [
      // Chromium refuses its sandbox to root.
      ...(process.getuid?.() === 0 ? ['--no-sandbox'] : []),
      ...(webgl ? ['--enable-unsafe-swiftshader', '--disable-gpu-compositing']
        : ['--disable-gpu', '--disable-3d-apis']),
    ],
  });
}

// Where pictures go, if they are wanted (SYSID_PICTURES).
export function pictureFile(name) {
  const folder = process.env.SYSID_PICTURES;
  if (!folder) return null;
  mkdirSync(folder, {recursive: true});
  return join(folder, name);
}
