// What a report does beyond its static page: plots answer the pointer, mechanisms move, tables are copied as CSV. The
// page holds its data in the JSON block "data" (html_page.cpp, motion_scene.cpp). Nothing is loaded.
"use strict";
(() => {
const data = JSON.parse(document.getElementById("data").textContent);
const array = k => data.arrays[k];
document.documentElement.classList.add("scripted");

// An element with attributes and children. Within a plot, the namespace is that of its drawing.
function element(tag, attributes = {}, children = [], namespace = null) {
  const e = namespace ? document.createElementNS(namespace, tag) : document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
  e.append(...children);
  return e;
}
const shown = (value, digits = 6) => value === null || value === undefined ? "-" : String(Number(value.toPrecision(digits)));

// The instant that all plots over time and all mechanisms of the page show.
const cursor = {t: null, listeners: [], set(t) { this.t = t; for (const f of this.listeners) f(t); }};

// ---- Tables ---------------------------------------------------------------------------------------------------------

// Cells as CSV, with all their digits; RFC 4180 quotes.
function csv_of(table) {
  const quoted = text => /[",\n]/.test(text) ? '"' + text.replaceAll('"', '""') + '"' : text;
  return [...table.rows].map(row => [...row.cells].map(c => quoted(c.title || c.textContent)).join(",")).join("\n") + "\n";
}

function copy(text) {
  const area = element("textarea", {"aria-hidden": "true"});
  area.value = text;
  document.body.append(area);
  area.select();
  document.execCommand("copy");  // also works where the page is opened from disk
  area.remove();
}

for (const box of document.querySelectorAll(".table")) {
  const button = element("button", {type: "button", class: "copy"}, ["copy as CSV"]);
  button.onclick = () => {
    copy(csv_of(box.querySelector("table")));
    button.textContent = "copied";
    setTimeout(() => button.textContent = "copy as CSV", 1500);
  };
  box.after(button);
}

// ---- Plots ----------------------------------------------------------------------------------------------------------

// About `count` round numbers within [low, high]: 1, 2 or 5 times a power of ten apart.
function round_ticks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * ([1, 2, 5].find(k => raw <= k * power) || 10), ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) ticks.push(k * step);
  return ticks;
}

// The index of the sample of a sorted array that is nearest to the value.
function nearest(sorted, value) {
  let low = 0, high = sorted.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    sorted[middle] <= value ? low = middle : high = middle;
  }
  return Math.abs(sorted[high] - value) < Math.abs(sorted[low] - value) ? high : low;
}

class Plot {
  constructor(figure, plot) {
    this.figure = figure, this.plot = plot, this.svg = figure.querySelector("svg");
    this.home = {x: plot.x, y: plot.y}, this.x = plot.x, this.y = plot.y;
    this.series = plot.series.map(s => ({...s, x: array(s.x), y: array(s.y), on: true,
                                         sorted: array(s.x).every((v, i, x) => i == 0 || x[i - 1] <= v)}));
    this.over_time = plot.xlabel == "t [s]";
    const [left, top, width, height] = plot.box, make = (tag, a) => element(tag, a, [], this.svg.namespaceURI);
    // A drawing within the drawing: it cuts off what a zoom moves out of the frame.
    this.inner = make("svg", {x: left, y: top, width, height, viewBox: plot.box.join(" ")});
    this.inner.append(...this.svg.querySelectorAll("path[data-series],.beyond,.limit"));
    this.line = make("path", {class: "cursor"}), this.zoom = make("rect", {class: "zoom", visibility: "hidden"});
    this.catcher = make("rect", {class: "catch", x: left, y: top, width, height});
    this.svg.append(this.inner, this.line, this.zoom, this.catcher);
    this.readout = element("div", {class: "readout", "aria-live": "off"});
    figure.append(this.readout);
    this.listen();
    if (this.over_time) cursor.listeners.push(t => this.show(t));
  }

