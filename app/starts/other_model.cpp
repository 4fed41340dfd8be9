#include "app/starts/other_model.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "app/json/input_error.hpp"
#include "app/json/problem_source.hpp"
#include "app/starts/identify_starts.hpp"
#include "app/terminal/text_table.hpp"
#include "optim/fit/variant_comparison.hpp"

namespace mbsopt::inline app {
namespace {

constexpr double kSmall = 0.01;  // p

std::string verdict(const VariantComparison& test, const std::string& larger) {
  if (!test.none.empty()) return "no F-test: " + test.none;
  std::string words =
      fmt::format("F({}, {}) = {:.4g}, p {}: the additional parameters of {} explain the data {} chance", test.more,
                  test.freedom, test.F, test.p > 0 ? fmt::format("= {:.2g}", test.p) : "< 1e-300", larger,
                  test.p < kSmall ? "better than" : "no better than");
  if (!test.white) words += "; residuals are correlated, so that p is too small";
  return words;
}

// Variants carry the names of their problems, or of their files if both problems have one name.
void add_comparison(Run& run, const IdentificationResult& first, const IdentificationResult& second,
                    const std::string& name) {
  const CommandOptions& options = run.context.options;
  std::string names[] = {run.problem.scene.name, name};
  if (names[0] == names[1])
    names[0] = options.problem_file + (options.sets.empty() ? "" : " with --set"), names[1] = options.compare;
  const VariantComparison test = compare_variants(first, second);
  Json& comparison = run.result["comparison"];
  TextTable table({"variant", "parameters", "degrees of freedom", "rms/sigma", "AIC", "BIC"});
  for (const bool k : {false, true}) {
    const IdentificationResult& fit = k ? second : first;
    table.add({names[k], std::to_string(fit.parameters.size()), std::to_string(fit.statistics.degrees_of_freedom),
               significant(test.rms_scaled[k], 4), significant(fit.aic, 7), significant(fit.bic, 7)});
    comparison["variants"].push_back({{"problem", names[k]},
                                      {"status", to_string(fit.status)},
                                      {"parameters", fit.parameters.size()},
                                      {"degrees_of_freedom", fit.statistics.degrees_of_freedom},
                                      {"rms_scaled", test.rms_scaled[k]},
                                      {"aic", fit.aic},
                                      {"bic", fit.bic}});
  }
  run.context.out << '\n' << table.text() << verdict(test, names[test.second]) << '\n';
  if (test.none.empty())
    comparison.update({{"larger", names[test.second]},
                       {"more_parameters", test.more},
                       {"F", test.F},
                       {"p", test.p},
                       {"residuals_are_white", test.white}});
  else
    comparison["no_test"] = test.none;
}

}  // namespace

OtherModel::OtherModel(const CommandContext& context)
    : source_(read_problem_source(context.options.compare, {})),
      problem_(read_problem(*source_, nullptr, read_options(context))) {
  if (!problem_.identification)
    throw std::invalid_argument(fmt::format("--compare: {} has no identification", context.options.compare));
}

void OtherModel::check(Run& run, const IdentificationOptions& options) {
  const CommandOptions& given = run.context.options;
  problem_.scene.simulation.integrator = run.problem.scene.simulation.integrator;
  problem_.scene.simulation.accuracy.reset();
  try {
    cut_ = cut_into_windows(problem_, data_of(problem_), options.user_forces, options.simulation_progress);
    IdentificationOptions once = options;
    once.preflight = true, once.tests_angles = false;
    run_identification(cut_.problem, cut_.data, once);
  } catch (const std::invalid_argument& error) {
    const Finding whole{source_->file.string(), 0, 0, "", error.what()};
    throw InputError({source_->finding(error.what()).value_or(whole)});
  }
  run.progress.finish();
  if (problem_.identification->multistart)
    run.warn(
        fmt::format("--compare: the multistart of {} is not run, its fit begins at its given values", given.compare));
  if (!given.sets.empty()) run.warn(fmt::format("--compare: --set does not change {}", given.compare));
  if (given.preflight) run.warn("--compare: is skipped by --preflight, which fits nothing");
}

void OtherModel::compare(Run& run, const IdentificationResult& fit, const IdentificationOptions& options) const {
  try {
    const IdentificationResult second = run_identification(cut_.problem, cut_.data, options);
    run.progress.finish();
    if (second.status != SolverStatus::stopped) add_comparison(run, fit, second, problem_.scene.name);
  } catch (const std::exception& error) {
    run.warn(fmt::format("--compare: {}: {}", run.context.options.compare, error.what()));
  }
}

}  // namespace mbsopt::inline app
