// The camera of the promise as three.js has it.

import * as THREE from 'three';
import { axesOf } from './flight.js';

/** Distance of a point from a box. */
function gap([min, max], point) {
  return Math.hypot(...point.map((x, i) => Math.max(min[i] - x, 0, x - max[i])));
}

/** Distance from a point to the farthest corner of a box. */
function reach([min, max], point) {
  return Math.hypot(...point.map((x, i) => Math.max(x - min[i], max[i] - x)));
}

/**
 * Distances along the axis that enclose boxes as far as they can be in the picture: as tightly as the
 * depth buffer needs to tell layers apart.
 */
export function planes(boxes, eye, fovDegrees) {
  const far = Math.max(...boxes.map((box) => reach(box, eye))) * 1.1;
  // In a corner of the picture depths are this much less than distances.
  const cosine = 1 / Math.hypot(1, Math.SQRT2 * slope(fovDegrees));
  const near = Math.min(...boxes.map((box) => gap(box, eye))) * cosine * 0.9;
  return [Math.max(near, far * 1e-4), far];
}

/** Points a camera as a flight has it; the field of view spans the larger side of the picture. */
export function aim(camera, flight, [near, far], fovDegrees, width, height) {
  const { right, up, forward } = axesOf(flight);
  const basis = new THREE.Matrix4().makeBasis(
    new THREE.Vector3(...right),
    new THREE.Vector3(...up),
    new THREE.Vector3(...forward).negate(),
  );
  camera.position.set(...flight.eye);
  camera.quaternion.setFromRotationMatrix(basis);
  camera.updateMatrixWorld(true);
  const size = (near * slope(fovDegrees)) / Math.max(width, height);
  const [x, y] = [size * width, size * height];
  camera.projectionMatrix.makePerspective(-x, x, y, -y, near, far);
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
}

/** Half of a picture's side per unit of depth. */
const slope = (fovDegrees) => Math.tan((fovDegrees * Math.PI) / 360);
