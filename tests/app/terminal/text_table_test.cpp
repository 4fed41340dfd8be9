#include "app/terminal/text_table.hpp"

#include <catch2/catch.hpp>
#include <limits>

using namespace mbsopt;

TEST_CASE("numbers are aligned right and words left", "[table]") {
  TextTable table({"parameter", "value", "unit"});
  table.add({"k", "-12.5", "N/m"});
  table.add({"length", "3", "m"});
  CHECK(table.text() ==
        "parameter  value  unit\n"
        "k          -12.5  N/m\n"
        "length         3  m\n");
}

TEST_CASE("a column is as wide as its characters, not its bytes", "[table]") {
  TextTable table({"name", "x"});
  table.add({"\u03c8", "1"});
  CHECK(table.text() == "name  x\n\u03c8     1\n");
}

TEST_CASE("a value that is not a number is a dash", "[table]") {
  CHECK(significant(std::numeric_limits<double>::quiet_NaN()) == "-");
  CHECK(significant(2.14695368088) == "2.146954");
}

TEST_CASE("the entries of a result are a table; a column that no row has may be left out", "[table]") {
  Json rows;
  rows["k"] = {{"value", 1.23456789012}, {"unit", ""}, {"fit", {{"p", 0.5}}}, {"price", nullptr}};
  rows["c"] = {{"value", 2}, {"unit", "N"}};
  const TextTable table =
      table_of(rows, {{"name"}, {"value", "value", 10}, {"unit", "unit"}, {"p", "fit/p"}, {"price", "price", 7, true}});
  CHECK(table.text() ==
        "name       value  unit    p\n"
        "k     1.23456789  -     0.5\n"
        "c              2  N\n");
  CHECK(table.rows()[0][1].brief == "1.234568");
  CHECK(table.rows()[0][1].full == "1.23456789012");
}
