#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <sstream>
#include <utility>

#include "app/json/read_problem.hpp"
#include "app/starts/sweep_blocks.hpp"
#include "app/terminal/exit_code.hpp"
#include "app/terminal/interrupt.hpp"
#include "optim/machine/stopwatch.hpp"
#include "optim/problem/csv_table.hpp"
#include "source_folder.hpp"
#include "tests/app/killed_run.hpp"
#include "tests/app/run_command.hpp"
#include "tests/app/swinging_rod.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

CsvTable swept(const TemporaryFolder& folder, std::vector<std::string> options, const std::string& out) {
  std::vector<std::string> arguments{"sweep", folder.write("rod.json", kSwingingRod), "--out", folder.file(out)};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const CommandOutcome outcome = run_command(arguments);
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  return read_csv(folder.file(out) + "/sweep.csv");
}

}  // namespace

TEST_CASE("a swept grid has the values and gradients of single runs, whatever the threads", "[command][sweep]") {
  const TemporaryFolder folder;
  const CsvTable table =
      swept(folder, {"--vary", "k=5:20:3", "--vary", "free=0.4:0.6:2", "--gradients", "--threads", "2"}, "two");
  REQUIRE(table.rows() == 6);
  CHECK(table.column("k")[2] == Approx(10));  // the scale of k is logarithmic
  CHECK(table.column("free")[3] == Approx(0.6));
  const CommandOutcome single =
      run_command({"gradient", folder.file("rod.json"), "--out", folder.file("single"), "--set",
                   "parameters.k.value=" + fmt::format("{:.17g}", table.column("k")[3]), "--set",
                   "parameters.free.value=" + fmt::format("{:.17g}", table.column("free")[3])});
  REQUIRE(single.exit_code == kDone);
  const nlohmann::json track = json_of(folder.path / "single/result.json").at("objectives").at("track");
  CHECK(table.column("track")[3] == Approx(track.at("value").get<double>()).epsilon(1e-12));
  CHECK(table.column("d track/d k")[3] == Approx(track.at("gradient").at("k").get<double>()).epsilon(1e-10));
  swept(folder, {"--vary", "k=5:20:3", "--vary", "free=0.4:0.6:2", "--gradients", "--threads", "1"}, "one");
  CHECK(content_of(folder.path / "one/sweep.csv") == content_of(folder.path / "two/sweep.csv"));
}

// Over a road's step h the integral of a sprung mass's acceleration squared is, by Parseval's theorem,
//   h^2/2 (k_t c/m^2 + (m + m_w) k^2/(m^2 c))
TEST_CASE("a sweep of quarter_car/ride has the comfort of its closed form at each point", "[command][sweep]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"sweep", MBSOPT_SOURCE_DIR "/problems/quarter_car/ride.json", "--vary", "k=20000:40000:5", "--vary",
                   "c=2000:6000:3", "--out", folder.file("ride"), "--threads", "2"});
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  const CsvTable table = read_csv(folder.file("ride/sweep.csv"));
  REQUIRE(table.rows() == 15);
  constexpr double m = 300, m_w = 40, k_t = 180000, h = 0.05;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double k = table.column("k")[row], c = table.column("c")[row];
    CHECK(table.column("comfort")[row] ==
          Approx(h * h / 2 * (k_t * c + (m + m_w) * k * k / c) / (m * m)).epsilon(1e-6));  // less what is after 3 s
  }
}

TEST_CASE("samples of a sweep fill their ranges, and a file gives its own points", "[command][sweep]") {
  const TemporaryFolder folder;
  const CsvTable samples = swept(folder, {"--vary", "free=0.3:0.7", "--samples", "4", "--seed", "3"}, "samples");
  REQUIRE(samples.rows() == 4);
  std::vector<double> values = samples.column("free");
  std::ranges::sort(values);
  for (std::size_t k = 0; k < 4; ++k) {
    CHECK(values[k] >= 0.3 + 0.1 * static_cast<double>(k));
    CHECK(values[k] <= 0.4 + 0.1 * static_cast<double>(k));
  }
  const CsvTable own = swept(folder, {"--points", folder.write("points.csv", "free,k\n0.5,20\n0.55,30\n")}, "own");
  CHECK(own.column("k") == std::vector<double>{20, 30});
  CHECK(json_of(folder.path / "own/result.json").at("sweep").at("computed") == 2);
}

