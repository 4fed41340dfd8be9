// Draws parts of a mechanism on a canvas: bodies, springs, joints, ground, axes.

class Symbols {
  // Set by whoever draws: c, the context; colour(name); axes, rows to the right, up and towards the reader;
  // scale [px/m]; project(point) in pixels.

  stroke(points, closed = false) {
    this.c.beginPath();
    points.forEach((p, k) => k ? this.c.lineTo(p[0], p[1]) : this.c.moveTo(p[0], p[1]));
    if (closed) this.c.closePath();
    this.c.stroke();
  }

  draw_hull(hull) {
    const c = this.c, alpha = c.globalAlpha;
    c.lineWidth = 2.4;
    if (hull.length == 1) { c.beginPath(), c.arc(hull[0][0], hull[0][1], 6, 0, 7), c.fill(); return; }
    this.stroke(hull, true);
    c.globalAlpha = alpha * 0.15, c.fill(), c.globalAlpha = alpha;
  }

  draw_shape(shape, from, to) {
    const c = this.c, alpha = c.globalAlpha, width = Math.max(2.4, 2 * shape.radius * this.scale);
    if (shape.type == "sphere" || Math.hypot(to[0] - from[0], to[1] - from[1]) < 1e-6) {
      c.globalAlpha = alpha * 0.3, c.beginPath(), c.arc(from[0], from[1], Math.max(4, width / 2), 0, 7), c.fill();
      c.globalAlpha = alpha, c.lineWidth = 1.6, c.stroke();
      return;
    }
    const a = Math.atan2(to[1] - from[1], to[0] - from[0]), n = [-Math.sin(a) * width / 2, Math.cos(a) * width / 2];
    if (width < 5) { c.lineWidth = width, this.stroke([from, to]); return; }
    c.lineWidth = 1.6;
    const corners = [[from, 1], [to, 1], [to, -1], [from, -1]].map(([p, k]) => [p[0] + k * n[0], p[1] + k * n[1]]);
    this.stroke(corners, true);
    c.globalAlpha = alpha * 0.3, c.fill(), c.globalAlpha = alpha;
  }

  // A coil, a piston in its cylinder, or both side by side; they stretch with the distance of their ends.
  draw_spring(from, to, spring) {
    const c = this.c, length = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (length < 1) return;
    const along = [(to[0] - from[0]) / length, (to[1] - from[1]) / length], both = spring.spring && spring.damper;
    const at = (s, n) => [from[0] + along[0] * s - along[1] * n, from[1] + along[1] * s + along[0] * n];
    c.strokeStyle = this.colour("soft"), c.lineWidth = 1.4;
    const low = 0.15 * length, high = 0.85 * length, side = both ? 8 : 0;
    if (both) for (const s of [low, high]) this.stroke([at(s, -side), at(s, side)]);
    if (both) this.stroke([from, at(low, 0)]), this.stroke([at(high, 0), to]);
    if (spring.spring || !spring.damper) {
      const coil = both ? [] : [from], turns = 10;
      for (let k = 0; k <= 20 * turns; ++k) {
        const a = 2 * Math.PI * k / 20;
        coil.push(at(low + (high - low) * k / (20 * turns) + 2.5 * (1 - Math.cos(a)), -side + 5 * Math.sin(a)));
      }
      if (!both) coil.push(to);
      this.stroke(coil);
    }
    if (spring.damper) {
      const open = 0.4 * length, close = 0.65 * length, piston = 0.52 * length;
      this.stroke([at(both ? low : 0, side), at(open, side)]);
      this.stroke([at(close, side - 5), at(open, side - 5), at(open, side + 5), at(close, side + 5)]);
      this.stroke([at(piston, side - 4), at(piston, side + 4)]);
      this.stroke([at(piston, side), at(both ? high : length, side)]);
    }
  }

