#include "core/dynamics/residual_watch.hpp"

#include <bit>
#include <cmath>

#include "core/body/state_layout.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/planar_model.hpp"

namespace mbsopt {

ResidualWatch::ResidualWatch(const MechanismData& data, Model model) : n_(data.n) {
  if (!(data.forces.empty() && data.applied.empty() && data.user_forces.empty())) return;
  if (std::none_of(data.bodies.begin() + 1, data.bodies.end(), [](auto& b) { return b.mass > 0; })) return;
  free_fall_ = model == Model::planar ? std::sqrt(squared_norm(data.planar->gravity)) : data.gravity.norm();
}

// The acceleration that a body's turning takes.
double ResidualWatch::turning(const Eigen::VectorXd& y, int body) const {
  const StateLayout layout{n_};
  const double omega = 2 * y.segment<4>(layout.pdot(body)).norm();
  return omega * (omega + y.segment<3>(layout.v(body)).norm());
}

// Where nothing accelerates (a wheel driven at constant speed) what is left is rounding. The sweep over all bodies is
// left out where one of them says that the residual is no larger than those before.
bool ResidualWatch::expected(double size, const Eigen::VectorXd& y) const {
  constexpr double kRounding = 1e-9;
  return size <= (1 + kRounding) * worst_ * std::max(free_fall_, n_ > 0 ? turning(y, fastest_) : 0.0);
}

// The fastest body is looked for ever more rarely: loads may be more than any turning.
void ResidualWatch::add(double residual, const Eigen::VectorXd& y) {
  worst_ = std::max(worst_, residual);
  if (!std::has_single_bit(++added_)) return;
  double largest = 0;
  for (int i = 1; i <= n_; ++i) {
    if (turning(y, i) > largest) largest = turning(y, i), fastest_ = i;
  }
}

}  // namespace mbsopt
