#include "app/starts/multistart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <tuple>

#include "app/report/report_parts.hpp"
#include "app/starts/distinct_optima.hpp"
#include "app/terminal/interrupt.hpp"
#include "app/terminal/text_table.hpp"
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
  const double violation = record.value("infeasibility", 0.0), objective = record["objective"].get<double>();
  if (violation <= kFeasible) return {0, objective, 0, number_of(record)};
  return {1, violation, objective, number_of(record)};
}

Json record_of(const JobReply& reply) {
  if (reply.ok) return read_json(reply.text);
  return {{"start", reply.job}, {"status", "failed"}, {"message", reply.text}, {"objective", nullptr}};
}

std::string text_of(const Json& record, const char* key) {
  if (!record.contains(key) || record[key].is_null()) return "-";
  return record[key].is_number_integer() ? std::to_string(record[key].get<long>())
                                         : significant(record[key].get<double>());
}

void print_waterfall(std::ostream& out, const std::vector<Json>& ranked) {
  std::vector<std::string> header{"rank", "start", "status", "objective", "infeasibility", "iterations", "evaluations"};
  if (!ranked.empty() && ranked[0].contains("parameters"))
    for (const auto& [name, value] : ranked[0]["parameters"].items()) header.push_back(name);
  TextTable table(header);
  for (std::size_t i = 0; i < std::min(kPrinted, ranked.size()); ++i) {
    const Json& record = ranked[i];
    std::vector<std::string> row{
        std::to_string(i + 1),         text_of(record, "start"),         record["status"].get<std::string>(),
        text_of(record, "objective"),  text_of(record, "infeasibility"), text_of(record, "iterations"),
        text_of(record, "evaluations")};
    for (std::size_t k = row.size(); k < header.size(); ++k)
      row.push_back(record.contains("parameters") ? text_of(record["parameters"], header[k].c_str()) : "-");
    table.add(row);
  }
  out << '\n' << table.text();
  if (ranked.size() > kPrinted) out << fmt::format("... and {} more, in result.json\n", ranked.size() - kPrinted);
}

void describe(const std::vector<DistinctOptimum>& optima, const SearchedOptima& found, bool all_found, Json& result) {
  Json list = Json::array();
  for (const DistinctOptimum& o : optima) {
    Json& entry = list.emplace_back(Json{{"start", number_of(*o.best)}, {"found_by", o.starts}});
    for (const char* key : {"objective", "infeasibility", "assembly_mode", "parameters"})
      if (o.best->contains(key)) entry[key] = (*o.best)[key];
  }
  result["optima"] = std::move(list);
  result["expected_optima"] = found.expected() ? Json(*found.expected()) : Json();
  result["covered"] = found.covered();
  result["all_found"] = all_found;
}

void print(const std::vector<DistinctOptimum>& optima, const SearchedOptima& found, bool all_found, std::ostream& out) {
  if (optima.empty()) return;
  TextTable table({"optimum", "found by", "first start", "objective"});
  for (std::size_t i = 0; i < std::min(kPrinted, optima.size()); ++i)
    table.add({std::to_string(i + 1), counted(optima[i].starts, "start"), text_of(*optima[i].best, "start"),
               text_of(*optima[i].best, "objective")});
  out << '\n' << table.text();
  if (optima.size() > kPrinted) out << fmt::format("... and {} more, in result.json\n", optima.size() - kPrinted);
  out << fmt::format("{} in {} that converged", counted(found.optima, "optimum", "optima"),
                     counted(found.searches, "search", "searches"));
  if (found.expected())
    out << fmt::format("; {:.3g} are expected in all, and {:.0f} % of further searches that converge at known ones{}",
                       *found.expected(), 100 * found.covered(), all_found ? ": the search ends" : "");
  out << '\n';
}

Json without_points(const Json& record) {
  Json short_record = Json::object();
  for (const auto& [key, value] : record.items())
    if (key != "points" && key != "hessians" && key != "motion") short_record[key] = value;
  return short_record;
}

