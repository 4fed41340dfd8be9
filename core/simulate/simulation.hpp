// Forward simulation, and its exact discrete derivatives by tangent-linear (TLM) and adjoint sweeps.
//
// All three take the same steps and compute the same numbers. The derivatives are those of the computed numbers, with
// the accepted steps held fixed, through projection and initial assembly.
//
//   const Mechanism mechanism(scene, rho);
//   SimulationResult run = simulate(mechanism, scene.simulation, {cost});        // run.psi(0)
//   SimulationResult back = simulate_adjoint(mechanism, scene.simulation, {cost});  // back.psi_rho.row(0)
#pragma once

#include <span>

#include "core/run/cost.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

class Mechanism;

SimulationResult simulate(const Mechanism& mechanism, const SimulationSettings& settings,
                          std::span<const Cost> costs = {}, const Sampling& sampling = {},
                          const RunOptions& options = {});
SimulationResult simulate_tlm(const Mechanism& mechanism, const SimulationSettings& settings,
                              std::span<const Cost> costs = {}, const TangentSampling& sampling = {},
                              const RunOptions& options = {});
SimulationResult simulate_adjoint(const Mechanism& mechanism, const SimulationSettings& settings,
                                  std::span<const Cost> costs, const RunOptions& options = {});

}  // namespace mbsopt
