// One body of a state, prepared for sensors: its Euler parameters and its frame with velocities.
#pragma once

#include "core/body/frame.hpp"

namespace mbsopt {

struct BodyAt {
  BodyState state;
  Frame frame;
};

// body: 0 is the ground; y = (q, v) of n bodies.
BodyAt body_at(const Eigen::VectorXd& y, int body);

void add_pull_back(const BodyAt& b, int body, const FrameBar& bar, double scale, Eigen::Ref<Eigen::VectorXd> y_bar);

}  // namespace mbsopt
