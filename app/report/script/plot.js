// Plots answer the pointer: values, zoom, legends that hide curves.

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
