#include "core/sensor/body_at.hpp"

#include "core/body/state_layout.hpp"

namespace mbsopt {

BodyAt body_at(const Eigen::VectorXd& y, int body) {
  BodyAt b;
  if (body == 0) return b;
  const StateLayout layout = StateLayout::of(y);
  set_position(y.segment<7>(layout.q(body)), b.frame);
  set_velocity(y.segment<7>(layout.v(body)), b.frame);
  b.state = b.frame;
  return b;
}

BodiesAt::BodiesAt(const Eigen::VectorXd& y) {
  const StateLayout layout = StateLayout::of(y);
  states.resize(at(layout.n) + 1);
  frames.resize(states.size());
  for (std::size_t k = 1; k < states.size(); ++k) {
    set_position(y.segment<7>(layout.q(k)), frames[k]);
    set_velocity(y.segment<7>(layout.v(k)), frames[k]);
    states[k] = frames[k];
  }
}

void add_pull_back(const BodyAt& b, int body, const FrameBar& bar, double scale, Eigen::Ref<Eigen::VectorXd> y_bar) {
  if (body == 0) return;
  const StateLayout layout = StateLayout::of(y_bar);
  add_pull_back_velocity(b.state, bar, scale, y_bar.segment<7>(layout.q(body)), y_bar.segment<7>(layout.v(body)));
}

}  // namespace mbsopt