  // Data to pixels and back; logarithmic axes hold logarithms.
  px(v) { return this.plot.box[0] + (v - this.x[0]) / (this.x[1] - this.x[0]) * this.plot.box[2]; }
  py(v) { return this.plot.box[1] + (this.y[1] - v) / (this.y[1] - this.y[0]) * this.plot.box[3]; }
  to_x(px) { return this.x[0] + (px - this.plot.box[0]) / this.plot.box[2] * (this.x[1] - this.x[0]); }
  to_y(py) { return this.y[1] - (py - this.plot.box[1]) / this.plot.box[3] * (this.y[1] - this.y[0]); }
  on_x(v) { return v === null ? NaN : this.plot.logx ? Math.log10(v) : v; }
  on_y(v) { return v === null ? NaN : this.plot.logy ? Math.log10(v) : v; }
  at(event) {
    const p = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.svg.getScreenCTM().inverse());
    const [left, top, width, height] = this.plot.box;
    return [Math.min(Math.max(p.x, left), left + width), Math.min(Math.max(p.y, top), top + height)];
  }

  listen() {
    let from = null;
    this.catcher.addEventListener("pointerdown", e => { from = this.at(e); this.catcher.setPointerCapture(e.pointerId); });
    this.catcher.addEventListener("pointermove", e => {
      const to = this.at(e);
      this.show(this.to_x(to[0]), to);
      if (!from) return;
      const [x, y, w, h] = this.dragged(from, to);
      for (const [key, value] of Object.entries({x, y, width: w, height: h})) this.zoom.setAttribute(key, value);
      this.zoom.setAttribute("visibility", w > 6 ? "visible" : "hidden");
    });
    this.catcher.addEventListener("pointerup", e => {
      if (!from) return;
      const to = this.at(e), [x, y, w, h] = this.dragged(from, to);
      from = null;
      this.zoom.setAttribute("visibility", "hidden");
      if (w > 6) this.zoom_to([this.to_x(x), this.to_x(x + w)], [this.to_y(y + h), this.to_y(y)]);
      else if (this.over_time) cursor.set(this.to_x(to[0]));
    });
    this.catcher.addEventListener("pointerleave", () => this.show(this.over_time ? cursor.t : null));
    this.catcher.addEventListener("dblclick", () => this.zoom_to(this.home.x, this.home.y));
    for (const key of this.figure.querySelectorAll(".legend [data-series]")) {
      key.setAttribute("role", "button"), key.setAttribute("tabindex", "0"), key.setAttribute("aria-pressed", "true");
      key.onclick = () => this.toggle(key);
      key.onkeydown = e => { if (e.key == "Enter" || e.key == " ") e.preventDefault(), this.toggle(key); };
    }
    this.svg.setAttribute("tabindex", "0");
    this.svg.onkeydown = e => {
      if (e.key == "Escape") this.zoom_to(this.home.x, this.home.y);
      const step = {ArrowRight: 1, ArrowLeft: -1}[e.key];
      if (!step || !this.over_time) return;
      e.preventDefault();
      cursor.set(Math.min(Math.max((cursor.t ?? this.home.x[0]) + step * (this.x[1] - this.x[0]) / 200, this.home.x[0]),
                          this.home.x[1]));
    };
  }

  // A box that the pointer drew; one that is flat leaves the height as it is.
  dragged(from, to) {
    const [x, y, w, h] = [Math.min(from[0], to[0]), Math.min(from[1], to[1]), Math.abs(from[0] - to[0]), Math.abs(from[1] - to[1])];
    return h > 12 ? [x, y, w, h] : [x, this.plot.box[1], w, this.plot.box[3]];
  }

  toggle(key) {
    const k = Number(key.dataset.series), on = !this.series[k].on;
    this.series.forEach((s, i) => { if (i == k || s.part == k) s.on = on; });
    key.setAttribute("aria-pressed", on);
    this.draw();
  }

  zoom_to(x, y) { this.x = x, this.y = y; this.draw(); this.show(this.over_time ? cursor.t : null); }

  path_of(s) {
    let d = "", down = false;
    for (let i = 0; i < s.x.length; ++i) {
      const px = this.px(this.on_x(s.x[i])), py = this.py(this.on_y(s.y[i]));
      if (!isFinite(px) || !isFinite(py)) { down = false; continue; }
      const at = px.toFixed(1) + " " + py.toFixed(1);
      if (s.mark == "points") d += "M" + at + "h0";
      else if (s.mark == "rings") d += "M" + (px - 4).toFixed(1) + " " + py.toFixed(1) + "a4 4 0 1 0 8 0a4 4 0 1 0 -8 0";
      else if (s.mark == "bars") d += "M" + px.toFixed(1) + " " + this.py(0).toFixed(1) + "V" + py.toFixed(1);
      else d += (down ? "L" : "M") + at;
      down = true;
    }
    return d;
  }

  // Between the limit and what of the lines lies beyond it.
  area_of(s, limit) {
    const y_limit = this.on_y(limit.value), at = (x, y) => this.px(this.on_x(x)).toFixed(1) + " " + this.py(y).toFixed(1);
    const points = s.x.map((x, i) => [x, this.on_y(s.y[i])]).filter(p => isFinite(p[1]));
    if (!points.some(p => limit.upper ? p[1] > y_limit : p[1] < y_limit)) return "";
    const along = points.map(p => at(p[0], limit.upper ? Math.max(p[1], y_limit) : Math.min(p[1], y_limit)));
    return "M" + at(points[0][0], y_limit) + "L" + along.join("L") + "L" + at(points.at(-1)[0], y_limit) + "Z";
  }

  draw() {
    this.inner.querySelectorAll(".beyond,.limit").forEach(e => e.remove());
    this.svg.querySelectorAll(".limit-name").forEach(e => e.remove());
    for (const path of this.inner.querySelectorAll("path[data-series]")) {
      const s = this.series[path.dataset.series];
      path.setAttribute("d", s.on ? this.path_of(s) : "");
    }
    const add = (kind, d) => this.inner.prepend(element("path", {class: kind, d}, [], this.svg.namespaceURI));
    for (const limit of this.plot.limits) {
      add("limit", "M" + this.plot.box[0] + " " + this.py(this.on_y(limit.value)) + "h" + this.plot.box[2]);
      for (const s of this.series) if (s.on && s.mark == "line") add("beyond", this.area_of(s, limit));
    }
    this.draw_ticks();
  }

  ticks(range, logarithmic, count) {
    const label = v => Math.abs(v) >= 1e5 || (v != 0 && Math.abs(v) < 1e-3) ? Number(v.toPrecision(4)).toExponential() : shown(v);
    if (!logarithmic) return round_ticks(...range, count).map(v => [v, label(v)]);
    if (range[1] - range[0] > 1) return round_ticks(...range, count).filter(v => Math.abs(v - Math.round(v)) < 1e-9).map(v => [v, label(10 ** v)]);
    return round_ticks(10 ** range[0], 10 ** range[1], count).filter(v => v > 0).map(v => [Math.log10(v), label(v)]);
  }

  draw_ticks() {
    const [left, top, width, height] = this.plot.box, group = this.svg.querySelector(".ticks");
    const make = (tag, a, text) => element(tag, a, text === undefined ? [] : [text], this.svg.namespaceURI);
    group.replaceChildren();
    for (const [v, label] of this.ticks(this.x, this.plot.logx, 8)) {
      if (this.plot.whole && v != Math.round(v)) continue;
      group.append(make("path", {class: "grid", d: `M${this.px(v).toFixed(1)} ${top}v${height}`}),
                   make("text", {x: this.px(v).toFixed(1), y: top + height + 16, "text-anchor": "middle"}, label));
    }
    for (const [v, label] of this.ticks(this.y, this.plot.logy, 6)) {
      group.append(make("path", {class: "grid", d: `M${left} ${this.py(v).toFixed(1)}h${width}`}),
                   make("text", {x: left - 6, y: (this.py(v) + 4).toFixed(1), "text-anchor": "end"}, label));
    }
  }

  // The cursor and the values at an x; `pointer`: in pixels, to choose among clouds. Null hides them.
  show(x, pointer = null) {
    const hidden = x === null || x < this.x[0] || x > this.x[1];
    if (hidden) { this.line.setAttribute("d", ""); this.readout.textContent = ""; return; }
    const [left, top, , height] = this.plot.box, words = [], unit = this.plot.ylabel.match(/\[([^\]]*)\]/);
    let at = x;
    for (const s of this.series) {
      if (!s.on || s.part >= 0 || !s.x.length) continue;
      const keys = s.x.map(v => this.on_x(v));
      const i = s.sorted ? nearest(keys, x) : this.closest(s, pointer || [this.px(x), top + height / 2]);
      if (!words.length && !this.over_time) at = keys[i];
      words.push((s.name || "value") + (this.over_time ? "" : ` (${shown(s.x[i])})`) + " = " + shown(s.y[i]));
    }
    this.line.setAttribute("d", `M${this.px(at).toFixed(1)} ${top}v${height}`);
    this.readout.textContent = (this.over_time ? `t = ${shown(x, 5)} s:  ` : "") + words.join(",  ") + (unit && unit[1] != "-" ? " " + unit[1] : "");
  }

  closest(s, pointer) {
    let best = 0, least = Infinity;
    for (let i = 0; i < s.x.length; ++i) {
      const d = Math.hypot(this.px(this.on_x(s.x[i])) - pointer[0], this.py(this.on_y(s.y[i])) - pointer[1]);
      if (d < least) least = d, best = i;
    }
    return best;
  }
}

