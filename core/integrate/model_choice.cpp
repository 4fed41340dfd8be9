#include "core/integrate/model_choice.hpp"

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {
namespace {

// Why a run with these settings is not planar; empty where it is. method: null for CVODES.
std::string why_spatial(const Mechanism& mechanism, const SimulationSettings& settings, const Method* method) {
  if (settings.model == ModelChoice::spatial) return "simulation.model is \"spatial\"";
  if (!mechanism.data().planar) return mechanism.data().not_planar;
  if (!method || method->implicit()) return "the planar model is for explicit Runge-Kutta methods only";
  if (settings.formulation.projection == Projection::velocity)
    return "the projection of velocities alone needs the spatial model";
  if (settings.model != ModelChoice::planar && settings.formulation.type == FormulationType::penalty)
    return "the penalty form is planar only if simulation.model is \"planar\"";
  return "";
}

// The same; throws SceneError if the settings ask for the planar model.
std::string checked_reason(const Mechanism& mechanism, const SimulationSettings& settings, const Method* method) {
  std::string reason = why_spatial(mechanism, settings, method);
  if (reason.empty() || settings.model != ModelChoice::planar) return reason;
  throw SceneError("simulation.model: cannot be planar: " + reason + ". Use \"auto\" or \"spatial\"");
}

}  // namespace

Model model_of(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method) {
  return checked_reason(mechanism, settings, &method).empty() ? Model::planar : Model::spatial;
}

void add_model(const Mechanism& mechanism, const SimulationSettings& settings, ModelSummary& summary) {
  summary.not_planar = checked_reason(mechanism, settings, runge_kutta_method(settings.integrator.type));
  if (summary.not_planar.empty()) summary.unknowns_per_body = 3;
}

}  // namespace mbsopt
