#include "app/files/atomic_file.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <iterator>

#include "tests/app/temporary_folder.hpp"

using namespace mbsopt;
namespace fs = std::filesystem;

TEST_CASE("a file is replaced whole, and nothing else stays in the folder", "[output]") {
  const TemporaryFolder folder;
  write_file_atomically(folder.path / "result.json", "a long first version");
  write_file_atomically(folder.path / "result.json", "second");
  CHECK(content_of(folder.path / "result.json") == "second");
  CHECK(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator{}) == 1);
}

TEST_CASE("a file that cannot be put into place leaves what was there, and no part of itself", "[output]") {
  const TemporaryFolder folder;
  fs::create_directory(folder.path / "result.json");  // a folder is never replaced by a file
  CHECK_THROWS_AS(write_file_atomically(folder.path / "result.json", "text"), OutputError);
  CHECK(fs::is_directory(folder.path / "result.json"));
  CHECK(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator{}) == 1);
}

TEST_CASE("a file in a missing folder is an error that names the file and the reason", "[output]") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(write_file_atomically(folder.path / "absent" / "x.csv", "text"),
                    Catch::Contains("absent/x.csv") && Catch::Contains("No such file"));
}

TEST_CASE("a link that waits under the name of a part is not followed", "[output]") {
  const TemporaryFolder folder;
  const std::string target = folder.write("target", "mine");
  fs::create_symlink(target, folder.path / fmt::format(".result.json.{}.part", ::getpid()));
  CHECK_THROWS_AS(write_file_atomically(folder.path / "result.json", "text"), WriteError);
  CHECK(content_of(target) == "mine");
}
