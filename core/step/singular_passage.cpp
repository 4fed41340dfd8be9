#include "core/step/singular_passage.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace mbsopt {
namespace {

constexpr double kEnds = 0.15;        // least distance of t* from the ends of a step, of its size
constexpr double kUncertain = 0.015;  // of theta, when a step is proposed
constexpr double kWorse = 1.5;        // than the best step, and one is tried again
constexpr double kStretch = 1.1;      // a step may grow so much to be placed well,
constexpr double kShrink = 0.4;       // or shrink,
constexpr double kLeast = 0.1;        // or where t* is too near for it
constexpr double kPole = 0.3;         // an inverse response below so much of the largest tells that a pole is near
constexpr double kCurved = 0.75;      // and below so much that it bends as d does
constexpr int kPlanned = 3;           // steps before the one past t* that are fitted
constexpr double kDense = 0.01;       // of a stage of dense output: what is observed, not the motion
constexpr double kNeighbours = 3;     // steps from t*

// d of t through three points; x: the root of the line through the last two.
double root_of_parabola(const std::array<double, 3>& t, const std::array<double, 3>& d, double x) {
  const double line = x, slope = (d[2] - d[1]) / (t[2] - t[1]);
  const double bend = (slope - (d[1] - d[0]) / (t[1] - t[0])) / (t[2] - t[0]);
  for (int k = 0; k < 5; ++k) x = t[2] - d[2] / (slope + bend * (x - t[1]));
  const double most = 0.5 * std::abs(line - t[2]);
  return std::clamp(x, line - most, line + most);
}

}  // namespace

double SingularPassage::best_theta() {
  tabulate();
  Passage best{0.5, kNone};
  for (int k = 0; k < good_count_; ++k) {
    if (good_[static_cast<std::size_t>(k)].magnified < best.magnified) best = good_[static_cast<std::size_t>(k)];
  }
  return best.theta;
}

void SingularPassage::tabulate() {
  if (good_count_ >= 0) return;
  good_count_ = 0;
  constexpr int kGrid = 100;
  double most[kGrid + 1];
  for (int i = 0; i <= kGrid; ++i) most[i] = uncertain(double(i) / kGrid);
  for (int i = 1; i < kGrid; ++i) {
    const bool far = i >= kEnds * kGrid && i <= (1 - kEnds) * kGrid;
    if (!far || most[i] >= most[i - 1] || most[i] > most[i + 1]) continue;
    if (good_count_ < kMostGood) good_[static_cast<std::size_t>(good_count_++)] = {double(i) / kGrid, most[i]};
  }
}

// Chooses equal steps of about h that reach t*, `left` away, with the least error after them. If t* is too near for
// them, it chooses a shorter step past it. The choice is continuous in both arguments except where the number of steps
// changes.
SingularPassage::Choice SingularPassage::choose(double left, double h, double most) const {
  const double longest = std::min(kStretch * h, most);
  Choice best{h, kNone};
  for (int before = 0; before <= kPlanned; ++before) {
    for (int k = 0; k < good_count_; ++k) {
      const Passage& good = good_[static_cast<std::size_t>(k)];
      const double wanted = left / (before + good.theta), size = std::min(wanted, longest);
      if (size < kShrink * h) continue;
      const double there = size == wanted ? good.magnified : uncertain(left / size - before);
      const double rounding = rounding_of(there, size / h);
      if (rounding < best.rounding) best = {size, rounding};
    }
  }
  if (best.rounding < kNone || left >= h) return best;
  for (int k = 0; k < good_count_; ++k) {
    const double size = std::max(left / good_[static_cast<std::size_t>(k)].theta, kLeast * h);
    const double rounding = rounding_of(uncertain(left / size), size / h);
    if (rounding < best.rounding) best = {size, rounding};
  }
  return best;
}

