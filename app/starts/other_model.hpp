// The other model of identify --compare. It is checked before the fit, and fitted and compared after it.
//
//   OtherModel other(context);             // read
//   other.check(run, options);             // cut into windows, simulated once
//   other.compare(run, fit, options);
#pragma once

#include <memory>

#include "app/run/run.hpp"
#include "optim/fit/identification.hpp"
#include "optim/fit/windows.hpp"

namespace mbsopt::inline app {

class OtherModel {
 public:
  // Throws InputError and std::invalid_argument, with the place in its own file.
  explicit OtherModel(const CommandContext& context);

  // Takes the integrator of the run, so that errors of the integration are the same in both fits. Throws InputError
  // with the place in its own file, and CsvError.
  void check(Run& run, const IdentificationOptions& options);
  // Adds both fits and their F-test to the result and to standard output. Warns if its fit cannot be made. Call this
  // after check().
  void compare(Run& run, const IdentificationResult& fit, const IdentificationOptions& options) const;

 private:
  std::shared_ptr<ProblemSource> source_;
  Problem problem_;
  CutProblem cut_;
};

}  // namespace mbsopt::inline app
