// The least-squares problem of an identification in the scaled variables of variable_scaling.hpp. The residuals of its
// experiments stand one below the other; one residual per prior follows. Last come the equations of experiments that
// continue each other:
//
//   z = [ z_1; z_2; ...; (u_k - mean_k)/sigma_k for each unknown with a prior; s(end of e) - s(start of e + 1); ... ]
//
// The loss does not see priors. A value free in several experiments has its prior in each. s is the chart of the later
// experiment's start (experiment.hpp).
//
//   ExperimentStack stack(std::move(experiments), unknowns, spec.loss);
//   LeastSquaresResult fit = solve_least_squares(stack, stack.start());
#pragma once

#include <functional>
#include <map>
#include <tuple>
#include <vector>

#include "optim/fit/score_variance.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "optim/problem/variable_scaling.hpp"
#include "optim/solver/least_squares.hpp"

namespace mbsopt::inline optim {

class ExperimentStack : public LeastSquaresProblem {
 public:
  struct Member {
    std::size_t experiment;  // in the identification
    Experiment model;
    bool continues = false;  // into the next member
    bool follows = false;    // in time, in the same experiment of the problem file
    long most_steps = 0;     // of a simulation that went well
  };

  // go_on: within a simulation, in any thread; false abandons it. threads: experiments at a time.
  ExperimentStack(std::vector<Member> members, std::vector<UnknownParameter> unknowns, const Loss& fit_loss,
                  std::function<bool(double t)> go_on = {}, int threads = 1);

  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& point) override { point = at(x); }
  LeastSquaresPoint at(const Eigen::VectorXd& x) { return collected(residuals(scaling_.to_rho(x)), x); }
  std::vector<Experiment::Residuals> residuals(const Eigen::VectorXd& u);  // per member
  LeastSquaresPoint collected(const std::vector<Experiment::Residuals>& found, const Eigen::VectorXd& x) const;

  Eigen::VectorXd start() const { return scaling_.to_x(start_of(unknowns_)); }
  Eigen::MatrixXd z_rho(const LeastSquaresPoint& point, const Eigen::VectorXd& x) const;  // of all rows, at x
  bool is_at_bound(const Eigen::VectorXd& x, Eigen::Index k) const { return x(k) <= x_lower(k) || x(k) >= x_upper(k); }

  std::vector<Member>& members() { return members_; }
  const std::vector<Member>& members() const { return members_; }
  const std::vector<UnknownParameter>& unknowns() const { return unknowns_; }
  const VariableScaling& scaling() const { return scaling_; }
  Eigen::Index samples() const { return size - plain - equalities; }
  Eigen::Index freedom_of_variables() const { return variables() - equalities; }
  Eigen::VectorXd measured() const, sigma() const;     // per sample
  std::vector<SampledRecord> records_in_time() const;  // one per member, or per chain of those that continue
  std::vector<SampledRecord> motions_in_time() const;  // one per member, with all that follow
  long simulations() const { return simulations_; }
  bool remembers = false;  // residuals, so that the rounds of a fit simulate no point again

 private:
  std::vector<SampledRecord> in_time(const std::function<bool(std::size_t member)>& joins_last) const;
  void tie();

  std::vector<Member> members_;
  std::vector<UnknownParameter> unknowns_;
  VariableScaling scaling_;
  std::function<bool(double t)> go_on_;
  int threads_;
  long simulations_ = 0;
  // By member, u and the sigmas of its channels.
  std::map<std::tuple<std::size_t, std::vector<double>, std::vector<double>>, Experiment::Residuals> remembered_;
};

}  // namespace mbsopt::inline optim
