#include "core/integrate/linearised_stages.hpp"

#include <algorithm>

namespace mbsopt {

LinearisedStages::LinearisedStages(const MechanismData& data, const Method& method) : rk_(method), jacobian_(data) {
  values_.assign(static_cast<std::size_t>(largest_implicit_group(method)), jacobian_.values());
  std::vector<int> sizes;
  for (const StageGroup& g : method.stage_groups()) {
    if (is_implicit(method, g)) sizes.push_back(g.size());
  }
  std::sort(sizes.begin(), sizes.end());
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  for (const int stages : sizes) matrices_.emplace_back(data, jacobian_, stages);
}

StageMatrix& LinearisedStages::of(const StageGroup& group) {
  return *std::find_if(matrices_.begin(), matrices_.end(),
                       [&](const StageMatrix& m) { return m.stages() == group.size(); });
}

bool LinearisedStages::factor(double h, const StageGroup& g) {
  Eigen::MatrixXd P(g.size(), g.size());
  std::vector<const MotionJacobian::Values*> values;
  for (int i = 0; i < g.size(); ++i) {
    values.push_back(&values_[static_cast<std::size_t>(i)]);
    for (int j = 0; j < g.size(); ++j) P(i, j) = h * rk_.a(g.first + i, g.first + j);
  }
  return of(g).factor(P, values);
}

void LinearisedStages::solve(const StageGroup& g, Eigen::MatrixXd& x) {
  StageMatrix& N = of(g);
  N.solve(x.topRows(N.size()), StageMatrix::kExact);
}
void LinearisedStages::solve_transposed(const StageGroup& g, Eigen::MatrixXd& x) {
  StageMatrix& N = of(g);
  for (Eigen::Index first = 0; first < x.cols(); first += kLanes) {
    N.solve_transposed(x.block(0, first, N.size(), std::min<Eigen::Index>(kLanes, x.cols() - first)),
                       StageMatrix::kExact);
  }
}

long LinearisedStages::factorisations() const {
  long sum = 0;
  for (const StageMatrix& m : matrices_) sum += m.factorisations();
  return sum;
}

}  // namespace mbsopt
