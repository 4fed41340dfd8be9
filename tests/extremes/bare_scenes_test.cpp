// Scenes of next to nothing.
#include "tests/app/run_command.hpp"
#include "tests/extremes/problem_runs.hpp"

using namespace mbsopt;
using namespace mbsopt::extremes;
using Catch::Matchers::Contains;

TEST_CASE("a scene with nothing but ground is refused in words", "[extremes]") {
  Json p = problem("nothing");
  if (GENERATE(false, true)) p.erase("bodies");
  const std::string command = GENERATE(as<std::string>{}, "validate", "simulate", "gradient", "check");
  const TemporaryFolder folder;
  const CommandOutcome run =
      run_command({command, folder.write("nothing.json", p.dump()), "--out", folder.file("out")});
  CHECK(run.exit_code == 2);
  CHECK_THAT(run.err, Contains("nothing.json:1:") && Contains("bodies: is ") &&
                          (Contains("at least one body") || Contains("expected: rigid bodies")));
  CHECK_FALSE(std::filesystem::exists(folder.path / "out"));
}

TEST_CASE("one free body without any force goes straight on and turns evenly about its axis", "[extremes]") {
  Json p = problem("free");
  p["gravity"] = {0, 0, 0};
  const double T = GENERATE(1e-9, 1.0, 1e6), w = 0.5 / T;
  p["parameters"] = {{"v", {{"value", 3}}}};
  p["bodies"] = {{{"name", "body"},
                  {"mass", 2},
                  {"inertia", {0.2, 0.3, 0.4}},
                  {"velocity", {"v", -1, 0.5}},
                  {"angular_velocity", {0, 0, w}}}};
  p["sensors"] = {{"x", {{"quantity", "position"}, {"body", "body"}, {"component", "x"}}},
                  {"z", {{"quantity", "position"}, {"body", "body"}, {"component", "z"}}},
                  {"e3", {{"quantity", "orientation"}, {"body", "body"}, {"component", "e3"}}},
                  {"wz", {{"quantity", "angular_velocity"}, {"body", "body"}, {"component", "z"}}}};
  for (const char* name : {"x", "z", "e3", "wz"}) p["objectives"][name] = {{"terminal", name}};
  p["simulation"]["end_time"] = T;
  p["simulation"]["integrator"] = {
      {"type", GENERATE(as<std::string>{}, "dopri5", "radau5", "cvodes_adams")}, {"rtol", 1e-9}, {"atol", 1e-12}};
  const Outcome run = gradients(p);
  INFO("T = " << T << ": " << run.message());
  REQUIRE(run.ok());
  CHECK(run("x") == Approx(3 * T).epsilon(1e-8));
  CHECK(run("z") == Approx(0.5 * T).epsilon(1e-8));
  CHECK(run("e3") == Approx(std::sin(0.25)).epsilon(1e-7));
  CHECK(run("wz") == Approx(w).epsilon(1e-7));
  CHECK(run("x", "v") == Approx(T).epsilon(1e-8));
}

TEST_CASE("one free body at rest stays there to the last digit", "[extremes]") {
  Json p = problem("rest");
  p["gravity"] = {0, 0, 0};
  p["bodies"] = {{{"name", "body"}, {"mass", 2}, {"inertia", {0.2, 0.3, 0.4}}, {"position", {0.1, 0.2, 0.3}}}};
  p["sensors"] = {{"x", {{"quantity", "position"}, {"body", "body"}, {"component", "x"}}},
                  {"speed", {{"quantity", "velocity"}, {"body", "body"}, {"component", "norm"}}}};
  p["objectives"] = {{"x", {{"terminal", "x"}}}, {"speed", {{"terminal", "speed"}}}};
  const Outcome run = values(p);
  REQUIRE(run.ok());
  CHECK(run("x") == 0.1);
  CHECK(run("speed") == 0);
}

TEST_CASE("without gravity a pendulum turns evenly, and at rest it stays", "[extremes]") {
  Json p = pendulum();
  p["gravity"] = {0, 0, 0};
  const double rate = GENERATE(0.0, 1e-6, 5.0);
  p["simulation"]["end_time"] = 10;
  p["initial"]["conditions"] = {{{"sensor", "theta"}, {"value", 0.3}, {"rate", rate}}};
  set_accuracy(p, GENERATE(as<std::string>{}, "dopri5", "radau5", "cvodes_bdf"), 1e-9);
  const Outcome run = values(p);
  INFO(run.message());
  REQUIRE(run.ok());
  CHECK(run("theta") == Approx(0.3 + 10 * rate).epsilon(1e-6));
  CHECK(run("speed") == Approx(rate).epsilon(1e-6).margin(1e-15));
}

// Two oscillators that have nothing to do with each other: 1e-12 kg on 1e-10 N/m and 1e12 kg on 1e14 N/m, both 10
// rad/s.
TEST_CASE("one gradient with parameters of 1e-12 and 1e12 has every entry right", "[extremes]") {
  const double x0 = 0.3, T = 2, w = 10;
  Json p = problem("scales");
  p["gravity"] = {0, 0, 0};
  p["parameters"] = {{"m_small", {{"value", 1e-12}}},
                     {"k_small", {{"value", 1e-10}}},
                     {"m_large", {{"value", 1e12}}},
                     {"k_large", {{"value", 1e14}}}};
  for (const std::string size : {"small", "large"}) {
    const std::string m = "m_" + size;
    p["bodies"].push_back({{"name", size}, {"mass", m}, {"inertia", {m, m, m}}, {"position", {x0, 0, 0}}});
    p["forces"].push_back({{"name", "spring_" + size},
                           {"type", "tsda"},
                           {"body1", "ground"},
                           {"body2", size},
                           {"point1", {0, 0, 0}},
                           {"point2", "O"},
                           {"stiffness", "k_" + size}});
    p["sensors"]["x_" + size] = {{"quantity", "position"}, {"body", size}, {"component", "x"}};
  }
  p["objectives"] = {{"sum", {{"terminal", "x_small + x_large"}}}};
  p["simulation"]["end_time"] = T;
  set_accuracy(p, "dopri853", 1e-11);
  const double by_w = -x0 * std::sin(w * T) * T;  // w = sqrt(k/m):  w_k = w/(2k),  w_m = -w/(2m)
  const auto [method, digits] = GENERATE(table<GradientMethod, double>({{GradientMethod::tlm, 1e-8},
                                                                        {GradientMethod::adjoint, 1e-8},
                                                                        {GradientMethod::cvodes_forward, 1e-6},
                                                                        {GradientMethod::cvodes_adjoint, 1e-6},
                                                                        {GradientMethod::differences, 1e-6}}));
  const Outcome run = gradients(p, method);
  INFO(to_string(method) << ": " << run.message());
  REQUIRE(run.ok());
  CHECK(run("sum") == Approx(2 * x0 * std::cos(w * T)).epsilon(1e-8));
  CHECK(run("sum", "k_small") == Approx(by_w * w / 2e-10).epsilon(digits));
  CHECK(run("sum", "k_large") == Approx(by_w * w / 2e14).epsilon(digits));
  CHECK(run("sum", "m_small") == Approx(-by_w * w / 2e-12).epsilon(digits));
  CHECK(run("sum", "m_large") == Approx(-by_w * w / 2e12).epsilon(digits));
}
