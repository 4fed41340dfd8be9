// Bodies of a state, prepared for sensors: their Euler parameters and their frames with velocities.
#pragma once

#include <vector>

#include "core/body/frame.hpp"

namespace mbsopt {

struct BodyAt {
  BodyState state;
  Frame frame;
};

// body: 0 is the ground; y = (q, v) of n bodies.
BodyAt body_at(const Eigen::VectorXd& y, int body);

// All bodies of a state. They begin with the ground.
struct BodiesAt {
  explicit BodiesAt(const Eigen::VectorXd& y);
  BodyAt body(int k) const { return {states[at(k)], frames[at(k)]}; }
  std::vector<BodyState> states;
  std::vector<Frame> frames;
};

// y_bar += scale times a gradient in the frame.
void add_pull_back(const BodyAt& b, int body, const FrameBar& bar, double scale, Eigen::Ref<Eigen::VectorXd> y_bar);

}  // namespace mbsopt
