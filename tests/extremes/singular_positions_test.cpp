// A four-bar that flattens, redundant equations, and constraints that nothing meets.
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <numbers>

#include "source_folder.hpp"
#include "tests/app/run_command.hpp"
#include "tests/extremes/problem_runs.hpp"

using namespace mbsopt;
using namespace mbsopt::extremes;
using Catch::Matchers::Contains;

namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr int kPassages = 4;
#else
constexpr int kPassages = 20;
#endif

// A02 with one window: three unit rods, cranks up, their tops moving at 1 m/s. All lie in line twice a turn.
Json window() {
  Json p = problem("window");
  const double up = std::numbers::pi / 2;
  p["bodies"] = {rod("crank", 1, 1, 0, 0, up), rod("coupler", 1, 1, 0, 1, 0), rod("rocker", 1, 1, 1, 0, up)};
  p["joints"] = {hinge("A", "ground", {0, 0, 0}, "crank", "O"), hinge("B", "crank", "tip", "coupler", "O"),
                 hinge("C", "coupler", "tip", "rocker", "tip"), hinge("D", "ground", {1, 0, 0}, "rocker", "O")};
  p["initial"]["conditions"] = {{{"sensor", "crank"}, {"value", up}, {"rate", -1}}};
  p["sensors"] = {{"crank", {{"quantity", "angle"}, {"joint", "A"}}},
                  {"rocker", {{"quantity", "angle"}, {"joint", "D"}}}};
  p["objectives"] = {{"crank", {{"terminal", "crank"}}}, {"apart", {{"terminal", "crank - rocker"}}}};
  return p;
}

// chi: clockwise from upright; chi'^2 = 1 + 2a (1 - cos chi), a = 3(3N + 1)g/(2(4N + 1)L) with N = 1.
double time_to(double chi) {
  const auto slowness = [](double x) { return 1 / std::sqrt(1 + 2 * (6 * 9.81 / 5) * (1 - std::cos(x))); };
  double t = 0;
  for (double from = 0; from < chi; from += 0.5) {
    t += boost::math::quadrature::gauss_kronrod<double, 31>::integrate(slowness, from, std::min(chi, from + 0.5), 5,
                                                                       1e-13);
  }
  return t;
}

// Six rods at right angles, closed by one more equation than they need: Bricard's mechanism (1897).
Json bricard() {
  Json p = problem("bricard");
  const double P[6][3] = {{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}};
  const int axes[6] = {1, 2, 0, 1, 2, 0};  // of the revolutes at P0 .. P5
  const double thin = 1e-9, I = 1.0 / 12;
  for (int i = 0; i < 5; ++i) {
    Json at = Json::array(), to = Json::array(), back = Json::array(), inertia = Json::array();
    for (int k = 0; k < 3; ++k) {
      at.push_back((P[i][k] + P[i + 1][k]) / 2);
      to.push_back((P[i + 1][k] - P[i][k]) / 2);
      back.push_back(-(P[i + 1][k] - P[i][k]) / 2);
      inertia.push_back(P[i + 1][k] != P[i][k] ? thin : I);
    }
    p["bodies"].push_back({{"name", "rod" + std::to_string(i + 1)},
                           {"mass", 1},
                           {"inertia", inertia},
                           {"position", at},
                           {"points", {{"start", back}, {"end", to}}}});
  }
  for (int i = 0; i < 6; ++i) {
    Json axis = {0, 0, 0};
    axis[static_cast<std::size_t>(axes[i])] = 1;
    const std::string before = i == 0 ? "ground" : "rod" + std::to_string(i);
    const std::string after = i == 5 ? "ground" : "rod" + std::to_string(i + 1);
    const Json on1 = i == 0 ? Json({0, 0, 0}) : Json("end"), on2 = i == 5 ? Json({0, 0, 1}) : Json("start");
    p["joints"].push_back(hinge("P" + std::to_string(i), before, on1, after, on2, axis));
  }
  p["sensors"] = {{"x", {{"quantity", "position"}, {"body", "rod3"}, {"component", "x"}}},
                  {"y", {{"quantity", "position"}, {"body", "rod3"}, {"component", "y"}}},
                  {"z", {{"quantity", "position"}, {"body", "rod3"}, {"component", "z"}}}};
  p["objectives"] = {{"x", {{"terminal", "x"}}}, {"y", {{"terminal", "y"}}}, {"z", {{"terminal", "z"}}}};
  return p;
}

}  // namespace

