// Plots answer the pointer: values, zoom, legends that hide curves. A plot is drawn in fractions of its frame
// (line_plot.cpp). A zoom shows a part of this drawing, and other ticks.

const kUnits = 1e6;  // of the frame's width and of its height, in paths

// About `count` round numbers within [low, high]: 1, 2 or 5 times a power of ten apart.
function round_ticks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * ([1, 2, 5].find(k => raw <= k * power) || 10), ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) ticks.push(k * step);
  return ticks;
}

// As in line_plot.cpp: powers of ten; 1, 2, 5 times powers of ten where there are few; else round numbers.
function logarithmic_ticks(low, high, count) {
  const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9), ticks = [];
  if (last - first >= 2) {
    const stride = Math.max(1, Math.ceil((last - first) / count));
    for (let k = Math.ceil(first / stride) * stride; k <= last; k += stride) ticks.push(10 ** k);
    return ticks;
  }
  for (let k = first - 1; k <= last; ++k)
    for (const digit of [1, 2, 5]) {
      const tick = digit * 10 ** k;
      if (tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9)) ticks.push(tick);
    }
  return ticks.length >= 3 ? ticks : round_ticks(low, high, count).filter(v => v > 0);
}

// Where the lines and moves of a path lead, in fractions of the frame. Other strokes belong to marks.
function samples(path) {
  const x = [], y = [];
  let [right, down] = [0, 0];
  for (const [, command, text] of path.getAttribute("d").matchAll(/([mlhv])([^mlhv]*)/g)) {
    const numbers = text.match(/-?\d+/g).map(Number);
    if (command == "v") down += numbers[0];
    if (command == "m" || command == "l")
      for (let k = 0; k < numbers.length; k += 2) {
        x.push((right += numbers[k]) / kUnits), y.push((down += numbers[k + 1]) / kUnits);
      }
  }
  return {x, y, sorted: x.every((v, k) => k == 0 || x[k - 1] <= v)};
}

// The index of the sample of a sorted array below a value, and of the nearest one.
function below(sorted, value) {
  let low = 0, high = sorted.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    sorted[middle] <= value ? low = middle : high = middle;
  }
  return low;
}
function nearest(sorted, value) {
  const low = below(sorted, value);
  return Math.abs(sorted[low + 1] - value) < Math.abs(sorted[low] - value) ? low + 1 : low;
}

