// Positions of a mechanism over time.

// One of the motions that are shown on top of each other: positions of its points over time.
class State {
  constructor(spec) { Object.assign(this, spec); }
  // Sample and fraction of the interval at t, of ascending times.
  place(t, times = this.t) {
    const low = below(times, t), share = (t - times[low]) / (times[low + 1] - times[low]);
    return [low, Math.min(Math.max(share || 0, 0), 1)];
  }
  // Poses between samples: r linear; p linear on the shorter way, and normalised.
  poses(t) {
    const [i, f] = this.place(t);
    return this.bodies.map(body => {
      const value = (c, k) => typeof c == "number" ? c : c[Math.min(k, c.length - 1)];
      const a = body.pose.map(c => value(c, i)), b = body.pose.map(c => value(c, i + 1));
      const sign = a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6] < 0 ? -1 : 1;
      const mix = (k, s) => a[k] + f * (s * b[k] - a[k]);
      const p = [3, 4, 5, 6].map(k => mix(k, sign)), n = Math.hypot(...p) || 1;
      return {r: [0, 1, 2].map(k => mix(k, 1)), p: p.map(v => v / n)};
    });
  }
  // The places of a target. Coordinates that nobody prescribed or measured are those of the mechanism.
  places(target) {
    return target.t.map((t, i) => {
      const moved = target.place.includes(null) ? this.at(this.poses(t), target.at) : [];
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
  // A point and a direction of a body, or of the ground, in space.
  at(poses, {b, p}) { return b < 0 ? p : plus(poses[b].r, turned(poses[b].p, p)); }
  along(poses, {b, p}) { return b < 0 ? p : turned(poses[b].p, p); }
}
