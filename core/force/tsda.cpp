#include "core/force/tsda.hpp"

#include <algorithm>

#include "core/constraint/body_vector.hpp"

namespace mbsopt {

SpringSpan<Vector3d> TsdaForce::span(const Frame& f1, const Frame& f2) const {
  return {f2.point(s2) - f1.point(s1), f2.point_dot(s2) - f1.point_dot(s1)};
}

Law::Point TsdaForce::measured(const Eigen::VectorXd&, const Frame& f1, const Frame& f2) const {
  const SpringSpan<Vector3d> x = span(f1, f2);
  return {x.l, x.ldot};
}

// Adds the gradient of a scalar, given that in the separation.
void TsdaForce::add_point_bars(const MovedJet<Vector3d>& bar, const Frame& f1, const Frame& f2, FrameBar& bar1,
                               FrameBar& bar2, auto&& fields) const {
  Vector3d s1_bar = Vector3d::Zero(), s2_bar = Vector3d::Zero();
  add_point_bar(f2, s2, bar, 1, bar2, s2_bar);
  add_point_bar(f1, s1, bar, -1, bar1, s1_bar);
  fields.template add<3>(slot1, s1_bar);
  fields.template add<3>(slot2, s2_bar);
}

void TsdaForce::pull_back_measured(const Frame& f1, const Frame& f2, double x_bar, double xdot_bar, FrameBar& bar1,
                                   FrameBar& bar2, FieldGradient& fields) const {
  const SpringSpan<Vector3d> x = span(f1, f2);
  // l_d = u,  (ldot)_d = (ddot - ldot u)/l,  (ldot)_ddot = u; a spring of zero length has no direction
  const Vector3d ddot_bar = xdot_bar * x.u;
  Vector3d d_bar = x_bar * x.u;
  if (x.l > 0) d_bar += xdot_bar * (x.ddot - x.ldot * x.u) / x.l;
  add_point_bars({{d_bar, ddot_bar, Vector3d::Zero()}, Vector3d::Zero()}, f1, f2, bar1, bar2, fields);
}

void TsdaForce::add_load(const ForceInputs& in, const Frame& f1, const Frame& f2, Vec<6>& load1, Vec<6>& load2) const {
  const SpringSpan<Vector3d> x = span(f1, f2);
  const Vector3d F = law.value(in.t, in.rho, x.l, x.ldot, in.scratch) * x.u;
  add_force(f1, s1, F, load1);
  add_force(f2, s2, Vector3d(-F), load2);
}

void TsdaForce::pull_back(const ForceInputs& in, const Frame& f1, const Frame& f2, FrameBar& bar1, FrameBar& bar2,
                          Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const {
  const SpringSpan<Vector3d> x = span(f1, f2);
  const Vector3d d_eta = f2.point_eta(s2) - f1.point_eta(s1);
  const std::optional<VectorJet> bar = work_bar(in.t, in.rho, x, d_eta, in.scratch, theta_bar, rho_bar);
  if (bar) add_point_bars(*bar, f1, f2, bar1, bar2, ThetaGradient{theta_bar});
}

Law::Value TsdaForce::at(const ForceInputs& in, const Frame& f1, const Frame& f2) const {
  const SpringSpan<Vector3d> x = span(f1, f2);
  return law.derivatives(in.t, in.rho, x.l, x.ldot, in.scratch);
}

void TsdaForce::tangent(const Law::Value& f, const Frame& f1, const Frame& f2, const FrameTangent& t1,
                        const FrameTangent& t2, const FieldLanes& dir, Lanes<6>& load1, Lanes<6>& load2) const {
  const DualFrame g1{f1, t1}, g2{f2, t2};
  const BodyVector v1{s1, dir.s1}, v2{s2, dir.s2};
  const Jet<DualVector> d = separation(g1, g2, v1, v2);
  const Jet<Dual> l = length(d);
  if (l.x == 0 && !is_k_times_d()) return;
  const Dual tension = dual(f.f, dir.f + f.f_x * lanes(l.x) + f.f_xdot * lanes(l.xd));
  const DualVector F = l.x == 0 ? law.k * d.x : tension * direction(d.x, l.x);
  add_force(g1, v1, F, load1);
  add_force(g2, v2, -F, load2);
}

void TsdaForce::add_field_tangent(const ForceInputs& in, const ParameterBlock& block, const Frame& f1, const Frame& f2,
                                  Lanes<6>& load1, Lanes<6>& load2) const {
  FieldLanes dir;
  Lanes<3> s1_dir, s2_dir;
  dir.s1 = block.field<3>(slot1, s1_dir);
  dir.s2 = block.field<3>(slot2, s2_dir);
  if (!law.moves(block) && !dir.s1 && !dir.s2) return;
  const Law::Value f = at(in, f1, f2);
  Lanes<4> fields;
  dir.f = law.field_tangent(
      measured(in.angles, f1, f2), block.field<4>(law.slot, fields), [&](int k) { return block.direction(k); },
      in.scratch);
  tangent(f, f1, f2, kStill, kStill, dir, load1, load2);
}

double TsdaForce::potential(const Eigen::VectorXd&, const Frame& f1, const Frame& f2) const {
  return law.potential(span(f1, f2).l);
}

void TsdaForce::pull_back_potential(const Eigen::VectorXd&, const Frame& f1, const Frame& f2, FrameBar& bar1,
                                    FrameBar& bar2, FieldGradient& fields) const {
  const double l = span(f1, f2).l;
  pull_back_measured(f1, f2, law.potential_slope(l), 0, bar1, bar2, fields);
  fields.add<4>(law.slot, law.potential_gradient(l));
}

double TsdaForce::natural_energy(const Frame& f1, const Frame& f2) const {
  const double l = span(f1, f2).l;
  return law.k * std::max(l * l, law.x0 * law.x0);
}

}  // namespace mbsopt
