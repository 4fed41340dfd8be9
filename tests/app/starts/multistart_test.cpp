// Multistart, journal and resume, as commands.
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <fstream>
#include <set>
#include <thread>

#include "app/files/journal.hpp"
#include "app/starts/distinct_optima.hpp"
#include "app/terminal/exit_code.hpp"
#include "tests/app/killed_run.hpp"
#include "tests/app/run_command.hpp"
#include "tests/app/swinging_rod.hpp"

using namespace mbsopt;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

using Arguments = std::vector<std::string>;

CommandOutcome design(const std::string& file, const std::string& out, const Arguments& more = {}) {
  Arguments arguments{"design", file, "--out", out};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_command(arguments);
}

void write_text(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

}  // namespace

TEST_CASE("multistart: the same result from 1, 2 and 4 workers, with a waterfall", "[multistart]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  nlohmann::json first;
  std::string history;
  for (const std::string workers : {"1", "2", "4"}) {
    const CommandOutcome outcome = design(file, folder.file(workers), {"--threads", workers});
    INFO(outcome.err);
    REQUIRE(outcome.exit_code == kDone);
    CHECK_THAT(outcome.out, Contains("rank") && Contains("8 starts, seed 11"));
    CHECK_THAT(outcome.err, Contains("8 of 8 finished"));
    const nlohmann::json result = outcome_of(folder.path / workers);
    if (first.is_null()) first = result, history = content_of(folder.path / workers / "history.csv");
    CHECK(result == first);
    CHECK(content_of(folder.path / workers / "history.csv") == history);
  }
  const std::string report = content_of(folder.path / "4/report.html");
  CHECK_THAT(report, Contains("Waterfall") && Contains("8 starts, seed 11"));
  const auto& multistart = first.at("multistart");
  CHECK(multistart.at("starts") == 8);
  CHECK(multistart.at("seed") == 11);
  REQUIRE(multistart.at("waterfall").size() == 8);
  std::set<int> starts;
  double before = -1;
  for (const auto& record : multistart.at("waterfall")) {
    starts.insert(record.at("start").get<int>());
    // Starts whose design failed come last: there the spring's ends meet, where there is no gradient.
    const auto& objective = record.at("objective");
    CHECK((objective.is_null() || objective.get<double>() >= before));
    before = objective.is_null() ? INFINITY : objective.get<double>();
    if (record.at("start") == 0) CHECK(record.at("from").at("k") == 20);
  }
  CHECK(starts.size() == 8);
  const auto& best = multistart.at("waterfall").at(0);
  CHECK(best.at("start") == multistart.at("best"));
  CHECK(first.at("optimizer").at("objective_final") == best.at("objective"));
  CHECK(first.at("parameters").at("k").at("value") == best.at("parameters").at("k"));
  CHECK(first.at("parameters").at("k").at("initial") == 20);
  CHECK(first.at("optimizer").at("evaluations") == best.at("evaluations"));
}

TEST_CASE("multistart: a single run from the best start ends where the multistart says", "[multistart]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  REQUIRE(design(file, folder.file("many")).exit_code == kDone);
  const auto result = outcome_of(folder.path / "many");
  REQUIRE(run_command({"simulate", folder.file("many/optimized.json"), "--out", folder.file("again")}).exit_code ==
          kDone);
  const double again = json_of(folder.path / "again/result.json").at("objectives").at("track").at("value");
  CHECK(again == Approx(result.at("optimizer").at("objective_final").get<double>()).epsilon(1e-10));
}

TEST_CASE("multistart: Sobol points are other points, and a seed that is not given is drawn and told", "[multistart]") {
  const TemporaryFolder folder;
  std::string text = kSwingingRod;
  text.replace(text.find(", \"seed\": 11"), 12, "");
  const std::string file = folder.write("rod.json", text);
  const Arguments few{"--set", "design.multistart.starts=3", "--set", "design.optimizer.max_iterations=0"};
  design(file, folder.file("a"), few);
  design(file, folder.file("b"), few);
  const auto a = outcome_of(folder.path / "a").at("multistart"), b = outcome_of(folder.path / "b").at("multistart");
  CHECK(a.at("seed") != b.at("seed"));
  Arguments repeated = few;
  repeated.insert(repeated.end(), {"--set", "design.multistart.seed=" + a.at("seed").dump()});
  design(file, folder.file("c"), repeated);
  CHECK(outcome_of(folder.path / "c").at("multistart") == a);
  repeated.insert(repeated.end(), {"--set", "design.multistart.sampling=sobol"});
  design(file, folder.file("d"), repeated);
  CHECK(outcome_of(folder.path / "d").at("multistart").at("waterfall") != a.at("waterfall"));
}

