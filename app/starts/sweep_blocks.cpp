#include "app/starts/sweep_blocks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/files/journal.hpp"
#include "app/terminal/interrupt.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline app {
namespace {

// A block costs a process (1 ms) and a line of the journal. A killed sweep loses one block per worker.
constexpr std::size_t kMostBlocks = 1000;

std::size_t block_size(std::size_t points) { return (points + kMostBlocks - 1) / kMostBlocks; }

Json task_of(const SweepOptions& options, long seed) {
  return {{"vary", options.vary},
          {"samples", options.samples ? Json(*options.samples) : Json()},
          {"points", options.points},
          {"gradients", options.gradients},
          {"seed", seed}};
}

SweepOptions options_in(const Json& task) {
  SweepOptions options;
  options.vary = task.at("vary").get<std::vector<std::string>>();
  if (!task.at("samples").is_null()) options.samples = task["samples"].get<int>();
  options.points = task.at("points").get<std::string>();
  options.gradients = task.at("gradients").get<bool>();
  return options;
}

Json to_json(const Evaluation& e, const std::vector<std::optional<double>>& true_values) {
  Json row{{"psi", entries_of(e.psi)}};
  for (const std::optional<double>& value : true_values) row["true"].push_back(or_null(value));
  if (e.psi_rho.rows() > 0) row["psi_rho"] = rows_of(e.psi_rho);
  return row;
}

// Runs in a worker process. An interrupt ends the block: it is "stopped", with the rows until then.
Json record_of_block(const Problem& problem, const SweepPoints& points, bool gradients, int block) {
  std::vector<std::string> varied;
  for (const int p : points.parameters) varied.push_back(problem.scene.parameters[static_cast<std::size_t>(p)].name);
  EvaluatorOptions options;
  options.progress = [](double) { return !interrupted(); };
  Evaluator evaluator(problem.scene, objectives_of(problem), varied, options);
  Json record{{"start", block}, {"status", "ok"}, {"rows", Json::array()}};
  const std::size_t size = block_size(points.values.size()), first = size * static_cast<std::size_t>(block);
  for (std::size_t i = first; i < std::min(first + size, points.values.size()); ++i) {
    Eigen::VectorXd rho = parameter_values(problem.scene);
    for (std::size_t k = 0; k < points.parameters.size(); ++k)
      rho(points.parameters[k]) = points.values[i](static_cast<Eigen::Index>(k));
    const Evaluation& e = gradients ? evaluator.gradients(rho) : evaluator.values(rho);
    Json row = e.ok ? to_json(e, evaluator.true_values(rho)) : Json{{"failed", e.message}};
    if (interrupted()) {  // which may have cut off the evaluation or the true values
      record["status"] = "stopped";
      break;
    }
    record["rows"].push_back(std::move(row));
  }
  return record;
}

}  // namespace

std::vector<Json> swept(LongRun& long_run, const SweepPoints& points, long seed) {
  Run& run = long_run.run;
  std::vector<Json> rows(points.values.size());
  const std::size_t size = block_size(rows.size());
  const std::size_t blocks = (rows.size() + size - 1) / size;
  std::size_t done = 0;
  const auto take = [&](const Json& record) {
    const std::size_t first = size * record.at("start").get<std::size_t>(), end = std::min(first + size, rows.size());
    ++done;
    if (record.at("status") == "failed")
      for (std::size_t i = first; i < end; ++i) rows[i]["failed"] = record.at("message");
    std::size_t i = first;
    for (const Json& row : record.value("rows", Json::array())) rows.at(i++) = row;
  };
  std::ranges::for_each(long_run.earlier().of("start"), take);
  compute_starts(long_run, 0, static_cast<int>(blocks),
                 sweep_work(run.problem, task_of(run.context.options.sweep, seed)), take,
                 [&] { run.progress.fraction("sweep", static_cast<double>(done) / static_cast<double>(blocks)); });
  run.progress.finish();
  return rows;
}

StartWork sweep_work(const Problem& problem, const Json& task) {
  const SweepOptions options = options_in(task);
  return {task,
          [problem, points = sweep_points(problem.scene, options, task.at("seed").get<long>()),
           gradients = options.gradients](int block) { return record_of_block(problem, points, gradients, block); }};
}

}  // namespace mbsopt::inline app
