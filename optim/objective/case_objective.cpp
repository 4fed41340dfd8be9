#include "optim/objective/case_objective.hpp"

#include <algorithm>
#include <cmath>

namespace mbsopt::inline optim {

using Eigen::MatrixXd;
using Eigen::VectorXd;

CaseObjective::CaseObjective(const std::vector<CaseSpec>& cases, const DesignSpec& design)
    : takes_largest_(!design.largest_of.empty()) {
  const std::vector<WeightedObjective> terms = design.terms();
  const Eigen::Index n = static_cast<Eigen::Index>(terms.size());
  a_.resize(n);
  for (Eigen::Index k = 0; k < n; ++k) a_(k) = terms[static_cast<std::size_t>(k)].weight;
  w_ = a_.replicate(std::max<Eigen::Index>(1, static_cast<Eigen::Index>(cases.size())), 1);
  for (std::size_t c = 0; c < cases.size(); ++c) w_.segment(static_cast<Eigen::Index>(c) * n, n) *= cases[c].weight;
  if (takes_largest_ || (cases.size() > 1 && design.over == "max")) k_ = design.sharpness.value_or(INFINITY);
}

double CaseObjective::of_case(const VectorXd& psi, Eigen::Index load_case) const {
  const VectorXd x = a_.cwiseProduct(psi.segment(load_case * a_.size(), a_.size()));
  return takes_largest_ ? x.maxCoeff() : x.sum();
}

// exp(k (x_c - largest)), divided by their sum
VectorXd CaseObjective::shares(const VectorXd& x) const {
  Eigen::Index top = 0;
  x.maxCoeff(&top);
  if (is_true_maximum()) return VectorXd::Unit(x.size(), top);
  const VectorXd e = (k_ * (x.array() - x.maxCoeff())).exp();
  return e / e.sum();
}

double CaseObjective::value(const VectorXd& psi) const {
  const VectorXd x = w_.cwiseProduct(psi);
  if (!is_maximum()) return x.sum();
  const double largest = x.maxCoeff();
  if (is_true_maximum()) return largest;
  return largest + std::log((k_ * (x.array() - largest)).exp().sum()) / k_;
}

VectorXd CaseObjective::gradient(const VectorXd& psi) const {
  if (!is_maximum()) return w_;
  return w_.cwiseProduct(shares(w_.cwiseProduct(psi)));
}

MatrixXd CaseObjective::hessian(const VectorXd& psi) const {
  if (!is_maximum() || is_true_maximum()) return MatrixXd::Zero(w_.size(), w_.size());
  const VectorXd p = shares(w_.cwiseProduct(psi));
  const MatrixXd H = k_ * (MatrixXd(p.asDiagonal()) - p * p.transpose());
  return w_.asDiagonal() * H * w_.asDiagonal();
}

double CaseObjective::true_value(const VectorXd& psi) const {
  const VectorXd x = w_.cwiseProduct(psi);
  return is_maximum() ? x.maxCoeff() : x.sum();
}

}  // namespace mbsopt::inline optim