TEST_CASE("multistart needs bounds, and says of which parameter", "[multistart]") {
  const TemporaryFolder folder;
  std::string text = kSwingingRod;
  text.replace(text.find(", \"upper\": 1.2"), 14, "");
  const CommandOutcome outcome = design(folder.write("rod.json", text), folder.file("out"));
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("parameters.free: has no upper bound") && Contains("multistart"));
}

TEST_CASE("resume: a multistart that is killed ends as if it had not been", "[resume]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  REQUIRE(design(file, folder.file("whole")).exit_code == kDone);
  const fs::path killed = folder.path / "killed";
  const long at = GENERATE(0, 1, 4, 7);
  kill_at({"design", file, "--out", killed.string(), "--threads", "2", "--keep-journal"}, killed,
          at == 0 ? "journal" : "start", std::max(at, 1L));
  const long finished = journal_lines(killed, "start");
  INFO("killed after " << finished << " starts");
  REQUIRE(finished >= at);
  const bool was_done = journal_lines(killed, "ended") > 0;
  const CommandOutcome outcome = run_command({"resume", killed.string(), "--threads", "3"});
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  CHECK(journal_lines(killed, "start") == 8);  // those that had finished are not run again
  if (!was_done) CHECK(outcome_of(killed) == outcome_of(folder.path / "whole"));
  for (const char* name : {"history.csv", "trajectory.csv"})
    CHECK(content_of(killed / name) == content_of(folder.path / "whole" / name));
}

TEST_CASE("resume: a single run is repeated to the same end, wherever its journal was cut off", "[resume]") {
  const TemporaryFolder folder;
  const std::string optimizer = GENERATE("ipopt", "slsqp", "bobyqa", "crs");
  INFO(optimizer);
  std::string text = kSwingingRod;
  text.replace(text.find("\"multistart\": {\"starts\": 8, \"seed\": 11}"), 39,
               "\"optimizer\": {\"type\": \"" + optimizer + "\"}");
  const std::string alone = folder.write("alone.json", text);
  const fs::path out = folder.path / "out";
  REQUIRE(design(alone, out.string(), {"--keep-journal"}).exit_code == kDone);
  const auto whole = outcome_of(out);
  const std::string history = content_of(out / "history.csv"), journal = content_of(out / kJournalFile);
  const long iterates = journal_lines(out, "iterate");
  CHECK(iterates == whole.at("optimizer").at("iterations").get<long>() + 1);
  for (const double part : {0.15, 0.93}) {
    INFO(part);
    fs::remove(out / "optimized.json");
    write_text(out / kJournalFile,
               journal.substr(0, std::max(journal.find('\n') + 1,
                                          static_cast<std::size_t>(part * static_cast<double>(journal.size())))));
    const CommandOutcome outcome = run_command({"resume", out.string()});
    INFO(outcome.err);
    REQUIRE(outcome.exit_code == kDone);
    CHECK(outcome_of(out) == whole);
    CHECK(content_of(out / "history.csv") == history);
    CHECK(journal_lines(out, "iterate") == iterates);  // each once
    CHECK(fs::exists(out / "optimized.json"));
  }
}

TEST_CASE("resume: a run that was interrupted keeps its best and goes on", "[resume]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  // Simulations that take a while, so that the signal comes within one.
  const Arguments slow{
      "--threads", "2", "--set", "simulation.integrator.max_step=2e-3", "--set", "design.multistart.starts=4"};
  REQUIRE(design(file, folder.file("whole"), slow).exit_code == kDone);
  const fs::path out = folder.path / "out";
  const int signal = GENERATE(SIGTERM, SIGHUP, SIGPIPE);
  std::thread killer([&] {
    for (int i = 0; i < 3000 && !(fs::exists(out / kJournalFile) && journal_lines(out, "start") >= 1); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ::kill(::getpid(), signal);
  });
  const CommandOutcome outcome = design(file, out.string(), slow);
  killer.join();
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == kInterrupted);
  CHECK_THAT(outcome.err, Contains("mbsopt resume"));
  const auto part = json_of(out / "result.json");
  CHECK(part.at("status") == "interrupted");
  CHECK(fs::exists(out / "optimized.json"));
  CHECK(part.at("optimizer").at("objective_final") <= part.at("optimizer").at("objective_initial"));
  REQUIRE(run_command({"resume", out.string()}).exit_code == kDone);
  CHECK(outcome_of(out) == outcome_of(folder.path / "whole"));
}

