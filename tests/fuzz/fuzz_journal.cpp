// journal.jsonl: what is read of any bytes is a journal, or a refusal in words; so are its records.
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "app/atomic_file.hpp"
#include "app/journal.hpp"
#include "app/point_records.hpp"
#include "app/residual_records.hpp"
#include "tests/fuzz/fuzz_target.hpp"

using namespace mbsopt;

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

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  const std::string_view text = fuzz::text_of(data, size);
  std::ofstream(folder.path() / kJournalFile, std::ios::binary) << text;
  refused_in_words(text, [&] {
    const JournalContent content = read_journal(folder.path());
    refused_in_words(text,
                     [&] { JsonPointRecords(content.points, content.hessians, [](const char*, const Json&) {}); });
    refused_in_words(text, [&] { JsonResidualRecords(content.residuals, [](const Json&) {}); });
    Journal(folder.path()).add("ended", "ok");
    const JournalContent longer = read_journal(folder.path());
    fuzz::expect(longer.points.size() == content.points.size() && longer.ended == "ok", "a record was lost", "");
  });
  return 0;
}
