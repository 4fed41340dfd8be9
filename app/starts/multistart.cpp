#include "app/starts/multistart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <tuple>

#include "app/report/run_page.hpp"
#include "app/starts/distinct_optima.hpp"
#include "app/terminal/interrupt.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {
namespace {

constexpr std::size_t kPrinted = 20;
// After so many starts it decides whether all optima are found. The number does not depend on the machine.
constexpr int kBatch = 20;

bool has_objective(const Json& record) { return record.contains("objective") && record["objective"].is_number(); }

int number_of(const Json& record) { return record.at("start").get<int>(); }

// A smaller rank is better.
std::tuple<int, double, double, int> rank(const Json& record) {
  if (!has_objective(record)) return {2, 0, 0, number_of(record)};
  const double violation = record.value("infeasibility", 0.0),
               objective = (record.value("maximised", false) ? -1 : 1) * record["objective"].get<double>();
  if (violation <= kFeasible) return {0, objective, 0, number_of(record)};
  return {1, violation, objective, number_of(record)};
}

// Prints a table of the first rows.
void print_first(std::ostream& out, const Json& rows, const std::vector<TableColumn>& columns) {
  const Json first(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(std::min(kPrinted, rows.size())));
  out << '\n' << table_of(first, columns).text();
  if (rows.size() > kPrinted) out << fmt::format("... and {} more, in result.json\n", rows.size() - kPrinted);
}

void print_waterfall(std::ostream& out, const Json& waterfall) {
  std::vector<TableColumn> columns{{"rank"}};
  for (const char* key : {"start", "status", "objective", "infeasibility", "iterations", "evaluations"})
    columns.push_back({key, key});
  if (!waterfall.empty() && waterfall[0].contains("parameters"))
    for (const auto& [name, value] : waterfall[0]["parameters"].items())
      columns.push_back({name, "parameters/" + name});
  print_first(out, waterfall, columns);
}

// Adds the distinct optima to the result, and prints them.
void add_optima(Run& run, const std::vector<DistinctOptimum>& optima, bool all_found) {
  const SearchedOptima found = searched(optima);
  Json& result = run.result["multistart"];
  result["optima"] = Json::array();
  for (const DistinctOptimum& o : optima) {
    Json& entry = result["optima"].emplace_back(Json{{"start", number_of(*o.best)}, {"found_by", o.starts}});
    for (const char* key : {"objective", "infeasibility", "assembly_mode", "parameters"})
      if (o.best->contains(key)) entry[key] = (*o.best)[key];
  }
  result["expected_optima"] = or_null(found.expected());
  result["covered"] = found.covered();
  result["all_found"] = all_found;
  if (optima.empty()) return;
  std::ostream& out = run.context.out;
  print_first(out, result["optima"],
              {{"optimum"}, {"found by starts", "found_by"}, {"best start", "start"}, {"objective", "objective"}});
  out << fmt::format("{} in {} that converged", counted(found.optima, "optimum", "optima"),
                     counted(found.searches, "search", "searches"));
  if (found.expected())
    out << fmt::format("; {:.3g} are expected in all, and {:.0f} % of further searches that converge at known ones{}",
                       *found.expected(), 100 * found.covered(), all_found ? ": the search ends" : "");
  out << '\n';
}

// Returns whether the search ended because it had found all optima (spec.until_all_found).
bool compute_batches(LongRun& long_run, const MultistartSpec& spec, const StartWork& work, MultistartOutcome& outcome) {
  Run& run = long_run.run;
  outcome.ranked = long_run.earlier().of("start");
  const auto done = [&](const Json& record) {
    outcome.ranked.push_back(record);
    run.progress.iteration(fmt::format("start {:3d}   {}   objective {}   {} of {} finished", number_of(record),
                                       cell(record.at("status")), cell(record.at("objective")), outcome.ranked.size(),
                                       spec.starts));
  };
  const auto show = [&] { run.progress.fraction("starts", static_cast<double>(outcome.ranked.size()) / spec.starts); };
  const int batch = spec.until_all_found ? kBatch : spec.starts;
  bool ends = false;
  for (int first = 0; first < spec.starts && !ends && !outcome.interrupted; first += batch) {
    const int last = std::min(first + batch, spec.starts);
    outcome.interrupted = !compute_starts(long_run, first, last, work, done, show);
    std::ranges::sort(outcome.ranked, {}, rank);
    if (!spec.until_all_found) continue;
    std::vector<Json> looked_at;  // a resumed run may know starts of a later batch
    std::ranges::copy_if(outcome.ranked, std::back_inserter(looked_at),
                         [&](const Json& record) { return number_of(record) < last; });
    ends = all_found(looked_at, run.problem.scene);
  }
  return ends;
}

void add_starts(Run& run, const MultistartSpec& spec, const MultistartOutcome& outcome) {
  const Json* const best = outcome.best();
  const long same = best && is_an_optimum(*best)
                        ? std::ranges::count_if(outcome.ranked,
                                                [&](const Json& r) {
                                                  return has_objective(r) && same_optimum(*best, r, run.problem.scene);
                                                })
                        : 0;
  Json& result = run.result["multistart"];
  result = {{"starts", spec.starts},
            {"seed", *spec.seed},
            {"sampling", spec.sampling == StartSampling::sobol ? "sobol" : "latin_hypercube"},
            {"finished", outcome.ranked.size()},
            {"simulations", outcome.simulations},
            {"wall_seconds", outcome.wall_seconds},
            {"best", best ? Json(number_of(*best)) : Json()},
            {"at_the_best_optimum", same}};
  for (const Json& record : outcome.ranked) result["waterfall"].push_back(record);
  print_waterfall(run.context.out, result.value("waterfall", Json::array()));
  run.context.out << starts_in_words(result) << '\n';
  const auto ended = [&](const char* optimum) {
    return std::ranges::count_if(outcome.ranked, [&](const Json& r) { return r.value("optimum", "") == optimum; });
  };
  if (const long inside = ended("interior"), beside = ended("boundary"); inside + beside > 0) {
    result["optima_inside"] = inside;
    result["optima_at_boundary"] = beside;
    run.context.out << fmt::format("{} end in an optimum: {} inside, {} at a bound or a limit\n", inside + beside,
                                   inside, beside);
  }
}

}  // namespace