TEST_CASE("a multistart that is interrupted gives the best of its waterfall", "[multistart]") {
  const TemporaryFolder folder;
  std::string text = kSwingingRod;
  const bool tracked = GENERATE(false, true);
  if (tracked) {  // solved runs
    text.replace(text.find("\"joints\""), 0, R"x("drives": [{"name": "motor", "type": "angle", "joint": "pin",
      "law": "0.02*k + free*sin(3*t)"}], )x");
    text.replace(text.find("{\"running\""), std::string::npos, R"({"track": [{"sensor": "tip_y", "file": "wish.csv",
      "column": "y"}]}}, "design": {"minimize": "track", "variables": ["k", "free"],
      "optimizer": {"type": "least_squares"}, "multistart": {"starts": 4000, "seed": 5}}})");
    std::string wish = "t,y\n";
    for (int i = 0; i <= 10; ++i)
      wish += std::to_string(0.1 * i) + "," + std::to_string(0.4 * std::sin(0.25 * i)) + "\n";
    folder.write("wish.csv", wish);
  }
  const std::string file = folder.write("rod.json", text);
  const fs::path out = folder.path / "out";
  Arguments arguments{"design", file, "--out", out.string(), "--threads", "2"};
  if (!tracked) arguments.insert(arguments.end(), {"--set", "simulation.integrator.max_step=1e-3"});
  kill_at(arguments, out, "start", tracked ? 20 : 2, SIGINT);
  const auto result = json_of(out / "result.json");
  REQUIRE(result.at("status") == "interrupted");
  const auto& best = result.at("multistart").at("waterfall").at(0);
  CHECK(result.at("objectives").at("track").at("value") == best.at("objective"));
  CHECK(result.at("optimizer").at("objective_final") == best.at("objective"));
  for (const auto& [name, value] : best.at("parameters").items())
    CHECK(result.at("parameters").at(name).at("value") == value);
  std::vector<std::string> again{"simulate", (out / "optimized.json").string(), "--out", folder.file("again")};
  if (!tracked) again.insert(again.end(), {"--set", "simulation.integrator.max_step=1e-3"});
  REQUIRE(run_command(again).exit_code == kDone);
  CHECK(json_of(folder.path / "again/result.json").at("objectives").at("track").at("value").get<double>() ==
        Approx(best.at("objective").get<double>()).epsilon(1e-9));
}

TEST_CASE("a design of load cases that is interrupted gives the values of its best design in each", "[multistart]") {
  const TemporaryFolder folder;
  std::string text = kSwingingRod;
  const std::size_t at = text.find("{\"running\"");  // an extreme takes another run for its true value
  text.replace(at, text.find("}},", at) - at, R"({"maximum_of": "(tip_y + 0.2*sin(5*t))^2", "sharpness": 40)");
  text.replace(text.find("\"design\""), std::string::npos, R"("cases": [{"name": "light", "overrides": {"k": "0.8*k"}},
    {"name": "short", "end_time": 0.7}], "design": {"minimize": "track", "variables": ["k", "free"]}})");
  const fs::path out = folder.path / "out";
  kill_at(
      {"design", folder.write("rod.json", text), "--out", out.string(), "--set", "simulation.integrator.max_step=1e-3"},
      out, "iterate", 4, SIGINT);
  const auto result = json_of(out / "result.json");
  REQUIRE(result.at("status") == "interrupted");
  REQUIRE(run_command({"simulate", (out / "optimized.json").string(), "--out", folder.file("again"), "--set",
                       "simulation.integrator.max_step=1e-3"})
              .exit_code == kDone);
  const auto again = json_of(folder.path / "again/result.json");
  for (const char* name : {"light", "short"}) {
    const auto& track = result.at("cases").at(name).at("objectives").at("track");
    CHECK(track.at("value") != track.at("initial"));
    CHECK(track.at("value").get<double>() ==
          Approx(again.at("cases").at(name).at("objectives").at("track").at("true_value").get<double>()).epsilon(1e-9));
  }
}