// Returns whether the search ended because it had found all optima (spec.until_all_found).
bool compute_batches(Run& run, LongRun& long_run, const MultistartSpec& spec, const StartWork& work,
                     MultistartOutcome& outcome) {
  std::set<int> finished;
  for (const Json& record : long_run.earlier().starts) {
    if (finished.insert(number_of(record)).second) outcome.ranked.push_back(record);
  }
  const auto done = [&](const JobReply& reply) {
    const Json record = record_of(reply);
    const std::string status = record["status"];
    const bool cut_off = status == "stopped" || (!reply.ok && interrupted());
    // A worker that crashed may succeed next time, so it is not in the journal.
    if (!cut_off && reply.ok) long_run.add("start", record);
    outcome.interrupted = outcome.interrupted || cut_off;
    outcome.ranked.push_back(record);
    run.progress.iteration(fmt::format("start {:3d}   {}   objective {}   {} of {} finished", reply.job, status,
                                       text_of(record, "objective"), outcome.ranked.size(), spec.starts));
  };
  const auto show = [&] { run.progress.fraction("starts", static_cast<double>(outcome.ranked.size()) / spec.starts); };
  const int batch = spec.until_all_found ? kBatch : spec.starts;
  bool ends = false;
  for (int first = 0; first < spec.starts && !ends && !outcome.interrupted; first += batch) {
    const int last = std::min(first + batch, spec.starts);
    std::vector<int> jobs;
    for (int start = first; start < last; ++start)
      if (!finished.contains(start)) jobs.push_back(start);
    compute_starts(run, jobs, work, done, show);
    outcome.interrupted = outcome.interrupted || outcome.ranked.size() < static_cast<std::size_t>(last);
    std::ranges::sort(outcome.ranked, {}, rank);
    if (!spec.until_all_found) continue;
    std::vector<Json> looked_at;  // a resumed run may know starts of a later batch
    std::ranges::copy_if(outcome.ranked, std::back_inserter(looked_at),
                         [&](const Json& record) { return number_of(record) < last; });
    ends = all_found(looked_at, run.problem.scene);
  }
  return ends;
}

void tell_starts(Run& run, const MultistartSpec& spec, const MultistartOutcome& outcome) {
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
  for (const Json& record : outcome.ranked) result["waterfall"].push_back(without_points(record));
  print_waterfall(run.context.out, outcome.ranked);
  run.context.out << starts_in_words(result) << '\n';
  const auto ended = [&](const char* optimum) {
    return std::ranges::count_if(outcome.ranked, [&](const Json& r) { return r.value("optimum", "") == optimum; });
  };
  if (const long inside = ended("interior"), beside = ended("boundary"); inside + beside > 0) {
    result["optima_inside"] = inside, result["optima_at_boundary"] = beside;
    run.context.out << fmt::format("{} end in an optimum: {} inside, {} at a bound or a limit\n", inside + beside,
                                   inside, beside);
  }
}

}  // namespace

const Json* MultistartOutcome::best() const {
  return !ranked.empty() && has_objective(ranked[0]) ? &ranked[0] : nullptr;
}

std::string effort(const Run& run, long simulations, double wall_seconds) {
  std::string of;
  if (run.result.contains("multistart"))
    of = " in " + counted_starts(run.result["multistart"]);
  else if (run.context.options.resume)
    of = " since it was resumed";
  return fmt::format("{}, {:.3g} s{}", counted(simulations, "simulation"), wall_seconds, of);
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

MultistartOutcome run_multistart(Run& run, LongRun& long_run, const MultistartSpec& spec, const StartWork& work) {
  MultistartOutcome outcome;
  const bool all_found = compute_batches(run, long_run, spec, work, outcome);
  run.progress.finish();
  for (const Json& record : outcome.ranked) {
    outcome.simulations += record.value("simulations", 0L);
    outcome.wall_seconds += record.value("wall_seconds", 0.0);
  }
  tell_starts(run, spec, outcome);
  const std::vector<DistinctOptimum> optima = distinct_optima(outcome.ranked, run.problem.scene);
  describe(optima, searched(optima), all_found, run.result["multistart"]);
  print(optima, searched(optima), all_found, run.context.out);
  return outcome;
}

}  // namespace mbsopt::inline app
