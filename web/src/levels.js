// Levels of detail of textures that mask: colours are averaged in linear light and weighted with alpha,
// so that the invisible colours of transparent texels do not bleed into visible ones, as `Textures` of
// the crate `sampling` has them. GPUs average without weights.

import * as THREE from 'three';

const LINEAR = Float64Array.from({ length: 256 }, (_, i) => linear(i / 255));

function linear(value) {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

function srgb(intensity) {
  return intensity <= 0.0031308 ? intensity * 12.92 : 1.055 * intensity ** (1 / 2.4) - 0.055;
}

/** A level of half the width and height: `data` holds sRGB and straight alpha, row by row. */
export function halved({ data, width, height }) {
  const [columns, rows] = [width, height].map((side) => Math.max(side >> 1, 1));
  const half = new Uint8Array(columns * rows * 4);
  for (let y = 0; y < rows; y++) {
    for (let x = 0; x < columns; x++) {
      const four = [0, 1, 2, 3].map((i) => {
        const column = Math.min(2 * x + (i & 1), width - 1);
        const row = Math.min(2 * y + (i >> 1), height - 1);
        return (row * width + column) * 4;
      });
      const total = four.reduce((sum, at) => sum + data[at + 3], 0);
      const weight = (at) => (total > 0 ? data[at + 3] / total : 1 / 4);
      const to = (y * columns + x) * 4;
      for (let c = 0; c < 3; c++) {
        const mean = four.reduce((sum, at) => sum + LINEAR[data[at + c]] * weight(at), 0);
        half[to + c] = Math.round(srgb(mean) * 255);
      }
      half[to + 3] = Math.round(total / 4);
    }
  }
  return { data: half, width: columns, height: rows };
}

/** A texture with such levels; itself where it has no levels. */
export function weighted(texture) {
  if (texture.minFilter !== THREE.LinearMipmapLinearFilter) return texture;
  const { image } = texture;
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext('2d', { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  const { data } = context.getImageData(0, 0, image.width, image.height);
  const levels = [{ data: new Uint8Array(data.buffer), width: image.width, height: image.height }];
  while (Math.max(levels.at(-1).width, levels.at(-1).height) > 1) levels.push(halved(levels.at(-1)));
  const made = new THREE.DataTexture(levels[0].data, image.width, image.height);
  made.mipmaps = levels;
  made.generateMipmaps = false;
  for (const same of ['wrapS', 'wrapT', 'magFilter', 'minFilter', 'colorSpace']) made[same] = texture[same];
  made.needsUpdate = true;
  return made;
}
