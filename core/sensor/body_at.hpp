// Bodies of a state, prepared for sensors: their frames with velocities.
#pragma once

#include <vector>

#include "core/body/frame.hpp"

namespace mbsopt {

// body: 0 is the ground; y = (q, v) of n bodies.
Frame body_at(const Eigen::VectorXd& y, int body);
std::vector<Frame> frames_at(const Eigen::VectorXd& y);  // all of them

// y_bar += scale times a gradient in the frame.
void add_pull_back(const Frame& b, int body, const FrameBar& bar, double scale, Eigen::Ref<Eigen::VectorXd> y_bar);

}  // namespace mbsopt
