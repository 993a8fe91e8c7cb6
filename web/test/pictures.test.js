// What a browser shows of an exported page is what the software renderer shows.
//
// CHROMIUM names a browser, FARFIELD_XTASK a driver that is built already, and FARFIELD_PICTURES a folder
// where the browser's pictures are left. Without a browser the test is skipped and says so, unless
// FARFIELD_REQUIRE_BROWSER is 1.

import assert from 'node:assert/strict';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import test from 'node:test';
import { PNG } from 'pngjs';
import { browserPath, launch, serve, view as viewed, xtask } from './browser.js';

/**
 * How bundles are baked, and from where they are looked at: the reference viewpoint, corners, an edge and
 * places inside; fewer and smaller of meshes, which take longer. One is exported and served by this script, the
 * others by the driver.
 */
const BUNDLES = [
  { name: 'layered', options: [], resolution: 256, views: [0, 1, 8, 14, 77], isExported: true },
  { name: 'pbr', options: ['--channels', 'pbr'], resolution: 256, views: [3], isExported: false },
  { name: 'tdm', options: ['--technique', 'tdm'], resolution: 128, views: [0, 40], isExported: false },
];

/** Difference of a channel, of 255, that a pixel may have: a rounding in either renderer. */
const LEVEL = 2;

/**
 * Share of the pixels that may have more. GPUs place vertices on a grid of 1/256 pixel and interpolate
 * with fewer digits: pixels whose centre an edge passes closely show what is beside. Edges are the more of
 * a picture the smaller it is; this is twice what was found.
 */
const mostOver = (resolution) => 2 / resolution;

const browser = browserPath();
const isRequired = process.env.FARFIELD_REQUIRE_BROWSER === '1';
if (!browser && !isRequired) {
  console.error('\n!!! No Chromium was found: what a browser shows was NOT TESTED. Set CHROMIUM.\n');
}

/** Share of the pixels in which a channel differs by more than a level. */
function shareOver(a, b, level) {
  assert.deepEqual([a.width, a.height], [b.width, b.height]);
  let over = 0;
  for (let i = 0; i < a.data.length; i += 4) {
    const differs = [0, 1, 2].some((c) => Math.abs(a.data[i + c] - b.data[i + c]) > level);
    over += differs ? 1 : 0;
  }
  return (over * 4) / a.data.length;
}

/** As `verify` names its pictures. */
const nameOf = (side, view) => `view-${String(view).padStart(4, '0')}-${side}.png`;

/** Waits until the page shows a mode from a viewpoint, and takes its picture. */
async function picture(page, mode, view) {
  await page.evaluate((fragment) => (location.hash = fragment), `mode=${mode}&view=${view}&panel=0&cell=0`);
  const isShown = (wanted) => document.documentElement.dataset.shown === wanted;
  await page.waitForFunction(isShown, { timeout: 60_000 }, `${mode} ${view}`);
  // On the screen one frame later.
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  return PNG.sync.read(Buffer.from(await page.screenshot({ type: 'png' })));
}

for (const { name: kind, options, resolution, views, isExported } of BUNDLES) {
  const skip = !browser && !isRequired ? 'no Chromium' : false;
  test(`a browser shows the ${kind} house as the software renderer does`, { skip }, async () => {
    assert.ok(browser, 'FARFIELD_REQUIRE_BROWSER is set, and there is no browser');
    const folder = mkdtempSync(join(tmpdir(), 'farfield-web-'));
    const [bundle, out] = [join(folder, 'house'), join(folder, 'page')];
    xtask('bake', 'house', ...options, '--resolution', `${resolution}`, '--out', bundle);
    for (const view of views) xtask('verify', bundle, '--view', `${view}`);
    if (isExported) xtask('view', bundle, '--web', '--export', out);
    const site = await (isExported ? serve(out) : viewed(bundle));
    const running = await launch(browser);
    try {
      const page = await running.newPage();
      const wanted = (side, view) =>
        PNG.sync.read(readFileSync(join(bundle, 'report', nameOf(side, view))));
      const errors = [];
      page.on('pageerror', (error) => errors.push(String(error)));
      page.on('console', (said) => said.type() === 'error' && errors.push(said.text()));
      await page.setViewport({ width: resolution, height: resolution });
      await page.goto(site.address);
      for (const view of views) {
        for (const side of ['original', 'impostor']) {
          const shown = await picture(page, side, view);
          const name = nameOf(side, view);
          const left = process.env.FARFIELD_PICTURES;
          if (left) {
            mkdirSync(left, { recursive: true });
            writeFileSync(join(left, `${kind}-${name}`), PNG.sync.write(shown));
          }
          const most = mostOver(resolution);
          const found = shareOver(shown, wanted(side, view), LEVEL);
          console.log(`${kind} ${name}: ${(found * 100).toFixed(3)} % of the pixels differ by more than ${LEVEL}/255`);
          assert.ok(found <= most, `${name}: ${found} of the pixels differ`);
          // The other side is told apart from this one.
          const other = side === 'original' ? 'impostor' : 'original';
          assert.ok(shareOver(shown, wanted(other, view), LEVEL) > 4 * most);
        }
      }
      assert.deepEqual(errors, []);
    } finally {
      await running.close();
      site.close();
      rmSync(folder, { recursive: true, force: true });
    }
  });
}
