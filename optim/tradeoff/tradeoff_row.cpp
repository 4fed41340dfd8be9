#include "optim/tradeoff/tradeoff_row.hpp"

#include <fmt/format.h>

namespace mbsopt {

std::string in_words(const TradeoffSetting& setting) {
  const IntegratorSettings& s = setting.simulation.integrator;
  std::string name = setting.curve;
  if (stands_alone(setting)) {  // for any method
    name = fmt::format("{} ({})", s.type, name);
    if (setting.gradient) name = fmt::format("{}, {}", to_string(*setting.gradient), name);
  }
  return s.step ? fmt::format("{} with steps of {:.3g} s", name, *s.step)
                : fmt::format("{} at rtol {:.0e}", name, s.rtol);
}

bool stands_alone(const TradeoffSetting& setting) {
  return setting.curve == kOwnSettings || setting.curve == kDefaults;
}

std::string_view to_string(RowStatus status) {
  switch (status) {
    case RowStatus::ok:
      return "ok";
    case RowStatus::failed:
      return "failed";
    case RowStatus::abandoned:
      return "abandoned";
    case RowStatus::skipped:
      break;
  }
  return "skipped";
}

}  // namespace mbsopt
