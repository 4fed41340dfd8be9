// Forward integration by CVODES, one internal step at a time. The running costs are quadratures with error control.
// Samples come from the method's own interpolating polynomial and never force a step; the end time does. Observers and
// derivatives follow the run as its Follower.
#pragma once

#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/cvodes/cvodes_flow.hpp"
#include "core/cvodes/cvodes_handles.hpp"
#include "core/cvodes/cvodes_linear_solver.hpp"
#include "core/projection/projection.hpp"
#include "core/run/sample_schedule.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"
#include "core/start/assembly.hpp"
#include "core/step/component_tolerances.hpp"
#include "core/watch/pulse_watch.hpp"

namespace mbsopt::cvodes {

bool is_stiff_method(const SimulationSettings& settings);  // cvodes_bdf
// The return values of right-hand sides that CVODES calls.
inline constexpr int kOk = 0, kTryASmallerStep = 1;

// The size by which tolerances of a derivative are divided.
inline double parameter_size(double rho) { return rho == 0 ? 1 : std::abs(rho); }

// A follower takes the steps and samples of a forward run: it observes the samples, or carries derivatives along.
struct Follower {
  explicit Follower(const Sampling& sampling = {}) : observe(sampling.observe), look_inside(sampling.look_inside) {}
  virtual ~Follower() = default;
  virtual bool differentiates() const { return false; }
  // Takes one step towards end.
  virtual int advance(void* memory, double end, N_Vector y, double* t) { return CVode(memory, end, y, t, CV_ONE_STEP); }
  virtual void take_sample(const SampleEvent& event, const StatePoint& at) {  // of a cost, or an observation
    if (!event.cost && observe) observe(event.index, at);
  }
  virtual void take_step(const StatePoint&) {}
  // Adds those of the derivatives.
  virtual void count(void* /*memory*/, long& /*failed_error_tests*/, long& /*iterations*/) const {}

  std::function<void(std::size_t index, const StatePoint& at)> observe;
  std::function<void(const StepInside&)> look_inside;
};

class ForwardRun {
 public:
  // Throws std::invalid_argument for a type that CVODES does not have, a fixed step, or frozen steps.
  ForwardRun(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
             const RunOptions& options);
  ForwardRun(const ForwardRun&) = delete;
  ForwardRun& operator=(const ForwardRun&) = delete;

  const Assembly& assembly() const { return assembly_; }
  const Context& context() const { return context_; }
  void* memory() const { return memory_.get(); }
  Flow& flow() { return flow_; }
  SimulationResult& result() { return result_; }
  struct Running {
    const PointCost* cost;
    Eigen::Index objective;
  };
  const std::vector<Running>& running() const { return running_; }
  Eigen::VectorXd quadrature_atol();  // of each of these

  // From assembly to the end, with values of all costs; result() says how it ended.
  void go(std::span<const double> observed, Follower& follower);
  Follower& follower() const { return *follower_; }  // during go()
  // The value of a running cost, or of its derivative. A value beyond the range of a quadrature makes psi not finite,
  // as an infinite sum would. From then on 0 is integrated, since so large a derivative may change its sign within
  // rounding.
  double bounded(double g, std::size_t quadrature);
  StatePoint end();  // of the run

  void require(int flag) const;  // throws std::runtime_error where CVODES refused what is always right
  // The meaning of a negative return value, in words.
  void stop_for(int flag, double t, const char* of_what);
  std::string about_quadratures() const;
  SimulationResult finish();

 private:
  void set_up();
  bool step_is_followed(double h);
  double stop_before_pulse(double t, PulseWatch& pulses);
  bool advance(double t, double& t1);
  StatePoint inside(double t);  // the last step, until the next call
  void take_samples(SampleSchedule& schedule, double t);
  void add_integrals();
  void count_steps();  // rejected ones, and the work of their solutions
  static int f(realtype t, N_Vector y, N_Vector ydot, void* self);
  static int g(realtype t, N_Vector y, N_Vector gdot, void* self);
  static int weights(N_Vector y, N_Vector w, void* self);  // of the norm of errors

  const Mechanism mechanism_;
  const SimulationSettings settings_;
  std::span<const Cost> costs_;
  const RunOptions& options_;
  Assembly assembly_;
  SimulationResult result_;
  ComponentTolerances tolerances_;
  Flow flow_;
  std::unique_ptr<Projector> violations_;
  std::vector<Running> running_;
  std::vector<bool> left_range_;
  std::string last_words_;  // of CVODES
  Follower* follower_ = nullptr;
  Eigen::VectorXd y_before_, y_now_, y_change_;  // at the ends of the last step

  Context context_;
  Vector y_, y_sample_;
  LinearSolver linear_solver_;
  Owner<SUNNonlinearSolver> fixed_point_;
  Owner<void*> memory_;
};

}  // namespace mbsopt::cvodes
