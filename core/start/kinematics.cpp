#include "core/start/kinematics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/dynamics/constraint_terms.hpp"
#include "core/dynamics/spatial_dynamics.hpp"
#include "core/linear/dense.hpp"
#include "core/start/driven_path.hpp"
#include "core/start/free_motion.hpp"
#include "core/start/law_jumps.hpp"
#include "core/start/poses.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kDrivenRankThreshold = 1e-7;  // rows of J scaled to unit length
constexpr double kDigitsOfInstant = 1e-3;      // the same at the instant of a window, which is known to some digits

// Accelerations from the equations of the drives alone, with their multipliers. They are right for any masses; the
// equations of motion would lose digits for some.
class DrivenMotion final : public MotionSource {
 public:
  DrivenMotion(const Mechanism& mechanism, const FormulationSettings& formulation)
      : d_(mechanism.data()), dynamics_(mechanism, formulation), ydot_(mechanism.states()) {
    motion_.z.assign(at(d_.n), Vec<6>::Zero());
    bar_ = motion_;
    bar_.lambda.setZero(d_.m);
  }

  const Motion& motion(const StatePoint& at) override {
    if (at.t == t_ && at.y.size() == y_.size() && at.y == y_) return motion_;
    t_ = at.t, y_ = at.y;
    const bool solved = dynamics_.evaluate(at.t, at.y, at.angles, ydot_);
    const JointSolver J(d_, BodiesAt(at.y).frames, kDrivenRankThreshold);
    const VectorXd z = J.solve(-dynamics_.gamma());
    motion_.lambda = solved && dynamics_.lambda().allFinite() ? dynamics_.lambda() : VectorXd::Zero(d_.m);
    std::vector<Vec<6>> left = dynamics_.loads();  // f - M z
    for (int i = 0; i < d_.n; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      motion_.z[k] = z.segment<6>(6 * i);
      left[k] -= dynamics_.solver().mass_times(i + 1, motion_.z[k]);
    }
    dynamics_.terms().add_user_mass(-1, motion_.z, left);
    motion_.lambda += J.solve_transposed(flat(left) - J.transposed_times(motion_.lambda));
    return motion_;
  }
  Motion& bar() override { return bar_; }
  void fold_bar(const StatePoint&, Eigen::Ref<VectorXd>, Eigen::Ref<VectorXd>) override {
    assert(false && "kinematics carries no derivatives");
  }

 private:
  const MechanismData& d_;
  SpatialDynamics dynamics_;
  Motion motion_, bar_;
  double t_ = 0;
  VectorXd y_, ydot_;
};

// Finds the degrees of freedom that J leaves at a position, and the owners of equations that depend on each other
// there. These have a share in null vectors of J'.
SingularPosition rank_at(const MechanismData& d, double t, const VectorXd& y, double threshold = kDrivenRankThreshold) {
  const JointSolver J(d, BodiesAt(y).frames, threshold);
  SingularPosition s;
  s.t = t;
  s.rank_lost = static_cast<int>(6 * d.n - J.rank());
  if (s.rank_lost == 0 || d.m == 0) return s;
  const LeftSingular svd = left_singular(J.unit_rows_of_J());
  for (Index k = 0; k < d.m; ++k) {
    if (k < svd.values.size() && svd.values(k) > threshold) continue;
    for (const Constraint& c : d.constraints) {
      if (svd.U.col(k).segment(c.row, c.rows()).cwiseAbs().maxCoeff() < 1e-3) continue;
      const std::string owner =
          c.drive >= 0 ? "drive '" + d.drive_names[at(c.drive)] + "'" : "joint '" + d.joint_names[at(c.joint)] + "'";
      if (std::ranges::find(s.owners, owner) == s.owners.end()) s.owners.push_back(owner);
    }
  }
  return s;
}

// Newton's last steps and the velocities, by equations without masses.
VectorXd polished(const MechanismData& d, const DrivenState& state) {
  VectorXd y = state.y, phi_dot(d.m);
  close_joints(d, state.t, state.angles, kDrivenRankThreshold, y);
  RowLaws laws(d);
  laws.set_time(state.t);
  const std::vector<Frame> frames = BodiesAt(y).frames;
  ConstraintTerms(d).phi_dot(frames, laws, phi_dot);
  const Index half = y.size() / 2;
  y.tail(half) += rates_of_poses(y.head(half), JointSolver(d, frames, kDrivenRankThreshold).solve(-phi_dot));
  return y;
}

}  // namespace