// An arm of 0.6 m that begins at angle a and swings on. The mirrored design passes the same heights another way.
TEST_CASE("optima that differ by whole turns are one, mirrored ones are two", "[multistart]") {
  const TemporaryFolder folder;
  const auto [miss, optima] =
      GENERATE(table<std::string, std::size_t>({{"(x+0.36)^2 + (y-0.48)^2", 1}, {"(x+0.36)^2", 2}}));
  const std::string file = folder.write("arm.json", R"({"format": 1, "name": "arm", "gravity": [0, -9.81, 0],
    "parameters": {"a": {"value": 0.4, "lower": -6, "upper": 2.9, "unit": "rad"}},
    "bodies": [{"name": "arm", "mass": 3, "inertia": [0.1, 0.1, 0.2], "points": {"tip": [0.6, 0, 0]}}],
    "joints": [{"name": "pin", "type": "revolute", "body2": "arm", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}],
    "drives": [{"name": "motor", "type": "angle", "joint": "pin", "law": "a + 0.3*t^2"}],
    "sensors": {"x": {"quantity": "position", "body": "arm", "point": "tip", "component": "x"},
                "y": {"quantity": "position", "body": "arm", "point": "tip", "component": "y"}},
    "simulation": {"end_time": 0.5}, "objectives": {"miss": {"samples": [{"time": 0, "value": ")" +
                                                        miss + R"("}]}},
    "design": {"minimize": "miss", "variables": ["a"], "multistart": {"starts": 14, "seed": 4}}})");
  REQUIRE(design(file, folder.file("out")).exit_code == kDone);
  const auto result = json_of(folder.path / "out/result.json").at("multistart");
  CHECK(result.at("optima").size() == optima);
  std::set<long> turns;
  for (const auto& record : result.at("waterfall"))
    turns.insert(std::lround(10 * record.at("parameters").at("a").get<double>()));
  CHECK(turns.size() > optima);
}

TEST_CASE("more starts than a machine can run are refused before anything runs", "[multistart]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  for (const char* command : {"validate", "design"}) {
    const CommandOutcome outcome =
        run_command({command, file, "--out", folder.file("out"), "--set", "design.multistart.starts=40000000"});
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains("design.multistart.starts: is 40000000, at most 1000000"));
  }
}

TEST_CASE("resume refuses what it cannot go on with", "[resume]") {
  const TemporaryFolder folder;
  CommandOutcome outcome = run_command({"resume", folder.path.string()});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("journal.jsonl: there is none"));

  const std::string file = folder.write("rod.json", kSwingingRod);
  const fs::path out = folder.path / "out";
  for (const bool keep : {false, true}) {
    Arguments arguments{"--set", "design.multistart.starts=2"};
    if (keep) arguments.push_back("--keep-journal");
    REQUIRE(design(file, out.string(), arguments).exit_code == kDone);
    CHECK(fs::exists(out / kJournalFile) == keep);
    outcome = run_command({"resume", out.string()});
    CHECK(outcome.exit_code == kDone);
    CHECK_THAT(outcome.out, Contains("its 'design' is finished (ok)"));
  }
  // A journal that ends, beside results of a run that does not, goes on.
  auto running = json_of(out / "result.json");
  running["status"] = "running";
  write_text(out / "result.json", running.dump());
  fs::remove(out / "optimized.json");
  CHECK(run_command({"resume", out.string()}).exit_code == kDone);
  CHECK(fs::exists(out / "optimized.json"));

  std::vector<std::string> lines = lines_of(out / kJournalFile);
  write_text(out / kJournalFile, lines[0] + "\n" + lines[1] + "\n");
  folder.write("rod.json", std::string(kSwingingRod) + "\n");
  outcome = run_command({"resume", out.string()});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("another content of the problem file") && Contains("anew"));
  write_text(out / kJournalFile, "{\"a\": 1}\n");
  CHECK_THAT(run_command({"resume", out.string()}).err, Contains("no journal of this version"));
}

