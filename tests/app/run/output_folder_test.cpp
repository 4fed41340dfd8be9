#include "app/run/output_folder.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "app/files/atomic_file.hpp"
#include "tests/app/temporary_folder.hpp"

using namespace mbsopt;
namespace fs = std::filesystem;

namespace {

std::string marker(const OutputFolder& folder) {
  return R"({"program": "mbsopt", "provenance": {"input": ")" + folder.owner() + "\"}}";
}

}  // namespace

TEST_CASE("a folder is created, and taken again by the same problem", "[output]") {
  const TemporaryFolder temporary;
  const std::string problem = temporary.write("a.json", "{}");
  const OutputFolder first(temporary.file("deep/out"), "a", problem, "simulate");
  first.write("result.json", marker(first));
  CHECK(first.owner() == "../../a.json");
  CHECK_NOTHROW(OutputFolder(temporary.file("deep/out"), "a", problem, "simulate"));
}

TEST_CASE("a folder with another problem's results is refused and stays as it is", "[output]") {
  const TemporaryFolder temporary;
  const OutputFolder first(temporary.file("out"), "same name", temporary.write("a.json", "{}"), "simulate");
  first.write("result.json", marker(first));
  CHECK_THROWS_WITH(OutputFolder(temporary.file("out"), "same name", temporary.write("b.json", "{}"), "simulate"),
                    Catch::Contains("another problem") && Catch::Contains("a.json"));
  CHECK(content_of(temporary.path / "out/result.json") == marker(first));
}

TEST_CASE("a file that no run wrote is never overwritten", "[output]") {
  const TemporaryFolder temporary;
  const std::string problem = temporary.write("a.json", "{}");
  temporary.write("trajectory.csv", "mine");
  CHECK_THROWS_WITH(OutputFolder(temporary.path.string(), "a", problem, "simulate"), Catch::Contains("trajectory.csv"));
  temporary.write("result.json", R"({"program": "another"})");
  CHECK_THROWS_AS(OutputFolder(temporary.path.string(), "a", problem, "simulate"), OutputError);
}

TEST_CASE("a problem's name cannot lead out of the output folder", "[output]") {
  const TemporaryFolder temporary;
  const std::string problem = temporary.write("a.json", "{}");
  const fs::path before = fs::current_path();
  fs::current_path(temporary.path);
  const OutputFolder folder("", "../escape", problem, "simulate");
  fs::current_path(before);
  CHECK(folder.path() == fs::path("out") / "_.._escape");
}

TEST_CASE("an output folder where a file lies is an error", "[output]") {
  const TemporaryFolder temporary;
  const std::string problem = temporary.write("a.json", "{}");
  CHECK_THROWS_AS(OutputFolder(problem, "a", problem, "simulate"), OutputError);
}

TEST_CASE("a run that can write nothing any more is marked as failed in place", "[output]") {
  const TemporaryFolder temporary;
  const OutputFolder folder(temporary.file("out"), "a", temporary.write("a.json", "{}"), "simulate");
  folder.mark_failed();  // there is nothing to mark
  folder.write("result.json", "{\n  \"status\": \"running\",\n  \"x\": 1\n}");
  folder.mark_failed();
  const auto result = nlohmann::json::parse(content_of(temporary.path / "out/result.json"));
  CHECK(result.at("status") == "failed");
  CHECK(result.at("x") == 1);
}
