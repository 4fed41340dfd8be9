// A Grashof four-bar under gravity whose crank turns round and round: lengths 0.5, 1.2, 0.9, pins 1 m apart. From its
// energy the time that it takes to reach an angle is an integral, computed here without the toolkit:
//   t = integral of sqrt(M(theta)/2 / (E - V(theta))) dtheta,   kinetic energy M theta'^2/2
#pragma once

#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <numbers>

#include "tests/extremes/problem_runs.hpp"

namespace mbsopt::extremes {

struct FourBar {
  double crank_mass = 1, coupler_mass = 1, rocker_mass = 1;
  double theta0 = 1.3, rate0 = 6;
  static constexpr double L1 = 0.5, L2 = 1.2, L3 = 0.9, d = 1, g = 9.81;

  struct Position {
    double bx, by, coupler, rocker;
  };
  static Position at(double theta) {
    const double bx = L1 * std::cos(theta), by = L1 * std::sin(theta), D = std::hypot(d - bx, by);
    const double coupler = std::atan2(-by, d - bx) + std::acos((D * D + L2 * L2 - L3 * L3) / (2 * D * L2));
    const double cx = bx + L2 * std::cos(coupler), cy = by + L2 * std::sin(coupler);
    return {bx, by, coupler, std::atan2(cy, cx - d)};
  }

  double M(double theta) const {  // [kg m^2]
    const auto [bx, by, b, c] = at(theta);
    const double coupler = L1 * std::sin(theta - c) / (L2 * std::sin(c - b));  // rates for theta' = 1
    const double rocker = L1 * std::sin(theta - b) / (L3 * std::sin(c - b));
    const double vx = -by - L2 / 2 * std::sin(b) * coupler, vy = bx + L2 / 2 * std::cos(b) * coupler;
    return crank_mass * L1 * L1 / 3 + coupler_mass * (vx * vx + vy * vy + L2 * L2 / 12 * coupler * coupler) +
           rocker_mass * L3 * L3 / 3 * rocker * rocker;
  }
  double V(double theta) const {  // [J]
    const auto [bx, by, b, c] = at(theta);
    return g * (crank_mass * by / 2 + coupler_mass * (by + L2 / 2 * std::sin(b)) + rocker_mass * L3 / 2 * std::sin(c));
  }
  double time_to(double theta) const {
    const double E = M(theta0) * rate0 * rate0 / 2 + V(theta0);
    const auto slowness = [&](double x) { return std::sqrt(M(x) / 2 / (E - V(x))); };
    double t = 0, from = theta0;
    while (from < theta) {
      const double to = std::min(theta, from + 0.5);
      t += boost::math::quadrature::gauss_kronrod<double, 31>::integrate(slowness, from, to, 5, 1e-13);
      from = to;
    }
    return t;
  }

  Json json() const {
    const auto [bx, by, b, c] = at(theta0);
    Json p = problem("four_bar");
    p["bodies"] = {rod("crank", crank_mass, L1, 0, 0, theta0), rod("coupler", coupler_mass, L2, bx, by, b),
                   rod("rocker", rocker_mass, L3, d, 0, c)};
    p["joints"] = {hinge("A", "ground", {0, 0, 0}, "crank", "O"), hinge("B", "crank", "tip", "coupler", "O"),
                   hinge("C", "coupler", "tip", "rocker", "tip"), hinge("D", "ground", {d, 0, 0}, "rocker", "O")};
    p["initial"]["conditions"] = {{{"sensor", "theta"}, {"value", theta0}, {"rate", rate0}}};
    p["sensors"] = {{"theta", {{"quantity", "angle"}, {"joint", "A"}}}};
    p["objectives"] = {{"theta", {{"terminal", "theta"}}}};
    set_accuracy(p, "dopri5", 1e-9);
    return p;
  }
};

}  // namespace mbsopt::extremes
