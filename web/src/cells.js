// The borders of view cells as lines.

import * as THREE from 'three';

/** Pairs of corners that differ in one bit: the edges of a box. */
const EDGES = [0, 1, 2].flatMap((bit) =>
  [0, 1, 2, 3, 4, 5, 6, 7].filter((i) => !(i & (1 << bit))).map((i) => [i, i | (1 << bit)]),
);

/** Lines along the edges of cells, each given by its eight corners. */
export function outlines(cells) {
  const ends = cells.flatMap((corners) => EDGES.flatMap((edge) => edge.map((i) => corners[i])));
  // Relative to the first, as GPUs have few digits.
  const origin = ends[0] ?? [0, 0, 0];
  const points = ends.map((point) => new THREE.Vector3(...point.map((x, i) => x - origin[i])));
  const material = new THREE.LineBasicMaterial({ color: 0xffd040, depthTest: false });
  const lines = new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(points), material);
  lines.position.set(...origin);
  const scene = new THREE.Scene().add(lines);
  scene.updateMatrixWorld(true);
  return scene;
}
