#include "app/run/provenance.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/app/temporary_folder.hpp"

using namespace mbsopt;
namespace fs = std::filesystem;

TEST_CASE("sha256 of a file is that of FIPS 180-4", "[provenance]") {
  const TemporaryFolder folder;
  CHECK(sha256_of_file(folder.write("abc", "abc")) ==
        "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  CHECK(sha256_of_file(folder.write("million", std::string(1'000'000, 'a'))) ==
        "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  CHECK(sha256_of_file(folder.file("absent")).empty());
}

TEST_CASE("the command line is stored as a shell would take it", "[provenance]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("a.json", "{}");
  const auto origin = provenance({"simulate", "it's a.json", "--set", "name=x y"}, "a.json", file, {});
  CHECK(origin.at("command_line") == R"(mbsopt simulate 'it'\''s a.json' --set 'name=x y')");
  CHECK(origin.at("input_sha256") == sha256_of_file(file));
  CHECK(origin.at("libraries").contains("Ipopt"));
}

TEST_CASE("data files of one base name keep their own checksums, named as seen from the problem", "[output]") {
  const TemporaryFolder folder;
  fs::create_directories(folder.path / "a"), fs::create_directories(folder.path / "b");
  const std::string problem = folder.write("p.json", "{}"), first = folder.write("a/r.csv", "1"),
                    second = folder.write("b/r.csv", "2");
  const auto origin = provenance({}, "", problem, {first, second});
  CHECK_THROWS_WITH(provenance({}, "", problem, {folder.file("absent.csv")}),
                    Catch::Contains("absent.csv: cannot be read"));
  CHECK(origin.at("data_sha256") ==
        nlohmann::ordered_json{{"a/r.csv", sha256_of_file(first)}, {"b/r.csv", sha256_of_file(second)}});
}
