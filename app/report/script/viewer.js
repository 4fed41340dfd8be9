// The mechanism that moves: its controls, the view, the order in which parts are drawn.

const kArrow = 80;  // length of a large force [px]

class Viewer extends Symbols {
  constructor(box, motion) {
    super();
    this.motion = motion, this.states = motion.states.map(s => new State(s));
    const times = this.states.flatMap(s => [s.t[0], s.t.at(-1)]);
    this.begin = Math.min(...times), this.end = Math.max(...times), this.t = this.begin;
    this.playing = false, this.hidden = new Set();
    this.canvas = element("canvas", {tabindex: "0", role: "img", "aria-label":
      "The mechanism. Space plays, left and right arrows step, up and down arrows turn, plus and minus zoom, 0 fits."});
    box.append(this.canvas, ...this.controls());
    if (motion.note) box.append(element("p", {class: "note"}, [motion.note]));
    this.bounds();
    this.view(motion.planar ? "flat" : "iso");
    this.listen();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    cursor.listeners.push(t => { this.t = Math.min(Math.max(t, this.begin), this.end); this.draw(); });
  }

  controls() {
    const button = (text, label, action) => {
      const b = element("button", {type: "button", "aria-label": label, title: label}, [text]);
      b.onclick = action;
      return b;
    };
    const check = (text, checked, action) => {
      const input = element("input", {type: "checkbox"});
      input.checked = checked, input.onchange = () => action(input.checked);
      return element("label", {}, [input, " " + text]);
    };
    const span = this.end - this.begin;
    this.play_button = button("\u25b6", "play", () => this.play(!this.playing));
    this.slider = element("input", {type: "range", min: 0, max: 1000, step: "any", value: 0, "aria-label": "time"});
    this.slider.oninput = () => cursor.set(this.begin + span * this.slider.value / 1000);
    this.clock = element("output", {}, []);
    // Real time, unless the motion would pass in a moment or last long.
    const fitting = [0.001, 0.01, 0.1, 0.25, 0.5, 1, 2, 5, 10, 100].filter(s => span / s >= 1.5 && span / s <= 20);
    this.speed = fitting.includes(1) ? 1 : fitting[0] || span / 6;
    const choices = [...new Set([0.001, 0.01, 0.1, 0.25, 0.5, 1, 2, 5, 10, 100, this.speed])].sort((a, b) => a - b);
    const speed = element("select", {"aria-label": "speed", title: "speed"}, choices.map(s => {
      const option = element("option", {value: s}, ["\u00d7 " + shown(s, 2)]);
      option.selected = s == this.speed;
      return option;
    }));
    speed.onchange = () => this.speed = Number(speed.value);
    this.loop = true, this.names = this.states[0].bodies.length <= 6;
    const first = element("div", {class: "controls"}, [
      this.play_button, this.slider, this.clock, speed, check("loop", true, on => this.loop = on)]);
    const principal = [["xy", "x-y"], ["xz", "x-z"], ["yz", "y-z"]];
    const views = [...(this.motion.planar ? [["flat", "plane"]] : principal), ["iso", "isometric"]];
    const second = element("div", {class: "controls"}, [
      ...views.map(([key, text]) => button(text, "view: " + text, () => this.view(key))),
      button("\u2212", "zoom out", () => this.zoom(0.8)), button("+", "zoom in", () => this.zoom(1.25)),
      button("fit", "fit into the frame", () => this.fit()),
      check("names", this.names, on => { this.names = on; this.draw(); })]);
    const toggle = name => on => { on ? this.hidden.delete(name) : this.hidden.add(name); this.draw(); };
    for (const s of this.states) if (s.ghost) second.append(check(s.name, true, toggle("ghost " + s.name)));
    const traces = this.states.at(-1).traces.map(t => t.name);
    traces.slice(0, 6).forEach((name, k) => {
      if (k > 1) this.hidden.add("trace " + name);
      second.append(check("path of " + name, k < 2, toggle("trace " + name)));
    });
    const last = this.states.at(-1), kinds = new Set(last.targets.map(t => t.measured ? "measured" : "targets"));
    for (const kind of kinds) second.append(check(kind, true, toggle(kind)));
    if (last.reactions) {
      this.hidden.add("reactions");  // on demand
      const name = `reactions (${kArrow} px: ${shown(last.reactions.large, 3)} N)`;
      second.append(check(name, false, toggle("reactions")));
    }
    return [first, second];
  }

