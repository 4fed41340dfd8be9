#include "app/terminal/progress.hpp"

#include <catch2/catch.hpp>
#include <sstream>

using namespace mbsopt;

TEST_CASE("without a terminal: a line per iteration, and no bar", "[progress]") {
  std::ostringstream err;
  Progress progress(err, false, false);
  progress.fraction("simulating", 0.5);
  progress.iteration("1  psi 0.5");
  progress.iteration("2  psi 0.25");
  progress.finish();
  CHECK(err.str() == "1  psi 0.5\n2  psi 0.25\n");
}

TEST_CASE("on a terminal: a bar that is redrawn in place and cleared", "[progress]") {
  std::ostringstream err;
  {
    Progress progress(err, true, false);
    progress.fraction("simulating", 0.5);
    progress.fraction("simulating", 0.501);  // the same percent is not drawn again
  }
  CHECK(err.str() == "\r\x1b[Ksimulating [" + std::string(20, '#') + std::string(20, '.') + "]  50 %\r\x1b[K");
}

TEST_CASE("quiet prints nothing", "[progress]") {
  std::ostringstream err;
  Progress progress(err, true, true);
  progress.fraction("simulating", 0.5);
  progress.iteration("1");
  progress.finish();
  CHECK(err.str().empty());
}
