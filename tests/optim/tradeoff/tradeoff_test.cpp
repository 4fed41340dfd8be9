#include "optim/tradeoff/tradeoff.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>

#include "optim/tradeoff/advice.hpp"
#include "tests/optim/counted_clock.hpp"
#include "tests/optim/five_bar.hpp"
#include "tests/optim/pendulum.hpp"

using namespace mbsopt;

namespace {

Problem short_five_bar() {
  Problem p = five_bar::problem(1e-7);
  p.scene.simulation.end_time = 0.5;
  return p;
}

Tradeoff measured(const Problem& p, double budget) {
  CountedClock clock;
  TradeoffOptions options;
  options.budget_seconds = budget, options.clock = clock.clock();
  return measure_tradeoff(p.scene, objectives_of(p), options);
}

std::size_t index_of(const Tradeoff& tradeoff, const std::string& name) {
  const std::vector<Quantity>& q = tradeoff.reference.errors->quantities();
  return static_cast<std::size_t>(std::find_if(q.begin(), q.end(), [&](const Quantity& x) { return x.name == name; }) -
                                  q.begin());
}

}  // namespace

TEST_CASE("the five-bar's reference is right to 1e-10 in psi and gradient, and its certificate says so", "[tradeoff]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Problem p = five_bar::problem();
  const TradeoffRuns runs(p.scene, objectives_of(p));
  CountedClock clock;
  const TradeoffReference reference = converged_reference(runs, {.clock = clock.clock()});
  INFO(reference.message);
  REQUIRE(reference.ok());
  CHECK(reference.first.integrator != reference.second.integrator);
  const Answer& exact = reference.errors->exact();
  CHECK(std::abs(exact.psi(0) / five_bar::kPsi - 1) < 1e-10);
  for (std::size_t k = 0; k < five_bar::kGradient.size(); ++k) {
    INFO(five_bar::kGradient[k].first);
    CHECK(std::abs(exact.psi_rho(0, static_cast<Eigen::Index>(k)) / five_bar::kGradient[k].second - 1) < 1e-10);
  }
  for (const Quantity& q : reference.errors->quantities()) {
    INFO(q.name);
    CHECK(q.relative);
    CHECK(q.certificate < 1e-9);
    CHECK(q.certificate > 0);
  }
  // What is measured with the reference itself is no error, with anything else it is one.
  CHECK((reference.errors->of(exact).array() == 0).all());
  const Answer loose = runs.motion(with_tolerance(p.scene.simulation, "bs3", 1e-3));
  const Eigen::VectorXd errors = reference.errors->of(loose);
  CHECK(errors(0) > 1e-5);                       // motion
  CHECK(std::isnan(errors(errors.size() - 1)));  // no gradient was computed
  CHECK(errors(0) == Approx(reference.errors->of(loose)(0)));
}

TEST_CASE("a reference that the time allowed does not suffice for is none, in words", "[tradeoff]") {
  const Problem p = five_bar::problem();
  CountedClock clock;
  const TradeoffReference reference =
      converged_reference(TradeoffRuns(p.scene, objectives_of(p)), {.seconds_per_run = 1e-4, .clock = clock.clock()});
  CHECK_FALSE(reference.ok());
  CHECK(reference.message.find("dopri853: took longer than") != std::string::npos);
}

TEST_CASE("errors fall along every curve of the sweep down to the reference's floor", "[tradeoff]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Tradeoff tradeoff = measured(short_five_bar(), 3);
  REQUIRE(tradeoff.ok());
  std::map<std::pair<std::string, std::size_t>, std::vector<double>> curves;
  const std::vector<Quantity>& quantities = tradeoff.reference.errors->quantities();
  std::set<std::string> names;
  for (const TradeoffRow& row : tradeoff.rows) {
    names.insert(row.setting.curve);  // skipped or not, as the time allows
    if (row.status != RowStatus::ok || row.setting.stands_alone()) continue;
    if (row.setting.curve.starts_with("penalty")) continue;  // these keep a model error
    for (std::size_t q = 0; q < quantities.size(); ++q) {
      const double error = row.errors(static_cast<Eigen::Index>(q));
      if (std::isfinite(error)) curves[{row.setting.curve, q}].push_back(error);
    }
  }
  for (const char* name : {"dopri5", "dopri853", "radau5", "cvodes_adams", "rk4", "adjoint, dopri5", "tlm, dopri853",
                           "fd, dopri5", "cvodes_forward, cvodes_adams", "cvodes_adjoint, cvodes_adams"}) {
    INFO(name);
    CHECK(names.contains(name));
  }
  int steps = 0, rising = 0;
  for (const auto& [key, errors] : curves) {
    INFO(key.first << ", " << quantities[key.second].name);
    const double floor = std::max(30 * quantities[key.second].certificate, 1e-10);
    for (std::size_t i = 1; i < errors.size(); ++i) {
      if (errors[i - 1] < floor) continue;
      ++steps;
      if (errors[i] > 1.5 * errors[i - 1]) ++rising;  // an error that passed through zero
      CHECK(errors[i] < 10 * errors[i - 1]);
    }
    if (errors.size() > 3) CHECK(errors.back() < std::max(0.2 * errors.front(), floor));
  }
  CHECK(steps > 100);
  CHECK(rising < 0.1 * steps);
}

