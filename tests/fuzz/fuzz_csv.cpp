// The reader of CSV files: a table whose parts agree, or a refusal that names the file.
#include <algorithm>
#include <cmath>

#include "optim/problem/csv_table.hpp"
#include "tests/fuzz/fuzz_target.hpp"

using namespace mbsopt;
using fuzz::expect;

namespace {

template <class Read>
void refused_in_words(std::string_view text, const Read& read) {
  try {
    read();
  } catch (const CsvError& error) {
    fuzz::expect_words(error.what(), text);
    expect(std::string_view(error.what()).starts_with("run.csv:"), "the refusal does not name the file", error.what());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text_of(data, size);
  refused_in_words(text, [&] {
    const CsvTable table = parse_csv(text, "run.csv");
    expect(!table.header.empty() && table.columns.size() == table.header.size(), "columns without names", "");
    expect(std::is_sorted(table.lines.begin(), table.lines.end()), "lines out of order", "");
    for (const std::vector<double>& column : table.columns) {
      expect(column.size() == table.rows(), "columns of different length", "");
      expect(std::none_of(column.begin(), column.end(), [](double x) { return std::isinf(x); }), "an infinite cell",
             "");
    }
    for (const std::string& name : table.header) {
      expect(table.has_column(name), "a column that cannot be found", name);
      refused_in_words(text, [&] { ascending_times(table, name); });
    }
    refused_in_words(text, [&] { table.column("no such column"); });
  });
  return 0;
}