  draw_joint(s, poses, joint) {
    const c = this.c, spot = (b, p) => this.project(s.at(poses, b, p));
    const a = spot(joint.b1, joint.p1), b = spot(joint.b2, joint.p2);
    c.strokeStyle = this.colour("ink"), c.fillStyle = this.colour("paper"), c.lineWidth = 1.4;
    if (joint.b1 < 0 || joint.b2 < 0) this.draw_ground(joint.b1 < 0 ? a : b);
    c.strokeStyle = this.colour("ink"), c.fillStyle = this.colour("paper");
    const disc = (p, r) => { c.beginPath(), c.arc(p[0], p[1], r, 0, 7), c.fill(), c.stroke(); };
    const axis = joint.axis ? s.along(poses, joint.b1, joint.axis) : null;
    const flat = axis ? unit([dot(this.axes[0], axis), -dot(this.axes[1], axis), 0]) : [1, 0, 0];
    const length = axis ? Math.hypot(dot(this.axes[0], axis), dot(this.axes[1], axis)) / (Math.hypot(...axis) || 1) : 0;
    const block = p => {
      c.save(), c.translate(p[0], p[1]), c.rotate(Math.atan2(flat[1], flat[0]));
      c.fillRect(-9, -5, 18, 10), c.strokeRect(-9, -5, 18, 10), c.restore();
    };
    const line = (p, n) => this.stroke([-n, n].map(k => [p[0] + k * flat[0], p[1] + k * flat[1]]));
    const cross = (p, n) => {
      this.stroke([[p[0] - n, p[1]], [p[0] + n, p[1]]]);
      this.stroke([[p[0], p[1] - n], [p[0], p[1] + n]]);
    };
    switch (joint.type) {
      case "translational": line(b, 22), block(b); break;
      case "cylindrical": case "screw": line(b, 22), block(b), disc(b, 3); break;
      case "point_on_line": line(b, 22), disc(b, 3.5); break;
      case "fixed": c.fillStyle = this.colour("ink"), c.fillRect(b[0] - 4, b[1] - 4, 8, 8); break;
      case "distance": c.lineWidth = 2, this.stroke([a, b]), disc(a, 3.5), disc(b, 3.5); break;
      case "spherical": disc(b, 5), c.fillStyle = this.colour("ink"), disc(b, 2); break;
      case "universal": disc(b, 5), cross(b, 4); break;
      case "planar": case "point_on_plane": disc(b, 3); break;
      case "perpendicular": break;
      default: if (length > 0.2) line(b, 12 * length); disc(b, 4);
    }
  }

  draw_ground(p) {
    const c = this.c;
    c.strokeStyle = this.colour("soft"), c.lineWidth = 1.2;
    this.stroke([[p[0] - 8, p[1] + 13], p, [p[0] + 8, p[1] + 13]]);
    this.stroke([[p[0] - 12, p[1] + 13], [p[0] + 12, p[1] + 13]]);
    for (const x of [-8, -2, 4, 10]) this.stroke([[p[0] + x, p[1] + 13], [p[0] + x - 4, p[1] + 18]]);
  }

  // From a pixel along v [px]; one that is too short to see is left out.
  draw_arrow(from, v, colour, name = "") {
    const c = this.c, n = Math.hypot(v[0], v[1]);
    if (n < 5) return;
    const to = [from[0] + v[0], from[1] + v[1]], u = [v[0] / n, v[1] / n];
    const barb = side => [to[0] - 6 * u[0] - 3 * side * u[1], to[1] - 6 * u[1] + 3 * side * u[0]];
    c.strokeStyle = c.fillStyle = this.colour(colour), c.lineWidth = 1.6;
    this.stroke([from, to]);
    this.stroke([barb(1), to, barb(-1)]);
    if (name) c.fillText(name, to[0] + 7 * u[0] - 3, to[1] + 10 * u[1] + 4);
  }

  // A direction of space in pixels.
  flat(v) { return [dot(this.axes[0], v), -dot(this.axes[1], v)]; }

  // Prescribed places are crosses, measured ones dots; the one of now is larger.
  draw_target(places, now, measured) {
    const c = this.c, at = places.map(p => this.project(p));
    c.strokeStyle = c.fillStyle = this.colour(measured ? "c4" : "limit"), c.lineWidth = 1.4;
    at.forEach((p, k) => {
      const r = k == now ? 6 : 3.5;
      if (measured) { c.beginPath(), c.arc(p[0], p[1], r / 1.8, 0, 7), c.fill(); return; }
      this.stroke([[p[0] - r, p[1] - r], [p[0] + r, p[1] + r]]);
      this.stroke([[p[0] - r, p[1] + r], [p[0] + r, p[1] - r]]);
    });
  }

  // Axes, gravity and a round length, in the corners.
  draw_frame(w, h) {
    const c = this.c, colours = ["c1", "c2", "c0"], g = this.motion.gravity;
    for (let k = 0; k < 3; ++k)
      this.draw_arrow([42, h - 42], [26 * this.axes[0][k], -26 * this.axes[1][k]], colours[k], "xyz"[k]);
    if (Math.hypot(...g) > 0) this.draw_arrow([w - 34, 24], this.flat(unit(g)).map(v => 30 * v), "soft", "g");
    const raw = w / 8 / this.scale, power = 10 ** Math.floor(Math.log10(raw));
    const length = power * ([1, 2, 5].find(k => raw <= k * power) || 10);
    const right = w - 16, left = right - length * this.scale;
    c.strokeStyle = c.fillStyle = this.colour("soft"), c.lineWidth = 1.2;
    this.stroke([[left, h - 18], [left, h - 12], [right, h - 12], [right, h - 18]]);
    c.textAlign = "right", c.fillText(shown(length) + " m", right - 3, h - 18), c.textAlign = "left";
  }
}
