// The errors of a problem file: every finding, with its place.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace mbsopt::inline app {

struct Finding {
  std::string source;        // the file as the user named it; empty: from a --set
  int line = 0, column = 0;  // from 1, columns in characters; 0: the file as a whole
  std::string path;          // JSON path, "bodies[2].inertia"; empty: the file as a whole
  std::string message;
  bool operator==(const Finding&) const = default;
};

// "suspension.json:41:18: bodies[2].inertia: ..."  or  "--set bodies[2].inertia: ..."
std::string to_string(const Finding& finding);

// what() has one line per finding for the first hundred, and the number of the others.
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::vector<Finding> all);
  const std::vector<Finding>& findings() const { return findings_; }

 private:
  std::vector<Finding> findings_;
};

}  // namespace mbsopt::inline app