  // The box that holds all points at all times.
  bounds() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    const include = p => p.forEach((v, k) => { low[k] = Math.min(low[k], v), high[k] = Math.max(high[k], v); });
    for (const s of this.states) {
      for (let k = 0; k <= 40; ++k) {
        const poses = s.poses(this.begin + (this.end - this.begin) * k / 40);
        s.bodies.forEach((b, i) => b.points.forEach(p => include(s.at(poses, i, p))));
        s.bodies.forEach((b, i) => b.shapes.forEach(shape => {
          for (const end of [shape.from, shape.to])
            for (const r of [-shape.radius, shape.radius]) include(s.at(poses, i, end).map(v => v + r));
        }));
        for (const j of [...s.joints, ...s.springs])
          include(s.at(poses, j.b1, j.p1)), include(s.at(poses, j.b2, j.p2));
      }
      for (const target of s.targets) {
        target.places = s.places(target);
        target.places.forEach(include);
      }
    }
    this.low = low, this.high = high;
  }

  // Rows of `axes`: the global directions to the right, up and towards the reader.
  view(key) {
    const e = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], g = this.motion.gravity;
    const flat = key == "flat" ? this.motion.plane : {xy: [0, 1], xz: [0, 2], yz: [1, 2]}[key];
    if (flat) {
      this.axes = [e[flat[0]], e[flat[1]], cross(e[flat[0]], e[flat[1]])];
    } else {  // from where the three axes look equally long; up is against gravity, or z
      const up = Math.hypot(...g) > 0 ? unit(g.map(v => -v)) : e[2], size = up.map(Math.abs);
      const k = size.indexOf(Math.max(...size));
      const out = unit(plus(plus(e[(k + 1) % 3], up), e[(k + 2) % 3])), right = unit(cross(up, out));
      this.axes = [right, cross(out, right), out];
    }
    this.fit();
  }

  fit() {
    this.target = this.low.map((v, k) => (v + this.high[k]) / 2), this.pan = [0, 0], this.scale = null;
    this.draw();
  }
  zoom(factor) { this.scale *= factor, this.pan = this.pan.map(v => v * factor); this.draw(); }
  turn(dx, dy) {
    const [right, up, out] = this.axes;
    // Rodrigues' formula: v cos a + axis x v sin a + axis (axis.v) (1 - cos a)
    const about = (axis, v, a) => {
      const normal = cross(axis, v), along = dot(axis, v) * (1 - Math.cos(a));
      return v.map((x, k) => x * Math.cos(a) + normal[k] * Math.sin(a) + axis[k] * along);
    };
    this.axes = [right, up, out].map(v => about(right, about(up, v, -dx), -dy));
    this.draw();
  }

  listen() {
    const pointers = new Map();
    let spread = null;
    this.canvas.addEventListener("pointerdown", e => {
      pointers.set(e.pointerId, [e.clientX, e.clientY]), this.canvas.setPointerCapture(e.pointerId), spread = null;
    });
    this.canvas.addEventListener("pointermove", e => {
      const before = pointers.get(e.pointerId);
      if (!before) return;
      const dx = e.clientX - before[0], dy = e.clientY - before[1];
      pointers.set(e.pointerId, [e.clientX, e.clientY]);
      if (pointers.size == 2) {
        const [a, b] = [...pointers.values()], distance = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (spread) this.zoom(distance / spread);
        spread = distance;
      }
      if (pointers.size == 2 || e.shiftKey || e.buttons == 2 || e.buttons == 4) {
        this.pan = [this.pan[0] + dx / pointers.size, this.pan[1] + dy / pointers.size];
        this.draw();
      } else {
        this.turn(dx * 0.008, dy * 0.008);
      }
    });
    for (const end of ["pointerup", "pointercancel"])
      this.canvas.addEventListener(end, e => { pointers.delete(e.pointerId); });
    this.canvas.addEventListener("contextmenu", e => e.preventDefault());
    const wheel = e => { e.preventDefault(); this.zoom(Math.exp(-e.deltaY * 0.0015)); };
    this.canvas.addEventListener("wheel", wheel, {passive: false});
    this.canvas.onkeydown = e => {
      const step = (this.end - this.begin) / 100, to = t => cursor.set(Math.min(Math.max(t, this.begin), this.end));
      const action = {
        " ": () => this.play(!this.playing), Home: () => to(this.begin), End: () => to(this.end),
        ArrowLeft: () => to(this.t - step), ArrowRight: () => to(this.t + step),
        ArrowUp: () => this.turn(0, 0.1), ArrowDown: () => this.turn(0, -0.1),
        "+": () => this.zoom(1.25), "-": () => this.zoom(0.8), "0": () => this.fit(),
      }[e.key];
      if (action) e.preventDefault(), action();
    };
  }

  play(on) {
    this.playing = on;
    this.play_button.textContent = on ? "\u275a\u275a" : "\u25b6";
    this.play_button.setAttribute("aria-label", on ? "pause" : "play");
    if (!on) return;
    if (this.t >= this.end) this.t = this.begin;
    let last = null;
    const frame = now => {
      if (!this.playing) return;
      let t = this.t + (last === null ? 0 : (now - last) / 1000 * this.speed);
      last = now;
      if (t > this.end) t = this.loop ? this.begin : this.end;
      cursor.set(t);
      t >= this.end && !this.loop ? this.play(false) : requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  draw() {
    const ratio = window.devicePixelRatio || 1, w = this.canvas.clientWidth, h = this.canvas.clientHeight;
    if (!w || !this.axes) return;
    if (this.canvas.width != Math.round(w * ratio)) this.canvas.width = Math.round(w * ratio);
    if (this.canvas.height != Math.round(h * ratio)) this.canvas.height = Math.round(h * ratio);
    const c = this.c = this.canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
    this.colour = name => style.getPropertyValue("--" + name);
    if (this.scale === null) {  // the projected box fills most of the frame
      const share = (k, i) => Math.abs(this.axes[k][i]) * (this.high[i] - this.low[i]) / 2;
      const half = k => share(k, 0) + share(k, 1) + share(k, 2);
      this.scale = Math.min((w / 2 - 40) / Math.max(half(0), 1e-9), (h / 2 - 45) / Math.max(half(1), 1e-9));
    }
    this.project = p => {
      const d = p.map((v, k) => v - this.target[k]);
      const [right, up, out] = this.axes.map(axis => dot(axis, d));
      return [w / 2 + this.pan[0] + this.scale * right, h / 2 + this.pan[1] - this.scale * up, out];
    };
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, w, h);
    c.font = "12px system-ui, sans-serif", c.lineJoin = c.lineCap = "round";
    for (const s of this.states) if (!this.hidden.has("ghost " + s.name)) this.draw_state(s);
    this.draw_frame(w, h);
    this.clock.textContent = "t = " + this.t.toPrecision(4) + " s";
    if (document.activeElement != this.slider)
      this.slider.value = 1000 * (this.t - this.begin) / (this.end - this.begin || 1);
  }

  draw_state(s) {
    const c = this.c, poses = s.poses(this.t), spot = (b, p) => this.project(s.at(poses, b, p));
    c.globalAlpha = s.ghost ? 0.35 : 1;
    c.setLineDash(s.ghost ? [6, 4] : []);
    s.traces.forEach((trace, k) => { if (!this.hidden.has("trace " + trace.name)) this.draw_trace(s, trace, k); });
    for (const spring of s.springs) this.draw_spring(spot(spring.b1, spring.p1), spot(spring.b2, spring.p2), spring);
    const bodies = s.bodies.map((body, i) => ({body, i, points: body.points.map(p => spot(i, p))}));
    const depth = b => b.points.reduce((sum, p) => sum + p[2], 0) / (b.points.length || 1);
    bodies.sort((a, b) => depth(a) - depth(b));  // what is nearer is drawn later
    for (const {body, i, points} of bodies) {
      c.strokeStyle = c.fillStyle = this.colour("c" + i % 8);
      if (!body.shapes.length) this.draw_hull(hull_of(points));
      for (const shape of body.shapes) this.draw_shape(shape, spot(i, shape.from), spot(i, shape.to));
    }
    c.setLineDash([]);
    for (const joint of s.joints) this.draw_joint(s, poses, joint);
    for (const target of s.targets)
      if (!this.hidden.has(target.measured ? "measured" : "targets"))
        this.draw_target(target.places, nearest(target.t, this.t), target.measured);
    if (s.reactions && !this.hidden.has("reactions")) this.draw_reactions(s, spot);
    if (this.names && !s.ghost) {
      c.fillStyle = this.colour("ink"), c.strokeStyle = this.colour("panel"), c.lineWidth = 4;  // a halo over bars
      const taken = [];
      for (const {body, points} of bodies) {
        const middle = k => points.reduce((sum, p) => sum + p[k], 0) / (points.length || 1);
        if (!points.length) continue;
        let x = middle(0) + 7, y = middle(1) - 7;
        const wide = c.measureText(body.name).width;  // a name that would lie on another one moves up
        while (taken.some(n => Math.abs(n.y - y) < 13 && x < n.x + n.wide && n.x < x + wide)) y -= 13;
        taken.push({x, y, wide});
        c.strokeText(body.name, x, y), c.fillText(body.name, x, y);
      }
    }
    c.globalAlpha = 1;
  }

  // The force on the second body of each joint; one that is much larger than most is cut at twice their length.
  draw_reactions(s, spot) {
    for (const joint of s.reactions.joints) {
      const force = s.reaction(joint, this.t), size = Math.hypot(...force) / s.reactions.large;
      const v = this.flat(unit(force)).map(x => kArrow * Math.min(size, 2) * x);
      if (v.every(isFinite)) this.draw_arrow(spot(joint.b, joint.p), v, "limit");
    }
  }

  draw_trace(s, trace, k) {
    const c = this.c, alpha = c.globalAlpha, path = [], past = [];
    const stride = Math.max(1, Math.floor(s.t.length / 400));
    const times = s.t.filter((t, i) => i % stride == 0 || i == s.t.length - 1);
    trace.path = trace.path || times.map(t => [t, s.at(s.poses(t), trace.b, trace.p)]);
    for (const [t, p] of trace.path) path.push(this.project(p)), t <= this.t && past.push(path.at(-1));
    c.strokeStyle = this.colour("c" + (k + 1) % 8), c.lineWidth = 1;
    c.globalAlpha = alpha * 0.4, this.stroke(path), c.globalAlpha = alpha, c.lineWidth = 1.8;
    past.push(this.project(s.at(s.poses(this.t), trace.b, trace.p)));
    this.stroke(past);
    c.fillStyle = c.strokeStyle, c.beginPath(), c.arc(past.at(-1)[0], past.at(-1)[1], 3, 0, 7), c.fill();
  }
}
