#include "core/start/assembly_equations.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/body/state_layout.hpp"
#include "core/constraint/unit_norm.hpp"
#include "core/dynamics/constraint_terms.hpp"
#include "core/mechanism/constraint_gradient.hpp"
#include "core/mechanism/followed_angles.hpp"

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

}  // namespace

AssemblyEquations::AssemblyEquations(const MechanismData& data, AssemblyLevel level, double t)
    : data_(data),
      level_(level),
      t_(t),
      angles_(Eigen::VectorXd::Zero(static_cast<Index>(data.angles.size()))),
      laws_(data) {
  laws_.set_time(t);
  for (const ConditionData& c : data.conditions)
    if (c.of_velocities != positions()) targets_.push_back({&c, c.value});
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
    if (target.sensor()->angle() >= 0) angles(target.sensor()->angle()) = target.branch;
  return angles;
}

VectorXd AssemblyEquations::branches(const AssemblyTarget& target) const {
  if (target.sensor()->angle() < 0) return followed_angles();
  return VectorXd::Constant(static_cast<Index>(data_.angles.size()), target.branch);
}

void AssemblyEquations::settle_shared_rows(const VectorXd& y, VectorXd& angles) const {
  if (std::ranges::none_of(data_.groups, &RowGroup::shared)) return;
  const std::vector<Frame> frames = frames_at(y);
  VectorXd phi(data_.m);
  for (const RowGroup& g : data_.groups) {
    if (!g.shared) continue;
    const Constraint* last = nullptr;
    auto c = std::ranges::lower_bound(data_.constraints, g.row, {}, &Constraint::row);  // they ascend
    for (; c != data_.constraints.end() && c->row == g.row; ++c)
      if (std::holds_alternative<Angle>(c->primitive)) last = &*c;
    if (!last || last->factor == 0) continue;
    ConstraintTerms(data_).phi(frames, laws_, angles, phi);
    double& angle = angles(last->angle);
    angle = Angle::on_branch(angle, angle - phi(g.row) / last->factor);
  }
}

void AssemblyEquations::start_branches(const VectorXd& y) {
  angles_.setZero();
  for (std::size_t i = 0; i < data_.angles.size(); ++i) {
    const JointAngle& a = data_.angles[i];
    double& angle = angles_(static_cast<Index>(i));
    angle = a.value(body_at(y, a.body1), body_at(y, a.body2));
    if (angle < kHalfTurn) angle += 2 * std::numbers::pi;
  }
  settle_shared_rows(y, angles_);
}

VectorXd AssemblyEquations::state(const VectorXd& x) const {
  VectorXd y = VectorXd::Zero(2 * x.size());
  if (!positions()) y.head(x.size()) = q_;
  y.segment(first(x), x.size()) = x;
  return y;
}

template <class F>
void AssemblyEquations::for_jacobian(const VectorXd& x, F&& f) const {
  for (const SparseEntry& e : entries(state(x))) {
    const Index k = e.column - first(x);
    if (k >= 0 && k < x.size()) f(e.row, k, e.value);
  }
}

MatrixXd AssemblyEquations::jacobian(const VectorXd& x) const {
  MatrixXd J = MatrixXd::Zero(rows(), x.size());
  for_jacobian(x, [&](Index row, Index k, double value) { J(row, k) += value; });
  return J;
}

VectorXd AssemblyEquations::magnitudes(const VectorXd& x) const {
  VectorXd largest = x.cwiseAbs(), sums = VectorXd::Zero(rows());
  for (Index i = 0; i < x.size(); i += 7) {
    largest.segment<3>(i).setConstant(largest.segment<3>(i).maxCoeff());
    largest.segment<4>(i + 3).setConstant(largest.segment<4>(i + 3).maxCoeff());
  }
  for_jacobian(x, [&](Index row, Index k, double value) { sums(row) += std::abs(value) * largest(k); });
  return sums;
}

VectorXd AssemblyEquations::sizes(const MatrixXd& J) const {
  double r = 0, p = 0;
  for (Index k = 0; k < J.cols(); k += 7) {
    for (Index i = 0; i < J.rows(); ++i) {
      const double here = J.row(i).segment<3>(k).squaredNorm();
      if (here > 0) {
        r += here;
        p += J.row(i).segment<4>(k + 3).squaredNorm();
      }
    }
  }
  const double length = p > 0 ? std::sqrt(p / r) : 1;
  VectorXd sizes = VectorXd::Ones(J.cols());
  for (Index k = 0; k < J.cols(); k += 7) sizes.segment<3>(k).setConstant(length);
  return sizes;
}

