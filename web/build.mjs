// Writes the page as one html file: node build.mjs [--out FILE], or the
// environment variable SYSID_PAGE_OUT; default dist/page.html.
import {build} from 'esbuild';
import {mkdir, readFile, rename, writeFile} from 'node:fs/promises';
import {dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));

function outputFile() {
  const args = process.argv.slice(2);
  let out = process.env.SYSID_PAGE_OUT || join(here, 'dist', 'page.html');
  for (let i = 0; i < args.length; ++i) {
    if (args[i] === '--out' && args[i + 1]) {
      out = args[++i];
    } else if (args[i].startsWith('--out=')) {
      out = args[i].slice('--out='.length);
    } else {
      console.error(`build.mjs: unknown argument ${args[i]}; --out FILE`);
      process.exit(2);
    }
  }
  return resolve(out);
}

// Meshes cannot be loaded in a page without a network: their loaders, which
// urdf-loader imports, stay out.
const withoutMeshLoaders = {
  name: 'without-mesh-loaders',
  setup(b) {
    b.onResolve({filter: /(STL|Collada)Loader\.js$/}, () => ({
      path: join(here, 'src', 'plots', 'no_mesh_loader.ts'),
    }));
  },
};

async function bundle(entry) {
  const result = await build({
    entryPoints: [join(here, 'src', entry)],
    bundle: true,
    minify: true,
    write: false,
    format: 'iife',
    target: 'es2022',
    jsx: 'automatic',
    jsxImportSource: 'preact',
    legalComments: 'none',
    logLevel: 'warning',
    plugins: [withoutMeshLoaders],
  });
  return result.outputFiles[0].text;
}

const out = outputFile();
const [template, js, css] = await Promise.all([
  readFile(join(here, 'src', 'index.html'), 'utf8'),
  bundle('main.tsx'),
  bundle('style.css'),
]);
// What would end the element early; functions, as `$` is special in strings.
const inlineJs = js.replace(/<\/(script)/gi, '<\\/$1').replace(/<!--/g, '\\x3c!--');
const html = template
  .replace('/*style*/', () => css.replace(/<\/(style)/gi, '<\\/$1').trim())
  .replace('/*script*/', () => inlineJs.trim());
await mkdir(dirname(out), {recursive: true});
await writeFile(out + '.part', html);
await rename(out + '.part', out);
console.log(`${out}: ${(html.length / 1024).toFixed(0)} KiB`);
