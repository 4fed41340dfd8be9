#include "optim/problem/csv_table.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace mbsopt;
using Catch::Matchers::Contains;

namespace {

std::string error_of(std::string_view text) {
  try {
    const CsvTable table = parse_csv(text, "run1.csv");
    for (const std::string& name : table.header) table.column(name);
  } catch (const CsvError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("commas, semicolons and tabs separate alike, with either line end", "[csv]") {
  const std::string text = GENERATE(as<std::string>{}, "t,x\n0,1.5\n1e-3,-2\n", "t;x\r\n0;1.5\r\n1e-3;-2\r\n",
                                    "t\tx\n0\t1.5\n0.001\t-2", "\xEF\xBB\xBF t , x \n 0 , +1.5 \n 1E-3,\t-2.0 \n",
                                    "# made by the rig\n\nt,x\n# warm\n0,1.5\n\n0.001,-2\n", "t,x\r0,1.5\r1e-3,-2\r");
  const CsvTable table = parse_csv(text, "run1.csv");
  CHECK(table.header == std::vector<std::string>{"t", "x"});
  CHECK(table.rows() == 2);
  CHECK(table.column("t") == std::vector<double>{0, 1e-3});
  CHECK(table.column("x") == std::vector<double>{1.5, -2});
}

TEST_CASE("quoted names and cells may hold the delimiter and quotes", "[csv]") {
  const CsvTable table = parse_csv("t,\"force, left\",\"1/2\"\" pipe\"\n\"0\",\"1\",2\n", "run1.csv");
  CHECK(table.header == std::vector<std::string>{"t", "force, left", "1/2\" pipe"});
  CHECK(table.column("force, left") == std::vector<double>{1});
}

TEST_CASE("a semicolon in the header leaves commas to the names", "[csv]") {
  CHECK(parse_csv("t;force, left\n0;1\n", "a").header == std::vector<std::string>{"t", "force, left"});
}

TEST_CASE("missing cells are NaN", "[csv]") {
  const CsvTable table = parse_csv("t,x,y\n0,,1\n1,nan,\n2,NA,NaN\n", "run1.csv");
  for (const double x : table.column("x")) CHECK(std::isnan(x));
  CHECK(table.column("y")[0] == 1);
  CHECK(std::isnan(table.column("y")[1]));
  CHECK(std::isnan(table.column("y")[2]));
}

TEST_CASE("a tab-separated row may end in missing cells", "[csv]") {
  const CsvTable table = parse_csv("t\tx\ty\n0\t\t\n", "run1.csv");
  CHECK(table.rows() == 1);
  CHECK(std::isnan(table.column("y")[0]));
}

TEST_CASE("decimals may have a comma between semicolons and tabs", "[csv]") {
  for (const char* text : {"t;x;y\n0;-1,5;2\n0,25;+3,5e-2;\n", "t\tx\ty\n0\t-1,5\t2\n0,25\t+3,5e-2\t\n"}) {
    const CsvTable table = parse_csv(text, "run1.csv");
    REQUIRE(table.rows() == 2);
    CHECK(table.column("t") == std::vector<double>{0, 0.25});
    CHECK(table.column("x") == std::vector<double>{-1.5, 0.035});
    CHECK(table.column("y")[0] == 2);
    CHECK(std::isnan(table.column("y")[1]));
  }
}

TEST_CASE("errors in a table name the file, the line and the column", "[csv]") {
  CHECK(error_of("") == "run1.csv: is empty; a header row with the columns' names is needed");
  CHECK(error_of("# only a comment\n") == error_of(""));
  CHECK(error_of("t,x\n0,1\n1,1.5e\n") == "run1.csv:3:3: column 'x': '1.5e' is not a finite number");
  CHECK(error_of("t,x\n0,inf\n") == "run1.csv:2:3: column 'x': 'inf' is not a finite number");
  CHECK(error_of("t,x\n0,1\n1,1.5e\n1,2e\n") == error_of("t,x\n0,1\n1,1.5e\n"));
  CHECK(error_of("t,x\n0\n") == "run1.csv:2:1: the row has 1 cell, the header 2");
  CHECK(error_of("t,x\n0,1,2\n") ==
        "run1.csv:2:1: the row has 3 cells, the header 2 (where decimals have a comma, cells need a semicolon or a tab "
        "between them)");
  CHECK(error_of("t,x,t\n") == "run1.csv:1:5: the column 't' appears twice");
  CHECK(error_of("0,1\n1,2\n") == "run1.csv:1:1: the first row must hold the columns' names, found numbers");
  CHECK(error_of("0,5;1\n1;2\n") == "run1.csv:1:1: the first row must hold the columns' names, found numbers");
  CHECK(error_of("t,x\n0,\"1,5\"\n") ==
        "run1.csv:2:3: column 'x': '1,5' has a decimal comma, which needs a semicolon or a tab between cells");
  CHECK(error_of("t;x\n0;1,5\n\n1;2.5\n") ==
        "run1.csv:4:3: column 'x': '2.5' has a decimal point, line 2 a decimal comma; a file has one of them");
  CHECK(error_of("t\tx\n0.0\t1,5\n") ==
        "run1.csv:2:5: column 'x': '1,5' has a decimal comma, line 2 a decimal point; a file has one of them");
  CHECK(error_of("t;x\n0;1.234,5\n") ==
        "run1.csv:2:3: column 'x': '1.234,5' has more than one point or comma; thousands are not separated");
  CHECK(error_of("t,\"x\n0,1\n") == "run1.csv:1:3: the quote is not closed on its line");
  CHECK(error_of("t,\"x\"y\n0,1\n") == "run1.csv:1:6: found 'y' after a closing quote, where the cell must end");
}

TEST_CASE("what nobody asks for may be text, without a name, or behind the last comma", "[csv]") {
  for (const char* text :
       {"t,state,x\n0,idle,1.5\n1,\"up, slowly\",2\n", ",t,x\n0,0,1.5\n1,1,2\n", "t,x,\n0,1.5,\n1,2,\n",
        "t,x,\n0,1.5\n1,2\n", "t,x\n0,1.5,\n1,2,,\n", ",t,,x\na,0,,1.5\nb,1,,2\n"}) {
    const CsvTable table = parse_csv(text, "run1.csv");
    CHECK(table.column("t") == std::vector<double>{0, 1});
    CHECK(table.column("x") == std::vector<double>{1.5, 2});
    CHECK_THROWS_WITH(table.column(""), Contains("has no column ''") && !Contains(", ,"));
  }
  CHECK_THROWS_WITH(parse_csv("t,state\n0,idle\n", "a.csv").column("state"),
                    "a.csv:2:3: column 'state': 'idle' is not a finite number");
  CHECK(error_of("t,x\n0,1,2\n") != "no error");
}

TEST_CASE("text between commas decides nothing about decimals", "[csv]") {
  CHECK(parse_csv("t;v;x\n0;v1.2;1,5\n", "a.csv").column("x") == std::vector<double>{1.5});
}

TEST_CASE("units stand in square or round brackets, or in a row of their own", "[csv]") {
  for (const char* text : {"t [ms],rate [deg/s]\n0,1\n", "t (ms),rate (deg/s)\n0,1\n", "t,rate\nms,deg/s\n0,1\n",
                           "t,rate\n[ms],(deg/s)\n0,1\n", "t,rate [deg/s]\nms,rad/s\n0,1\n"}) {
    const CsvTable table = parse_csv(text, "run1.csv");
    REQUIRE(table.rows() == 1);
    CHECK(parts_of_header(table.header[table.find_column("t")]).unit == "ms");
    CHECK(parts_of_header(table.header[table.find_column("rate")]).unit == "deg/s");
  }
  CHECK(parts_of_header("force (left)").name == "force (left)");
  CHECK_FALSE(parts_of_header("force (left)").unit);
  CHECK(error_of("t,x\nsecs,metres\n0,1\n") ==
        "run1.csv:2:1: the row below the names has no numbers, and 'secs' is no known unit; a '#' in front of the row "
        "leaves it out");
  CHECK(parse_csv("t,x\nnan,nan\n0,1\n", "a").rows() == 2);
}

TEST_CASE("programs write a missing number in many ways", "[csv]") {
  const CsvTable table = parse_csv("x\n-nan\n+NaN\n-nan(ind)\nN/A\n", "a.csv");
  REQUIRE(table.rows() == 4);
  for (const double x : table.column("x")) CHECK(std::isnan(x));
}

TEST_CASE("a file in UTF-16 is named as such", "[csv]") {
  using namespace std::string_view_literals;
  for (const std::string_view text : {"\xFF\xFEt\0,\0x\0\n\0"sv, "\xFE\xFF\0t\0,\0x\0\n"sv, "t\0,\0x\0\n\0"sv})
    CHECK_THROWS_WITH(parse_csv(text, "run1.csv"), Contains("run1.csv") && Contains("UTF-16"));
}

TEST_CASE("a column that is not there is answered with those that are", "[csv]") {
  const CsvTable table = parse_csv("t,theta,omega\n0,1,2\n", "run1.csv");
  CHECK_FALSE(table.has_column("thetta"));
  CHECK_THROWS_WITH(table.column("thetta"),
                    Contains("run1.csv") && Contains("did you mean 'theta'") && Contains("t, theta, omega"));
}

TEST_CASE("times must ascend, and the row that does not is named", "[csv]") {
  CHECK(ascending_times(parse_csv("t\n0\n0.5\n0.7\n", "a.csv"), "t").size() == 3);
  CHECK_THROWS_WITH(ascending_times(parse_csv("t\n0\n# gap\n0.7\n0.5\n", "a.csv"), "t"),
                    "a.csv:5: column 't': 0.5 comes after 0.7; times must be ascending");
  CHECK_THROWS_WITH(ascending_times(parse_csv("t\n0\n0\n", "a.csv"), "t"), Contains("0 comes after 0"));
  CHECK_THROWS_WITH(ascending_times(parse_csv("t,x\n0,1\n,2\n", "a.csv"), "t"),
                    "a.csv:3: the time in column 't' is missing");
}

TEST_CASE("a file that is not there is an error with its path", "[csv]") {
  CHECK_THROWS_WITH(read_csv("no/such/file.csv"), "no/such/file.csv: there is no such file");
}

TEST_CASE("data are read from regular files only: a device may never end, a pipe is empty the second time", "[csv]") {
  CHECK_THROWS_WITH(read_csv("/dev/zero"), Catch::Contains("/dev/zero: is a pipe or a device"));
  CHECK_THROWS_WITH(read_csv("/proc/self/mem"), Catch::Contains("cannot be read: Input/output error"));
  CHECK_THROWS_WITH(read_csv("/tmp"), Catch::Contains("is a directory"));
}
