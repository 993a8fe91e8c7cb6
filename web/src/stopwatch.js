// How long drawing takes.

/** Milliseconds are the median of so many frames. */
const FRAMES = 9;

export class Stopwatch {
  constructor(gl) {
    this.gl = gl;
    this.timer = gl.getExtension('EXT_disjoint_timer_query_webgl2');
    /** What the milliseconds are: of the GPU, or until the GPU had done it. */
    this.what = this.timer ? 'GPU ms' : 'ms until drawn';
    this.milliseconds = {};
    this.times = {};
    this.running = [];
  }

  /** Runs `work`, and adds its time to those of `name`. */
  time(name, work) {
    const { gl, timer } = this;
    if (!timer) {
      const start = performance.now();
      work();
      // Waits for the GPU, as `finish` does not everywhere.
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      this.add(name, performance.now() - start);
      return;
    }
    const query = gl.createQuery();
    gl.beginQuery(timer.TIME_ELAPSED_EXT, query);
    work();
    gl.endQuery(timer.TIME_ELAPSED_EXT);
    this.running.push({ name, query });
  }

  /** Whether a name's time is neither known nor to be known soon. */
  lacks(name) {
    return this.milliseconds[name] === undefined && !this.running.some((one) => one.name === name);
  }

  /** Takes the times that are known by now. */
  collect() {
    const { gl, timer } = this;
    const isKnown = ({ query }) => gl.getQueryParameter(query, gl.QUERY_RESULT_AVAILABLE);
    while (this.running.length > 0 && isKnown(this.running[0])) {
      const { name, query } = this.running.shift();
      const isDisturbed = gl.getParameter(timer.GPU_DISJOINT_EXT);
      if (!isDisturbed) this.add(name, gl.getQueryParameter(query, gl.QUERY_RESULT) / 1e6);
      gl.deleteQuery(query);
    }
  }

  add(name, milliseconds) {
    const times = (this.times[name] ??= []);
    times.push(milliseconds);
    // Programs are compiled and textures uploaded while the first frame is drawn.
    if (this.milliseconds[name] === undefined && times.length < 2) return;
    if (times.length > FRAMES || this.milliseconds[name] === undefined) times.shift();
    this.milliseconds[name] = [...times].sort((a, b) => a - b)[times.length >> 1];
  }
}
