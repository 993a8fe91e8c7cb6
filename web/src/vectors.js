// Arithmetic on points and directions, arrays of three numbers.

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const subtract = (a, b) => a.map((x, i) => x - b[i]);
export const scale = (a, s) => a.map((x) => x * s);
export const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
export const length = (a) => Math.sqrt(dot(a, a));
export const distance = (a, b) => length(subtract(a, b));
export const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];

/** Of length 1; NaN where the vector has no direction. */
export const normalize = (a) => scale(a, 1 / length(a));

export const clamp = (x, least, most) => Math.min(Math.max(x, least), most);

/**
 * Axes of a viewer who looks along a direction: +Y is up or, when that is straight up or down, -Z,
 * as in the crate `views`.
 */
export function axes(along) {
  const forward = normalize(along);
  const sideways = cross(forward, [0, 1, 0]);
  const right = normalize(dot(sideways, sideways) > 1e-12 ? sideways : cross(forward, [0, 0, -1]));
  return { right, up: cross(right, forward), forward };
}
