#include "core/sensor/body_at.hpp"

namespace mbsopt {

BodyAt body_at(const Eigen::VectorXd& y, int body) {
  BodyAt b;
  if (body == 0) return b;
  set_position(y.segment<7>(7 * (body - 1)), b.state, b.frame);
  set_velocity(y.segment<7>(y.size() / 2 + 7 * (body - 1)), b.state, b.frame);
  return b;
}

void add_pull_back(const BodyAt& b, int body, const FrameBar& bar, double scale, Eigen::Ref<Eigen::VectorXd> y_bar) {
  if (body == 0) return;
  add_pull_back_velocity(b.state, bar, scale, y_bar.segment<7>(7 * (body - 1)),
                         y_bar.segment<7>(y_bar.size() / 2 + 7 * (body - 1)));
}

}  // namespace mbsopt
