// References that `tradeoff` computes itself, against figures found elsewhere.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <string>

#include "app/json/read_problem.hpp"
#include "optim/tradeoff/tradeoff.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/optim/counted_clock.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

struct Found {
  Problem problem;
  TradeoffReference reference;
  double sensor(const std::string& name) const {  // at the end
    const std::vector<Sensor>& sensors = problem.scene.sensors;
    for (std::size_t s = 0; s < sensors.size(); ++s) {
      if (sensors[s].name == name)
        return reference.errors->exact().motion.sensors.rightCols<1>()(static_cast<Eigen::Index>(s));
    }
    FAIL("no sensor " << name);
    return 0;
  }
};

Found reference_of(const std::string& name, const std::vector<std::string>& sets = {}, bool gradients = false,
                   double seconds_per_run = 0.5) {
  Found found{read_problem(file_of(name), sets), {}};
  CountedClock clock;
  found.reference =
      converged_reference(TradeoffRuns(found.problem.scene, objectives_of(found.problem)),
                          {.seconds_per_run = seconds_per_run, .gradients = gradients, .clock = clock.clock()});
  INFO(name << ": " << found.reference.message);
  REQUIRE(found.reference.ok());
  return found;
}

double largest_certificate(const TradeoffReference& reference) {
  double largest = 0;
  for (const Quantity& q : reference.errors->quantities()) largest = std::max(largest, q.certificate);
  return largest;
}

}  // namespace

// Two models, halved steps agree to 1e-12 (angles) and 1e-10 (rates).
TEST_CASE("the reference of Andrews' mechanism is right to 1e-10", "[tradeoff]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Found found = reference_of("andrews/simulate", {"simulation.end_time=0.03"});
  const std::map<std::string, double> expected{{"beta", 15.8107711951538},    {"theta", -15.756371058412},
                                               {"gamma", 0.0408222401196468}, {"phi", -0.534730116342077},
                                               {"delta", 0.524409965879955},  {"Omega", 0.534730116342077},
                                               {"eps", 1.04808074104194},     {"beta_rate", 1139.9203022591}};
  for (const auto& [sensor, value] : expected) {
    INFO(sensor);
    CHECK(std::abs(found.sensor(sensor) / value - 1) < 1e-10);
  }
}

// An 8th-order method with projection and complex steps; halved steps agree to 1e-14, and so do the optima's forces.
TEST_CASE("the reference of the five-bar and its gradient are right to 1e-10", "[tradeoff]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Found found = reference_of("five_bar/sensitivities", {}, true);
  const Answer& exact = found.reference.errors->exact();
  std::size_t travel = 0;
  while (found.problem.objectives.at(travel).name != "travel") ++travel;
  const Eigen::Index row = static_cast<Eigen::Index>(travel);
  CHECK(std::abs(exact.psi(row) / 0.12883112793824 - 1) < 1e-10);
  const std::map<std::string, double> expected{{"L01", 0.43585125087835},    {"L02", 1.61976207776287},
                                               {"k1", -0.00068529458007929}, {"k2", -0.00231809881744949},
                                               {"c1", -0.040992678495154},   {"c2", -0.038258434911866},
                                               {"m1", -0.010025945272298},   {"m2", 0.059162921408138},
                                               {"m3", 0.116610652344094},    {"m4", 0.046704924396818}};
  std::size_t found_parameters = 0;
  for (std::size_t k = 0; k < found.problem.scene.parameters.size(); ++k) {
    const auto p = expected.find(found.problem.scene.parameters[k].name);
    if (p == expected.end()) continue;
    ++found_parameters;
    INFO(p->first << ": " << exact.psi_rho(row, static_cast<Eigen::Index>(k)));
    CHECK(std::abs(exact.psi_rho(row, static_cast<Eigen::Index>(k)) / p->second - 1) < 1e-10);
  }
  CHECK(found_parameters == expected.size());
}

// The exact solution, by quadrature: 16 digits; its derivatives by that of the quadrature in 30 digits.
TEST_CASE("the reference of two windows is right to 1e-10 m after ten passages of their singular positions",
          "[tradeoff]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Found found = reference_of("four_bar/windows", {}, true, 0.25);
  const Answer& exact = found.reference.errors->exact();
  INFO(in_words(found.reference.first) << ", " << in_words(found.reference.second));
  const double error = std::hypot(found.sensor("x") - 0.3284581115408154, found.sensor("y") - 0.944518538178601);
  INFO("error " << error);
  CHECK(error < 1e-10);
  REQUIRE(found.problem.objectives[0].name == "end");
  CHECK(std::abs(exact.psi(1) / 6.28503607541884628607 - 1) < 1e-10);  // height
  const double gradients[2][3] = {{-9.08810439514276442, 4.60261031129771836, 0.490718878224858454},
                                  {11.2497692519315727, 0.00448918360067316117, 0.134129838461309551}};
  const double sizes[3] = {1, 1, 9.81};  // L, v, g
  const std::vector<Quantity>& quantities = found.reference.errors->quantities();
  for (Eigen::Index i = 0; i < 2; ++i) {
    double difference = 0, whole = 0;
    for (Eigen::Index k = 0; k < 3; ++k) {
      difference = std::hypot(difference, sizes[k] * (exact.psi_rho(i, k) - gradients[i][k]));
      whole = std::hypot(whole, sizes[k] * gradients[i][k]);
    }
    INFO("gradient " << i << " is off by " << difference / whole);
    CHECK(difference < 5e-10 * whole);
    // What is certified holds. Both errors are magnified rounding, of one size: their distance may be less than either.
    const double certificate = quantities[quantities.size() - 2 + static_cast<std::size_t>(i)].certificate;
    CHECK(difference < 2 * certificate * whole);
    CHECK(certificate < 1e-6);
  }
}

TEST_CASE("the reference of two windows is right to 1e-10 m after two passages of their singular positions",
          "[tradeoff]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Found found = reference_of("four_bar/windows", {"simulation.end_time=2"}, false, 0.1);
  const double error = std::hypot(found.sensor("x") - 0.05781579576801143, found.sensor("y") - 0.9983272678634555);
  INFO("error " << error);
  CHECK(error < 1e-10);
}

TEST_CASE("the reference of a stiff governor is found, though its link decays at 8000 1/s", "[tradeoff]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Found found = reference_of("governor/stiff_flyball", {"simulation.end_time=1"});
  CHECK(largest_certificate(found.reference) < 1e-8);
  const TradeoffRuns runs(found.problem.scene, objectives_of(found.problem));
  double last = 1;
  for (const double rtol : {1e-3, 1e-5, 1e-7}) {
    SimulationSettings settings = with_tolerance(found.problem.scene.simulation, "radau5", rtol);
    const Eigen::VectorXd errors = found.reference.errors->of(runs.motion(settings));
    CHECK(errors(0) < 0.3 * last);
    last = errors(0);
  }
}

TEST_CASE("a chaotic motion's reference says how little it is certain of", "[tradeoff]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Found found = reference_of("double_pendulum/gradient",
                                   {"simulation.end_time=20", "forces[0].damping=0", "parameters.theta1.value=3"});
  CHECK(largest_certificate(found.reference) > 1e-9);
}
