#include "app/report/mechanism_drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

struct DrawnSketch {
  const DrawnState& state;
  Sketch sketch;

  Point3 at(const SketchPoint& p) const { return placed(state.row, p); }
  std::vector<Point2> outline_of(std::size_t body, const std::vector<Point3>& points, const auto& view) const {
    std::vector<Point2> pixels;
    for (const Point3& s : points) pixels.push_back(view(at({body, s})));
    return outline(std::move(pixels));
  }
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
    for (std::size_t i = 0; i < one.sketch.bodies.size(); ++i) {
      for (const Point3& s : one.sketch.bodies[i].points) extend(one.at({i, s}));
      for (const std::vector<Point3>& hull : one.sketch.bodies[i].hulls)
        for (const Point3& s : hull) extend(one.at({i, s}));
    }
    for (const SketchedMark& mark : one.sketch.marks) {
      extend(one.at(mark.at));
      if (mark.to) extend(one.at(*mark.to));
    }
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
  return closed ? d + "Z" : pixels.size() == 1 ? d + "h0" : d;
}

// Puts x along the axis of a mark, or stretches it to its other end.
std::string transform_of(const SketchedMark& mark, const DrawnSketch& drawn, const View& view) {
  const Point2 at = view(drawn.at(mark.at));
  if (mark.radius > 0)
    return fmt::format("translate({:.1f} {:.1f}) scale({:.4g})", at.x(), at.y(), mark.radius * view.scale);
  Point2 along(1, 0);
  if (mark.to) along = view(drawn.at(*mark.to)) - at;
  if (mark.axis) along = view.flat(turned(drawn.state.row, *mark.axis)).cwiseProduct(Point2(1, -1));
  const Point2 forward = along.norm() > 1e-9 ? Point2(along.normalized()) : Point2(1, 0),
               x = mark.to || mark.foreshortened ? along : forward;
  return fmt::format("matrix({:.4g} {:.4g} {:.4g} {:.4g} {:.1f} {:.1f})", x.x(), x.y(), -forward.y(), forward.x(),
                     at.x(), at.y());
}

Point2 middle_of(const std::vector<Point2>& points) {
  Point2 middle(0, 0);
  for (const Point2& p : points) middle += p / static_cast<double>(points.size());
  return middle;
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
  for (std::size_t i = 0; i < sketch.bodies.size(); ++i) {
    const SketchedBody& body = sketch.bodies[i];
    for (const std::vector<Point3>& points : body.hulls) {
      const std::vector<Point2> hull = drawn.outline_of(i, points, view);
      svg += fmt::format("<path class=\"body {0}c{1} f{1}\" d=\"{2}\"/>\n", body.solid ? "solid " : "",
                         i % kBodyColours, path_through(hull, hull.size() > 2));
    }
    if (last && sketch.bodies.size() <= kMostNames)
      svg +=
          name_beside(drawn.outline_of(i, body.points, view),
                      middle_of(first.outline_of(i, first.sketch.bodies[i].points, view)), state.scene.bodies[i].name);
  }
  for (const SketchedMark& mark : sketch.marks)
    svg += fmt::format("<path class=\"mark {}\" transform=\"{}\" d=\"{}\"/>\n", mark.style,
                       transform_of(mark, drawn, view), mark.path);
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

MotionPlane plane_of_motion(const Scene& scene, const Trajectory& trajectory) {
  constexpr std::size_t kInstants = 50;
  constexpr double kStandstill = 1e-6;  // of the spread: smaller motion is rounding
  const Sketch sketch = sketch_of(scene);
  Eigen::AlignedBox3d all;
  Point3 motion = Point3::Zero();  // largest way of a point along each axis
  const std::size_t stride = std::max<std::size_t>(1, trajectory.rows.size() / kInstants);
  for (std::size_t i = 0; i < sketch.bodies.size(); ++i) {
    for (const Point3& s : sketch.bodies[i].points) {
      Eigen::AlignedBox3d way;
      for (std::size_t row = 0; row < trajectory.rows.size(); row += stride)
        way.extend(placed(trajectory.rows[row], {i, s}));
      if (way.isEmpty()) continue;
      motion = motion.cwiseMax(way.sizes());
      all.extend(way);
    }
  }
  const Point3 spread = all.isEmpty() ? Point3::Zero() : Point3(all.sizes());
  const double least = kStandstill * spread.maxCoeff();
  std::array<int, 3> axes{0, 1, 2};
  std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) {
    const bool still = motion(a) <= least && motion(b) <= least;
    return still ? spread(a) > spread(b) : motion(a) > motion(b);
  });
  // A body whose points lie on its axis turns without moving them. Its angular velocity points along the normal.
  const auto turns_in_plane = [&](const std::vector<double>& row) {
    for (std::size_t i = 0; i < sketch.bodies.size(); ++i) {
      const Point3 omega(row.data() + 11 + 13 * i), along = omega(axes[2]) * Point3::Unit(axes[2]);
      if ((omega - along).norm() > kStandstill * (1 + along.norm())) return false;
    }
    return true;
  };
  return {{std::min(axes[0], axes[1]), std::max(axes[0], axes[1])},
          motion(axes[2]) <= least && std::ranges::all_of(trajectory.rows, turns_in_plane)};
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
