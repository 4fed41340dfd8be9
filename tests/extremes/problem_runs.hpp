// Problem files as JSON values, varied and run: each test changes one number to an extreme.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/json/read_problem.hpp"
#include "optim/objective/evaluator.hpp"

namespace mbsopt::extremes {

using Json = nlohmann::json;

// What a problem's objectives and their gradients come to, by name.
struct Outcome {
  Evaluation evaluation;
  std::vector<std::string> objectives, parameters;

  bool ok() const { return evaluation.ok; }
  const std::string& message() const { return evaluation.message; }
  const SimulationStatistics& statistics() const { return evaluation.statistics; }
  double operator()(const std::string& objective) const { return evaluation.psi(index(objectives, objective)); }
  double operator()(const std::string& objective, const std::string& parameter) const {
    return evaluation.psi_rho(index(objectives, objective), index(parameters, parameter));
  }

 private:
  static Eigen::Index index(const std::vector<std::string>& names, const std::string& name) {
    const auto at = std::find(names.begin(), names.end(), name);
    REQUIRE(at != names.end());
    return at - names.begin();
  }
};

inline Outcome run(const Json& json, bool gradient, GradientMethod method) {
  const Problem problem = read_problem_text(json.dump(), "extreme.json");
  EvaluatorOptions options;
  options.method = method;
  Evaluator evaluator(problem.scene, objectives_of(problem), {}, options);
  Outcome outcome;
  outcome.evaluation = gradient ? evaluator.gradients(evaluator.start()) : evaluator.values(evaluator.start());
  for (const ObjectiveSpec& o : problem.objectives) outcome.objectives.push_back(o.name);
  for (const Parameter& p : problem.scene.parameters) outcome.parameters.push_back(p.name);
  return outcome;
}
inline Outcome values(const Json& json) { return run(json, false, GradientMethod::automatic); }
inline Outcome gradients(const Json& json, GradientMethod method = GradientMethod::automatic) {
  return run(json, true, method);
}

inline void set_accuracy(Json& json, const std::string& method, double rtol) {
  json["simulation"]["integrator"] = {{"type", method}, {"rtol", rtol}, {"atol", 0.01 * rtol}};
}

// A rod of length L along its own x, its frame at its first end; turned by `angle` about z.
inline Json rod(const std::string& name, double mass, double L, double x, double y, double angle) {
  return {{"name", name},
          {"mass", mass},
          {"com", {L / 2, 0, 0}},
          {"inertia", {1e-3 * mass * L * L, mass * L * L / 12, mass * L * L / 12}},
          {"position", {x, y, 0}},
          {"orientation", {{"axis", {0, 0, 1}}, {"angle", angle}}},
          {"points", {{"tip", {L, 0, 0}}}}};
}

inline Json hinge(const std::string& name, const std::string& body1, const Json& point1, const std::string& body2,
                  const Json& point2, const Json& axis = {0, 0, 1}) {
  return {{"name", name},     {"type", "revolute"}, {"body1", body1}, {"body2", body2},
          {"point1", point1}, {"point2", point2},   {"axis1", axis},  {"axis2", axis}};
}

inline Json problem(const std::string& name) {
  return {{"format", 1},
          {"name", name},
          {"gravity", {0, -9.81, 0}},
          {"bodies", Json::array()},
          {"joints", Json::array()},
          {"simulation", {{"end_time", 1}}}};
}

// A rod of 1 m and 1 kg on a pin at the origin, horizontal and at rest.
inline Json pendulum() {
  Json p = problem("pendulum");
  p["bodies"] = {rod("rod", 1, 1, 0, 0, 0)};
  p["joints"] = {hinge("pin", "ground", {0, 0, 0}, "rod", "O")};
  p["sensors"] = {{"theta", {{"quantity", "angle"}, {"joint", "pin"}}},
                  {"speed", {{"quantity", "rate"}, {"joint", "pin"}}},
                  {"tip_x", {{"quantity", "position"}, {"body", "rod"}, {"point", "tip"}, {"component", "x"}}},
                  {"tip_y", {{"quantity", "position"}, {"body", "rod"}, {"point", "tip"}, {"component", "y"}}}};
  p["objectives"] = {{"theta", {{"terminal", "theta"}}}, {"speed", {{"terminal", "speed"}}}};
  return p;
}

// A ball of 1 kg on a spring along x; nothing else acts.
inline Json oscillator(double stiffness, double free_length, double x0) {
  Json p = problem("oscillator");
  p["gravity"] = {0, 0, 0};
  p["parameters"] = {{"k", {{"value", stiffness}}}};
  p["bodies"] = {{{"name", "ball"}, {"mass", 1}, {"inertia", {0.1, 0.1, 0.1}}, {"position", {x0, 0, 0}}}};
  p["forces"] = {{{"name", "spring"},
                  {"type", "tsda"},
                  {"body1", "ground"},
                  {"body2", "ball"},
                  {"point1", {0, 0, 0}},
                  {"point2", "O"},
                  {"stiffness", "k"},
                  {"free_length", free_length}}};
  p["sensors"] = {{"x", {{"quantity", "position"}, {"body", "ball"}, {"component", "x"}}}};
  p["objectives"] = {{"x", {{"terminal", "x"}}}};
  return p;
}

}  // namespace mbsopt::extremes