SingularPosition singular_position(const Mechanism& mechanism, double t, const VectorXd& y) {
  return rank_at(mechanism.data(), t, y, kDigitsOfInstant);
}

SingularPosition& singular_position(const Mechanism& mechanism, const SingularWindow& w,
                                    std::vector<SingularPosition>& known) {
  const auto same = std::ranges::find(known, w.t, &SingularPosition::t);
  if (same != known.end()) return *same;
  known.push_back(singular_position(mechanism, w.t, w.state_at(w.t).y));
  known.back().half = w.half;
  return known.back();
}

std::string why_stuck(const Mechanism& mechanism, const SimulationSettings& settings, double t, const VectorXd& y) {
  // The interval over which a jump is measured; it is long against the rounding of times.
  const double beside = 1e-3 * (settings.end_time - settings.start_time);
  const std::string jump =
      LawJumps(mechanism.data())
          .between(std::max(t - beside, settings.start_time), std::min(t + beside, settings.end_time));
  if (!jump.empty()) return jump;
  const SingularPosition here = rank_at(mechanism.data(), t, y);
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
  const MechanismData& d = mechanism.data();
  KinematicsResult result;
  result.last_good_time = times.front();
  if (!start.result().ok) {
    result.message = start.result().message;
    return result;
  }
  DrivenPath path(mechanism, Model::spatial);
  path.start(times.front(), times.back(), start.result().y, start.result().angles);
  if (start.summary().degrees_of_freedom > 0 && rank_at(d, path.state().t, path.state().y).rank_lost > 0) {
    result.message = fmt::format(
        "the drives leave {}. Kinematics needs every motion driven, by drives or by a condition on a sensor "
        "(initial.conditions) for each. If the start is a singular position, begin beside it",
        freedoms_in_words(mechanism, start, times.front()));
    return result;
  }
  DrivenMotion solved(mechanism, settings.formulation);
  ContinuedMotion motion(solved, [&](double t) { return path.window_at(t); });
  LawJumps law_jumps(d);
  std::string jump;
  path.set_watch([&](const DrivenState& from, const DrivenState& to) {
    jump = law_jumps.between(from.t, to.t);
    return jump.empty() ? past_half_turn(d, from.y, to.t, to.y) : jump;
  });
  const auto stop = [&] {
    result.message = fmt::format("stopped at t = {:.6g} s", path.state().t);
    return false;
  };
  long tried = 0;
  const auto goes_on = [&] {
    const double t = path.state().t;
    if (!jump.empty()) return false;
    if (go_on && !go_on(t)) return stop();
    const double most = static_cast<double>(settings.integrator.max_steps - tried++);
    if (!(times.back() - t > most * path.step_limit())) return true;
    result.message = fmt::format(
        "at t = {:.6g} s the drives turn a body so fast that the motion until {:.6g} s takes more steps than "
        "simulation.integrator.max_steps, {}. Is the law in rad and s?",
        t, times.back(), settings.integrator.max_steps);
    return false;
  };
  const double shortest = 1e-9 * std::max(1e-3, times.back() - times.front());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const bool reached = path.go_to(times[i], shortest, std::numeric_limits<int>::max(), goes_on);
    result.steps = path.accepted();
    if (!reached && result.message.empty())
      result.message =
          path.objection().empty() ? why_stuck(mechanism, settings, path.state().t, path.state().y) : path.objection();
    if (!reached) return result;
    const double t = path.state().t;
    const SingularWindow* const w = path.window_at(t);
    if (!w) path.improve(polished(d, path.state()));
    const StatePoint point{t, path.state().y, path.state().angles, &motion};
    result.last_good_time = t;
    result.max_position_violation = std::max(result.max_position_violation, path.position_violation());
    result.max_velocity_violation = std::max(result.max_velocity_violation, path.velocity_violation());
    if (w) {
      SingularPosition& here = singular_position(mechanism, *w, result.singular);
      for (const std::string& name : lacking_sensors(mechanism, point)) here.note(name);
      for (const RowLaw& law : d.laws)
        if (law.drive >= 0 && std::isnan(motion.motion(point).lambda(law.row)))
          here.note("drive '" + d.drive_names[at(law.drive)] + "'");
    } else if (path.is_uncertain()) {
      result.singular.push_back(singular_position(mechanism, t, path.state().y));
    }
    if (!observe(i, point)) {
      stop();
      return result;
    }
  }
  result.ok = true;
  return result;
}

}  // namespace mbsopt