TEST_CASE("multistart: identify fits from several starts, the same with any number of workers, killed or not",
          "[multistart]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  const std::string file = write_swing_fit(folder);
  REQUIRE(run_command({"identify", file, "--out", folder.file("one"), "--threads", "1"}).exit_code == kDone);
  const auto one = outcome_of(folder.path / "one");
  CHECK(one.at("parameters").at("k").at("value").get<double>() == Approx(20).epsilon(1e-4));
  CHECK(one.at("parameters").at("k").at("initial") == 60);
  CHECK(one.at("multistart").at("waterfall").size() == 5);
  const double best = one.at("multistart").at("waterfall").at(0).at("objective");
  CHECK(one.at("optimizer").at("objective_final").get<double>() <= best * (1 + 1e-9) + 1e-12);

  REQUIRE(run_command({"identify", file, "--out", folder.file("three"), "--threads", "3"}).exit_code == kDone);
  CHECK(outcome_of(folder.path / "three") == one);

  const fs::path killed = folder.path / "killed";
  kill_at({"identify", file, "--out", killed.string(), "--threads", "2", "--keep-journal"}, killed, "start", 2);
  const bool was_done = journal_lines(killed, "ended") > 0;
  REQUIRE(run_command({"resume", killed.string()}).exit_code == kDone);
  CHECK(journal_lines(killed, "start") == 5);
  if (!was_done) CHECK(content_of(killed / "residuals.csv") == content_of(folder.path / "one/residuals.csv"));
}

TEST_CASE("resume: an identification that was interrupted between its starts goes on", "[resume]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  const std::string file = write_swing_fit(folder);
  const Arguments slow{"--threads", "2", "--set", "simulation.integrator.max_step=1e-3"};
  const auto identify = [&](const fs::path& out) {
    Arguments arguments{"identify", file, "--out", out.string()};
    arguments.insert(arguments.end(), slow.begin(), slow.end());
    return run_command(arguments);
  };
  REQUIRE(identify(folder.path / "whole").exit_code == kDone);
  const fs::path out = folder.path / "out";
  std::thread killer([&] {
    for (int i = 0; i < 6000 && !(fs::exists(out / kJournalFile) && journal_lines(out, "start") >= 1); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ::kill(::getpid(), SIGTERM);
  });
  const CommandOutcome outcome = identify(out);
  killer.join();
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == kInterrupted);
  const auto part = json_of(out / "result.json");
  CHECK(part.at("status") == "interrupted");
  CHECK_THAT(outcome.err, Contains("holds the best of the starts so far"));
  const auto& best = part.at("multistart").at("waterfall").at(0);
  for (const auto& [name, value] : best.at("parameters").items()) {
    CHECK(part.at("parameters").at(name).at("value").get<double>() == Approx(value.get<double>()).epsilon(1e-12));
    CHECK(json_of(out / "optimized.json").at("parameters").at(name).at("value") ==
          part.at("parameters").at(name).at("value"));
  }
  CHECK(part.at("parameters").at("k").at("initial") == 60);
  CHECK(part.at("optimizer").at("objective_final").is_null());
  CHECK_THAT(content_of(out / "report.html"), Contains("interrupted"));
  REQUIRE(run_command({"resume", out.string()}).exit_code == kDone);
  CHECK(outcome_of(out) == outcome_of(folder.path / "whole"));
}

namespace {

std::string single_fit(const TemporaryFolder& folder) {
  std::string text = fit_problem();
  const std::string multistart = ",\n      \"multistart\": {\"starts\": 5, \"seed\": 2}";
  text.erase(text.find(multistart), multistart.size());
  text.replace(text.find("\"k\": {\"value\": 60"), 17, "\"k\": {\"value\": 25");
  folder.write("swing.csv", swing_csv(folder));
  return folder.write("fit.json", text);
}

}  // namespace

TEST_CASE("resume: a single identification is repeated, wherever its journal was cut off", "[resume]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  const std::string file = single_fit(folder);
  const fs::path out = folder.path / "out";
  REQUIRE(run_command({"identify", file, "--out", out.string(), "--keep-journal"}).exit_code == kDone);
  const auto whole = outcome_of(out);
  const std::vector<std::string> files{"history.csv", "residuals.csv", "optimized.json"};
  std::vector<std::string> contents;
  for (const std::string& name : files) contents.push_back(content_of(out / name));
  const std::string journal = content_of(out / kJournalFile);
  const long simulations = json_of(out / "result.json").at("optimizer").at("simulations");
  const long iterates = journal_lines(out, "iterate");
  CHECK(iterates == whole.at("optimizer").at("iterations").get<long>() + 1);
  for (const double part : {0.02, 0.3, 0.9}) {
    INFO(part);
    for (const std::string& name : files) fs::remove(out / name);
    write_text(out / kJournalFile,
               journal.substr(0, std::max(journal.find('\n') + 1,
                                          static_cast<std::size_t>(part * static_cast<double>(journal.size())))));
    const CommandOutcome outcome = run_command({"resume", out.string()});
    INFO(outcome.err);
    REQUIRE(outcome.exit_code == kDone);
    CHECK(outcome_of(out) == whole);
    CHECK(json_of(out / "result.json").at("optimizer").at("simulations") == simulations);
    for (std::size_t i = 0; i < files.size(); ++i) CHECK(content_of(out / files[i]) == contents[i]);
    CHECK(journal_lines(out, "iterate") == iterates);
  }
}

