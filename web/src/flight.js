// Where the viewer is and looks: a plain state, and what changes it.

import { contains, inside, speed } from './space.js';
import { add, axes, clamp, distance, dot, scale, subtract } from './vectors.js';

/**
 * Looks at a fixed point, as the promise of a bundle has it, or, where `target` is null, along
 * `forward`. Unless `leaves`, the view space is not left.
 */
export function startOf(view, aim) {
  const flight = { leaves: false };
  goTo(flight, view, aim);
  return flight;
}

/** Goes to a viewpoint and looks from there as `verify` does. */
export function goTo(flight, view, aim) {
  flight.view = view.view;
  flight.eye = view.eye;
  flight.forward = axes(subtract(view.target, view.eye)).forward;
  flight.target = aim === 'centre' ? view.target : null;
}

/** Right, up and forward of the viewer. */
export function axesOf({ eye, target, forward }) {
  const along = target ? subtract(target, eye) : forward;
  return axes(dot(along, along) > 0 ? along : forward);
}

/** Flies: `[right, up, forward]` in seconds at the space's speed. */
export function fly(flight, space, centre, [right, up, forward]) {
  const now = axesOf(flight);
  const step = speed(space, flight.eye, centre);
  const along = [scale(now.right, right), scale(now.up, up), scale(now.forward, forward)];
  const eye = add(flight.eye, scale(along.reduce(add), step));
  flight.eye = flight.leaves ? eye : inside(space, eye);
  flight.view = null;
}

/** Turns by angles in radians, to the right and up; looks at nothing fixed any more. */
export function turn(flight, right, up) {
  const { forward } = axesOf(flight);
  const steepest = Math.PI / 2 - 1e-3;
  const heading = Math.atan2(forward[0], -forward[2]) + right;
  const pitch = clamp(Math.asin(clamp(forward[1], -1, 1)) + up, -steepest, steepest);
  const level = Math.cos(pitch);
  flight.forward = [Math.sin(heading) * level, Math.sin(pitch), -Math.cos(heading) * level];
  flight.target = null;
  flight.view = null;
}

/** Looks at a point from now on. */
export function lookAt(flight, target) {
  if (flight.target && distance(flight.target, target) === 0) return;
  flight.target = target;
  flight.view = null;
}

/** Looks in a direction from now on, at nothing fixed; nothing changes where it has no length. */
export function lookAlong(flight, forward) {
  if (!(dot(forward, forward) > 0)) return;
  flight.forward = axes(forward).forward;
  flight.target = null;
  flight.view = null;
}

/** Leaves the view space at will from now on, or goes back into it. */
export function leave(flight, space, leaves) {
  flight.leaves = leaves;
  if (!leaves && !contains(space, flight.eye)) {
    flight.eye = inside(space, flight.eye);
    flight.view = null;
  }
}