TEST_CASE("the report of a sweep names the extremes, plots each objective and lists the best points",
          "[command][sweep][report]") {
  const TemporaryFolder folder;
  // The points below the limit that the design sets: their best is not the best of all.
  const std::string limit = R"(design.subject_to=[{"objective": "reach", "upper": 0.45}])";
  const CsvTable table = swept(
      folder, {"--vary", "free=0.3:0.7:30", "--set", "objectives.reach.parameters_only=free", "--set", limit}, "line");
  const std::vector<double> track = table.column("track"), reach = table.column("reach");
  std::vector<std::size_t> order(track.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t i) { return std::pair(reach[i] > 0.45, track[i]); };
  std::ranges::stable_sort(order, {}, key);
  const std::size_t least = static_cast<std::size_t>(std::ranges::min_element(track) - track.begin());
  REQUIRE(order.front() != least);
  const std::string line = content_of(folder.path / "line/report.html");
  CHECK_THAT(line, Contains("30 of 30 points have values") &&
                       Contains(fmt::format("{} keep the limits",
                                            std::ranges::count_if(reach, [](double r) { return r <= 0.45; }))));
  CHECK_THAT(line, Contains(fmt::format("track from {:.5g} m^2 s at point {} (free = {:.5g})", track[least], least + 1,
                                        table.column("free")[least])));
  // The rows of the table, in their order.
  std::vector<std::string> rows;
  for (std::size_t at = line.find("<tbody>"); (at = line.find("<tr><td>", at)) < line.find("</table>");) {
    at += 8;
    rows.push_back(line.substr(at, line.find('<', at) - at));
  }
  std::vector<std::string> expected;
  for (std::size_t i = 0; i < 20; ++i) expected.push_back(std::to_string(order[i] + 1));
  CHECK(rows == expected);
  CHECK_THAT(line, Contains("class=\"line c0\"") && Contains("of 30 with values"));

  swept(folder, {"--vary", "k=5:20:3", "--vary", "free=0.4:0.6:2"}, "grid");
  const std::string grid = content_of(folder.path / "grid/report.html");
  CHECK_THAT(grid, Contains("track over k") && Contains("track over free") && Contains("class=\"points c0\""));
  CHECK_THAT(grid, !Contains("class=\"line c0\"") && !Contains("limits of the design"));
}

TEST_CASE("a sweep says where true extremes are least and largest, the same everywhere", "[command][sweep][report]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"sweep", folder.write("rod.json", kSwingingRod), "--out", folder.file("out"), "--vary",
                   "free=0.3:0.7:5", "--set", R"(objectives.peak={"maximum_of": "speed", "sharpness": 5})"});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  const std::vector<double> peaks = read_csv(folder.file("out/sweep.csv")).column("peak true");
  const auto [least, largest] = std::ranges::minmax(peaks);
  const nlohmann::json ranges = json_of(folder.path / "out/result.json").at("sweep").at("objectives");
  CHECK(ranges.at("peak").at("of") == "true_value");
  CHECK(ranges.at("peak").at("least").get<double>() == Approx(least).epsilon(1e-12));
  CHECK(ranges.at("peak").at("largest").get<double>() == Approx(largest).epsilon(1e-12));
  CHECK(ranges.at("track").at("of") == "value");
  CHECK_THAT(outcome.out, Contains("peak (true)"));
  CHECK_THAT(content_of(folder.path / "out/report.html"),
             Contains(fmt::format("peak (true) from {:.5g}", least)) && Contains("peak (true) over free"));
}

TEST_CASE("a sweep shows that it works before its first point is done", "[command][sweep]") {
  const TemporaryFolder folder;
  std::ostringstream out, err;
  const bool terminal = true;
  REQUIRE(run_command_line({"sweep", folder.write("rod.json", kSwingingRod), "--out", folder.file("bar"), "--vary",
                            "k=5:20:3", "--threads", "1"},
                           out, err, terminal) == kDone);
  CHECK_THAT(err.str(), Contains("  0 %"));
}

TEST_CASE("what a sweep cannot vary is said", "[command][sweep]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  const auto words = [&](std::vector<std::string> options) {
    std::vector<std::string> arguments{"sweep", file, "--out", folder.file("out")};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const CommandOutcome outcome = run_command(arguments);
    CHECK(outcome.exit_code == kBadInput);
    return outcome.err;
  };
  CHECK_THAT(words({}), Contains("either --vary") && Contains("--points"));
  CHECK_THAT(words({"--vary", "fre=1:2:3"}), Contains("no parameter 'fre'") && Contains("free"));
  CHECK_THAT(words({"--vary", "zz=1:2:3"}), Contains("no parameter 'zz'; known: k, free"));
  CHECK_THAT(words({"--vary", "free=1:2"}), Contains("no number of points"));
  CHECK_THAT(words({"--vary", "free=2:1:3"}), Contains("not below"));
  CHECK_THAT(words({"--vary", "k=-1:1:3"}), Contains("logarithmic"));
  CHECK_THAT(words({"--vary", "free=1:2:3", "--vary", "free=1:2:3"}), Contains("varied twice"));
  CHECK_THAT(words({"--points", folder.write("bad.csv", "free\n1\n\"\"\n")}), Contains("no number here"));
  CHECK_THAT(words({"--points", folder.file("absent.csv")}), Contains("absent.csv: cannot be read"));
}

