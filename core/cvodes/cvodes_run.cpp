#include "core/cvodes/cvodes_run.hpp"

#include <fmt/format.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <stdexcept>

#include "core/cvodes/cvodes.hpp"
#include "core/run/run_ends.hpp"
#include "core/start/model_warnings.hpp"
#include "core/step/step_control.hpp"
#include "core/step/step_failure.hpp"
#include "core/tableau/tableaus.hpp"
#include "core/watch/jump_watch.hpp"
#include "core/watch/run_guard.hpp"
#include "core/watch/weak_joints.hpp"
#include "core/watch/zero_length.hpp"

namespace mbsopt::cvodes {
namespace {

// Numbers up to this one have a finite square, also after division by tolerances.
constexpr double kLargestRate = 1e120;
constexpr long kMostIterations = std::numeric_limits<int>::max();

const SimulationSettings& possible(const SimulationSettings& settings, const RunOptions& options) {
  const std::string& type = settings.integrator.type;
  if (!is_cvodes(type)) throw std::invalid_argument(fmt::format("integrator '{}' is not one of CVODES'", type));
  if (settings.integrator.step) {
    throw std::invalid_argument(
        fmt::format("integrator '{}' chooses its own steps: give rtol and atol, no step", type));
  }
  if (!settings.events.empty()) {
    throw std::invalid_argument(fmt::format("integrator '{}' does not end steps at simulation.events", type));
  }
  if (options.frozen) {
    throw std::invalid_argument(
        fmt::format("integrator '{}' cannot repeat the steps of another run: its steps and orders are its own", type));
  }
  return settings;
}

}  // namespace

bool is_stiff_method(const SimulationSettings& settings) { return settings.integrator.type == "cvodes_bdf"; }

ForwardRun::ForwardRun(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                       const RunOptions& options)
    : mechanism_(mechanism),
      settings_(possible(settings, options)),
      costs_(costs),
      options_(options),
      assembly_(mechanism, settings.start_time),
      result_(result_at_start(assembly_, settings.start_time, costs.size())),
      tolerances_(mechanism.data(), settings.integrator),
      flow_(mechanism, settings.formulation),
      violations_(make_projector(mechanism, Projection::none)),
      y_(mechanism.states(), context_),
      y_sample_(mechanism.states(), context_),
      linear_solver_(flow_, context_) {
  y_now_ = assembly_.result().y;
  for (std::size_t o = 0; o < costs.size(); ++o)
    if (costs[o].running) running_.push_back({costs[o].running.get(), static_cast<Eigen::Index>(o)});
  left_range_.assign(running_.size(), false);
  if (!result_.ok()) return;
  flow_.start(settings.start_time, assembly_.result().angles);
  *y_ = assembly_.result().y;
  if (!flow_.evaluate(settings.start_time, *y_) || !massless_bodies(mechanism, assembly_).empty()) {
    result_.stop(SimulationStatus::not_finite, start_failure(mechanism_.data(), settings.start_time));
    return;
  }
  set_up();
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
Eigen::VectorXd ForwardRun::quadrature_atol() {
  Eigen::VectorXd atol(static_cast<Eigen::Index>(running_.size()));
  const StatePoint start{settings_.start_time, assembly_.result().y, assembly_.result().angles, flow_.motion()};
  for (std::size_t k = 0; k < running_.size(); ++k) {
    const double rate = std::abs(running_[k].cost->value(start));
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
      values(gdot)(static_cast<Eigen::Index>(k)) = run.bounded(run.running_[k].cost->value(at), k);
    }
    return kOk;
  });
}

void ForwardRun::stop_for(int flag, double t, const char* of_what) {
  // h is the step that CVODES tried last. CVODES itself reports only the step that it proposed before its own
  // reductions.
  const double h = std::abs(flow_.last_time() - t);
  const auto is = [&](std::initializer_list<int> flags) { return std::ranges::find(flags, flag) != flags.end(); };
  if (is({CV_RHSFUNC_FAIL, CV_FIRST_RHSFUNC_ERR, CV_REPTD_RHSFUNC_ERR, CV_UNREC_RHSFUNC_ERR, CV_SRHSFUNC_FAIL,
          CV_FIRST_SRHSFUNC_ERR, CV_REPTD_SRHSFUNC_ERR, CV_UNREC_SRHSFUNC_ERR}))
    return result_.stop(SimulationStatus::not_finite, not_computable(of_what, t));
  if (flag == CV_TOO_MUCH_ACC)
    return result_.stop(SimulationStatus::step_too_small, too_few_digits(settings_.integrator, t));
  if (flag == CV_TOO_MUCH_WORK)
    return result_.stop(
        SimulationStatus::too_many_steps,
        fmt::format("more than {} steps were needed; stopped at t = {:.6g} s. Loosen rtol and atol, raise "
                    "simulation.integrator.max_steps{}",
                    settings_.integrator.max_steps, t,
                    is_stiff_method(settings_) ? "" : ", or take cvodes_bdf where springs or dampers are very stiff"));
  if (!is({CV_ERR_FAILURE, CV_CONV_FAILURE, CV_TOO_CLOSE, CV_LSETUP_FAIL}))
    return result_.stop(SimulationStatus::step_too_small,
                        fmt::format("CVODES stopped at t = {:.6g} s: {}", t, last_words_));
  // CVODES gives up if h is the smallest step, within its own tolerance of 1e-6.
  if (const auto min_step = settings_.integrator.options.min_step; min_step && h <= *min_step * (1 + 1e-6))
    return result_.stop(
        SimulationStatus::step_too_small,
        below_min_step(flag == CV_ERR_FAILURE ? StepOutcome::rejected : StepOutcome::unsolved, t, *min_step));
  result_.stop(
      SimulationStatus::step_too_small,
      fmt::format("no step beyond t = {:.6g} s is small enough for the tolerances (the last one tried was {:.3g} "
                  "s). Look for {}a singular position, a spring of zero length or a law that is not smooth near "
                  "this time; CVODES does not project onto the constraints, a Runge-Kutta method may pass it",
                  t, h, about_quadratures()));
}

