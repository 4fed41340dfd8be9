#include "core/dynamics/assembly_equations.hpp"

#include <cmath>

#include "core/constraint/unit_norm.hpp"
#include "core/sensor/body_at.hpp"

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// y = (q, e_j)
VectorXd with_unit_velocity(const VectorXd& y, Index j) {
  VectorXd at = y;
  at.tail(y.size() / 2).setZero();
  at(y.size() / 2 + j) = 1;
  return at;
}

// The components of a norm of velocities, which alone is not linear in v; empty for every other sensor.
std::vector<SensorKind> components_of_norm(const SensorKind& kind) {
  std::vector<SensorKind> components;
  auto split = [&](auto sensor) {
    for (sensor.component = 0; sensor.component < 3; ++sensor.component) components.emplace_back(sensor);
  };
  if (const auto* p = std::get_if<PointSensor>(&kind)) {
    if (p->quantity == PointSensor::Quantity::velocity && p->component == PointSensor::kNorm) split(*p);
  } else if (const auto* w = std::get_if<AngularVelocitySensor>(&kind)) {
    if (w->component == AngularVelocitySensor::kNorm) split(*w);
  }
  return components;
}

template <class P>
Multipliers<P::kRows> only_mu0(const Vec<P::kRows>& mu0) {
  Multipliers<P::kRows> z;
  z.lambda.setZero(), z.mu1.setZero(), z.mu2.setZero();
  z.mu0 = mu0;
  return z;
}
template <class P>
Multipliers<P::kRows> only_mu1(const Vec<P::kRows>& mu1) {
  Multipliers<P::kRows> z;
  z.lambda.setZero(), z.mu0.setZero(), z.mu2.setZero();
  z.mu1 = mu1;
  return z;
}

struct PrimitiveBars {
  FrameBar bar1, bar2;
  Vector3d s1 = Vector3d::Zero(), s2 = Vector3d::Zero();
  PrimitiveBars() { bar1.set_zero(), bar2.set_zero(); }
};

BodyAt at_rest(const VectorXd& y, int body) {
  BodyAt b;
  if (body > 0) set_position(y.segment<7>(7 * (body - 1)), b.state, b.frame);
  return b;
}

// The part of a pull-back that lies in q.
void add_to_row(const BodyAt& b, int body, const FrameBar& bar, AssemblyEquations::Row row) {
  if (body == 0) return;
  Vec<7> q_bar = Vec<7>::Zero(), v_bar = Vec<7>::Zero();
  add_pull_back_velocity(b.state, bar, 1, q_bar, v_bar);
  row.segment<7>(7 * (body - 1)) += q_bar.transpose();
}

}  // namespace

AssemblyEquations::AssemblyEquations(const MechanismData& data, AssemblyLevel level, double t)
    : data_(data), level_(level), t_(t) {
  for (std::size_t i = 0; i < data.conditions.size(); ++i) {
    const ConditionData& c = data.conditions[i];
    const SensorKind& sensor = data.sensors[static_cast<std::size_t>(c.sensor)];
    const int index = static_cast<int>(i);
    if (level == AssemblyLevel::position) {
      if (c.has_value && !c.velocity_level) {
        targets_.push_back({index, sensor, c.rate_kind, c.value, c.slot_value, c.value});
      }
    } else if (c.velocity_level) {
      if (c.has_value) targets_.push_back({index, sensor, sensor, c.value, c.slot_value, 0});
    } else if (c.has_rate) {
      targets_.push_back({index, c.rate_kind, c.rate_kind, c.rate, c.slot_rate, 0});
    }
  }
}

Index AssemblyEquations::rows() const { return data_.m + data_.n + static_cast<Index>(targets_.size()); }

VectorXd AssemblyEquations::weights() const {
  VectorXd w = VectorXd::Ones(rows());
  w.segment(data_.m, data_.n).setConstant(1e3);
  return w;
}

VectorXd AssemblyEquations::branches(const AssemblyTarget& target) const {
  return VectorXd::Constant(static_cast<Index>(data_.angles.size()), target.branch);
}

