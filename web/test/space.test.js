// Properties of view spaces and of what flies in them, tried on many of either.

import assert from 'node:assert/strict';
import test from 'node:test';
import { axesOf, fly, goTo, leave, startOf, turn } from '../src/flight.js';
import { contains, inside, shownFrom } from '../src/space.js';
import { axes, cross, distance, dot, length } from '../src/vectors.js';

/** The same numbers in every run, from 0 to 1 (mulberry32). */
function numbers(seed) {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
}

const SPACES = ['box', 'shaft', 'around'];

function spaceOf(kind, next) {
  const point = (size) => [0, 0, 0].map(() => (next() * 2 - 1) * size);
  const near = 0.1 + next() * 10;
  const far = near * (1 + next() * 10);
  if (kind === 'around') return { kind, center: point(100), near, far };
  const box = { kind: 'box', center: point(100), size: [next() * 9, next() * 9, 0] };
  const shaft = { kind: 'shaft', apex: point(100), axis: point(3), half_angle: 0.1 + next(), near, far };
  return { kind: 'before', view_cell: kind === 'box' ? box : shaft };
}

for (const kind of SPACES) {
  test(`a point is brought into a space of kind ${kind} and stays where it is in it`, () => {
    const next = numbers(1);
    for (let i = 0; i < 500; i++) {
      const space = spaceOf(kind, next);
      const point = [0, 0, 0].map(() => (next() * 2 - 1) * 150);
      const brought = inside(space, point);
      assert.ok(contains(space, brought), `${brought} of ${JSON.stringify(space)}`);
      assert.ok(distance(inside(space, brought), brought) < 1e-9);
      assert.equal(contains(space, point), distance(point, brought) < 1e-6);
    }
  });

  test(`nobody flies out of a space of kind ${kind} who did not leave it`, () => {
    const next = numbers(2);
    for (let i = 0; i < 50; i++) {
      const space = spaceOf(kind, next);
      const view = { view: 3, eye: inside(space, [0, 0, 0]), target: [500, 1, 2] };
      const flight = startOf(view, 'centre');
      for (let step = 0; step < 20; step++) {
        if (next() < 0.2) turn(flight, next() - 0.5, next() - 0.5);
        fly(flight, space, [500, 1, 2], [next() - 0.5, next() - 0.5, next() - 0.5]);
        assert.ok(contains(space, flight.eye));
        assert.equal(flight.view, null);
      }
      leave(flight, space, true);
      fly(flight, space, [500, 1, 2], [0, 0, 1e4]);
      assert.ok(!contains(space, flight.eye));
      leave(flight, space, false);
      assert.ok(contains(space, flight.eye));
    }
  });
}

test('axes are orthonormal and +Y is up, or -Z', () => {
  const next = numbers(3);
  const directions = Array.from({ length: 200 }, () => [0, 0, 0].map(() => next() - 0.5));
  for (const along of [...directions, [0, 1, 0], [0, -2, 0]]) {
    const { right, up, forward } = axes(along);
    for (const axis of [right, up, forward]) assert.ok(Math.abs(length(axis) - 1) < 1e-12);
    assert.ok(distance(cross(right, up), forward.map((x) => -x)) < 1e-12);
    assert.ok(Math.abs(dot(right, [0, 1, 0])) < 1e-12);
    assert.ok(up[1] >= 0 && (up[1] > 0 || up[2] === -1));
  }
});

test('turning goes where the mouse goes, and not over the top', () => {
  const flight = startOf({ view: 0, eye: [0, 0, 0], target: [0, 0, -5] }, 'centre');
  turn(flight, 0.1, 0.2);
  const { forward } = axesOf(flight);
  assert.ok(forward[0] > 0 && forward[1] > 0);
  turn(flight, 0, 9);
  assert.ok(axesOf(flight).up[1] > 0 && axesOf(flight).forward[1] < 1);
  goTo(flight, { view: 4, eye: [1, 1, 1], target: [0, 0, 0] }, 'anywhere');
  assert.deepEqual([flight.view, flight.target], [4, null]);
});

test('of impostors around a scene the one is shown on whose side the viewer is', () => {
  const impostors = ['+x', '-x', '+y', '-y', '+z', '-z'].map((side) => ({ side }));
  const space = { kind: 'around', center: [1, 2, 3], near: 1, far: 9 };
  assert.equal(shownFrom(space, impostors, [1, 2, -4]), 5);
  assert.equal(shownFrom(space, impostors, [6, 2, 4]), 0);
  assert.equal(shownFrom({ kind: 'before' }, impostors, [6, 2, 4]), -1);
});
