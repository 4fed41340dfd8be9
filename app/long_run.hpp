// A run that may take hours, and its journal: new, or gone on with (mbsopt resume).
//
//   LongRun long_run(run);
//   spec.seed = long_run.seed("multistart", spec.seed);   // given, of the run that this one goes on with, or drawn
//   long_run.begin();                                     // throws OutputError when the input has changed
//   long_run.earlier().starts ...                         // what was done before
//   long_run.journal().add("start", record);
//   long_run.end("ok");
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "app/journal.hpp"
#include "app/run.hpp"

namespace mbsopt {

class LongRun {
 public:
  explicit LongRun(Run& run);

  long seed(const std::string& of, const std::optional<long>& given);
  void begin();                         // once; further calls do nothing
  void end(const std::string& status);  // "ok", "failed", "interrupted"

  const JournalContent& earlier() const { return earlier_; }
  Journal& journal() { return *journal_; }

 private:
  void refuse_what_has_changed() const;

  Run& run_;
  JournalContent earlier_;
  Json seeds_ = Json::object();
  std::unique_ptr<Journal> journal_;
};

}  // namespace mbsopt