TEST_CASE("a four-bar passes its flat position forty times in twenty turns, on its branch, at the time its energy says",
          "[extremes]") {
  Json p = window();
  const auto [method, rtol, bound] =
      GENERATE(table<std::string, double, double>({{"dopri5", 1e-8, 1e-4}, {"dopri853", 1e-10, 1e-6}}));
  set_accuracy(p, method, rtol);
  const double end = time_to(2 * std::numbers::pi * kPassages);
  p["simulation"]["end_time"] = end;
  const Outcome run = values(p);
  INFO(method << ": " << run.message());
  REQUIRE(run.ok());
  const double chi = std::numbers::pi / 2 - run("crank");
  CHECK(chi / (2 * std::numbers::pi) == Approx(kPassages).epsilon(1e-5));
  CHECK(std::abs(time_to(chi) - end) < bound);
  CHECK(std::abs(std::remainder(run("apart"), 2 * std::numbers::pi)) < 1e-7);  // a parallelogram still
  CHECK(run.statistics().max_position_violation < 1e-12);
}

TEST_CASE("Bricard's mechanism, one equation too many, moves as with just the equations it needs", "[extremes]") {
  Json redundant = bricard();
#ifdef __SANITIZE_ADDRESS__
  redundant["simulation"]["end_time"] = 1;
#else
  redundant["simulation"]["end_time"] = 10;
#endif
  set_accuracy(redundant, "dopri853", 1e-10);
  // The last revolute as a point and one direction: four equations in place of five.
  Json least = redundant;
  Json point = redundant["joints"][5];
  point["type"] = "spherical", point.erase("axis1"), point.erase("axis2");
  least["joints"][5] = point;
  least["joints"].push_back({{"name", "square"},
                             {"type", "perpendicular"},
                             {"body1", "rod5"},
                             {"body2", "ground"},
                             {"axis1", {1, 0, 0}},
                             {"axis2", {0, 1, 0}}});
  const Outcome a = values(redundant), b = values(least);
  INFO(a.message() << b.message());
  REQUIRE((a.ok() && b.ok()));
  for (const char* at : {"x", "y", "z"}) CHECK(std::abs(a(at) - b(at)) < 1e-6);
  CHECK(a.statistics().energy_drift < 1e-6);
  CHECK(a.statistics().max_position_violation < 1e-12);
}

// Stages leave the constraints by the error of a step, and redundant equations then disagree, alpha times as much as
// that: it shows in derivatives, and goes with the tolerance.
TEST_CASE("gradients of Bricard's mechanism are the same by TLM and adjoint, and its mass has none", "[extremes]") {
  Json p = bricard();
  p["parameters"] = {{"g", {{"value", 9.81}}}, {"m", {{"value", 1}}}};
  p["gravity"] = {0, "-g", 0};
  for (Json& body : p["bodies"]) {  // all masses and inertias times m: the motion is the same
    body["mass"] = "m";
    for (Json& x : body["inertia"]) x = x.dump() + "*m";
  }
  set_accuracy(p, "dopri853", 1e-12);
  const Outcome tlm = gradients(p, GradientMethod::tlm), adjoint = gradients(p, GradientMethod::adjoint);
  INFO(tlm.message() << adjoint.message());
  REQUIRE((tlm.ok() && adjoint.ok()));
  for (const char* at : {"x", "y", "z"}) {
    CHECK(std::abs(tlm(at, "m")) < 1e-9);
    CHECK(adjoint(at, "g") == Approx(tlm(at, "g")).epsilon(1e-10));
    CHECK(std::abs(tlm(at, "g")) > 1e-6);
  }
}

