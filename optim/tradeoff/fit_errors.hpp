// The integrator's errors in an identification. They are those in 1/2 sum z^2 over the samples of its fitted
// experiments, and in its gradient in the unknowns, at the starting values. The reference is dopri853 and gauss6 at
// tight tolerances, with steps shortened until both agree. Priors and losses do not depend on integration and are left
// out.
//
//   const FitErrors errors = measure_fit_errors(problem, data, {{"own", problem.scene.simulation}});
//   errors.settings.at(0).cost;   // |cost - cost*| / |cost*|
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/scene/settings.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

struct FitErrors {
  // Relative differences; that of the gradient is |D (g - g*)|/|D g*|, D the sizes of the unknowns on the diagonal.
  struct Apart {
    double cost = 0, gradient = 0;
    double largest() const { return cost > gradient ? cost : gradient; }
  };
  struct Setting {
    std::string name;
    std::string message;  // why there is no error
    Apart error;
  };
  std::string message;  // why there is nothing
  double cost = 0;      // the right one
  Apart certificate;    // difference of the two methods
  std::vector<Setting> settings;
  bool ok() const { return message.empty(); }
};

struct NamedSettings {
  std::string name;
  SimulationSettings simulation;
};

// The right cost and gradient, computed once, and errors of any settings against them.
class FitErrorMeasure {
 public:
  // data has one table per experiment. It and the problem must outlive this.
  FitErrorMeasure(const Problem& problem, const std::vector<CsvTable>& data, std::function<bool()> interrupted = {});
  ~FitErrorMeasure();

  FitErrors found() const;                                  // without settings
  FitErrors::Setting at(const NamedSettings& named) const;  // only where found().ok()

 private:
  class Runs;
  struct Fit {
    std::string message;  // why there is none
    double cost = 0;
    Eigen::VectorXd gradient;
    bool ok() const { return message.empty(); }
  };
  void find_right();

  std::unique_ptr<const Runs> runs_;
  Fit right_;
  FitErrors::Apart certificate_;
};

// data has one table per experiment.
FitErrors measure_fit_errors(const Problem& problem, const std::vector<CsvTable>& data,
                             const std::vector<NamedSettings>& settings, const std::function<bool()>& interrupted = {});

}  // namespace mbsopt
