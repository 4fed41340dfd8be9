#include "app/results/preflight_results.hpp"

#include <fmt/format.h>

#include <cmath>

#include "app/terminal/text_table.hpp"

namespace mbsopt {

void print_preflight(std::ostream& out, const IdentificationResult& start) {
  TextTable parameters({"parameter", "start", "predicted std error", "unit"});
  for (const FittedParameter& p : start.parameters)
    parameters.add({p.name, significant(p.initial), std::isfinite(p.std_error) ? significant(p.std_error, 3) : "-",
                    p.unit.empty() ? "-" : p.unit});
  out << '\n' << parameters.text();
  for (const std::string& words : start.statistics.unidentifiable)
    out << "not determined by the data: " << words << '\n';
  out << "\npredicted at the start, with the sigmas as given; nothing was fitted\n";
}

void add_preflight(Json& result, const IdentificationResult& start) {
  for (const FittedParameter& p : start.parameters)
    result["preflight"]["parameters"][p.name] = {{"start", p.initial}, {"predicted_std_error", p.std_error}};
  result["identifiability"] = {{"condition_number", start.statistics.condition_number},
                               {"unidentifiable", start.statistics.unidentifiable}};
}

}  // namespace mbsopt
