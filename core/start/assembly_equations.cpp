#include "core/start/assembly_equations.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/constraint/unit_norm.hpp"
#include "core/mechanism/followed_angles.hpp"
#include "core/mechanism/sensor_gradient.hpp"

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// A half turn is +pi, so that rounding does not decide its sign.
constexpr double kHalfTurn = -std::numbers::pi + 1e-6;

// y = (q, e_j)
VectorXd with_unit_velocity(const VectorXd& y, Index j) {
  VectorXd at = y;
  at.tail(y.size() / 2).setZero();
  at(y.size() / 2 + j) = 1;
  return at;
}

struct PrimitiveBars {
  FrameBar bar1, bar2;
  GeometryBar s;
  PrimitiveBars() { bar1.set_zero(), bar2.set_zero(); }
};

}  // namespace

AssemblyEquations::AssemblyEquations(const MechanismData& data, AssemblyLevel level, double t)
    : data_(data),
      level_(level),
      t_(t),
      angles_(Eigen::VectorXd::Zero(static_cast<Index>(data.angles.size()))),
      laws_(data) {
  laws_.set_time(t);
  for (std::size_t i = 0; i < data.conditions.size(); ++i) {
    const ConditionData& c = data.conditions[i];
    const SensorPtr& sensor = data.sensors[static_cast<std::size_t>(c.sensor)];
    const int index = static_cast<int>(i);
    if (level == AssemblyLevel::position) {
      if (c.has_value && !c.velocity_level) {
        targets_.push_back({index, sensor, c.rate_sensor, c.value, c.slot_value, c.value});
      }
    } else if (c.velocity_level) {
      if (c.has_value) targets_.push_back({index, sensor, sensor, c.value, c.slot_value, 0});
    } else if (c.has_rate) {
      targets_.push_back({index, c.rate_sensor, c.rate_sensor, c.rate, c.slot_rate, 0});
    }
  }
}

Index AssemblyEquations::rows() const { return data_.m + data_.n + static_cast<Index>(targets_.size()); }

VectorXd AssemblyEquations::weights() const {
  VectorXd w = VectorXd::Ones(rows());
  w.segment(data_.m, data_.n).setConstant(1e3);
  return w;
}

VectorXd AssemblyEquations::followed_angles() const {
  VectorXd angles = angles_;
  if (level_ == AssemblyLevel::velocity) return angles;
  for (const AssemblyTarget& target : targets_)
    if (target.sensor->angle() >= 0) angles(target.sensor->angle()) = target.branch;
  return angles;
}

VectorXd AssemblyEquations::branches(const AssemblyTarget& target) const {
  if (target.sensor->angle() < 0) return followed_angles();
  return VectorXd::Constant(static_cast<Index>(data_.angles.size()), target.branch);
}

// factor * primitive of a constraint of one row, at position level.
double AssemblyEquations::term_value(const Constraint& c, const VectorXd& y, const VectorXd& angles) const {
  const BodyAt b1 = body_at(y, c.body1), b2 = body_at(y, c.body2);
  return std::visit(
      [&]<class P>(const P& p) {
        Vec<P::kRows> phi;
        p.phi(b1.frame, b2.frame, phi);
        if constexpr (std::is_same_v<P, Angle>) {
          const double reference = c.angle == Constraint::kNearestLaw ? laws_.f_or_zero(c.row) : angles(c.angle);
          return c.factor * Angle::on_branch(phi(0), reference);
        }
        return c.factor * phi(0);
      },
      c.primitive);
}

void AssemblyEquations::settle_shared_rows(const VectorXd& y, VectorXd& angles) const {
  for (const RowGroup& g : data_.groups) {
    if (!g.shared) continue;
    double sum = 0;
    const Constraint* last = nullptr;
    for (const Constraint& c :
         std::ranges::equal_range(data_.constraints, g.row, {}, &Constraint::row)) {  // they ascend
      sum += term_value(c, y, angles);
      if (std::holds_alternative<Angle>(c.primitive)) last = &c;
    }
    sum -= laws_.f_or_zero(g.row);
    if (!last || last->factor == 0) continue;
    double& angle = angles(last->angle);
    angle = Angle::on_branch(angle, angle - sum / last->factor);
  }
}

