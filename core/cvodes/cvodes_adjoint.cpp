// Adjoint sensitivities by CVODES. lambda has one column per objective. One backward problem holds all columns, which
// share each solution of the equations of motion. lambda and mu solve
//   lambda' = -f_y'lambda - g_y,      mu' = -(f_rho'lambda + g_rho),
// backward from lambda(T) = d terminal/dy, mu(T) = d terminal/drho. At the time of a sampled cost lambda jumps by its
// gradient. A multistep method cannot step over a jump: it starts again there, at order one. mu is a quadrature with an
// error control of its own. Its steps are bounded by the forward ones. The forward solution is the method's polynomial
// between stored steps. CVODES uses checkpoints if there are too many steps to store.
#include <fmt/format.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/cvodes/cvodes.hpp"
#include "core/cvodes/cvodes_run.hpp"
#include "core/run/run_ends.hpp"

namespace mbsopt::cvodes {
namespace {

// Memory for the steps between two checkpoints. CVODES holds all of them at once: forward, and again on the way back.
constexpr std::size_t kBytesOfSteps = std::size_t{32} << 20;
constexpr long kFewestSteps = 100, kMostSteps = 20'000;

long steps_between_checkpoints(Eigen::Index states) {
  const std::size_t bytes = sizeof(double) * static_cast<std::size_t>(states);
  return std::clamp(static_cast<long>(kBytesOfSteps / bytes), kFewestSteps, kMostSteps);
}

class Adjoint final : public Follower {
 public:
  Adjoint(ForwardRun& run, const SimulationSettings& settings, std::span<const Cost> costs);

  bool differentiates() const override { return true; }
  // Takes a step of the forward run and keeps what the backward run needs.
  int advance(void* memory, double end, N_Vector y, double* t) override {
    return CVodeF(memory, end, y, t, CV_ONE_STEP, &checkpoints_);
  }
  void take_sample(const SampleEvent& event, const StatePoint& at) override;
  void take_step(const StatePoint& at) override;
  // Integrates from the end to the start; run.result() says how it ended.
  void go_back(const RunOptions& options);
  const Eigen::MatrixXd& lambda() const { return lambda_; }  // at the start, 14n x objectives
  const Eigen::MatrixXd& mu() const { return mu_; }          // parameters x objectives
  std::size_t bytes() const;
  long factorisations() const { return linear_solver_.factorisations(); }

 private:
  struct Jump {
    double time;
    Eigen::Index objective;
    Eigen::VectorXd y_bar;
  };
  template <Eigen::VectorXd Adjoint::*Rate>
  static int rate(realtype t, N_Vector y, N_Vector lambda, N_Vector out, void* self);
  bool evaluate(double t, N_Vector y, N_Vector lambda);  // both rates
  void add_terminal_costs();
  void take_jumps(double t);  // of samples at or after t
  void create_backward();
  double largest_step(double t) const;
  bool go_back_to(double t, double from, const RunOptions& options);
  void failed(int flag);

  ForwardRun& run_;
  const SimulationSettings settings_;
  std::span<const Cost> costs_;
  Eigen::Index states_, objectives_, active_;
  long kept_steps_;
  int checkpoints_ = 0, which_ = -1;
  long steps_ = 0;  // of the backward run
  double tie_;      // times closer than this are one
  std::vector<Jump> jumps_;
  // Per objective: source_ is the largest entry of any gradient in y that enters. `running_source_` is the integral
  // over the steps so far of that of the running cost, and last_size_ its entry at the last step.
  Eigen::VectorXd source_, running_source_, last_size_;
  double last_time_;
  Eigen::MatrixXd lambda_, mu_;
  // The time and the results of the last evaluation.
  double t_;
  Eigen::VectorXd lambda_at_, lambda_rate_, mu_rate_;
  CostGradient bar_;
  Eigen::VectorXd w_, theta_bar_;