void AssemblyEquations::continue_branches(const VectorXd& y) {
  for (AssemblyTarget& target : targets_) {
    if (std::holds_alternative<AngleSensor>(target.sensor)) {
      target.branch = evaluate(data_, target.sensor, t_, y, branches(target));
    }
  }
}

void AssemblyEquations::add_slot(int slot, const Eigen::Ref<const VectorXd>& bar, Row rho_bar) const {
  if (slot < 0) return;
  for (std::size_t k = 0; k < data_.active.size(); ++k) {
    rho_bar(data_.active[k]) += data_.theta_rho.col(static_cast<Index>(k)).segment(slot, bar.size()).dot(bar);
  }
}

VectorXd AssemblyEquations::values(const VectorXd& y) const {
  VectorXd F(rows());
  for (const Constraint& c : data_.constraints) {
    const BodyAt b1 = body_at(y, c.body1), b2 = body_at(y, c.body2);
    std::visit(
        [&](const auto& p) {
          Vec<std::decay_t<decltype(p)>::kRows> phi;
          if (level_ == AssemblyLevel::position) {
            p.phi(b1.frame, b2.frame, phi);
          } else {
            p.phi_dot(b1.frame, b2.frame, phi);
          }
          F.segment(c.row, phi.size()) = phi;
        },
        c.primitive);
  }
  for (int i = 0; i < data_.n; ++i) {
    const Vector4d p = y.segment<4>(7 * i + 3), pdot = y.segment<4>(y.size() / 2 + 7 * i + 3);
    F(data_.m + i) = level_ == AssemblyLevel::position ? UnitNorm::phi(p) : UnitNorm::phi_dot(p, pdot);
  }
  Index row = data_.m + data_.n;
  for (const AssemblyTarget& target : targets_) {
    F(row++) = evaluate(data_, target.sensor, t_, y, branches(target)) - target.value;
  }
  return F;
}

AssemblyEquations::Gradients AssemblyEquations::gradients(const VectorXd& y) const {
  Gradients out{MatrixXd::Zero(rows(), y.size()), MatrixXd::Zero(rows(), data_.rho.size())};
  VectorXd y_bar(y.size()), rho_bar(data_.rho.size());
  for (const Constraint& c : data_.constraints) {
    const BodyAt b1 = body_at(y, c.body1), b2 = body_at(y, c.body2);
    std::visit(
        [&](const auto& p) {
          using P = std::decay_t<decltype(p)>;
          for (int i = 0; i < P::kRows; ++i) {
            const Vec<P::kRows> unit = Vec<P::kRows>::Unit(i);
            PrimitiveBars bars;
            p.pull_back(b1.frame, b2.frame, level_ == AssemblyLevel::position ? only_mu0<P>(unit) : only_mu1<P>(unit),
                        bars.bar1, bars.bar2, bars.s1, bars.s2);
            y_bar.setZero();
            add_pull_back(b1, c.body1, bars.bar1, 1, y_bar);
            add_pull_back(b2, c.body2, bars.bar2, 1, y_bar);
            out.y.row(c.row + i) = y_bar.transpose();
            add_slot(c.slot1, bars.s1, out.rho.row(c.row + i));
            add_slot(c.slot2, bars.s2, out.rho.row(c.row + i));
          }
        },
        c.primitive);
  }
  for (int i = 0; i < data_.n; ++i) {
    const Index p = 7 * i + 3, pdot = y.size() / 2 + p;
    if (level_ == AssemblyLevel::position) {
      out.y.row(data_.m + i).segment<4>(p) = 2 * y.segment<4>(p).transpose();
    } else {
      out.y.row(data_.m + i).segment<4>(p) = 2 * y.segment<4>(pdot).transpose();
      out.y.row(data_.m + i).segment<4>(pdot) = 2 * y.segment<4>(p).transpose();
    }
  }
  Index row = data_.m + data_.n;
  for (const AssemblyTarget& target : targets_) {
    y_bar.setZero(), rho_bar.setZero();
    add_gradient(data_, target.sensor, t_, y, branches(target), 1, y_bar, rho_bar);
    out.y.row(row) = y_bar.transpose();
    out.rho.row(row) = rho_bar.transpose();
    add_slot(target.slot, Vec<1>(-1), out.rho.row(row));
    ++row;
  }
  return out;
}

