#include "optim/problem/data_issues.hpp"

#include <catch2/catch.hpp>

using namespace mbsopt;

namespace {

std::vector<SceneIssue> issues_of(const ExperimentSpec& experiment, const std::string& csv) {
  Scene scene;
  for (const char* name : {"x_sensor", "y_sensor"}) {
    scene.sensors.emplace_back();
    scene.sensors.back().name = name, scene.sensors.back().quantity = "angle";
  }
  return find_data_issues(experiment, "experiments[0]", parse_csv(csv, "run.csv"), scene);
}

ExperimentSpec experiment() {
  ExperimentSpec e;
  e.channels = {{"x", "x_sensor"}, {"y", "y_sensor"}};
  return e;
}

}  // namespace

TEST_CASE("data that can be used have no issue", "[data]") {
  CHECK(issues_of(experiment(), "t,x,y\n0,1,2\n1,nan,2\n").empty());
}

TEST_CASE("every missing column is reported at the field that names it", "[data]") {
  const auto issues = issues_of(experiment(), "time,x,z\n0,1,2\n1,1,2\n");
  REQUIRE(issues.size() == 2);
  CHECK(issues[0].path == "experiments[0].time");
  CHECK(issues[1].path == "experiments[0].channels[1].column");
  CHECK_THAT(issues[1].message, Catch::Contains("no column 'y'") && Catch::Contains("its columns: time, x, z"));
}

TEST_CASE("times that go back, and records without a sample after the start, are issues of the data", "[data]") {
  const auto back = issues_of(experiment(), "t,x,y\n0,1,2\n1,1,2\n0.5,1,2\n");
  REQUIRE(back.size() == 1);
  CHECK(back[0].path == "experiments[0].data");
  CHECK_THAT(back[0].message, Catch::Contains("run.csv:4") && Catch::Contains("must be ascending"));
  ExperimentSpec late = experiment();
  late.start_time = 3;
  const auto early = issues_of(late, "t,x,y\n0,1,2\n1,1,2\n");
  REQUIRE(early.size() == 1);
  CHECK_THAT(early[0].message, Catch::Contains("no sample after the start at 3 s") && Catch::Contains("from 0 to 1 s"));
  CHECK(issues_of(experiment(), "t,x,y\n1,,\n").size() == 1);
}

TEST_CASE("a channel without any sample is an issue of its column", "[data]") {
  const auto issues = issues_of(experiment(), "t,x,y\n0,1,nan\n1,1,\n2,1,NA\n");
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].path == "experiments[0].channels[1].column");
  CHECK_THAT(issues[0].message, Catch::Contains("'y' of run.csv has no sample after the start at 0 s"));
}

TEST_CASE("a number as sigma or bias of a column that is not in SI is doubted", "[data]") {
  const std::string csv = "t,x [deg],y [rad]\n0,1,2\n1,3,2.5\n2,2,2.6\n";
  ExperimentSpec e = experiment();
  e.channels[0].sigma = e.channels[1].sigma = 0.25, e.channels[0].bias = 0.1;
  const auto issues = issues_of(e, csv);
  REQUIRE(issues.size() == 2);
  CHECK((issues[0].is_warning && issues[1].is_warning));
  CHECK(issues[0].path == "experiments[0].channels[0].sigma");
  CHECK(issues[0].message ==
        "is 0.25 rad, which is 14.3 deg: write \"0.25 [deg]\" if 0.25 deg is meant, else \"0.25 [rad]\"");
  CHECK(issues[1].path == "experiments[0].channels[0].bias");
  e.channels[0].sigma = Expression::parse("0.25 [deg]"), e.channels[0].bias = 0.0;
  CHECK(issues_of(e, csv).empty());
}

TEST_CASE("a doubt about an acceleration in g suggests m/s^2, since fields read g as the gram", "[data]") {
  Scene scene;
  scene.sensors.emplace_back();
  scene.sensors[0].name = "a", scene.sensors[0].quantity = "acceleration";
  ExperimentSpec e;
  e.channels = {{"a", "a"}};
  e.channels[0].sigma = 0.01;
  const auto issues = find_data_issues(e, "experiments[0]", parse_csv("t,a [g]\n0,1\n1,2\n", "run.csv"), scene);
  REQUIRE(issues.size() == 1);
  CHECK_THAT(issues[0].message, Catch::Contains("0.00102 g: write \"0.0980665 [m/s^2]\" if 0.01 g is meant"));
}

TEST_CASE("a unit other than that of the header is said", "[data]") {
  const std::string csv = "t,x [deg],y\n0,1,2\n1,3,2.5\n2,2,2.6\n";
  ExperimentSpec e = experiment();
  e.channels[0].unit = "rad", e.channels[1].unit = "rad";
  const auto issues = issues_of(e, csv);
  REQUIRE(issues.size() == 1);
  CHECK((issues[0].is_warning && issues[0].path == "experiments[0].channels[0].unit"));
  CHECK(issues[0].message == "the header of 'x' says deg, \"unit\" says rad, which counts");
  e.channels[0].unit = "deg";
  CHECK(issues_of(e, csv).empty());
}

