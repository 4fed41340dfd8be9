#include "core/sensor/body_at.hpp"

#include "core/body/state_layout.hpp"

namespace mbsopt {

Frame body_at(const Eigen::VectorXd& y, int body) {
  Frame frame;
  if (body == 0) return frame;
  const StateLayout layout = StateLayout::of(y);
  set_position(y.segment<7>(layout.q(body)), frame);
  set_velocity(y.segment<7>(layout.v(body)), frame);
  return frame;
}

std::vector<Frame> frames_at(const Eigen::VectorXd& y) {
  std::vector<Frame> frames;
  for (int body = 0; body <= StateLayout::of(y).n; ++body) frames.push_back(body_at(y, body));
  return frames;
}

void add_pull_back(const Frame& b, int body, const FrameBar& bar, double scale, Eigen::Ref<Eigen::VectorXd> y_bar) {
  if (body == 0) return;
  const StateLayout layout = StateLayout::of(y_bar);
  add_pull_back_velocity(b, bar, scale, y_bar.segment<7>(layout.q(body)), y_bar.segment<7>(layout.v(body)));
}

}  // namespace mbsopt
