#include "app/run/run.hpp"

#include <catch2/catch.hpp>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <streambuf>

#include "app/run/long_run.hpp"
#include "tests/app/swinging_rod.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

CommandOptions options_of_rod(const TemporaryFolder& folder) {
  CommandOptions options;
  options.problem_file = folder.write("rod.json", kSwingingRod), options.out = folder.file("out");
  return options;
}

struct BrokenBuffer : std::streambuf {
  int overflow(int) override { throw std::runtime_error("the stream is broken"); }
};

}  // namespace

TEST_CASE("a warning is placed in the file as it was read", "[run]") {
  const TemporaryFolder folder;
  std::ostringstream out, err;
  const CommandContext context{"validate", {}, options_of_rod(folder), out, err};
  Run run(context);
  run.warn("forces[0].damping: is low");
  const std::string expected = "rod.json:12:82: forces[0].damping: is low";
  CHECK_THAT(err.str(), Contains(expected));
  for (const char* changed : {"\n\n\n{}", "no JSON"}) {
    folder.write("rod.json", changed);
    err.str("");
    run.warn("forces[0].damping: is low");
    CHECK_THAT(err.str(), Contains(expected));
  }
  err.str("");
  run.warn("a sentence: of no path");
  CHECK(err.str() == "warning: a sentence: of no path\n");
}

TEST_CASE("a long run that an exception ends passes it on, also if the stream of errors throws", "[run]") {
  const TemporaryFolder folder;
  std::ostringstream out;
  BrokenBuffer buffer;
  std::ostream err(&buffer);
  err.exceptions(std::ios::badbit);
  const CommandContext context{"design", {"design"}, options_of_rod(folder), out, err};
  const auto fails = [&] {
    Run run(context);
    run.start();
    LongRun long_run(run);
    long_run.begin();
    throw std::runtime_error("the first error");
  };
  CHECK_THROWS_WITH(fails(), "the first error");
  CHECK(json_of(folder.path / "out/result.json").at("status") == "failed");
}
