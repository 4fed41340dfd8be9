// A second opinion on gradients: the sensitivities of the differential equation by CVODES against the discrete
// derivatives. Both have tolerances tight enough to be the same number. They share the derivatives of single terms, and
// assembly. They do not share the steps, the projection, the dense output, and the quadrature of running costs.
//
//   const ContinuousCheck check = check_continuous(Evaluator(scene, objectives));
//   if (check.ran) std::cout << check.method << ": " << check.worst_difference();
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "optim/differences/verdict.hpp"
#include "optim/objective/evaluator.hpp"

namespace mbsopt::inline optim {

struct ContinuousEntry {
  std::string objective, parameter;
  Eigen::Index row = 0, column = 0;  // of the gradients
  double discrete = 0, continuous = 0;
  double difference = 0;  // relative to the entry, or to `floor` times the gradient's size
  Verdict verdict = Verdict::disagrees;
};

struct ContinuousCheck {
  bool ran = false;
  std::string message;                   // why not
  std::string method;                    // cvodes_forward, cvodes_adjoint
  std::string integrator, discrete;      // of CVODES; of the discrete derivatives
  double rtol = 0;                       // of both
  Eigen::MatrixXd psi_rho;               // objective x parameter, by CVODES
  std::vector<ContinuousEntry> entries;  // objective by objective
  double wall_seconds = 0;               // of CVODES
  long simulations = 0;
  bool passed() const;  // also where it could not run
  double worst_difference(const std::string& objective) const;
  Verdict worst_verdict(const std::string& objective) const;
};

struct ContinuousCheckOptions {
  double rtol = 1e-9;  // or the scene's, where that is tighter
  double threshold = 1e-6;
  double floor = 1e-3;     // entries below this part of the largest are compared to that part
  long typical_steps = 0;  // of the scene's own run, 0: unknown; CVODES ends at many times these
};

// Checks the gradients in the variables of the evaluator at their values in the scene. If an entry is off by more than
// the threshold, both sides run once more at ten times tighter tolerances, and these decide. The change between the
// runs excuses the rest.
ContinuousCheck check_continuous(const Evaluator& evaluator, const ContinuousCheckOptions& options = {});

}  // namespace mbsopt::inline optim
