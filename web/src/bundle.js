// Loads what `view.json` and the manifest name.

import * as THREE from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { shade } from './material.js';

async function json(path) {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error(`${path}: ${answer.status} ${answer.statusText}`);
  return answer.json();
}

/** One side of the comparison, ready to be drawn. */
async function side(path, light) {
  const { scene } = await new GLTFLoader().loadAsync(path).catch((error) => {
    throw new Error(`${path}: ${error.message ?? error}`);
  });
  shade(scene, light);
  const root = new THREE.Scene();
  root.add(scene);
  root.updateMatrixWorld(true);
  // Nothing moves but the viewer.
  root.matrixWorldAutoUpdate = false;
  return root;
}

/** Everything that is shown; `original` is null where it was not there when the page was made. */
export async function load() {
  const [data, manifest] = await Promise.all([json('view.json'), json('bundle/bundle.json')]);
  const [original, impostor] = await Promise.all([
    data.original && side(data.original, data.light),
    side('bundle/impostors.glb', data.light),
  ]);
  return { data, manifest, sides: { original, impostor } };
}

/** Refuses textures that a device would shrink: impostors would show what is beside. */
export function requireTextures(sides, largest) {
  const check = (texture) => {
    const { width, height } = texture?.image ?? {};
    if (Math.max(width, height) > largest) {
      throw new Error(
        `a texture has ${width} x ${height} texels, and this device's limit is ${largest}: ` +
          `bake with --page-size ${largest}, or shrink the original's`,
      );
    }
  };
  for (const root of Object.values(sides)) {
    root?.traverse(({ material }) => {
      for (const name of ['colorMap', 'bumpMap', 'glowMap']) check(material?.uniforms[name].value);
    });
  }
}

/** Of several impostors shows only number `shown`, or all where that is -1. */
export function showImpostor({ manifest, sides }, shown) {
  const names = manifest.impostors.map((impostor) => impostor.name);
  for (const node of sides.impostor.children[0].children) {
    // The loader cleans names up, and keeps what the file has.
    node.visible = shown < 0 || node.userData.name === names[shown];
  }
}

/** Least and greatest corner of all that is represented. */
export function bounds({ impostors }) {
  const corner = (which, pick) =>
    impostors.map(({ represented }) => represented[which]).reduce((a, b) => a.map((x, i) => pick(x, b[i])));
  return [corner(0, Math.min), corner(1, Math.max)];
}
