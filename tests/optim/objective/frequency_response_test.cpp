// Responses to an input that swings: closed forms of one and two masses, and a minimax design.
#include "optim/objective/frequency_response.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <numbers>

#include "optim/design/design.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/objective/problem_issues.hpp"
#include "tests/core/mechanism/one_coordinate.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

// Masses in a row on springs and dampers, the first one pushed by the force F.
Scene masses(const std::vector<std::pair<std::string, double>>& parameters, int count) {
  Scene s;
  add_parameters(s, parameters);
  s.gravity = {0.0, 0.0, 0.0};
  s.equilibrium = true;
  for (int i = 1; i <= count; ++i) {
    const std::string n = std::to_string(i), before = i == 1 ? "ground" : "m" + std::to_string(i - 1);
    s.bodies.push_back(plain_body("m" + n, 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec(n, "0", "0")));
    s.bodies.back().mass = f("m" + n);
    Joint slide;
    slide.name = "slide" + n, slide.type = "translational", slide.body2 = "m" + n;
    slide.axis1 = vec("1", "0", "0"), slide.axis2 = vec("1", "0", "0");
    s.joints.push_back(slide);
    Tsda spring;
    spring.body1 = before, spring.body2 = "m" + n;
    spring.stiffness = f("k" + n), spring.damping = f("c" + n), spring.free_length = 1.0;
    s.forces.push_back({"spring" + n, spring});
    s.sensors.push_back(point_sensor("x" + n, "position", "m" + n, vec("0", "0", "0"), "x"));
    s.sensors.push_back(point_sensor("a" + n, "acceleration", "m" + n, vec("0", "0", "0"), "x"));
  }
  PointForce push;
  push.body = "m1", push.components = {f("F"), f("0"), f("0")};
  s.forces.push_back({"push", push});
  return s;
}

FrequencyResponseSpec response(const std::string& output, const std::string& value) {
  FrequencyResponseSpec spec;
  spec.input = "F", spec.output = output, spec.value = value;
  return spec;
}

}  // namespace

TEST_CASE("one mass answers with the amplitude and phase of its closed form, and their derivatives", "[response]") {
  const double m = 2, k = 300, c = 4;
  const Scene scene = masses({{"m1", m}, {"k1", k}, {"c1", c}, {"F", 0.0}}, 1);
  const Eigen::VectorXd rho = nominal(scene);
  const std::vector<int> variables{0, 1, 2};
  const double f = GENERATE(0.3, 1.9, 5.0), w = kTurn * f;
  const std::complex<double> H = 1.0 / std::complex<double>(k - m * w * w, c * w);
  const std::complex<double> H_of[] = {H * H * w * w, -H * H, -H * H * std::complex<double>(0, w)};
  for (const std::string value : {"amplitude", "phase"}) {
    FrequencyResponseSpec spec = response("x1", value);
    spec.at = f;
    const FrequencyResponse of(scene, spec);
    const FrequencyResponse::Peak found = of.peaks(rho, {}, variables).front();
    CHECK(found.value == Approx(value == "phase" ? std::arg(H) : std::abs(H)).epsilon(1e-9));
    CHECK(of.value(rho, {}) == Approx(found.value).epsilon(1e-12));
    for (int p = 0; p < 3; ++p) {
      const std::complex<double> relative = H_of[p] / H;
      const double exact = value == "phase" ? relative.imag() : std::abs(H) * relative.real();
      CHECK(found.gradient(p) == Approx(exact).epsilon(1e-8).margin(1e-13));
    }
  }
  FrequencyResponseSpec of_acceleration = response("a1", "amplitude");
  of_acceleration.at = f;
  CHECK(FrequencyResponse(scene, of_acceleration).value(rho, {}) == Approx(w * w * std::abs(H)).epsilon(1e-9));
}