  Vector lambda_vector_, mu_vector_;
  LinearSolver linear_solver_;
  Owner<SUNNonlinearSolver> fixed_point_;
};

Adjoint::Adjoint(ForwardRun& run, const SimulationSettings& settings, std::span<const Cost> costs)
    : run_(run),
      settings_(settings),
      costs_(costs),
      states_(run.flow().states()),
      objectives_(static_cast<Eigen::Index>(costs.size())),
      active_(static_cast<Eigen::Index>(run.flow().data().active.size())),
      kept_steps_(steps_between_checkpoints(states_)),
      tie_(1e-12 * std::max(settings.end_time - settings.start_time,
                            std::max(std::abs(settings.start_time), std::abs(settings.end_time)))),
      t_(std::numeric_limits<double>::quiet_NaN()),
      lambda_vector_(states_ * objectives_, run.context()),
      mu_vector_(active_ * objectives_, run.context()),
      linear_solver_(run.flow(), run.context()) {
  const MechanismData& d = run.flow().data();
  for (Eigen::VectorXd* x : {&source_, &running_source_, &last_size_}) x->setZero(objectives_);
  last_time_ = settings.start_time;
  lambda_.setZero(states_, objectives_);
  mu_.setZero(d.rho.size(), objectives_);
  for (Eigen::VectorXd* x : {&lambda_at_, &lambda_rate_}) x->setZero(states_ * objectives_);
  mu_rate_.setZero(active_ * objectives_);
  w_.setZero(states_);
  bar_ = {Eigen::VectorXd::Zero(states_), Eigen::VectorXd::Zero(d.rho.size())};
  theta_bar_.setZero(d.slots());
  run.require(CVodeAdjInit(run.memory(), kept_steps_, CV_POLYNOMIAL));
}

std::size_t Adjoint::bytes() const {
  // A checkpoint holds the method's history: at most 13 states, 6 of BDF.
  const std::size_t vectors = static_cast<std::size_t>(kept_steps_) + 13 * static_cast<std::size_t>(checkpoints_ + 1);
  return sizeof(double) * static_cast<std::size_t>(states_) * (vectors + jumps_.size()) + run_.flow().history_bytes();
}

void Adjoint::take_sample(const SampleEvent& event, const StatePoint& at) {
  if (!event.cost) return;
  Jump jump{event.time, event.objective, Eigen::VectorXd::Zero(states_)};
  event.cost->add_gradient(at, 1, jump.y_bar, mu_.col(event.objective));
  double& source = source_(event.objective);
  source = std::max(source, jump.y_bar.cwiseAbs().maxCoeff());
  jumps_.push_back(std::move(jump));
}

// lambda can become as large as the integral of a running cost's gradient. The largest value times the span would be
// too much: it may belong to the first steps of a motion that dies out at once.
void Adjoint::take_step(const StatePoint& at) {
  for (const auto& [cost, o] : run_.running()) {
    bar_.set(*cost, at, 1);
    const double size = bar_.y.cwiseAbs().maxCoeff();
    if (!std::isfinite(size)) continue;
    running_source_(o) += (at.t - last_time_) * std::max(size, last_size_(o));
    last_size_(o) = size;
  }
  last_time_ = at.t;
}

void Adjoint::add_terminal_costs() {
  const StatePoint end = run_.end();
  for (Eigen::Index o = 0; o < objectives_; ++o) {
    const Cost& cost = costs_[static_cast<std::size_t>(o)];
    if (!cost.terminal) continue;
    cost.terminal->add_gradient(end, 1, lambda_.col(o), mu_.col(o));
    source_(o) = std::max(source_(o), lambda_.col(o).cwiseAbs().maxCoeff());
  }
  source_ = source_.cwiseMax(running_source_);
}

void Adjoint::take_jumps(double t) {
  while (!jumps_.empty() && jumps_.back().time >= t - tie_) {
    lambda_.col(jumps_.back().objective) += jumps_.back().y_bar;
    jumps_.pop_back();
  }
}

bool Adjoint::evaluate(double t, N_Vector y, N_Vector lambda) {
  if (t == t_ && values(lambda) == lambda_at_) return true;
  Flow& flow = run_.flow();
  if (!flow.linearise(t, values(y))) return false;
  const MechanismData& d = flow.data();
  const StatePoint at = flow.point(t, values(y));
  for (Eigen::Index o = 0; o < objectives_; ++o) {
    w_ = values(lambda).segment(o * states_, states_);
    bar_.y.setZero();
    bar_.rho.setZero();
    theta_bar_.setZero();
    flow.dynamics().add_adjoint(w_, bar_.y, theta_bar_, bar_.rho);
    const PointCost* const running = costs_[static_cast<std::size_t>(o)].running.get();
    if (running) running->add_gradient(at, 1, bar_.y, bar_.rho);
    d.add_to_rho(theta_bar_, bar_.rho);
    lambda_rate_.segment(o * states_, states_) = -bar_.y;
    for (Eigen::Index k = 0; k < active_; ++k)
      mu_rate_(o * active_ + k) = -bar_.rho(d.active[static_cast<std::size_t>(k)]);
  }
  const bool finite = lambda_rate_.allFinite() && mu_rate_.allFinite();
  t_ = finite ? t : std::numeric_limits<double>::quiet_NaN();
  lambda_at_ = values(lambda);
  return finite;
}

template <Eigen::VectorXd Adjoint::*Rate>
int Adjoint::rate(realtype t, N_Vector y, N_Vector lambda, N_Vector out, void* self) {
  Adjoint& adjoint = *static_cast<Adjoint*>(self);
  return adjoint.run_.flow().thrown().keep([&] {
    if (!adjoint.evaluate(t, y, lambda)) return kTryASmallerStep;
    values(out) = adjoint.*Rate;
    return kOk;
  });
}

void Adjoint::create_backward() {
  const IntegratorSettings& s = settings_.integrator;
  const bool stiff = is_stiff_method(settings_);
  void* memory = run_.memory();
  run_.require(CVodeCreateB(memory, stiff ? CV_BDF : CV_ADAMS, &which_));
  run_.require(CVodeInitB(memory, which_, rate<&Adjoint::lambda_rate_>, settings_.end_time, lambda_vector_));
  run_.require(CVodeSetUserDataB(memory, which_, this));
  // atol is meant for a state of size one. lambda has the size of psi divided by that of the state.
  Vector atol(states_ * objectives_, run_.context()), atol_mu(active_ * objectives_, run_.context());
  const MechanismData& d = run_.flow().data();
  for (Eigen::Index o = 0; o < objectives_; ++o) {
    const double atol_o = s.atol * (source_(o) > 0 ? source_(o) : 1);
    (*atol).segment(o * states_, states_).setConstant(atol_o);
    (*atol_mu).segment(o * active_, active_) =
        d.rho(d.active).unaryExpr([&](double rho) { return atol_o / parameter_size(rho); });
  }
  run_.require(CVodeSVtolerancesB(memory, which_, s.rtol, atol));
  run_.require(CVodeSetMaxNumStepsB(memory, which_, s.max_steps));
  if (s.options.min_step) run_.require(CVodeSetMinStepB(memory, which_, *s.options.min_step));
  if (stiff) {
    if (!linear_solver_.attach_backward(memory, which_)) run_.require(CV_ILL_INPUT);
  } else {
    fixed_point_.reset(SUNNonlinSol_FixedPoint(lambda_vector_, 0, run_.context()));
    run_.require(CVodeSetNonlinearSolverB(memory, which_, fixed_point_.get()));
  }
  if (active_ == 0) return;
  run_.require(CVodeQuadInitB(memory, which_, rate<&Adjoint::mu_rate_>, mu_vector_));
  run_.require(CVodeQuadSVtolerancesB(memory, which_, s.rtol, atol_mu));
  run_.require(CVodeSetQuadErrConB(memory, which_, SUNTRUE));
}

void Adjoint::failed(int flag) {
  double t = settings_.end_time;
  CVodeGetCurrentTime(CVodeGetAdjCVodeBmem(run_.memory(), which_), &t);
  run_.stop_for(flag, t, "the adjoint's rates");
  run_.result().message += ". This happened in the backward run of the adjoint";
}

// The largest step back from t that is at most twice any forward step it overlaps. Longer ones could pass over what the
// forward run met there.
double Adjoint::largest_step(double t) const {
  const StepSequence& steps = run_.result().steps;
  double least = std::numeric_limits<double>::infinity();
  for (auto j = static_cast<std::size_t>(std::ranges::lower_bound(steps.times, t) - steps.times.begin()); j-- > 0;) {
    const double before = t - (steps.times[j] + steps.sizes[j]);  // what lies between
    if (2 * std::min(least, steps.sizes[j]) <= before) return std::min(2 * least, before);
    least = std::min(least, steps.sizes[j]);
  }
  return 2 * least;
}

bool Adjoint::go_back_to(double t, double from, const RunOptions& options) {
  const IntegratorSettings& s = settings_.integrator;
  void* const backward = CVodeGetAdjCVodeBmem(run_.memory(), which_);
  constexpr double kShortest = 1e-10;  // of the run: nothing is met within it, where forward steps fall to rounding
  const double least =
      std::max(kShortest * (settings_.end_time - settings_.start_time), s.options.min_step.value_or(0));
  double h = 0;  // of the next step, which CVODES has chosen; the limit is for the one after it
  for (double now = from; now > t;) {
    const double largest = std::min(largest_step(now - h), s.max_step.value_or(INFINITY));
    run_.require(CVodeSetMaxStepB(run_.memory(), which_, std::max(largest, least)));
    const int flag = ++steps_ > s.max_steps ? CV_TOO_MUCH_WORK : CVodeB(run_.memory(), t, CV_ONE_STEP);
    run_.flow().thrown().throw_on();
    if (flag < 0) {
      failed(flag);
      return false;
    }
    run_.require(CVodeGetCurrentTime(backward, &now));
    run_.require(CVodeGetCurrentStep(backward, &h));
    h = std::abs(h);
    if (options.progress && !options.progress(settings_.end_time)) {
      run_.result().stop(SimulationStatus::stopped, fmt::format("stopped in the backward run, at t = {:.6g} s", now));
      return false;
    }
  }
  run_.require(CVodeGetDky(backward, t, 0, lambda_vector_));
  if (active_ > 0) run_.require(CVodeGetQuadDky(backward, t, 0, mu_vector_));
  lambda_ = Eigen::Map<const Eigen::MatrixXd>((*lambda_vector_).data(), states_, objectives_);
  return true;
}

void Adjoint::go_back(const RunOptions& options) {
  add_terminal_costs();
  take_jumps(settings_.end_time);
  *lambda_vector_ = lambda_.reshaped();
  create_backward();
  double from = settings_.end_time;
  while (from > settings_.start_time) {
    const double to =
        jumps_.empty() || jumps_.back().time <= settings_.start_time + tie_ ? settings_.start_time : jumps_.back().time;
    if (!go_back_to(to, from, options)) return;
    take_jumps(to);
    if (to > settings_.start_time) {
      *lambda_vector_ = lambda_.reshaped();
      run_.require(CVodeReInitB(run_.memory(), which_, to, lambda_vector_));
      if (active_ > 0) run_.require(CVodeQuadReInitB(run_.memory(), which_, mu_vector_));
    }
    from = to;
  }
  const std::vector<int>& active = run_.flow().data().active;
  for (Eigen::Index o = 0; o < objectives_; ++o) mu_(active, o) += (*mu_vector_).segment(o * active_, active_);
}

}  // namespace
}  // namespace mbsopt::cvodes

namespace mbsopt {

SimulationResult cvodes_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                std::span<const Cost> costs, const RunOptions& options) {
  if (costs.empty()) return cvodes_simulate(mechanism, settings, costs, {}, options);
  cvodes::ForwardRun run(mechanism, settings, costs, options);
  SimulationResult& result = run.result();
  result.psi_rho.setZero(static_cast<Eigen::Index>(costs.size()), mechanism.parameters());
  if (!result.ok()) return run.finish();
  cvodes::Adjoint adjoint(run, settings, costs);
  run.go({}, adjoint);
  if (!result.ok()) return run.finish();
  result.statistics.adjoint_memory_bytes = adjoint.bytes();
  adjoint.go_back(options);
  result.statistics.factorisations += adjoint.factorisations();
  if (result.ok()) add_start_gradient(run.assembly(), adjoint.lambda(), adjoint.mu(), result);
  return run.finish();
}

}  // namespace mbsopt
