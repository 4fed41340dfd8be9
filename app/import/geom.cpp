#include "app/import/geom.hpp"

#include <numbers>

namespace mbsopt::inline app {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

// A capsule is a cylinder and a sphere.
double cylinder_volume(const Geom& g) { return 2 * pi * g.size(0) * g.size(0) * g.size(1); }
double sphere_volume(const Geom& g) { return 4. / 3 * pi * g.size(0) * g.size(0) * g.size(0); }

Vector3d cylinder_inertia(double r, double h) {
  const double across = (3 * r * r + 4 * h * h) / 12;
  return {across, across, r * r / 2};
}

}  // namespace

int sizes_of(const std::string& type) {
  if (type == "sphere") return 1;
  if (type == "capsule" || type == "cylinder") return 2;
  return type == "ellipsoid" || type == "box" ? 3 : 0;
}

double volume(const Geom& g) {
  if (g.type == "sphere") return sphere_volume(g);
  if (g.type == "cylinder") return cylinder_volume(g);
  if (g.type == "capsule") return cylinder_volume(g) + sphere_volume(g);
  return (g.type == "box" ? 8 : 4. / 3 * pi) * g.size.prod();
}

Vector3d unit_inertia(const Geom& g) {
  const double r = g.size(0), h = g.size(1);
  if (g.type == "sphere") return Vector3d::Constant(2 * r * r / 5);
  if (g.type == "cylinder") return cylinder_inertia(r, h);
  if (g.type == "capsule") {
    const double ends = 2 * r * r / 5 + h * h + 3 * h * r / 4;  // 83/320 r^2 + (h + 3r/8)^2
    const double part = cylinder_volume(g) / volume(g);
    return part * cylinder_inertia(r, h) + (1 - part) * Vector3d(ends, ends, 2 * r * r / 5);
  }
  const Vector3d squares = g.size.cwiseAbs2();
  return (Vector3d::Constant(squares.sum()) - squares) / (g.type == "box" ? 3 : 5);
}

ImportedShape shape_of(const Geom& g) {
  const Vector3d centre = g.at.translation();
  if (g.type == "sphere") return {"sphere", centre, centre, g.size(0)};
  if (g.type == "ellipsoid") return {"sphere", centre, centre, g.size.mean()};
  if (g.type == "box") {
    Eigen::Index longest = 0;
    const double length = g.size.maxCoeff(&longest);
    const Vector3d half = length * Vector3d::Unit(longest);
    return {"box", g.at * Vector3d(-half), g.at * half, (g.size - half).maxCoeff()};
  }
  const Vector3d half(0, 0, g.size(1));
  return {g.type == "capsule" ? "rod" : "cylinder", g.at * Vector3d(-half), g.at * half, g.size(0)};
}

}  // namespace mbsopt::inline app
