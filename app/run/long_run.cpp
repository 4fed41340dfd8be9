#include "app/run/long_run.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "app/files/atomic_file.hpp"
#include "app/terminal/exit_code.hpp"
#include "app/terminal/interrupt.hpp"
#include "optim/problem/start_points.hpp"

namespace mbsopt::inline app {
namespace {

Json header_of(const Run& run, const Json& seeds) {
  const CommandContext& context = run.context;
  const Json& provenance = run.result["provenance"];
  Json header{{"program", "mbsopt"},
              {"version", run.result["version"]},
              {"command", context.command},
              {"arguments", context.arguments},
              {"input", provenance["input"]},
              {"input_sha256", provenance["input_sha256"]},
              {"seeds", seeds}};
  if (const std::string& points = context.options.sweep.points; !points.empty())
    header["points"] = std::filesystem::relative(points, run.folder.path()).generic_string();
  if (provenance.contains("data_sha256")) header["data_sha256"] = provenance["data_sha256"];
  return header;
}

}  // namespace

LongRun::LongRun(Run& its_run) : run(its_run) {
  if (run.context.options.resume) earlier_ = read_journal(run.folder.path());
}

LongRun::~LongRun() {
  if (!journal_ || finished_) return;
  try {
    run.progress.finish();
    run.context.err << how_to_continue() << '\n';
  } catch (...) {  // the exception under way says more than this one
  }
}

long LongRun::seed(const std::string& of, const std::optional<long>& given) {
  const Json earlier = earlier_.header.value("seeds", Json::object());
  const long value = given ? *given : earlier.contains(of) ? earlier[of].get<long>() : drawn_seed();
  seeds_[of] = value;
  return value;
}

void LongRun::begin() {
  if (journal_) return;
  interrupted();  // listens: from here on a signal ends the run in words
  const std::filesystem::path& folder = run.folder.path();
  const Json header = header_of(run, seeds_);
  if (!run.context.options.resume) {
    journal_ = std::make_unique<Journal>(folder, header);
    return;
  }
  for (const auto& [key, what] : {std::pair{"version", "version of mbsopt"},
                                  {"input_sha256", "content of the problem file"},
                                  {"data_sha256", "content of a data file, plug-in or program"}})
    if (earlier_.header.value(key, Json()) != header.value(key, Json()))
      throw OutputError(fmt::format("{}: was begun with another {} and cannot be resumed: start '{}' anew",
                                    (folder / kJournalFile).string(), what, run.context.command));
  journal_ = std::make_unique<Journal>(folder, earlier_.end);
}

void LongRun::add(const std::string& kind, const Json& content) {
  if (failure_) return;
  try {
    journal_->add(kind, content);
  } catch (const WriteError& error) {
    failure_ = error.what();
    interrupt();
  }
}

void LongRun::add_iterate(const Json& iterate) {
  const std::vector<Json>& before = earlier_.of("iterate");
  if (before.empty() || iterate.at("iteration") > before.back().at("iteration")) add("iterate", iterate);
}

// A run without starts has no finished parts.
std::string LongRun::how_to_continue() const {
  if (!journal_->exists()) return "the journal was deleted during the run, so nothing can be resumed";
  const Problem& problem = run.problem;
  const bool is_single = (run.context.command == "design" && !problem.design->multistart) ||
                         (run.context.command == "identify" && !problem.identification->multistart);
  return fmt::format("'mbsopt resume {}' {}", run.folder.path().string(), is_single ? "repeats the run" : "continues");
}

void LongRun::stopped(const std::string& kept) {
  const std::string words = kept + "; " + how_to_continue();
  failure_ ? run.failed(*failure_ + "; " + words) : run.stopped(words);
}

void LongRun::failed(SolverStatus status, const std::string& message) {
  if (status != SolverStatus::iteration_limit) return run.failed(message);
  const std::string& command = run.context.command;
  run.failed(fmt::format(
      "{}; raise {}.optimizer.max_iterations or max_evaluations, or go on from the best point: 'mbsopt {} {} --out "
      "ANOTHER_DIR'",
      message, command == "identify" ? "identification" : command, command,
      (run.folder.path() / "optimized.json").string()));
}

int LongRun::finish() {
  const int exit_code = run.finish();
  finished_ = true;
  if (!failure_) journal_->add("ended", run.result["status"]);
  if (exit_code == kDone && !run.context.options.keep_journal) {
    journal_.reset();
    std::error_code ignored;  // a journal that stays says that the run has ended
    std::filesystem::remove(run.folder.path() / kJournalFile, ignored);
  }
  return exit_code;
}

}  // namespace mbsopt::inline app