TEST_CASE("a recommended setting gives the accuracy it promises", "[tradeoff]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Problem p = short_five_bar();
  const Tradeoff tradeoff = measured(p, 2);
  REQUIRE(tradeoff.ok());
  const TradeoffRuns runs(p.scene, objectives_of(p));
  const std::size_t motion = index_of(tradeoff, "motion"), psi = index_of(tradeoff, "objective motion"),
                    gradient = index_of(tradeoff, "gradient of motion");
  for (const double accuracy : {1e-3, 1e-5, 1e-7}) {
    INFO(accuracy);
    const Recommendation r = recommend(tradeoff, {motion, psi}, accuracy);
    REQUIRE(r.row);
    const TradeoffRow& row = tradeoff.rows[*r.row];
    const Answer again = runs.motion(row.setting.simulation);
    for (const std::size_t q : {motion, psi})
      CHECK(tradeoff.reference.errors->of(again)(static_cast<Eigen::Index>(q)) <= accuracy);
    const Recommendation g = recommend(tradeoff, {gradient}, accuracy);
    REQUIRE(g.row);
    const TradeoffSetting& setting = tradeoff.rows[*g.row].setting;
    REQUIRE(setting.gradient);
    const Answer differentiated = runs.gradients(setting.simulation, *setting.gradient);
    CHECK(tradeoff.reference.errors->of(differentiated)(static_cast<Eigen::Index>(gradient)) <= accuracy);
  }
  const Recommendation beyond = recommend(tradeoff, {motion}, 1e-17);
  CHECK_FALSE(beyond.row);
  CHECK(beyond.why_not.find("the reference itself is certain to") != std::string::npos);
}

TEST_CASE("an error that is small by chance is not recommended", "[tradeoff]") {
  Tradeoff tradeoff = measured(short_five_bar(), 0);
  REQUIRE(tradeoff.ok());
  tradeoff.rows.clear();
  const auto add = [&](const std::string& curve, double seconds, double error) {
    TradeoffRow row;
    row.setting.curve = curve;
    row.wall_seconds = seconds;
    row.errors =
        Eigen::VectorXd::Constant(static_cast<Eigen::Index>(tradeoff.reference.errors->quantities().size()), error);
    tradeoff.rows.push_back(row);
  };
  add("a", 1, 1e-2), add("b", 1.5, 1e-3), add("a", 2, 1e-7), add("b", 3, 1e-5), add("a", 4, 1e-4), add("a", 8, 1e-6);
  bound_errors(tradeoff.rows);
  CHECK(*recommend(tradeoff, {0}, 2e-2).row == 0);
  CHECK(*recommend(tradeoff, {0}, 2e-5).row == 3);
  CHECK(*recommend(tradeoff, {0}, 2e-6).row == 5);
  CHECK(recommend(tradeoff, {0}, 5e-7).why_not.find("the best has 1.0e-06") != std::string::npos);
  // Errors below what the reference is certain of are equal: the faster setting is taken.
  const double certain = tradeoff.reference.errors->quantities()[0].certificate;
  REQUIRE(certain > 0);
  tradeoff.rows.clear();
  add("a", 1, 0.5 * certain), add("b", 1.05, 0);
  bound_errors(tradeoff.rows);
  CHECK(*recommend(tradeoff, {0}, 1e-3).row == 0);
}

