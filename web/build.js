// Builds the page into dist/: one script with all it needs, and the files it is shown by.
import { build } from 'esbuild';
import { copyFileSync, mkdirSync, rmSync } from 'node:fs';
import { fileURLToPath } from 'node:url';

const from = (path) => fileURLToPath(new URL(path, import.meta.url));

rmSync(from('dist'), { recursive: true, force: true });
mkdirSync(from('dist'));
for (const name of ['index.html', 'style.css']) {
  copyFileSync(from(`src/${name}`), from(`dist/${name}`));
}
// Licences of what is built in stay in the script.
await build({
  entryPoints: [from('src/main.js')],
  outfile: from('dist/page.js'),
  bundle: true,
  minify: true,
  format: 'esm',
  target: 'es2022',
  legalComments: 'eof',
});
