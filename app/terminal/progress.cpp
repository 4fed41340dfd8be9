#include "app/terminal/progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbsopt {
namespace {

constexpr int kBarWidth = 40;
constexpr std::string_view kClearLine = "\r\x1b[K";

}  // namespace

Progress::~Progress() {
  try {
    finish();
  } catch (...) {  // a stream that throws: the bar stays
  }
}

void Progress::fraction(std::string_view what, double done) {
  if (quiet_ || !terminal_) return;
  const int percent = static_cast<int>(std::floor(100 * std::clamp(done, 0.0, 1.0)));
  if (percent == shown_percent_) return;
  shown_percent_ = percent;
  const int filled = percent * kBarWidth / 100;
  err_ << kClearLine << fmt::format("{} [{:#>{}}{:.>{}}] {:3d} %", what, "", filled, "", kBarWidth - filled, percent)
       << std::flush;
  line_open_ = true;
}

void Progress::iteration(std::string_view line) {
  if (quiet_) return;
  if (terminal_) {
    err_ << kClearLine << line << std::flush;
    line_open_ = true;
  } else {
    err_ << line << '\n' << std::flush;
  }
}

void Progress::finish() {
  if (line_open_) err_ << kClearLine << std::flush;
  line_open_ = false;
  shown_percent_ = -1;
}

}  // namespace mbsopt