TEST_CASE("the largest amplitude in a band and the root of its mean square are those of the closed form",
          "[response]") {
  const double m = 2, k = 300, c = 4;
  const Scene scene = masses({{"m1", m}, {"k1", k}, {"c1", c}, {"F", 0.0}}, 1);
  const Eigen::VectorXd rho = nominal(scene);
  FrequencyResponseSpec largest = response("x1", "max");
  largest.from = 0.1, largest.to = 20;
  const FrequencyResponse::Peak top = FrequencyResponse(scene, largest).peaks(rho, {}, {1}).front();
  const double zeta = c / (2 * std::sqrt(k * m));  // |H| = 1/(2 k zeta sqrt(1 - zeta^2)) at its largest
  CHECK(top.value == Approx(1 / (2 * k * zeta * std::sqrt(1 - zeta * zeta))).epsilon(1e-9));
  CHECK(top.frequency == Approx(std::sqrt(k / m * (1 - 2 * zeta * zeta)) / kTurn).epsilon(1e-6));
  FrequencyResponseSpec noise = response("x1", "rms");
  noise.from = 0, noise.to = 4000, noise.spectrum = 3;
  // integral of |H|^2 df over all f > 0: 1/(4 k c)
  CHECK(FrequencyResponse(scene, noise).value(rho, {}) == Approx(std::sqrt(3 / (4 * k * c))).epsilon(1e-6));
}

// Den Hartog's absorber at a mass ratio of 0.05: both peaks of the main mass are equal at its best, 6.40792.
TEST_CASE("an absorber has the least largest amplitude where its peaks are equal", "[response]") {
  const double mu = 0.05;
  Problem problem;
  problem.scene =
      masses({{"m1", 1.0}, {"k1", 1.0}, {"c1", 0.0}, {"m2", mu}, {"k2", 0.03}, {"c2", 0.02}, {"F", 0.0}}, 2);
  for (const std::size_t p : {4U, 5U}) {
    problem.scene.parameters[p].lower = 0.001;
    problem.scene.parameters[p].upper = 0.2;
  }
  ObjectiveSpec gain;
  gain.name = "gain";
  gain.frequency_response = response("x1", "max");
  gain.frequency_response->from = 0.05, gain.frequency_response->to = 0.4;
  problem.objectives = {gain};
  problem.design.emplace();
  problem.design->minimize = "gain", problem.design->variables = {"k2", "c2"};
  CHECK(find_issues(problem).empty());
  const DesignResult result = run_design(problem);
  INFO(result.message);
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.objective_final == Approx(6.40792).epsilon(2e-6));
  const double ratio =
      std::sqrt(result.variables[0].value / mu);  // of the absorber's frequency; Den Hartog's 1/(1 + mu)
  CHECK(ratio == Approx(1 / (1 + mu)).epsilon(2e-3));
}

TEST_CASE("a response is refused in words where it is none", "[response]") {
  Scene scene = masses({{"m1", 2.0}, {"k1", 300.0}, {"c1", 4.0}, {"F", 0.0}, {"s", 0.0}}, 1);
  scene.joints[0].point1 = vec("s", "0", "0"), scene.joints[0].point2 = vec("0", "0", "0");
  FrequencyResponseSpec spec = response("x1", "amplitude");
  spec.at = 1;
  scene.equilibrium = false;
  scene.bodies[0].position = vec("2", "0", "0");
  CHECK_THROWS_WITH(FrequencyResponse(scene, spec).value(nominal(scene), {}), Contains("no equilibrium"));
  spec.input = "nothing";
  CHECK_THROWS_WITH(FrequencyResponse(scene, spec), Contains("there is no 'nothing'"));
  Problem problem;
  problem.scene = scene;
  ObjectiveSpec gain;
  gain.name = "gain", gain.frequency_response = response("x1", "max");
  problem.objectives = {gain};
  const std::vector<SceneIssue> issues = find_issues(problem);
  REQUIRE_FALSE(issues.empty());
  CHECK_THAT(issues[0].path + ": " + issues[0].message, Contains("frequency_response.from: and to are needed"));
}
