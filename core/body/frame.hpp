// A frame is a body as constraints, forces and sensors see it. It has the centre of mass r, the matrix A of the axes,
// and their first and second time derivatives. Every primitive is a smooth function of these. So its derivatives in (q,
// v) take two steps. The first leads to the frame. The second leads from the frame to (r, p) and (rdot, pdot) by the
// pull-backs below, once per body.
//
//   A = A(p)     Adot = B(p, pdot)     Addot = B(p, pddot) + 2 A(pdot)
//   pddot = 1/2 G(p)' omegadot - (pdot'pdot) p       (the unit-norm equation differentiated twice, solved by hand)
//
// A virtual displacement is (eta_r, eta_theta), eta_theta in body axes. It moves a body-fixed vector s by A
// skew(eta_theta) s and the Euler parameters by 1/2 G(p)' eta_theta. A frame carries p for drives of single
// coordinates.
#pragma once

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

// A body's own numbers at a state: q = (r, p), v = (rdot, pdot), z = (rddot, omegadot in body axes).
struct BodyState {
  Vector4d p{1, 0, 0, 0}, pdot = Vector4d::Zero();
  Vector3d omegadot = Vector3d::Zero();

  Vector3d omega() const;
};
Vector4d pddot_of(const BodyState& body);

struct Frame : BodyState {
  Vector3d r = Vector3d::Zero(), rdot = Vector3d::Zero(), rddot = Vector3d::Zero();
  Matrix3d A = Matrix3d::Identity(), Adot = Matrix3d::Zero(), Addot = Matrix3d::Zero();
  // The virtual displacement of the adjoint sweep; A_eta = A skew(eta_theta).
  Vector3d r_eta = Vector3d::Zero(), theta_eta = Vector3d::Zero();
  Matrix3d A_eta = Matrix3d::Zero();
  Vector4d pddot = Vector4d::Zero(), p_eta = Vector4d::Zero();

  Vector3d point(const Vector3d& s) const { return r + A * s; }
  Vector3d point_dot(const Vector3d& s) const { return rdot + Adot * s; }
  Vector3d point_ddot(const Vector3d& s) const { return rddot + Addot * s; }
  Vector3d point_eta(const Vector3d& s) const { return r_eta + A_eta * s; }
};

// Gradient of a scalar with respect to the entries of a Frame. rddot, r_eta and theta_eta are held fixed.
struct FrameBar {
  Vector3d r, rdot;
  Matrix3d A, Adot, Addot, A_eta;
  Vector4d p, pdot, pddot, p_eta;
  void set_zero();
  static FrameBar zero() {
    FrameBar bar;
    bar.set_zero();
    return bar;
  }
};

// The tangent of a Frame in kLanes directions. Matrices are stored entry by entry: row 3 i + j holds entry (i, j).
struct FrameTangent {
  Lanes<3> r, rdot;
  Lanes<9> A, Adot, Addot;
  Lanes<4> p, pdot, pddot;
  bool still = false;  // all of it is zero (set_zero): products with it may be left out
  void set_zero();
  static FrameTangent zero() {
    FrameTangent t;
    t.set_zero();
    return t;
  }
};
inline const FrameTangent kStill = FrameTangent::zero();

void set_position(const Eigen::Ref<const Vec<7>>& q, Frame& frame);
void set_velocity(const Eigen::Ref<const Vec<7>>& v, Frame& frame);
void set_acceleration(const Vec<6>& z, Frame& frame);
void set_virtual(const Vec<6>& eta, Frame& frame);

// T'w with T = da/dz: the cotangent of z = (rddot, omegadot) for w, that of a = (rddot, pddot).
Vec<6> to_virtual(const BodyState& body, const Vec<7>& w);

// Moves the cotangents of A_eta and p_eta, the images of the virtual displacement, to A and p; eta_theta is held fixed.
void fold_virtual(const Vector3d& eta_theta, FrameBar& bar);

// Pull-back of a gradient in (r, A, p) to q. [7]
Vec<7> pull_back_position(const BodyState& body, const FrameBar& bar);

// Pull-back of a gradient in (r, rdot, A, Adot, p, pdot) to q and v.
void add_pull_back_velocity(const BodyState& body, const FrameBar& bar, double scale, Eigen::Ref<Vec<7>> q_bar,
                            Eigen::Ref<Vec<7>> v_bar);

// The full pull-back of the adjoint sweep. `w_p` is the cotangent of pddot itself, eta_theta the virtual rotation. The
// accelerations z are held fixed: the adjoint system solves for its cotangent.
void add_pull_back(const BodyState& body, FrameBar bar, const Vector4d& w_p, const Vector3d& eta_theta,
                   Eigen::Ref<Vec<7>> q_bar, Eigen::Ref<Vec<7>> v_bar);

// Tangent of the frame for directions (q', v') with z held fixed; and of pddot alone.
void set_tangent(const BodyState& body, const Lanes<7>& q_dir, const Lanes<7>& v_dir, FrameTangent& out);
Lanes<4> pddot_tangent(const BodyState& body, const Lanes<4>& p_dir, const Lanes<4>& pdot_dir);

// Tangents of the frame in each coordinate of r, p, rdot, pdot in turn; r and rdot use three lanes.
struct UnitTangents {
  FrameTangent r, p, rdot, pdot;
};
void set_unit_tangents(const BodyState& body, UnitTangents& out);

}  // namespace mbsopt
