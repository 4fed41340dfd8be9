// The tolerance of each component of the state y = (q, v): IntegratorSettings::rtol and atol, in the proportions of
// rtol_of and atol_of.
#pragma once

#include <Eigen/Core>

#include "core/scene/settings.hpp"

namespace mbsopt {

struct MechanismData;

class ComponentTolerances {
 public:
  ComponentTolerances(const MechanismData& data, const IntegratorSettings& settings);

  // atol_i + rtol_i size
  double of(Eigen::Index i, double size) const { return atol_(i) + rtol_(i) * size; }

 private:
  Eigen::VectorXd rtol_, atol_;
};

}  // namespace mbsopt
