#include "app/terminal/progress.hpp"

#include <catch2/catch.hpp>
#include <sstream>

using namespace mbsopt;

TEST_CASE("without a terminal: a line per iteration, and no bar", "[progress]") {
  std::ostringstream err;
  double now = 0;
  Progress progress(err, false, false, [&] { return now; });
  progress.fraction("simulating", 0.5);
  progress.iteration("1  psi 0.5");
  now = 3;
  progress.iteration("2  psi 0.25");
  progress.finish();
  CHECK(err.str() == "1  psi 0.5, 0 s\n2  psi 0.25, 3 s\n");
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

TEST_CASE("on a terminal, a bar that stands for long says since when", "[progress]") {
  std::ostringstream err;
  double now = 0;
  Progress progress(err, true, false, [&] { return now; });
  const auto bar = [&] { return err.str().substr(err.str().rfind(']')); };
  for (; now < 4; now += 0.5) progress.fraction("simulating", 1e-9 * now);
  CHECK(bar() == "]   0 %");
  for (; now < 9; now += 0.5) progress.fraction("simulating", 1e-9 * now);
  CHECK(bar() == "]   0 %, 8 s");
}

TEST_CASE("a bar tells the time that is left, of what it is about", "[progress]") {
  std::ostringstream err;
  double now = 0;
  Progress progress(err, true, false, [&] { return now; });
  const auto bar = [&] { return err.str().substr(err.str().rfind(']')); };
  progress.fraction("starts", 0.5);  // half of them were done before
  now = 3, progress.fraction("starts", 0.6);
  CHECK(bar() == "]  60 %");
  now = 5, progress.fraction("starts", 0.75);
  CHECK(bar() == "]  75 %, 5 s left");
  now = 6, progress.fraction("sweep", 0.1);
  CHECK(bar() == "]  10 %");
}

TEST_CASE("without a terminal, a long silence is broken, and ever more rarely", "[progress]") {
  std::ostringstream err;
  double now = 100;
  Progress progress(err, false, false, [&] { return now; });
  for (; now <= 130; now += 0.5) progress.fraction("simulating", 0.01 * (now - 100));
  CHECK(err.str() ==
        "simulating: 4 % after 4 s, 96 s left\nsimulating: 12 % after 12 s, 88 s left\n"
        "simulating: 28 % after 28 s, 72 s left\n");
}

TEST_CASE("a run whose end is not known tells its time", "[progress]") {
  std::ostringstream err;
  double now = 0;
  Progress progress(err, false, false, [&] { return now; });
  for (; now <= 5; now += 0.5) progress.time("simulating", 0.1 * now);
  CHECK(err.str() == "simulating: t = 0.4 s after 4 s\n");
}

TEST_CASE("on a terminal, an iteration's line stays for a moment", "[progress]") {
  std::ostringstream err;
  double now = 0;
  Progress progress(err, true, false, [&] { return now; });
  progress.iteration("1  psi 0.5");
  now = 0.3;
  progress.fraction("simulating", 0.5);
  CHECK(err.str() == "\r\x1b[K1  psi 0.5, 0 s");
  now = 0.7;
  progress.fraction("simulating", 0.5);
  CHECK(err.str().find("50 %") != std::string::npos);
}

TEST_CASE("what stands for long says since when, with a terminal or without", "[progress]") {
  std::ostringstream drawn, written;
  double now = 0;
  Progress terminal(drawn, true, false, [&] { return now; }), pipe(written, false, false, [&] { return now; });
  for (Progress* progress : {&terminal, &pipe}) progress->iteration("choosing: 1");
  for (; now < 6; now += 0.5) {
    for (Progress* progress : {&terminal, &pipe}) progress->stands("choosing: 1");
  }
  CHECK(drawn.str() == "\r\x1b[Kchoosing: 1, 0 s\r\x1b[Kchoosing: 1, 4 s");
  CHECK(written.str() == "choosing: 1, 0 s\nchoosing: 1 after 4 s\n");
}

TEST_CASE("on a terminal a line is cut to its width, and keeps the elapsed time", "[progress]") {
  std::ostringstream err;
  double now = 0;
  int columns = 21;
  Progress progress(
      err, true, false, [&] { return now; }, [&] { return columns; });
  const auto last = [&] { return err.str().substr(err.str().rfind("\x1b[K") + 3); };
  now = 75;
  progress.iteration("12  psi 0.0123456789");
  CHECK(last() == "12  psi 0.0123, 75 s");
  columns = 22;  // the window has become wider
  progress.iteration("12  psi 0.0123456789");
  CHECK(last() == "12  psi 0.01234, 75 s");
  columns = 9;  // room for "a" and one of the two bytes of the next letter
  progress.iteration("a\u00e9bc");
  CHECK(last() == "a, 75 s");
  columns = 3;
  progress.iteration("12");
  CHECK(last() == ", 75 s");
  columns = 0;  // not known
  progress.iteration("12  psi 0.0123456789");
  CHECK(last() == "12  psi 0.0123456789, 75 s");
}

TEST_CASE("quiet prints nothing", "[progress]") {
  std::ostringstream err;
  Progress progress(err, true, true);
  progress.fraction("simulating", 0.5);
  progress.iteration("1");
  progress.finish();
  CHECK(err.str().empty());
}
