// Options of an identification that the problem does not give.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "optim/fit/fit_result.hpp"

namespace mbsopt {

struct UserForce;        // core/force/user_force.hpp
struct ResidualRecords;  // optim/fit/experiment_stack.hpp

struct IdentificationOptions {
  std::vector<std::string> profiles;  // names of fitted parameters whose profile likelihood is wanted
  std::vector<std::shared_ptr<const UserForce>> user_forces;
  std::function<bool(const FitRow&)> progress;        // after every iteration; false stops, the best so far is kept
  std::function<bool(double t)> simulation_progress;  // within a simulation; false abandons it
  // No step is taken: residuals at the start, and the standard errors that the given sigmas predict there.
  bool preflight = false;
  bool tests_angles = true;            // fits again where a column may be in degrees
  int threads = 1;                     // experiments at a time; results do not depend on it
  ResidualRecords* records = nullptr;  // of an earlier run that this one goes on with; of the fit and its profiles
  // After every point of a profile; false ends it there.
  std::function<bool(const std::string& name, double value, double tau)> profile_progress;
};

}  // namespace mbsopt
