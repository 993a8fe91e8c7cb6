// Builds the page into dist/: one script with all it needs, and the files it is shown by.
import { build } from 'esbuild';
import { copyFileSync, mkdirSync, renameSync, rmSync } from 'node:fs';
import { fileURLToPath } from 'node:url';

const from = (path) => fileURLToPath(new URL(path, import.meta.url));

const remove = (path) => rmSync(from(path), { recursive: true, force: true });

// Beside its place, so that a build that is interrupted leaves no page that looks finished.
remove('dist.new');
mkdirSync(from('dist.new'));
for (const name of ['index.html', 'style.css']) {
  copyFileSync(from(`src/${name}`), from(`dist.new/${name}`));
}
// Licences of what is built in stay in the script.
await build({
  entryPoints: [from('src/main.js')],
  outfile: from('dist.new/page.js'),
  bundle: true,
  minify: true,
  format: 'esm',
  target: 'es2022',
  legalComments: 'eof',
});
remove('dist');
renameSync(from('dist.new'), from('dist'));
