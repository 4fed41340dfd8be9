#include "core/cvodes/cvodes_run.hpp"

#include <fmt/format.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <stdexcept>

#include "core/sensor/body_at.hpp"
#include "core/start/model_warnings.hpp"
#include "core/step/step_control.hpp"
#include "core/step/step_failure.hpp"
#include "core/watch/jump_watch.hpp"
#include "core/watch/run_guard.hpp"
#include "core/watch/start_failure.hpp"
#include "core/watch/weak_joints.hpp"
#include "core/watch/zero_length.hpp"

namespace mbsopt::cvodes {
namespace {

// Numbers up to this one have a finite square, also after division by tolerances.
constexpr double kLargestRate = 1e120;
constexpr long kMostIterations = std::numeric_limits<int>::max();

}  // namespace

bool is_stiff_method(const SimulationSettings& settings) { return settings.integrator.type == "cvodes_bdf"; }

ForwardRun::ForwardRun(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs)
    : start_(std::chrono::steady_clock::now()),
      mechanism_(mechanism),
      settings_(settings),
      costs_(costs),
      assembly_(mechanism, settings.start_time),
      tolerances_(mechanism.data(), settings.integrator),
      flow_(mechanism, settings.formulation),
      violations_(make_projector(mechanism, Projection::none)),
      y_(mechanism.states(), context_),
      y_sample_(mechanism.states(), context_),
      linear_solver_(flow_, context_) {
  result_.psi.setZero(static_cast<Eigen::Index>(costs.size()));
  result_.last_good_time = settings.start_time;
  result_.y_initial = assembly_.result().y;
  y_now_ = assembly_.result().y;
  for (std::size_t o = 0; o < costs.size(); ++o) {
    if (costs[o].running) running_.push_back(static_cast<Eigen::Index>(o));
  }
  left_range_.assign(running_.size(), false);
  if (!assembly_.result().ok) {
    stop(SimulationStatus::assembly_failed, assembly_.result().message);
    return;
  }
  flow_.start(settings.start_time, assembly_.result().angles);
  *y_ = assembly_.result().y;
  if (!flow_.evaluate(settings.start_time, *y_) || !massless_bodies(mechanism, assembly_).empty()) {
    stop(SimulationStatus::not_finite, start_failure(mechanism_.data(), settings.start_time));
    return;
  }
  set_up();
}

void ForwardRun::stop(SimulationStatus status, std::string message) {
  result_.status = status;
  result_.message = std::move(message);
}

void ForwardRun::require(int flag) const {
  if (flag < 0) throw std::runtime_error("CVODES: " + last_words_);
}

void ForwardRun::set_up() {
  const IntegratorSettings& s = settings_.integrator;
  const bool stiff = is_stiff_method(settings_);
  memory_.reset(CVodeCreate(stiff ? CV_BDF : CV_ADAMS, context_));
  if (!memory_) throw std::bad_alloc();
  const CVErrHandlerFn keep_words = [](int, const char*, const char*, char* words, void* self) {
    static_cast<ForwardRun*>(self)->last_words_ = words;
  };
  require(CVodeSetErrHandlerFn(memory(), keep_words, this));
  require(CVodeInit(memory(), f, settings_.start_time, y_));
  require(CVodeSetUserData(memory(), this));
  require(CVodeWFtolerances(memory(), weights));
  require(CVodeSetMaxHnilWarns(memory(), -1));
  require(CVodeSetMaxErrTestFails(memory(), 30));
  require(CVodeSetMaxConvFails(memory(), 60));
  require(CVodeSetMaxNumSteps(memory(), s.max_steps));
  if (s.initial_step) {
    require(CVodeSetInitStep(memory(), std::min(*s.initial_step, settings_.end_time - settings_.start_time)));
  }
  if (s.max_step) require(CVodeSetMaxStep(memory(), *s.max_step));
  if (s.options.min_step) require(CVodeSetMinStep(memory(), *s.options.min_step));
  if (stiff) {
    if (!linear_solver_.attach(memory())) require(CV_ILL_INPUT);
    if (const auto most = s.options.newton_iterations)
      require(CVodeSetMaxNonlinIters(memory(), static_cast<int>(std::min(*most, kMostIterations))));
    if (s.options.newton_tolerance) require(CVodeSetNonlinConvCoef(memory(), *s.options.newton_tolerance));
  } else {
    fixed_point_.reset(SUNNonlinSol_FixedPoint(y_, 0, context_));
    require(CVodeSetNonlinearSolver(memory(), fixed_point_.get()));
  }
  if (running_.empty()) return;
  const Eigen::Index count = static_cast<Eigen::Index>(running_.size());
  Vector none(count, context_), atol(count, context_);
  *atol = quadrature_atol();
  require(CVodeQuadInit(memory(), g, none));
  require(CVodeQuadSVtolerances(memory(), s.rtol, atol));
  require(CVodeSetQuadErrCon(memory(), SUNTRUE));
}

// An integral's absolute tolerance is the larger of atol and rtol times its rate at the start times the whole span. The
// exponential of a smooth maximum may have any size.
Eigen::VectorXd ForwardRun::quadrature_atol() const {
  Eigen::VectorXd atol(static_cast<Eigen::Index>(running_.size()));
  const Eigen::VectorXd& y = assembly_.result().y;
  std::optional<MotionSolver> motion;
  if (mechanism_.data().needs_motion) motion.emplace(mechanism_, settings_.formulation);
  for (std::size_t k = 0; k < running_.size(); ++k) {
    const double rate = std::abs(costs_[static_cast<std::size_t>(running_[k])].running->value(
        {settings_.start_time, y, assembly_.result().angles, motion ? &*motion : nullptr}));
    const double size = rate < kLargestRate ? rate * (settings_.end_time - settings_.start_time) : 0;
    atol(static_cast<Eigen::Index>(k)) = std::max(settings_.integrator.atol, settings_.integrator.rtol * size);
  }
  return atol;
}

double ForwardRun::bounded(double value, std::size_t quadrature) {
  if (!(std::abs(value) <= kLargestRate)) left_range_[quadrature] = true;
  return left_range_[quadrature] ? 0 : value;
}

int ForwardRun::f(realtype t, N_Vector y, N_Vector ydot, void* self) {
  Flow& flow = static_cast<ForwardRun*>(self)->flow_;
  return flow.thrown().keep([&] {
    if (!flow.evaluate(t, values(y))) return kTryASmallerStep;
    values(ydot) = flow.ydot();
    return kOk;
  });
}

// CVODES' own norm is the root mean square of y_i w_i, too.
int ForwardRun::weights(N_Vector y, N_Vector w, void* self) {
  const ComponentTolerances& tolerances = static_cast<ForwardRun*>(self)->tolerances_;
  for (Eigen::Index i = 0; i < values(y).size(); ++i) values(w)(i) = 1 / tolerances.of(i, std::abs(values(y)(i)));
  return kOk;
}

int ForwardRun::g(realtype t, N_Vector y, N_Vector gdot, void* self) {
  ForwardRun& run = *static_cast<ForwardRun*>(self);
  return run.flow_.thrown().keep([&] {
    const StatePoint at = run.flow_.point(t, values(y));
    for (std::size_t k = 0; k < run.running_.size(); ++k) {
      const PointCost& cost = *run.costs_[static_cast<std::size_t>(run.running_[k])].running;
      values(gdot)(static_cast<Eigen::Index>(k)) = run.bounded(cost.value(at), k);
    }
    return kOk;
  });
}

void ForwardRun::stop_for(int flag, double t, const char* of_what) {
  // h is the step that CVODES tried last. CVODES itself reports only the step that it proposed before its own
  // reductions.
  const double h = std::abs(flow_.last_time() - t);
  switch (flag) {
    case CV_RHSFUNC_FAIL:
    case CV_FIRST_RHSFUNC_ERR:
    case CV_REPTD_RHSFUNC_ERR:
    case CV_UNREC_RHSFUNC_ERR:
    case CV_SRHSFUNC_FAIL:
    case CV_FIRST_SRHSFUNC_ERR:
    case CV_REPTD_SRHSFUNC_ERR:
    case CV_UNREC_SRHSFUNC_ERR:
      stop(SimulationStatus::not_finite,
           fmt::format(
               "{} cannot be computed beyond t = {:.6g} s, however small the step. Look for a law or force that is "
               "not finite there (a root, logarithm or division outside its range), or for a body without "
               "inertia in a direction that no joint holds",
               of_what, t));
      return;
    case CV_TOO_MUCH_ACC:
      stop(SimulationStatus::step_too_small, too_few_digits(settings_.integrator, t));
      return;
    case CV_TOO_MUCH_WORK:
      stop(SimulationStatus::too_many_steps,
           fmt::format(
               "more than {} steps were needed; stopped at t = {:.6g} s. Loosen rtol and atol, raise "
               "simulation.integrator.max_steps{}",
               settings_.integrator.max_steps, t,
               is_stiff_method(settings_) ? "" : ", or take cvodes_bdf where springs or dampers are very stiff"));
      return;
    case CV_ERR_FAILURE:
    case CV_CONV_FAILURE:
    case CV_TOO_CLOSE:
    case CV_LSETUP_FAIL:
      // CVODES gives up if h is the smallest step, within its own tolerance of 1e-6.
      if (const auto min_step = settings_.integrator.options.min_step; min_step && h <= *min_step * (1 + 1e-6)) {
        stop(SimulationStatus::step_too_small,
             below_min_step(flag == CV_ERR_FAILURE ? StepOutcome::rejected : StepOutcome::unsolved, t, *min_step));
        return;
      }
      stop(SimulationStatus::step_too_small,
           fmt::format("no step beyond t = {:.6g} s is small enough for the tolerances (the last one tried was {:.3g} "
                       "s). Look for {}a singular position, a spring of zero length or a law that is not smooth near "
                       "this time; CVODES does not project onto the constraints, a Runge-Kutta method may pass it",
                       t, h, about_quadratures()));
      return;
    default:
      stop(SimulationStatus::step_too_small, fmt::format("CVODES stopped at t = {:.6g} s: {}", t, last_words_));
  }
}

// Names the running costs if their integrals demanded smaller steps.
std::string ForwardRun::about_quadratures() const {
  long fails = 0;
  if (!running_.empty()) CVodeGetQuadNumErrTestFails(memory(), &fails);
  if (fails == 0) return {};
  std::string names;
  for (const Eigen::Index o : running_) {
    const std::string& name = costs_[static_cast<std::size_t>(o)].name;
    if (!name.empty()) names += (names.empty() ? " of objective '" : ", '") + name + "'";
  }
  return "a pole or jump of the running cost" + names + ", ";
}

// The branch is the nearest one, so a joint must not turn by half a turn in one step.
bool ForwardRun::step_is_followed(double h, const Eigen::VectorXd& y) {
  for (const JointAngle& a : mechanism_.data().angles) {
    const double rate = std::abs(a.rate(body_at(y, a.body1).frame, body_at(y, a.body2).frame));
    if (rate * h <= 3) continue;
    stop(SimulationStatus::step_too_large,
         fmt::format("at t = {:.6g} s a joint whose angle is used turns by {:.3g} rad in one step of {:.3g} s; more "
                     "than half a turn cannot be followed: set simulation.integrator.max_step",
                     result_.last_good_time, rate * h, h));
    return false;
  }
  return true;
}

Energy ForwardRun::update_statistics(double t, const Eigen::VectorXd& y) {
  SimulationStatistics& s = result_.statistics;
  const Eigen::VectorXd& angles = flow_.angles_at(t);
  double relative = 0;
  s.max_position_violation =
      std::max(s.max_position_violation, violations_->position_violation(t, angles, y, &relative));
  s.relative_position_violation = std::max(s.relative_position_violation, relative);
  s.max_velocity_violation = std::max(s.max_velocity_violation, violations_->velocity_violation(t, y));
  const Energy e = energy(mechanism_.data(), y, angles);
  s.energy_final = e.kinetic + e.potential;
  s.energy_drift = std::max(s.energy_drift, std::abs(s.energy_final - s.energy_initial));
  return e;
}

void ForwardRun::take_samples(SampleSchedule& schedule, double t, const Hooks& hooks) {
  for (const SampleEvent& e : schedule.take(t)) {
    require(CVodeGetDky(memory(), e.time, 0, y_sample_));
    const StatePoint at = flow_.point(e.time, *y_sample_);
    if (e.cost) result_.psi(e.objective) += e.cost->value(at);
    if (hooks.sampled) hooks.sampled(e, at);
  }
}

// Counts the steps of the state and those of its derivatives.
void ForwardRun::count_steps() {
  long state = 0, derivatives = 0, not_converged = 0, iterations = 0, their_iterations = 0;
  CVodeGetNumErrTestFails(memory(), &state);
  CVodeGetNumStepSolveFails(memory(), &not_converged);
  CVodeGetNumNonlinSolvIters(memory(), &iterations);
  if (sensitivities_) {
    CVodeGetSensNumErrTestFails(memory(), &derivatives);
    CVodeGetSensNumNonlinSolvIters(memory(), &their_iterations);
  }
  SimulationStatistics& s = result_.statistics;
  s.rejections.error_test = state + derivatives;
  s.rejections.not_converged = not_converged;
  s.rejected = s.rejections.error_test + not_converged;
  if (is_stiff_method(settings_)) s.newton_iterations = iterations + their_iterations;
  s.linear_solves = flow_.evaluations() + linear_solver_.solves();
}

// The latest end of the step at t. CVODES cannot take back a step that passes over a pulse, so it must end before.
double ForwardRun::stop_before_pulse(double t, PulseWatch& pulses) {
  constexpr double kMissed = 10;       // tolerances, as of other methods (runge_kutta_run.cpp)
  constexpr double kShortest = 1e-10;  // of the run
  const double left = settings_.end_time - t;
  double h = 0;
  CVodeGetCurrentStep(memory(), &h);  // that of the next step; 0 before the first one, which is short
  h = std::min(h, left);
  const auto is_missed = [&](const PulseWatch::Doubt& doubt) {
    if (doubt.share > 0) return doubt.share > kMissed * settings_.integrator.rtol;
    const Flow::Numbers y(y_now_.data(), y_now_.size());
    if (!flow_.evaluate(doubt.beside, y)) return false;
    y_change_ = flow_.ydot();
    if (!flow_.evaluate(doubt.at, y)) return false;
    y_change_ = doubt.duration * (flow_.ydot() - y_change_);
    return scaled_norm(y_change_, y_now_, y_now_, tolerances_) > kMissed;
  };
  bool shorter = false;
  while (h > kShortest * (settings_.end_time - settings_.start_time) &&
         std::ranges::any_of(pulses.doubts(t, h), is_missed))
    h /= 2, shorter = true;
  return shorter ? t + h : settings_.end_time;
}

// One internal step from t to t1. Returns false, with the reason in the result, if there is none.
bool ForwardRun::advance(double t, const Hooks& hooks, double& t1) {
  count_steps();
  if (result_.statistics.steps + result_.statistics.rejected >= settings_.integrator.max_steps) {
    stop_for(CV_TOO_MUCH_WORK, t, "");
    return false;
  }
  const double end = settings_.end_time;
  t1 = t;
  const int flag = hooks.advance ? hooks.advance(end, y_, &t1) : CVode(memory(), end, y_, &t1, CV_ONE_STEP);
  flow_.thrown().throw_on();
  if (flag < 0) {
    stop_for(flag, t, "the accelerations or their derivatives");
  } else if (t1 <= t) {
    stop_for(CV_ERR_FAILURE, t, "");
  }
  return result_.ok();
}

void ForwardRun::go(std::span<const double> observed, const RunOptions& options, const Hooks& hooks) {
  if (!result_.ok()) return;
  const double end = settings_.end_time;
  SampleSchedule schedule(costs_, observed, end);
  const Energy e = energy(mechanism_.data(), y_now_, assembly_.result().angles);
  result_.statistics.energy_initial = result_.statistics.energy_final = e.kinetic + e.potential;
  double t = settings_.start_time, t1 = t;
  RunGuard guard(mechanism_.data());
  const std::string at_start = guard.begin(t, y_now_, e, end, settings_.integrator.max_steps);
  if (!at_start.empty()) return stop(SimulationStatus::not_credible, at_start);
  const bool derivatives = hooks.advance || sensitivities_;
  std::optional<JumpWatch> jumps;
  if (derivatives) {
    jumps.emplace(mechanism_, settings_, costs_, flow_.motion());
    jumps->begin({t, y_now_, assembly_.result().angles, flow_.motion()});
  }
  // CVODES sees the rates at the ends of a step.
  PulseWatch pulses(mechanism_, costs_, t, end, {{0, 0.5, 0.5}, {1, 0.5, -0.5}});
  Eigen::VectorXd y_before;
  while (t < end) {
    require(CVodeSetStopTime(memory(), stop_before_pulse(t, pulses)));
    if (!advance(t, hooks, t1)) break;
    y_before = y_now_;
    y_now_ = *y_;
    if (!step_is_followed(t1 - t, y_now_)) break;
    ++result_.statistics.steps;
    result_.steps.times.push_back(t);
    result_.steps.sizes.push_back(t1 - t);
    flow_.accept(t1, y_now_);
    const Energy energy_now = update_statistics(t1, y_now_);
    std::string objection = guard.objection(t1, y_now_, energy_now, flow_.worst_residual());
    if (objection.empty() && derivatives) objection = through_zero_length(mechanism_.data(), t, y_before, t1, y_now_);
    if (!objection.empty()) {
      stop(SimulationStatus::not_credible, objection);
      break;
    }
    t = result_.last_good_time = t1;
    take_samples(schedule, t, hooks);
    const StatePoint here{t, y_now_, flow_.angles_at(t), flow_.motion()};
    if (jumps) jumps->look_at(here);
    if (hooks.accepted) hooks.accepted(here);
    if (options.after_step) options.after_step(here);
    if (options.progress && !options.progress(t)) {
      stop(SimulationStatus::stopped, fmt::format("stopped at t = {:.6g} s", t));
      break;
    }
  }
  count_steps();
  result_.statistics.relative_energy_drift = guard.relative_energy_drift();
  result_.y_end = y_now_;
  if (jumps) jumps->add_to(result_.statistics);
  if (result_.ok()) finish_costs();
}

void ForwardRun::finish_costs() {
  double t = settings_.end_time;
  if (!running_.empty()) {
    Vector integrals(static_cast<Eigen::Index>(running_.size()), context_);
    require(CVodeGetQuad(memory(), &t, integrals));
    for (std::size_t k = 0; k < running_.size(); ++k) {
      result_.psi(running_[k]) +=
          left_range_[k] ? std::numeric_limits<double>::infinity() : (*integrals)(static_cast<Eigen::Index>(k));
    }
  }
  const StatePoint at{settings_.end_time, y_now_, flow_.angles_at(settings_.end_time), flow_.motion()};
  for (std::size_t o = 0; o < costs_.size(); ++o) {
    if (costs_[o].terminal) result_.psi(static_cast<Eigen::Index>(o)) += costs_[o].terminal->value(at);
  }
  if (!result_.psi.allFinite()) {
    stop(SimulationStatus::not_finite, not_finite_costs(costs_, result_.psi));
  }
}

SimulationResult ForwardRun::finish() {
  SimulationStatistics& s = result_.statistics;
  s.rhs_evaluations += flow_.evaluations();
  s.factorisations += flow_.dynamics().solver().factorisations() + linear_solver_.factorisations();
  const double worst = flow_.worst_residual(), t = result_.last_good_time;
  s.weak_joints_error = error_of_weak_joints(mechanism_, settings_.formulation, worst, t, y_now_, flow_.angles_at(t));
  s.max_acceleration_residual = std::max(worst, s.weak_joints_error);
  s.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  return std::move(result_);
}

}  // namespace mbsopt::cvodes
