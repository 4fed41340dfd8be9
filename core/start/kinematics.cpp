#include "core/start/kinematics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>

#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/dynamics/spatial_dynamics.hpp"
#include "core/linear/dense.hpp"
#include "core/start/assembly_problems.hpp"
#include "core/start/driven_path.hpp"
#include "core/start/free_motion.hpp"
#include "core/start/law_jumps.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kDrivenRankThreshold = 1e-7;  // rows of J scaled to unit length
constexpr double kDigitsOfInstant = 1e-3;      // the same at the instant of a window, which is known to some digits

// J at a state with rows scaled to unit length, for linear solves without masses.
class DrivenRows {
 public:
  explicit DrivenRows(const MechanismData& d) : d_(d), rows_(d), laws_(d), states_(static_cast<std::size_t>(d.n) + 1) {
    frames_.resize(states_.size());
    phi_.setZero(d.m);
  }

  void set(double t, const VectorXd& y) {
    laws_.set_time(t);
    const StateLayout layout{d_.n};
    for (std::size_t k = 1; k < states_.size(); ++k) {
      set_position(y.segment<7>(layout.q(k)), states_[k], frames_[k]);
      set_velocity(y.segment<7>(layout.v(k)), states_[k], frames_[k]);
    }
  }
  void factor(double threshold = kDrivenRankThreshold) {
    if (d_.m == 0) return;
    rows_.evaluate(frames_);
    J_ = rows_.dense();
    scale_ = J_.rowwise().norm().cwiseMax(1e-300).cwiseInverse();
    unit_rows_.noalias() = scale_.asDiagonal() * J_;
    scaled_.compute(unit_rows_, threshold);
  }
  const VectorXd& phi(const VectorXd& angles) {
    ConstraintTerms(d_).phi(frames_, laws_, angles, phi_);
    return phi_;
  }
  const VectorXd& phi_dot() {
    ConstraintTerms(d_).phi_dot(frames_, laws_, phi_);
    return phi_;
  }
  Index rank() const { return d_.m == 0 ? 0 : scaled_.rank(); }
  const MatrixXd& unit_rows() const { return unit_rows_; }
  VectorXd solve(const VectorXd& b) const { return scaled_.solve(scale_.cwiseProduct(b)); }  // J x = b
  VectorXd solve_transposed(const VectorXd& f) const {                                       // J'x = f
    const VectorXd x = scaled_.solve_transposed(f);
    return scale_.cwiseProduct(x);
  }
  VectorXd transposed_times(const VectorXd& x) const { return J_.transpose() * x; }

 private:
  const MechanismData& d_;
  ConstraintRows rows_;
  RowLaws laws_;
  std::vector<BodyState> states_;
  std::vector<Frame> frames_;
  VectorXd phi_, scale_;
  MatrixXd J_, unit_rows_;
  OrthogonalDecomposition scaled_;  // of unit_rows_
};

// Accelerations from the equations of the drives alone, with their multipliers. They are right for any masses; the
// equations of motion would lose digits for some.
class DrivenMotion final : public MotionSource {
 public:
  DrivenMotion(const Mechanism& mechanism, const FormulationSettings& formulation)
      : d_(mechanism.data()), dynamics_(mechanism, formulation), rows_(d_), ydot_(mechanism.states()) {
    motion_.z.assign(static_cast<std::size_t>(d_.n), Vec<6>::Zero());
    bar_ = motion_;
    bar_.lambda.setZero(d_.m);
  }

  const Motion& motion(const StatePoint& at) override {
    if (at.t == t_ && at.y.size() == y_.size() && at.y == y_) return motion_;
    t_ = at.t, y_ = at.y;
    const bool solved = dynamics_.evaluate(at.t, at.y, at.angles, ydot_);
    rows_.set(at.t, at.y);
    rows_.factor();
    const VectorXd z = rows_.solve(-dynamics_.gamma());
    std::vector<Vec<6>> loads = dynamics_.loads();
    VectorXd left(6 * d_.n);  // f - M z - J'lambda
    motion_.lambda = solved && dynamics_.lambda().allFinite() ? dynamics_.lambda() : VectorXd::Zero(d_.m);
    const StateLayout layout{d_.n};
    for (int i = 1; i <= d_.n; ++i) {
      Vec<6>& of_body = motion_.z[static_cast<std::size_t>(i - 1)];
      of_body = z.segment<6>(layout.z(i));
      left.segment<6>(layout.z(i)) = -dynamics_.solver().mass_times(i, of_body);
    }
    dynamics_.terms().add_user_mass(-1, motion_.z, loads);
    for (int i = 1; i <= d_.n; ++i) left.segment<6>(layout.z(i)) += loads[static_cast<std::size_t>(i - 1)];
    motion_.lambda += rows_.solve_transposed(left - rows_.transposed_times(motion_.lambda));
    return motion_;
  }
  Motion& bar() override { return bar_; }
  void fold_bar(const StatePoint&, Eigen::Ref<VectorXd>, Eigen::Ref<VectorXd>) override {
    assert(false && "kinematics carries no derivatives");
  }

