#include "core/mechanism/reaction_sensor.hpp"

#include "core/sensor/body_at.hpp"

namespace mbsopt {
namespace {

struct Loads {
  Vector3d F = Vector3d::Zero(), T = Vector3d::Zero();  // global; about the centre of mass, body axes
};

template <class P>
Vec<P::kRows> weights(const Constraint& c, const Eigen::VectorXd& lambda) {
  return c.factor * lambda.segment<P::kRows>(c.row);
}

Loads loads_on_body2(const MechanismData& d, const ReactionSensor& s, const Eigen::VectorXd& y,
                     const Eigen::VectorXd& lambda) {
  Loads loads;
  for (const Constraint& c : d.constraints) {
    if (c.joint != s.joint) continue;
    const BodyAt b1 = body_at(y, c.body1), b2 = body_at(y, c.body2);
    std::visit(
        [&]<class P>(const P& p) {
          Mat<P::kRows, 6> J1, J2;
          p.jacobian(b1.frame, b2.frame, J1, J2);
          const Vec<6> f = J2.transpose() * weights<P>(c, lambda);
          loads.F -= f.template head<3>();
          loads.T -= f.template tail<3>();
        },
        c.primitive);
  }
  return loads;
}

Vector3d measured(const ReactionSensor& s, const Loads& loads, const Matrix3d& A2) {
  if (!s.torque) return loads.F;
  return A2 * loads.T - (A2 * s.s2).cross(loads.F);
}

// -(lambda' J2 eta) with eta of body 2 in its frame and none of body 1: its gradient.
void add_pull_back_of_loads(const MechanismData& d, const ReactionSensor& s, const Eigen::VectorXd& y,
                            const Eigen::VectorXd& lambda, const Vec<6>& eta, double scale,
                            Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& lambda_bar,
                            Eigen::Ref<Eigen::VectorXd> rho_bar) {
  for (const Constraint& c : d.constraints) {
    if (c.joint != s.joint) continue;
    BodyAt b1 = body_at(y, c.body1), b2 = body_at(y, c.body2);
    set_virtual(Vec<6>::Zero(), b1.frame);
    set_virtual(eta, b2.frame);
    FrameBar bar1, bar2;
    bar1.set_zero(), bar2.set_zero();
    GeometryBar geometry;
    std::visit(
        [&]<class P>(const P& p) {
          Multipliers<P::kRows> z = Multipliers<P::kRows>::zero();
          z.lambda = -weights<P>(c, lambda);
          p.pull_back(b1.frame, b2.frame, z, bar1, bar2, geometry);
          const Vec<P::kRows> change = virtual_change(p, b1.frame, b2.frame);
          lambda_bar.segment<P::kRows>(c.row) -= scale * c.factor * change;
          add_slot<1>(d, c.slot_factor, Vec<1>(-lambda.segment<P::kRows>(c.row).dot(change)), scale, rho_bar);
        },
        c.primitive);
    fold_virtual(Vector3d::Zero(), bar1);
    fold_virtual(eta.tail<3>(), bar2);
    add_pull_back(b1, c.body1, bar1, scale, y_bar);
    add_pull_back(b2, c.body2, bar2, scale, y_bar);
    add_slot<3>(d, c.slot1, geometry.s1, scale, rho_bar);
    add_slot<3>(d, c.slot2, geometry.s2, scale, rho_bar);
    add_slot<3>(d, c.slot3, geometry.s3, scale, rho_bar);
  }
}

}  // namespace

double evaluate(const MechanismData& d, const ReactionSensor& s, const Eigen::VectorXd& y,
                const Eigen::VectorXd& lambda) {
  if (s.drive_row >= 0) return -lambda(s.drive_row);
  const Vector3d x = measured(s, loads_on_body2(d, s, y, lambda), body_at(y, s.body2).frame.A);
  return s.component == PointSensor::kNorm ? x.norm() : x(s.component);
}

double add_gradient(const MechanismData& d, const ReactionSensor& s, const Eigen::VectorXd& y,
                    const Eigen::VectorXd& lambda, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                    Eigen::VectorXd& lambda_bar, Eigen::Ref<Eigen::VectorXd> rho_bar) {
  if (s.drive_row >= 0) {
    lambda_bar(s.drive_row) -= scale;
    return -lambda(s.drive_row);
  }
  const BodyAt b2 = body_at(y, s.body2);
  const Matrix3d& A2 = b2.frame.A;
  const Loads loads = loads_on_body2(d, s, y, lambda);
  const Vector3d x = measured(s, loads, A2);
  const double result = s.component == PointSensor::kNorm ? x.norm() : x(s.component);
  Vector3d c = Vector3d::Unit(s.component % 3);
  if (s.component == PointSensor::kNorm) c = result > 0 ? Vector3d(x / result) : Vector3d(Vector3d::Zero());

  // c'x = F'eta_r + T'eta_theta with eta_r = c, or for a torque eta_theta = A2'c and eta_r = (A2 s2) x c
  Vec<6> eta = Vec<6>::Zero();
  if (s.torque) {
    eta << (A2 * s.s2).cross(c), A2.transpose() * c;
  } else {
    eta.head<3>() = c;
  }
  add_pull_back_of_loads(d, s, y, lambda, eta, scale, y_bar, lambda_bar, rho_bar);
  if (!s.torque) return result;
  // Through eta itself, with F and T fixed.
  const Vector3d arm_bar = c.cross(loads.F);
  FrameBar bar;
  bar.set_zero();
  bar.A = c * loads.T.transpose() + arm_bar * s.s2.transpose();
  add_pull_back(b2, s.body2, bar, scale, y_bar);
  add_slot<3>(d, s.slot_s2, Vec<3>(A2.transpose() * arm_bar), scale, rho_bar);
  return result;
}

}  // namespace mbsopt
