#include "core/integrate/singular_passage.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mbsopt {
namespace {

constexpr double kUncertain = 0.05;  // of theta, when it is chosen
constexpr double kWorse = 30;        // than at the best theta, and a step is tried again
constexpr double kStretch = 1.1;     // a step may grow so much to be placed well,
constexpr double kLeast = 0.1;       // or shrink
constexpr double kPole = 0.3;        // an inverse response below so much of the largest tells that a pole is near
constexpr double kNeighbours = 3;    // steps from t*

}  // namespace

double SingularPassage::best_theta() {
  if (best_theta_ > 0) return best_theta_;
  for (double theta = 0.3; theta < 0.9; theta += 0.01) {
    double now = 0;
    for (const double off : {-1.0, -0.5, 0.0, 0.5, 1.0}) now = std::max(now, magnified(theta + off * kUncertain));
    if (now < least_) least_ = now, best_theta_ = theta;
  }
  return best_theta_;
}

double SingularPassage::magnified(double theta) const {
  double k[Method::kMaxStages], most = 0;
  for (const double to : {theta, theta - 1}) {
    for (int i = 0; i < rk_.stages; ++i) {
      double u = 1 / std::abs(to);
      for (int j = 0; j < i; ++j) u += rk_.a(i, j) * k[j];
      k[i] = 2 * u / (to - rk_.c[i]);
      most = std::max(most, std::abs(k[i] / (to - rk_.c[i])));
    }
  }
  return most;
}

void SingularPassage::forget() {
  last_.known = false;
  most_ = 0;
  ahead_ = kNone, behind_ = -kNone;
}

bool SingularPassage::well_placed(double t, double h, const Eigen::VectorXd& response) {
  // The response grows as 1/d^3.
  now_.t = t + h, now_.response = response, now_.known = true;
  now_.inverse = 1 / std::cbrt(std::max(response.norm(), 1e-300));
  found_ = kNone;
  if (!last_.known) return true;
  const double most = std::max(most_, now_.inverse);
  if (std::min(last_.inverse, now_.inverse) > kPole * most) return true;
  // 1/inverse^3 = 1/most^3 + 1/d^3
  const auto distance = [most](double inverse) { return inverse / std::cbrt(1.001 - std::pow(inverse / most, 3)); };
  const double d0 = distance(last_.inverse), d1 = std::copysign(distance(now_.inverse), last_.response.dot(response));
  if (d1 >= d0) return true;
  const double theta = d0 / (d0 - d1), best = best_theta();
  found_ = t + h * theta;
  if (theta < 1 ? magnified(theta) < kWorse * least_ : theta > 1 + 0.5 * best) return true;
  ahead_ = found_;
  return false;
}

void SingularPassage::accept() {
  most_ = std::max(most_, now_.inverse);
  ahead_ = kNone;
  if (found_ > now_.t) {
    ahead_ = found_;
  } else {
    behind_ = found_;
  }
  std::swap(last_, now_);
}

double SingularPassage::propose(double t, double h) const {
  const double left = ahead_ - t;
  if (!(left > 0) || left >= (1 + best_theta_) * h) return h;
  // Past it in this step, or in the next one of the same size.
  if (left > kStretch * best_theta_ * h) return left / (1 + best_theta_);
  return std::max(left / best_theta_, kLeast * h);
}

bool SingularPassage::near(double t, double h) const {
  return ahead_ - t < kNeighbours * h || t - behind_ < kNeighbours * h;
}

}  // namespace mbsopt
