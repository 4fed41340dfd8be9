#include "app/files/result_json.hpp"

#include <array>
#include <cmath>

namespace mbsopt::inline app {
namespace {

constexpr std::array kOrder{
    "program",         "version",        "command",    "problem",         "status",
    "message",         "last_good_time", "machine",    "model",           "accuracy",
    "simulation",      "objectives",     "methods",    "hessian_method",  "verdict",
    "reference",       "settings",       "fit",        "recommendations", "task_recommendations",
    "applied",         "skipped",        "parameters", "experiments",     "correlation",
    "covariance",      "recovery",       "statistics", "multistart",      "optimizer",
    "identifiability", "provenance",     "warnings"};

}  // namespace

Json to_json(const ModelSummary& summary) {
  Json json{{"bodies", summary.bodies},
            {"equations", summary.equations},
            {"rank", summary.rank},
            {"degrees_of_freedom", summary.degrees_of_freedom},
            {"redundant", summary.redundant},
            {"type", summary.unknowns_per_body == 3 ? "planar" : "spatial"},
            {"unknowns_per_body", summary.unknowns_per_body}};
  if (!summary.not_planar.empty()) json["not_planar"] = summary.not_planar;
  return json;
}

Json to_json(const SimulationStatistics& statistics) {
  Json json{{"solve", statistics.solved ? "kinematics" : "dynamics"},
            {"steps", statistics.steps},
            {"rejected", statistics.rejected},
            {"rejected_by",
             {{"error_test", statistics.rejections.error_test},
              {"not_converged", statistics.rejections.not_converged},
              {"off_constraints", statistics.rejections.off_constraints},
              {"not_finite", statistics.rejections.not_finite},
              {"placed_again", statistics.rejections.placed_again}}},
            {"rhs_evaluations", statistics.rhs_evaluations},
            {"newton_iterations", statistics.newton_iterations},
            {"linear_solves", statistics.linear_solves},
            {"factorisations", statistics.factorisations},
            {"jacobians", statistics.jacobians},
            {"factor_blocks", statistics.factor_blocks},
            {"linearised_states", statistics.linearised_states},
            {"wall_seconds", statistics.wall_seconds},
            {"max_acceleration_residual", statistics.max_acceleration_residual},
            {"max_position_violation", statistics.max_position_violation},
            {"max_velocity_violation", statistics.max_velocity_violation},
            {"energy_drift", statistics.energy_drift}};
  for (const auto& [key, worst] : {std::pair{"quadrature_error", &statistics.quadrature},
                                   {"extreme_quadrature_error", &statistics.extreme_quadrature},
                                   {"gradient_quadrature_error", &statistics.gradient_quadrature}})
    if (worst->error > 0 && !worst->of.empty()) json[key] = worst->error;
  if (statistics.watched_steps > 0) {
    json["watched_steps"] = statistics.watched_steps;
    json["stability_limited_steps"] = statistics.stability_limited_steps;
    if (statistics.stability_limited_steps > 0) json["fastest_rate"] = statistics.stiffest_rate;
  }
  for (const ImpactEvent& impact : statistics.impacts)
    json["events"].push_back(
        {{"name", impact.name}, {"time", impact.time}, {"kind", "impact"}, {"impulse", impact.impulse}});
  if (statistics.kinks > 0) json["kinks"] = statistics.kinks;
  if (statistics.adjoint_memory_bytes > 0) {
    json["adjoint_memory_bytes"] = statistics.adjoint_memory_bytes;
    json["recomputed_steps"] = statistics.recomputed_steps;
  }
  return json;
}

Json to_json(const IntegratorSettings& s) { return {{"type", s.type}, {"rtol", s.rtol}, {"atol", s.atol}}; }

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

double number_of(const Json& object, const std::string& key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : NAN;
}

const char* bound_hit(bool lower, bool upper) { return lower ? "lower" : upper ? "upper" : ""; }

Json bound_json(bool lower, bool upper) { return lower || upper ? Json(bound_hit(lower, upper)) : Json(); }

std::string result_json_text(const Json& parts) {
  Json ordered = Json::object();
  for (const char* key : kOrder) {
    if (const auto part = parts.find(key); part != parts.end()) ordered[key] = *part;
  }
  for (const auto& [key, part] : parts.items()) ordered[key] = part;  // keys without a place, last
  return json_text(ordered, 2) + "\n";
}

}  // namespace mbsopt::inline app
