// The lookups that README shows find the lists of a bundle of ID-bitfields.

import assert from 'node:assert/strict';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import test from 'node:test';
import { Matrix3, Vector3 } from 'three';
import { xtask } from './browser.js';

const README = readFileSync(new URL('../../README.md', import.meta.url), 'utf8');
const [FACES, CELLS] = [...README.matchAll(/^```js\n(.*?)^```$/gms)].map((block) => block[1]);

/** Bakes the house, and hands the files of its bundle to a check. */
function withHouse(options, check) {
  const folder = mkdtempSync(join(tmpdir(), 'farfield-web-'));
  try {
    const bundle = join(folder, 'house');
    xtask('bake', 'house', '--technique', 'bitfields', '--resolution', '64', ...options, '--out', bundle);
    check((name) => readFileSync(join(bundle, name)));
  } finally {
    rmSync(folder, { recursive: true });
  }
}

/** Places spread over a cube around the origin, the same in every run. */
const places = Array.from({ length: 200 }, (_, i) =>
  new Vector3(...[0.8192, 0.671, 0.5497].map((step) => ((i + 0.5) * step) % 1)).subScalar(0.5),
);

/** The numbers of the triangles in which each primitive of a GLB begins, and behind the last. */
function starts(glb) {
  const { meshes, accessors } = JSON.parse(glb.subarray(20, 20 + glb.readUInt32LE(12)));
  const counts = meshes.flatMap((mesh) => mesh.primitives.map(({ indices }) => accessors[indices].count / 3));
  return counts.reduce((all, count) => [...all, all.at(-1) + count], [0]);
}

test('the face of a direction is the one it passes through, and its ranges are of primitives', () => {
  withHouse(['--samples', '14'], (read) => {
    const lists = JSON.parse(read('faces.json'));
    const primitives = starts(read('impostors.glb'));
    assert.deepEqual(lists.parts, primitives);
    const center = new Vector3(1, 2, 3);
    const look = new Function('camera', 'center', 'lists', 'primitives', 'drawIndexed', FACES);
    for (const place of places) {
      const drawn = [];
      const draw = (first, offset, count) => drawn.push([first + offset / 3, first + (offset + count) / 3]);
      look({ position: place.clone().add(center) }, center, lists, primitives, draw);
      // Whose viewpoints the direction is a sum of, with no negative weight.
      const { draw: wanted } = lists.faces.find(({ corners }) => {
        const corner = new Matrix3().fromArray(corners.flatMap((v) => lists.viewpoints[v]));
        return Math.min(...place.clone().applyMatrix3(corner.invert())) >= 0;
      });
      assert.deepEqual(drawn, wanted);
      for (const [first, end] of drawn) {
        assert.ok(primitives.some((start, i) => start <= first && end <= primitives[i + 1]));
      }
    }
  });
});

test('the cell of a camera is the one it is in, or the nearest', () => {
  const options = ['--view-cell', 'box:0,2,30:6,1,4', '--cells', '3,2,2', '--held-back', '1'];
  withHouse(options, (read) => {
    const lists = JSON.parse(read('cells.json'));
    const manifest = JSON.parse(read('bundle.json'));
    assert.equal(lists.cells.length, 12);
    const look = new Function(
      'camera',
      'manifest',
      'lists',
      `${CELLS}; return lists.cells.findIndex((cell) => cell.draw === draw)`,
    );
    for (const place of places) {
      // Over twice the box, so that some are beside it.
      const position = place.clone().multiply(new Vector3(12, 2, 8)).add(new Vector3(0, 2, 30));
      const column = [-1, 1].filter((border) => border <= position.x).length;
      const [row, slice] = [position.y >= 2, position.z >= 30].map(Number);
      assert.equal(look({ position }, manifest, lists), 6 * slice + 3 * row + column);
    }
  });
});
