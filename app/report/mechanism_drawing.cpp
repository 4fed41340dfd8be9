#include "app/report/mechanism_drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "app/report/html_text.hpp"
#include "app/report/line_plot.hpp"
#include "app/report/mechanism_sketch.hpp"

namespace mbsopt::inline app {
namespace {

using Point3 = Eigen::Vector3d;
using Point2 = Eigen::Vector2d;

constexpr double kWidth = 760, kLargestHeight = 460, kSmallestHeight = 160, kMargin = 40;  // [px]
constexpr double kTitle = 24;                                                              // room above [px]
constexpr std::size_t kBodyColours = 8, kMostNames = 10;

double cross(const Point2& a, const Point2& b) { return a.x() * b.y() - a.y() * b.x(); }

// Andrew's monotone chain, Information Processing Letters 9 (1979) 216-219.
std::vector<Point2> convex_hull(std::vector<Point2> points) {
  const auto before = [](const Point2& a, const Point2& b) {
    return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
  };
  std::sort(points.begin(), points.end(), before);
  points.erase(std::unique(points.begin(), points.end(), [](const auto& a, const auto& b) { return a == b; }),
               points.end());
  if (points.size() < 3) return points;
  std::vector<Point2> hull;
  for (int side = 0; side < 2; ++side, std::reverse(points.begin(), points.end())) {
    const std::size_t first = hull.size();
    for (const Point2& p : points) {
      while (hull.size() >= first + 2 && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();  // the other side begins with it
  }
  return hull;
}

// A hull thinner than a pixel becomes a line between its two farthest points.
std::vector<Point2> outline(std::vector<Point2> points) {
  const std::vector<Point2> hull = convex_hull(std::move(points));
  if (hull.size() < 3) return hull;
  Point2 a = hull[0], b = hull[1];
  for (const Point2& p : hull)
    for (const Point2& q : hull)
      if ((p - q).norm() > (a - b).norm()) a = p, b = q;
  const auto off = [&](const Point2& p) { return std::abs(cross(b - a, p - a)) / (b - a).norm(); };
  const bool thin = std::all_of(hull.begin(), hull.end(), [&](const Point2& p) { return off(p) < 1; });
  return thin ? std::vector<Point2>{a, b} : hull;
}

// Maps metres to pixels with the same scale in both directions.
struct View {
  std::array<int, 2> plane;
  double x0 = 0, y0 = 0, scale = 1, height = 0;  // x0, y0: at the left and lower margin [m]; scale [px/m]

  Point2 flat(const Point3& p) const { return {p(plane[0]), p(plane[1])}; }
  Point2 operator()(const Point3& p) const {
    return {kMargin + (p(plane[0]) - x0) * scale, height - kMargin - (p(plane[1]) - y0) * scale};
  }
};

// The drawing shows a joint at its point on the ground, or else on its second body.
const SketchPoint& drawn_point(const SketchedJoint& joint) {
  return joint.on_body1.body == kGround ? joint.on_body1 : joint.on_body2;
}

struct DrawnSketch {
  const DrawnState& state;
  Sketch sketch;

  Point3 at(const SketchPoint& p) const { return placed(state.row, p); }
};

// Returns nullopt if a position in the drawing or its width [m] overflows.
std::optional<View> view_of(std::array<int, 2> plane, const std::vector<DrawnSketch>& drawn) {
  Eigen::AlignedBox2d box;
  View view{plane};
  bool finite = true;
  const auto extend = [&](const Point3& p) {
    box.extend(view.flat(p));
    finite = finite && view.flat(p).allFinite();
  };
  for (const DrawnSketch& one : drawn) {
    for (std::size_t i = 0; i < one.sketch.bodies.size(); ++i)
      for (const Point3& s : one.sketch.bodies[i]) extend(one.at({i, s}));
    for (const SketchedJoint& joint : one.sketch.joints) extend(one.at(drawn_point(joint)));
    for (const SketchedSpring& spring : one.sketch.springs) extend(one.at(spring.from)), extend(one.at(spring.to));
  }
  const double width = std::max(box.sizes().x(), 1e-12), height = std::max(box.sizes().y(), 1e-12);
  view.scale = std::min((kWidth - 2 * kMargin) / width, (kLargestHeight - 2 * kMargin - kTitle) / height);
  view.height = std::max(kSmallestHeight, height * view.scale + 2 * kMargin + kTitle);
  view.x0 = box.center().x() - (kWidth / 2 - kMargin) / view.scale;
  view.y0 = box.center().y() - ((view.height - kTitle) / 2 - kMargin) / view.scale;
  if (!finite || !Point3(view.x0, view.y0, kWidth / view.scale).allFinite()) return std::nullopt;
  return view;
}

std::string path_through(const std::vector<Point2>& pixels, bool closed) {
  std::string d;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    d += fmt::format("{}{:.1f} {:.1f}", i == 0 ? 'M' : 'L', pixels[i].x(), pixels[i].y());
  return closed ? d + "Z" : d;
}

// A coil as in script/symbols.js: seen from the side, and a little from the end.
std::string coil(const Point2& from, const Point2& to) {
  constexpr int kTurns = 10, kSamples = 12;  // of a turn
  constexpr double kRadius = 5;              // [px]
  const Point2 along = to - from;
  const double length = along.norm();
  if (!(length > 0)) return path_through({from, to}, false);
  const Point2 forward = along / length, across(-forward.y(), forward.x());
  std::vector<Point2> pixels{from};
  for (int i = 0; i <= kTurns * kSamples; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSamples;
    pixels.push_back(from + (0.15 + 0.7 * i / (kTurns * kSamples)) * along +
                     kRadius * ((0.5 - 0.5 * std::cos(angle)) * forward + std::sin(angle) * across));
  }
  pixels.push_back(to);
  return path_through(pixels, false);
}

Point2 middle_of(const std::vector<Point2>& points) {
  Point2 middle(0, 0);
  for (const Point2& p : points) middle += p / static_cast<double>(points.size());
  return middle;
}

std::vector<Point2> outline_of(const DrawnSketch& drawn, std::size_t body, const View& view) {
  std::vector<Point2> pixels;
  for (const Point3& s : drawn.sketch.bodies[body]) pixels.push_back(view(drawn.at({body, s})));
  return outline(std::move(pixels));
}

// A name beside a body. Beside a bar its nearest corner is kGap off the bar, on the side away from `other`.
std::string name_beside(const std::vector<Point2>& hull, const Point2& other, const std::string& name) {
  constexpr double kGap = 6, kAscent = 10, kDescent = 3;  // [px]
  const Point2 middle = middle_of(hull);
  Point2 side(1, -1);
  if (hull.size() == 2) {
    const Point2 along = (hull[1] - hull[0]).normalized();
    side = {-along.y(), along.x()};
    const double away = side.dot(middle - other);
    if (std::abs(away) > 1 ? away < 0 : side.x() < 0) side = -side;
  }
  const Point2 at = middle + kGap * side;
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\"{}>{}</text>\n", at.x(),
                     at.y() + (side.y() > 0 ? kAscent : -kDescent), side.x() < 0 ? " text-anchor=\"end\"" : "",
                     html_escaped(name));
}

// Names stand in the last state, on the side away from the first.
void draw_state(const DrawnSketch& drawn, const DrawnSketch& first, const View& view, bool last, std::string& svg) {
  const auto& [state, sketch] = drawn;
  svg += last ? "<g>\n" : "<g class=\"earlier\">\n";
  for (const SketchedSpring& spring : sketch.springs)
    svg += fmt::format("<path class=\"spring\" d=\"{}\"/>\n",
                       coil(view(drawn.at(spring.from)), view(drawn.at(spring.to))));
  for (std::size_t i = 0; i < sketch.bodies.size(); ++i) {
    const std::vector<Point2> hull = outline_of(drawn, i, view);
    svg += fmt::format("<path class=\"body c{0} f{0}\" d=\"{1}\"/>\n", i % kBodyColours,
                       hull.size() == 1 ? path_through(hull, false) + "h0" : path_through(hull, hull.size() > 2));
    if (last && sketch.bodies.size() <= kMostNames)
      svg += name_beside(hull, middle_of(outline_of(first, i, view)), state.scene.bodies[i].name);
  }
  for (const SketchedJoint& joint : sketch.joints) {
    const Point2 p = view(drawn.at(drawn_point(joint)));
    if (drawn_point(joint).body == kGround)
      svg += fmt::format("<path class=\"ground\" d=\"M{0:.1f} {1:.1f}l-7 12h14Z\"/>\n", p.x(), p.y());
    svg += fmt::format("<circle class=\"joint\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\"/>\n", p.x(), p.y());
  }
  svg += "</g>\n";
}

// Draws a round length of about an eighth of the width.
void draw_scale(const View& view, std::string& svg) {
  const double wanted = kWidth / 8 / view.scale, length = round_ticks(0, 4 * wanted, 4).at(1);
  svg += fmt::format(
      "<path class=\"frame\" d=\"M{0:.1f} {1:.1f}v6h{2:.1f}v-6\"/><text x=\"{3:.1f}\" y=\"{4:.1f}\">{5:g} m</text>\n",
      kMargin / 2, view.height - 14, length * view.scale, kMargin / 2 + length * view.scale + 6, view.height - 8,
      length);
}

}  // namespace

std::array<int, 2> plane_of_motion(const Scene& scene, const Trajectory& trajectory) {
  constexpr std::size_t kInstants = 50;
  constexpr double kStandstill = 1e-6;  // of the spread: smaller motion is rounding
  const Sketch sketch = sketch_of(scene);
  Eigen::AlignedBox3d all;
  Point3 motion = Point3::Zero();  // largest way of a point along each axis
  const std::size_t stride = std::max<std::size_t>(1, trajectory.rows.size() / kInstants);
  for (std::size_t i = 0; i < sketch.bodies.size(); ++i) {
    for (const Point3& s : sketch.bodies[i]) {
      Eigen::AlignedBox3d way;
      for (std::size_t row = 0; row < trajectory.rows.size(); row += stride)
        way.extend(placed(trajectory.rows[row], {i, s}));
      if (way.isEmpty()) continue;
      motion = motion.cwiseMax(way.sizes());
      all.extend(way);
    }
  }
  const Point3 spread = all.isEmpty() ? Point3::Zero() : Point3(all.sizes());
  std::array<int, 3> axes{0, 1, 2};
  std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) {
    const double least = kStandstill * spread.maxCoeff();
    const bool still = motion(a) <= least && motion(b) <= least;
    return still ? spread(a) > spread(b) : motion(a) > motion(b);
  });
  return {std::min(axes[0], axes[1]), std::max(axes[0], axes[1])};
}