// No Euler parameter changes by more than 0.3 in one step (about 0.6 rad); r and v enter linearly.
double AssemblyEquations::step_fraction(const VectorXd& step) const {
  double change = 0;
  for (Index i = 3; i < step.size() && positions(); i += 7)
    change = std::max(change, step.segment<4>(i).lpNorm<Eigen::Infinity>());
  return change > 0.3 ? 0.3 / change : 1.0;
}

VectorXd AssemblyEquations::retracted(const VectorXd& x) const {
  VectorXd out = x;
  for (Index i = 3; i < x.size() && positions(); i += 7) out.segment<4>(i) = UnitNorm::project(x.segment<4>(i));
  return out;
}

void AssemblyEquations::accept(const VectorXd& x) {
  if (!positions()) return;
  const VectorXd y = state(x);
  continue_angles(data_, y, angles_);
  for (AssemblyTarget& target : targets_)
    if (target.sensor()->angle() >= 0) target.branch = evaluate(data_, target.sensor(), t_, y, branches(target));
}

VectorXd AssemblyEquations::values_at(const VectorXd& y) const {
  const std::vector<Frame> frames = frames_at(y);
  VectorXd of_joints(data_.m), F(rows());
  if (positions())
    ConstraintTerms(data_).phi(frames, laws_, angles_, of_joints);
  else
    ConstraintTerms(data_).phi_dot(frames, laws_, of_joints);
  F.head(data_.m) = of_joints;
  Index row = data_.m;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const Frame& b = frames[i];
    F(row++) = positions() ? UnitNorm::phi(b.p) : UnitNorm::phi_dot(b.p, b.pdot);
  }
  for (const AssemblyTarget& target : targets_)
    F(row++) = evaluate(data_, target.sensor(), t_, y, branches(target)) - target.condition->value;
  return F;
}

// Calls add(row, column, value) for the gradient in y of the joints' rows at a level, and add_field(row, slot, bar) for
// that in fields. If `only` is a body, other bodies' joints are left out.
template <class AddEntry, class AddField>
void AssemblyEquations::for_joint_gradients(AssemblyLevel level, const std::vector<Frame>& frames, int only,
                                            AddEntry&& add, AddField&& add_field) const {
  const bool positions = level == AssemblyLevel::position;
  const StateLayout layout{data_.n};
  const auto add_body = [&](Index row, int body, const FrameBar& bar) {
    if (body == 0) return;
    Vec<7> q_bar = Vec<7>::Zero(), v_bar = Vec<7>::Zero();
    add_pull_back_velocity(frames[at(body)], bar, 1, q_bar, v_bar);
    for (Index k = 0; k < 7; ++k) {
      add(row, layout.q(body) + k, q_bar(k));
      add(row, layout.v(body) + k, v_bar(k));
    }
  };
  for (const Constraint& c : data_.constraints) {
    if (only > 0 && c.body1 != only && c.body2 != only) continue;
    const Frame &f1 = frames[at(c.body1)], &f2 = frames[at(c.body2)];
    std::visit(
        [&]<class P>(const P& p) {
          for (int i = 0; i < P::kRows; ++i) {
            Multipliers<P::kRows> unit = Multipliers<P::kRows>::zero();
            (positions ? unit.mu0 : unit.mu1) = c.factor * Vec<P::kRows>::Unit(i);
            FrameBar bar1 = FrameBar::zero(), bar2 = bar1;
            GeometryBar s;
            p.pull_back(f1, f2, unit, bar1, bar2, s);
            const Index row = c.row + i;
            add_body(row, c.body1, bar1);
            add_body(row, c.body2, bar2);
            add_field(row, c.slot1, s.s1);
            add_field(row, c.slot2, s.s2);
            add_field(row, c.slot3, s.s3);
          }
          if (c.slot_factor < 0) return;
          Vec<P::kRows> phi = phi_of(c, p, f1, f2, laws_, angles_);
          if (!positions) p.phi_dot(f1, f2, phi);
          add_field(c.row, c.slot_factor, Vec<1>(phi(0)));
        },
        c.primitive);
  }
}

