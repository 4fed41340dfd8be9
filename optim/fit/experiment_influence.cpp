#include "optim/fit/experiment_influence.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <limits>
#include <utility>

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kSingular = 1e-12;  // of the largest pivot

}  // namespace

std::vector<VectorXd> changes_without(const ExperimentStack& stack, const LeastSquaresPoint& solution,
                                      const std::vector<UnknownParameter>& unknowns) {
  std::vector<Index> shared, number(unknowns.size(), -1);
  for (std::size_t k = 0; k < unknowns.size(); ++k)
    if (unknowns[k].shared) number[k] = static_cast<Index>(shared.size()), shared.push_back(static_cast<Index>(k));
  const Index n = static_cast<Index>(shared.size());
  const VectorXd w = stack.weights(solution.z).cwiseSqrt();

  struct Part {
    MatrixXd T;
    VectorXd p;
  };
  std::vector<Part> parts;
  MatrixXd S = MatrixXd::Zero(n, n);
  for (const Dependence& part : stack.parts) {  // those of the members first
    std::vector<Index> order, here;             // here: numbers of its shared variables
    for (const Index k : part.variables)
      if (number[static_cast<std::size_t>(k)] < 0) order.push_back(k);
    const Index own = static_cast<Index>(order.size());
    for (const Index k : part.variables)
      if (number[static_cast<std::size_t>(k)] >= 0)
        order.push_back(k), here.push_back(number[static_cast<std::size_t>(k)]);
    const Index columns = static_cast<Index>(order.size()), rows = static_cast<Index>(part.rows.size());
    MatrixXd J(rows, columns + 1);
    J.leftCols(columns) = w(part.rows).asDiagonal() * solution.z_x(part.rows, order);
    J.rightCols(1) = w(part.rows).cwiseProduct(solution.z(part.rows));
    const Eigen::HouseholderQR<MatrixXd> qr(std::move(J));
    const MatrixXd R = qr.matrixQR().topRows(std::min(rows, columns)).triangularView<Eigen::Upper>();
    const Index left = std::max<Index>(R.rows() - own, 0);
    Part& rest = parts.emplace_back(Part{MatrixXd::Zero(left, n), R.bottomRows(left).rightCols(1)});
    rest.T(Eigen::all, here) = R.bottomRows(left).middleCols(own, columns - own);
    S += rest.T.transpose() * rest.T;
  }

  std::vector<VectorXd> changes;
  for (std::size_t e = 0; e < stack.members().size(); ++e) {
    const Part& part = parts[e];
    VectorXd& change = changes.emplace_back(VectorXd::Zero(solution.z_x.cols()));
    // Columns of unit length, so that pivots compare.
    VectorXd scale = S.diagonal().cwiseSqrt();
    for (double& s : scale) s = s > 0 ? 1 / s : 1;
    const MatrixXd without = scale.asDiagonal() * (S - part.T.transpose() * part.T) * scale.asDiagonal();
    const Eigen::LDLT<MatrixXd> factors(without);
    if (n > 0 && factors.vectorD().minCoeff() > kSingular)
      change(shared) = scale.cwiseProduct(factors.solve(scale.cwiseProduct(part.T.transpose() * part.p)));
    else
      change(shared).setConstant(std::numeric_limits<double>::infinity());
  }
  return changes;
}

}  // namespace mbsopt
