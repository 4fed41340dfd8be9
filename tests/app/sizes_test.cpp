// Commands on large problems take time that grows with the size, not with its square. Processor time is compared with
// that of a quarter of the size: linear growth gives 4, quadratic 16.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <ctime>

#include "app/json/input_error.hpp"
#include "app/json/read_problem.hpp"
#include "app/terminal/exit_code.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/start/assembly.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/app/run_command.hpp"
#include "tests/core/linear/dense_redundancy.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

constexpr int kSize = 1000;
constexpr double kMostGrowth = 8;  // for four times the size

// The lesser of two runs, which the rest of the machine disturbed less.
template <class F>
double seconds(F&& run) {
  double least = 1e300;
  for (int i = 0; i < 2; ++i) {
    const std::clock_t start = std::clock();
    run();
    least = std::min(least, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  return least;
}

template <class F>
void check_growth(F&& run, int size) {
  const double small = seconds([&] { run(size); }), large = seconds([&] { run(4 * size); });
  INFO(small << " s, then " << large << " s");
  CHECK(large < kMostGrowth * small);
}

enum class Layout { chain, ladder, free };

// Rods of 1 m in x-y, named r0, r1, ...; of a ladder the even ones stand on the ground, joined by the odd ones.
// last_inertia: of the last rod, about the joints' axis.
std::string scene(Layout layout, int bodies, const char* last_mass = "m", double last_inertia = 0.1) {
  std::string rods, joints;
  const auto hinge = [&](int b1, int b2, double x1, double y1, double x2, double y2) {
    joints += fmt::format(R"({}{{"name": "h{}", "type": "revolute", "body1": "{}", "body2": "r{}",)"
                          R"("point1": [{}, {}, 0], "point2": [{}, {}, 0], "axis1": [0, 0, 1], "axis2": [0, 0, 1]}})",
                          joints.empty() ? "" : ",", std::count(joints.begin(), joints.end(), '{'),
                          b1 < 0 ? "ground" : fmt::format("r{}", b1), b2, x1, y1, x2, y2);
  };
  for (int i = 0; i < bodies; ++i) {
    const bool upright = layout == Layout::ladder && i % 2 == 0;
    const double x = layout == Layout::ladder ? i / 2 + (upright ? 0 : 0.5) : i + 0.5, y = upright ? 0.5 : 1;
    rods += fmt::format(R"({}{{"name": "r{}", "mass": "{}", "inertia": [0.1, 0.1, {}], "position": [{}, {}, 0]}})",
                        i == 0 ? "" : ",", i, i + 1 == bodies ? last_mass : "m", i + 1 == bodies ? last_inertia : 0.1,
                        x, y);
    if (layout == Layout::chain) hinge(i - 1, i, i == 0 ? 0 : 0.5, i == 0 ? 1 : 0, -0.5, 0);
    if (layout != Layout::ladder) continue;
    if (upright) hinge(-1, i, x, 0, 0, -0.5);
    if (upright && i > 0) hinge(i - 1, i, 0.5, 0, 0, 0.5);
    if (!upright) hinge(i - 1, i, 0, 0.5, -0.5, 0);
  }
  return fmt::format(R"({{"format": 1, "name": "large", "gravity": [0, -9.81, 0], "parameters": {{"m": 1}},)"
                     R"("bodies": [{}], "joints": [{}],)"
                     R"("sensors": {{"e": {{"quantity": "energy", "component": "total"}}}},)"
                     R"("objectives": {{"end": {{"terminal": "e"}}}},)"
                     R"("simulation": {{"end_time": 0.004, "output_step": 0.002,)"
                     R"("integrator": {{"type": "dopri5", "step": 1e-3}}}}}})",
                     rods, joints);
}

void check_growth_of(const char* command, Layout layout) {
  const TemporaryFolder folder;
  const int least = std::string(command) == "validate" ? kSize : kSize / 2;
  for (const int size : {least, 4 * least}) folder.write(std::to_string(size), scene(layout, size));
  const auto run = [&](int size) {
    const std::string name = std::to_string(size);
    const CommandOutcome outcome =
        run_command({command, folder.file(name), "--out", folder.file("o" + name), "--quiet"});
    INFO(outcome.err);
    REQUIRE(outcome.exit_code == kDone);
  };
  check_growth(run, least);
}

// The whole text of the error.
std::string refusal(const std::string& text) {
  try {
    read_problem_text(text, "large.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

// kPendulum with `count` more of something before "bodies".
std::string pendulum_with(const std::string& before, int count, const std::string& each, const std::string& after) {
  std::string more = before;
  for (int i = 0; i < count; ++i) more += fmt::format(fmt::runtime(each), i) + ",";
  more.back() = ' ';
  std::string text = kPendulum;
  return text.insert(text.find("\"bodies\""), more + after + ",\n");
}

}  // namespace

TEST_CASE("commands take time linear in the bodies of a chain", "[sizes]") {
  const auto command = GENERATE("validate", "simulate", "gradient");
  INFO(command);
  check_growth_of(command, Layout::chain);
}

TEST_CASE("commands take time linear in the loops of a mechanism", "[sizes]") {
  const auto command = GENERATE("validate", "simulate", "gradient");
  INFO(command);
  check_growth_of(command, Layout::ladder);
}

TEST_CASE("commands take time linear in the number of free bodies", "[sizes]") {
  const auto command = GENERATE("validate", "simulate", "gradient");
  INFO(command);
  check_growth_of(command, Layout::free);
}

TEST_CASE("massless directions are looked for in time linear in the bodies", "[sizes]") {
  const TemporaryFolder folder;
  for (const int size : {kSize, 4 * kSize}) folder.write(std::to_string(size), scene(Layout::chain, size, "0", 0));
  const auto run = [&](int size) {
    const CommandOutcome outcome = run_command(
        {"validate", folder.file(std::to_string(size)), "--out", folder.file("o" + std::to_string(size)), "--quiet"});
    REQUIRE(outcome.exit_code == kNumericalFailure);
    CHECK_THAT(outcome.err, Contains(fmt::format("body 'r{}' has no inertia in a direction", size - 1)));
  };
  check_growth(run, kSize);
}

TEST_CASE("the rank of the equations of many loops is right", "[sizes]") {
  const TemporaryFolder folder;
  const int bodies = 2 * kSize + 1;
  const CommandOutcome outcome = run_command(
      {"validate", folder.write("ladder.json", scene(Layout::ladder, bodies)), "--out", folder.file("out")});
  CHECK_THAT(outcome.out, Contains(fmt::format("of rank {}, 1 degree of freedom", 7 * bodies - 1)));
}

TEST_CASE("rank and redundant equations of the gallery are those of dense rows", "[sizes][gallery]") {
  for (const std::string& name : gallery()) {
    INFO(name);
    const Scene of = read_problem(file_of(name)).scene;
    const Mechanism mechanism(of, nominal(of));
    const Assembly assembly(mechanism, of.simulation.start_time);
    const ModelSummary found = assembly.summary();
    const DenseRedundancy dense = dense_redundancy(mechanism.data(), of.simulation.start_time, assembly.result().y);
    CHECK(found.rank == dense.rank);
    CHECK(found.redundant == dense.redundant);
  }
}

TEST_CASE("of many errors a hundred are shown, and how many more there are", "[sizes]") {
  const std::string text = refusal(pendulum_with("", 300, R"("bodie{}": 1)", ""));
  CHECK(std::count(text.begin(), text.end(), '\n') == 100);
  CHECK_THAT(text, Contains("bodie0: unknown key (did you mean 'bodies'?)") && Contains("bodie99") &&
                       !Contains("bodie100") && Catch::EndsWith("\nand 200 more"));
}

TEST_CASE("errors are found in time linear in their number", "[sizes]") {
  const auto [before, each, after, expected] =
      GENERATE(std::tuple("", R"("bodie{}": 1)", "", "unknown key"),
               std::tuple("", R"("name": {})", "", "this key is there twice"),
               std::tuple(R"("definitions": {)", R"("d{0}": "nobody{0} + 1")", "}", "unknown name 'nobody0'"),
               std::tuple(R"("drives": [)", R"({{"name": "d{0}", "type": "angle", "joint": "pun{0}", "law": "t"}})",
                          "]", "there is no joint 'pun0'"));
  INFO(expected);
  const std::string few = pendulum_with(before, 1000, each, after), many = pendulum_with(before, 4000, each, after);
  CHECK_THAT(refusal(few), Contains(expected));
  check_growth([&](int size) { refusal(size == 1000 ? few : many); }, 1000);
}

TEST_CASE("unused parameters are found in time linear in their number", "[sizes]") {
  const auto text = [](int count) {
    std::string all = kPendulum;
    std::string more;
    for (int i = 0; i < count; ++i) more += fmt::format("\"idle{}\": 1, ", i);
    return all.insert(all.find("\"L\""), more);
  };
  const std::string few = text(500), many = text(2000);
  CHECK_THAT(refusal(few), Contains("parameters.idle0: 'idle0' is used by nothing") && Contains("and 400 more"));
  check_growth([&](int size) { refusal(size == 500 ? few : many); }, 500);
}