TEST_CASE("resume: a sweep that is killed ends with the same bytes, from its journal", "[command][sweep][resume]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  std::string rows = "free,k\n";
  for (int i = 0; i < 40; ++i) rows += fmt::format("{},{}\n", 0.3 + 0.01 * i, 10 + i);
  const std::string points = folder.write("points.csv", rows);
  // Samples whose seed is drawn are in the journal's first line; points are read again.
  const bool sampled = GENERATE(true, false);
  const auto sweep = [&](const std::string& out) {
    std::vector<std::string> arguments{"sweep", file, "--gradients", "--threads", "2", "--out", folder.file(out)};
    if (sampled)
      arguments.insert(arguments.end(), {"--vary", "free=0.3:0.7", "--vary", "k=5:50", "--samples", "40"});
    else
      arguments.insert(arguments.end(), {"--points", points});
    return arguments;
  };
  const std::filesystem::path killed = folder.path / "killed";
  std::vector<std::string> kept = sweep("killed");
  kept.emplace_back("--keep-journal");
  kill_at(kept, killed, "start", 3);
  const long before = journal_lines(killed, "start");
  CHECK(before >= 3);
  CHECK(before < 40);
  const CommandOutcome resumed = run_command({"resume", killed.string(), "--threads", "1"});
  INFO(resumed.err);
  REQUIRE(resumed.exit_code == kDone);
  CHECK(journal_lines(killed, "start") == 40);
  std::vector<std::string> again = sweep("whole");
  if (sampled) again.insert(again.end(), {"--seed", json_of(killed / "result.json").at("sweep").at("seed").dump()});
  REQUIRE(run_command(again).exit_code == kDone);
  CHECK(content_of(killed / "sweep.csv") == content_of(folder.path / "whole/sweep.csv"));
  CHECK(outcome_of(killed) == outcome_of(folder.path / "whole"));
}

TEST_CASE("a sweep that is interrupted keeps no point half done", "[command][sweep][resume]") {
  std::string text = kSwingingRod;
  text.replace(text.find("\"objectives\": {"), 15,
               R"("objectives": {"lift": {"maximum_of": "tip_y", "sharpness": 80}, )");
  Problem problem = read_problem_text(text, "rod.json");
  problem.scene.simulation.integrator.max_step = 1e-3;
  const StartWork work = sweep_work(
      problem, {{"vary", {"k=7:90:9"}}, {"samples", nullptr}, {"points", ""}, {"gradients", false}, {"seed", 0}});
  // Each true extreme takes a run of its own. The signal comes within one run or the other, or after both.
  const InterruptGuard before;
  const Stopwatch stopwatch;
  work.record(4);
  const double both = stopwatch.seconds();
  int cut = 0;
  for (int k = 0; k < 24; ++k) {
    const InterruptGuard guard;
    std::thread signal([&] { std::this_thread::sleep_for(std::chrono::duration<double>(k * both / 20)), interrupt(); });
    const Json record = work.record(4);
    signal.join();
    if (record.at("status") == "stopped") ++cut;
    CHECK(record.at("rows").size() == (record.at("status") == "ok" ? 1 : 0));
    for (const Json& row : record.at("rows")) CHECK(row.at("true")[0].is_number());
  }
  CHECK(cut > 0);
}

TEST_CASE("a sweep whose folder is deleted meanwhile writes its results into a new one", "[command][sweep][resume]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  const std::filesystem::path out = folder.path / "out";
  std::thread deleting([&] {
    for (int i = 0; i < 3000 && !(std::filesystem::exists(out / kJournalFile) && journal_lines(out, "start") > 0); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    std::filesystem::remove_all(out);
  });
  const CommandOutcome outcome = run_command({"sweep", file, "--vary", "k=6:60:12", "--threads", "1", "--out",
                                              out.string(), "--set", "simulation.integrator.max_step=1e-3"});
  deleting.join();
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.err, Contains("was deleted during the run"));
  CHECK(lines_of(out / "sweep.csv").size() == 13);
  CHECK(json_of(out / "result.json").at("status") == "ok");
}

TEST_CASE("resume: a sweep whose points have changed is refused", "[command][sweep][resume]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  const std::string points = folder.write("points.csv", "free\n0.4\n0.5\n");
  const std::filesystem::path out = folder.path / "out";
  REQUIRE(run_command({"sweep", file, "--points", points, "--out", out.string(), "--keep-journal"}).exit_code == kDone);
  const std::string journal = content_of(out / kJournalFile);
  std::ofstream(out / kJournalFile, std::ios::binary) << journal.substr(0, journal.find('\n') + 1);
  folder.write("points.csv", "free\n0.4\n0.6\n");
  const CommandOutcome refused = run_command({"resume", out.string()});
  CHECK(refused.exit_code == kBadInput);
  CHECK_THAT(refused.err, Contains("another content of a data file"));
}