 private:
  const MechanismData& d_;
  SpatialDynamics dynamics_;
  DrivenRows rows_;
  Motion motion_, bar_;
  double t_ = 0;
  VectorXd y_, ydot_;
};

// Finds the degrees of freedom that J leaves at a position, and the owners of equations that depend on each other
// there. These have a share in null vectors of J'.
SingularPosition rank_at(const MechanismData& d, DrivenRows& rows, double t, const VectorXd& y,
                         double threshold = kDrivenRankThreshold) {
  rows.set(t, y);
  rows.factor(threshold);
  SingularPosition s;
  s.t = t;
  s.rank_lost = static_cast<int>(6 * d.n - rows.rank());
  if (s.rank_lost == 0 || d.m == 0) return s;
  const LeftSingular svd = left_singular(rows.unit_rows());
  std::set<std::string> seen;
  for (Index k = 0; k < rows.unit_rows().rows(); ++k) {
    if (k < svd.values.size() && svd.values(k) > threshold) continue;
    for (const Constraint& c : d.constraints) {
      if (svd.U.col(k).segment(c.row, c.rows()).cwiseAbs().maxCoeff() < 1e-3) continue;
      const std::string owner = c.drive >= 0 ? "drive '" + d.drive_names[static_cast<std::size_t>(c.drive)] + "'"
                                             : "joint '" + d.joint_names[static_cast<std::size_t>(c.joint)] + "'";
      if (seen.insert(owner).second) s.owners.push_back(owner);
    }
  }
  return s;
}

// The path, with positions and velocities that do not depend on masses.
class Kinematics {
 public:
  Kinematics(const Mechanism& mechanism, const FormulationSettings& formulation)
      : d_(mechanism.data()),
        motion_(mechanism, formulation),
        path_(mechanism, Model::spatial),
        continued_(motion_, [this](double t) { return path_.window_at(t); }),
        rows_(d_) {
    path_.set_watch(
        [this](const DrivenState& from, const DrivenState& to) { return past_half_turn(d_, from.y, to.t, to.y); });
  }

  void start(double t, double end, const VectorXd& y, const VectorXd& angles) { path_.start(t, end, y, angles); }
  StatePoint point() { return {path_.state().t, path_.state().y, path_.state().angles, &continued_}; }
  const SingularWindow* window() const { return path_.window_at(t()); }
  bool is_uncertain() const { return path_.is_uncertain(); }
  const std::string& objection() const { return path_.objection(); }
  double t() const { return path_.state().t; }
  double step_limit() const { return path_.step_limit(); }
  bool advance(double h, double t1) {
    if (!path_.advance(h, t1)) return false;
    if (!window()) polish();
    return true;
  }
  double position_violation() { return path_.position_violation(); }
  double velocity_violation() { return path_.velocity_violation(); }
  SingularPosition rank_here() { return rank_at(d_, rows_, t(), path_.state().y); }

 private:
  // Computes Newton's last steps and the velocities without masses.
  void polish() {
    y_ = path_.state().y;
    double before = INFINITY;
    for (int k = 0; k < 10; ++k) {
      rows_.set(t(), y_);
      const VectorXd phi = rows_.phi(path_.state().angles);
      const double now = phi.cwiseAbs().maxCoeff();
      rows_.factor();
      if (now < 1e-15 || !(now < 0.9 * before)) break;
      before = now;
      move(rows_.solve(-phi));
    }
    const Index half = y_.size() / 2;
    y_.tail(half) += rates_of_poses(y_.head(half), rows_.solve(-rows_.phi_dot()));
    path_.improve(y_);
  }
  void move(const VectorXd& delta) {
    const StateLayout layout{d_.n};
    y_.head(layout.positions()) += rates_of_poses(y_.head(layout.positions()), delta);
    for (int i = 1; i <= d_.n; ++i) {
      auto p = y_.segment<4>(layout.p(i)), pdot = y_.segment<4>(layout.pdot(i));
      p.normalize();
      pdot -= p * p.dot(pdot);
    }
  }

  const MechanismData& d_;
  DrivenMotion motion_;
  DrivenPath path_;
  ContinuedMotion continued_;
  DrivenRows rows_;
  VectorXd y_;
};

}  // namespace

