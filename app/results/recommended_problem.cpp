#include "app/results/recommended_problem.hpp"

#include "app/json/edit_text.hpp"
#include "app/results/optimized_problem.hpp"
#include "app/run/run.hpp"

namespace mbsopt {
namespace {

std::string text_of(const Json& object) {
  std::string text;
  for (const auto& [key, value] : object.items())
    text += (text.empty() ? "" : ", ") + json_text(key) + ": " + json_text(value);
  return "{" + text + "}";
}

Json options_json(const IntegratorOptions& o) {
  Json json = Json::object();
  if (o.min_step) json["min_step"] = *o.min_step;
  if (o.newton_tolerance) json["newton_tolerance"] = *o.newton_tolerance;
  if (o.newton_iterations) json["newton_iterations"] = *o.newton_iterations;
  if (o.factor_min) json["factor_min"] = *o.factor_min;
  if (o.factor_max) json["factor_max"] = *o.factor_max;
  if (o.safety) json["safety"] = *o.safety;
  if (!o.controller.empty()) json["controller"] = o.controller;
  return json;
}

// The tolerance in the form of a problem file; kinds have the same scale.
Json tolerance_json(double smallest, const std::optional<KindTolerances>& kinds) {
  if (!kinds) return smallest;
  Json json = Json::object();
  const double scale = smallest / kinds->smallest();
  const auto put = [&](const char* key, const std::optional<double>& value) {
    if (value) json[key] = scale * *value;
  };
  put("position", kinds->position), put("angle", kinds->angle);
  put("velocity", kinds->velocity), put("rate", kinds->rate);
  for (const auto& [name, value] : kinds->bodies) json["bodies"][name] = scale * value;
  return json;
}

Json integrator_json(const IntegratorSettings& s) {
  Json json{{"type", s.type}};
  if (s.step) {
    json["step"] = *s.step;
  } else {
    json["rtol"] = tolerance_json(s.rtol, s.rtol_of), json["atol"] = tolerance_json(s.atol, s.atol_of);
  }
  if (s.initial_step) json["initial_step"] = *s.initial_step;
  if (s.max_step) json["max_step"] = *s.max_step;
  if (s.max_steps != IntegratorSettings{}.max_steps) json["max_steps"] = s.max_steps;
  if (const Json options = options_json(s.options); !options.empty()) json["options"] = options;
  return json;
}

Json formulation_json(const FormulationSettings& f) {
  const auto projection = f.projection == Projection::none       ? "none"
                          : f.projection == Projection::velocity ? "velocity"
                                                                 : "position_velocity";
  if (f.type == FormulationType::penalty) {
    return {{"type", "penalty"},
            {"alpha", f.alpha},
            {"xi", f.xi},
            {"omega", f.omega},
            {"projection", projection},
            {"linear_solver", f.linear_solver == LinearSolver::cholesky ? "cholesky" : "quasidefinite"}};
  }
  return {{"type", "augmented_lagrangian"},
          {"alpha", f.alpha},
          {"xi", f.xi},
          {"omega", f.omega},
          {"iterations", f.iterations},
          {"tolerance", f.tolerance},
          {"projection", projection}};
}

}  // namespace

std::string recommended_problem_text(const Run& run, const SimulationSettings& settings) {
  std::string text = optimized_problem_text(run, {});
  text = without_member(text, "simulation.accuracy");  // it was a choice, too
  text = with_value(text, "simulation.integrator", text_of(integrator_json(settings.integrator)));
  const Json formulation = formulation_json(settings.formulation);
  if (formulation != formulation_json(run.problem.scene.simulation.formulation))
    text = with_value(text, "simulation.formulation", text_of(formulation));
  return text;
}

}  // namespace mbsopt
