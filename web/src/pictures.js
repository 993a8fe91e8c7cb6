// Both sides rendered to textures, and what is made of the two.

import * as THREE from 'three';
import { Stopwatch } from './stopwatch.js';

const SIDES = ['original', 'impostor'];

const COMPOSE = `
precision highp float;
uniform sampler2D original, impostor;
uniform vec3 background;
uniform int mode;
uniform float gain;
uniform int border;
out vec4 shown;

vec3 over(vec4 color) { return mix(background, color.rgb, color.a); }

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec3 before = over(texelFetch(original, pixel, 0));
  vec3 after = over(texelFetch(impostor, pixel, 0));
  vec3 color = before;
  if (mode == 1) color = after;
  if (mode == 2) color = pixel.x < border ? before : pixel.x == border ? vec3(1.0) : after;
  if (mode == 3) color = min(abs(before - after) * gain, 1.0);
  shown = vec4(color, 1.0);
}`;

/** What the shader calls the modes; flickering is one and then the other. */
const SHOWN = { original: 0, impostor: 1, split: 2, difference: 3 };

export class Pictures {
  constructor(canvas, background) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: false, alpha: false, depth: false });
    this.renderer.autoClear = false;
    this.renderer.setClearColor(0x000000, 0);
    // In the order of the file: the first of equals is seen.
    this.renderer.sortObjects = false;
    const target = () => new THREE.WebGLRenderTarget(1, 1, { depthBuffer: true });
    this.targets = { original: target(), impostor: target() };
    this.stale = { original: true, impostor: true };
    this.drawn = { original: null, impostor: null };
    this.stopwatch = new Stopwatch(this.renderer.getContext());
    const value = (value) => ({ value });
    this.uniforms = {
      original: value(this.targets.original.texture),
      impostor: value(this.targets.impostor.texture),
      background: value(new THREE.Vector3(...background)),
      mode: value(0),
      gain: value(4),
      border: value(0),
    };
    const material = new THREE.RawShaderMaterial({
      glslVersion: THREE.GLSL3,
      vertexShader: 'in vec3 position; void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }',
      fragmentShader: COMPOSE,
      uniforms: this.uniforms,
      depthTest: false,
      depthWrite: false,
    });
    const all = new THREE.BufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    all.setAttribute('position', new THREE.BufferAttribute(corners, 3));
    const mesh = new THREE.Mesh(all, material);
    mesh.frustumCulled = false;
    this.composed = new THREE.Scene().add(mesh);
    this.anywhere = new THREE.Camera();
  }

  /** Pixels of the picture. */
  resize(width, height) {
    this.renderer.setPixelRatio(1);
    this.renderer.setSize(width, height, false);
    for (const side of SIDES) this.targets[side].setSize(width, height);
    this.touch();
  }

  /** The viewer moved: both sides are to be drawn again when they are shown. */
  touch() {
    for (const side of SIDES) this.stale[side] = true;
  }

  /** Draws a side where that was not done since the viewer moved, and remembers what it took. */
  draw(side, scene, camera) {
    if (!this.stale[side] || !scene) return;
    this.stale[side] = false;
    const { renderer } = this;
    renderer.setRenderTarget(this.targets[side]);
    this.stopwatch.time(side, () => {
      renderer.clear();
      renderer.render(scene, camera);
    });
    const { triangles, calls } = renderer.info.render;
    this.drawn[side] = { triangles, calls };
  }

  /** Shows what was drawn, and lines over it. */
  show(mode, { gain, split }, lines, camera) {
    const { renderer, uniforms } = this;
    uniforms.mode.value = SHOWN[mode];
    uniforms.gain.value = gain;
    uniforms.border.value = Math.round(split * this.targets.original.width);
    renderer.setRenderTarget(null);
    renderer.render(this.composed, this.anywhere);
    if (lines) renderer.render(lines, camera);
  }
}
