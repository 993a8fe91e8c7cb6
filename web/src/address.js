// What the fragment of the page's address sets, so that links and scripts can:
// #mode=difference&view=3&gain=8&split=0.5&panel=0&cell=1&native=1&leave=1&eye=x,y,z&target=x,y,z,
// or &forward=x,y,z in place of the target where no point is looked at.

export const MODES = ['original', 'impostor', 'split', 'flicker', 'difference'];

const number = (text) => (text !== null && text !== '' && Number.isFinite(+text) ? +text : null);
const flag = (text) => (text === null ? null : text !== '0');
const point = (text) => {
  const numbers = (text ?? '').split(',').map(number);
  return numbers.length === 3 && numbers.every((x) => x !== null) ? numbers : null;
};

/** What a fragment says; null for what it does not say or what makes no sense. */
export function parse(fragment) {
  const given = new URLSearchParams(fragment.replace(/^#/, ''));
  const mode = given.get('mode');
  return {
    mode: MODES.includes(mode) ? mode : null,
    view: number(given.get('view')),
    gain: number(given.get('gain')),
    split: number(given.get('split')),
    panel: flag(given.get('panel')),
    cell: flag(given.get('cell')),
    native: flag(given.get('native')),
    leave: flag(given.get('leave')),
    eye: point(given.get('eye')),
    target: point(given.get('target')),
    forward: point(given.get('forward')),
  };
}

/** How a page begins; fragments say only what differs. */
export const DEFAULTS = { gain: 4, split: 0.5, panel: true, cell: null, native: false };

/** The fragment that leads back to what is shown. */
export function format({ mode, flight, ...settings }) {
  const { view, eye, target, forward, leaves } = flight;
  const place = view === null ? [`eye=${eye}`, target ? `target=${target}` : `forward=${forward}`] : [`view=${view}`];
  const differs = Object.keys(DEFAULTS).filter((name) => settings[name] !== DEFAULTS[name]);
  const others = differs.map((name) => `${name}=${Number(settings[name])}`);
  return '#' + [`mode=${mode}`, ...place, ...(leaves ? ['leave=1'] : []), ...others].join('&');
}
