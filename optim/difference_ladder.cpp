#include "optim/difference_ladder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace mbsopt {

LadderDerivative difference_ladder(const std::function<std::optional<Eigen::VectorXd>(double h)>& f, Eigen::Index size,
                                   const LadderOptions& options) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double noise = std::max(options.noise, std::numeric_limits<double>::epsilon());
  LadderDerivative best;
  best.derivative.setZero(size);
  best.error.setConstant(size, kInfinity);
  best.rounding.setZero(size), best.step.setZero(size);
  std::vector<Eigen::VectorXd> above, row;  // rows j - 1 and j of T
  double h = options.step;
  for (int j = 0; j < options.rungs; ++j, h /= 2) {
    const std::optional<Eigen::VectorXd> plus = f(h), minus = f(-h);
    best.evaluations += 2;
    if (!plus || !minus) {
      above.clear();
      continue;
    }
    row.assign(1, (*plus - *minus) / (2 * h));
    double power = 4;
    for (std::size_t k = 1; k <= above.size(); ++k, power *= 4)
      row.push_back(row[k - 1] + (row[k - 1] - above[k - 1]) / (power - 1));
    const Eigen::ArrayXd rounding = noise * plus->cwiseAbs().cwiseMax(minus->cwiseAbs()).array() / h;
    for (std::size_t k = 0; k < row.size(); ++k) {
      for (Eigen::Index i = 0; i < size; ++i) {
        // A first difference has nothing to be compared with: its error is unknown, but it is better than nothing.
        const double spread =
            k == 0 ? std::numeric_limits<double>::max()
                   : std::max(std::abs(row[k](i) - row[k - 1](i)), std::abs(row[k](i) - above[k - 1](i)));
        const double error = std::max(spread, rounding(i));
        if (!(error < best.error(i))) continue;
        best.error(i) = error, best.derivative(i) = row[k](i);
        best.rounding(i) = rounding(i), best.step(i) = h;
      }
    }
    above = row;
  }
  return best;
}

}  // namespace mbsopt
