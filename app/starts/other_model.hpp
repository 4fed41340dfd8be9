// The other model of identify --compare. It is checked before the fit, and fitted after it.
//
//   OtherModel other(file);                    // read
//   other.check(run.problem.scene, options);   // cut into windows, simulated once
//   const IdentificationResult second = other.fit(options);
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/json/problem_source.hpp"
#include "optim/fit/identification.hpp"
#include "optim/fit/windows.hpp"

namespace mbsopt {

class OtherModel {
 public:
  // Throws InputError and std::invalid_argument, with the place in its own file.
  OtherModel(const std::string& file, const ReadOptions& options);

  const Problem& problem() const { return problem_; }
  // Takes the integrator of `first`, so that errors of the integration are the same in both fits. Throws InputError
  // with the place in its own file, and CsvError.
  void check(const Scene& first, const IdentificationOptions& options);
  // Call this after check().
  IdentificationResult fit(const IdentificationOptions& options) const;

 private:
  std::shared_ptr<ProblemSource> source_;
  Problem problem_;
  CutProblem cut_;
};

}  // namespace mbsopt
