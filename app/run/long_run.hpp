// A run that may take hours, with its journal. It is new or resumed (mbsopt resume).
//
//   LongRun long_run(run);
//   spec.seed = long_run.seed("multistart", spec.seed);   // given, or that of the resumed run, or drawn
//   long_run.begin();                                     // throws OutputError when the input has changed
//   long_run.earlier().of("start") ...                    // what was done before
//   long_run.add("start", record);
//   return long_run.finish();                             // that of Run; a successful run needs no journal
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "app/files/journal.hpp"
#include "app/run/run.hpp"
#include "optim/solver/solver_outcome.hpp"

namespace mbsopt::inline app {

class LongRun {
 public:
  explicit LongRun(Run& run);
  ~LongRun();  // says how to continue if an exception ends the run
  LongRun(const LongRun&) = delete;
  LongRun& operator=(const LongRun&) = delete;

  long seed(const std::string& of, const std::optional<long>& given);
  void begin();  // once; further calls do nothing
  // Returns the exit code. The journal ends only when all files are written; until then `resume` writes them. Then it
  // is removed, unless the run failed or --keep-journal is set.
  int finish();

  Run& run;
  const JournalContent& earlier() const { return earlier_; }
  // Adds a line to the journal. No exception may pass through a solver. If the journal cannot be written, the run stops
  // as by a signal, and reports the failure at its end.
  void add(const std::string& kind, const Json& content);
  void add_iterate(const Json& iterate);  // unless the earlier run has: its "iteration" says so
  // Ends a stopped run. kept names the content of the folder.
  void stopped(const std::string& kept);
  // Ends a failed search, whose best point is in optimized.json. At a limit of iterations it says what to change.
  void failed(SolverStatus status, const std::string& message);

 private:
  std::string how_to_continue() const;

  JournalContent earlier_;
  Json seeds_ = Json::object();
  std::unique_ptr<Journal> journal_;
  std::optional<std::string> failure_;  // of the journal
  bool finished_ = false;
};

}  // namespace mbsopt::inline app
