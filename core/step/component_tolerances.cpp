#include "core/step/component_tolerances.hpp"

#include <string>

#include "core/body/state_layout.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {
namespace {

Eigen::VectorXd of_components(const MechanismData& data, double smallest, const std::optional<KindTolerances>& kinds) {
  const StateLayout layout{data.n};
  Eigen::VectorXd tolerance = Eigen::VectorXd::Constant(2 * layout.positions(), smallest);
  if (!kinds) return tolerance;
  const double least = kinds->smallest();
  const auto scaled = [&](const std::optional<double>& given) { return smallest * (given.value_or(least) / least); };
  for (int body = 1; body <= data.n; ++body) {
    tolerance.segment<3>(layout.q(body)).setConstant(scaled(kinds->position));
    tolerance.segment<4>(layout.p(body)).setConstant(scaled(kinds->angle));
    tolerance.segment<3>(layout.v(body)).setConstant(scaled(kinds->velocity));
    tolerance.segment<4>(layout.pdot(body)).setConstant(scaled(kinds->rate));
    for (const auto& [name, given] : kinds->bodies) {
      if (name != data.body_names[static_cast<std::size_t>(body)]) continue;
      tolerance.segment<7>(layout.q(body)).setConstant(scaled(given));
      tolerance.segment<7>(layout.v(body)).setConstant(scaled(given));
    }
  }
  return tolerance;
}

}  // namespace

ComponentTolerances::ComponentTolerances(const MechanismData& data, const IntegratorSettings& s)
    : rtol_(of_components(data, s.rtol, s.rtol_of)), atol_(of_components(data, s.atol, s.atol_of)) {}

}  // namespace mbsopt
