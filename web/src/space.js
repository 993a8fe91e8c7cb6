// From where the impostors of a bundle may be seen: options.view_space of its manifest.

import { add, axes, clamp, distance, dot, scale, subtract } from './vectors.js';

/** A point of the view space near `point`; the point itself where that lies in it. */
export function inside(space, point) {
  return space.kind === 'around' ? insideShell(space, point) : insideCell(space.view_cell, point);
}

/** Whether a point lies in the view space, but for rounding. */
export function contains(space, point) {
  const digits = 1e-9 * Math.max(...point.map(Math.abs), 1);
  return distance(inside(space, point), point) <= digits;
}

/** How far to go in a second, in metres. */
export function speed(space, eye, centre) {
  const far = distance(eye, centre) / 3;
  const size = space.view_cell?.size;
  return size && Math.max(...size) > 0 ? Math.max(...size) / 3 : far;
}

/** Index of the impostor that is seen from `eye` where only one is to be shown at a time, else -1. */
export function shownFrom(space, impostors, eye) {
  if (space.kind !== 'around') return -1;
  const outwards = impostors.map(({ side }) => dot(direction(side), subtract(eye, space.center)));
  return outwards.indexOf(Math.max(...outwards));
}

/** Outwards from a side such as "+x". */
function direction(side) {
  const out = [0, 0, 0];
  out['xyz'.indexOf(side[1])] = side[0] === '-' ? -1 : 1;
  return out;
}

function insideCell(cell, point) {
  if (cell.kind === 'box') {
    return point.map((x, i) => {
      const half = cell.size[i] / 2;
      return clamp(x, cell.center[i] - half, cell.center[i] + half);
    });
  }
  const { right, up, forward } = axes(cell.axis);
  const from = subtract(point, cell.apex);
  const depth = clamp(dot(from, forward), cell.near, cell.far ?? Infinity);
  const reach = depth * Math.tan(cell.half_angle);
  const lateral = (axis) => scale(axis, clamp(dot(from, axis), -reach, reach));
  return add(cell.apex, add(scale(forward, depth), add(lateral(right), lateral(up))));
}

/** Between two cubes; who is inside of the smaller one leaves it on the nearest side. */
function insideShell({ center, near, far }, point) {
  const from = subtract(point, center).map((x) => clamp(x, -far, far));
  const reach = from.map(Math.abs);
  const axis = reach.indexOf(Math.max(...reach));
  if (reach[axis] < near) from[axis] = from[axis] < 0 ? -near : near;
  return add(center, from);
}
