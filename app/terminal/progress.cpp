#include "app/terminal/progress.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace mbsopt::inline app {
namespace {

constexpr int kBarWidth = 40;
constexpr std::string_view kClearLine = "\r\x1b[K";
// [s] of silence. A user wonders after some seconds, and wants no log of a thousand lines after a night.
constexpr double kAtFirst = 4, kLongest = 64;
constexpr double kIterationStays = 0.5;  // [s] on a terminal, before a bar takes its place

std::string in_seconds(double seconds) { return fmt::format(", {:.0f} s", seconds); }

// Bytes count as columns, so a line with other than ASCII letters is cut early, but never within a letter of UTF-8.
std::string_view cut(std::string_view line, std::size_t most) {
  if (line.size() <= most) return line;
  while (most > 0 && (static_cast<unsigned char>(line[most]) & 0xC0U) == 0x80U) --most;
  return line.substr(0, most);
}

}  // namespace

Progress::Progress(std::ostream& err, bool terminal, bool quiet, std::function<double()> seconds,
                   std::function<int()> columns)
    : err_(err),
      terminal_(terminal),
      quiet_(quiet),
      seconds_(std::move(seconds)),
      columns_(std::move(columns)),
      start_(seconds_()),
      said_(start_),
      patience_(terminal ? 0 : kAtFirst) {}

double Progress::steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int Progress::terminal_columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

Progress::~Progress() {
  try {
    finish();
  } catch (...) {  // a stream that throws: the bar stays
  }
}

// The time left at the speed since the first fraction of the same task. The first hundredth gives no speed yet.
std::string Progress::left_of(std::string_view what, double done, double now) {
  constexpr double kTells = 0.01;
  if (what != doing_ || done < done_) {
    doing_ = what;
    began_ = now;
    done_ = done;
  }
  if (now - began_ < kAtFirst || done - done_ < kTells) return "";
  return fmt::format(", {:.0f} s left", (now - began_) * (1 - done) / (done - done_));
}

void Progress::fraction(std::string_view what, double done) {
  if (quiet_) return;
  const double percent = 100 * std::clamp(done, 0.0, 1.0);
  const int whole = static_cast<int>(std::floor(percent));
  const bool stands = terminal_ && whole == shown_percent_;
  const double now = seconds_();
  const std::string left = left_of(what, std::clamp(done, 0.0, 1.0), now);
  if (now - said_ < (stands ? kAtFirst : patience_)) return;
  if (!terminal_) return break_silence(fmt::format("{}: {:.3g} %", what, percent), now, left);
  shown_percent_ = whole;
  said_ = now;
  const int filled = whole * kBarWidth / 100;
  draw(fmt::format("{} [{:#>{}}{:.>{}}] {:3d} %", what, "", filled, "", kBarWidth - filled, whole),
       (stands ? in_seconds(now - start_) : "") + left);
}

bool Progress::silent_for_long() const { return !quiet_ && seconds_() - said_ >= (terminal_ ? kAtFirst : patience_); }

void Progress::stands(std::string_view what) {
  if (!silent_for_long()) return;
  const double now = seconds_();
  if (!terminal_) return break_silence(what, now);
  said_ = now;
  draw(what, in_seconds(now - start_));
}

void Progress::time(std::string_view what, double t) {
  if (!silent_for_long()) return;
  stands(fmt::format("{}: t = {:.3g} s", what, t));
}

void Progress::break_silence(std::string_view words, double now, const std::string& left) {
  err_ << fmt::format("{} after {:.0f} s{}\n", words, now - start_, left) << std::flush;
  said_ = now;
  patience_ = std::min(2 * patience_, kLongest);
}

void Progress::draw(std::string_view line, const std::string& end) {
  // The last column stays free, because a terminal may wrap as soon as it is filled.
  const int columns = columns_(), room = columns - 1 - static_cast<int>(end.size());
  err_ << kClearLine << (columns > 0 ? cut(line, static_cast<std::size_t>(std::max(room, 0))) : line) << end
       << std::flush;
  line_open_ = true;
}

void Progress::iteration(std::string_view line) {
  if (quiet_) return;
  said_ = seconds_();
  patience_ = terminal_ ? kIterationStays : kAtFirst;
  shown_percent_ = -1;
  const std::string elapsed = in_seconds(said_ - start_);
  if (terminal_) return draw(line, elapsed);
  err_ << line << elapsed << '\n' << std::flush;
}

void Progress::finish() {
  if (line_open_) err_ << kClearLine << std::flush;
  line_open_ = false;
  shown_percent_ = -1;
}

}  // namespace mbsopt::inline app
