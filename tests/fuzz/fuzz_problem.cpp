// The reader of problem files: a problem, or an InputError whose findings are in words and lie inside of the text.
// Lines at the end that begin with "--set " are overrides, as on a command line.
#include <algorithm>

#include "app/json/edit_text.hpp"
#include "app/json/read_problem.hpp"
#include "source_folder.hpp"
#include "tests/fuzz/fuzz_target.hpp"

using namespace mbsopt;
using fuzz::expect;

namespace {

std::vector<std::string> cut_overrides(std::string& text) {
  std::vector<std::string> sets;
  constexpr std::string_view kSet = "\n--set ";
  for (std::size_t at = text.rfind(kSet); at != std::string::npos && sets.size() < 4; at = text.rfind(kSet)) {
    sets.push_back(text.substr(at + kSet.size()));
    text.resize(at);
  }
  return sets;
}

void check(const InputError& error, const std::string& text, std::string_view input) {
  expect(!error.findings().empty(), "an error without findings", error.what());
  const auto lines = 1 + std::count(text.begin(), text.end(), '\n');
  for (const Finding& finding : error.findings()) {
    fuzz::expect_words(finding.message, input);
    expect(finding.line >= 0 && finding.line <= lines, "a line outside of the text", to_string(finding));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view input = fuzz::text_of(data, size);
  std::string text(input);
  const std::vector<std::string> sets = cut_overrides(text);
  const std::filesystem::path file = MBSOPT_SOURCE_DIR "/problems/fuzz/problem.json";  // data files lie beside it
  try {
    std::vector<std::string> warnings;
    read_problem_text(text, file, sets, &warnings);
    for (const std::string& warning : warnings) fuzz::expect_words(warning, input);
  } catch (const InputError& error) {
    check(error, text, input);
  }
  try {  // what tradeoff and design do to a text
    std::string edited = text;
    for (const std::string& set : sets) edited = with_override(edited, set);
    without_member(edited, "simulation.integrator");
  } catch (const InputError& error) {
    check(error, text + "\n\n", input);
  }
  return 0;
}
