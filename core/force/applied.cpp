#include "core/force/applied.hpp"

#include "core/body/dual_frame.hpp"

namespace mbsopt {

template <class F, class S, class Load>
void AppliedForce::add(const S& c, const F& f, const S& point, Load& load) const {
  using V = VectorOf<F>;
  if (is_torque) {
    load.template bottomRows<3>() += load_part(in_body_axes ? V(c) : in_body(f, V(c)));
  } else {
    add_force(f, point, in_body_axes ? in_space(f, c) : V(c), load);
  }
}
void AppliedForce::add_load(const Vector3d& c, const Frame& f, Vec<6>& load) const { add(c, f, s, load); }
void AppliedForce::tangent(const Vector3d& c, const Lanes<3>& dc, const Frame& f, const FrameTangent& t,
                           const Lanes<3>* ds, Lanes<6>& load) const {
  add(BodyVector{c, &dc}, DualFrame{f, t}, BodyVector{s, ds}, load);
}

Vector3d AppliedForce::pull_back(const Vector3d& c, const Frame& f, FrameBar& bar, Eigen::VectorXd& theta_bar) const {
  if (is_torque) {
    if (in_body_axes) return f.theta_eta;
    bar.A += c * f.theta_eta.transpose();
    return f.A * f.theta_eta;
  }
  const Vector3d F = in_body_axes ? Vector3d(f.A * c) : c, P_eta = f.point_eta(s);
  bar.A_eta += F * s.transpose();
  if (slot >= 0) theta_bar.segment<3>(slot) += f.A_eta.transpose() * F;
  if (!in_body_axes) return P_eta;
  bar.A += P_eta * c.transpose();
  return f.A.transpose() * P_eta;
}

}  // namespace mbsopt