SingularPosition singular_position(const Mechanism& mechanism, double t, const VectorXd& y, double half) {
  DrivenRows rows(mechanism.data());
  SingularPosition s = rank_at(mechanism.data(), rows, t, y, kDigitsOfInstant);
  s.half = half;
  return s;
}

std::string why_stuck(const Mechanism& mechanism, const SimulationSettings& settings, double t, const VectorXd& y) {
  // The interval over which a jump is measured; it is long against the rounding of times.
  const double beside = 1e-3 * (settings.end_time - settings.start_time);
  const std::string jump =
      LawJumps(mechanism.data())
          .between(std::max(t - beside, settings.start_time), std::min(t + beside, settings.end_time));
  if (!jump.empty()) return jump;
  DrivenRows rows(mechanism.data());
  const SingularPosition here = rank_at(mechanism.data(), rows, t, y);
  const std::string why = here.owners.empty()
                              ? std::string()
                              : fmt::format(": a singular position, where the equations of {} depend on each other",
                                            fmt::join(here.owners, ", "));
  return fmt::format(
      "the positions cannot be continued beyond t = {:.6g} s{}. Perhaps a drive asks for more than the mechanism "
      "reaches, or cannot pass a dead point. Look for poles and jumps of its law, change the lengths, or drive another "
      "joint there",
      t, why);
}

KinematicsResult solve_kinematics(const Mechanism& mechanism, const Assembly& start, const SimulationSettings& settings,
                                  const std::vector<double>& times,
                                  const std::function<bool(std::size_t, const StatePoint&)>& observe,
                                  const std::function<bool(double)>& go_on) {
  KinematicsResult result;
  result.last_good_time = times.front();
  if (!start.result().ok) {
    result.message = start.result().message;
    return result;
  }
  const int freedoms = start.summary().degrees_of_freedom;
  Kinematics k(mechanism, settings.formulation);
  k.start(times.front(), times.back(), start.result().y, start.result().angles);
  if (freedoms > 0 && k.rank_here().rank_lost > 0) {
    result.message = fmt::format(
        "the drives leave {}. Kinematics needs every motion driven, by drives or by a condition on a sensor "
        "(initial.conditions) for each. If the start is a singular position, begin beside it",
        freedoms_in_words(mechanism, start, times.front()));
    return result;
  }
  const auto stopped = [&] {
    result.message = fmt::format("stopped at t = {:.6g} s", k.t());
    return result;
  };
  LawJumps law_jumps(mechanism.data());
  long tried = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    double h = times[i] - k.t();
    while (k.t() < times[i]) {
      if (go_on && !go_on(k.t())) return stopped();
      const double most = static_cast<double>(settings.integrator.max_steps - tried++);
      if (times.back() - k.t() > most * k.step_limit()) {
        result.message = fmt::format(
            "at t = {:.6g} s the drives turn a body so fast that the motion until {:.6g} s takes more steps than "
            "simulation.integrator.max_steps, {}. Is the law in rad and s?",
            k.t(), times.back(), settings.integrator.max_steps);
        return result;
      }
      const double left = times[i] - k.t();
      h = std::min({h, left, k.step_limit()});
      const bool last = h >= left * (1 - 1e-12);
      const double t = k.t();
      if (k.advance(h, last ? times[i] : t + h)) {
        result.message = law_jumps.between(t, k.t());
        if (!result.message.empty()) return result;
        ++result.steps;
        h *= 2;
        continue;
      }
      h /= 2;
      if (h < 1e-9 * std::max(1e-3, times.back() - times.front())) {
        result.message = k.objection().empty() ? why_stuck(mechanism, settings, k.t(), k.point().y) : k.objection();
        return result;
      }
    }
    result.last_good_time = k.t();
    result.max_position_violation = std::max(result.max_position_violation, k.position_violation());
    result.max_velocity_violation = std::max(result.max_velocity_violation, k.velocity_violation());
    if (const SingularWindow* const w = k.window()) {
      if (result.singular.empty() || result.singular.back().t != w->t)
        result.singular.push_back(singular_position(mechanism, w->t, w->state_at(w->t).y, w->half));
      for (const std::string& name : lacking_sensors(mechanism, k.point())) result.singular.back().note(name);
      const MechanismData& d = mechanism.data();
      for (const RowLaw& law : d.laws)
        if (law.drive >= 0 && std::isnan(k.point().motion->motion(k.point()).lambda(law.row)))
          result.singular.back().note("drive '" + d.drive_names[static_cast<std::size_t>(law.drive)] + "'");
    } else if (k.is_uncertain()) {
      result.singular.push_back(singular_position(mechanism, k.t(), k.point().y, 0));
    }
    if (!observe(i, k.point())) return stopped();
  }
  result.ok = true;
  return result;
}

}  // namespace mbsopt
