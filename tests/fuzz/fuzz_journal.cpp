// journal.jsonl. Any bytes are a journal or refused in words. What is written reads back; of a journal with one other
// byte, the first records do, or it is refused.
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <vector>

#include "app/files/atomic_file.hpp"
#include "app/files/journal.hpp"
#include "optim/problem/regular_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"

using namespace mbsopt;
using fuzz::expect;

namespace {

// One folder for all calls of a process, removed at its end.
class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / ("mbsopt_fuzz_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

template <class Read>
void refused_in_words(std::string_view text, const Read& read) {
  try {
    read();
  } catch (const OutputError& error) {
    fuzz::expect_words(error.what(), text);
  }
}

void write(const std::filesystem::path& file, std::string_view text) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << text;
}

// The lines of the text that are JSON objects.
std::vector<Json> records_of(std::string_view text) {
  std::vector<Json> records;
  while (!text.empty() && records.size() < 4) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const Json json = Json::parse(line.begin(), line.end(), nullptr, false);
    if (json.is_object()) records.push_back(json);
  }
  return records;
}

bool is_beginning(const std::vector<Json>& of, const std::vector<Json>& found) {
  return found.size() <= of.size() && std::equal(found.begin(), found.end(), of.begin());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  const std::filesystem::path file = folder.path() / kJournalFile;
  const std::string_view text = fuzz::text_of(data, size);
  write(file, text);
  refused_in_words(text, [&] { read_journal(folder.path()); });
  const std::vector<Json> records = records_of(text);
  if (records.empty()) return 0;
  std::filesystem::remove(file);
  {
    Journal journal(folder.path(), Json{{"program", "mbsopt"}});
    for (const Json& record : records) journal.add("point", record);
  }
  expect(read_journal(folder.path()).of("point") == records, "records that do not read back as they were written",
         text);
  std::string damaged = content_of_regular_file(file);
  const std::size_t at = (data[0] + 256u * data[size - 1]) % damaged.size();
  damaged[at] = static_cast<char>(data[size / 2]);
  write(file, damaged);
  refused_in_words(damaged, [&] {
    expect(is_beginning(records, read_journal(folder.path()).of("point")), "a damaged record is read", damaged);
  });
  return 0;
}