// Names the running costs if their integrals demanded smaller steps.
std::string ForwardRun::about_quadratures() const {
  long fails = 0;
  if (!running_.empty()) CVodeGetQuadNumErrTestFails(memory(), &fails);
  if (fails == 0) return {};
  std::string names;
  for (const Running& r : running_) {
    const std::string& name = costs_[static_cast<std::size_t>(r.objective)].name;
    if (!name.empty()) names += (names.empty() ? " of objective '" : ", '") + name + "'";
  }
  return "a pole or jump of the running cost" + names + ", ";
}

// The branch is the nearest one, so a joint must not turn by half a turn in one step.
bool ForwardRun::step_is_followed(double h) {
  const double turn = h * fastest_followed_rate(mechanism_.data(), y_now_);
  if (turn <= 3) return true;
  result_.stop(
      SimulationStatus::step_too_large,
      fmt::format("at t = {:.6g} s a joint whose angle is used turns by {:.3g} rad in one step of {:.3g} s; more "
                  "than half a turn cannot be followed: set simulation.integrator.max_step",
                  result_.last_good_time, turn, h));
  return false;
}

StatePoint ForwardRun::inside(double t) {
  require(CVodeGetDky(memory(), t, 0, y_sample_));
  return flow_.point(t, *y_sample_);
}

void ForwardRun::take_samples(SampleSchedule& schedule, double t) {
  for (const SampleEvent& e : schedule.take(t)) {
    const StatePoint at = inside(e.time);
    if (e.cost) result_.psi(e.objective) += e.cost->value(at);
    follower_->take_sample(e, at);
  }
}

// Counts the steps of the state and those of its derivatives.
void ForwardRun::count_steps() {
  SimulationStatistics& s = result_.statistics;
  long iterations = 0;
  CVodeGetNumErrTestFails(memory(), &s.rejections.error_test);
  CVodeGetNumStepSolveFails(memory(), &s.rejections.not_converged);
  CVodeGetNumNonlinSolvIters(memory(), &iterations);
  follower_->count(memory(), s.rejections.error_test, iterations);
  s.rejected = s.rejections.error_test + s.rejections.not_converged;
  if (is_stiff_method(settings_)) s.newton_iterations = iterations;
  s.linear_solves = flow_.evaluations() + linear_solver_.solves();
}

// The latest end of the step at t. CVODES cannot take back a step that passes over a pulse, so it must end before.
double ForwardRun::stop_before_pulse(double t, PulseWatch& pulses) {
  const double end = settings_.end_time, shortest = PulseWatch::kShortest * (end - settings_.start_time);
  double h = 0;
  CVodeGetCurrentStep(memory(), &h);  // that of the next step; 0 before the first one, which is short
  h = std::min(h, end - t);
  const auto change = [&](double at, double beside, double duration) {
    const Flow::Numbers y(y_now_.data(), y_now_.size());
    if (!flow_.evaluate(beside, y)) return 0.0;
    y_change_ = flow_.ydot();
    if (!flow_.evaluate(at, y)) return 0.0;
    y_change_ = duration * (flow_.ydot() - y_change_);
    return scaled_norm(y_change_, y_now_, y_now_, tolerances_);
  };
  const double given = h;
  while (h > shortest && pulses.worst(t, h, true, y_now_, flow_.angles_at(t), change).error > PulseWatch::kMissed)
    h /= 2;
  return h < given ? t + h : end;
}

// One internal step from t to t1. Returns false, with the reason in the result, if there is none.
bool ForwardRun::advance(double t, double& t1) {
  count_steps();
  if (result_.statistics.steps + result_.statistics.rejected >= settings_.integrator.max_steps) {
    stop_for(CV_TOO_MUCH_WORK, t, "");
    return false;
  }
  t1 = t;
  const int flag = follower_->advance(memory(), settings_.end_time, y_, &t1);
  flow_.thrown().throw_on();
  if (flag < 0) {
    stop_for(flag, t, "the accelerations or their derivatives");
  } else if (t1 <= t) {
    stop_for(CV_ERR_FAILURE, t, "");
  }
  return result_.ok();
}

