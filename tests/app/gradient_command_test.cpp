#include <catch2/catch.hpp>

#include "app/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

TEST_CASE("gradient: every method gives every objective and parameter the same derivative", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  nlohmann::json reference;
  for (const std::string method : {"auto", "tlm", "adjoint", "fd"}) {
    const CommandOutcome outcome = run_command({"gradient", file, "--out", folder.file("out"), "--method", method});
    REQUIRE(outcome.exit_code == kDone);
    CHECK_THAT(outcome.out, Contains("track") && Contains("L"));
    const auto objectives = json_of(folder.path / "out/result.json").at("objectives");
    if (reference.is_null()) reference = objectives;
    for (const char* objective : {"track", "end"}) {
      for (const char* parameter : {"L", "k"}) {
        const double derivative = objectives.at(objective).at("gradient").at(parameter);
        CHECK(derivative != 0);
        CHECK(derivative == Approx(reference.at(objective).at("gradient").at(parameter).get<double>()).epsilon(1e-7));
      }
    }
  }
}

TEST_CASE("gradient: a method that does not exist, and a file without objectives, are bad input", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  CHECK(run_command({"gradient", file, "--method", "magic"}).exit_code == kBadInput);
  std::string text = kPendulum;
  const auto begin = text.find(",\n  \"objectives\"");
  text.erase(begin, text.rfind('}') - begin);
  const CommandOutcome outcome =
      run_command({"gradient", folder.write("bare.json", text), "--out", folder.file("out")});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("objectives"));
}
