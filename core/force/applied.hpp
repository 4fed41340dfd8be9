// A force at a point of a body, or a torque on a body; its three components c are a user's expressions of t, parameters
// and sensors of the state, evaluated by the caller.
//   force    F = c, or A c in the body's axes       virtual work  F'(r_eta + A_eta s)             [N]
//   torque   T = c, or A c in the body's axes       virtual work  (A'T)'theta_eta, or c'theta_eta   [N m]
// Loads: the force in global axes, the moment about the centre of mass in body axes.
#pragma once

#include <array>
#include <vector>

#include "core/body/frame.hpp"
#include "core/expression/program.hpp"

namespace mbsopt {

struct AppliedForce {
  int force = 0;  // index in the scene
  int body = 0;
  bool is_torque = false, in_body_axes = false;
  Vector3d s = Vector3d::Zero();  // the point, from the centre of mass, body axes [m]
  int slot = -1;
  std::array<Program, 3> components;  // inputs: all parameters, t, all sensors of the scene
  std::vector<int> parameters;        // that the components use
  std::vector<int> sensors;           // the same

  void add_load(const Vector3d& c, const Frame& f, Vec<6>& load) const {
    if (is_torque) {
      load.tail<3>() += in_body_axes ? c : Vector3d(f.A.transpose() * c);
      return;
    }
    const Vector3d F = in_body_axes ? Vector3d(f.A * c) : c;
    load.head<3>() += F;
    load.tail<3>() += s.cross(f.A.transpose() * F);
  }

  // Gradient of the virtual work load'eta in the frame (eta held fixed) and the point; returns that in c.
  Vector3d pull_back(const Vector3d& c, const Frame& f, FrameBar& bar, Eigen::VectorXd& theta_bar) const {
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

  // Tangent of the load; dc, ds: directions of c and s (null: constant).
  void tangent(const Vector3d& c, const Lanes<3>& dc, const Frame& f, const FrameTangent& t, const Lanes<3>* ds,
               Lanes<6>& load) const {
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
};

}  // namespace mbsopt