std::vector<SparseEntry> AssemblyEquations::entries(const VectorXd& y, MatrixXd* rho) const {
  const StateLayout layout{data_.n};
  std::vector<SparseEntry> out;
  MatrixXd rho_bars = MatrixXd::Zero(data_.rho.size(), rho ? rows() : 0);  // a column per row
  const auto add = [&](Index row, Index column, double value) {
    if (value != 0) out.push_back({static_cast<int>(row), static_cast<int>(column), value});
  };
  const auto add_field = [&](Index row, int slot, const auto& bar) {
    if (rho) FieldGradient{data_.theta_rho, data_.active, 1, rho_bars.col(row)}.add(slot, bar);
  };
  for_joint_gradients(level_, frames_at(y), 0, add, add_field);
  for (const RowLaw& law : data_.laws)
    if (rho) laws_.add_gradient(positions() ? 0 : 1, law.row, -1, rho_bars.col(law.row));
  Index row = data_.m;
  for (int i = 1; i <= data_.n; ++i, ++row) {
    const Index p = layout.p(i), pdot = layout.pdot(i);
    for (Index k = 0; k < 4; ++k) {
      add(row, p + k, 2 * y(positions() ? p + k : pdot + k));
      if (!positions()) add(row, pdot + k, 2 * y(p + k));
    }
  }
  VectorXd y_bar(y.size()), rho_bar(data_.rho.size());
  for (const AssemblyTarget& target : targets_) {
    y_bar.setZero();
    rho_bar.setZero();
    add_gradient(data_, target.sensor(), t_, y, branches(target), 1, y_bar, rho_bar);
    for (Index k = 0; k < y.size(); ++k) add(row, k, y_bar(k));
    add_field(row, target.condition->slot, Vec<1>(-1));
    if (rho) rho_bars.col(row) += rho_bar;
    ++row;
  }
  if (rho) *rho = rho_bars.transpose();
  return out;
}

AssemblyEquations::Gradients AssemblyEquations::gradients(const VectorXd& y) const {
  Gradients out{MatrixXd::Zero(rows(), y.size()), {}};
  for (const SparseEntry& e : entries(y, &out.rho)) out.y(e.row, e.column) += e.value;
  return out;
}

AssemblyEquations::Gradients AssemblyEquations::second(const VectorXd& y, const VectorXd& nu) const {
  const Index N = y.size() / 2;
  const StateLayout layout{data_.n};
  Gradients out{MatrixXd::Zero(N, y.size()), {}};
  MatrixXd rho_bars = MatrixXd::Zero(data_.rho.size(), N);
  VectorXd at_rest = y;
  at_rest.tail(N).setZero();
  std::vector<Frame> frames = frames_at(at_rest);
  for (int i = 1; i <= data_.n; ++i) {
    Frame& frame = frames[at(i)];
    for (Index j = layout.q(i); j < layout.q(i) + 7; ++j) {
      set_velocity(Vec<7>::Unit(j - layout.q(i)), frame);
      for_joint_gradients(
          AssemblyLevel::velocity, frames, i,
          [&](Index row, Index column, double value) {
            if (column < N) out.y(j, column) += nu(row) * value;
          },
          [&](Index row, int slot, const auto& bar) {
            FieldGradient{data_.theta_rho, data_.active, nu(row), rho_bars.col(j)}.add(slot, bar);
          });
    }
    set_velocity(Vec<7>::Zero(), frame);
  }
  out.rho = rho_bars.transpose();
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
  VectorXd y_bar(y.size()), rho_bar(P);
  const auto add_linear = [&](const SensorPtr& rate, double weight) {
    for (Index j = 0; j < N; ++j) {
      y_bar.setZero();
      rho_bar.setZero();
      add_gradient(data_, rate, t_, with_unit_velocity(y, j), branch, weight, y_bar, rho_bar);
      out.y.row(j).head(N) += y_bar.head(N).transpose();
      out.rho.row(j) += rho_bar.transpose();
    }
  };
  const std::vector<SensorPtr> components = target.condition->rate->components();
  if (components.empty()) return add_linear(target.condition->rate, nu);
  // f = |c| with components c_i linear in v:  f_v = c'c_v/f,  d f_v = (dc' c_v + c' dc_v - f_v df)/f
  VectorXd f_y = VectorXd::Zero(y.size()), f_rho = VectorXd::Zero(P);
  const double f = add_gradient(data_, target.sensor(), t_, y, branch, 1, f_y, f_rho);
  if (f == 0) return;
  for (const SensorPtr& component : components) {
    VectorXd c_y = VectorXd::Zero(y.size()), c_rho = VectorXd::Zero(P);
    add_linear(component, nu / f * add_gradient(data_, component, t_, y, branch, 1, c_y, c_rho));
    out.y += nu / f * c_y.tail(N) * c_y.transpose();
    out.rho += nu / f * c_y.tail(N) * c_rho.transpose();
  }
  out.y -= nu / f * f_y.tail(N) * f_y.transpose();
  out.rho -= nu / f * f_y.tail(N) * f_rho.transpose();
}

}  // namespace mbsopt
