#include "core/watch/stiffness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace mbsopt {
namespace {

// R(-x): the step of y' = lambda y, y0 = 1, with h lambda = -x.
double amplification(const Method& rk, double x) {
  std::array<double, Method::kMaxStages> u{};
  double R = 1;
  for (int i = 0; i < rk.stages; ++i) {
    double Y = 1;
    for (int j = 0; j < i; ++j) Y -= x * rk.a(i, j) * u[static_cast<std::size_t>(j)];
    u[static_cast<std::size_t>(i)] = Y;
    R -= x * rk.b[i] * Y;
  }
  return R;
}

bool is_end_of_step(const Method& rk, int stage) {
  for (int j = 0; j < rk.stages; ++j)
    if (std::abs(rk.a(stage, j) - rk.b[j]) > 1e-14) return false;
  return true;
}

}  // namespace

double real_stability_boundary(const Method& rk) {
  const auto stable = [&](double x) { return std::abs(amplification(rk, x)) <= 1 + 1e-12; };
  constexpr double kStride = 0.05;
  double inside = 0;
  while (inside < 100 && stable(inside + kStride)) inside += kStride;
  double outside = inside + kStride;
  while (outside - inside > 1e-6) (stable(0.5 * (inside + outside)) ? inside : outside) = 0.5 * (inside + outside);
  return inside;
}

StiffnessWatch::StiffnessWatch(const Method& rk, Eigen::Index states, SimulationStatistics& statistics)
    : statistics_(statistics) {
  if (rk.implicit() || rk.stages < 3 || !rk.adaptive) return;
  second_ = rk.stages - 1;
  for (int i = 0; i < second_; ++i)
    if (rk.c[i] == rk.c[second_]) first_ = i, pair_ = Pair::in_step;
  if (pair_ == Pair::none && rk.c[second_] == 1 && !is_end_of_step(rk, second_)) pair_ = Pair::across_steps;
  if (pair_ != Pair::none) boundary_ = real_stability_boundary(rk);
  if (pair_ == Pair::across_steps) {
    Y_last_.setZero(states);
    K_last_.setZero(states);
  }
}

std::string StiffnessWatch::look_at(const SeenStep& seen) {
  const Step& step = *seen.stages;
  if (pair_ == Pair::in_step)
    compare(step.Y.col(first_), step.K.col(first_), step.Y.col(second_), step.K.col(second_), step.h);
  if (pair_ != Pair::across_steps) return {};
  if (h_last_ > 0 && t_last_ == step.t) compare(Y_last_, K_last_, step.Y.col(0), step.K.col(0), h_last_);
  Y_last_ = step.Y.col(second_);
  K_last_ = step.K.col(second_);
  t_last_ = step.t1;
  h_last_ = step.h;
  return {};
}

void StiffnessWatch::compare(const Eigen::Ref<const Eigen::VectorXd>& Y_a, const Eigen::Ref<const Eigen::VectorXd>& K_a,
                             const Eigen::Ref<const Eigen::VectorXd>& Y_b, const Eigen::Ref<const Eigen::VectorXd>& K_b,
                             double h) {
  ++statistics_.watched_steps;
  constexpr double kRounding = 100 * std::numeric_limits<double>::epsilon();
  const double apart = (Y_b - Y_a).norm();
  if (!(apart > kRounding * Y_b.norm())) return;  // rounding says nothing of f_y
  const double rate = (K_b - K_a).norm() / apart;
  if (!(h * rate > kNear * boundary_ && h * rate < kBeyond * boundary_)) return;
  ++statistics_.stability_limited_steps;
  statistics_.stiffest_rate = std::max(statistics_.stiffest_rate, rate);
}

bool is_stability_limited(const SimulationStatistics& statistics) {
  constexpr long kEnough = 50;
  return statistics.watched_steps >= kEnough && 2 * statistics.stability_limited_steps >= statistics.watched_steps;
}

bool may_spoil_derivatives(const SimulationStatistics& statistics) {
  constexpr long kMany = 1000;
  return is_stability_limited(statistics) ||
         (statistics.watched_steps >= kMany && 10 * statistics.stability_limited_steps >= statistics.watched_steps);
}

std::string stiffness_warning(const SimulationStatistics& statistics, const std::string& integrator,
                              bool differentiated) {
  if (!(differentiated ? may_spoil_derivatives(statistics) : is_stability_limited(statistics))) return "";
  std::string words = fmt::format(
      "the step is limited by stability, not by accuracy, in {:.0f} % of the steps of {}: something decays or swings "
      "at {:.1e} 1/s, which the motion does not show. Use radau5 or sdirk4 as simulation.integrator.type",
      100.0 * static_cast<double>(statistics.stability_limited_steps) / static_cast<double>(statistics.watched_steps),
      integrator, statistics.stiffest_rate);
  if (differentiated)
    words +=
        ". The gradient is not to be trusted: it is exact for these steps held fixed, which amplify errors that "
        "step-size control would keep down, and may be wrong by orders of magnitude";
  return words;
}

}  // namespace mbsopt
