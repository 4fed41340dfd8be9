#include "app/results/trajectory_mat.hpp"

#include <matio.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;

namespace {

// What libmatio reads: names and columns of doubles.
std::vector<std::pair<std::string, std::vector<double>>> read_by_matio(const std::string& file) {
  const std::unique_ptr<mat_t, decltype(&Mat_Close)> mat(Mat_Open(file.c_str(), MAT_ACC_RDONLY), Mat_Close);
  REQUIRE(mat);
  std::vector<std::pair<std::string, std::vector<double>>> vectors;
  for (;;) {
    const std::unique_ptr<matvar_t, decltype(&Mat_VarFree)> v(Mat_VarReadNext(mat.get()), Mat_VarFree);
    if (!v) return vectors;
    REQUIRE(v->class_type == MAT_C_DOUBLE);
    REQUIRE(v->rank == 2);
    REQUIRE(v->dims[1] == 1);
    const auto* const data = static_cast<const double*>(v->data);
    vectors.emplace_back(v->name, std::vector<double>(data, data + v->dims[0]));
  }
}

}  // namespace

TEST_CASE("libmatio reads each column of trajectory.mat under its name", "[results]") {
  const TemporaryFolder folder;
  const Trajectory trajectory{{"t", "rod.x", "swing"}, {{0, 1, 1e-300}, {0.1, -2, 1e300}, {0.2, 3.25, 0.1}}};
  const auto vectors = read_by_matio(folder.write("trajectory.mat", to_mat(trajectory)));
  REQUIRE(vectors.size() == 3);
  CHECK(vectors[0] == std::pair<std::string, std::vector<double>>{"t", {0, 0.1, 0.2}});
  CHECK(vectors[1] == std::pair<std::string, std::vector<double>>{"rod_x", {1, -2, 3.25}});
  CHECK(vectors[2] == std::pair<std::string, std::vector<double>>{"swing", {1e-300, 1e300, 0.1}});
  CHECK(to_mat(trajectory) == to_mat(trajectory));  // no date in the header
}

TEST_CASE("a trajectory without rows, and values that are no numbers, are written, too", "[results]") {
  const TemporaryFolder folder;
  CHECK(read_by_matio(folder.write("a.mat", to_mat({{"t"}, {}})))[0].second.empty());
  const auto vectors = read_by_matio(folder.write("b.mat", to_mat({{"t"}, {{std::nan("")}, {INFINITY}}})));
  CHECK(std::isnan(vectors[0].second[0]));
  CHECK(vectors[0].second[1] == INFINITY);
}

TEST_CASE("names of columns become names of MATLAB, each once", "[results]") {
  const std::string longest(80, 'a');
  CHECK(mat_names({"rod.x", "rod_x", "1st", "_a", "über", longest, longest}) ==
        std::vector<std::string>{"rod_x", "rod_x_2", "x1st", "x_a", "x__ber", std::string(63, 'a'),
                                 std::string(61, 'a') + "_2"});
}

TEST_CASE("simulate --mat writes trajectory.mat beside trajectory.csv", "[results]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  REQUIRE(run_command({"simulate", file, "--out", folder.file("plain")}).exit_code == kDone);
  CHECK_FALSE(std::filesystem::exists(folder.path / "plain/trajectory.mat"));
  const CommandOutcome outcome = run_command({"simulate", file, "--mat", "--out", folder.file("out")});
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out, Catch::Contains("trajectory.csv trajectory.mat"));
  CHECK_THAT(content_of(folder.path / "out/trajectory.mat"), Catch::StartsWith("MATLAB 5.0 MAT-file"));
}
