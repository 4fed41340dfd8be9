// Progress on standard error: a bar on a terminal, a line per iteration otherwise, nothing when quiet.
//
//   Progress progress(err, terminal, quiet);
//   progress.fraction("simulating", 0.4);     // a bar; silent where there is no terminal
//   progress.iteration("3   psi 0.0123");     // its own line; on a terminal it replaces the previous one
//   progress.finish();
#pragma once

#include <ostream>
#include <string_view>

namespace mbsopt {

class Progress {
 public:
  Progress(std::ostream& err, bool terminal, bool quiet) : err_(err), terminal_(terminal), quiet_(quiet) {}
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void fraction(std::string_view what, double done);  // done: 0..1
  void iteration(std::string_view line);
  void finish();  // clears the bar

 private:
  std::ostream& err_;
  bool terminal_, quiet_;
  bool line_open_ = false;
  int shown_percent_ = -1;
};

}  // namespace mbsopt
