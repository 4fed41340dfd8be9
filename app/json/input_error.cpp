#include "app/json/input_error.hpp"

#include <algorithm>

namespace mbsopt::inline app {

namespace {

std::string lines(const std::vector<Finding>& findings) {
  constexpr std::size_t kShown = 100;  // more than a user corrects before the next run
  std::string all;
  for (std::size_t i = 0; i < std::min(kShown, findings.size()); ++i) {
    if (!all.empty()) all += '\n';
    all += to_string(findings[i]);
  }
  if (findings.size() > kShown) all += "\nand " + std::to_string(findings.size() - kShown) + " more";
  return all;
}

}  // namespace

std::string to_string(const Finding& finding) {
  std::string text;
  if (finding.source.empty()) {
    text = "--set " + finding.path;
  } else {
    text = finding.source;
    if (finding.line > 0) text += ":" + std::to_string(finding.line) + ":" + std::to_string(finding.column);
    if (!finding.path.empty()) text += ": " + finding.path;
  }
  text += ": " + finding.message;
  // Keeps each finding on one line, for any names and texts in it.
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  return text;
}

InputError::InputError(std::vector<Finding> all) : std::runtime_error(lines(all)), findings_(std::move(all)) {}

}  // namespace mbsopt::inline app
