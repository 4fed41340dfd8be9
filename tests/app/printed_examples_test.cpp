#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <set>

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
bool same_word(const std::vector<std::string>& expected, const std::vector<std::string>& printed, std::size_t i) {
  if (i + 1 < printed.size() &&
      (printed[i + 1] == "s" || printed[i + 1].starts_with("iterations") || printed[i + 1].starts_with("evaluations")))
    return true;
  const std::optional<double> a = number_of(expected[i]), b = number_of(printed[i]);
  return a && b ? std::abs(*a - *b) <= 1e-6 * (1 + std::abs(*a)) : expected[i] == printed[i];
}

void check_printed(const std::string& page, const std::string& output) {
  const auto expected = words_of(page), printed = words_of(output);
  REQUIRE(printed.size() == expected.size());
  for (std::size_t i = 0; i + 1 < printed.size(); ++i) {
    INFO("word " << i << ": the page '" << expected[i] << "', printed '" << printed[i] << "'");
    CHECK(same_word(expected, printed, i));
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

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);)
    if (line.find_first_not_of(' ') != std::string::npos) lines.push_back(line);
  return lines;
}

// Whether the lines of a page come in this order among those that were printed; "..." stands for lines left out.
bool shows(const std::vector<std::string>& page, const std::vector<std::string>& printed, std::string& missing) {
  std::size_t at = 0;
  bool gap = false;
  for (const std::string& line : page) {
    if (line == "...") {
      gap = true;
      continue;
    }
    const auto same_line = [&](const std::string& other) {
      const auto expected = words_of(line), found = words_of(other);
      if (expected.size() != found.size()) return false;
      for (std::size_t i = 0; i < found.size(); ++i)
        if (!same_word(expected, found, i)) return false;
      return true;
    };
    while (at < printed.size() && gap && !same_line(printed[at])) ++at;
    missing = line;
    if (at == printed.size() || !same_line(printed[at++])) return false;
    gap = false;
  }
  return gap || at == printed.size();
}

// Runs a tutorial's commands in a copy of its folder. Each line of a block of JSON or CSV must be in the file of the
// command that follows, or in a data file of the folder.
void check_tutorial(const std::string& name) {
  const fs::path docs = fs::path(MBSOPT_SOURCE_DIR) / "docs";
  const TemporaryFolder folder;
  fs::copy(docs / "tutorials" / name, folder.path / name);
  const auto trimmed = [](const std::string& line) {
    std::string text = line.substr(line.find_first_not_of(' '));
    while (text.back() == ',') text.pop_back();
    return text;
  };
  std::set<std::string> data_lines;
  for (const fs::directory_entry& file : fs::directory_iterator(folder.path / name))
    if (file.path().extension() == ".csv")
      for (const std::string& line : lines_of(content_of(file.path()))) data_lines.insert(line);
  std::vector<std::string> awaited;
  int commands = 0;
  std::istringstream page(content_of(docs / ("tutorial-" + name + ".md")));
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("```") || line == "```") continue;
    std::string block;
    const std::string kind = line;
    while (std::getline(page, line) && line != "```") block += line + "\n";
    std::vector<std::string> lines = lines_of(block);
    REQUIRE(!lines.empty());
    if (kind == "```csv") {
      for (const std::string& row : lines) CHECK(data_lines.count(row) == 1);
    } else if (kind == "```jsonc") {
      awaited.insert(awaited.end(), lines.begin(), lines.end());
    } else {
      const std::string prompt = "$ mbsopt ";
      REQUIRE(lines.front().starts_with(prompt));
      const std::vector<std::string> arguments = words_of(lines.front().substr(prompt.size()));
      lines.erase(lines.begin());
      std::set<std::string> in_file;
      for (const std::string& text : lines_of(content_of(folder.path / name / arguments.at(1))))
        in_file.insert(trimmed(text));
      for (const std::string& text : awaited) {
        INFO(arguments.at(1) << " has no line " << text);
        CHECK(in_file.count(trimmed(text)) == 1);
      }
      awaited.clear();
      const CommandOutcome outcome = run_in(folder.path / name, arguments);
      std::vector<std::string> printed;
      for (const std::string& text : lines_of(outcome.err))
        if (text.find(" converted from ") != std::string::npos) printed.push_back(text);
      for (const std::string& text : lines_of(outcome.out)) printed.push_back(text);
      std::string missing;
      const bool shown = shows(lines, printed, missing);
      INFO(outcome.out << outcome.err << "\nnot as the page says: " << missing);
      CHECK(outcome.exit_code == kDone);
      CHECK(shown);
      ++commands;
    }
  }
  CHECK(awaited.empty());
  CHECK(commands >= 4);
}

