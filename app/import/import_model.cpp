#include "app/import/import_model.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/import/mjcf_model.hpp"
#include "app/import/model_reader.hpp"
#include "app/import/problem_text.hpp"
#include "app/import/urdf_model.hpp"
#include "app/json/node.hpp"
#include "app/json/read_problem.hpp"
#include "app/json/source_text.hpp"
#include "core/start/model_warnings.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt {
namespace {

constexpr double kSmoothVelocity = 0.01;  // a tenth of a slow joint's rate (docs/forces.md) [rad/s], [m/s]

// These elements act on the motion in the program that the model is for: inertia of rotors, stops, contact, actuators,
// a medium. All else is drawing, or settings of that program.
// clang-format off
constexpr std::array kActs{
    "limit", "collision", "geom", "contact", "safety_controller", "joint armature", "joint range", "joint margin", "actuator",
    "tendon", "joint springdamper", "option wind", "option density", "option viscosity", "body gravcomp",
    "body mocap", "weld relpose", "distance", "compiler inertiagrouprange", "compiler boundmass",
    "compiler boundinertia", "compiler balanceinertia", "geom shellinertia", "geom fluidshape"};
// clang-format on

// A problem file cannot express numbers that overflowed, or ties between joints without an angle or a displacement. So
// these are findings.
void refuse(const ImportedModel& model, ModelErrors& errors) {
  for (const ImportedBody& b : model.bodies) {
    const bool finite =
        std::isfinite(b.mass) && b.com.allFinite() && b.inertia.allFinite() && b.frame.matrix().allFinite();
    if (b.source && !finite) errors.add(*b.source, "its place, mass or inertia is too large for a number");
  }
  for (const ImportedTie& tie : model.ties) {
    const auto has = [&](int joint, const char* type) {
      return model.joints[static_cast<std::size_t>(joint)].type == type;
    };
    const auto valued = [&](int joint) { return has(joint, "revolute") || has(joint, "translational"); };
    if (!valued(tie.joint1) || !valued(tie.joint2))
      errors.add(*tie.source, "ties joints that have neither an angle nor a displacement");
    else if (has(tie.joint1, "translational") && has(tie.joint2, "translational"))
      errors.add(*tie.source, "ties two sliding joints, for which there is no joint here");
    else if (!std::isfinite(1 / tie.factor))
      errors.add(*tie.source, "its factor is 0, or too small; use a fixed joint");
  }
  errors.throw_if_any();
}

// Returns the problem. Findings about a body or a joint name their element of the model.
Problem checked(const std::string& text, const ImportedModel& model, const std::string& file) {
  try {
    return read_problem_text(text, file);
  } catch (const InputError& error) {
    std::vector<Finding> findings;
    for (Finding finding : error.findings()) {
      const XmlElement* source = nullptr;
      const std::vector<PathStep> path = finding.path.empty() ? std::vector<PathStep>{} : parse_path(finding.path);
      if (path.size() >= 2 && path[1].is_index) {
        const std::size_t i = path[1].index;
        if (path[0].key == "bodies" && i + 1 < model.bodies.size()) source = model.bodies[i + 1].source;
        if (path[0].key == "joints" && i < model.joints.size()) source = model.joints[i].source;
      }
      finding.line = source ? source->line : 0;
      finding.column = source ? source->column : 0;
      const std::string what = finding.path.substr(std::min(finding.path.size(), finding.path.find('.') + 1));
      if (source) finding.path = described(*source) + ": " + what;
      findings.push_back(finding);
    }
    throw InputError(findings);
  }
}

// Bodies whose accelerations no simulation can compute. The model may still serve kinematics.
std::vector<std::string> warnings_of(const Problem& problem, const ImportedModel& model) {
  const Mechanism mechanism(problem.scene, parameter_values(problem.scene));
  const Assembly assembly(mechanism, problem.scene.simulation.start_time);
  std::vector<std::string> warnings;
  for (const int body : massless_bodies(mechanism, assembly)) {
    const ImportedBody& b = model.bodies[static_cast<std::size_t>(body)];
    warnings.push_back(
        fmt::format("line {}: '{}' has no mass or inertia in a direction that no joint holds, and "
                    "simulate fails; give it some",
                    b.source ? b.source->line : 0, b.name));
  }
  return warnings;
}

std::string comment(const std::vector<std::string>& lines, const char* heading) {
  if (lines.empty()) return "";
  return fmt::format("// {}\n//   {}\n", heading, fmt::join(lines, "\n//   "));
}

ImportedProblem imported_from(const std::string& text, const std::filesystem::path& file, const auto& warnings) {
  const std::string name = file.string();
  const XmlElement root = parse_xml(text, name);
  ModelErrors errors(name);
  if (root.name != "robot" && root.name != "mujoco") {
    errors.add(root, "is not a model that import reads: URDF begins with <robot>, MJCF with <mujoco>");
    errors.throw_if_any();
  }
  ImportedModel model = root.name == "robot" ? urdf_model(root, name) : mjcf_model(root, name);
  if (model.bodies.size() < 2) {
    errors.add(root, "has no body that moves");
    errors.throw_if_any();
  }
  refuse(model, errors);
  model.name = Names({}, &model.changed).body(model.name);
  if (std::ranges::any_of(model.joints, [](const ImportedJoint& j) { return j.coulomb != 0; }))
    model.changed.push_back(fmt::format(
        "dry friction does not stick: it is smoothed over {} rad/s, m/s (smooth_velocity)", kSmoothVelocity));
  const nlohmann::ordered_json problem = problem_of(model, kSmoothVelocity, model.changed);
  ImportedProblem imported;
  imported.name = model.name;
  imported.changed = model.changed;
  for (const XmlElement::Unread& unread : root.unread())
    imported.dropped.push_back(
        fmt::format("line {}: {}{}", unread.line, unread.what,
                    std::ranges::find(kActs, unread.what) == kActs.end() ? "" : " (may change the motion)"));
  const std::string json = text_of(problem);
  imported.warnings = warnings(checked(json, model, name), model);
  for (std::vector<std::string>* list : {&imported.changed, &imported.dropped, &imported.warnings})
    for (std::string& words : *list)
      std::ranges::replace_if(
          words, [](unsigned char c) { return c < ' '; }, ' ');
  imported.bodies = problem.at("bodies").size();
  imported.joints = problem.at("joints").size();
  imported.text = fmt::format("// Imported from {}.\n", file.filename().string()) +
                  comment(imported.warnings, "Warnings:") + comment(imported.changed, "Changed:") +
                  comment(imported.dropped, "Dropped (kinds of elements and attributes, with their first line):") +
                  json;
  return imported;
}

}  // namespace

ImportedProblem import_model(const std::filesystem::path& model) {
  return imported_from(read_text_file(model), model, warnings_of);
}

ImportedProblem read_model_text(const std::string& text, const std::filesystem::path& model) {
  return imported_from(text, model, [](const Problem&, const ImportedModel&) { return std::vector<std::string>{}; });
}

}  // namespace mbsopt
