// Forward sensitivities by CVODES: s_k = dy/drho_k solves
//   s_k' = f_y s_k + f_rho_k,     s_k(t0) = dy0/drho_k, through the assembly
// beside the state (staggered corrector), for all parameters at once. The sensitivities have an error control of their
// own: rtol, and atol over the parameter's size. Running costs integrate g_y s_k + g_rho_k under the same control.
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <vector>

#include "core/cvodes/cvodes.hpp"
#include "core/cvodes/cvodes_run.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt::cvodes {
namespace {

class Sensitivities final : public Follower {
 public:
  // Registers the sensitivities with CVODES, if a parameter is active.
  Sensitivities(ForwardRun& run, const SimulationSettings& settings, std::span<const Cost> costs,
                const TangentSampling& sampling);

  bool differentiates() const override { return !active_.empty(); }
  void take_sample(const SampleEvent& event, const StatePoint& at) override;
  void count(void* memory, long& failed_error_tests, long& iterations) const override;
  // Adds integrals and terminal costs, after the last step.
  void finish();

 private:
  static int f(int count, realtype t, N_Vector y, N_Vector ydot, N_Vector* s, N_Vector* sdot, void* run, N_Vector,
               N_Vector);
  static int g(int count, realtype t, N_Vector y, N_Vector* s, N_Vector gdot, N_Vector* gsdot, void* run, N_Vector,
               N_Vector);
  void register_with(const SimulationSettings& settings);
  void set_y_rho();
  // psi_rho of one objective += g_y S + g_rho
  void add_cost(const PointCost& cost, const StatePoint& at, Eigen::Index objective);