// The number of cells of a table's row, 0 if it does not end on its line.
std::size_t cells_of(std::string row) {
  row.erase(row.find_last_not_of(' ') + 1);
  std::size_t bars = 0;
  for (std::size_t i = 0; i < row.size(); ++i) bars += row[i] == '|' && (i == 0 || row[i - 1] != '\\');
  return row.ends_with('|') ? bars - 1 : 0;
}

void add_fields(const nlohmann::json& schema, std::set<std::string>& fields) {
  if (!schema.is_structured()) return;
  for (const auto& [key, value] : schema.items()) {
    if (key == "properties")
      for (const auto& [name, field] : value.items()) fields.insert(name);
    add_fields(value, fields);
  }
}

}  // namespace

TEST_CASE("each command of the tutorials prints what its page says", "[docs]") {
  check_tutorial("design");
  check_tutorial("identify");
}

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

TEST_CASE("each table of the docs begins with a head and a rule, and its rows have as many cells", "[docs]") {
  for (const fs::directory_entry& file : fs::directory_iterator(fs::path(MBSOPT_SOURCE_DIR) / "docs")) {
    if (file.path().extension() != ".md") continue;
    std::istringstream page(content_of(file.path()));
    std::size_t row = 0, cells = 0, number = 0;
    for (std::string line; std::getline(page, line);) {
      ++number;
      const std::size_t indent = line.find_first_not_of(' ');
      row = indent < 4 && line[indent] == '|' ? row + 1 : 0;  // four spaces begin code
      if (row == 0) continue;
      if (row == 1) cells = cells_of(line);
      INFO(file.path().filename() << ':' << number << ": " << line);
      CHECK(cells_of(line) == cells);
      CHECK(cells > 0);
      CHECK((row != 2 || line.find_first_not_of("|-: ") == std::string::npos));
    }
  }
}

TEST_CASE("docs/fields.md names every field of the schema", "[docs]") {
  const std::string page = content_of(fs::path(MBSOPT_SOURCE_DIR) / "docs/fields.md");
  std::set<std::string> fields;
  add_fields(nlohmann::json::parse(run_command({"schema"}).out), fields);
  CHECK(fields.size() > 100);
  for (const std::string& field : fields) {
    INFO(field);
    const bool named =
        page.find('`' + field + '`') != std::string::npos || page.find('`' + field + '.') != std::string::npos ||
        page.find('.' + field + '`') != std::string::npos || page.find('"' + field + '"') != std::string::npos;
    CHECK(named);
  }
}

TEST_CASE("the gallery page shows each problem file", "[docs]") {
  const fs::path docs = fs::path(MBSOPT_SOURCE_DIR) / "docs";
  const std::string page = content_of(docs / "gallery.md");
  for (const fs::directory_entry& file : fs::recursive_directory_iterator(docs / "../problems")) {
    const fs::path folder = file.path().parent_path().filename(), name = file.path().stem();
    if (file.path().extension() != ".json" || folder == "problems") continue;
    INFO(file.path());
    CHECK(page.find("](../problems/" + (folder / name).string() + ".json)") != std::string::npos);
  }
  for (std::size_t at = page.find("](gallery/"); at != std::string::npos; at = page.find("](gallery/", at + 1))
    CHECK(fs::exists(docs / page.substr(at + 2, page.find(')', at) - at - 2)));
}
