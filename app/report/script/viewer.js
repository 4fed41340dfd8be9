// The mechanism that moves: its controls, the view, what is drawn at an instant. Its elements have the classes of the
// still drawing (mechanism_drawing.cpp).

const kArrow = 80;  // length of a large force [px]

class Viewer {
  constructor(box, motion) {
    this.motion = motion, this.states = motion.states.map(s => new State(s));
    const times = this.states.flatMap(s => [s.t[0], s.t.at(-1)]);
    this.begin = Math.min(...times), this.end = Math.max(...times), this.t = this.begin;
    this.playing = false, this.hidden = new Set();
    this.svg = svg("svg", {tabindex: "0", role: "img", "aria-label":
      "The mechanism. Space plays, left and right arrows step, up and down arrows turn, plus and minus zoom, 0 fits."});
    box.append(this.svg, ...this.controls());
    if (motion.note) box.append(element("p", {class: "note"}, [motion.note]));
    this.bounds();
    this.parts = this.states.flatMap(s => this.parts_of(s)), this.frame = this.svg.appendChild(svg("g"));
    this.view(motion.planar ? "flat" : "iso");
    this.listen();
    new ResizeObserver(() => this.draw()).observe(this.svg);
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
        s.bodies.forEach((body, b) => [body.points, ...body.hulls].flat().forEach(p => include(s.at(poses, {b, p}))));
        for (const {at, to} of s.marks) include(s.at(poses, at)), include(s.at(poses, to || at));
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
    this.svg.addEventListener("pointerdown", e => {
      pointers.set(e.pointerId, [e.clientX, e.clientY]), this.svg.setPointerCapture(e.pointerId), spread = null;
    });
    this.svg.addEventListener("pointermove", e => {
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
      this.svg.addEventListener(end, e => { pointers.delete(e.pointerId); });
    this.svg.addEventListener("contextmenu", e => e.preventDefault());
    const wheel = e => { e.preventDefault(); this.zoom(Math.exp(-e.deltaY * 0.0015)); };
    this.svg.addEventListener("wheel", wheel, {passive: false});
    this.svg.onkeydown = e => {
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

  // The elements of a state from back to front, each with the attributes that it has at some poses. `key` names what
  // a reader can hide.
  parts_of(s) {
    const parts = [], spot = (poses, point) => this.project(s.at(poses, point));
    const group = this.svg.appendChild(svg("g", s.ghost ? {class: "earlier"} : {}));
    const add = (style, attributes, {key = "", d = ""} = {}) => {
      const e = group.appendChild(svg("path", {class: style, d}));
      parts.push({s, e, keys: ["ghost " + s.name, key], attributes});
    };
    s.traces.forEach((trace, k) => {
      const at = t => s.at(s.poses(t), trace.at), stride = Math.max(1, Math.floor(s.t.length / 400));
      const path = s.t.filter((t, i) => i % stride == 0 || i == s.t.length - 1).map(t => [t, at(t)]);
      const until = t => path_of([...path.filter(p => p[0] <= t).map(p => p[1]), at(t)].map(this.project));
      const key = "trace " + trace.name, style = "trace c" + (k + 1) % 8;
      add(style + " ahead", () => ({d: until(this.end)}), {key});
      add(style, () => ({d: until(this.t)}), {key});
      add(style + " now", poses => ({d: path_of([spot(poses, trace.at)], "h0")}), {key});
    });
    s.bodies.forEach(({hulls, solid}, b) => hulls.forEach(points =>
      add(`body ${solid ? "solid " : ""}c${b % 8} f${b % 8}`, poses => {
        const hull = hull_of(points.map(p => spot(poses, {b, p})));
        return {d: path_of(hull, hull.length > 1 ? "Z" : "h0")};
      })));
    // As transform_of in mechanism_drawing.cpp.
    for (const {style, path, at, to, axis, foreshortened, radius} of s.marks)
      add("mark " + style, poses => {
        const [x, y] = spot(poses, at), end = to && spot(poses, to);
        if (radius) return {transform: `translate(${x} ${y}) scale(${radius * this.scale})`};
        const along = end ? [end[0] - x, end[1] - y] : axis ? this.flat(s.along(poses, axis)) : [1, 0];
        const [u, v] = Math.hypot(...along) > 1e-9 ? unit(along) : [1, 0];
        return {transform: `matrix(${[...(end || foreshortened ? along : [u, v]), -v, u, x, y].join(" ")})`};
      }, {d: path});
    for (const {places, t, measured} of s.targets) {  // prescribed places are crosses, measured ones dots
      const mark = (p, r) => measured ? path_of([p], "h0") : cross_at(p, r), key = measured ? "measured" : "targets";
      add(key, () => ({d: places.map(p => mark(this.project(p), 3.5)).join("")}), {key});
      add(key + " now", () => ({d: mark(this.project(places[nearest(t, this.t)]), 6)}), {key});
    }
    // The force on the second body of each joint; one that is much larger than most is cut at twice their length.
    for (const joint of s.reactions ? s.reactions.joints : [])
      add("limit", poses => {
        const force = s.reaction(joint, this.t), size = Math.min(Math.hypot(...force) / s.reactions.large, 2);
        return {d: arrow(spot(poses, joint.at), this.flat(unit(force)).map(x => kArrow * size * x))};
      }, {key: "reactions"});
    return parts;
  }

  draw() {
    const {width: w, height: h} = this.svg.getBoundingClientRect();
    if (!w || !this.axes) return;
    if (this.scale === null) {  // the projected box fills most of the frame
      const share = (k, i) => Math.abs(this.axes[k][i]) * (this.high[i] - this.low[i]) / 2;
      const half = k => share(k, 0) + share(k, 1) + share(k, 2);
      this.scale = Math.min((w / 2 - 40) / Math.max(half(0), 1e-9), (h / 2 - 45) / Math.max(half(1), 1e-9));
    }
    this.project = p => {
      const [right, up] = this.flat(p.map((v, k) => v - this.target[k]));
      return [w / 2 + this.pan[0] + this.scale * right, h / 2 + this.pan[1] + this.scale * up];
    };
    const poses = new Map(this.states.map(s => [s, s.poses(this.t)]));
    for (const {s, e, keys, attributes} of this.parts) {
      const hidden = keys.some(key => this.hidden.has(key));
      e.setAttribute("visibility", hidden ? "hidden" : "inherit");
      if (!hidden) set(e, attributes(poses.get(s)));
    }
    this.frame.replaceChildren();
    this.draw_frame(w, h);
    for (const [s, at] of poses) if (this.names && !s.ghost) this.draw_names(s, at);
    this.clock.textContent = "t = " + this.t.toPrecision(4) + " s";
    if (document.activeElement != this.slider)
      this.slider.value = 1000 * (this.t - this.begin) / (this.end - this.begin || 1);
  }

  // A direction of space in the drawing, where y points down.
  flat(v) { return [dot(this.axes[0], v), -dot(this.axes[1], v)]; }

  draw_names(s, poses) {
    const taken = [];
    s.bodies.forEach((body, b) => {
      const points = body.points.map(p => this.project(s.at(poses, {b, p})));
      const middle = k => points.reduce((sum, p) => sum + p[k], 0) / (points.length || 1);
      let [x, y] = [middle(0) + 7, middle(1) - 7];
      const text = this.frame.appendChild(svg("text", {}, [body.name])), wide = text.getComputedTextLength();
      while (taken.some(n => Math.abs(n.y - y) < 13 && x < n.x + n.wide && n.x < x + wide)) y -= 13;  // moves up
      taken.push({x, y, wide});
      set(text, {x, y});
    });
  }

  // Axes, gravity and a round length, in the corners.
  draw_frame(w, h) {
    const add = (style, d, x, y, words) =>
      this.frame.append(svg("path", {class: style, d}), svg("text", {x, y}, d ? [words] : []));
    const label = (from, v, style, name) => {
      const [x, y] = unit(v);
      add("line " + style, arrow(from, v), from[0] + v[0] + 7 * x - 3, from[1] + v[1] + 10 * y + 4, name);
    };
    ["c1", "c2", "c0"].forEach((style, k) =>
      label([42, h - 42], [26 * this.axes[0][k], -26 * this.axes[1][k]], style, "xyz"[k]));
    if (Math.hypot(...this.motion.gravity) > 0)
      label([w - 34, 24], this.flat(unit(this.motion.gravity)).map(v => 30 * v), "frame", "g");
    const length = round_ticks(0, w / 2 / this.scale, 4)[1], left = w - 16 - length * this.scale;
    add("frame", `M${left} ${h - 18}v6H${w - 16}v-6`, left, h - 22, shown(length) + " m");
  }
}
