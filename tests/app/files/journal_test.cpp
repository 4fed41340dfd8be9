#include "app/files/journal.hpp"

#include <sys/syscall.h>
#include <unistd.h>

#include <catch2/catch.hpp>

#include "app/files/atomic_file.hpp"
#include "app/files/sha256.hpp"
#include "tests/app/swinging_rod.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {
int flushes = 0;
}

// In place of the library's.
extern "C" int fdatasync(int file) {
  ++flushes;
  return static_cast<int>(::syscall(SYS_fdatasync, file));
}

namespace fs = std::filesystem;

namespace {

const Json kHeader{{"program", "mbsopt"}, {"command", "design"}, {"input", "../rod.json"}};

void write_text(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

// A header and three points, the last of which has no derivatives.
std::string small_journal(const fs::path& folder) {
  Journal journal(folder, kHeader);
  for (const double x : {1.5, 2.25}) journal.add("point", {{"x", {x}}, {"derivatives", true}, {"f", x}, {"c", {x}}});
  journal.add("point", {{"x", {3.0}}, {"derivatives", false}, {"f", 9.0}, {"c", Json::array()}});
  return content_of(folder / kJournalFile);
}

std::string refusal(const fs::path& folder, const std::string& text) {
  write_text(folder / kJournalFile, text);
  try {
    read_journal(folder);
  } catch (const OutputError& error) {
    return error.what();
  }
  return "";
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace

TEST_CASE("journal: what was added is read again, and a run goes on where it was cut off", "[journal]") {
  const TemporaryFolder folder;
  const std::string text = small_journal(folder.path);
  const JournalContent whole = read_journal(folder.path);
  CHECK(whole.header.at("input") == "../rod.json");
  REQUIRE(whole.of("point").size() == 3);
  CHECK(whole.of("point")[1].at("f") == 2.25);
  write_text(folder.path / kJournalFile, text.substr(0, text.size() - 10));
  const JournalContent cut_off = read_journal(folder.path);
  CHECK(cut_off.of("point").size() == 2);
  Journal(folder.path, cut_off.end)
      .add("point", {{"x", {3.0}}, {"derivatives", false}, {"f", 9.0}, {"c", Json::array()}});
  CHECK(content_of(folder.path / kJournalFile) == text);
}

TEST_CASE("journal: each line is flushed to the disk at once", "[journal]") {
  const TemporaryFolder folder;
  Journal journal(folder.path, kHeader);
  for (const char* kind : {"iterate", "start", "ended"}) {
    const int before = flushes;
    journal.add(kind, kind == std::string("ended") ? Json("ok") : Json::object());
    CHECK(flushes == before + 1);
  }
}

TEST_CASE("journal: no single flipped bit goes unseen", "[journal]") {
  const TemporaryFolder folder;
  const std::string text = small_journal(folder.path);
  const std::size_t last_line = text.rfind('\n', text.size() - 2) + 1;
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string damaged = text;
    damaged[i] = static_cast<char>(damaged[i] ^ (1 << (i % 8)));
    INFO("byte " << i);
    if (i + 1 == text.size()) {  // without its end the last line counts as cut off
      CHECK(refusal(folder.path, damaged).empty());
      CHECK(read_journal(folder.path).of("point").size() == 2);
    } else {
      CHECK_THAT(refusal(folder.path, damaged), Contains("journal.jsonl: "));
      if (i > text.find('\n')) CHECK_THAT(refusal(folder.path, damaged), Contains("is damaged"));
    }
  }
  CHECK_THAT(refusal(folder.path, text.substr(0, last_line) + "\n"), Contains("line 4 is damaged"));
}

TEST_CASE("journal: lines that are missing, repeated, exchanged or of another run are refused", "[journal]") {
  const TemporaryFolder folder, other;
  small_journal(folder.path), small_journal(other.path);
  const std::vector<std::string> lines = lines_of(folder.path / kJournalFile),
                                 others = lines_of(other.path / kJournalFile);
  const auto refused = [&](const std::vector<std::string>& damaged) { return refusal(folder.path, joined(damaged)); };
  CHECK_THAT(refused({lines[0], lines[2], lines[3]}), Contains("line 2"));
  CHECK_THAT(refused({lines[0], lines[1], lines[1], lines[2]}), Contains("line 3"));
  CHECK_THAT(refused({lines[0], lines[2], lines[1], lines[3]}), Contains("line 2"));
  CHECK_THAT(refused({lines[0], lines[1], others[2], lines[3]}), Contains("line 3") && Contains("remove this line"));
  CHECK_THAT(refused({lines[1], lines[2]}), Contains("no journal of this version"));
  CHECK_THAT(refusal(folder.path, ""), Contains("no whole line"));
  CHECK_THAT(refusal(folder.path, "{\"journal\": \"x\"}\n"), Contains("no journal of this version"));
  CHECK(refused({lines[0], lines[1], lines[2]}).empty());  // as if it had been killed there
}

TEST_CASE("journal: a file that is none of ours is never overwritten, nor what a link points to", "[journal]") {
  const TemporaryFolder folder;
  const fs::path journal = folder.path / kJournalFile;
  for (const std::string foreign : {"my notes\n", "{\"mine\": true}\n", ""}) {
    write_text(journal, foreign);
    CHECK_THROWS_WITH(Journal(folder.path, kHeader), Contains("never overwritten"));
    CHECK(content_of(journal) == foreign);
  }
  fs::remove(journal);
  const std::string target = folder.write("target", "mine");
  fs::create_symlink(target, journal);
  CHECK_THROWS_AS(Journal(folder.path, kHeader), OutputError);
  CHECK(content_of(target) == "mine");
  fs::remove(journal);
  fs::create_symlink(folder.path / "absent", journal);
  CHECK_THROWS_AS(Journal(folder.path, kHeader), OutputError);
  CHECK_FALSE(fs::exists(folder.path / "absent"));
  fs::remove(journal);
  small_journal(folder.path);
  CHECK_NOTHROW(Journal(folder.path, kHeader));  // of an earlier run
  CHECK(read_journal(folder.path).of("point").empty());
}

TEST_CASE("sha256_of gives the values of FIPS 180-4", "[journal]") {
  CHECK(sha256_of("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  CHECK(sha256_of("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}
