// The import of models: a problem file that reads, or an InputError whose findings are in words and lie inside of the
// text.
#include <algorithm>

#include "app/import/import_model.hpp"
#include "app/json/read_problem.hpp"
#include "tests/fuzz/fuzz_target.hpp"

using namespace mbsopt;
using fuzz::expect;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view input = fuzz::text_of(data, size);
  try {
    const ImportedProblem imported = read_model_text(std::string(input), "model.xml");
    try {
      read_problem_text(imported.text, "model.json");
    } catch (const InputError& error) {
      fuzz::fail("an imported problem that does not read", error.what());
    }
  } catch (const InputError& error) {
    const auto lines = 1 + std::count(input.begin(), input.end(), '\n');
    for (const Finding& finding : error.findings()) {
      fuzz::expect_words(finding.message, input);
      expect(finding.line >= 0 && finding.line <= lines, "a line outside of the text", to_string(finding));
    }
  }
  return 0;
}