void ForwardRun::go(std::span<const double> observed, Follower& follower) {
  if (!result_.ok()) return;
  follower_ = &follower;
  const double end = settings_.end_time;
  double t = settings_.start_time, t1 = t;
  SampleSchedule schedule(costs_, observed, end);
  RunGuard guard(mechanism_.data(), *violations_, settings_, result_.statistics);
  ObserverOf lengths([&](const SeenStep& step) {
    return through_zero_length(mechanism_.data(), step.from.t, step.from.y, step.to.t, step.to.y);
  });
  ObserverOf samples([&](const SeenStep& step) {
    t = result_.last_good_time = step.to.t;
    take_samples(schedule, t);
    follower.take_step(step.to);
    if (follower.look_inside) follower.look_inside({step.from.t, t, {}, [&](double at) { return inside(at); }});
    return std::string();
  });
  std::optional<JumpWatch> jumps;
  std::vector<StepObserver*> observers{&guard};
  if (follower.differentiates())
    observers.insert(observers.end(), {&lengths, &jumps.emplace(mechanism_, settings_, costs_, flow_.motion(),
                                                                result_.statistics.jumps)});
  observers.push_back(&samples);
  // CVODES sees the rates at the ends of a step.
  PulseWatch pulses(mechanism_, settings_, costs_, {{0, 0.5, 0.5}, {1, 0.5, -0.5}});
  std::string words = objection_to_start(observers, {t, y_now_, assembly_.result().angles});
  if (!words.empty()) result_.stop(SimulationStatus::not_credible, std::move(words));
  while (t < end && result_.ok()) {
    require(CVodeSetStopTime(memory(), stop_before_pulse(t, pulses)));
    if (!advance(t, t1)) break;
    y_before_ = y_now_;
    y_now_ = *y_;
    if (!step_is_followed(t1 - t)) break;
    ++result_.statistics.steps;
    result_.steps.add(t, t1 - t);
    flow_.accept(t1, y_now_);
    const StatePoint before{t, y_before_, flow_.angles_at(t)}, here{t1, y_now_, flow_.angles_at(t1), flow_.motion()};
    words = objection_to({before, here, flow_.worst_residual()}, observers);
    if (words.empty()) {
      report_step(here, options_, result_);
    } else {
      result_.stop(SimulationStatus::not_credible, std::move(words));
    }
  }
  count_steps();
  result_.y_end = y_now_;
  if (!result_.ok()) return;
  add_integrals();
  add_terminal_costs(costs_, this->end(), result_);
}

void ForwardRun::add_integrals() {
  if (running_.empty()) return;
  double t = settings_.end_time;
  Vector integrals(static_cast<Eigen::Index>(running_.size()), context_);
  require(CVodeGetQuad(memory(), &t, integrals));
  for (std::size_t k = 0; k < running_.size(); ++k) {
    result_.psi(running_[k].objective) +=
        left_range_[k] ? std::numeric_limits<double>::infinity() : (*integrals)(static_cast<Eigen::Index>(k));
  }
}

StatePoint ForwardRun::end() {
  const double t = settings_.end_time;
  return {t, y_now_, flow_.angles_at(t), flow_.motion()};
}

SimulationResult ForwardRun::finish() {
  SimulationStatistics& s = result_.statistics;
  s.rhs_evaluations += flow_.evaluations();
  s.factorisations += flow_.dynamics().solver().factorisations() + linear_solver_.factorisations();
  const double t = result_.last_good_time;
  add_residuals(mechanism_, settings_.formulation, flow_.worst_residual(), {t, y_now_, flow_.angles_at(t)}, s);
  return std::move(result_);
}

}  // namespace mbsopt::cvodes

namespace mbsopt {

bool is_cvodes(std::string_view integrator) { return integrator == "cvodes_adams" || integrator == "cvodes_bdf"; }

SimulationSettings with_cvodes(SimulationSettings settings) {
  std::string& type = settings.integrator.type;
  const Method* method = runge_kutta_method(type);
  if (!is_cvodes(type)) {
    type = method && method->implicit() ? "cvodes_bdf" : "cvodes_adams";
    settings.integrator.options = {};  // the other method's
  }
  settings.integrator.step.reset();
  if (settings.solve == Solve::kinematics) settings.solve = Solve::automatic;
  return settings;
}

SimulationResult cvodes_simulate(const Mechanism& mechanism, const SimulationSettings& settings,
                                 std::span<const Cost> costs, const Sampling& sampling, const RunOptions& options) {
  cvodes::ForwardRun run(mechanism, settings, costs, options);
  cvodes::Follower observed(sampling);
  run.go(sampling.times, observed);
  return run.finish();
}

}  // namespace mbsopt