TEST_CASE("advice for a design covers the gradient, at the same settings as the value", "[tradeoff]") {
  Tradeoff tradeoff = measured(short_five_bar(), 0);
  REQUIRE(tradeoff.ok());
  const std::vector<Quantity>& all = tradeoff.reference.errors->quantities();
  const std::size_t psi = index_of(tradeoff, "objective motion"), gradient = index_of(tradeoff, "gradient of motion");
  const std::vector<std::size_t> asked{psi, gradient};
  tradeoff.rows.clear();
  const auto add = [&](double rtol, std::optional<GradientMethod> method, double seconds, double error) {
    TradeoffRow row;
    row.setting.curve = method ? "gradient" : "simulation";
    row.setting.simulation.integrator.rtol = rtol, row.setting.gradient = method;
    row.wall_seconds = seconds;
    row.errors.setConstant(static_cast<Eigen::Index>(all.size()), std::nan(""));
    row.errors(static_cast<Eigen::Index>(method ? gradient : psi)) = error;
    row.deviations = row.errors;
    tradeoff.rows.push_back(row);
  };
  add(1e-3, {}, 1, 2.8e-4), add(1e-5, {}, 2, 1e-6), add(1e-7, {}, 4, 1e-8);
  add(1e-3, GradientMethod::tlm, 3, 3.5e-2), add(1e-5, GradientMethod::differences, 3.5, 1e-5);
  add(1e-5, GradientMethod::tlm, 5, 2e-4), add(1e-9, GradientMethod::tlm, 20, 1e-9);
  bound_errors(tradeoff.rows);
  CHECK(*recommend(tradeoff, {psi}, 1e-3).row == 0);
  CHECK(*recommend(tradeoff, asked, 1e-3).row == 5);
  CHECK(*recommend(tradeoff, asked, 5e-2).row == 3);
  CHECK_FALSE(recommend(tradeoff, asked, 1e-4).row);  // no value was measured at 1e-9
  tradeoff.rows[2].within_floor = true;               // nor need it be: a looser one is as exact as the reference
  CHECK(*recommend(tradeoff, asked, 1e-4).row == 6);
  std::vector<double> tried;
  const auto slow = [&](std::size_t row) {
    tried.push_back(tradeoff.rows[row].wall_seconds);
    return tried.back() > 3;
  };
  CHECK(*recommend(tradeoff, {psi}, 1e-3, slow).row == 2);
  CHECK(tried == std::vector<double>{1, 2, 4});
}

TEST_CASE("settings that fail are rows with their reasons, and do not end the sweep", "[tradeoff]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  Problem p = pendulum::problem(100, 0.1, 0.1, 0);
  p.scene.simulation.end_time = 8;  // a 32nd is a step too large: the angle turns by more than half a turn
  ObjectiveSpec end;
  end.name = "end", end.terminal = Expression::parse("theta");
  p.objectives = {end};
  const Tradeoff tradeoff = measured(p, 1);
  REQUIRE(tradeoff.ok());
  const auto count = [&](RowStatus status) {
    return std::count_if(tradeoff.rows.begin(), tradeoff.rows.end(),
                         [&](const TradeoffRow& row) { return row.status == status; });
  };
  CHECK(count(RowStatus::failed) > 0);
  CHECK(count(RowStatus::ok) > 20);
  for (const TradeoffRow& row : tradeoff.rows) {
    CHECK(row.message.empty() == (row.status == RowStatus::ok));
    if (row.status != RowStatus::ok) CHECK(row.errors.array().isNaN().all());
  }
}

TEST_CASE("without a budget only the scene's own settings and the defaults are measured", "[tradeoff]") {
  const Tradeoff tradeoff = measured(short_five_bar(), 0);
  REQUIRE(tradeoff.ok());
  REQUIRE(tradeoff.rows.size() == 4);
  REQUIRE((tradeoff.own && tradeoff.defaults && tradeoff.own_gradient && tradeoff.default_gradient));
  CHECK(tradeoff.rows[*tradeoff.own].setting.simulation.integrator.rtol == 1e-7);
  CHECK(tradeoff.rows[*tradeoff.defaults].setting.simulation.integrator.rtol == 1e-8);
  CHECK(in_words(tradeoff.rows[*tradeoff.defaults].setting) == "dopri853 (defaults) at rtol 1e-08");
}

TEST_CASE("a sweep keeps to its budget, says what it skipped, and stops where it is interrupted", "[tradeoff]") {
  const Problem p = short_five_bar();
  const Tradeoff tradeoff = measured(p, 0.1);
  REQUIRE(tradeoff.ok());
  CHECK(std::any_of(tradeoff.rows.begin(), tradeoff.rows.end(), [](const TradeoffRow& row) {
    return row.status == RowStatus::skipped && row.message.find("budget") != std::string::npos;
  }));
  CountedClock clock;
  TradeoffOptions options;
  options.clock = clock.clock();
  int asked = 0;
  options.interrupted = [&] { return ++asked > 20000; };
  const Tradeoff part = measure_tradeoff(p.scene, objectives_of(p), options);
  CHECK(part.interrupted);
  CHECK(part.rows.size() < 200);
}
