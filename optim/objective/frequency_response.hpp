// The response of the motion near the initial state, an equilibrium, to an input that swings: a function of the
// parameters alone, with its gradient.
//
//   H(f) = C (2 pi i f - A)^-1 B + D       [unit of the output/unit of the input]   core/start/linearisation.hpp
//
//   amplitude |H|, phase arg H             at a frequency
//   max                                    the largest |H| within a band
//   rms                                    sqrt( integral of |H|^2 S df ) within it, S: the spectrum of the input
//
// The largest |H| has a kink where two resonances are equally high, so all of them are known as peaks: |H| at the
// frequency of each, which does not move it. Derivatives are those of H at fixed frequencies, by extrapolated
// differences of the linearisation.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "core/mechanism/scene_programs.hpp"
#include "core/start/linearisation.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

class FrequencyResponse {
 public:
  // Throws std::invalid_argument for unknown names.
  FrequencyResponse(const Scene& scene, const FrequencyResponseSpec& spec);

  using UserForces = std::vector<std::shared_ptr<const UserForce>>;
  // Throw std::runtime_error if there is no response: assembly failed, no equilibrium, an input that moves joints.
  double value(const Eigen::VectorXd& rho, const UserForces& forces) const;

  struct Peak {
    double frequency = 0, value = 0;
    Eigen::VectorXd gradient;  // per variable
  };
  // The value with its gradient; of "max" with the lower peaks after it, of others alone.
  std::vector<Peak> peaks(const Eigen::VectorXd& rho, const UserForces& forces,
                          const std::vector<int>& variables) const;
  bool is_largest() const { return spec_.value == "max"; }

 private:
  Linearisation linearised(const Eigen::VectorXd& rho, const UserForces& forces) const;
  std::vector<double> frequencies(const Linearisation& x) const;  // to look at, within the band
  std::vector<Peak> peaks_of(const Linearisation& x) const;
  double value_at(const Linearisation& x, double f) const;  // of an amplitude, a phase, or rms, whose f is not used
  double rms(const Linearisation& x) const;

  Scene scene_;
  FrequencyResponseSpec spec_;
  int input_ = 0, output_ = 0;
  std::shared_ptr<ScenePrograms> programs_;
};

}  // namespace mbsopt::inline optim
