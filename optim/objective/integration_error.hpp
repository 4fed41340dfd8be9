// How much of psi and of its derivatives is the integrator's error: the change that ten times tighter tolerances make
// (looser ones where tighter are out of reach), of derivatives at least rtol times them. An estimate of its size, no
// bound. With fixed steps there is nothing that jumps from run to run: zero.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/scene/scene.hpp"
#include "optim/objective/evaluator.hpp"

namespace mbsopt {

class Objective;
struct UserForce;

struct IntegrationError {
  Eigen::VectorXd psi;      // per objective, >= 0
  Eigen::MatrixXd psi_rho;  // objective x parameter, >= 0
  long simulations = 0;
};

struct IntegrationErrorOptions {
  std::vector<std::shared_ptr<const UserForce>> user_forces = {};
  std::function<bool(double t)> progress = {};  // within a simulation; false abandons it
  GradientMethod method = GradientMethod::automatic;
};

// The scene with tolerances ten times tighter, or looser; none where its steps are fixed.
std::optional<Scene> with_other_tolerances(Scene scene);

// psi, psi_rho: at the parameters and tolerances of the scene.
IntegrationError integration_error(const Scene& scene, const std::vector<Objective>& objectives,
                                   const Eigen::VectorXd& psi, const Eigen::MatrixXd& psi_rho,
                                   const IntegrationErrorOptions& options = {});

}  // namespace mbsopt