AssemblyEquations::Gradients AssemblyEquations::second(const VectorXd& y, const VectorXd& nu) const {
  const Index N = y.size() / 2;
  Gradients out{MatrixXd::Zero(N, y.size()), MatrixXd::Zero(N, data_.rho.size())};
  add_joint_curvature(y, nu, out);
  for (int i = 0; i < data_.n; ++i) {
    const Index p = 7 * i + 3;
    out.y.block<4, 4>(p, p).diagonal().array() += 2 * nu(data_.m + i);
  }
  Index row = data_.m + data_.n;
  for (const AssemblyTarget& target : targets_) add_target_curvature(target, y, nu(row++), out);
  return out;
}

void AssemblyEquations::add_joint_curvature(const VectorXd& y, const VectorXd& nu, Gradients& out) const {
  for (const Constraint& c : data_.constraints) {
    for (const int moving : {c.body1, c.body2}) {
      if (moving == 0) continue;
      for (int k = 0; k < 7; ++k) {
        BodyAt b1 = at_rest(y, c.body1), b2 = at_rest(y, c.body2);
        BodyAt& b = moving == c.body1 ? b1 : b2;
        set_velocity(Vec<7>::Unit(k), b.state, b.frame);
        const Index j = 7 * (moving - 1) + k;
        PrimitiveBars bars;
        std::visit(
            [&](const auto& p) {
              using P = std::decay_t<decltype(p)>;
              p.pull_back(b1.frame, b2.frame, only_mu1<P>(nu.segment<P::kRows>(c.row)), bars.bar1, bars.bar2, bars.s1,
                          bars.s2);
            },
            c.primitive);
        add_to_row(b1, c.body1, bars.bar1, out.y.row(j));
        add_to_row(b2, c.body2, bars.bar2, out.y.row(j));
        add_slot(c.slot1, bars.s1, out.rho.row(j));
        add_slot(c.slot2, bars.s2, out.rho.row(j));
      }
    }
  }
}

void AssemblyEquations::add_target_curvature(const AssemblyTarget& target, const VectorXd& y, double nu,
                                             Gradients& out) const {
  const Index N = y.size() / 2, P = data_.rho.size();
  const VectorXd branch = branches(target);
  const std::vector<SensorKind> components = components_of_norm(target.rate);
  VectorXd y_bar(y.size()), rho_bar(P);
  if (components.empty()) {
    for (Index j = 0; j < N; ++j) {
      y_bar.setZero(), rho_bar.setZero();
      add_gradient(data_, target.rate, t_, with_unit_velocity(y, j), branch, nu, y_bar, rho_bar);
      out.y.row(j).head(N) += y_bar.head(N).transpose();
      out.rho.row(j) += rho_bar.transpose();
    }
    return;
  }
  // f = |c| with components c_i linear in v:  f_v = c'c_v/f,  d f_v = (dc' c_v + c' dc_v - f_v df)/f
  VectorXd f_y = VectorXd::Zero(y.size()), f_rho = VectorXd::Zero(P);
  const double f = add_gradient(data_, target.sensor, t_, y, branch, 1, f_y, f_rho);
  if (f == 0) return;
  for (const SensorKind& component : components) {
    VectorXd c_y = VectorXd::Zero(y.size()), c_rho = VectorXd::Zero(P);
    const double c = add_gradient(data_, component, t_, y, branch, 1, c_y, c_rho);
    for (Index j = 0; j < N; ++j) {
      y_bar.setZero(), rho_bar.setZero();
      add_gradient(data_, component, t_, with_unit_velocity(y, j), branch, nu * c / f, y_bar, rho_bar);
      out.y.row(j).head(N) += y_bar.head(N).transpose();
      out.rho.row(j) += rho_bar.transpose();
    }
    out.y += nu / f * c_y.tail(N) * c_y.transpose();
    out.rho += nu / f * c_y.tail(N) * c_rho.transpose();
  }
  out.y -= nu / f * f_y.tail(N) * f_y.transpose();
  out.rho -= nu / f * f_y.tail(N) * f_rho.transpose();
}

}  // namespace mbsopt
