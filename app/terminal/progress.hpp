// Progress on standard error: a bar on a terminal. Otherwise it is a line per iteration, and one after a long silence
// of a command. It is nothing when quiet.
//
//   Progress progress(err, terminal, quiet);
//   progress.fraction("simulating", 0.4);     // a bar; without a terminal "simulating: 40 % after 5 s, 8 s left", now
//                                             // and then
//   progress.iteration("3   psi 0.0123");     // "3   psi 0.0123, 5 s"; on a terminal it replaces the previous one
//   progress.finish();
//
// A line on a terminal is cut to its width: a longer one would wrap, and could not be replaced.
#pragma once

#include <functional>
#include <ostream>
#include <string>
#include <string_view>

namespace mbsopt::inline app {

class Progress {
 public:
  // seconds counts from any fixed moment. columns is the width of the terminal, or 0 if unknown.
  Progress(std::ostream& err, bool terminal, bool quiet, std::function<double()> seconds = steady_seconds,
           std::function<int()> columns = terminal_columns);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  static double steady_seconds();
  static int terminal_columns();

  void fraction(std::string_view what, double done);  // done: 0..1
  void stands(std::string_view what);                 // still at it: the seconds, now and then
  void time(std::string_view what, double t);         // [s]; the same, of runs whose end is not known
  void iteration(std::string_view line);
  void finish();  // clears the bar

 private:
  bool silent_for_long() const;
  void break_silence(std::string_view words, double now, const std::string& left = "");
  std::string left_of(std::string_view what, double done, double now);  // ", 8 s left", or nothing
  void draw(std::string_view line, const std::string& end);             // end: is never cut

  std::ostream& err_;
  bool terminal_, quiet_;
  std::function<double()> seconds_;
  std::function<int()> columns_;
  double start_, said_;  // [s]; said_: when the last line was
  double patience_;      // [s] of silence
  bool line_open_ = false;
  int shown_percent_ = -1;
  std::string doing_;            // the task of the last fraction
  double began_ = 0, done_ = 0;  // when it was first told [s], and how much was done then
};

}  // namespace mbsopt::inline app
