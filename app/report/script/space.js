// Vectors, rotations and hulls of points.

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
