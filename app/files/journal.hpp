// journal.jsonl of an output folder: the progress of a long run, a line of JSON each, appended at once. The kernel
// keeps an appended line when the run is killed. A flush to the disk protects lines when the machine stops: evaluations
// at most every 100 ms, other lines at once.
//
//   {"journal": 4, "command": "design", "input": "../five_bar.json", ...}    the first line: what is run, and on what
//   {"point": {"x": [...], "f": 0.12, "f_x": [...], ...}}                    an evaluation   (json_records.hpp)
//   {"hessians": {...}}                                                      second derivatives
//   {"residuals": {...}}                                                     an experiment   (json_records.hpp)
//   {"iterate": {"iteration": 3, "objective": ..., "parameters": {...}}}     accepted by the optimiser
//   {"start": {"start": 7, "status": "converged", ...}}                      a start, or a block of a sweep
//   {"ended": "ok"}                                                          the status of result.json, which exists
//
// Each line ends with
//   "run": "52bd...", "bytes": 310, "sha256": "9f86..."
// the run's id, the number of bytes before "sha256", and the checksum of these after the checksum of the line before.
// So the reader finds a line that is damaged, missing, moved or of another run. It ignores a truncated last line.
//
// A resumed run repeats everything from the first line, but takes from the journal what it contains. So it ends with
// the same result, bit by bit.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/files/result_json.hpp"

namespace mbsopt::inline app {

inline constexpr const char* kJournalFile = "journal.jsonl";

// The lines after the first one, which is the header.
struct JournalContent {
  Json header;
  std::vector<Json> points, hessians, residuals, starts;
  int last_iteration = -1;
  std::string ended;      // empty: it did not end by itself
  std::string run, seal;  // its id; the last checksum
  std::size_t bytes = 0;  // of whole lines
};

// Throws OutputError if there is no journal, or if it has another version or is damaged.
JournalContent read_journal(const std::filesystem::path& folder);

// Reads a record's content. It turns exceptions, from a library or a wrong size, into an OutputError.
void read_record(const std::function<void()>& read);

class Journal {
 public:
  // Replaces the journal of an earlier run. Throws OutputError if a file that is no journal has its name.
  Journal(const std::filesystem::path& folder, const Json& header);
  // Continues the given journal, and removes its truncated last line.
  Journal(const std::filesystem::path& folder, const JournalContent& earlier);
  ~Journal();  // flushes
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  void add(const char* kind, const Json& content);  // throws WriteError; then the line is not there
  bool exists() const;                              // false where its file was deleted meanwhile

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

}  // namespace mbsopt::inline app