TEST_CASE("resume: an identification that is interrupted within its first simulation has nothing yet, and says so",
          "[resume]") {
  const TemporaryFolder folder;
  const std::string file = single_fit(folder);
  const fs::path out = folder.path / "out";
  std::thread killer([&] {
    for (int i = 0; i < 3000 && !fs::exists(out / kJournalFile); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ::kill(::getpid(), SIGINT);
  });
  const CommandOutcome outcome = run_command(
      {"identify", file, "--out", out.string(), "--set", "simulation.integrator.max_step=1e-5"});  // takes seconds
  killer.join();
  INFO(outcome.err);
  CHECK(outcome.exit_code == kInterrupted);
  CHECK_THAT(outcome.err, Contains("mbsopt resume"));
  CHECK(json_of(out / "result.json").at("status") == "interrupted");
  CHECK(journal_lines(out, "iterate") == 0);
}

TEST_CASE("multistart: simulations and seconds are those of all starts, after a resumption too", "[multistart]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  const bool designs = GENERATE(true, false);
  const std::string command = designs ? "design" : "identify";
  const std::string file = designs ? folder.write("rod.json", kSwingingRod) : write_swing_fit(folder);
  const CommandOutcome outcome = run_command({command, file, "--out", folder.file("out"), "--keep-journal"});
  REQUIRE(outcome.exit_code == kDone);
  const auto check = [&] {
    const auto result = json_of(folder.path / "out/result.json");
    long simulations = 0;
    double seconds = 0;
    for (const auto& start : result.at("multistart").at("waterfall")) {
      CHECK(start.at("simulations").get<long>() > 0);
      simulations += start.at("simulations").get<long>(), seconds += start.at("wall_seconds").get<double>();
    }
    CHECK(result.at("multistart").at("simulations") == simulations);
    // An identification fits once more, from the best start.
    const auto& optimizer = result.at("optimizer");
    CHECK(
        (designs ? optimizer.at("simulations") == simulations : optimizer.at("simulations").get<long>() > simulations));
    CHECK((designs ? optimizer.at("wall_seconds") == seconds : optimizer.at("wall_seconds").get<double>() > seconds));
    return result.at("optimizer").at("simulations").get<long>();
  };
  const long whole = check();
  CHECK_THAT(outcome.out, Contains(std::to_string(whole) + " simulations, ") &&
                              Contains(designs ? "in all 8 starts" : "in all 5 starts"));
  std::vector<std::string> lines = lines_of(folder.path / "out" / kJournalFile);
  const auto is_start = [](const std::string& line) { return line.starts_with("{\"start\":"); };
  const auto fourth = std::find_if(lines.begin() + 4, lines.end(), is_start);
  REQUIRE(fourth != lines.end());
  std::string journal;
  for (auto line = lines.begin(); line != fourth; ++line) journal += *line + "\n";
  write_text(folder.path / "out" / kJournalFile, journal);
  REQUIRE(run_command({"resume", folder.file("out")}).exit_code == kDone);
  CHECK(check() == whole);
}

TEST_CASE("multistart: starts with sigmas of their own are ranked by the likelihood", "[multistart]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  write_swing_fit(folder);
  std::string text = fit_problem();
  text.replace(text.find("\"sigma\": 0.01"), 13, "\"sigma\": 0.01, \"estimate_sigma\": true");
  REQUIRE(run_command({"identify", folder.write("own.json", text), "--out", folder.file("own")}).exit_code == kDone);
  const auto result = outcome_of(folder.path / "own");
  CHECK(result.at("parameters").at("k").at("value").get<double>() == Approx(20).epsilon(1e-3));
  const auto& waterfall = result.at("multistart").at("waterfall");
  CHECK(waterfall.at(0).at("parameters").at("k").get<double>() == Approx(20).epsilon(1e-3));
  for (const auto& record : waterfall) {
    if (record.at("objective").is_null() || record.at("parameters").at("k").get<double>() == Approx(20).epsilon(0.01))
      continue;  // a start that failed, or found the same
    CHECK(waterfall.at(0).at("objective").get<double>() < record.at("objective").get<double>() - 10);
  }
}

namespace {

// Two experiments, whose data have one base name.
std::string two_records(const TemporaryFolder& folder) {
  const std::string csv = swing_csv(folder);
  fs::create_directories(folder.path / "a"), fs::create_directories(folder.path / "b");
  folder.write("a/r.csv", csv), folder.write("b/r.csv", csv);
  nlohmann::json problem = nlohmann::json::parse(content_of(single_fit(folder)));
  nlohmann::json& experiments = problem["identification"]["experiments"];
  experiments.push_back(experiments[0]);
  experiments[0]["data"] = "a/r.csv", experiments[0]["name"] = "first";
  experiments[1]["data"] = "b/r.csv", experiments[1]["name"] = "second";
  return folder.write("fit.json", problem.dump(2));
}

}  // namespace

TEST_CASE("resume refuses changed data also where two files have one base name", "[resume]") {
  const TemporaryFolder folder;
  const std::string file = two_records(folder);
  const fs::path out = folder.path / "out";
  REQUIRE(run_command({"identify", file, "--out", out.string(), "--keep-journal"}).exit_code == kDone);
  const std::vector<std::string> lines = lines_of(out / kJournalFile);
  for (const std::string data : {"a/r.csv", "b/r.csv"}) {
    const std::string before = content_of(folder.path / data);
    write_text(out / kJournalFile, lines[0] + "\n" + lines[1] + "\n");
    folder.write(data, before + "1.05,0.1\n");
    const CommandOutcome outcome = run_command({"resume", out.string()});
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains("another content of a data file"));
    folder.write(data, before);
  }
  CHECK(run_command({"resume", out.string()}).exit_code == kDone);
}

