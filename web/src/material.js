// Surfaces as the software renderer shades them, so that pictures can be compared: the functions
// `surface` and `lit_color` of the crate `sampling`, as a shader.

import * as THREE from 'three';
import { weighted } from './levels.js';

const VARYINGS = `
varying vec2 at;
varying vec3 normalInWorld;
varying vec3 pointInView;
#ifdef USE_COLOR_ALPHA
varying vec4 tint;
#endif
`;

const VERTEX = `${VARYINGS}void main() {
  at = uv;
#ifdef USE_COLOR_ALPHA
  tint = color;
#endif
  // Turned back by the transposed view.
  normalInWorld = (vec4(normalMatrix * normal, 0.0) * viewMatrix).xyz;
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  pointInView = place.xyz;
  gl_Position = projectionMatrix * place;
}`;

const FRAGMENT = `
uniform vec4 baseColor;
uniform float cutoff;
uniform vec3 emission;
uniform float normalScale;
uniform vec3 toSun, sun, sky, ground;
#ifdef HAS_COLOR_MAP
uniform sampler2D colorMap;
#endif
#ifdef HAS_NORMAL_MAP
uniform sampler2D bumpMap;
#endif
#ifdef HAS_EMISSIVE_MAP
uniform sampler2D glowMap;
#endif
${VARYINGS}
vec3 srgb(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}

// A normal bent by a bump: x along growing u, y against growing v.
vec3 bent(vec3 normal, vec3 bump, vec3 dx, vec3 dy, vec2 uvDx, vec2 uvDy) {
  float turn = sign(uvDx.x * uvDy.y - uvDx.y * uvDy.x);
  vec3 alongU = (dx * uvDy.y - dy * uvDx.y) * turn;
  vec3 alongV = (dy * uvDx.x - dx * uvDy.x) * turn;
  vec3 tangent = alongU - normal * dot(alongU, normal);
  float size = length(tangent);
  if (size == 0.0) return normal;
  tangent /= size;
  vec3 side = cross(normal, tangent);
  vec3 bitangent = dot(side, alongV) > 0.0 ? -side : side;
  return normalize(tangent * bump.x + bitangent * bump.y + normal * bump.z);
}

void main() {
  vec4 color = baseColor;
#ifdef USE_COLOR_ALPHA
  color *= tint;
#endif
#ifdef HAS_COLOR_MAP
  vec4 texel = texture2D(colorMap, at);
  // Averaged alpha would make thin leaves vanish or swell with distance.
  float alpha = color.a * textureLod(colorMap, at, 0.0).a;
  color.rgb *= texel.rgb;
#else
  float alpha = color.a;
#endif
#ifdef IS_LIT
  vec3 normal = normalize(normalInWorld);
#ifdef HAS_NORMAL_MAP
  vec3 bump = texture2D(bumpMap, at).xyz * 2.0 - 1.0;
  vec3 dx = (vec4(dFdx(pointInView), 0.0) * viewMatrix).xyz;
  vec3 dy = (vec4(dFdy(pointInView), 0.0) * viewMatrix).xyz;
  normal = bent(normal, bump * vec3(normalScale, normalScale, 1.0), dx, dy, dFdx(at), dFdy(at));
#endif
#ifdef DOUBLE_SIDED
  if (!gl_FrontFacing) normal = -normal;
#endif
  vec3 around = mix(ground, sky, normal.y * 0.5 + 0.5);
  color.rgb *= sun * max(dot(normal, toSun), 0.0) + around;
  vec3 glow = emission;
#ifdef HAS_EMISSIVE_MAP
  glow *= texture2D(glowMap, at).rgb;
#endif
  color.rgb += glow;
#endif
  if (alpha < cutoff) discard;
  gl_FragColor = vec4(srgb(color.rgb), 1.0);
}`;

/** Replaces the materials of what a glTF file shows. */
export function shade(scene, light) {
  const [known, levelled] = [new Map(), new Map()];
  const once = (map, key, make) => {
    if (!map.has(key)) map.set(key, make(key));
    return map.get(key);
  };
  // Materials share textures.
  const masking = (texture) => once(levelled, texture, weighted);
  const shaded = (material) => once(known, material, () => shader(material, light, masking));
  scene.traverse((node) => {
    if (node.isMesh) node.material = shaded(node.material);
  });
}

/** Blended surfaces count as there where alpha is at least a half, as in a bake. */
const cutoffOf = (material) => (material.transparent ? 0.5 : material.alphaTest);

/** - `masking`: gives a texture that masks the levels of detail that it needs */
function shader(material, light, masking) {
  const isLit = !material.isMeshBasicMaterial;
  const isDoubleSided = material.side === THREE.DoubleSide;
  const { color } = material;
  const map = material.map && cutoffOf(material) > 0 ? masking(material.map) : material.map;
  const bumps = isLit ? material.normalMap : null;
  const glows = isLit ? material.emissiveMap : null;
  const emission = isLit
    ? material.emissive.clone().multiplyScalar(material.emissiveIntensity)
    : new THREE.Color(0);
  const defines = {
    ...(isLit && { IS_LIT: '' }),
    ...(isDoubleSided && { DOUBLE_SIDED: '' }),
    ...(map && { HAS_COLOR_MAP: '' }),
    ...(bumps && { HAS_NORMAL_MAP: '' }),
    ...(glows && { HAS_EMISSIVE_MAP: '' }),
  };
  const value = (value) => ({ value });
  return new THREE.ShaderMaterial({
    name: material.name,
    side: material.side,
    vertexColors: material.vertexColors,
    // Of surfaces that are equally far, the first is seen.
    depthFunc: THREE.LessDepth,
    defines,
    uniforms: {
      baseColor: value(new THREE.Vector4(color.r, color.g, color.b, material.opacity)),
      cutoff: value(cutoffOf(material)),
      emission: value(emission),
      // Along y the loader turns it, for another idea of tangents.
      normalScale: value(isLit ? material.normalScale.x : 1),
      toSun: value(new THREE.Vector3(...light.to_sun)),
      sun: value(new THREE.Vector3(...light.sun)),
      sky: value(new THREE.Vector3(...light.sky)),
      ground: value(new THREE.Vector3(...light.ground)),
      colorMap: value(map),
      bumpMap: value(bumps),
      glowMap: value(glows),
    },
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
  });
}
