// Positions of a mechanism over time.

// One of the motions that are shown on top of each other: positions of its points over time.
class State {
  constructor(spec) {
    Object.assign(this, spec);
    this.t = array(spec.t);
    for (const body of this.bodies) body.row = body.row.map(c => Array.isArray(c) ? array(c[0]) : c);
  }
  // Sample and fraction of the interval at t.
  place(t) {
    let low = 0, high = this.t.length - 1;
    if (high < 1 || t <= this.t[0]) return [0, 0];
    if (t >= this.t[high]) return [high - 1, 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      this.t[middle] <= t ? low = middle : high = middle;
    }
    return [low, (t - this.t[low]) / (this.t[low + 1] - this.t[low])];
  }
  // Poses between samples: r linear; p linear on the shorter way, and normalised.
  poses(t) {
    const [i, f] = this.place(t);
    return this.bodies.map(body => {
      const value = (c, k) => typeof c == "number" ? c : c[Math.min(k, c.length - 1)];
      const a = body.row.map(c => value(c, i)), b = body.row.map(c => value(c, i + 1));
      const sign = a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6] < 0 ? -1 : 1;
      const mix = (k, s) => a[k] + f * (s * b[k] - a[k]), p = [3, 4, 5, 6].map(k => mix(k, sign)), n = Math.hypot(...p) || 1;
      return {r: [0, 1, 2].map(k => mix(k, 1)), p: p.map(v => v / n)};
    });
  }
  at(poses, body, s) { return body < 0 ? s : plus(poses[body].r, turned(poses[body].p, s)); }
  along(poses, body, v) { return body < 0 ? v : turned(poses[body].p, v); }
}