std::string mechanism_drawing(const std::string& title, std::array<int, 2> plane,
                              const std::vector<DrawnState>& states) {
  if (states.empty()) return {};
  std::vector<DrawnSketch> drawn;
  for (const DrawnState& state : states) drawn.push_back({state, sketch_of(state.scene)});
  const std::optional<View> found = view_of(plane, drawn);
  if (!found) return {};
  const View& view = *found;
  const std::string full_title = fmt::format("{}, seen in the {}-{} plane", title, "xyz"[plane[0]], "xyz"[plane[1]]);
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {0} {1:.0f}\" role=\"img\" aria-label=\"{2}\">\n<text class=\"title\" x=\"{3}\" "
      "y=\"18\">{2}</text>\n",
      kWidth, view.height, html_escaped(full_title), kMargin / 2);
  for (const DrawnSketch& one : drawn) draw_state(one, drawn.front(), view, &one == &drawn.back(), svg);
  draw_scale(view, svg);
  svg += "</svg>\n";
  if (states.size() < 2) return svg;
  svg += "<div class=\"legend\">";
  for (const DrawnState& state : states)
    svg += fmt::format(
        "<span><svg class=\"key\" viewBox=\"0 0 30 10\"><path class=\"line{} c0\" d=\"M0 5H30\"/></svg>{}</span>",
        &state == &states.back() ? "" : " dashed", html_escaped(state.name));
  return svg + "</div>\n";
}

Scene with_values(Scene scene, const Eigen::VectorXd& rho) {
  for (std::size_t k = 0; k < scene.parameters.size(); ++k)
    scene.parameters[k].value = rho(static_cast<Eigen::Index>(k));
  return scene;
}

}  // namespace mbsopt::inline app
