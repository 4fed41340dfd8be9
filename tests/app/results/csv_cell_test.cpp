
#include <catch2/catch.hpp>

#include "app/results/trajectory_csv.hpp"

using namespace mbsopt;

TEST_CASE("a cell that a comma would split is quoted, one that a spreadsheet would run is text", "[output]") {
  CHECK(csv_cell("rod.x") == "rod.x");
  CHECK(csv_cell("a, b") == "\"a, b\"");
  CHECK(csv_cell("a \"b\"") == "\"a \"\"b\"\"\"");
  CHECK(csv_cell("=1+1") == "'=1+1");
  CHECK(csv_cell("@SUM(A1,A2)") == "\"'@SUM(A1,A2)\"");
  CHECK(csv_cell("") == "");
  CHECK(to_csv({{"t", "=1+1.x", "-a", "+b"}, {{0, 1, 2, 3}}}) == "t,'=1+1.x,'-a,'+b\n0,1,2,3\n");
}
