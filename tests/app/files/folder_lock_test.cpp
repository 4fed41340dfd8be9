#include "app/files/folder_lock.hpp"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <memory>
#include <thread>

#include "app/files/atomic_file.hpp"
#include "app/run/output_folder.hpp"
#include "app/terminal/exit_code.hpp"
#include "optim/machine/process_pool.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;
namespace fs = std::filesystem;

TEST_CASE("a folder is written into by one command at a time", "[output]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum), out = folder.file("out");
  fs::create_directory(out);
  {
    const FolderLock lock(out);
    CHECK(lock.held());
    const CommandOutcome outcome = run_command({"simulate", file, "--out", out});
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains("another mbsopt is writing"));
    CHECK(fs::is_empty(out));
  }
  CHECK(run_command({"simulate", file, "--out", out}).exit_code == kDone);
}

TEST_CASE("a worker holds no lock: the folder is free when the run has ended, however it ended", "[output]") {
  const TemporaryFolder folder;
  auto lock = std::make_unique<FolderLock>(folder.path);
  ProcessPool pool(1, [](int) {
    ::pause();
    return std::string();
  });
  REQUIRE(pool.start(0));
  lock.reset();
  bool is_free = false;
  for (int i = 0; i < 1000 && !is_free; ++i) {  // the worker needs a moment to begin
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    try {
      const FolderLock again(folder.path);
      is_free = true;
    } catch (const OutputError&) {
      continue;
    }
  }
  CHECK(is_free);
}

TEST_CASE("who claims a folder removes what killed runs left of files, and nothing else", "[output]") {
  const TemporaryFolder folder;
  const std::string problem = folder.write("a.json", "{}");
  const OutputFolder out(folder.file("out"), "a", problem, "simulate");
  const fs::path parts[] = {out.path() / ".result.json.12.part", out.path() / ".journal.jsonl.7.part"};
  const fs::path others[] = {out.path() / ".mine.12.part", out.path() / ".result.json.x.part",
                             out.path() / ".result.json..part"};
  for (const fs::path& file : parts) std::ofstream(file) << "half";
  for (const fs::path& file : others) std::ofstream(file) << "mine";
  const auto lock = out.claim();
  for (const fs::path& file : parts) CHECK_FALSE(fs::exists(file));
  for (const fs::path& file : others) CHECK(fs::exists(file));
}
