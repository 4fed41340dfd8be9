// The program under mpirun. Compiled where it is built with MPI.
#include "app/starts/ranks.hpp"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "app/files/journal.hpp"
#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"
#include "tests/app/swinging_rod.hpp"

using namespace mbsopt;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

struct Finished {
  int exit_code;
  std::string out, err;
};

// mpirun -n ranks mbsopt arguments, in its own session, as from a terminal of its own. Ranks that wait leave the
// processor to others: the tests run in parallel.
pid_t started(int ranks, const std::vector<std::string>& arguments, const TemporaryFolder& folder) {
  std::vector<std::string> words{
      MBSOPT_MPIRUN, "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "--mca", "mpi_yield_when_idle", "1",
      "-n",          std::to_string(ranks), MBSOPT_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t process = ::fork();
  if (process != 0) return process;
  ::setsid();
  if (!std::freopen(folder.file("out.txt").c_str(), "w", stdout) ||
      !std::freopen(folder.file("err.txt").c_str(), "w", stderr))
    ::_exit(126);
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

Finished finished(pid_t process, const TemporaryFolder& folder) {
  int status = 0;
  ::waitpid(process, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), content_of(folder.path / "out.txt"),
          content_of(folder.path / "err.txt")};
}

Finished mpirun(int ranks, const std::vector<std::string>& arguments, const TemporaryFolder& folder) {
  return finished(started(ranks, arguments, folder), folder);
}

void wait_for_starts(const fs::path& folder, long count) {
  for (int i = 0; i < 6000 && !(fs::exists(folder / kJournalFile) && journal_lines(folder, "start") >= count); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
}

// Processes that one of the threads of the given one has started, the oldest first.
std::vector<pid_t> children_of(pid_t parent) {
  std::vector<pid_t> children;
  for (const fs::directory_entry& task : fs::directory_iterator("/proc/" + std::to_string(parent) + "/task")) {
    std::ifstream in(task.path() / "children");
    for (pid_t child = 0; in >> child;) children.push_back(child);
  }
  std::sort(children.begin(), children.end());
  return children;
}

// State T in /proc/PID/stat, after the name in brackets.
bool is_stopped(pid_t process) {
  std::ifstream in("/proc/" + std::to_string(process) + "/stat");
  std::string stat;
  std::getline(in, stat);
  const std::size_t name = stat.rfind(')');
  return name != std::string::npos && name + 2 < stat.size() && stat[name + 2] == 'T';
}

}  // namespace

TEST_CASE("mpirun: two ranks design what one worker does, bit by bit, and only one of them speaks", "[mpi]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  const CommandOutcome one = run_command({"design", file, "--out", folder.file("one"), "--threads", "1"});
  REQUIRE(one.exit_code == kDone);
  const Finished two = mpirun(2, {"design", file, "--out", folder.file("two"), "--keep-journal"}, folder);
  INFO(two.err);
  REQUIRE(two.exit_code == kDone);
  CHECK(outcome_of(folder.path / "two") == outcome_of(folder.path / "one"));
  for (const char* name : {"history.csv", "trajectory.csv", "optimized.json"})
    CHECK(content_of(folder.path / "two" / name) == content_of(folder.path / "one" / name));
  CHECK(journal_lines(folder.path / "two", "start") == 8);
  const std::string waterfall = "8 starts, seed 11";
  CHECK(two.out.find(waterfall) != std::string::npos);
  CHECK(two.out.find(waterfall) == two.out.rfind(waterfall));
}

TEST_CASE("mpirun: two ranks identify what one worker does, bit by bit", "[mpi]") {
  const TemporaryFolder folder;
  const std::string file = write_swing_fit(folder);
  REQUIRE(run_command({"identify", file, "--out", folder.file("one"), "--threads", "1"}).exit_code == kDone);
  const Finished two = mpirun(2, {"identify", file, "--out", folder.file("two")}, folder);
  INFO(two.err);
  REQUIRE(two.exit_code == kDone);
  CHECK(outcome_of(folder.path / "two") == outcome_of(folder.path / "one"));
  CHECK(content_of(folder.path / "two/residuals.csv") == content_of(folder.path / "one/residuals.csv"));
}

TEST_CASE("mpirun: two ranks sweep what one worker does, bit by bit", "[mpi]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  const std::string points = folder.write("points.csv", "free,k\n0.3,10\n0.4,20\n0.5,30\n0.6,40\n0.7,50\n");
  const auto sweep = [&](const std::string& out) {
    return std::vector<std::string>{"sweep", file, "--points", points, "--gradients", "--out", folder.file(out)};
  };
  REQUIRE(run_command(sweep("one")).exit_code == kDone);
  const Finished two = mpirun(2, sweep("two"), folder);
  INFO(two.err);
  REQUIRE(two.exit_code == kDone);
  CHECK(content_of(folder.path / "two/sweep.csv") == content_of(folder.path / "one/sweep.csv"));
}

TEST_CASE("mpirun: bad input is said once, and other commands run as ever", "[mpi]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  const Finished bad = mpirun(2, {"design", file, "--out", folder.file("bad"), "--set", "bodies[0].mass=-1"}, folder);
  CHECK(bad.exit_code == kBadInput);
  CHECK_THAT(bad.err, Contains("bodies[0].mass"));
  CHECK(bad.err.find("bodies[0].mass") == bad.err.rfind("bodies[0].mass"));
  CHECK(mpirun(2, {"simulate", file, "--out", folder.file("motion")}, folder).exit_code == kDone);
  CHECK(fs::exists(folder.path / "motion/trajectory.csv"));
}

TEST_CASE("mpirun: Ctrl-C, and the loss of a rank, leave what resume goes on with, to the same end", "[mpi]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kSwingingRod);
  const auto design = [&](const fs::path& out) {
    return std::vector<std::string>{"design",
                                    file,
                                    "--out",
                                    out.string(),
                                    "--keep-journal",
                                    "--set",
                                    "design.multistart.starts=12",
                                    "--set",
                                    "simulation.integrator.max_step=0.001"};
  };
  REQUIRE(run_command(design(folder.path / "whole")).exit_code == kDone);
  for (const bool lose_a_rank : {false, true}) {
    INFO(lose_a_rank);
    const fs::path out = folder.path / (lose_a_rank ? "lost" : "stopped");
    const pid_t process = started(3, design(out), folder);
    wait_for_starts(out, 1);
    const std::vector<pid_t> ranks = children_of(process);
    // They could be done before mpirun passes a signal on; it wakes them when it does.
    for (const pid_t rank : ranks) ::kill(rank, SIGSTOP);
    CHECK(ranks.size() == 3);
    ::kill(lose_a_rank ? ranks.back() : process, lose_a_rank ? SIGKILL : SIGINT);
    for (int i = 0; i < 1000 && std::any_of(ranks.begin(), ranks.end(), is_stopped); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    for (const pid_t rank : ranks) ::kill(rank, SIGCONT);
    const Finished ended = finished(process, folder);
    INFO(ended.err);
    CHECK(ended.exit_code != kDone);
    CHECK(journal_lines(out, "start") < 12);
    if (!lose_a_rank) {
      CHECK(json_of(out / "result.json").at("status") == "interrupted");
      CHECK(fs::exists(out / "optimized.json"));
    }
    const Finished resumed = mpirun(2, {"resume", out.string()}, folder);
    INFO(resumed.err);
    REQUIRE(resumed.exit_code == kDone);
    CHECK(journal_lines(out, "start") == 12);
    CHECK(outcome_of(out) == outcome_of(folder.path / "whole"));
  }
}

TEST_CASE("outside of mpirun there are no ranks", "[mpi]") { CHECK(mpi_ranks() == nullptr); }
