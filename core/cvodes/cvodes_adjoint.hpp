// Adjoint sensitivities by CVODES. lambda has one column per objective. One backward problem holds all columns, which
// share each solution of the equations of motion. lambda and mu solve
//   lambda' = -f_y'lambda - g_y,      mu' = -(f_rho'lambda + g_rho),
// backward from lambda(T) = d terminal/dy, mu(T) = d terminal/drho. At the time of a sampled cost lambda jumps by its
// gradient. A multistep method cannot step over a jump: it starts again there, at order one. mu is a quadrature with an
// error control of its own. Its steps are bounded by the forward ones. The forward solution is the method's polynomial
// between stored steps. CVODES uses checkpoints if there are too many steps to store.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "core/cvodes/cvodes_run.hpp"

namespace mbsopt::cvodes {

class Adjoint {
 public:
  Adjoint(ForwardRun& run, const SimulationSettings& settings, std::span<const Cost> costs);
  Adjoint(const Adjoint&) = delete;
  Adjoint& operator=(const Adjoint&) = delete;

  // Takes a step of the forward run and keeps what the backward run needs.
  int advance(double end, N_Vector y, double* t);
  void take_sample(const SampleEvent& event, const StatePoint& at);
  void take_step(const StatePoint& at);
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
  void begin();                                          // terminal costs
  void take_jumps(double t);                             // of samples at or after t
  void create_backward();
  double largest_step(double t) const;
  bool go_back_to(double t, double from, const RunOptions& options);
  void failed(int flag);

  ForwardRun& run_;
  const SimulationSettings settings_;
  std::span<const Cost> costs_;
  Eigen::Index states_, objectives_, active_;
  long kept_steps_;
  // Room for the steps that the first CVodeF allocates. SUNDIALS 6.4.1 crashes without memory; std::bad_alloc does not.
  std::unique_ptr<std::byte[]> room_;
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
  Eigen::VectorXd w_, y_bar_, theta_bar_, rho_bar_;

  Vector lambda_vector_, mu_vector_;
  LinearSolver linear_solver_;
  NonlinearSolver fixed_point_;
};

}  // namespace mbsopt::cvodes