TEST_CASE("a pendulum on three hinges in line swings as on one", "[extremes]") {
  Json one = pendulum();
  one["simulation"]["end_time"] = 5;
  set_accuracy(one, "dopri5", 1e-11);
  Json three = one;
  for (const double z : {-0.3, 0.4}) {
    three["joints"].push_back(hinge(z < 0 ? "left" : "right", "ground", {0, 0, z}, "rod", {0, 0, z}));
  }
  const Outcome a = values(one), b = values(three);
  INFO(b.message());
  REQUIRE((a.ok() && b.ok()));
  CHECK(std::abs(a("theta") - b("theta")) < 1e-9);
  CHECK(std::abs(a("speed") - b("speed")) < 1e-9);
}

// A crank of 0.5 m pulled along by a rod whose length a drive makes grow: at 1.5 m from a pin 1 m away it is stretched.
TEST_CASE("a drive that asks for more than the mechanism reaches ends the run in words, with what was good",
          "[extremes]") {
  Json p = pendulum();
  p["drives"] = {{{"name", "rope"},
                  {"type", "distance"},
                  {"body1", "ground"},
                  {"body2", "rod"},
                  {"point1", {-1, 0.5, 0}},
                  {"point2", "tip"},
                  {"law", "1.6 + 0.3*t"}}};  // the farthest the tip gets is 1 + sqrt(1.25) = 2.118 m, at 1.727 s
  p["bodies"][0]["orientation"] = {{"axis", {0, 0, 1}}, {"angle", 0.6}};
  p["simulation"]["end_time"] = 5;
  Json settings = GENERATE(Json{{"type", "dopri5"}}, Json{{"type", "radau5"}}, Json{{"type", "rk4"}, {"step", 0.005}});
  p["simulation"]["integrator"] = settings;
  const Outcome run = values(p);
  INFO(settings.dump() << run.message());
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains("a drive asks for more than the mechanism reaches") ||
                                Contains("a drive ask for more than the mechanism reaches") ||
                                Contains("a drive that asks for more than the mechanism reaches") ||
                                (Contains("Use a smaller step") && Contains("singular position")));
}

// Multistep methods do not project onto the constraints: they leave the branch in the end, or end there, as rounding
// has it.
TEST_CASE("a run of CVODES past singular positions is no silent success", "[extremes]") {
  const TemporaryFolder folder;
  const std::string file = std::string(MBSOPT_SOURCE_DIR) + "/problems/four_bar/windows.json";
  const auto simulate = [&](const std::vector<std::string>& settings) {
    std::vector<std::string> arguments{"simulate", file, "--out", folder.file("out"), "--quiet"};
    for (const std::string& setting : settings)
      arguments.insert(arguments.end(), {"--set", "simulation.integrator." + setting});
    return run_command(arguments);
  };
  const std::string method = GENERATE(as<std::string>{}, "cvodes_adams", "cvodes_bdf");
  const std::string rtol = GENERATE(as<std::string>{}, "1e-6", "1e-8");
  const CommandOutcome run = simulate({"type=" + method, "rtol=" + rtol, "atol=1e-10"});
  INFO(method << " at " << rtol << ": " << run.err);
  if (run.exit_code == 0) {
    CHECK_THAT(run.err, (Contains("warning: the energy changed by") &&
                         Contains("near singular positions a Runge-Kutta method")) ||
                            (Contains("warning: the joints came apart") && Contains("take a Runge-Kutta method")));
  } else {
    CHECK(run.exit_code == 1);
    CHECK_THAT(run.err, Contains("singular"));
  }
  const CommandOutcome projected = simulate({});
  CHECK(projected.exit_code == 0);
  CHECK_THAT(projected.err, !Contains("warning: "));
}