TEST_CASE("resume: results that could not be written are written when there is room again", "[resume]") {
  const TemporaryFolder folder;
  const bool fit = GENERATE(false, true);
  const std::string command = fit ? "identify" : "design";
  const std::string file = fit ? single_fit(folder) : folder.write("rod.json", kSwingingRod);
  REQUIRE(run_command({command, file, "--out", folder.file("whole")}).exit_code == kDone);
  const fs::path out = folder.path / "out";
  REQUIRE(run_command({"validate", file, "--out", out.string()}).exit_code == kDone);
  fs::create_directory(out / "optimized.json");  // no file can take its place
  const CommandOutcome failed = run_command({command, file, "--out", out.string()});
  CHECK(failed.exit_code == kNumericalFailure);
  CHECK_THAT(failed.err, Contains("optimized.json: cannot be put into place") && Contains("mbsopt resume"));
  CHECK(json_of(out / "result.json").at("status") == "failed");
  fs::remove(out / "optimized.json");
  const CommandOutcome resumed = run_command({"resume", out.string()});
  INFO(resumed.err);
  CHECK(resumed.exit_code == kDone);
  CHECK(outcome_of(out) == outcome_of(folder.path / "whole"));
  CHECK(content_of(out / "optimized.json") == content_of(folder.path / "whole/optimized.json"));
}

TEST_CASE("a damaged journal is refused in words, whatever the line", "[resume]") {
  const TemporaryFolder folder;
  const fs::path out = folder.path / "out";
  REQUIRE(design(folder.write("rod.json", kPendulum), out.string(), {"--keep-journal"}).exit_code == kDone);
  const std::string journal = content_of(out / kJournalFile);
  for (const auto& [good, bad] :
       std::vector<std::pair<std::string, std::string>>{{"\"objective\":", "\"objective\":1"},
                                                        {"{\"iterate", "{\"start"},
                                                        {"\"parameters\":{", "\"parameters\":{\"a\":1,"}}) {
    std::string damaged = journal;
    INFO(good);
    REQUIRE(damaged.find(good) != std::string::npos);
    damaged.replace(damaged.find(good), good.size(), bad);
    write_text(out / kJournalFile, damaged);
    const CommandOutcome outcome = run_command({"resume", out.string()});
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains("journal.jsonl: line 2 is damaged"));
  }
}

TEST_CASE("the rule of Boender and Rinnooy Kan", "[multistart]") {
  CHECK_FALSE(SearchedOptima{3, 1}.expected());
  CHECK(*SearchedOptima{10, 2}.expected() == Approx(2 * 9. / 6));
  CHECK_FALSE(SearchedOptima{10, 2}.all_found());
  CHECK(SearchedOptima{20, 2}.all_found());  // 2.375
  CHECK(SearchedOptima{10, 2}.covered() == Approx(7 * 12. / 90));
}

