// Vectors, rotations, and paths through points of the drawing.

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

// The d of SVG paths: through points; a cross; an arrow along v, if it is long enough.
const path_of = (points, end = "") => "M" + points.map(p => p[0].toFixed(1) + " " + p[1].toFixed(1)).join("L") + end;
const cross_at = ([x, y], r) => path_of([[x - r, y - r], [x + r, y + r]]) + path_of([[x - r, y + r], [x + r, y - r]]);
function arrow(from, v) {
  const n = Math.hypot(...v);
  if (!(n >= 5 && isFinite(n))) return "";
  const to = [from[0] + v[0], from[1] + v[1]], [x, y] = [6 * v[0] / n, 6 * v[1] / n];
  const barb = side => [to[0] - x - side * y / 2, to[1] - y + side * x / 2];
  return path_of([from, to]) + path_of([barb(1), to, barb(-1)]);
}
