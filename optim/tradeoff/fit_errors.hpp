// The integrator's errors in an identification. They are those in 1/2 sum z^2 over the samples of its fitted
// experiments, and in its gradient in the unknowns, at the starting values. The reference is dopri853 and gauss6 at
// tight tolerances, with steps shortened until both agree. Priors and losses do not depend on integration and are left
// out.
//
//   const FitErrors errors(problem, data);
//   errors.at(problem.scene.simulation).cost;   // |cost - cost*| / |cost*|
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "core/scene/settings.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

class FitErrors {
 public:
  // Relative differences; that of the gradient is |D (g - g*)|/|D g*|, D the sizes of the unknowns on the diagonal.
  struct Error {
    std::string message = {};  // why there is none
    double cost = 0, gradient = 0;
    bool ok() const { return message.empty(); }
    double largest() const { return cost > gradient ? cost : gradient; }
  };

  // Finds the right cost and gradient. data has one table per experiment. It and the problem must outlive this.
  FitErrors(const Problem& problem, const std::vector<CsvTable>& data, std::function<bool()> interrupted = {});

  bool ok() const { return certificate_.ok(); }
  double cost() const { return right_.cost; }
  const Error& certificate() const { return certificate_; }  // difference of the two methods
  Error at(const SimulationSettings& settings) const;        // only if ok()

 private:
  struct Fit {
    std::string message = {};  // why there is none
    double cost = 0;
    Eigen::VectorXd gradient = {};  // times the sizes of the unknowns
  };
  Fit fit(const SimulationSettings& settings) const;

  const Problem& problem_;
  const std::vector<CsvTable>& data_;
  const std::function<bool()> interrupted_;
  Fit right_;
  Error certificate_;
};

}  // namespace mbsopt::inline optim
