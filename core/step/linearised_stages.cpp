#include "core/step/linearised_stages.hpp"

#include <algorithm>

namespace mbsopt {

LinearisedStages::LinearisedStages(const MechanismData& data, const Method& method, SpatialDynamics& dynamics)
    : rk_(method), equations_(dynamics), jacobian_(data) {
  values_.assign(at(largest_implicit_group(method)), jacobian_.values());
  for (const StageGroup& g : method.stage_groups()) {
    if (!is_implicit(method, g) || of(g) < matrices_.size()) continue;
    matrices_.emplace_back(data, jacobian_, g.size());
    A_.push_back(Eigen::MatrixXd::Zero(g.size(), g.size()));
  }
}

StageEquations& LinearisedStages::place_at(const Step& step, int i) {
  y_ = step.Y.col(i);
  equations_.place_at(step.t + rk_.c[i] * step.h, y_, step.angles0, step.K.col(i).tail(y_.size() / 2),
                      step.lambda.col(i));
  return equations_;
}

StageEquations& LinearisedStages::linearise(const Step& step, int stage, int k) {
  jacobian_.evaluate(place_at(step, stage), values_[at(k)]);
  return equations_;
}

std::size_t LinearisedStages::of(const StageGroup& group) const {
  std::size_t k = 0;
  while (k < matrices_.size() && matrices_[k].stages() != group.size()) ++k;
  return k;
}

bool LinearisedStages::factor(double h, const StageGroup& g) {
  Eigen::MatrixXd& A = A_[of(g)];
  for (int i = 0; i < g.size(); ++i) {
    for (int j = 0; j < g.size(); ++j) A(i, j) = rk_.a(g.first + i, g.first + j);
  }
  return matrices_[of(g)].factor(h, A, std::span(values_).first(at(g.size())), StageMatrix::Trial::by_solutions);
}

void LinearisedStages::solve(const StageGroup& g, Eigen::MatrixXd& x) {
  StageMatrix& N = matrices_[of(g)];
  N.solve(x.topRows(N.size()), StageMatrix::kExact);
}
void LinearisedStages::solve_transposed(const StageGroup& g, Eigen::MatrixXd& x) {
  StageMatrix& N = matrices_[of(g)];
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
