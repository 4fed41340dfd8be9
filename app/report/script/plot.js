// Plots answer the pointer: values, zoom, legends that hide curves. They fit their drawing to the width of the window.

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
    // A drawing within the drawing: it cuts off what a zoom moves out of the frame.
    this.inner = this.make("svg");
    this.inner.append(...this.svg.querySelectorAll("path[data-series],.beyond,.limit"));
    this.line = this.make("path", {class: "cursor"});
    this.zoom = this.make("rect", {class: "zoom", visibility: "hidden"});
    this.catcher = this.make("rect", {class: "catch"});
    this.svg.append(this.inner, this.line, this.zoom, this.catcher);
    this.readout = element("div", {class: "readout", "aria-live": "off"});
    figure.append(this.readout);
    this.listen();
    this.layout(figure.clientWidth || 700);  // a hidden figure has no width yet
    if (this.over_time) cursor.listeners.push(t => this.show(t));
    // In the next frame: a layout changes the height that is observed.
    new ResizeObserver(() => requestAnimationFrame(() => this.layout())).observe(figure);
    addEventListener("beforeprint", () => this.layout(560, 200));  // 15 cm wide; four on a page
    addEventListener("afterprint", () => this.layout());
  }

  make(tag, attributes = {}, text) {
    return element(tag, attributes, text === undefined ? [] : [text], this.svg.namespaceURI);
  }

  // One unit of the drawing is one pixel, so that all text has its size at each width.
  layout(width = this.figure.clientWidth, height = Math.round(Math.min(Math.max(0.42 * width, 250), 360))) {
    if (!width || width == this.width) return;
    this.width = width;
    const [left, top] = [66, 26], [w, h] = [width - left - 22, height - top - 44];
    this.box = [left, top, w, h];
    const set = (e, values) => { for (const [key, value] of Object.entries(values)) e.setAttribute(key, value); };
    const frame = {x: left, y: top, width: w, height: h};
    set(this.svg, {viewBox: `0 0 ${width} ${height}`});
    set(this.inner, {...frame, viewBox: this.box.join(" ")});
    for (const rect of [this.svg.querySelector(".frame"), this.catcher]) set(rect, frame);
    set(this.svg.querySelector(".x-label"), {x: left + w / 2, y: height - 8});
    const name = this.svg.querySelector(".y-label"), most = width - 8;
    name.removeAttribute("textLength");
    if (name.getComputedTextLength() > most) set(name, {textLength: most, lengthAdjust: "spacingAndGlyphs"});
    if (this.plot.equal) this.equalise();
    this.draw();
    this.show(this.over_time ? cursor.t : null);
  }

  // Widens one range, so that a metre is as long in x as in y.
  equalise() {
    const [, , w, h] = this.box, [x, y] = [this.home.x, this.home.y];
    const scale = Math.max((x[1] - x[0]) / w, (y[1] - y[0]) / h);
    const wide = (range, pixels) => [-1, 1].map(s => (range[0] + range[1] + s * scale * pixels) / 2);
    this.x = wide(x, w), this.y = wide(y, h);
  }

  // Data to pixels and back; logarithmic axes hold logarithms.
  px(v) { return this.box[0] + (v - this.x[0]) / (this.x[1] - this.x[0]) * this.box[2]; }
  py(v) { return this.box[1] + (this.y[1] - v) / (this.y[1] - this.y[0]) * this.box[3]; }
  to_x(px) { return this.x[0] + (px - this.box[0]) / this.box[2] * (this.x[1] - this.x[0]); }
  to_y(py) { return this.y[1] - (py - this.box[1]) / this.box[3] * (this.y[1] - this.y[0]); }
  on_x(v) { return v === null ? NaN : this.plot.logx ? Math.log10(v) : v; }
  on_y(v) { return v === null ? NaN : this.plot.logy ? Math.log10(v) : v; }
  at(event) {
    const p = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.svg.getScreenCTM().inverse());
    const [left, top, width, height] = this.box;
    return [Math.min(Math.max(p.x, left), left + width), Math.min(Math.max(p.y, top), top + height)];
  }

  listen() {
    let from = null;
    this.catcher.addEventListener("pointerdown", e => {
      from = this.at(e);
      this.catcher.setPointerCapture(e.pointerId);
    });
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
    this.catcher.addEventListener("dblclick", () => this.go_home());
    for (const key of this.figure.querySelectorAll(".legend [data-series]")) {
      key.setAttribute("role", "button"), key.setAttribute("tabindex", "0"), key.setAttribute("aria-pressed", "true");
      key.onclick = () => this.toggle(key);
      key.onkeydown = e => { if (e.key == "Enter" || e.key == " ") e.preventDefault(), this.toggle(key); };
    }
    this.svg.setAttribute("tabindex", "0");
    this.svg.onkeydown = e => {
      if (e.key == "Escape") this.go_home();
      const step = {ArrowRight: 1, ArrowLeft: -1}[e.key], [begin, end] = this.home.x;
      if (!step || !this.over_time) return;
      e.preventDefault();
      cursor.set(Math.min(Math.max((cursor.t ?? begin) + step * (this.x[1] - this.x[0]) / 200, begin), end));
    };
  }

  // A box that the pointer drew; one that is flat leaves the height as it is.
  dragged(from, to) {
    const x = Math.min(from[0], to[0]), w = Math.abs(from[0] - to[0]);
    const y = Math.min(from[1], to[1]), h = Math.abs(from[1] - to[1]);
    return h > 12 ? [x, y, w, h] : [x, this.box[1], w, this.box[3]];
  }

  toggle(key) {
    const k = Number(key.dataset.series), on = !this.series[k].on;
    this.series.forEach((s, i) => { if (i == k || s.part == k) s.on = on; });
    key.setAttribute("aria-pressed", on);
    this.draw();
  }

  zoom_to(x, y) { this.x = x, this.y = y; this.draw(); this.show(this.over_time ? cursor.t : null); }
  go_home() {
    this.zoom_to(this.home.x, this.home.y);
    if (this.plot.equal) this.equalise(), this.draw();
  }

  path_of(s) {
    let d = "", down = false;
    for (let i = 0; i < s.x.length; ++i) {
      const px = this.px(this.on_x(s.x[i])), py = this.py(this.on_y(s.y[i]));
      if (!isFinite(px) || !isFinite(py)) { down = false; continue; }
      const at = px.toFixed(1) + " " + py.toFixed(1);
      if (s.mark == "points") d += "M" + at + "h0";
      else if (s.mark == "rings") d += `M${(px - 4).toFixed(1)} ${py.toFixed(1)}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0`;
      else if (s.mark == "crosses") d += `M${(px - 5).toFixed(1)} ${(py - 5).toFixed(1)}l10 10m-10 0l10 -10`;
      else if (s.mark == "bars") d += `M${px.toFixed(1)} ${this.py(0).toFixed(1)}V${py.toFixed(1)}`;
      else d += (down ? "L" : "M") + at;
      down = true;
    }
    return d;
  }

  // Between the limit and what of the lines lies beyond it.
  area_of(s, limit) {
    const level = this.on_y(limit.value), at = (x, y) => this.px(this.on_x(x)).toFixed(1) + " " + this.py(y).toFixed(1);
    const points = s.x.map((x, i) => [x, this.on_y(s.y[i])]).filter(p => isFinite(p[1]));
    if (!points.some(p => limit.upper ? p[1] > level : p[1] < level)) return "";
    const along = points.map(p => at(p[0], limit.upper ? Math.max(p[1], level) : Math.min(p[1], level)));
    return "M" + at(points[0][0], level) + "L" + along.join("L") + "L" + at(points.at(-1)[0], level) + "Z";
  }

  draw() {
    this.inner.querySelectorAll(".beyond,.limit").forEach(e => e.remove());
    this.svg.querySelectorAll(".limit-name").forEach(e => e.remove());
    for (const path of this.inner.querySelectorAll("path[data-series]")) {
      const s = this.series[path.dataset.series];
      path.setAttribute("d", s.on ? this.path_of(s) : "");
    }
    this.draw_limits();
    this.draw_instants();
    this.draw_ticks();
  }

  draw_limits() {
    const [left, top, width, height] = this.box;
    const add = (kind, d) => this.inner.prepend(this.make("path", {class: kind, d}));
    for (const limit of this.plot.limits) {
      const y = this.py(this.on_y(limit.value));
      add("limit", `M${left} ${y.toFixed(1)}h${width}`);
      for (const s of this.series) if (s.on && s.mark == "line") add("beyond", this.area_of(s, limit));
      if (y < top || y > top + height) continue;
      const place = {x: left + width - 4, y: (y - top < 16 ? y + 14 : y - 4).toFixed(1), "text-anchor": "end"};
      this.svg.insertBefore(this.make("text", {class: "limit-name", ...place}, limit.name), this.line);
    }
  }

  // Vertical lines, each with its name where it does not lie on the one before.
  draw_instants() {
    const [left, top, width, height] = this.box;
    let free = left;
    for (const instant of this.plot.instants) {
      const x = this.px(this.on_x(instant.x));
      this.inner.prepend(this.make("path", {class: "limit dashed", d: `M${x.toFixed(1)} ${top}v${height}`}));
      if (x < free || x > left + width) continue;
      const at_left = x < left + width / 2;
      const place = {x: x + (at_left ? 4 : -4), "text-anchor": at_left ? "start" : "end"};
      const name = this.make("text", {class: "limit-name", y: top + 14, ...place}, instant.name);
      this.svg.insertBefore(name, this.line);
      free = x + name.getComputedTextLength() + 12;
    }
  }

  // Pairs of a place on the axis and the parts of its label.
  ticks(range, logarithmic, count) {
    const size = Math.max(...range.map(Math.abs)), hidden = Math.floor(Math.log10(size / (range[1] - range[0])));
    const rounded = (v, digits) => Number(v.toPrecision(Math.min(digits + Math.max(hidden, 0), 15))) || 0;
    const label = v => size >= 1e5 || size < 1e-3 ? rounded(v, 4).toExponential() : String(rounded(v, 6));
    if (!logarithmic) return round_ticks(...range, count).map(v => [v, [v ? label(v) : "0"]]);
    const values = logarithmic_ticks(10 ** range[0], 10 ** range[1], count);
    const near_one = values.every(v => v > 0.9e-3 && v < 1.1e4);
    const power = v => {
      const exponent = Math.floor(Math.log10(v) + 1e-9), digits = v / 10 ** exponent;
      const raised = this.make("tspan", {dy: -4, "font-size": 9}, String(exponent));
      return [(Math.abs(digits - 1) < 1e-6 ? "" : shown(digits, 4) + "\u00b7") + "10", raised];
    };
    return values.map(v => [Math.log10(v), near_one ? [shown(v)] : power(v)]);
  }

  draw_ticks() {
    const [left, top, width, height] = this.box, group = this.svg.querySelector(".ticks");
    group.replaceChildren();
    const add = (d, place, words) => {
      const text = this.make("text", place);
      text.append(...words);
      group.append(this.make("path", {class: "grid", d}), text);
    };
    const count = pixels => Math.min(Math.max(Math.floor(width / pixels), 2), 8);
    const names = this.plot.names.map((name, k) => [k, [name]]);
    for (const [v, words] of names.length ? names : this.ticks(this.x, this.plot.logx, count(75))) {
      if (this.plot.whole && v != Math.round(v) || v < this.x[0] || v > this.x[1]) continue;
      const x = this.px(v).toFixed(1);
      add(`M${x} ${top}v${height}`, {x, y: top + height + 16, "text-anchor": "middle"}, words);
    }
    if (names.length) this.thin_names(group);
    for (const [v, words] of this.ticks(this.y, this.plot.logy, height > 220 ? 6 : 5)) {
      const y = this.py(v);
      const fit = words[0].length > 9 ? {textLength: left - 8, lengthAdjust: "spacingAndGlyphs"} : {};
      const place = {x: left - 6, y: (y + 4).toFixed(1), "text-anchor": "end", ...fit};
      add(`M${left} ${y.toFixed(1)}h${width}`, place, words);
    }
  }

  // Of names that would lie on each other only some are shown; the pointer tells the others.
  thin_names(group) {
    let free = -Infinity;
    for (const text of group.querySelectorAll("text")) {
      const half = text.getComputedTextLength() / 2, x = Number(text.getAttribute("x"));
      x - half < free ? text.remove() : free = x + half + 6;
    }
  }

  // The cursor and the values at an x; `pointer`: in pixels, to choose among clouds. Null hides them.
  show(x, pointer = null) {
    const hidden = x === null || x < this.x[0] || x > this.x[1];
    if (hidden) { this.line.setAttribute("d", ""); this.readout.textContent = ""; return; }
    const [left, top, , height] = this.box, words = [], unit = this.plot.ylabel.match(/\[([^\]]*)\]/);
    let at = x;
    for (const s of this.series) {
      if (!s.on || s.part >= 0 || !s.x.length) continue;
      const keys = s.x.map(v => this.on_x(v));
      const i = s.sorted ? nearest(keys, x) : this.closest(s, pointer || [this.px(x), top + height / 2]);
      if (!words.length && !this.over_time) at = keys[i];
      const place = this.over_time ? "" : ` (${this.plot.names[s.x[i]] ?? shown(s.x[i])})`;
      words.push((s.name || "value") + place + " = " + shown(s.y[i]));
    }
    this.line.setAttribute("d", `M${this.px(at).toFixed(1)} ${top}v${height}`);
    this.readout.textContent = (this.over_time ? `t = ${shown(x, 5)} s:  ` : "") + words.join(",  ") +
                               (unit && unit[1] != "-" ? " " + unit[1] : "");
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
