#include "app/run/long_run.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <utility>

#include "app/files/atomic_file.hpp"
#include "app/terminal/exit_code.hpp"
#include "app/terminal/interrupt.hpp"
#include "optim/problem/seed.hpp"

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
  for (const auto& [key, file] :
       {std::pair{"points", context.options.sweep.points}, {"compare", context.options.compare}})
    if (!file.empty()) header[key] = std::filesystem::relative(file, run.folder.path()).generic_string();
  if (provenance.contains("data_sha256")) header["data_sha256"] = provenance["data_sha256"];
  return header;
}

}  // namespace

LongRun::LongRun(Run& run) : run_(run) {
  if (run.context.options.resume) earlier_ = read_journal(run.folder.path());
}

LongRun::~LongRun() {
  if (!journal_ || finished_) return;
  try {
    run_.progress.finish();
    run_.context.err << how_to_continue() << '\n';
  } catch (...) {  // the exception under way says more than this one
  }
}

long LongRun::seed(const std::string& of, const std::optional<long>& given) {
  long value = 0;
  if (given)
    value = *given;
  else if (earlier_.header.contains("seeds") && earlier_.header["seeds"].contains(of))
    value = earlier_.header["seeds"][of].get<long>();
  else
    value = drawn_seed();
  seeds_[of] = value;
  return value;
}

void LongRun::refuse_what_has_changed() const {
  const Json now = header_of(run_, seeds_);
  for (const char* key : {"version", "input_sha256", "data_sha256"}) {
    const Json before = earlier_.header.value(key, Json()), after = now.value(key, Json());
    if (before == after) continue;
    throw OutputError(fmt::format("{}: was begun with another {} and cannot be resumed: start '{}' anew",
                                  (run_.folder.path() / kJournalFile).string(),
                                  std::string(key) == "version"        ? "version of mbsopt"
                                  : std::string(key) == "input_sha256" ? "content of the problem file"
                                                                       : "content of a data file, plug-in or program",
                                  run_.context.command));
  }
}

void LongRun::begin() {
  if (journal_) return;
  if (!run_.context.options.resume) {
    journal_ = std::make_unique<Journal>(run_.folder.path(), header_of(run_, seeds_));
    return;
  }
  refuse_what_has_changed();
  journal_ = std::make_unique<Journal>(run_.folder.path(), earlier_);
}

void LongRun::add(const char* kind, const Json& content) {
  if (failure_) return;
  try {
    journal_->add(kind, content);
  } catch (const WriteError& error) {
    failure_ = error.what();
    interrupt();
  }
}

std::string LongRun::how_to_continue() const {
  if (!journal_->exists()) return "the journal was deleted during the run, so nothing can be resumed";
  return fmt::format("'mbsopt resume {}' continues", run_.folder.path().string());
}

void LongRun::stopped(const std::string& kept) {
  const std::string words = kept + "; " + how_to_continue();
  failure_ ? run_.failed(*failure_ + "; " + words) : run_.stopped(words);
}

void LongRun::failed(SolverStatus status, const std::string& message) {
  if (status != SolverStatus::iteration_limit) return run_.failed(message);
  const std::string& command = run_.context.command;
  run_.failed(fmt::format(
      "{}; raise {}.optimizer.max_iterations or max_evaluations, or go on from the best point: 'mbsopt {} {} --out "
      "ANOTHER_DIR'",
      message, command == "identify" ? "identification" : command, command,
      (run_.folder.path() / "optimized.json").string()));
}

int LongRun::finish() {
  const int exit_code = run_.finish();
  finished_ = true;
  if (!failure_) journal_->add("ended", run_.result["status"]);
  if (exit_code == kDone && !run_.context.options.keep_journal) {
    journal_.reset();
    std::error_code ignored;  // a journal that stays says that the run has ended
    std::filesystem::remove(run_.folder.path() / kJournalFile, ignored);
  }
  return exit_code;
}

}  // namespace mbsopt::inline app