double SingularPassage::uncertain(double theta) const {
  double most = 0;
  for (const double off : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    const double here = theta + off * kUncertain;
    most = std::max(most, here > 0 && here < 1 ? magnified(here) : kNone);
  }
  return most;
}

double SingularPassage::magnified(double theta) const {
  double k[Method::kMaxStages], most = 0;
  for (const double to : {theta, theta - 1}) {
    for (int i = 0; i < rk_.dense_stages; ++i) {
      double u = 1 / (to * to);
      for (int j = 0; j < i; ++j) u += rk_.a(i, j) * k[j];
      k[i] = 2 * u / (to - rk_.c[i]);
      most = std::max(most, (i < rk_.stages ? 1 : kDense) * std::abs(k[i] / (to - rk_.c[i])));
    }
  }
  return most;
}

void SingularPassage::forget() {
  before_.known = last_.known = tried_.known = false;
  most_ = 0;
  ahead_ = {};
  found_ = {};
  behind_ = -kNone;
}

// Line or parabola through d at the ends of the last steps and of the one looked at.
SingularPassage::Estimate SingularPassage::estimate() const {
  // The response grows as 1/d^3:  1/inverse^3 = 1/most^3 + 1/d^3
  const double most = std::max(most_, now_.inverse);
  if (std::min(last_.inverse, now_.inverse) > kPole * most) return {};
  const auto distance = [&](const Place& p) {
    const double d = p.inverse / std::cbrt(1.001 - std::pow(p.inverse / most, 3));
    return std::copysign(d, last_.response.dot(p.response));
  };
  const double d0 = distance(last_), d1 = distance(now_);
  if (d1 >= d0) return {};
  const double step = now_.t - last_.t;
  const bool apart = std::min(std::abs(tried_.t - now_.t), std::abs(tried_.t - last_.t)) > 0.1 * step;
  const Place& third = tried_.known && apart ? tried_ : before_;
  double t = last_.t + step * d0 / (d0 - d1);
  if (third.known && third.inverse < kCurved * most) {
    t = root_of_parabola({third.t, last_.t, now_.t}, {distance(third), d0, d1}, t);
    if (d1 < 0) t = std::clamp(t, last_.t, now_.t);
  }
  return {t, std::min(std::abs(t - last_.t), std::abs(t - now_.t))};
}

bool SingularPassage::well_placed(double t, double h, double wanted, double most, const Eigen::VectorXd& response) {
  now_.t = t + h;
  now_.response = response;
  now_.known = true;
  now_.inverse = 1 / std::cbrt(std::max(response.norm(), 1e-300));
  found_ = ahead_;
  if (!last_.known) return true;
  const Estimate now = estimate();
  if (now.reach < found_.reach) found_ = now;
  if (found_.t == kNone) return true;
  tabulate();
  const double left = found_.t - t;
  const double rounding =
      left < h ? rounding_of(magnified(left / h), h / wanted) : choose(left - h, wanted, most).rounding;
  if (!(rounding > kWorse * choose(left, wanted, most).rounding)) return true;
  ahead_ = found_;
  std::swap(tried_, now_);
  now_.known = false;
  return false;
}

void SingularPassage::accept() {
  if (!now_.known) now_ = tried_;
  most_ = std::max(most_, now_.inverse);
  ahead_ = found_;
  std::swap(before_, last_);
  std::swap(last_, now_);
  tried_.known = tried_.known && tried_.t > before_.t;
  if (found_.t > last_.t) return;
  behind_ = found_.t;
  ahead_ = {};
  before_.known = tried_.known = false;
}

double SingularPassage::propose(double t, double wanted, double most) const {
  const double left = ahead_.t - t;
  if (!(left > 0) || left > (kPlanned + 1) * kStretch * wanted) return wanted;
  return choose(left, wanted, most).h;
}

bool SingularPassage::near(double t, double h) const {
  return ahead_.t - t < kNeighbours * h || t - behind_ < kNeighbours * h;
}

}  // namespace mbsopt
