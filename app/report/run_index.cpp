#include "app/report/run_index.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include "app/files/atomic_file.hpp"
#include "app/report/run_page.hpp"
#include "optim/problem/regular_file.hpp"

namespace mbsopt::inline app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kIndexTitle = "Runs";
// A sweep or a study may keep far more than a comparison needs. Its reading would delay every command by a second.
constexpr std::size_t kLargest = 20'000'000;  // [bytes] of result.json

struct IndexedRun {
  std::string folder;
  Json result;
  bool has_report;
};

std::vector<IndexedRun> runs_in(const fs::path& folder) {
  std::vector<IndexedRun> runs;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    if (!fs::exists(entry.path() / "result.json", ignored)) continue;
    Json result;
    try {
      result = read_json_or_discarded(content_of_regular_file(entry.path() / "result.json", kLargest));
    } catch (const FileError&) {
      continue;
    }
    if (!result.is_object() || result.value("program", Json()) != "mbsopt") continue;
    runs.push_back(
        {entry.path().filename().string(), std::move(result), fs::exists(entry.path() / "report.html", ignored)});
  }
  std::ranges::sort(runs, {}, &IndexedRun::folder);
  return runs;
}

// A folder's name as part of an address (RFC 3986): letters, digits, - . _ ~ stay.
std::string address_of(const std::string& folder) {
  std::string address;
  for (const char c : folder) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
                       std::string_view("-._~").find(c) != std::string_view::npos;
    address += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return address;
}

// The numbers by which two runs are compared have names: "objective path [m^2]", "parameter k1 [N/m]", ...
Json compared_numbers(const Json& result) {
  Json numbers = Json::object();
  const Json objectives = result.value("objectives", Json::object()),  // items() refers to them
      parameters = result.value("parameters", Json::object());
  for (const auto& [kind, quantities] : {std::pair{"objective", &objectives}, std::pair{"parameter", &parameters}})
    for (const auto& [name, quantity] : quantities->items()) {
      if (!quantity.is_object()) continue;
      const std::string unit = quantity.value("unit", "");
      numbers[fmt::format("{} {}{}", kind, name, unit.empty() ? "" : " [" + unit + "]")] =
          quantity.value("value", Json());
    }
  for (const auto& [part, keys] : {std::pair{"simulation", std::vector{"steps", "rejected", "rhs_evaluations"}},
                                   std::pair{"optimizer", std::vector{"iterations", "evaluations"}}}) {
    for (const char* key : keys)
      if (result.contains(part) && result.at(part).contains(key)) numbers[key] = result.at(part).at(key);
  }
  return numbers;
}

}  // namespace

std::string run_index(const fs::path& folder) {
  const std::vector<IndexedRun> runs = runs_in(folder);
  if (runs.empty()) return {};
  HtmlPage page(kIndexTitle);
  page.heading("All runs");
  std::vector<TableRow> rows;
  Json compared = Json::array();
  for (const IndexedRun& run : runs) {
    TableCell name(run.folder);
    if (run.has_report) name.link = address_of(run.folder) + "/report.html";
    rows.push_back({name, cell(run.result.value("command", Json())), cell(run.result.value("status", Json())),
                    std::to_string(run.result.value("warnings", Json::array()).size())});
    compared.push_back({{"name", run.folder}, {"numbers", compared_numbers(run.result)}});
  }
  page.table({"folder", "command", "status", "warnings"}, rows);
  if (runs.size() > 1) page.comparison(std::move(compared));
  return page.text();
}

void write_run_index(const fs::path& folder) {
  const fs::path file = folder / "index.html";
  std::error_code ignored;
  if (fs::exists(file, ignored)) {
    try {
      if (content_of_regular_file(file).find(fmt::format("<title>{}</title>", kIndexTitle)) == std::string::npos)
        return;
    } catch (const FileError&) {
      return;
    }
  }
  if (const std::string text = run_index(folder); !text.empty()) write_file_atomically(file, text);
}

}  // namespace mbsopt::inline app
