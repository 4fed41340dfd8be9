#include "core/driven/kinematics.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "core/driven/driven_run.hpp"
#include "core/driven/singular_position.hpp"
#include "core/dynamics/spatial_dynamics.hpp"
#include "core/run/run_ends.hpp"
#include "core/start/free_motion.hpp"
#include "core/start/poses.hpp"

namespace mbsopt {
namespace {

using Eigen::VectorXd;

// Accelerations from the equations of the drives alone, with their multipliers. They are right for any masses; the
// equations of motion would lose digits for some.
class DrivenMotion final : public MotionSource {
 public:
  DrivenMotion(const Mechanism& mechanism, const FormulationSettings& formulation)
      : d_(mechanism.data()), dynamics_(mechanism, formulation), ydot_(mechanism.states()) {
    motion_.z.assign(at(d_.n), Vec<6>::Zero());
  }

  const Motion& motion(const StatePoint& at, MotionPart) override {
    if (at.t == t_ && at.y.size() == y_.size() && at.y == y_) return motion_;
    t_ = at.t;
    y_ = at.y;
    const bool solved = dynamics_.evaluate(at.t, at.y, at.angles, ydot_);
    const JointSolver J(d_, frames_at(at.y), kDrivenRankThreshold);
    const VectorXd z = J.solve(-dynamics_.gamma());
    motion_.lambda = solved && dynamics_.lambda().allFinite() ? dynamics_.lambda() : VectorXd::Zero(d_.m);
    std::vector<Vec<6>> left = dynamics_.loads();  // f - M z
    for (int i = 0; i < d_.n; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      motion_.z[k] = z.segment<6>(6 * i);
      left[k] -= dynamics_.solver().mass_times(i + 1, motion_.z[k]);
    }
    motion_.lambda += J.solve_transposed(flat(left) - J.transposed_times(motion_.lambda));
    return motion_;
  }
  Motion& bar(MotionPart) override {
    assert(false && "kinematics carries no derivatives");
    return motion_;
  }
  void fold_bar(const StatePoint&, Eigen::Ref<VectorXd>, Eigen::Ref<VectorXd>) override { bar(MotionPart::all); }

 private:
  const MechanismData& d_;
  SpatialDynamics dynamics_;
  Motion motion_;
  double t_ = 0;
  VectorXd y_, ydot_;
};

}  // namespace

SimulationResult solve_kinematics(const Mechanism& mechanism, const Assembly& start, const SimulationSettings& settings,
                                  const std::vector<double>& times,
                                  const std::function<void(std::size_t, const StatePoint&)>& observe,
                                  const std::function<bool(double)>& go_on) {
  SimulationResult failed = result_at_start(start, times.front(), 0);
  if (!failed.ok()) return failed;
  const MechanismData& d = mechanism.data();
  SimulationSettings solved;
  solved.start_time = times.front();
  solved.end_time = times.back();
  solved.formulation = settings.formulation;
  solved.integrator.max_steps = settings.integrator.max_steps;
  RunOptions options;
  options.progress = go_on;
  DrivenMotion motion(mechanism, settings.formulation);
  DrivenRun run(mechanism, solved, {}, times, options, start, false, &motion);
  const StatePoint first = run.point();
  if (start.summary().degrees_of_freedom > 0 &&
      singular_position(mechanism, first.t, first.y, kDrivenRankThreshold).rank_lost > 0) {
    failed.stop(
        SimulationStatus::assembly_failed,
        fmt::format("the drives leave {}. Kinematics needs every motion driven, by drives or by a condition on a "
                    "sensor (initial.conditions) for each. If the start is a singular position, begin beside it",
                    freedoms_in_words(mechanism, start, times.front())));
    return failed;
  }
  run.go([&](const StatePoint& at, std::span<const DrivenTerm> terms) {
    if (run.window_at(at.t))
      for (const RowLaw& law : d.laws)
        if (law.drive >= 0 && std::isnan(at.motion->motion(at, MotionPart::in_plane).lambda(law.row)))
          run.singular_at(at.t).note("drive '" + d.drive_names[mbsopt::at(law.drive)] + "'");
    for (const DrivenTerm& term : terms) observe(term.observation, at);
    return true;
  });
  return run.finish();
}

}  // namespace mbsopt
