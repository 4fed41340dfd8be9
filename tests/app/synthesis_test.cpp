// Dimensional synthesis as commands: least squares, every assembly mode.
#include <catch2/catch.hpp>

#include "app/terminal/exit_code.hpp"
#include "source_folder.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

using Arguments = std::vector<std::string>;

struct Designed {
  CommandOutcome outcome;
  nlohmann::json result;
};

Designed designed_points(const TemporaryFolder& folder, const Arguments& more) {
  Arguments arguments{"design", MBSOPT_SOURCE_DIR + std::string("/problems/synthesis/eighteen_points.json"), "--out",
                      folder.file("out")};
  arguments.insert(arguments.end(), more.begin(), more.end());
  Designed done{run_command(arguments), {}};
  if (std::filesystem::exists(folder.path / "out/result.json")) done.result = json_of(folder.path / "out/result.json");
  return done;
}

const Arguments kLeastSquares{"--set", "design.optimizer={\"type\": \"least_squares\"}"};

Arguments and_also(Arguments a, const Arguments& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace

TEST_CASE("eighteen points: least squares ends where the literature does", "[synthesis]") {
  const TemporaryFolder folder;
  const Designed d = designed_points(folder, kLeastSquares);
  INFO(d.outcome.err);
  REQUIRE(d.outcome.exit_code == kDone);
  CHECK(d.result["optimizer"]["status"] == "converged");
  CHECK(d.result["optimizer"]["objective_final"].get<double>() < 0.0099120);
}

TEST_CASE("least squares is refused where there are no squares, or limits", "[synthesis]") {
  const TemporaryFolder folder;
  const Designed limits =
      designed_points(folder, and_also(kLeastSquares, {"--set",
                                                       "design.subject_to=[{\"objective\": \"transmission\", "
                                                       "\"lower\": 0.5}]"}));
  CHECK(limits.outcome.exit_code == kBadInput);
  CHECK_THAT(limits.outcome.err, Contains("design.optimizer.type") && Contains("bounds of variables alone"));
  const Designed squares = designed_points(folder, and_also(kLeastSquares, {"--set", "design.minimize=transmission"}));
  CHECK(squares.outcome.exit_code == kBadInput);
  CHECK_THAT(squares.outcome.err, Contains("is not a sum of squares"));
}

TEST_CASE("eighteen points: all branches start in both assembly modes, and the result is that of its mode",
          "[synthesis]") {
  const TemporaryFolder folder;
  const Designed d = designed_points(
      folder,
      and_also(kLeastSquares, {"--set", "design.multistart={\"starts\": 3, \"seed\": 1, \"branches\": \"all\"}"}));
  INFO(d.outcome.err);
  REQUIRE(d.outcome.exit_code == kDone);
  const nlohmann::json& waterfall = d.result["multistart"]["waterfall"];
  REQUIRE(waterfall.size() == 6);
  for (const nlohmann::json& record : waterfall) {
    INFO(record.dump());
    CHECK(record["assembly_mode"]["mode"] == record["start"].get<int>() % 2);
  }
  CHECK(d.result["optimizer"]["assembly_mode"]["mode"] == waterfall[0]["assembly_mode"]["mode"]);
  // The written problem has the same value.
  const CommandOutcome again = run_command({"gradient", folder.file("out/optimized.json"), "--out", folder.file("g")});
  INFO(again.err);
  REQUIRE(again.exit_code == kDone);
  CHECK(json_of(folder.path / "g/result.json")["objectives"]["path"]["value"].get<double>() ==
        Approx(d.result["optimizer"]["objective_final"].get<double>()).epsilon(1e-9));
}
