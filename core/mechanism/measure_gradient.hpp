// What a gradient in a joint's angle or displacement and in its rate means for the state and the parameters.
#pragma once

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

// y_bar, rho_bar += the gradient of  x_bar x + rate_bar xdot;  b1, b2: the measure's bodies at y.
template <class P>
void add_measure_gradient(const MechanismData& data, const JointMeasure<P>& joint, const BodyAt& b1, const BodyAt& b2,
                          double x_bar, double rate_bar, Eigen::Ref<Eigen::VectorXd> y_bar,
                          Eigen::Ref<Eigen::VectorXd> rho_bar) {
  Multipliers<1> z = Multipliers<1>::zero();
  z.mu0(0) = x_bar, z.mu1(0) = rate_bar;
  FrameBar bar1, bar2;
  bar1.set_zero(), bar2.set_zero();
  GeometryBar s;
  joint.measure.pull_back(b1.frame, b2.frame, z, bar1, bar2, s);
  add_pull_back(b1, joint.body1, bar1, 1, y_bar);
  add_pull_back(b2, joint.body2, bar2, 1, y_bar);
  add_slot<3>(data, joint.slot1, s.s1, 1, rho_bar);
  add_slot<3>(data, joint.slot2, s.s2, 1, rho_bar);
  add_slot<3>(data, joint.slot3, s.s3, 1, rho_bar);
}

}  // namespace mbsopt
