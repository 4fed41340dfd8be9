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