// ---- The mechanism that moves ---------------------------------------------------------------------------------------

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => { const n = Math.hypot(...a) || 1; return a.map(v => v / n); };
const plus = (a, b) => a.map((v, i) => v + b[i]);

// A(p) s, p = (e0, e1, e2, e3):  s + 2 e0 (e x s) + 2 e x (e x s)
function turned(p, s) {
  const e = [p[1], p[2], p[3]], c = cross(e, s), cc = cross(e, c);
  return s.map((v, i) => v + 2 * (p[0] * c[i] + cc[i]));
}

// Andrew's monotone chain, as in mechanism_drawing.cpp.
function hull_of(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]), hull = [];
  const left_of = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  for (const side of [sorted, [...sorted].reverse()]) {
    const first = hull.length;
    for (const p of side) {
      while (hull.length >= first + 2 && left_of(hull.at(-2), hull.at(-1), p) <= 0) hull.pop();
      hull.push(p);
    }
    hull.pop();
  }
  return hull.length ? hull : sorted.slice(0, 1);
}

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

class Viewer {
  constructor(box, motion) {
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
    const views = this.motion.planar ? [["flat", "plane"], ["iso", "isometric"]] : [["xy", "x-y"], ["xz", "x-z"], ["yz", "y-z"], ["iso", "isometric"]];
    const second = element("div", {class: "controls"}, [
      ...views.map(([key, text]) => button(text, "view: " + text, () => this.view(key))),
      button("\u2212", "zoom out", () => this.zoom(0.8)), button("+", "zoom in", () => this.zoom(1.25)),
      button("fit", "fit into the frame", () => this.fit()), check("names", this.names, on => { this.names = on; this.draw(); })]);
    const toggle = name => on => { on ? this.hidden.delete(name) : this.hidden.add(name); this.draw(); };
    for (const s of this.states) if (s.ghost) second.append(check(s.name, true, toggle("ghost " + s.name)));
    const traces = this.states.at(-1).traces.map(t => t.name);
    traces.slice(0, 6).forEach((name, k) => {
      if (k > 1) this.hidden.add("trace " + name);
      second.append(check("path of " + name, k < 2, toggle("trace " + name)));
    });
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
          for (const end of [shape.from, shape.to]) for (const r of [-shape.radius, shape.radius]) include(s.at(poses, i, end).map(v => v + r));
        }));
        for (const j of [...s.joints, ...s.springs]) include(s.at(poses, j.b1, j.p1)), include(s.at(poses, j.b2, j.p2));
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
      const up = Math.hypot(...g) > 0 ? unit(g.map(v => -v)) : e[2], k = up.map(Math.abs).indexOf(Math.max(...up.map(Math.abs)));
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
    const about = (axis, v, a) => plus(plus(v.map(x => x * Math.cos(a)), cross(axis, v).map(x => x * Math.sin(a))), axis.map(x => x * dot(axis, v) * (1 - Math.cos(a))));
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
    for (const end of ["pointerup", "pointercancel"]) this.canvas.addEventListener(end, e => { pointers.delete(e.pointerId); });
    this.canvas.addEventListener("contextmenu", e => e.preventDefault());
    this.canvas.addEventListener("wheel", e => { e.preventDefault(); this.zoom(Math.exp(-e.deltaY * 0.0015)); }, {passive: false});
    this.canvas.onkeydown = e => {
      const step = (this.end - this.begin) / 100, to = t => cursor.set(Math.min(Math.max(t, this.begin), this.end));
      const action = {" ": () => this.play(!this.playing), ArrowLeft: () => to(this.t - step), ArrowRight: () => to(this.t + step),
                      ArrowUp: () => this.turn(0, 0.1), ArrowDown: () => this.turn(0, -0.1), Home: () => to(this.begin), End: () => to(this.end),
                      "+": () => this.zoom(1.25), "-": () => this.zoom(0.8), "0": () => this.fit()}[e.key];
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
      const half = k => [0, 1, 2].reduce((sum, i) => sum + Math.abs(this.axes[k][i]) * (this.high[i] - this.low[i]) / 2, 0);
      this.scale = Math.min((w / 2 - 40) / Math.max(half(0), 1e-9), (h / 2 - 45) / Math.max(half(1), 1e-9));
    }
    this.project = p => {
      const d = p.map((v, k) => v - this.target[k]);
      return [w / 2 + this.pan[0] + this.scale * dot(this.axes[0], d), h / 2 + this.pan[1] - this.scale * dot(this.axes[1], d), dot(this.axes[2], d)];
    };
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, w, h);
    c.font = "12px system-ui, sans-serif", c.lineJoin = c.lineCap = "round";
    for (const s of this.states) if (!this.hidden.has("ghost " + s.name)) this.draw_state(s);
    this.draw_frame(w, h);
    this.clock.textContent = "t = " + this.t.toPrecision(4) + " s";
    if (document.activeElement != this.slider) this.slider.value = 1000 * (this.t - this.begin) / (this.end - this.begin || 1);
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
      if (body.shapes.length) body.shapes.forEach(shape => this.draw_shape(shape, spot(i, shape.from), spot(i, shape.to)));
      else this.draw_hull(hull_of(points));
    }
    c.setLineDash([]);
    for (const joint of s.joints) this.draw_joint(s, poses, joint);
    if (this.names && !s.ghost) {
      c.fillStyle = this.colour("ink");
      const taken = [];
      for (const {body, points} of bodies) {
        const middle = k => points.reduce((sum, p) => sum + p[k], 0) / (points.length || 1);
        if (!points.length) continue;
        let x = middle(0) + 7, y = middle(1) - 7;
        const wide = c.measureText(body.name).width;  // a name that would lie on another one moves up
        while (taken.some(n => Math.abs(n.y - y) < 13 && x < n.x + n.wide && n.x < x + wide)) y -= 13;
        taken.push({x, y, wide});
        c.fillText(body.name, x, y);
      }
    }
    c.globalAlpha = 1;
  }

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
    const c = this.c, a = this.project(s.at(poses, joint.b1, joint.p1)), b = this.project(s.at(poses, joint.b2, joint.p2));
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
    const line = (p, n) => this.stroke([[p[0] - n * flat[0], p[1] - n * flat[1]], [p[0] + n * flat[0], p[1] + n * flat[1]]]);
    switch (joint.type) {
      case "translational": line(b, 22), block(b); break;
      case "cylindrical": case "screw": line(b, 22), block(b), disc(b, 3); break;
      case "point_on_line": line(b, 22), disc(b, 3.5); break;
      case "fixed": c.fillStyle = this.colour("ink"), c.fillRect(b[0] - 4, b[1] - 4, 8, 8); break;
      case "distance": c.lineWidth = 2, this.stroke([a, b]), disc(a, 3.5), disc(b, 3.5); break;
      case "spherical": disc(b, 5), c.fillStyle = this.colour("ink"), disc(b, 2); break;
      case "universal": disc(b, 5), this.stroke([[b[0] - 4, b[1]], [b[0] + 4, b[1]]]), this.stroke([[b[0], b[1] - 4], [b[0], b[1] + 4]]); break;
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

  draw_trace(s, trace, k) {
    const c = this.c, alpha = c.globalAlpha, path = [], past = [];
    const stride = Math.max(1, Math.floor(s.t.length / 400));
    trace.path = trace.path || s.t.filter((t, i) => i % stride == 0 || i == s.t.length - 1).map(t => [t, s.at(s.poses(t), trace.b, trace.p)]);
    for (const [t, p] of trace.path) path.push(this.project(p)), t <= this.t && past.push(path.at(-1));
    c.strokeStyle = this.colour("c" + (k + 1) % 8), c.lineWidth = 1;
    c.globalAlpha = alpha * 0.4, this.stroke(path), c.globalAlpha = alpha, c.lineWidth = 1.8;
    past.push(this.project(s.at(s.poses(this.t), trace.b, trace.p)));
    this.stroke(past);
    c.fillStyle = c.strokeStyle, c.beginPath(), c.arc(past.at(-1)[0], past.at(-1)[1], 3, 0, 7), c.fill();
  }

  // Axes, gravity and a round length, in the corners.
  draw_frame(w, h) {
    const c = this.c, colours = ["c1", "c2", "c0"];
    const arrow = (from, v, colour, name) => {
      const n = Math.hypot(v[0], v[1]);
      if (n < 5) return;
      const to = [from[0] + v[0], from[1] + v[1]], u = [v[0] / n, v[1] / n];
      c.strokeStyle = c.fillStyle = this.colour(colour), c.lineWidth = 1.6;
      this.stroke([from, to]);
      this.stroke([[to[0] - 6 * u[0] - 3 * u[1], to[1] - 6 * u[1] + 3 * u[0]], to, [to[0] - 6 * u[0] + 3 * u[1], to[1] - 6 * u[1] - 3 * u[0]]]);
      c.fillText(name, to[0] + 7 * u[0] - 3, to[1] + 10 * u[1] + 4);
    };
    for (let k = 0; k < 3; ++k) arrow([42, h - 42], [26 * this.axes[0][k], -26 * this.axes[1][k]], colours[k], "xyz"[k]);
    const g = this.motion.gravity;
    if (Math.hypot(...g) > 0) {
      const u = unit(g);
      arrow([w - 34, 24], [30 * dot(this.axes[0], u), -30 * dot(this.axes[1], u)], "soft", "g");
    }
    const raw = w / 8 / this.scale, power = 10 ** Math.floor(Math.log10(raw)), length = power * ([1, 2, 5].find(k => raw <= k * power) || 10);
    const right = w - 16, left = right - length * this.scale;
    c.strokeStyle = c.fillStyle = this.colour("soft"), c.lineWidth = 1.2;
    this.stroke([[left, h - 18], [left, h - 12], [right, h - 12], [right, h - 18]]);
    c.textAlign = "right", c.fillText(shown(length) + " m", right - 3, h - 18), c.textAlign = "left";
  }
}

for (const figure of document.querySelectorAll("figure[data-plot]")) new Plot(figure, data.plots[figure.dataset.plot]);
for (const box of document.querySelectorAll("[data-motion]")) new Viewer(box, data.motions[box.dataset.motion]);
})();