  ForwardRun& run_;
  std::span<const Cost> costs_;
  const TangentSampling& sampling_;
  const std::vector<int>& active_;
  const int count_;
  std::vector<ParameterBlock> blocks_;
  LaneRows direction_, change_;
  CostGradient bar_;
  Eigen::MatrixXd y_rho_;
  Eigen::MatrixXd& psi_rho_;  // of the result
  VectorArray s_;
  Vector rate_;  // dy/dt at a sample
  Owner<SUNNonlinearSolver> fixed_point_;
};

Sensitivities::Sensitivities(ForwardRun& run, const SimulationSettings& settings, std::span<const Cost> costs,
                             const TangentSampling& sampling)
    : run_(run),
      costs_(costs),
      sampling_(sampling),
      active_(run.flow().data().active),
      count_(static_cast<int>(active_.size())),
      blocks_(parameter_blocks(run.flow().data())),
      psi_rho_(run.result().psi_rho),
      s_(std::max(1, count_), run.flow().states(), run.context()),
      rate_(run.flow().states(), run.context()) {
  const Eigen::Index states = run.flow().states(), parameters = run.flow().data().rho.size();
  direction_.setZero(states, kLanes);
  change_.setZero(states, kLanes);
  bar_ = {Eigen::VectorXd(states), Eigen::VectorXd(parameters)};
  y_rho_.setZero(states, parameters);
  psi_rho_.setZero(static_cast<Eigen::Index>(costs.size()), parameters);
  if (count_ > 0 && run.result().ok()) register_with(settings);
}

void Sensitivities::register_with(const SimulationSettings& settings) {
  const Eigen::MatrixXd y0_rho = run_.assembly().tangent();
  std::vector<double> size, atol;
  for (int k = 0; k < count_; ++k) {
    const int parameter = active_[at(k)];
    s_.at(k) = y0_rho.col(parameter);
    size.push_back(parameter_size(run_.flow().data().rho(parameter)));
    atol.push_back(settings.integrator.atol / size.back());
  }
  void* memory = run_.memory();
  run_.require(CVodeSensInit(memory, count_, CV_STAGGERED, f, s_));
  run_.require(CVodeSensSStolerances(memory, settings.integrator.rtol, atol.data()));
  run_.require(CVodeSetSensErrCon(memory, SUNTRUE));
  if (!is_stiff_method(settings)) {
    fixed_point_.reset(SUNNonlinSol_FixedPointSens(count_, s_[0], 0, run_.context()));
    run_.require(CVodeSetNonlinearSolverSensStg(memory, fixed_point_.get()));
  }
  if (run_.running().empty()) return;
  const Eigen::Index quadratures = static_cast<Eigen::Index>(run_.running().size());
  VectorArray none(count_, quadratures, run_.context()), tolerances(count_, quadratures, run_.context());
  const Eigen::VectorXd atol_g = run_.quadrature_atol();
  for (int k = 0; k < count_; ++k) tolerances.at(k) = atol_g / size[at(k)];
  run_.require(CVodeQuadSensInit(memory, g, none));
  run_.require(CVodeQuadSensSVtolerances(memory, settings.integrator.rtol, tolerances));
  run_.require(CVodeSetQuadSensErrCon(memory, SUNTRUE));
}

int Sensitivities::f(int count, realtype t, N_Vector y, N_Vector, N_Vector* s, N_Vector* sdot, void* run, N_Vector,
                     N_Vector) {
  Sensitivities& self = static_cast<Sensitivities&>(static_cast<ForwardRun*>(run)->follower());
  return self.run_.flow().thrown().keep([&] {
    Flow& flow = self.run_.flow();
    if (!flow.linearise(t, values(y))) return kTryASmallerStep;
    for (std::size_t c = 0; c < self.blocks_.size(); ++c) {
      const int first = kLanes * static_cast<int>(c), lanes = std::min(kLanes, count - first);
      for (int k = 0; k < lanes; ++k) self.direction_.col(k) = values(s[first + k]);
      flow.dynamics().tangent(self.blocks_[c], self.direction_, self.change_);
      for (int k = 0; k < lanes; ++k) values(sdot[first + k]) = self.change_.col(k);
      if (!self.change_.leftCols(lanes).allFinite()) return kTryASmallerStep;
    }
    return kOk;
  });
}

int Sensitivities::g(int count, realtype t, N_Vector y, N_Vector* s, N_Vector, N_Vector* gsdot, void* run, N_Vector,
                     N_Vector) {
  Sensitivities& self = static_cast<Sensitivities&>(static_cast<ForwardRun*>(run)->follower());
  return self.run_.flow().thrown().keep([&] {
    const StatePoint at = self.run_.flow().point(t, values(y));
    for (std::size_t q = 0; q < self.run_.running().size(); ++q) {
      self.bar_.set(*self.run_.running()[q].cost, at, 1);
      for (int k = 0; k < count; ++k) {
        const double rate = self.bar_.y.dot(values(s[k])) + self.bar_.rho(self.active_[mbsopt::at(k)]);
        values(gsdot[k])(static_cast<Eigen::Index>(q)) = self.run_.bounded(rate, q);
      }
    }
    return kOk;
  });
}

void Sensitivities::add_cost(const PointCost& cost, const StatePoint& at, Eigen::Index objective) {
  if (count_ == 0) return;
  bar_.set(cost, at, 1);
  psi_rho_.row(objective) += bar_.rho.transpose() + bar_.y.transpose() * y_rho_;
}

void Sensitivities::set_y_rho() {
  for (std::size_t k = 0; k < active_.size(); ++k) y_rho_.col(active_[k]) = s_.at(static_cast<int>(k));
}

// Observers also get the rate of the state, which delays of measurements need.
void Sensitivities::take_sample(const SampleEvent& event, const StatePoint& at) {
  if (count_ > 0) run_.require(CVodeGetSensDky(run_.memory(), event.time, 0, s_));
  set_y_rho();
  if (event.cost) return add_cost(*event.cost, at, event.objective);
  if (!sampling_.observe) return;
  run_.require(CVodeGetDky(run_.memory(), event.time, 1, rate_));
  const Eigen::VectorXd ydot = *rate_;
  StatePoint with_rate = at;
  with_rate.ydot = &ydot;
  sampling_.observe(event.index, with_rate, y_rho_);
}

void Sensitivities::count(void* memory, long& failed_error_tests, long& iterations) const {
  if (count_ == 0) return;
  long failed = 0, more = 0;
  CVodeGetSensNumErrTestFails(memory, &failed);
  CVodeGetSensNumNonlinSolvIters(memory, &more);
  failed_error_tests += failed;
  iterations += more;
}

void Sensitivities::finish() {
  if (count_ == 0) return;
  const StatePoint end = run_.end();
  double t = end.t;
  run_.require(CVodeGetSens(run_.memory(), &t, s_));
  set_y_rho();
  for (std::size_t o = 0; o < costs_.size(); ++o)
    if (costs_[o].terminal) add_cost(*costs_[o].terminal, end, static_cast<Eigen::Index>(o));
  if (run_.running().empty()) return;
  VectorArray integrals(count_, static_cast<Eigen::Index>(run_.running().size()), run_.context());
  run_.require(CVodeGetQuadSens(run_.memory(), &t, integrals));
  for (std::size_t k = 0; k < active_.size(); ++k) {
    for (std::size_t q = 0; q < run_.running().size(); ++q) {
      psi_rho_(run_.running()[q].objective, active_[k]) +=
          integrals.at(static_cast<int>(k))(static_cast<Eigen::Index>(q));
    }
  }
}

}  // namespace
}  // namespace mbsopt::cvodes

namespace mbsopt {

SimulationResult cvodes_forward(const Mechanism& mechanism, const SimulationSettings& settings,
                                std::span<const Cost> costs, const TangentSampling& sampling,
                                const RunOptions& options) {
  cvodes::ForwardRun run(mechanism, settings, costs, options);
  cvodes::Sensitivities sensitivities(run, settings, costs, sampling);
  run.go(sampling.times, sensitivities);
  if (run.result().ok()) sensitivities.finish();
  return run.finish();
}

}  // namespace mbsopt
