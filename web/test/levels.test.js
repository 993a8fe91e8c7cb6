// Levels of detail as the software renderer has them.

import assert from 'node:assert/strict';
import test from 'node:test';
import { halved } from '../src/levels.js';

test('invisible colours do not bleed, and sides are halved down to one', () => {
  const [red, hidden, dim] = [[255, 0, 0, 255], [0, 255, 0, 0], [0, 0, 255, 85]];
  // 3 x 2 texels: the last column is left out.
  const image = { data: Uint8Array.from([red, hidden, dim, hidden, hidden, dim].flat()), width: 3, height: 2 };
  const half = halved(image);
  assert.deepEqual([half.width, half.height, [...half.data]], [1, 1, [255, 0, 0, 64]]);
  // One to three in linear light: 0.75 and 0.25.
  const mixed = halved({ data: Uint8Array.from([...red, ...dim]), width: 2, height: 1 });
  assert.deepEqual([mixed.width, mixed.height, [...mixed.data]], [1, 1, [225, 0, 137, 170]]);
  const nothing = halved({ data: Uint8Array.from([...hidden, ...hidden]), width: 1, height: 2 });
  assert.deepEqual([...nothing.data], [0, 255, 0, 0]);
});
