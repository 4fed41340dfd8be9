#include "core/cvodes/cvodes_newton.hpp"

#include "core/body/state_layout.hpp"

namespace mbsopt::cvodes {

NewtonMatrix::NewtonMatrix(Flow& flow)
    : flow_(flow),
      equations_(flow.dynamics()),
      jacobian_(flow.data()),
      values_(jacobian_.values()),
      system_(flow.data(), jacobian_) {
  y_.setZero(StateLayout{flow.data().n}.size());
}

bool NewtonMatrix::linearise(double t, const Flow::Numbers& y) {
  if (!flow_.linearise(t, y)) return false;
  y_ = y;
  equations_.place_at(t, y_, flow_.angles_at(t), flow_.ydot().tail(y_.size() / 2), flow_.dynamics().lambda());
  jacobian_.evaluate(equations_, values_);
  return true;
}

bool NewtonMatrix::factor(double gamma) { return system_.factor(gamma, values_); }

}  // namespace mbsopt::cvodes