namespace {

Json ended_at(int start, double k, const char* status = "converged") {
  return {{"start", start}, {"status", status}, {"objective", k}, {"parameters", {{"k", k}}}};
}

}  // namespace

TEST_CASE("optima of a parameter with a logarithmic scale differ by their ratio", "[multistart]") {
  Scene scene;
  scene.parameters.push_back({"k", 100, 1.0, 1e4, ParameterScale::log});
  const std::vector<Json> ranked{ended_at(0, 2), ended_at(1, 2.001), ended_at(2, 6), ended_at(3, 3000)};
  const std::vector<DistinctOptimum> optima = distinct_optima(ranked, scene);
  REQUIRE(optima.size() == 3);
  CHECK(optima[0].starts == 2);
}

TEST_CASE("an assembly mode in which few searches converge keeps the search from its end", "[multistart]") {
  Scene scene;
  scene.parameters.push_back({"k", 100, 1.0, 1e4, ParameterScale::linear});
  std::vector<Json> ranked;
  for (int i = 0; i < 20; ++i) ranked.push_back(ended_at(i, 7));
  CHECK(all_found(ranked, scene));
  for (Json& record : ranked) record["assembly_mode"] = {{"mode", 0}, {"of", 2}};
  CHECK(all_found(ranked, scene));
  for (int i = 20; i < 40; ++i) {
    ranked.push_back(ended_at(i, 9, "no_progress"));
    ranked.back()["assembly_mode"] = {{"mode", 1}, {"of", 2}};
  }
  CHECK_FALSE(all_found(ranked, scene));
}

namespace {

constexpr const char* kThreeOptima = R"({
  "parameters": {"g": {"value": 1.2, "lower": 0, "upper": 6}},
  "bodies": [{"name": "b", "mass": 1, "inertia": [1, 1, 1]}],
  "objectives": {"o": {"parameters_only": "cos(pi*g) + 0.01*g"}},
  "design": {"minimize": "o", "variables": ["g"],
             "multistart": {"starts": 100, "seed": 1, "until": "all_found"}}})";

}  // namespace

TEST_CASE("until all_found: starts end when no other optimum is expected, for any number of workers", "[multistart]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("three.json", kThreeOptima);
  nlohmann::json first;
  for (const std::string workers : {"1", "3"}) {
    const CommandOutcome outcome = design(file, folder.file(workers), {"--threads", workers});
    INFO(outcome.out << outcome.err);
    REQUIRE(outcome.exit_code == kDone);
    const nlohmann::json multistart = outcome_of(folder.path / workers).at("multistart");
    if (first.is_null()) first = multistart;
    CHECK(multistart == first);
    CHECK(multistart.at("all_found") == true);
    CHECK(multistart.at("finished").get<int>() < 100);
    CHECK(multistart.at("finished").get<int>() % 20 == 0);
    const auto& optima = multistart.at("optima");
    REQUIRE(!optima.empty());
    CHECK(optima.at(0).at("start") == multistart.at("best"));
    CHECK(optima.at(0).at("found_by") == multistart.at("at_the_best_optimum"));
    CHECK(multistart.at("expected_optima").get<double>() < static_cast<double>(optima.size()) + 0.5);
    CHECK_THAT(outcome.out, Contains("found by") && Contains("are expected in all") && Contains("the search ends"));
  }
}

TEST_CASE("resume: until all_found ends where it would have, whatever starts the journal knows", "[multistart]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("three.json", kThreeOptima);
  const fs::path out = folder.path / "out";
  REQUIRE(design(file, out.string(), {"--keep-journal"}).exit_code == kDone);
  const nlohmann::json whole = outcome_of(out);
  REQUIRE(whole.at("multistart").at("finished") == 40);  // three optima: the rule does not hold after 20, but after 30
  const std::string journal = content_of(out / kJournalFile);
  std::size_t end = 0;
  for (int line = 0; line < 31; ++line) end = journal.find('\n', end) + 1;
  write_text(out / kJournalFile, journal.substr(0, end));
  REQUIRE(journal_lines(out, "start") == 30);
  const CommandOutcome outcome = run_command({"resume", out.string()});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  CHECK(outcome_of(out) == whole);
}
