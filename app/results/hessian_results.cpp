#include "app/results/hessian_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/results/objective_units.hpp"
#include "app/terminal/text_table.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt {
namespace {

constexpr Eigen::Index kColumns = 6;   // of a table
constexpr double kPoorlyKnown = 1e-4;  // of the largest entry, or of the gradient where that is larger

std::string entry_text(double value, double error) { return std::abs(value) <= error ? "0" : significant(value, 6); }

bool hides_entries(const ObjectiveHessian& H) {
  return ((H.value.array() != 0) && (H.value.array().abs() <= H.error.array())).any();
}

std::string accuracy(const ObjectiveHessian& H) {
  if (H.largest_error == 0) return "exact";
  if (H.largest_entry <= H.largest_error) return "zero, as far as differences can tell";
  return fmt::format("estimated error {:.1e} of the largest entry{}", H.relative(),
                     hides_entries(H) ? "; entries within their own error are shown as 0" : "");
}

}  // namespace

void add_hessians(Json& result, const Hessians& hessians, const std::vector<std::string>& objectives,
                  const std::vector<std::string>& parameters) {
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    const ObjectiveHessian& H = hessians.of[i];
    Json& objective = result["objectives"][objectives[i]];
    objective["hessian"] = Json::object();
    for (std::size_t p = 0; p < parameters.size(); ++p)
      objective["hessian"][parameters[p]] = by_name(parameters, H.value.row(static_cast<Eigen::Index>(p)));
    objective["hessian_error"] = H.relative();
  }
  result["methods"]["hessian"] = {{"wall_seconds", hessians.wall_seconds}, {"gradients", hessians.gradients}};
  result["hessian_method"] = hessian_method(hessians.method);
}

void print_hessians(std::ostream& out, const Hessians& hessians, const std::vector<std::string>& objectives,
                    const std::vector<std::string>& parameters) {
  out << fmt::format("\nsecond derivatives by {}: {}, {:.3g} s\n", hessian_method(hessians.method),
                     counted(hessians.gradients, "gradient"), hessians.wall_seconds);
  const auto n = static_cast<Eigen::Index>(parameters.size());
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    const ObjectiveHessian& H = hessians.of[i];
    out << fmt::format("\n{}: {}\n", objectives[i], accuracy(H));
    for (Eigen::Index first = 0; first < n; first += kColumns) {
      const Eigen::Index end = std::min(first + kColumns, n);
      std::vector<std::string> header{"d2 " + objectives[i]};
      for (Eigen::Index q = first; q < end; ++q) header.push_back(parameters[static_cast<std::size_t>(q)]);
      TextTable table(header);
      for (Eigen::Index p = first; p < n; ++p) {
        std::vector<std::string> row{parameters[static_cast<std::size_t>(p)]};
        for (Eigen::Index q = first; q < end; ++q)
          row.push_back(q <= p ? entry_text(H.value(p, q), H.error(p, q)) : std::string());
        table.add(std::move(row));
      }
      out << table.text();
    }
  }
}

std::vector<std::string> hessian_warnings(const Hessians& hessians, const std::vector<std::string>& objectives) {
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < objectives.size(); ++i) {
    const ObjectiveHessian& H = hessians.of[i];
    const double size = std::max(H.largest_entry, H.gradient);
    if (H.largest_error <= kPoorlyKnown * size) continue;
    warnings.push_back(
        fmt::format("the second derivatives of '{}' are known to {:.1g} of the largest only: differences at different "
                    "steps do not agree; is it smooth here (abs, min, max)?",
                    objectives[i], H.largest_error / size));
  }
  return warnings;
}

}  // namespace mbsopt
