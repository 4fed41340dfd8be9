// Positions of a mechanism over time.

// One of the motions that are shown on top of each other: positions of its points over time.
class State {
  constructor(spec) {
    Object.assign(this, spec);
    this.t = array(spec.t);
    for (const body of this.bodies) body.row = body.row.map(c => Array.isArray(c) ? array(c[0]) : c);
    for (const target of this.targets) {
      target.t = array(target.t);
      target.place = target.place.map(k => k === null ? null : array(k));
    }
    if (!this.reactions) return;
    this.reactions.t = array(this.reactions.t);
    for (const joint of this.reactions.joints) joint.force = joint.force.map(array);
  }
  // Sample and fraction of the interval at t, of ascending times.
  place(t, times = this.t) {
    let low = 0, high = times.length - 1;
    if (high < 1 || t <= times[0]) return [0, 0];
    if (t >= times[high]) return [high - 1, 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      times[middle] <= t ? low = middle : high = middle;
    }
    return [low, (t - times[low]) / (times[low + 1] - times[low])];
  }
  // Poses between samples: r linear; p linear on the shorter way, and normalised.
  poses(t) {
    const [i, f] = this.place(t);
    return this.bodies.map(body => {
      const value = (c, k) => typeof c == "number" ? c : c[Math.min(k, c.length - 1)];
      const a = body.row.map(c => value(c, i)), b = body.row.map(c => value(c, i + 1));
      const sign = a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6] < 0 ? -1 : 1;
      const mix = (k, s) => a[k] + f * (s * b[k] - a[k]);
      const p = [3, 4, 5, 6].map(k => mix(k, sign)), n = Math.hypot(...p) || 1;
      return {r: [0, 1, 2].map(k => mix(k, 1)), p: p.map(v => v / n)};
    });
  }
  // The places of a target. Coordinates that nobody prescribed or measured are those of the mechanism.
  places(target) {
    return target.t.map((t, i) => {
      const moved = target.place.includes(null) ? this.at(this.poses(t), target.b, target.p) : [];
      return target.place.map((values, k) => values === null ? moved[k] : values[i]);
    });
  }
  // The force on the second body of a joint [N].
  reaction(joint, t) {
    const [i, f] = this.place(t, this.reactions.t);
    return joint.force.map(x => {
      const a = x[i] ?? NaN, b = i + 1 < x.length ? x[i + 1] ?? NaN : a;
      return a + f * (b - a);
    });
  }
  at(poses, body, s) { return body < 0 ? s : plus(poses[body].r, turned(poses[body].p, s)); }
  along(poses, body, v) { return body < 0 ? v : turned(poses[body].p, v); }
}