TEST_CASE("a column is compared once, and not with the times", "[data]") {
  ExperimentSpec e = experiment();
  e.channels[1].column = "x";
  auto issues = issues_of(e, "t,x\n0,1\n1,2\n");
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].path == "experiments[0].channels[1].column");
  CHECK_THAT(issues[0].message, Catch::Contains("compared by channels[0] already"));
  e.channels[1].column = "t";
  issues = issues_of(e, "t,x\n0,1\n1,2\n");
  REQUIRE(issues.size() == 1);
  CHECK_THAT(issues[0].message, Catch::Contains("column of the times"));
}

TEST_CASE("seconds since 1970 are not simulated", "[data]") {
  const std::string csv = "t,x,y\n1700000000,1,1\n1700000001,2,1\n1700000030,1,2\n";
  const auto issues = issues_of(experiment(), csv);
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].path == "experiments[0].data");
  CHECK_THAT(issues[0].message, Catch::Contains("run.csv:2: the record begins 1.7e+09 s after the start") &&
                                    Catch::Contains("\"start_time\""));
  ExperimentSpec said = experiment();
  said.start_time = 1.7e9;
  CHECK(issues_of(said, csv).empty());
  said.start_time = 1.7e9 + 29;
  const auto unresolved = issues_of(said, csv);
  REQUIRE(unresolved.size() == 1);
  CHECK_THAT(unresolved[0].message, Catch::Contains("do not resolve the steps"));
  CHECK(issues_of(experiment(), "t,x,y\n10,1,1\n11,1,1\n").empty());  // a record that begins late
}

TEST_CASE("an angle that jumps by a turn is warned of, at the row", "[data]") {
  const auto turned = [](double turn) {
    std::string csv = "t,x,y\n";
    for (int i = 0; i < 40; ++i)
      csv += std::to_string(i) + "," + std::to_string(i % 2) + "," +
             std::to_string(0.04 * turn * i - (i < 20 ? 0 : turn)) + "\n";
    return csv;
  };
  for (const double turn : {2 * 3.14159265358979, 360.0}) {
    const auto issues = issues_of(experiment(), turned(turn));
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].is_warning);
    CHECK(issues[0].path == "experiments[0].channels[1].column");
    CHECK_THAT(issues[0].message, Catch::Contains("run.csv:22: 'y' jumps"));
    CHECK((issues[0].message.find("degrees") != std::string::npos) == (turn > 300));
  }
}

TEST_CASE("a signal that never moves is warned of", "[data]") {
  const auto issues = issues_of(experiment(), "t,x,y\n0,1,0.5\n1,2,nan\n2,1,0.5\n3,2,0.5\n");
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].is_warning);
  CHECK(issues[0].path == "experiments[0].channels[1].column");
  CHECK_THAT(issues[0].message, Catch::Contains("'y' of run.csv never changes: 3 samples of 0.5"));
  ExperimentSpec moving = experiment();
  moving.end_time = 2;
  CHECK(issues_of(moving, "t,x,y\n0,1,0.5\n1,2,0.6\n2,1,0.5\n3,1,0.5\n").empty());
}

TEST_CASE("an angle beyond 100 rad is warned of where nobody gives its unit", "[data]") {
  const auto record = [](const char* header) { return std::string(header) + "\n0,1,1\n1,2,-40\n2,1,-80\n3,2,-120\n"; };
  const auto issues = issues_of(experiment(), record("t,x,y"));
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].is_warning);
  CHECK(issues[0].path == "experiments[0].channels[1].column");
  CHECK_THAT(issues[0].message, Catch::Contains("run.csv:5: 'y' is -120 rad, 19.1 turns: is the column in degrees?"));
  CHECK(issues_of(experiment(), record("t,x,y [rad]")).empty());
  ExperimentSpec in_degrees = experiment();
  in_degrees.channels[1].gain = 180 / 3.14159265358979;
  CHECK(issues_of(in_degrees, record("t,x,y")).empty());
}

TEST_CASE("a record of days is warned of where nobody gives the unit of its times", "[data]") {
  const auto record = [](const char* header) {  // 3 s in microseconds
    return std::string(header) + "\n0,1,1\n1000000,2,2\n2000000,1,1\n3000000,2,3\n";
  };
  const auto issues = issues_of(experiment(), record("t,x,y"));
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].is_warning);
  CHECK(issues[0].path == "experiments[0].time");
  CHECK_THAT(issues[0].message, Catch::Contains("the record lasts 3e+06 s, 34.7 days: is 't' in s?"));
  CHECK(issues_of(experiment(), record("t [s],x,y")).empty());
}