class Plot {
  constructor(figure) {
    this.figure = figure, this.plot = JSON.parse(figure.dataset.plot), this.svg = figure.querySelector("svg");
    this.curves = this.svg.querySelector(".curves"), this.ticks = this.svg.querySelector(".ticks");
    const words = name => this.svg.querySelector(name).textContent, unit = words(".y-label").match(/\[([^\]]*)\]/);
    this.unit = unit && unit[1] != "-" ? " " + unit[1] : "", this.over_time = words(".x-label") == "t [s]";
    this.view = {x: [0, 1], y: [0, 1]};  // what the frame shows of the drawing
    this.series = [...this.curves.querySelectorAll("[data-series]")].map((path, k) =>
      ({...this.plot.series[k], ...samples(path), on: true}));
    this.moving = [...this.svg.querySelectorAll("[data-at]")].map(e =>
      ({e, home: [...e.dataset.at].map(axis => [axis, parseFloat(e.getAttribute(axis)) / 100])}));
    this.line = svg("line", {class: "cursor", y2: "100%"});
    this.box = svg("rect", {class: "zoom"});
    this.catcher = svg("rect", {class: "catch", width: "100%", height: "100%"});
    this.svg.append(this.line, this.box, this.catcher);
    this.readout = element("div", {class: "readout", "aria-live": "off"});
    figure.append(this.readout);
    this.listen();
    this.show(null);
    if (this.over_time) cursor.listeners.push(() => this.show_cursor());
    new ResizeObserver(() => this.draw()).observe(figure);
  }

  // Fractions of the drawing to places in the frame, and to values; logarithmic axes hold logarithms.
  place(axis, v) { const [a, b] = this.view[axis]; return 100 * (v - a) / (b - a) + "%"; }
  on_axis(axis, v) { const [a, b] = this.plot[axis]; return a + v * (b - a); }
  from_axis(axis, value) { const [a, b] = this.plot[axis]; return (value - a) / (b - a); }
  value(axis, v) {
    const [a, b] = this.plot[axis], step = 10 ** Math.ceil(Math.log10(Math.abs(b - a) / kUnits));
    const value = this.on_axis(axis, v);
    return this.plot.log[axis] ? Number((10 ** value).toPrecision(5)) : Math.round(value / step) * step;
  }
  at(event) {
    const box = this.catcher.getBoundingClientRect(), share = v => Math.min(Math.max(v, 0), 1);
    const inside = (axis, v) => this.view[axis][0] + share(v) * (this.view[axis][1] - this.view[axis][0]);
    return [inside("x", (event.clientX - box.x) / box.width), inside("y", (event.clientY - box.y) / box.height)];
  }

  listen() {
    let from = null;
    this.catcher.addEventListener("pointerdown", e => {
      from = this.at(e);
      this.catcher.setPointerCapture(e.pointerId);
    });
    this.catcher.addEventListener("pointermove", e => {
      const to = this.at(e);
      this.show(to[0], to);
      if (from) this.draw_box(this.dragged(from, to));
    });
    this.catcher.addEventListener("pointerup", e => {
      if (!from) return;
      const to = this.at(e), view = this.dragged(from, to);
      from = null;
      this.draw_box(null);
      if (view) this.zoom_to(view);
      else if (this.over_time) cursor.set(this.on_axis("x", to[0]));
    });
    this.catcher.addEventListener("pointerleave", () => this.show_cursor());
    this.catcher.addEventListener("dblclick", () => this.zoom_to({x: [0, 1], y: [0, 1]}));
    for (const key of this.figure.querySelectorAll(".legend [data-series]")) {
      key.setAttribute("role", "button"), key.setAttribute("tabindex", "0"), key.setAttribute("aria-pressed", "true");
      key.onclick = () => this.toggle(key);
      key.onkeydown = e => { if (e.key == "Enter" || e.key == " ") e.preventDefault(), this.toggle(key); };
    }
    this.svg.setAttribute("tabindex", "0");
    this.svg.onkeydown = e => {
      if (e.key == "Escape") this.zoom_to({x: [0, 1], y: [0, 1]});
      const step = {ArrowRight: 1, ArrowLeft: -1}[e.key], [begin, end] = this.view.x;
      if (!step || !this.over_time) return;
      e.preventDefault();
      const now = cursor.t === null ? begin : this.from_axis("x", cursor.t);
      cursor.set(this.on_axis("x", Math.min(Math.max(now + step * (end - begin) / 200, 0), 1)));
    };
  }

  // The part of the drawing that the pointer chose, if it is wide enough; a flat box leaves the height as it is.
  dragged(from, to) {
    const box = this.catcher.getBoundingClientRect(), range = k => [Math.min(from[k], to[k]), Math.max(from[k], to[k])];
    const pixels = (axis, [a, b], size) => (b - a) / (this.view[axis][1] - this.view[axis][0]) * size;
    if (pixels("x", range(0), box.width) <= 6) return null;
    return {x: range(0), y: pixels("y", range(1), box.height) > 12 ? range(1) : this.view.y};
  }

  draw_box(view) {
    for (const [axis, size] of [["x", "width"], ["y", "height"]]) {
      const [begin, end] = view ? view[axis].map(v => parseFloat(this.place(axis, v))) : [0, 0];
      this.box.setAttribute(axis, begin + "%"), this.box.setAttribute(size, end - begin + "%");
    }
  }

  toggle(key) {
    const k = Number(key.dataset.series), on = !this.series[k].on;
    this.series.forEach((s, i) => { if (i == k || s.part == k) s.on = on; });
    key.setAttribute("aria-pressed", on);
    this.draw();
  }

  zoom_to(view) { this.view = view; this.draw(); this.show_cursor(); }

  draw() {
    const {x, y} = this.view, width = this.catcher.getBoundingClientRect().width;
    this.curves.setAttribute("viewBox", [x[0], y[0], x[1] - x[0], y[1] - y[0]].map(v => kUnits * v).join(" "));
    const hide = (e, hidden) => e.setAttribute("visibility", hidden ? "hidden" : "inherit");
    for (const path of this.curves.querySelectorAll("[data-series]")) hide(path, !this.series[path.dataset.series].on);
    for (const {e, home} of this.moving) {
      for (const [axis, v] of home) e.setAttribute(axis, this.place(axis, v));
      const out = home.some(([axis, v]) => v < this.view[axis][0] || v > this.view[axis][1]);
      hide(e, out || (e.dataset.series && !this.series[e.dataset.series].on));
    }
    if (!width) return;  // of a figure that is hidden
    this.thin(this.svg.querySelectorAll("[data-at=x]:not([visibility=hidden])"));
    const label = this.svg.querySelector(".y-label"), fit = {textLength: width + 80, lengthAdjust: "spacingAndGlyphs"};
    label.removeAttribute("textLength");
    if (label.getComputedTextLength() > fit.textLength) set(label, fit);
    this.draw_ticks(width);
  }

  // Of words that would lie on each other only the first are shown.
  thin(texts) {
    let free = -Infinity;
    for (const text of texts) {
      const box = text.getBoundingClientRect();
      if (box.left < free) text.setAttribute("visibility", "hidden");
      else free = box.right + 6;
    }
  }

  // Pairs of a place on the axis and the parts of its label.
  labelled(axis, count) {
    const range = this.view[axis].map(v => this.on_axis(axis, v)).sort((a, b) => a - b);
    const size = Math.max(...range.map(Math.abs)), hidden = Math.floor(Math.log10(size / (range[1] - range[0])));
    const rounded = (v, digits) => Number(v.toPrecision(Math.min(digits + Math.max(hidden, 0), 15))) || 0;
    const label = v => size >= 1e5 || size < 1e-3 ? rounded(v, 4).toExponential() : String(rounded(v, 6));
    if (!this.plot.log[axis]) return round_ticks(...range, count).map(v => [v, [v ? label(v) : "0"]]);
    const values = logarithmic_ticks(10 ** range[0], 10 ** range[1], count);
    const near_one = values.every(v => v > 0.9e-3 && v < 1.1e4);
    const power = v => {
      const exponent = Math.floor(Math.log10(v) + 1e-9), digits = v / 10 ** exponent;
      const raised = svg("tspan", {dy: -4, "font-size": 9}, [String(exponent)]);
      return [(Math.abs(digits - 1) < 1e-6 ? "" : shown(digits, 4) + "\u00b7") + "10", raised];
    };
    return values.map(v => [Math.log10(v), near_one ? [shown(v)] : power(v)]);
  }

  draw_ticks(width) {
    this.ticks.replaceChildren();
    const add = (line, place, words) => this.ticks.append(svg("line", line), svg("text", place, words));
    for (const [v, words] of this.labelled("x", Math.min(Math.max(width / 75, 2), 8))) {
      const share = this.from_axis("x", v), x = this.place("x", share);
      if (this.plot.whole && v != Math.round(v) || share < this.view.x[0] || share > this.view.x[1]) continue;
      add({x1: x, x2: x, y2: "100%"}, {x, y: "100%", dy: 16}, words);
    }
    this.thin(this.ticks.querySelectorAll("text"));
    for (const [v, words] of this.labelled("y", 6)) {
      const y = this.place("y", this.from_axis("y", v));
      const fit = words[0].length > 9 ? {textLength: 58, lengthAdjust: "spacingAndGlyphs"} : {};
      add({y1: y, y2: y, x2: "100%"}, {class: "left", y, dx: -6, dy: 4, ...fit}, words);
    }
  }

  show_cursor() { this.show(this.over_time && cursor.t !== null ? this.from_axis("x", cursor.t) : null); }

  // The cursor and the values at a place; `pointer` chooses among clouds. Null hides them.
  show(x, pointer = null) {
    const hidden = x === null || x < this.view.x[0] || x > this.view.x[1], words = [];
    this.line.setAttribute("visibility", hidden ? "hidden" : "inherit");
    if (hidden) { this.readout.textContent = ""; return; }
    let at = x;
    for (const s of this.series) {
      if (!s.on || s.part >= 0 || !s.x.length) continue;
      const i = s.sorted ? nearest(s.x, x) : this.closest(s, pointer || [x, 0.5]);
      if (!words.length && !this.over_time) at = s.x[i];
      const value = this.value("x", s.x[i]);
      const place = this.over_time ? "" : ` (${shown(value)})`;
      words.push((s.name || "value") + place + " = " + shown(this.value("y", s.y[i])));
    }
    set(this.line, {x1: this.place("x", at), x2: this.place("x", at)});
    const time = this.over_time ? `t = ${shown(this.on_axis("x", x), 5)} s:  ` : "";
    this.readout.textContent = time + words.join(",  ") + this.unit;
  }

  closest(s, [x, y]) {
    const scale = k => 1 / (this.view[k][1] - this.view[k][0]), wide = 2.5 * scale("x"), high = scale("y");
    const distances = s.x.map((v, i) => Math.hypot(wide * (v - x), high * (s.y[i] - y)));
    return distances.indexOf(Math.min(...distances));
  }
}
