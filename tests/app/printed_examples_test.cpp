#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>

#include "app/terminal/exit_code.hpp"
#include "source_folder.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
namespace fs = std::filesystem;

namespace {

// The example of the README: what is typed after "$ ./dev run ", and the indented lines that follow.
struct Example {
  std::vector<std::string> arguments;
  std::string output;
};

Example readme_example() {
  std::istringstream readme(content_of(fs::path(MBSOPT_SOURCE_DIR) / "README.md"));
  const std::string prompt = "    $ ./dev run ";
  Example example;
  bool inside = false;
  for (std::string line; std::getline(readme, line);) {
    if (line.starts_with(prompt)) {
      std::istringstream words(line.substr(prompt.size()));
      for (std::string word; words >> word;) example.arguments.push_back(word);
      inside = true;
    } else if (inside && !line.empty() && !line.starts_with("    ")) {
      break;
    } else if (inside) {
      example.output += line + "\n";
    }
  }
  return example;
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

std::optional<double> number_of(const std::string& word) {
  char* end = nullptr;
  const double value = std::strtod(word.c_str(), &end);
  return end == word.c_str() + word.size() ? std::optional(value) : std::nullopt;
}

// Words must be the same, and numbers to 1e-6; seconds and how often an optimiser evaluated depend on the machine.
void check_printed(const std::string& page, const std::string& output) {
  const auto expected = words_of(page), printed = words_of(output);
  REQUIRE(printed.size() == expected.size());
  for (std::size_t i = 0; i + 1 < printed.size(); ++i) {
    if (printed[i + 1] == "s" || printed[i + 1].starts_with("iterations") ||
        printed[i + 1].starts_with("evaluations")) {
      continue;
    }
    const std::optional<double> a = number_of(expected[i]), b = number_of(printed[i]);
    INFO("word " << i << ": the page '" << expected[i] << "', printed '" << printed[i] << "'");
    CHECK((a && b ? std::abs(*a - *b) <= 1e-6 * (1 + std::abs(*a)) : expected[i] == printed[i]));
  }
}

// The text between the first line after `from` that begins with `fence` and the next "```".
std::string block_of(const std::string& page, const std::string& fence, std::size_t& from) {
  const std::size_t begin = page.find('\n', page.find("\n" + fence + "\n", from) + 1) + 1,
                    end = page.find("\n```", begin);
  from = end + 4;
  return page.substr(begin, end - begin);
}

CommandOutcome run_in(const fs::path& folder, const std::vector<std::string>& arguments) {
  const fs::path before = fs::current_path();
  fs::current_path(folder);
  const CommandOutcome outcome = run_command(arguments);
  fs::current_path(before);
  return outcome;
}

}  // namespace

TEST_CASE("the README's example prints what the README says", "[docs]") {
  const Example example = readme_example();
  REQUIRE(example.arguments.size() == 2);
  const TemporaryFolder folder;
  fs::create_directory_symlink(fs::path(MBSOPT_SOURCE_DIR) / "problems", folder.path / "problems");
  const CommandOutcome outcome = run_in(folder.path, example.arguments);
  REQUIRE(outcome.exit_code == kDone);
  check_printed(example.output, outcome.out);
}

TEST_CASE("the worked example of docs/problem-files.md prints what the page says", "[docs]") {
  const std::string page = content_of(fs::path(MBSOPT_SOURCE_DIR) / "docs/problem-files.md");
  std::size_t at = 0;
  const TemporaryFolder folder;
  std::ofstream(folder.path / "my_pendulum.json") << block_of(page, "```jsonc", at);
  const CommandOutcome outcome = run_in(folder.path, {"design", "my_pendulum.json"});
  REQUIRE(outcome.exit_code == kDone);
  check_printed(block_of(page, "```", at), outcome.out);
}

TEST_CASE("every page that the README links to is there", "[docs]") {
  const std::string readme = content_of(fs::path(MBSOPT_SOURCE_DIR) / "README.md");
  int links = 0;
  for (std::size_t at = readme.find("]("); at != std::string::npos; at = readme.find("](", at + 1)) {
    const std::string page = readme.substr(at + 2, readme.find(')', at) - at - 2);
    INFO(page);
    CHECK(fs::exists(fs::path(MBSOPT_SOURCE_DIR) / page));
    ++links;
  }
  CHECK(links > 0);
}
