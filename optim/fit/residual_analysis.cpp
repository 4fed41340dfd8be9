#include "optim/fit/residual_analysis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "optim/fit/distributions.hpp"

namespace mbsopt::inline optim {
namespace {

constexpr Eigen::Index kFewest = 10;

void count_runs(const Eigen::VectorXd& z, ResidualAnalysis& a) {
  double above = 0, below = 0;
  int last = 0;
  for (const double x : z) {
    const int sign = (x > 0) - (x < 0);
    if (sign == 0) continue;
    (sign > 0 ? above : below) += 1;
    if (sign != last) ++a.runs;
    last = sign;
  }
  const double n = above + below;
  if (n < kFewest) return;
  const double mean = 2 * above * below / n + 1, variance = (mean - 1) * (mean - 2) / (n - 1);
  if (variance > 0) {
    a.runs_z = (static_cast<double>(a.runs) - mean) / std::sqrt(variance);
    a.runs_p = 2 * normal_tail(std::abs(a.runs_z));
  } else {
    a.runs_p = 0;  // all of one sign
  }
}

}  // namespace

ResidualAnalysis analyse_residuals(const Eigen::VectorXd& z) {
  ResidualAnalysis a;
  const Eigen::Index n = z.size();
  a.samples = static_cast<std::size_t>(n);
  if (n == 0) return a;
  a.mean = z.mean();
  const Eigen::VectorXd e = z.array() - a.mean;
  const double sum = e.squaredNorm();
  if (n < kFewest || !(sum > 0) || !std::isfinite(sum)) return a;
  count_runs(z, a);
  a.lags = static_cast<int>(std::min<Eigen::Index>(10, n / 5));
  for (Eigen::Index k = 1; k <= a.lags; ++k) {
    const double r = e.head(n - k).dot(e.tail(n - k)) / sum;
    if (k == 1) a.autocorrelation = r;
    a.ljung_box += static_cast<double>(n * (n + 2)) * r * r / static_cast<double>(n - k);
  }
  a.ljung_box_p = chi_squared_tail(a.lags, a.ljung_box);
  return a;
}

std::string ResidualAnalysis::in_words() const {
  if (samples < static_cast<std::size_t>(kFewest)) return "too few to say";
  if (white()) return "white";
  if (ljung_box_p >= kSignificant) return runs_z < 0 ? "signs in long runs" : "signs alternate";
  return fmt::format("correlated in time (lag 1: {:.2f})", autocorrelation);
}

}  // namespace mbsopt::inline optim
