#include "app/starts/multistart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "app/terminal/interrupt.hpp"
#include "app/terminal/text_table.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt {
namespace {

constexpr double kFeasible = 1e-6;     // relative to the bounds
constexpr double kSameOptimum = 1e-3;  // of the range of a parameter
constexpr std::size_t kPrinted = 20;

bool has_objective(const Json& record) { return record.contains("objective") && record["objective"].is_number(); }

int number_of(const Json& record) { return record.at("start").get<int>(); }

// Smaller is better.
std::tuple<int, double, double, int> rank(const Json& record) {
  if (!has_objective(record)) return {2, 0, 0, number_of(record)};
  const double violation = record.value("infeasibility", 0.0), objective = record["objective"].get<double>();
  if (violation <= kFeasible) return {0, objective, 0, number_of(record)};
  return {1, violation, objective, number_of(record)};
}

Json record_of(const JobReply& reply) {
  if (reply.ok) return Json::parse(reply.text);
  return {{"start", reply.job}, {"status", "failed"}, {"message", reply.text}, {"objective", nullptr}};
}

bool same_optimum(const Json& a, const Json& b, const Scene& scene) {
  for (const auto& [name, value] : a["parameters"].items()) {
    if (!b["parameters"].contains(name)) return false;
    const auto parameter = std::find_if(scene.parameters.begin(), scene.parameters.end(),
                                        [&, key = name](const Parameter& p) { return p.name == key; });
    if (parameter == scene.parameters.end() || !parameter->lower || !parameter->upper) continue;
    const double range = *parameter->upper - *parameter->lower;
    if (std::abs(value.get<double>() - b["parameters"][name].get<double>()) > kSameOptimum * range) return false;
  }
  return true;
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

Json without_points(const Json& record) {
  Json short_record = Json::object();
  for (const auto& [key, value] : record.items())
    if (key != "points" && key != "hessians") short_record[key] = value;
  return short_record;
}

}  // namespace

const Json* MultistartOutcome::best() const {
  return !ranked.empty() && has_objective(ranked[0]) ? &ranked[0] : nullptr;
}

std::string effort(const Run& run, const std::optional<MultistartSpec>& starts, long simulations, double wall_seconds) {
  return fmt::format("{}, {:.3g} s{}", counted(simulations, "simulation"), wall_seconds,
                     starts                       ? fmt::format(" in all {}", counted(starts->starts, "start"))
                     : run.context.options.resume ? " since it was resumed"
                                                  : "");
}

Json named_values(const std::vector<std::string>& names, const std::vector<double>& values) {
  Json json = Json::object();
  for (std::size_t k = 0; k < names.size(); ++k) json[names[k]] = values[k];
  return json;
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
  std::set<int> finished;
  for (const Json& record : long_run.earlier().starts) {
    if (finished.insert(number_of(record)).second) outcome.ranked.push_back(record);
  }
  std::vector<int> jobs;
  for (int start = 0; start < spec.starts; ++start)
    if (!finished.contains(start)) jobs.push_back(start);

  const auto done = [&](const JobReply& reply) {
    const Json record = record_of(reply);
    const std::string status = record["status"];
    const bool cut_off = status == "stopped" || (!reply.ok && interrupted());
    // A worker that crashed may do better next time: not in the journal either.
    if (!cut_off && reply.ok) long_run.add("start", record);
    outcome.interrupted = outcome.interrupted || cut_off;
    outcome.ranked.push_back(record);
    run.progress.iteration(fmt::format("start {:3d}   {}   objective {}   {} of {} finished", reply.job, status,
                                       text_of(record, "objective"), outcome.ranked.size(), spec.starts));
  };
  compute_starts(run, jobs, work, done, [&] {
    run.progress.stands(fmt::format("{} of {} starts finished", outcome.ranked.size(), spec.starts));
  });
  run.progress.finish();
  outcome.interrupted = outcome.interrupted || outcome.ranked.size() < static_cast<std::size_t>(spec.starts);
  std::sort(outcome.ranked.begin(), outcome.ranked.end(),
            [](const Json& a, const Json& b) { return rank(a) < rank(b); });

  for (const Json& record : outcome.ranked) {
    outcome.simulations += record.value("simulations", 0L);
    outcome.wall_seconds += record.value("wall_seconds", 0.0);
  }
  Json& result = run.result["multistart"];
  result = {{"starts", spec.starts},
            {"seed", *spec.seed},
            {"sampling", spec.sampling == StartSampling::sobol ? "sobol" : "latin_hypercube"},
            {"finished", outcome.ranked.size()},
            {"simulations", outcome.simulations},
            {"wall_seconds", outcome.wall_seconds}};
  const Json* const best = outcome.best();
  const long same =
      best ? std::count_if(outcome.ranked.begin(), outcome.ranked.end(),
                           [&](const Json& r) { return has_objective(r) && same_optimum(*best, r, run.problem.scene); })
           : 0;
  result["best"] = best ? Json(number_of(*best)) : Json();
  result["at_the_best_optimum"] = same;
  for (const Json& record : outcome.ranked) result["waterfall"].push_back(without_points(record));
  print_waterfall(run.context.out, outcome.ranked);
  run.context.out << fmt::format("{}, seed {}: {} at the best optimum\n", counted(spec.starts, "start"), *spec.seed,
                                 same);
  return outcome;
}

}  // namespace mbsopt
