// Columns as loggers write them.
#include "optim/problem/logged_columns.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <numbers>

#include "tests/app/temporary_folder.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

const char* const kLog =
    "\"stamp [ms]\";\"shaft angle [deg]\";\"speed, motor [rpm]\";\"a (x) [g]\";\"volts [kV]\";\"plain\"\n"
    "1700000000123;180;60;1;1;5\n"
    "1700000000125;-90;30;-0.5;2;6\n";

std::string written(const TemporaryFolder& folder, const std::string& name, const std::string& text) {
  std::ofstream(folder.file(name)) << text;
  return folder.file(name);
}

}  // namespace

TEST_CASE("any header is found, with its unit or without it, and its values are SI", "[columns]") {
  const CsvTable log = parse_csv(kLog, "log.csv");
  CHECK(column_in_si(log, "shaft angle [deg]", "").values[0] == Approx(std::numbers::pi));
  CHECK(column_in_si(log, "shaft angle", "").unit == "rad");
  CHECK(column_in_si(log, "speed, motor", "").values == std::vector{2 * std::numbers::pi, std::numbers::pi});
  CHECK(column_in_si(log, "a (x)", "").values[1] == -0.5 * 9.80665);
  CHECK(column_in_si(log, "plain", "").values[0] == 5);
  CHECK(column_in_si(log, "plain", "").unit.empty());
  CHECK(column_in_si(log, "plain", "mm").values[0] == Approx(0.005));
  CHECK(column_in_si(log, "shaft angle", "mrad").values[0] == Approx(0.18));  // what is given comes first
  CHECK_THAT(column_in_si(log, "shaft angle", "").read, Contains("converted from deg to rad"));
  CHECK_THROWS_WITH(column_in_si(log, "volts", ""), Contains("'kV' is not a known unit; give its unit"));
  CHECK(column_in_si(log, "volts", "1").values[1] == 2);
  CHECK_THROWS_WITH(column_in_si(log, "torque", ""), Contains("has no column 'torque'"));
  const CsvTable twice = parse_csv("t,x [mm],x [V]\n0,1,2\n", "log.csv");
  CHECK_THROWS_WITH(twice.column("x"), Contains("has no column 'x'"));  // which of the two is not said
}

TEST_CASE("stamps of a clock become seconds from its zero without loss of digits", "[columns]") {
  const CsvTable log = parse_csv(kLog, "log.csv");
  const LoggedColumn first = times_in_seconds(log, "stamp", "", SampleColumn::kFirstRow);
  CHECK(first.values == std::vector{0.0, 0.002});
  CHECK_THAT(first.read, Contains("from ms to s"));
  const LoggedColumn given = times_in_seconds(log, "stamp", "", 1700000000.0);
  CHECK(given.values[1] == Approx(0.125).epsilon(1e-12));
  CHECK_THROWS_WITH(times_in_seconds(log, "plain", "deg", {}), Contains("'deg' is no unit of time"));
}

TEST_CASE("files of one experiment are joined in the order of time", "[columns]") {
  const TemporaryFolder folder;
  ExperimentSpec run;
  run.time = "t";
  run.channels.resize(2);
  run.channels[0].column = "x", run.channels[1].column = "angle", run.channels[1].unwrap = true;
  run.data = {written(folder, "a.csv", "t [ms],x [mm],angle [deg]\n5000,1,170\n5010,2,179\n5020,3,-172\n"),
              written(folder, "b.csv", "t,angle [deg]\n5.03,-163\n5.04,150\n"),
              written(folder, "c.csv", "t,x\n5.03,0.004\n5.015,0.009\n")};
  CHECK_THROWS_WITH(read_record(run), Contains("c.csv:3") && Contains("times must be ascending"));
  run.data[2] = written(folder, "c.csv", "t,x\n5.015,0.009\n5.03,0.004\n");
  run.time_zero = SampleColumn::kFirstRow;
  std::vector<std::string> read;
  const CsvTable record = read_record(run, &read);
  REQUIRE(record.rows() == 6);
  const std::vector<double> t{0, 0.01, 0.015, 0.02, 0.03, 0.04}, x{0.001, 0.002, 0.009, 0.003, 0.004, NAN},
      angle{170, 179, NAN, 188, 197, 150};
  for (std::size_t i = 0; i < t.size(); ++i) {
    INFO(i);
    CHECK(record.column("t")[i] == Approx(t[i]).margin(1e-12));
    if (i != 5) CHECK(record.column("x")[i] == Approx(x[i]));
    if (i != 2) CHECK(record.column("angle")[i] == Approx(angle[i] * kDegree));
  }
  CHECK(std::isnan(record.column("x")[5]));
  CHECK_THAT(record.place(2), Contains("c.csv:2"));
  CHECK(read.size() >= 4);

  run.data[2] = written(folder, "c.csv", "t,x\n5.01,0.009\n");
  CHECK_THROWS_WITH(read_record(run), Contains("column 'x' has a sample at") && Contains("c.csv:2"));
}
