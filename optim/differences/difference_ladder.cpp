#include "optim/differences/difference_ladder.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace mbsopt::inline optim {
namespace {

// One rung: the difference quotient, and the largest values in it.
struct Rung {
  Eigen::VectorXd quotient, largest;
};

// base is b of the extrapolation. evaluations counts those of f in a rung.
template <class RungAt>
LadderDerivative climb(const RungAt& rung_at, Eigen::Index size, double base, double amplification, int evaluations,
                       const LadderOptions& options) {
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  const double noise = amplification * std::max(options.noise, std::numeric_limits<double>::epsilon());
  LadderDerivative best;
  best.derivative.setZero(size);
  best.error.setConstant(size, kUnbounded);
  best.rounding.setZero(size);
  best.step.setZero(size);
  best.largest.setZero(size);
  std::vector<Eigen::VectorXd> above, row;  // rows j - 1 and j of T
  double h = options.step;
  for (int j = 0; j < options.rungs; ++j, h /= 2) {
    const std::optional<Rung> rung = rung_at(h);
    best.evaluations += evaluations;
    if (!rung) {
      above.clear();
      continue;
    }
    row.assign(1, rung->quotient);
    double power = base;
    for (std::size_t k = 1; k <= above.size(); ++k, power *= base)
      row.push_back(row[k - 1] + (row[k - 1] - above[k - 1]) / (power - 1));
    const Eigen::ArrayXd rounding = noise * rung->largest.array() / std::abs(h);
    for (std::size_t k = 0; k < row.size(); ++k) {
      for (Eigen::Index i = 0; i < size; ++i) {
        // The first difference has nothing to compare with: its error is unknown, but it is better than nothing.
        const double spread =
            k == 0 ? std::numeric_limits<double>::max()
                   : std::max(std::abs(row[k](i) - row[k - 1](i)), std::abs(row[k](i) - above[k - 1](i)));
        const double error = std::max(spread, rounding(i));
        if (!(error < best.error(i))) continue;
        best.error(i) = error;
        best.derivative(i) = row[k](i);
        best.rounding(i) = rounding(i);
        best.step(i) = std::abs(h);
        best.largest(i) = std::ldexp(std::abs(h), static_cast<int>(k));
      }
    }
    above = row;
    if (options.enough && row.size() > 1 && options.enough(best)) break;
  }
  return best;
}

}  // namespace

void LadderDerivative::take_better(const LadderDerivative& other) {
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    if (!(other.error(i) < error(i))) continue;
    derivative(i) = other.derivative(i);
    error(i) = other.error(i);
    rounding(i) = other.rounding(i);
    step(i) = other.step(i);
    largest(i) = other.largest(i);
  }
}

LadderDerivative difference_ladder(const LadderFunction& f, Eigen::Index size, const LadderOptions& options) {
  const auto rung_at = [&](double h) -> std::optional<Rung> {
    const std::optional<Eigen::VectorXd> plus = f(h), minus = f(-h);
    if (!plus || !minus) return std::nullopt;
    return Rung{(*plus - *minus) / (2 * h), plus->cwiseAbs().cwiseMax(minus->cwiseAbs())};
  };
  return climb(rung_at, size, 4, 1, 2, options);
}

LadderDerivative one_sided_ladder(const LadderFunction& f, const Eigen::VectorXd& f0, const LadderOptions& options) {
  constexpr double kAmplification = 8.3;
  const auto rung_at = [&](double h) -> std::optional<Rung> {
    const std::optional<Eigen::VectorXd> there = f(h);
    if (!there) return std::nullopt;
    return Rung{(*there - f0) / h, there->cwiseAbs().cwiseMax(f0.cwiseAbs())};
  };
  return climb(rung_at, f0.size(), 2, kAmplification, 1, options);
}

}  // namespace mbsopt::inline optim
