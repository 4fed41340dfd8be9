#include "core/step/step.hpp"

namespace mbsopt {

Step make_step(const Mechanism& mechanism, const Method& rk, ProjectionSolution projection) {
  Step s;
  const MechanismData& d = mechanism.data();
  const Eigen::Index states = mechanism.states(), angles = static_cast<Eigen::Index>(d.angles.size());
  for (Eigen::VectorXd* x : {&s.y0, &s.y_hat, &s.y1}) x->setZero(states);
  for (Eigen::VectorXd* x : {&s.angles0, &s.angles1}) x->setZero(angles);
  s.Y.setZero(states, rk.dense_stages);
  s.K.setZero(states, rk.dense_stages);
  s.lambda.setZero(d.m, rk.dense_stages);
  s.projection = std::move(projection);
  return s;
}

}  // namespace mbsopt