void AssemblyEquations::start_branches(const VectorXd& y) {
  angles_.setZero();
  for (std::size_t i = 0; i < data_.angles.size(); ++i) {
    const JointAngle& a = data_.angles[i];
    double& angle = angles_(static_cast<Index>(i));
    angle = a.value(body_at(y, a.body1).frame, body_at(y, a.body2).frame);
    if (angle < kHalfTurn) angle += 2 * std::numbers::pi;
  }
  settle_shared_rows(y, angles_);
}

void AssemblyEquations::continue_branches(const VectorXd& y) {
  continue_angles(data_, y, angles_);
  for (AssemblyTarget& target : targets_) {
    if (target.sensor->angle() >= 0) {
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
  VectorXd F = VectorXd::Zero(rows());
  const bool positions = level_ == AssemblyLevel::position;
  for (const Constraint& c : data_.constraints) {
    if (positions && c.rows() == 1) {
      F(c.row) += term_value(c, y, angles_);
      continue;
    }
    const BodyAt b1 = body_at(y, c.body1), b2 = body_at(y, c.body2);
    std::visit(
        [&]<class P>(const P& p) {
          Vec<P::kRows> phi;
          if (positions) {
            p.phi(b1.frame, b2.frame, phi);
          } else {
            p.phi_dot(b1.frame, b2.frame, phi);
          }
          F.segment<P::kRows>(c.row) += c.factor * phi;
        },
        c.primitive);
  }
  if (positions) {
    laws_.subtract_f(F);
  } else {
    laws_.subtract_f_t(F);
  }
  const StateLayout layout{data_.n};
  Index row = data_.m;
  for (int i = 1; i <= data_.n; ++i) {
    const Vector4d p = y.segment<4>(layout.p(i)), pdot = y.segment<4>(layout.pdot(i));
    F(row++) = level_ == AssemblyLevel::position ? UnitNorm::phi(p) : UnitNorm::phi_dot(p, pdot);
  }
  for (const AssemblyTarget& target : targets_) {
    F(row++) = evaluate(data_, target.sensor, t_, y, branches(target)) - target.value;
  }
  return F;
}

AssemblyEquations::Gradients AssemblyEquations::gradients(const VectorXd& y) const {
  Gradients out{MatrixXd::Zero(rows(), y.size()), {}};
  collect_gradients(
      y, [&](Index row, Index column, double value) { out.y(row, column) += value; }, &out.rho);
  return out;
}

MatrixXd AssemblyEquations::gradients_in_y(const VectorXd& y) const {
  MatrixXd F_y = MatrixXd::Zero(rows(), y.size());
  collect_gradients(
      y, [&](Index row, Index column, double value) { F_y(row, column) += value; }, nullptr);
  return F_y;
}

AssemblyEquations::SparseGradients AssemblyEquations::sparse_gradients(const VectorXd& y) const {
  SparseGradients out;
  collect_gradients(
      y,
      [&](Index row, Index column, double value) {
        if (value != 0) out.y.push_back({static_cast<int>(row), static_cast<int>(column), value});
      },
      &out.rho);
  return out;
}

// Calls add(row, column, value) for the gradient in y of the joints' rows at a level, and add_field(row, slot, bar) for
// that in fields. If `only` is a body, other bodies' joints are left out.
template <class AddEntry, class AddField>
void AssemblyEquations::collect_joints(AssemblyLevel level, const VectorXd& y, int only, AddEntry&& add,
                                       AddField&& add_field) const {
  const bool positions = level == AssemblyLevel::position;
  const StateLayout layout{data_.n};
  const auto add_body = [&](Index row, const BodyAt& b, int body, const FrameBar& bar) {
    if (body == 0) return;
    Vec<7> q_bar = Vec<7>::Zero(), v_bar = Vec<7>::Zero();
    add_pull_back_velocity(b.state, bar, 1, q_bar, v_bar);
    for (Index k = 0; k < 7; ++k) {
      add(row, layout.q(body) + k, q_bar(k));
      add(row, layout.v(body) + k, v_bar(k));
    }
  };
  for (const Constraint& c : data_.constraints) {
    if (only > 0 && c.body1 != only && c.body2 != only) continue;
    const BodyAt b1 = body_at(y, c.body1), b2 = body_at(y, c.body2);
    std::visit(
        [&]<class P>(const P& p) {
          for (int i = 0; i < P::kRows; ++i) {
            Multipliers<P::kRows> unit = Multipliers<P::kRows>::zero();
            (positions ? unit.mu0 : unit.mu1) = c.factor * Vec<P::kRows>::Unit(i);
            PrimitiveBars bars;
            p.pull_back(b1.frame, b2.frame, unit, bars.bar1, bars.bar2, bars.s);
            const Index row = c.row + i;
            add_body(row, b1, c.body1, bars.bar1);
            add_body(row, b2, c.body2, bars.bar2);
            add_field(row, c.slot1, bars.s.s1);
            add_field(row, c.slot2, bars.s.s2);
            add_field(row, c.slot3, bars.s.s3);
          }
          if (c.slot_factor < 0) return;
          Vec<P::kRows> phi_dot;
          p.phi_dot(b1.frame, b2.frame, phi_dot);
          add_field(c.row, c.slot_factor, Vec<1>(positions ? term_value(c, y, angles_) / c.factor : phi_dot(0)));
        },
        c.primitive);
  }
}

// rho is null if it is not wanted.
template <class AddEntry>
void AssemblyEquations::collect_gradients(const VectorXd& y, AddEntry&& add, MatrixXd* rho) const {
  const bool positions = level_ == AssemblyLevel::position;
  const StateLayout layout{data_.n};
  if (rho) *rho = MatrixXd::Zero(rows(), data_.rho.size());
  collect_joints(level_, y, 0, add, [&](Index row, int slot, const auto& bar) {
    if (rho) add_slot(slot, bar, rho->row(row));
  });
  if (rho) add_law_gradients(*rho);
  Index row = data_.m;
  for (int i = 1; i <= data_.n; ++i, ++row) {
    const Index p = layout.p(i), pdot = layout.pdot(i);
    for (Index k = 0; k < 4; ++k) {
      add(row, p + k, 2 * y(positions ? p + k : pdot + k));
      if (!positions) add(row, pdot + k, 2 * y(p + k));
    }
  }
  VectorXd y_bar(y.size()), rho_bar(data_.rho.size());
  for (const AssemblyTarget& target : targets_) {
    y_bar.setZero(), rho_bar.setZero();
    add_gradient(data_, target.sensor, t_, y, branches(target), 1, y_bar, rho_bar);
    for (Index k = 0; k < y.size(); ++k) add(row, k, y_bar(k));
    if (rho) {
      rho->row(row) = rho_bar.transpose();
      add_slot(target.slot, Vec<1>(-1), rho->row(row));
    }
    ++row;
  }
}

void AssemblyEquations::add_law_gradients(MatrixXd& rho) const {
  const RowLaws::Derivative what =
      level_ == AssemblyLevel::position ? RowLaws::Derivative::f : RowLaws::Derivative::f_t;
  VectorXd rho_bar(data_.rho.size());
  for (const RowLaw& law : data_.laws) {
    rho_bar.setZero();
    laws_.add_gradient(what, law.row, -1, rho_bar);
    rho.row(law.row) += rho_bar.transpose();
  }
}

AssemblyEquations::Gradients AssemblyEquations::second(const VectorXd& y, const VectorXd& nu) const {
  const Index N = y.size() / 2;
  Gradients out{MatrixXd::Zero(N, y.size()), MatrixXd::Zero(N, data_.rho.size())};
  const StateLayout layout{data_.n};
  for (int i = 1; i <= data_.n; ++i) {
    for (Index j = layout.q(i); j < layout.q(i) + 7; ++j) {
      const auto add = [&](Index row, Index column, double value) {
        if (column < N) out.y(j, column) += nu(row) * value;
      };
      collect_joints(AssemblyLevel::velocity, with_unit_velocity(y, j), i, add,
                     [&](Index row, int slot, const auto& bar) { add_slot(slot, nu(row) * bar, out.rho.row(j)); });
    }
  }
  Index row = data_.m;
  for (int i = 1; i <= data_.n; ++i) {
    out.y.block<4, 4>(layout.p(i), layout.p(i)).diagonal().array() += 2 * nu(row++);
  }
  for (const AssemblyTarget& target : targets_) add_target_curvature(target, y, nu(row++), out);
  return out;
}

void AssemblyEquations::add_target_curvature(const AssemblyTarget& target, const VectorXd& y, double nu,
                                             Gradients& out) const {
  const Index N = y.size() / 2, P = data_.rho.size();
  const VectorXd branch = branches(target);
  const std::vector<SensorPtr> components = target.rate->components();
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
  for (const SensorPtr& component : components) {
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
