#include "core/integrate/model_choice.hpp"

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {
namespace {

SceneError not_planar(const std::string& reason) {
  return SceneError("simulation.model: cannot be planar: " + reason + ". Use \"auto\" or \"spatial\"");
}

}  // namespace

std::string why_not_planar(const Mechanism& mechanism, const SimulationSettings& settings, const Method* method) {
  if (!mechanism.data().planar) return mechanism.data().not_planar;
  if (!method || method->implicit()) return "the planar model is for explicit Runge-Kutta methods only";
  if (settings.formulation.projection == Projection::velocity)
    return "the projection of velocities alone needs the spatial model";
  return "";
}

void add_model(const Mechanism& mechanism, const SimulationSettings& settings, ModelSummary& summary) {
  const Method* method = runge_kutta_method(settings.integrator.type);
  if (method && model_of(mechanism, settings, *method) == Model::planar) {
    summary.unknowns_per_body = 3;
    return;
  }
  if (settings.model == ModelChoice::planar) throw not_planar(why_not_planar(mechanism, settings, method));
  summary.not_planar = settings.model == ModelChoice::spatial ? "simulation.model is \"spatial\""
                                                              : why_not_planar(mechanism, settings, method);
  if (summary.not_planar.empty())
    summary.not_planar = "the penalty form is planar only if simulation.model is \"planar\"";
}

Model model_of(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method) {
  if (settings.model == ModelChoice::spatial) return Model::spatial;
  const std::string reason = why_not_planar(mechanism, settings, &method);
  const bool exact = settings.formulation.type == FormulationType::augmented_lagrangian;
  if (reason.empty() && (exact || settings.model == ModelChoice::planar)) return Model::planar;
  if (settings.model == ModelChoice::planar) {
    throw not_planar(reason);
  }
  return Model::spatial;
}

}  // namespace mbsopt
