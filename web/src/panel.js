// What is shown and what it costs, in words.

const count = (n) => (n === undefined || n === null ? '–' : Math.round(n).toLocaleString('en'));
const megabytes = (n) => (n === undefined ? '–' : `${(n / 1e6).toFixed(2)} MB`);
const milliseconds = (n) => (n === undefined ? '–' : n.toFixed(2));

/** Text that came from files, in HTML. */
const text = (words) => words.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);

/**
 * The panel as HTML.
 *
 * - `data`, `manifest`: what the page shows
 * - `mode`, `sides`, `gain`, `flight`, `isInside`: how it shows it
 * - `drawn`, `stopwatch`: what drawing took
 */
export function panel({ data, manifest, mode, sides, gain, flight, isInside, drawn, stopwatch, size }) {
  const { original, impostor } = data.cost;
  const { options, technique } = manifest;
  const rows = [
    ['triangles', count(original?.triangles), count(impostor.triangles)],
    ['draw calls', count(original?.draw_calls), count(impostor.draw_calls)],
    ['in this view', inView(drawn.original), inView(drawn.impostor)],
    ['textures', megabytes(original?.texture_bytes), megabytes(impostor.texture_bytes)],
    ['geometry', megabytes(original?.geometry_bytes), megabytes(impostor.geometry_bytes)],
    [
      stopwatch.what,
      milliseconds(stopwatch.milliseconds.original),
      milliseconds(stopwatch.milliseconds.impostor),
    ],
  ];
  const row = (cells) => `<tr><th>${cells[0]}</th>${cells.slice(1).map((cell) => `<td>${cell}</td>`).join('')}</tr>`;
  const lines = [
    { difference: `difference, ${gain} times as strong`, flicker: `flicker: ${sides}` }[mode] ?? mode,
    flight.view === null ? place(flight.eye) : `viewpoint ${flight.view}${worst(data, flight.view)}`,
    `${size[0]} × ${size[1]} pixels, ${options.fov_degrees}°; promised for ${options.resolution} × ${options.resolution}`,
  ];
  const warnings = [
    ...(isInside ? [] : ['outside of the view cell: gaps open here']),
    ...(data.aim === 'centre' && !flight.target
      ? ['the promise is for a camera that looks at the centre']
      : []),
    ...(options.view_space.kind === 'amid' ? ['what is near the view cell stays geometry and is not shown'] : []),
    ...(data.original ? [] : ['the original was not there: only the impostor is shown']),
  ];
  return `<h1>${text(data.name)}, ${technique.name}</h1>
    <table><tr><th></th><td>original</td><td>impostor</td></tr>${rows.map(row).join('')}</table>
    ${lines.map((line) => `<p>${line}</p>`).join('')}
    ${warnings.map((line) => `<p class="outside">${line}</p>`).join('')}
    <p><kbd>H</kbd> help</p>`;
}

const inView = (drawn) => (drawn ? `${count(drawn.triangles)} / ${count(drawn.calls)}` : '–');

const place = (eye) => `at ${eye.map((x) => Number(x.toPrecision(5))).join(', ')}`;

function worst({ worst }, view) {
  const rank = worst.indexOf(view);
  return rank < 0 ? '' : `, number ${rank + 1} of the worst`;
}
