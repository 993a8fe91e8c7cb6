// What fragments and keys say.

import assert from 'node:assert/strict';
import test from 'node:test';
import { DEFAULTS, MODES, format, parse } from '../src/address.js';
import { KEYS, actionOf, help, movement } from '../src/keys.js';

test('a fragment leads back to what it was made of', () => {
  for (const mode of MODES) {
    const eye = [1.5, -2e-7, 3e8];
    const forward = [0.6, -0.8, 0];
    for (const target of [null, [0.1, 0.2, 0.3]]) {
      const parsed = parse(format({ ...DEFAULTS, mode, flight: { view: null, eye, target, forward, leaves: true } }));
      assert.deepEqual([parsed.mode, parsed.view, parsed.eye, parsed.target, parsed.leave], [mode, null, eye, target, true]);
      // Where no point is looked at, a direction is.
      assert.deepEqual(parsed.forward, target ? null : forward);
    }
    const parsed = parse(format({ ...DEFAULTS, mode, flight: { view: 12, eye, target: eye, leaves: false } }));
    assert.deepEqual([parsed.mode, parsed.view, parsed.eye, parsed.leave], [mode, 12, null, null]);
  }
});

test('a fragment keeps the settings that differ from those a page begins with', () => {
  const flight = { view: 3, leaves: false };
  assert.equal(format({ ...DEFAULTS, mode: 'split', flight }), '#mode=split&view=3');
  const others = { gain: 16, split: 0.25, panel: false, cell: true, native: true };
  const parsed = parse(format({ ...others, mode: 'split', flight }));
  for (const [name, value] of Object.entries(others)) assert.equal(parsed[name], value);
  assert.equal(parse(format({ ...DEFAULTS, cell: false, mode: 'split', flight })).cell, false);
});

test('nonsense in a fragment is nothing', () => {
  const { mode, view, gain, eye } = parse('#mode=upside&view=x&gain=Infinity&eye=1,2&=&&%');
  assert.deepEqual([mode, view, gain, eye], [null, null, null, null]);
  const flags = parse('panel=0&cell=1');
  assert.deepEqual([flags.panel, flags.cell, flags.native], [false, true, null]);
});

test('every key does one thing, and the help tells it', () => {
  const words = help();
  for (const { key, or, say, action, value } of KEYS) {
    assert.equal(actionOf(key).action, action);
    if (or) assert.deepEqual(actionOf(or.toUpperCase()), { action, value });
    assert.ok(words.includes(say));
    assert.equal(KEYS.filter((one) => [one.key, one.or].includes(key)).length, 1);
  }
  assert.deepEqual(actionOf('7'), { action: 'worst', value: 7 });
  assert.deepEqual(actionOf('M'), { action: 'mode', value: 'difference' });
  assert.deepEqual(actionOf('n'), actionOf(']'));
  assert.equal(actionOf('Enter'), null);
  assert.deepEqual(movement(['KeyW', 'ArrowLeft', 'ShiftLeft']), [-1, 0, 1]);
});
