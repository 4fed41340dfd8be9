#include "app/results/variant_results.hpp"

#include <fmt/format.h>

#include "app/files/csv_cell.hpp"
#include "app/terminal/text_table.hpp"

namespace mbsopt {
namespace {

constexpr double kSmall = 0.01;  // p

std::string verdict(const VariantComparison& test, const Variant& first, const Variant& second) {
  if (!test.none.empty()) return "no F-test: " + test.none;
  const std::string& larger = test.second ? second.name : first.name;
  std::string words =
      fmt::format("F({}, {}) = {:.4g}, p {}: the additional parameters of {} explain the data {} chance", test.more,
                  test.freedom, test.F, test.p > 0 ? fmt::format("= {:.2g}", test.p) : "< 1e-300", larger,
                  test.p < kSmall ? "better than" : "no better than");
  if (!test.white) words += "; residuals are correlated, so that p is too small";
  return words;
}

}  // namespace

void print_comparison(std::ostream& out, const Variant& first, const Variant& second) {
  const VariantComparison test = compare_variants(first.fit, second.fit);
  TextTable table({"variant", "parameters", "degrees of freedom", "rms/sigma", "AIC", "BIC"});
  for (const Variant* v : {&first, &second})
    table.add({v->name, std::to_string(v->fit.parameters.size()), std::to_string(v->fit.statistics.degrees_of_freedom),
               significant(test.rms_scaled[v == &second], 4), significant(v->fit.aic, 7), significant(v->fit.bic, 7)});
  out << '\n' << table.text() << verdict(test, first, second) << '\n';
}

void add_comparison(Json& result, const Variant& first, const Variant& second) {
  const VariantComparison test = compare_variants(first.fit, second.fit);
  Json& comparison = result["comparison"];
  for (const Variant* v : {&first, &second})
    comparison["variants"].push_back({{"problem", v->name},
                                      {"status", to_string(v->fit.status)},
                                      {"parameters", v->fit.parameters.size()},
                                      {"degrees_of_freedom", v->fit.statistics.degrees_of_freedom},
                                      {"rms_scaled", test.rms_scaled[v == &second]},
                                      {"aic", v->fit.aic},
                                      {"bic", v->fit.bic}});
  if (test.none.empty())
    comparison.update({{"larger", (test.second ? second : first).name},
                       {"more_parameters", test.more},
                       {"F", test.F},
                       {"p", test.p},
                       {"residuals_are_white", test.white}});
  else
    comparison["no_test"] = test.none;
}

}  // namespace mbsopt
