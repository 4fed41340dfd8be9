#include "app/report/run_index.hpp"

#include <catch2/catch.hpp>
#include <fstream>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
namespace fs = std::filesystem;

namespace {

fs::path stored_run(const fs::path& runs, const std::string& name, const std::string& result) {
  fs::create_directories(runs / name);
  std::ofstream(runs / name / "result.json") << result;
  return runs / name;
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("the index lists all runs of its folder and holds their numbers", "[report]") {
  const TemporaryFolder folder;
  const fs::path a = stored_run(folder.path, "a #1", R"({"program": "mbsopt", "command": "design", "status": "ok",
      "objectives": {"path </script>": {"value": 0.25, "unit": "m^2"}},
      "parameters": {"k": {"value": 3, "unit": "N/m"}}})");
  std::ofstream(a / "report.html") << "a report";
  stored_run(folder.path, "b", R"({"program": "mbsopt", "command": "simulate", "status": "failed"})");
  stored_run(folder.path, "foreign_run", R"({"program": "another"})");
  stored_run(folder.path, "broken_run", R"({"program": )");
  const std::string page = run_index(folder.path);
  CHECK(contains(page, R"(<a href="a%20%231/report.html">a #1</a>)"));
  CHECK(contains(page, "<td>b</td><td>simulate</td><td>failed</td>"));  // no report, hence no link
  CHECK(contains(page, R"("objective path \u003c/script> [m^2]":0.25)"));
  CHECK(contains(page, R"("parameter k [N/m]":3)"));
  CHECK_FALSE(contains(page, "foreign_run"));
  CHECK_FALSE(contains(page, "broken_run"));
}

TEST_CASE("no index is written where there is no run, and none over another's page", "[report]") {
  const TemporaryFolder folder;
  write_run_index(folder.path);
  CHECK_FALSE(fs::exists(folder.path / "index.html"));
  stored_run(folder.path, "a", R"({"program": "mbsopt"})");
  std::ofstream(folder.path / "index.html") << "my own page";
  write_run_index(folder.path);
  CHECK(content_of(folder.path / "index.html") == "my own page");
  fs::remove(folder.path / "index.html");
  write_run_index(folder.path);
  write_run_index(folder.path);
  CHECK(content_of(folder.path / "index.html") == run_index(folder.path));
}

TEST_CASE("a command whose folder lies in out/ renews out/index.html, another does not", "[report]") {
  const TemporaryFolder folder;
  std::ofstream(folder.path / "rod.json") << kPendulum;
  const std::string problem = (folder.path / "rod.json").string();
  REQUIRE(run_command({"simulate", problem, "--out", (folder.path / "mine/rod").string()}).exit_code == kDone);
  CHECK_FALSE(fs::exists(folder.path / "mine/index.html"));
  REQUIRE(run_command({"simulate", problem, "--out", (folder.path / "out/rod/").string()}).exit_code == kDone);
  REQUIRE(run_command({"gradient", problem, "--out", (folder.path / "out/rod2").string()}).exit_code == kDone);
  const std::string page = content_of(folder.path / "out/index.html");
  CHECK(contains(page, R"(<a href="rod/report.html">rod</a>)"));
  CHECK(contains(page, R"(<a href="rod2/report.html">rod2</a>)"));
}
