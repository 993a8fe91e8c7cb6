// What keys do. The help is made of the same table.

/** Keys that move while they are held: right, up, forward. */
export const MOVES = {
  KeyW: [0, 0, 1],
  KeyS: [0, 0, -1],
  KeyA: [-1, 0, 0],
  KeyD: [1, 0, 0],
  KeyE: [0, 1, 0],
  KeyQ: [0, -1, 0],
  ArrowUp: [0, 0, 1],
  ArrowDown: [0, 0, -1],
  ArrowLeft: [-1, 0, 0],
  ArrowRight: [1, 0, 0],
  PageUp: [0, 1, 0],
  PageDown: [0, -1, 0],
};

/** The keys by what they are called, another one that does the same, what they do, and the name of the action. */
export const KEYS = [
  { key: 'o', say: 'original', action: 'mode', value: 'original' },
  { key: 'i', say: 'impostor', action: 'mode', value: 'impostor' },
  { key: 'p', say: 'split screen: original left, impostor right', action: 'mode', value: 'split' },
  { key: 'f', say: 'flicker between both', action: 'mode', value: 'flicker' },
  { key: 'm', say: 'difference of both', action: 'mode', value: 'difference' },
  { key: ',', say: 'moves the border of the split to the left', action: 'split', value: -0.02 },
  { key: '.', say: 'moves it to the right', action: 'split', value: 0.02 },
  { key: '-', say: 'halves how much differences are amplified', action: 'gain', value: 0.5 },
  { key: '+', say: 'doubles it', action: 'gain', value: 2 },
  { key: 'l', say: 'leaves the view cell, or returns to it', action: 'leave' },
  { key: 't', say: 'looks at the centre again', action: 'target' },
  { key: 'c', say: 'draws the view cell, or not', action: 'cell' },
  { key: 'r', say: "as many pixels as promised, or the window's own", action: 'native' },
  { key: '0', say: 'reference viewpoint', action: 'view', value: 0 },
  { key: '1', to: '9', say: 'worst views, the worst first', action: 'worst' },
  // Brackets need AltGr on many keyboards.
  { key: '[', or: 'b', say: 'viewpoint before', action: 'step', value: -1 },
  { key: ']', or: 'n', say: 'next viewpoint', action: 'step', value: 1 },
  { key: 'k', say: 'saves the picture', action: 'save' },
  { key: 'x', say: 'hides all but the picture, or shows it', action: 'panel' },
  { key: 'h', say: 'this help', action: 'help' },
];

/** The action of a key, with its value. */
export function actionOf(key) {
  const pressed = { '=': '+', '?': 'h' }[key] ?? key.toLowerCase();
  const found = KEYS.find((one) => one.key === pressed || one.or === pressed || (one.to && one.key <= pressed && pressed <= one.to));
  if (!found || pressed.length !== 1) return null;
  return { action: found.action, value: found.to ? Number(pressed) : found.value };
}

/** Moves of the keys that are held, added up. */
export function movement(held) {
  const total = [0, 0, 0];
  for (const code of held) MOVES[code]?.forEach((x, i) => (total[i] += x));
  return total;
}

/** The help as HTML. */
export function help() {
  const moves = [
    ['W A S D', 'fly, or the arrow keys; with Shift faster'],
    ['E Q', 'up and down'],
    ['mouse', 'drag to look elsewhere; the wheel flies on'],
  ];
  const name = ({ key, or, to }) => [key, or].filter(Boolean).join(' ').toUpperCase() + (to ? ` – ${to}` : '');
  const rows = [...moves, ...KEYS.map((one) => [name(one), one.say])];
  const row = ([keys, say]) => `<tr><th><kbd>${keys}</kbd></th><td>${say}</td></tr>`;
  return `<h2>Keys</h2><table>${rows.map(row).join('')}</table>`;
}
