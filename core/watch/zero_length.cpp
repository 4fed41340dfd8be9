#include "core/watch/zero_length.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/force/forces.hpp"
#include "core/sensor/body_at.hpp"

namespace mbsopt {
namespace {

constexpr double kThroughZero = 1e-3;  // of the length at the ends of the step

// Without free length, actuator and damper the force is k d, smooth at zero length, too. A law is evaluated there.
double pull_at_zero(const TsdaForce& f, double t, const Eigen::VectorXd& rho) {
  if (!f.law.program) return f.law.f0 - f.law.k * f.law.x0;
  Law::Scratch scratch;
  scratch.inputs.resize(static_cast<std::size_t>(rho.size()) + 3);
  f.law.program->grow(scratch.program);
  return f.law.value(t, rho, 0, 0, scratch);
}

// The least distance from the origin along the cubic through d0, d1 with the given rates, over h.
double closest(const Vector3d& d0, const Vector3d& rate0, const Vector3d& d1, const Vector3d& rate1, double h) {
  const auto distance = [&](double x) {
    const double x2 = x * x, x3 = x2 * x;
    return ((2 * x3 - 3 * x2 + 1) * d0 + (x3 - 2 * x2 + x) * h * rate0 + (3 * x2 - 2 * x3) * d1 + (x3 - x2) * h * rate1)
        .norm();
  };
  double best = 0, width = 0.5;
  for (double x = 0; x <= 1; x += 1.0 / 64) {
    if (distance(x) < distance(best)) best = x;
  }
  for (width = 1.0 / 64; width > 1e-9; width /= 2) {
    if (distance(best + width) < distance(best)) best += width;
    if (distance(best - width) < distance(best)) best -= width;
  }
  return distance(best);
}

}  // namespace

std::string through_zero_length(const MechanismData& d, double t0, const Eigen::VectorXd& y0, double t1,
                                const Eigen::VectorXd& y1) {
  for (const TsdaForce& f : d.forces->of<TsdaForce>()) {
    const auto span = [&](const Eigen::VectorXd& y) { return f.span(body_at(y, f.body1), body_at(y, f.body2)); };
    const SpringSpan<Vector3d> a = span(y0), b = span(y1);
    if (a.u.dot(b.u) >= 0) continue;
    const double pull = pull_at_zero(f, t1, d.rho);
    if (pull == 0 || closest(a.d, a.ddot, b.d, b.ddot, t1 - t0) > kThroughZero * std::max(a.l, b.l)) continue;
    const std::string what = std::isfinite(pull) ? fmt::format("its force of {:.3g} N reverses at once", pull)
                                                 : "its law has no finite value";
    return fmt::format(
        "there is no gradient: a tsda between '{}' and '{}' goes through zero length near t = {:.6g} s, where {}. Keep "
        "its points apart (move them, or end the run earlier), or give it a \"law\" that is zero at length 0",
        d.body_names[static_cast<std::size_t>(f.body1)], d.body_names[static_cast<std::size_t>(f.body2)], t1, what);
  }
  return {};
}

}  // namespace mbsopt