const Json* MultistartOutcome::best() const {
  return !ranked.empty() && has_objective(ranked[0]) ? &ranked[0] : nullptr;
}

std::string effort(const Run& run, long simulations, double wall_seconds) {
  const bool several = run.result.contains("multistart");
  return fmt::format("{}, {:.3g} s{}", counted(simulations, "simulation"), wall_seconds,
                     several ? " in " + counted_starts(run.result["multistart"]) : "");
}

std::vector<Parameter> parameters_of(const Scene& scene, const std::vector<std::string>& names) {
  std::vector<Parameter> parameters;
  for (const std::string& name : names)
    std::ranges::copy_if(scene.parameters, std::back_inserter(parameters),
                         [&](const Parameter& p) { return p.name == name; });
  return parameters;
}

Problem with_values(Problem problem, const Json& values) {
  for (Parameter& p : problem.scene.parameters)
    if (values.contains(p.name)) p.value = values[p.name].get<double>();
  if (problem.design) problem.design->multistart.reset();
  if (problem.identification) problem.identification->multistart.reset();
  return problem;
}

MultistartOutcome run_multistart(LongRun& long_run, const MultistartSpec& spec, const StartWork& work) {
  Run& run = long_run.run;
  MultistartOutcome outcome;
  const bool all_found = compute_batches(long_run, spec, work, outcome);
  run.progress.finish();
  for (const Json& record : outcome.ranked) {
    outcome.simulations += record.value("simulations", 0L);
    outcome.wall_seconds += record.value("wall_seconds", 0.0);
  }
  add_starts(run, spec, outcome);
  add_optima(run, distinct_optima(outcome.ranked, run.problem.scene), all_found);
  return outcome;
}

}  // namespace mbsopt::inline app
