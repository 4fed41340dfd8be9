#include "core/force/applied.hpp"

#include "core/body/lanes.hpp"

namespace mbsopt {

void AppliedForce::add_load(const Vector3d& c, const Frame& f, Vec<6>& load) const {
  if (is_torque) {
    load.tail<3>() += in_body_axes ? c : Vector3d(f.A.transpose() * c);
    return;
  }
  const Vector3d F = in_body_axes ? Vector3d(f.A * c) : c;
  load.head<3>() += F;
  load.tail<3>() += s.cross(f.A.transpose() * F);
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

void AppliedForce::tangent(const Vector3d& c, const Lanes<3>& dc, const Frame& f, const FrameTangent& t,
                           const Lanes<3>* ds, Lanes<6>& load) const {
  if (is_torque) {
    load.bottomRows<3>() += in_body_axes ? dc : Lanes<3>(transposed_times(t.A, c) + f.A.transpose() * dc);
    return;
  }
  const Vector3d F = in_body_axes ? Vector3d(f.A * c) : c;
  const Lanes<3> dF = in_body_axes ? Lanes<3>(times(t.A, c) + f.A * dc) : dc;
  load.topRows<3>() += dF;
  load.bottomRows<3>() += cross(s, transposed_times(t.A, F) + f.A.transpose() * dF);
  if (ds) load.bottomRows<3>() -= cross(f.A.transpose() * F, *ds);
}

}  // namespace mbsopt
