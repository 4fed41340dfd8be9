#include <catch2/catch.hpp>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

TEST_CASE("check: all methods agree on a smooth problem, and each one's cost is told", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"check", folder.write("rod.json", kPendulum), "--out", folder.file("out")});
  CHECK(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out, Contains("all gradients agree") && Contains("fd frozen") && Contains("simulations") &&
                              Contains("one simulation: a run with the same objectives") &&
                              Contains("Taylor remainder"));
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("status") == "ok");
  for (const char* method : {"adjoint", "tlm", "fd_frozen", "fd_free"}) {
    CHECK(result.at("methods").at(method).at("wall_seconds") > 0);
    CHECK(result.at("methods").at(method).at("gradient").at("track").at("k").is_number());
  }
  CHECK(result.at("verdict").at("entries").at("end").at("L").at("tlm_adjoint") < 1e-10);
  CHECK(result.at("verdict").at("entries").at("end").at("L").at("free").is_string());
  for (const auto& identity : result.at("verdict").at("identities")) {
    CHECK(identity.at("weights").contains("track"));
    CHECK(identity.at("direction").contains("k"));
  }
}

TEST_CASE("check: an objective with a kink at this very point ends with exit 3", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome = run_command({"check", folder.write("rod.json", kPendulum), "--out", folder.file("out"),
                                              "--set", "objectives.end.parameters_only=max(L, 2*L - 1 [m])"});
  CHECK(outcome.exit_code == kCheckFailed);
  CHECK_THAT(outcome.out, Contains("DISAGREE"));
  CHECK(json_of(folder.path / "out/result.json").at("status") == "disagrees");
}
