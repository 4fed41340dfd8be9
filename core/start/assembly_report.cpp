#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "core/constraint/constraint.hpp"
#include "core/start/assembly_equations.hpp"

namespace mbsopt {
namespace {

struct Finding {
  std::string name;
  double amount;
  std::string text;  // what the message says of it
};

// The violation of one joint: the distance of points, the deviation of directions from a right angle.
void add_joint(const MechanismData& d, bool rates, int joint, const Eigen::VectorXd& F, double tolerance,
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
  if (!any) return;
  std::vector<std::string> parts;
  if (apart > tolerance) parts.push_back(fmt::format("points {:.3g} {} apart", apart, rates ? "m/s" : "m"));
  if (skew > tolerance) {
    parts.push_back(rates ? fmt::format("axes turn apart at {:.3g} rad/s", skew)
                          : fmt::format("axes {:.3g} rad out of line", std::asin(std::min(1.0, skew))));
  }
  if (turned > tolerance) parts.push_back(fmt::format("angles off by {:.3g} {}", turned, rates ? "rad/s" : "rad"));
  const std::string name = fmt::format("joint '{}' ({} - {})", d.joint_names[at(joint)], d.body_names[at(any->body1)],
                                       d.body_names[at(any->body2)]);
  const bool finite = std::isfinite(apart + skew + turned);
  findings.push_back(
      {name, finite ? std::max({apart, skew, turned}) : NAN, fmt::format("{}: {}", name, fmt::join(parts, ", "))});
}

void add_drive(const MechanismData& d, bool rates, const Constraint& c, const Eigen::VectorXd& F,
               std::vector<Finding>& findings) {
  const double amount = std::abs(F(c.row));
  const RowQuantity quantity = c.quantity();
  const std::string unit = quantity == RowQuantity::angle ? " rad" : quantity == RowQuantity::length ? " m" : "";
  const std::string name = "drive '" + d.drive_names[at(c.drive)] + "'";
  findings.push_back(
      {name, amount, fmt::format("{}: missed by {:.3g}{}{}", name, amount, unit, rates ? " per second" : "")});
}

void add_condition(const MechanismData& d, const AssemblyTarget& target, double off, std::vector<Finding>& findings) {
  // The norm of a velocity has no direction in which it could grow from rest.
  const ConditionData& c = *target.condition;
  const bool at_rest = !c.measured->components().empty() && std::abs(c.value + off) < 1e-12;
  const std::string& sensor = d.sensor_names[at(c.sensor)];
  findings.push_back({"the condition of '" + sensor + "'", std::abs(off),
                      fmt::format("condition on '{}': asks for {}{:.3g}{}, nearest possible {:.3g}{}{}", sensor,
                                  c.of_rate ? "rate " : "", c.value, c.unit, c.value + off, c.unit,
                                  at_rest ? " (from a guess at rest; give a velocity of the body)" : "")});
}

}  // namespace

std::string assembly_failure(const MechanismData& d, const AssemblyEquations& equations, const NearestPoint& found) {
  const bool positions = equations.level() == AssemblyLevel::position;
  const std::string head = positions ? "initial assembly failed: " : "initial velocities failed: ";
  const Eigen::VectorXd& F = found.F;
  const double tolerance = std::max(1e-9, 1e-3 * F.lpNorm<Eigen::Infinity>());
  std::vector<Finding> findings;
  for (std::size_t j = 0; j < d.joint_names.size(); ++j)
    add_joint(d, !positions, static_cast<int>(j), F, tolerance, findings);
  for (const Constraint& c : d.constraints)
    if (c.drive >= 0) add_drive(d, !positions, c, F, findings);
  Eigen::Index row = d.m + d.n;
  for (const AssemblyTarget& target : equations.targets()) add_condition(d, target, F(row++), findings);
  if (!std::isfinite(F.squaredNorm())) {
    std::vector<std::string> names;
    for (const Finding& f : findings)
      if (!std::isfinite(f.amount)) names.push_back(f.name);
    if (names.empty()) names.emplace_back("a body's orientation");
    return fmt::format(
        "{}the equations are not finite at the guess: {}. Look at the laws of drives and the values of conditions (a "
        "root, logarithm or division outside its range), and at lengths and positions beyond all measure",
        head, fmt::join(names, ", "));
  }
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
  std::erase_if(findings, [&](const Finding& f) { return !(f.amount > tolerance); });
  if (findings.empty()) {
    return head + "no convergence after " + std::to_string(found.iterations) +
           " iterations; give a guess (position, orientation of the bodies) nearer to the initial state";
  }
  std::ranges::stable_sort(findings, std::ranges::greater(), &Finding::amount);
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
