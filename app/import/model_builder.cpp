#include "app/import/model_builder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/expression/operation.hpp"
#include "core/scene/inertia_check.hpp"

namespace mbsopt::inline app {

using Eigen::Matrix3d;
using Eigen::Vector3d;

std::string UniqueNames::add(const std::string& wanted) {
  const bool identifier = kind_ == Kind::identifier;
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto is_refused = [&](char c) {
    if (identifier) return !((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || is_digit(c));
    return static_cast<unsigned char>(c) < ' ' || std::string(".,;\"'[]/\\").find(c) != std::string::npos;
  };
  std::string stem = wanted;
  std::ranges::replace_if(stem, is_refused, '_');
  if (identifier && (stem.empty() || is_digit(stem[0]))) stem.insert(0, "_");
  if (stem.empty()) stem = "unnamed";
  std::string name = stem;
  for (int k = 2; std::ranges::find(taken_, name) != taken_.end() || find_function(name); ++k)
    name = fmt::format("{}_{}", stem, k);
  taken_.push_back(name);
  if (renamed_ && name != wanted) renamed_->push_back(fmt::format("'{}' is named '{}'", wanted, name));
  return name;
}

ModelBuilder::ModelBuilder(ModelFile& file, std::vector<ModelAttribute> table) : file_(file) {
  file.table = std::move(table);
}

int ModelBuilder::add_body(const std::string& name, int parent, const Eigen::Isometry3d& between,
                           const ModelElement& source) {
  model_.bodies.push_back(
      {.name = body_names_.add(name), .frame = body(parent).frame * between, .place = source.place()});
  return static_cast<int>(model_.bodies.size()) - 1;
}

void ModelBuilder::add_part(ImportedBody& body, double mass, const Vector3d& com, const Matrix3d& inertia,
                            const ModelElement& source) {
  if (mass < 0) return source.error(fmt::format("mass: is {} kg, a mass must not be negative", mass));
  if (inertia.allFinite()) {
    const Matrix3d& J = inertia;
    const std::string problem = inertia_problem({J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(0, 2), J(1, 2)});
    if (!problem.empty()) return source.error("inertia: " + problem);
  }
  body.inertia += inertia;
  if (mass == 0) return;
  const double sum = body.mass + mass;
  const Vector3d d = com - body.com;
  body.inertia += body.mass * mass / sum * (d.squaredNorm() * Matrix3d::Identity() - d * d.transpose());
  body.com = body.mass == 0 ? com : Vector3d((body.mass * body.com + mass * com) / sum);
  body.mass = sum;
}

void ModelBuilder::add_joint(const std::string& name, ImportedJoint joint, const ModelElement& source,
                             const ModelElement& resistance, const std::string& given) {
  const auto keep = [&](bool has, const std::string& attribute, double& value) {
    if (has || value == 0) return;
    model_.changed.push_back(fmt::format("line {}: {} {} of a {} joint is left out (may change the motion)",
                                         resistance.place().line, attribute, value, given));
    value = 0;
  };
  joint.axis.normalize();
  if (!joint.type.empty()) joint.name = joint_names_.add(name);
  const bool valued = joint.type == "revolute" || joint.type == "translational";
  keep(valued || joint.type == "spherical", "damping", joint.damping);
  keep(valued, "stiffness", joint.stiffness);
  keep(valued, resistance.name() == "dynamics" ? "friction" : "frictionloss", joint.coulomb);
  if (joint.type.empty()) return;
  joint.place = source.place();
  joint_index_[name] = static_cast<int>(model_.joints.size());
  model_.joints.push_back(joint);
}

void ModelBuilder::add_tie(const std::string& driven, const std::string& how, const std::string& driver, double factor,
                           const ModelElement& source) {
  int joint1 = joint_index_.at(driver), joint2 = joint_index_.at(driven);
  const auto is = [&](int joint, const char* type) {
    return model_.joints[static_cast<std::size_t>(joint)].type == type;
  };
  if (is(joint1, "translational")) {  // a rack and pinion goes from the angle to the displacement
    std::swap(joint1, joint2);
    factor = 1 / factor;
  }
  const bool gear = is(joint2, "revolute");
  if (is(joint1, "translational")) return source.error("ties two sliding joints, for which there is no joint here");
  if (!is(joint1, "revolute") || !(gear || is(joint2, "translational")))
    return source.error("ties joints that have neither an angle nor a displacement");
  if (!std::isfinite(factor) || !std::isfinite(1 / factor))
    return source.error("its factor is 0, or too small; use a fixed joint");
  model_.ties.push_back(
      {joint_names_.add(driven + how + driver), gear ? "gear" : "rack_pinion", joint1, joint2, factor});
}

ImportedModel ModelBuilder::finished() {
  file_.throw_if_any();
  if (model_.bodies.size() < 2) root_.error("has no body that moves");
  for (const ImportedBody& b : model_.bodies) {
    if (std::isfinite(b.mass) && b.com.allFinite() && b.inertia.allFinite() && b.frame.matrix().allFinite()) continue;
    file_.findings.push_back(b.place);
    file_.findings.back().message = "its place, mass or inertia is too large for a number";
  }
  file_.throw_if_any();
  model_.name = UniqueNames(UniqueNames::Kind::name, {}, &model_.changed).add(model_.name);
  return std::move(model_);
}

}  // namespace mbsopt::inline app
