#include "core/start/assembly_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/constraint/constraint.hpp"

namespace mbsopt {
namespace {

struct Finding {
  double amount;
  std::string text;
};

std::string joint_name(const MechanismData& d, const Constraint& c) {
  auto name = [&](int body) { return d.body_names[static_cast<std::size_t>(body)]; };
  return "joint '" + d.joint_names[static_cast<std::size_t>(c.joint)] + "' (" + name(c.body1) + " - " + name(c.body2) +
         ")";
}

// Adds the violation of one joint: the distance of points, the deviation of directions from a right angle.
void add_joint(const MechanismData& d, AssemblyLevel level, int joint, const Eigen::VectorXd& F, double tolerance,
               std::vector<Finding>& findings) {
  double apart = 0, skew = 0, turned = 0;
  const Constraint* any = nullptr;
  for (const Constraint& c : d.constraints) {
    if (c.joint != joint) continue;
    any = &c;
    const double amount = F.segment(c.row, c.rows()).norm();
    const RowQuantity quantity = c.quantity();
    double& kind = quantity == RowQuantity::cosine ? skew : quantity == RowQuantity::angle ? turned : apart;
    kind = quantity == RowQuantity::angle ? amount : std::hypot(kind, amount);
  }
  if (!any || std::max({apart, skew, turned}) <= tolerance) return;
  const bool rates = level == AssemblyLevel::velocity;
  std::vector<std::string> parts;
  if (apart > tolerance) parts.push_back(fmt::format("points {:.3g} {} apart", apart, rates ? "m/s" : "m"));
  if (skew > tolerance) {
    parts.push_back(rates ? fmt::format("axes turn apart at {:.3g} rad/s", skew)
                          : fmt::format("axes {:.3g} rad out of line", std::asin(std::min(1.0, skew))));
  }
  if (turned > tolerance) parts.push_back(fmt::format("angles off by {:.3g} {}", turned, rates ? "rad/s" : "rad"));
  std::string text = joint_name(d, *any) + ": " + parts[0];
  for (std::size_t i = 1; i < parts.size(); ++i) text += ", " + parts[i];
  findings.push_back({std::max({apart, skew, turned}), text});
}

// The drives, conditions and joints whose rows have no number.
std::vector<std::string> not_finite(const MechanismData& d, const AssemblyEquations& equations,
                                    const Eigen::VectorXd& F) {
  std::vector<std::string> names;
  const auto add = [&](const std::string& name) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  };
  for (const Constraint& c : d.constraints) {
    if (std::isfinite(F.segment(c.row, c.rows()).squaredNorm())) continue;
    add(c.drive >= 0 ? "drive '" + d.drive_names[static_cast<std::size_t>(c.drive)] + "'" : joint_name(d, c));
  }
  Eigen::Index row = d.m + d.n;
  for (const AssemblyTarget& target : equations.targets()) {
    const ConditionData& condition = d.conditions[static_cast<std::size_t>(target.condition)];
    if (!std::isfinite(F(row++)))
      add("the condition of '" + d.sensor_names[static_cast<std::size_t>(condition.sensor)] + "'");
  }
  if (names.empty()) names.emplace_back("a body's orientation");
  return names;
}

void add_drive(const MechanismData& d, AssemblyLevel level, const Constraint& c, const Eigen::VectorXd& F,
               double tolerance, std::vector<Finding>& findings) {
  const double amount = std::abs(F(c.row));
  if (amount <= tolerance) return;
  const RowQuantity quantity = c.quantity();
  const std::string unit = quantity == RowQuantity::angle ? " rad" : quantity == RowQuantity::length ? " m" : "";
  findings.push_back(
      {amount, fmt::format("drive '{}': missed by {:.3g}{}{}", d.drive_names[static_cast<std::size_t>(c.drive)], amount,
                           unit, level == AssemblyLevel::velocity ? " per second" : "")});
}

}  // namespace

std::string assembly_failure(const MechanismData& d, AssemblyLevel level, const AssemblyEquations& equations,
                             const NearestPoint& found) {
  const bool positions = level == AssemblyLevel::position;
  const std::string head = positions ? "initial assembly failed: " : "initial velocities failed: ";
  if (!std::isfinite(found.F.squaredNorm()))
    return head + "the equations are not finite at the guess: " +
           fmt::format("{}", fmt::join(not_finite(d, equations, found.F), ", ")) +
           ". Look at the laws of drives and the values of conditions (a root, logarithm or division outside its "
           "range), "
           "and at lengths and positions beyond all measure";
  if (found.status == NearestPointStatus::undetermined) {
    return head +
           "several initial states are equally near to the guess; move the guess (position, orientation of the "
           "bodies) towards the one that is meant, or fix it by initial.conditions";
  }
  if (found.status == NearestPointStatus::singular) {
    return head +
           "the search ends at a singular position (as with all bars in line), where several motions branch off; move "
           "the guess (position, orientation of the bodies) away from it, or fix the branch by initial.conditions";
  }
  const Eigen::VectorXd& F = found.F;
  const double tolerance = std::max(1e-9, 1e-3 * F.lpNorm<Eigen::Infinity>());
  std::vector<Finding> findings;
  for (std::size_t j = 0; j < d.joint_names.size(); ++j) {
    add_joint(d, level, static_cast<int>(j), F, tolerance, findings);
  }
  for (const Constraint& c : d.constraints) {
    if (c.drive >= 0) add_drive(d, level, c, F, tolerance, findings);
  }
  Eigen::Index row = d.m + d.n;
  for (const AssemblyTarget& target : equations.targets()) {
    const double off = F(row++);
    if (!(std::abs(off) > tolerance)) continue;
    // The norm of a velocity has no direction in which it could grow from rest.
    const bool at_rest = !target.sensor->components().empty() && std::abs(target.value + off) < 1e-12;
    const ConditionData& c = d.conditions[static_cast<std::size_t>(target.condition)];
    const std::string& unit = positions || c.velocity_level ? c.unit : c.rate_unit;
    findings.push_back(
        {std::abs(off), fmt::format("condition on '{}': asks for {}{:.3g}{}, nearest possible {:.3g}{}{}",
                                    d.sensor_names[static_cast<std::size_t>(c.sensor)],
                                    c.has_rate && !positions ? "rate " : "", target.value, unit, target.value + off,
                                    unit, at_rest ? " (from a guess at rest; give a velocity of the body)" : "")});
  }
  if (findings.empty()) {
    return head + "no convergence after " + std::to_string(found.iterations) +
           " iterations; give a guess (position, orientation of the bodies) nearer to the initial state";
  }
  std::stable_sort(findings.begin(), findings.end(),
                   [](const Finding& a, const Finding& b) { return a.amount > b.amount; });
  constexpr std::size_t kShown = 8;
  std::string text = head;
  for (std::size_t i = 0; i < std::min(kShown, findings.size()); ++i) text += (i ? "; " : "") + findings[i].text;
  if (findings.size() > kShown) text += "; and " + std::to_string(findings.size() - kShown) + " more";
  return text + (positions ? ". Check the lengths and conditions: the mechanism cannot be closed near its guess; if it "
                             "can elsewhere, give a guess (position, orientation of the bodies) on that side"
                           : ". The conditions on velocities contradict each other or the joints: leave one out, or "
                             "change its value");
}

}  // namespace mbsopt
