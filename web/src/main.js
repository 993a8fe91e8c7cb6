// The page: a bundle and its original, seen by one viewer.

import * as THREE from 'three';
import { DEFAULTS, format, parse } from './address.js';
import { bounds, load, requireTextures, showImpostor } from './bundle.js';
import { outlines } from './cells.js';
import { fly, goTo, leave, lookAlong, lookAt, startOf, turn } from './flight.js';
import { MOVES, actionOf, help, movement } from './keys.js';
import { aim, planes } from './lens.js';
import { panel } from './panel.js';
import { Pictures } from './pictures.js';
import { contains, shownFrom } from './space.js';
import { add, clamp, scale } from './vectors.js';

/** Flickering shows each side for so long: slow enough for anybody's eyes. */
const FLICKER_MS = 500;

/** The panel is written anew so often. */
const PANEL_MS = 200;

const element = (id) => document.getElementById(id);

function say(words) {
  element('message').textContent = words;
}

function start({ data, manifest, sides }) {
  const space = manifest.options.view_space;
  const boxes = manifest.impostors.map(({ represented }) => represented);
  const centre = scale(bounds(manifest).reduce(add), 0.5);
  const canvas = element('picture');
  const pictures = new Pictures(canvas, data.background);
  requireTextures(sides, pictures.renderer.capabilities.maxTextureSize);
  const [camera, cameraOfLines] = [new THREE.PerspectiveCamera(), new THREE.PerspectiveCamera()];
  const lines = outlines(data.cells);
  const state = {
    mode: data.original ? 'split' : 'impostor',
    /** Among them, whether the cell is drawn; null: when it was left. */
    ...DEFAULTS,
    flight: startOf(data.views[0], data.aim),
  };
  const held = new Set();
  let [size, written, flickered] = [[1, 1], 0, ''];

  const viewOf = (number) => data.views.find(({ view }) => view === number);
  const visit = (number) => {
    const view = viewOf(number);
    if (view) goTo(state.flight, view, data.aim);
    else say(`there is no viewpoint ${number}`);
    moved();
  };
  const setMode = (mode) => {
    if (mode !== 'impostor' && !data.original) {
      say('the original was not there when this page was made: only the impostor is shown');
      return;
    }
    state.mode = mode;
  };
  const setPanel = (isShown) => {
    state.panel = isShown;
    element('panel').hidden = !isShown;
  };
  const lookAtCentre = () => lookAt(state.flight, data.aim === 'centre' ? data.views[0].target : centre);

  /** Something is to be drawn again. */
  let isStale = true;
  function moved() {
    isStale = true;
    pictures.touch();
  }

  function resize() {
    const { innerWidth: width, innerHeight: height, devicePixelRatio } = window;
    const { resolution } = manifest.options;
    const fit = Math.min(width, height);
    size = state.native
      ? [width, height].map((side) => Math.max(1, Math.round(side * devicePixelRatio)))
      : [resolution, resolution];
    const shown = state.native ? [width, height] : [fit, fit];
    pictures.resize(...size);
    [canvas.style.width, canvas.style.height] = shown.map((side) => `${side}px`);
    moved();
  }

  function follow(fragment) {
    const wanted = parse(fragment);
    if (wanted.leave !== null) leave(state.flight, space, wanted.leave);
    if (wanted.view !== null) visit(wanted.view);
    if (wanted.eye) {
      state.flight.eye = wanted.eye;
      state.flight.view = null;
      if (wanted.target) lookAt(state.flight, wanted.target);
      else if (wanted.forward) lookAlong(state.flight, wanted.forward);
      leave(state.flight, space, state.flight.leaves);
    }
    if (wanted.mode) setMode(wanted.mode);
    if (wanted.gain !== null) state.gain = wanted.gain;
    if (wanted.split !== null) state.split = clamp(wanted.split, 0, 1);
    if (wanted.panel !== null) setPanel(wanted.panel);
    if (wanted.cell !== null) state.cell = wanted.cell;
    if (wanted.native !== null && wanted.native !== state.native) {
      state.native = wanted.native;
      resize();
    }
    moved();
  }

  function save() {
    draw(performance.now());
    const { view } = state.flight;
    const name = [data.name, ...(view === null ? [] : [`view-${view}`]), state.mode].join('-');
    canvas.toBlob((picture) => {
      const link = document.createElement('a');
      link.href = URL.createObjectURL(picture);
      link.download = `${name}.png`;
      link.click();
      URL.revokeObjectURL(link.href);
    }, 'image/png');
  }

  const actions = {
    mode: setMode,
    split: (by) => (state.split = clamp(state.split + by, 0, 1)),
    gain: (by) => (state.gain = clamp(state.gain * by, 1, 64)),
    leave: () => leave(state.flight, space, !state.flight.leaves),
    target: lookAtCentre,
    cell: () => (state.cell = !drawsCell()),
    native: () => {
      state.native = !state.native;
      resize();
    },
    view: visit,
    worst: (rank) => {
      const number = data.worst[rank - 1];
      if (number !== undefined) visit(number);
      else if (data.worst.length > 0) say(`verify kept the worst ${data.worst.length} views`);
      else say('the worst views are not known: cargo xtask verify finds them');
    },
    step: (by) => {
      const numbers = data.views.map(({ view }) => view);
      const at = numbers.indexOf(state.flight.view ?? 0);
      visit(numbers[(at + by + numbers.length) % numbers.length]);
    },
    save,
    panel: () => setPanel(!state.panel),
    help: () => (element('help').hidden = !element('help').hidden),
  };

  const isInside = () => contains(space, state.flight.eye);
  const drawsCell = () => state.cell ?? !isInside();

  /** The impostor that is shown; -1 where all are. On borders between two, that of the viewpoint. */
  function shownImpostor() {
    const { view, eye } = state.flight;
    const shown = shownFrom(space, manifest.impostors, eye);
    return shown < 0 || view === null ? shown : viewOf(view).impostor;
  }

  /** The sides that a mode shows at a time. */
  function shownSides(now) {
    if (state.mode === 'flicker') return [Math.floor(now / FLICKER_MS) % 2 ? 'impostor' : 'original'];
    if (state.mode === 'original' || state.mode === 'impostor') return [state.mode];
    return ['original', 'impostor'];
  }

  function draw(now) {
    const { flight } = state;
    const { fov_degrees: fov } = manifest.options;
    const [near, far] = planes(boxes, flight.eye, fov);
    aim(camera, flight, [near, far], fov, ...size);
    showImpostor({ manifest, sides }, shownImpostor());
    const shown = shownSides(now);
    for (const side of shown) pictures.draw(side, sides[side], camera);
    // The cell is nearer than what is represented, and its lines hide nothing.
    if (drawsCell()) aim(cameraOfLines, flight, [far * 1e-5, far * 10], fov, ...size);
    const mode = shown.length > 1 ? state.mode : shown[0];
    pictures.show(mode, state, drawsCell() ? lines : null, cameraOfLines);
  }

  function write() {
    const { mode, gain, flight } = state;
    const { drawn, stopwatch } = pictures;
    element('panel').innerHTML = panel({
      data,
      manifest,
      mode,
      sides: shownSides(before),
      gain,
      flight,
      isInside: isInside(),
      drawn,
      stopwatch,
      size,
    });
    const fragment = format(state);
    // A link to what is shown, without a step in the history for each.
    if (fragment !== location.hash) history.replaceState(null, '', fragment);
  }

  let before = performance.now();
  function frame(now) {
    requestAnimationFrame(frame);
    const seconds = Math.min((now - before) / 1000, 0.1);
    before = now;
    const move = movement(held);
    if (move.some((x) => x !== 0)) {
      const faster = held.has('ShiftLeft') || held.has('ShiftRight') ? 4 : 1;
      fly(state.flight, space, centre, scale(move, seconds * faster));
      moved();
    }
    const [side] = shownSides(now);
    if (state.mode === 'flicker' && side !== flickered) isStale = true;
    flickered = side;
    pictures.stopwatch.collect();
    // Again, as the first time does not count.
    if (shownSides(now).some((side) => pictures.stopwatch.lacks(side))) moved();
    if (isStale) {
      isStale = false;
      draw(now);
      // For scripts: what is on the screen by now.
      document.documentElement.dataset.shown = `${state.mode} ${state.flight.view ?? ''}`.trim();
    }
    if (now - written > PANEL_MS) {
      written = now;
      write();
    }
  }

  addEventListener('resize', resize);
  // Not `location.hash`: the panel may have written the old state there since.
  addEventListener('hashchange', (event) => follow(new URL(event.newURL).hash));
  addEventListener('blur', () => held.clear());
  addEventListener('keyup', (event) => held.delete(event.code));
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    held.add(event.code);
    const found = MOVES[event.code] ? null : actionOf(event.key);
    if (found || MOVES[event.code]) event.preventDefault();
    if (!found || (event.repeat && !['split', 'gain', 'step'].includes(found.action))) return;
    say('');
    actions[found.action](found.value);
    if (!['save', 'panel', 'help'].includes(found.action)) moved();
  });
  canvas.addEventListener('webglcontextlost', () => say('the graphics device was lost: load the page again'));
  canvas.addEventListener('pointerdown', (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener('pointermove', (event) => {
    if (!canvas.hasPointerCapture(event.pointerId)) return;
    const angle = (manifest.options.fov_degrees * Math.PI) / 180 / Math.max(canvas.clientWidth, canvas.clientHeight);
    turn(state.flight, -event.movementX * angle, event.movementY * angle);
    moved();
  });
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    fly(state.flight, space, centre, [0, 0, -event.deltaY / 1000]);
    moved();
  }, { passive: false });

  element('help').innerHTML = help();
  document.title = `${data.name}: farfield`;
  say('');
  resize();
  follow(location.hash);
  requestAnimationFrame(frame);
}

try {
  start(await load());
} catch (error) {
  console.error(error);
  say(`this cannot be shown: ${error.message}`);
}
