// A force at a point of a body, or a torque on a body. The caller evaluates its three components c: a user's
// expressions of t, parameters and sensors of the state.
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
  std::vector<int> parameters;        // used by the components
  std::vector<int> sensors;           // used by the components

  void add_load(const Vector3d& c, const Frame& f, Vec<6>& load) const;

  // Adds the gradient of the virtual work load'eta in the frame (eta held fixed) and the point. Returns that in c.
  Vector3d pull_back(const Vector3d& c, const Frame& f, FrameBar& bar, Eigen::VectorXd& theta_bar) const;

  // The tangent of the load. dc and ds are directions of c and s; a null ds is constant.
  void tangent(const Vector3d& c, const Lanes<3>& dc, const Frame& f, const FrameTangent& t, const Lanes<3>* ds,
               Lanes<6>& load) const;

 private:
  template <class F, class S, class Load>
  void add(const S& c, const F& f, const S& point, Load& load) const;  // the load, or its tangent
};

}  // namespace mbsopt
