// journal.jsonl of an output folder: the progress of a long run, a line of JSON each, appended at once. The kernel
// keeps an appended line when the run is killed. A flush to the disk protects lines when the machine stops: evaluations
// at most every 100 ms, other lines at once.
//
//   {"journal": 5, "command": "design", "input": "../five_bar.json", ...}    the first line: what is run, and on what
//   {"point": {"x": [...], "f": 0.12, "f_x": [...], ...}}                    an evaluation   (json_records.hpp)
//   {"hessians": {...}}                                                      second derivatives
//   {"residuals": {...}}                                                     an experiment   (json_records.hpp)
//   {"iterate": {"iteration": 3, "objective": ..., "parameters": {...}}}     accepted by the optimiser
//   {"start": {"start": 7, "status": "converged", ...}}                      a start, or a block of a sweep
//   {"ended": "ok"}                                                          the status of result.json, which exists
//
// So a line is a kind with its content. It ends with
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
#include <map>
#include <string>
#include <vector>

#include "app/files/result_json.hpp"

namespace mbsopt::inline app {

inline constexpr const char* kJournalFile = "journal.jsonl";

// Where the next line goes.
struct JournalEnd {
  std::string run, seal;  // the run's id; the last checksum
  std::size_t bytes = 0;  // of whole lines
};

using JournalRecords = std::map<std::string, std::vector<Json>>;  // contents of lines by kind, in their order

struct JournalContent {
  Json header = Json::object();  // the first line
  JournalRecords records;        // of the others
  JournalEnd end;

  const std::vector<Json>& of(const std::string& kind) const;
};

// Throws OutputError if there is no journal, or if it has another version or is damaged.
JournalContent read_journal(const std::filesystem::path& folder);

// Reads a record's content. It turns exceptions, from a library or a wrong size, into an OutputError.
void read_record(const std::function<void()>& read);

class Journal {
 public:
  // Replaces the journal of an earlier run. Throws OutputError if a file that is no journal has its name.
  Journal(const std::filesystem::path& folder, const Json& header);
  // Continues the journal of this end, and removes its truncated last line.
  Journal(const std::filesystem::path& folder, JournalEnd end);
  ~Journal();  // flushes
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  void add(const std::string& kind, const Json& content);  // throws WriteError; then the line is not there
  bool exists() const;                                     // false where its file was deleted meanwhile

 private:
  bool flush();

  std::filesystem::path path_;
  JournalEnd end_;
  int descriptor_ = -1;
  bool is_flushed_ = true;
  std::chrono::steady_clock::time_point flushed_at_ = std::chrono::steady_clock::now();
};

}  // namespace mbsopt::inline app
