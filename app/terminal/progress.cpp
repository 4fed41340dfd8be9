#include "app/terminal/progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace mbsopt {
namespace {

constexpr int kBarWidth = 40;
constexpr std::string_view kClearLine = "\r\x1b[K";
// [s] of silence. Whoever waits wonders after some seconds, and wants no log of a thousand lines after a night.
constexpr double kAtFirst = 4, kLongest = 64;
constexpr double kIterationStays = 0.5;  // [s] on a terminal, before a bar takes its place

}  // namespace

Progress::Progress(std::ostream& err, bool terminal, bool quiet, std::function<double()> seconds)
    : err_(err),
      terminal_(terminal),
      quiet_(quiet),
      seconds_(std::move(seconds)),
      start_(seconds_()),
      said_(start_),
      patience_(terminal ? 0 : kAtFirst) {}

double Progress::steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Progress::~Progress() {
  try {
    finish();
  } catch (...) {  // a stream that throws: the bar stays
  }
}

void Progress::fraction(std::string_view what, double done) {
  if (quiet_) return;
  const double percent = 100 * std::clamp(done, 0.0, 1.0);
  const int whole = static_cast<int>(std::floor(percent));
  const bool stands = terminal_ && whole == shown_percent_;
  const double now = seconds_();
  if (now - said_ < (stands ? kAtFirst : patience_)) return;
  if (!terminal_) return break_silence(fmt::format("{}: {:.3g} %", what, percent), now);
  shown_percent_ = whole, said_ = now;
  const int filled = whole * kBarWidth / 100;
  err_ << kClearLine << fmt::format("{} [{:#>{}}{:.>{}}] {:3d} %", what, "", filled, "", kBarWidth - filled, whole)
       << (stands ? fmt::format(", {:.0f} s", now - start_) : "") << std::flush;
  line_open_ = true;
}

bool Progress::silent_for_long() const { return !quiet_ && seconds_() - said_ >= (terminal_ ? kAtFirst : patience_); }

void Progress::stands(std::string_view what) {
  if (!silent_for_long()) return;
  const double now = seconds_();
  if (!terminal_) return break_silence(what, now);
  said_ = now;
  err_ << kClearLine << fmt::format("{}, {:.0f} s", what, now - start_) << std::flush;
  line_open_ = true;
}

void Progress::time(std::string_view what, double t) {
  if (!silent_for_long()) return;
  stands(fmt::format("{}: t = {:.3g} s", what, t));
}

void Progress::break_silence(std::string_view words, double now) {
  err_ << fmt::format("{} after {:.0f} s\n", words, now - start_) << std::flush;
  said_ = now, patience_ = std::min(2 * patience_, kLongest);
}

void Progress::iteration(std::string_view line) {
  if (quiet_) return;
  said_ = seconds_(), patience_ = terminal_ ? kIterationStays : kAtFirst;
  shown_percent_ = -1;
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
