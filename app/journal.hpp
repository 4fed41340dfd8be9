// journal.jsonl of an output folder: what a long run has done so far, a line of JSON each, appended and handed to the
// system at once, so that a run that is killed loses nothing that was done.
//
//   {"journal": 1, "command": "design", "input": "../five_bar.json", ...}    the first line: what is run, and on what
//   {"point": {"x": [...], "f": 0.12, "f_x": [...], ...}}                    an evaluation   (point_records.hpp)
//   {"hessians": {...}}                                                      second derivatives
//   {"residuals": {...}}                                                     an experiment   (residual_records.hpp)
//   {"iterate": {"iteration": 3, "objective": ..., "parameters": {...}}}     accepted by the optimiser
//   {"start": {"start": 7, "status": "converged", ...}}                      a finished start of a multistart
//   {"ended": "ok"}                                                          the status of result.json
//
// A run goes on by doing everything again, from the first line; whatever the journal knows is not computed again. So it
// ends as it would have, bit by bit.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/result_json.hpp"

namespace mbsopt {

inline constexpr const char* kJournalFile = "journal.jsonl";

// Lines after the first. A last line that was cut off is none.
struct JournalContent {
  Json header;
  std::vector<Json> points, hessians, residuals, starts;
  int last_iteration = -1;
  std::string ended;  // empty: it did not end by itself
};

// Throws OutputError where there is none, or where it is none.
JournalContent read_journal(const std::filesystem::path& folder);

class Journal {
 public:
  // A new one, in place of any that was there; throws OutputError.
  Journal(const std::filesystem::path& folder, const Json& header);
  // Goes on with the one that is there, its cut-off last line removed.
  explicit Journal(const std::filesystem::path& folder);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  void add(const char* kind, const Json& content);  // throws OutputError

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
};

}  // namespace mbsopt
