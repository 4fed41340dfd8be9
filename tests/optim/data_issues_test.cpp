#include "optim/data_issues.hpp"

#include <catch2/catch.hpp>

using namespace mbsopt;

namespace {

std::vector<SceneIssue> issues_of(const ExperimentSpec& experiment, const std::string& csv) {
  return find_data_issues(experiment, "experiments[0]", parse_csv(csv, "run.csv"), 0);
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
