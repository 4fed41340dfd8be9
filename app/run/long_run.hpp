// A run that may take hours, and its journal: new, or gone on with (mbsopt resume).
//
//   LongRun long_run(run);
//   spec.seed = long_run.seed("multistart", spec.seed);   // given, of the run that this one goes on with, or drawn
//   long_run.begin();                                     // throws OutputError when the input has changed
//   long_run.earlier().starts ...                         // what was done before
//   long_run.add("start", record);
//   return long_run.finish();                             // that of Run; what came to a good end needs no journal
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "app/files/journal.hpp"
#include "app/run/run.hpp"

namespace mbsopt {

class LongRun {
 public:
  explicit LongRun(Run& run);
  ~LongRun();  // says how to go on where an exception ends the run
  LongRun(const LongRun&) = delete;
  LongRun& operator=(const LongRun&) = delete;

  long seed(const std::string& of, const std::optional<long>& given);
  void begin();  // once; further calls do nothing
  // The exit code. Only when all files are written has the journal come to its end: till then `resume` writes them.
  // Then it is removed, unless the run failed or --keep-journal asks for it.
  int finish();

  const JournalContent& earlier() const { return earlier_; }
  // Into the journal. Nothing may be thrown through a solver: where the journal cannot be written, the run is stopped
  // as by a signal, and fails in words at its end.
  void add(const char* kind, const Json& content);
  // How the run ends that was stopped; kept: what the folder holds.
  void stopped(const std::string& kept);

 private:
  void refuse_what_has_changed() const;

  Run& run_;
  JournalContent earlier_;
  Json seeds_ = Json::object();
  std::unique_ptr<Journal> journal_;
  std::optional<std::string> failure_;  // of the journal
  bool finished_ = false;
};

}  // namespace mbsopt
