// journal.jsonl of an output folder: what a long run has finished, a line of JSON each. A line is appended and flushed
// to the disk at once, so that it survives the end of the run and of the machine.
//
//   {"journal": 6, "run": "52bd...", "command": "design", ...}               the first line: what is run, and on what
//   {"iterate": {"iteration": 3, "objective": ..., "parameters": {...}}}     accepted by the optimiser
//   {"start": {"start": 7, "status": "converged", ...}}                      a start, or a block of a sweep
//   {"ended": "ok"}                                                          the status of result.json, which exists
//
// So a line is a kind with its content. It ends with "sha256": "9f86...", the checksum of the line before this key
// after the checksum of the line before. So the reader finds a line that is damaged, missing, moved or of another run.
// It ignores a truncated last line.
//
// A resumed run takes finished starts from the journal and computes the others. Solvers are deterministic, and seeds
// are in the first line. So it ends with the same result, bit by bit.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "app/files/result_json.hpp"

namespace mbsopt::inline app {

inline constexpr const char* kJournalFile = "journal.jsonl";

// Where the next line goes.
struct JournalEnd {
  std::string seal;       // the last checksum
  std::size_t bytes = 0;  // of whole lines
};

struct JournalContent {
  Json header = Json::object();                      // the first line
  std::map<std::string, std::vector<Json>> records;  // contents of the others by kind, in their order
  JournalEnd end;

  const std::vector<Json>& of(const std::string& kind) const;
};

// Throws OutputError if there is no journal, or if it has another version or is damaged.
JournalContent read_journal(const std::filesystem::path& folder);

class Journal {
 public:
  // Replaces the journal of an earlier run. Throws OutputError if a file that is no journal has its name.
  Journal(const std::filesystem::path& folder, const Json& header);
  // Continues the journal of this end, and removes its truncated last line.
  Journal(const std::filesystem::path& folder, JournalEnd end);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  void add(const std::string& kind, const Json& content);  // throws WriteError; then the line is not there
  bool exists() const;                                     // false where its file was deleted meanwhile

 private:
  std::filesystem::path path_;
  JournalEnd end_;
  int descriptor_ = -1;
};

}  // namespace mbsopt::inline app
