// journal.jsonl of an output folder: what a long run has done so far, a line of JSON each, appended at once. The kernel
// keeps an appended line when the run is killed. Lines are flushed to the disk, for a machine that stops: evaluations
// at most every 100 ms, other lines at once.
//
//   {"journal": 3, "command": "design", "input": "../five_bar.json", ...}    the first line: what is run, and on what
//   {"point": {"x": [...], "f": 0.12, "f_x": [...], ...}}                    an evaluation   (point_records.hpp)
//   {"hessians": {...}}                                                      second derivatives
//   {"residuals": {...}}                                                     an experiment   (residual_records.hpp)
//   {"iterate": {"iteration": 3, "objective": ..., "parameters": {...}}}     accepted by the optimiser
//   {"start": {"start": 7, "status": "converged", ...}}                      a finished start of a multistart, or block
//   of a sweep
//   {"ended": "ok"}                                                          the status of result.json, which is there
//
// Each line ends with
//   "run": "52bd...", "bytes": 310, "sha256": "9f86..."
// the run's id, the number of bytes before "sha256", and the checksum of these after the checksum of the line before.
// So a line that is damaged, missing, moved or of another run is found. A last line that was cut off is none.
//
// A run goes on by doing everything again, from the first line; whatever the journal knows is not computed again. So it
// ends as it would have, bit by bit.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/files/result_json.hpp"

namespace mbsopt {

inline constexpr const char* kJournalFile = "journal.jsonl";

// Lines after the first.
struct JournalContent {
  Json header;
  std::vector<Json> points, hessians, residuals, starts;
  int last_iteration = -1;
  std::string ended;      // empty: it did not end by itself
  std::string run, seal;  // its id; the last checksum
  std::size_t bytes = 0;  // of whole lines
};

// Throws OutputError where there is none, or where it is none of this version, or damaged.
JournalContent read_journal(const std::filesystem::path& folder);

// Reads a record's content. What throws there, a library's words or a wrong size, is refused as an OutputError.
void read_record(const std::function<void()>& read);

class Journal {
 public:
  // A new one, in place of one of an earlier run. Throws OutputError where a file that is no journal has its name.
  Journal(const std::filesystem::path& folder, const Json& header);
  // Goes on with the one that has been read, its cut-off last line removed.
  Journal(const std::filesystem::path& folder, const JournalContent& earlier);
  ~Journal();  // flushes
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  void add(const char* kind, const Json& content);  // throws WriteError; then the line is not there

 private:
  void open();
  bool flush();

  std::filesystem::path path_;
  std::string run_, seal_;
  std::size_t bytes_ = 0;
  int descriptor_ = -1;
  bool is_flushed_ = true;
  std::chrono::steady_clock::time_point flushed_at_ = std::chrono::steady_clock::now();
};

}  // namespace mbsopt
