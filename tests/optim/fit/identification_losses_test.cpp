// Losses, priors, scales and estimated sigmas of whole identifications.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "optim/fit/experiment.hpp"
#include "optim/fit/identification.hpp"
#include "tests/optim/pendulum.hpp"

using namespace mbsopt;
using Catch::Matchers::Contains;

namespace {

constexpr double kSigma = 0.01;
constexpr LossType kRobust[] = {LossType::huber, LossType::cauchy, LossType::tukey};

Problem fit_problem(double w2 = 64.5, double c = 0.08) {
  Problem p = pendulum::problem(w2, c, 1.5, 1.5);
  p.identification.emplace();
  p.identification->variables = {"w2", "c"};
  p.identification->experiments = {pendulum::experiment("run1", {"theta0", "omega0"})};
  return p;
}

CsvTable noisy(unsigned seed, double sigma = kSigma) {
  CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 3);
  pendulum::add_noise(data, sigma, seed);
  return data;
}

// Every tenth sample is off by 20 to 60 sigma, all to one side.
CsvTable with_outliers(CsvTable data, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> size(20 * kSigma, 60 * kSigma);
  for (std::size_t i = 4; i < data.columns[1].size(); i += 10) data.columns[1][i] += size(generator);
  return data;
}

IdentificationResult fitted(Problem problem, const Loss& loss, const CsvTable& data) {
  problem.identification->loss = loss;
  problem.identification->covariance = CovarianceType::white;  // outliers come at regular times, which is no colour
  return run_identification(problem, {data});
}

// d cost/d rho of a loss at values of the parameters, from residuals and Jacobian alone: sum rho'(z^2) z J, each term
// written out here, over sum |J| as a measure.
double stationarity(const Problem& p, const CsvTable& data, const Eigen::VectorXd& u, LossType type, double s) {
  const Experiment run(p.scene, p.identification->experiments[0], "here", data, u, {{0, 0}, {1, 1}, {2, 2}, {3, 3}});
  const Experiment::Residuals r = run.residuals(u);
  Eigen::VectorXd pull = r.z;
  for (double& z : pull) {
    const double a = std::abs(z), x = z * z / (s * s);
    if (type == LossType::huber) z = std::copysign(std::min(a, s), z);
    if (type == LossType::cauchy) z = z / (1 + x);
    if (type == LossType::tukey) z = a < s ? z * (1 - x) * (1 - x) : 0;
  }
  double worst = 0;
  for (int k = 0; k < 4; ++k) worst = std::max(worst, std::abs(r.z_u.col(k).dot(pull)) / r.z_u.col(k).norm());
  return worst;  // of noise, about 1
}

Eigen::VectorXd values(const IdentificationResult& result) {
  Eigen::VectorXd u(static_cast<Eigen::Index>(result.parameters.size()));
  for (Eigen::Index k = 0; k < u.size(); ++k) u(k) = result.parameters[static_cast<std::size_t>(k)].value;
  return u;
}

}  // namespace

TEST_CASE("each loss ends where its own pulls balance, and no other loss's do", "[identification][loss]") {
  const CsvTable data = with_outliers(noisy(3), 5);
  const Problem p = fit_problem();
  constexpr double s = 1.5;
  constexpr LossType all[] = {LossType::squared, LossType::huber, LossType::cauchy, LossType::tukey};
#ifdef __SANITIZE_ADDRESS__
  constexpr LossType tried[] = {LossType::huber};
#else
  const auto& tried = all;
#endif
  for (const LossType type : tried) {
    Loss loss{type, {}};
    if (type != LossType::squared) loss.scale = s;
    Problem tight = p;
    tight.identification->tolerance = 1e-12;
    tight.scene.simulation.integrator.rtol = 1e-11, tight.scene.simulation.integrator.atol = 1e-13;
    const IdentificationResult result = fitted(tight, loss, data);
    INFO(result.message);
    REQUIRE(result.ok());
    for (const LossType other : all) {
      const double left = stationarity(p, data, values(result), other, s);
      if (other == type)
        CHECK(left < 1e-3);
      else
        CHECK(left > 0.05);
    }
  }
}

TEST_CASE("10 % gross outliers move robust estimates by less than two standard errors", "[identification][loss]") {
#ifdef __SANITIZE_ADDRESS__
  constexpr unsigned kSeeds = 1;
#else
  constexpr unsigned kSeeds = 5;
#endif
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const CsvTable clean = noisy(seed), dirty = with_outliers(clean, seed + 50);
    const IdentificationResult before = fitted(fit_problem(), {}, clean);
    REQUIRE(before.ok());
    const auto moved = [&](const IdentificationResult& after) {
      double most = 0;
      for (std::size_t k = 0; k < 4; ++k)
        most = std::max(
            most, std::abs(after.parameters[k].value - before.parameters[k].value) / before.parameters[k].std_error);
      return most;
    };
    for (const LossType type : kRobust) {
      const IdentificationResult after = fitted(fit_problem(), {type}, dirty);
      INFO("loss " << static_cast<int>(type) << ", seed " << seed << ": " << moved(after) << "; " << after.message);
      REQUIRE(after.ok());
      CHECK(moved(after) < 2);
      // And its own intervals know: they hold the truth within 4 standard errors, and are not far wider.
      CHECK(std::abs(after.parameters[0].value - 64) < 4 * after.parameters[0].std_error);
      CHECK(after.parameters[0].std_error < 1.6 * before.parameters[0].std_error);
    }
    CHECK(moved(fitted(fit_problem(), {}, dirty)) > 5);
  }
}

TEST_CASE("Tukey's loss finds its way from a start at which it sees only outliers", "[identification][loss]") {
  // 2 % off in frequency: after 3 s residuals are 0.3 rad, 30 sigma.
  const IdentificationResult result = fitted(fit_problem(65.3, 0.2), {LossType::tukey}, with_outliers(noisy(2), 9));
  INFO(result.message);
  REQUIRE(result.ok());
  CHECK(std::abs(result.parameters[0].value - 64) < 4 * result.parameters[0].std_error);
}

TEST_CASE("a normal prior pulls as one more measurement of the parameter", "[identification][prior]") {
  // Only an offset is unknown: its posterior is the precision-weighted mean of data and prior.
  Problem p = fit_problem(64, 0.055);
  testing::add_parameters(p.scene, {{"offset", 0}});
  p.scene.parameters.back().prior = Prior{0.3, 0.002};
  p.scene.parameters[2].value = 1.53, p.scene.parameters[3].value = 1.55;
  p.identification->variables = {"offset"}, p.identification->experiments[0].free.clear();
  p.identification->experiments[0].channels[0].bias = Expression::parse("offset");
  p.identification->sigma_is_known = true;
  p.identification->covariance = CovarianceType::white;  // the prior takes the residuals off zero
  CsvTable data = noisy(4);
  const Experiment run(p.scene, p.identification->experiments[0], "here", data,
                       (Eigen::VectorXd(5) << 64, 0.055, 1.53, 1.55, 0).finished(), {{4, 0}});
  const Eigen::VectorXd r = kSigma * run.residuals(Eigen::VectorXd::Zero(1)).z;  // without offset
  const double n = static_cast<double>(r.size());
  const double data_precision = n / (kSigma * kSigma), prior_precision = 1 / (0.002 * 0.002);
  const double expected = (data_precision * r.mean() + prior_precision * 0.3) / (data_precision + prior_precision);
  const IdentificationResult result = run_identification(p, {data});
  REQUIRE(result.ok());
  CHECK(result.parameters[0].value == Approx(expected).epsilon(1e-8));
  CHECK(result.parameters[0].std_error == Approx(1 / std::sqrt(data_precision + prior_precision)).epsilon(1e-8));
  REQUIRE(result.parameters[0].prior);
  CHECK(result.parameters[0].prior->mean == 0.3);
  CHECK(result.samples == 301);
  CHECK(result.residuals.size() == 301);
  CHECK(result.statistics.degrees_of_freedom == 301);
}

TEST_CASE("residuals that known sigmas do not explain are a warning", "[identification]") {
  const auto warned = [](double sigma, bool is_known) {
    Problem p = fit_problem();
    p.identification->sigma_is_known = is_known;
    p.identification->covariance = CovarianceType::white;
    p.identification->experiments[0].channels[0].sigma = sigma;
    const IdentificationResult result = run_identification(p, {noisy(3)});
    REQUIRE(result.ok());
    std::string found;
    for (const std::string& warning : result.warnings)
      if (warning.find("sigma_is_known") != std::string::npos) found = warning;
    return found;
  };
  CHECK(warned(kSigma, true).empty());
  CHECK(warned(kSigma / 1.5, true).empty());
  CHECK(warned(kSigma / 4, false).empty());
  CHECK_THAT(warned(kSigma / 4, true), Contains("residuals are 4") && Contains("Sigma is too small, or the model"));
  CHECK_THAT(warned(4 * kSigma, true), Contains("residuals are 0.2") && Contains("Sigma is too large"));
}

TEST_CASE("a fit that explains less than a mean does is a warning", "[identification]") {
  const auto warned = [](double scale) {
    Problem p = fit_problem();
    CsvTable measured = noisy(3);
    for (double& value : measured.columns[1]) value *= scale;  // a unit that the header does not say
    const IdentificationResult result = run_identification(p, {measured});
    return std::ranges::any_of(result.warnings, [](const std::string& warning) {
      return warning.find("the fit explains nothing of") != std::string::npos;
    });
  };
  CHECK_FALSE(warned(1));
  CHECK(warned(1e3));
}

TEST_CASE("a prior decides what the data leave open, for each free value by itself", "[identification][prior]") {
  Problem p = fit_problem(64, 0.055);
  testing::add_parameters(p.scene, {{"m_arm", 0.4}});
  testing::add_parameters(p.scene, {{"m_load", 0.6}});
  p.scene.bodies[0].mass = Expression::parse("m_arm + m_load");
  p.scene.parameters[4].prior = Prior{0.35, 0.02};
  p.scene.parameters[2].prior = Prior{1.5, 10};  // theta0, free in both runs
  p.identification->variables = {"m_arm", "m_load", "c"};
  p.identification->experiments.push_back(pendulum::experiment("run2", {"theta0", "omega0"}));
  const IdentificationResult result = run_identification(p, {noisy(1), noisy(2)});
  REQUIRE(result.ok());
  CHECK(result.statistics.unidentifiable.empty());
  CHECK(result.parameters[0].value == Approx(0.35).epsilon(1e-4));
  CHECK(result.parameters[0].std_error == Approx(0.02).epsilon(1e-3));
  CHECK(result.parameters[0].value + result.parameters[1].value == Approx(1).epsilon(0.01));
  CHECK(result.statistics.degrees_of_freedom == 2 * 301 + 3 - 7);  // three priors: m_arm, theta0 twice
}

TEST_CASE("logarithmic scales change the path of a fit, not its end", "[identification][scale]") {
  const CsvTable data = noisy(6);
  const IdentificationResult linear = fitted(fit_problem(), {}, data);
  for (const ParameterScale scale : {ParameterScale::log, ParameterScale::log10}) {
    Problem p = fit_problem();
    p.scene.parameters[0].scale = p.scene.parameters[1].scale = scale;
    p.scene.parameters[1].lower = 1e-6;
    const IdentificationResult result = fitted(p, {}, data);
    REQUIRE(result.ok());
    for (std::size_t k = 0; k < 4; ++k) {
      CHECK(result.parameters[k].value == Approx(linear.parameters[k].value).epsilon(1e-6));
      CHECK(result.parameters[k].std_error == Approx(linear.parameters[k].std_error).epsilon(1e-4));
    }
    // Another path: the first step is taken in other variables.
    REQUIRE(result.history.size() > 2);
    CHECK(result.history[1].parameters(1) != Approx(linear.history[1].parameters(1)).epsilon(1e-6));
  }
}

TEST_CASE("sigmas are estimated channel by channel, and weigh the channels", "[identification][sigma]") {
  Problem p = fit_problem();
  p.scene.sensors.push_back(p.scene.sensors[0]);
  p.scene.sensors[1].name = "omega", p.scene.sensors[1].quantity = "rate";
  ChannelSpec rate;
  rate.column = "omega", rate.sensor = "omega";
  auto& channels = p.identification->experiments[0].channels;
  channels.push_back(rate);
  for (ChannelSpec& c : channels) c.estimate_sigma = SigmaEstimate::own, c.sigma = 1.0;

  // Angles to 0.004 rad; rates by differences of the exact motion, to 0.5 rad/s.
  CsvTable data = noisy(8, 0.0);
  const std::vector<double> exact = data.columns[1];
  pendulum::add_noise(data, 0.004, 8);
  const CsvTable fine = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 3.002, 1);
  data.header.push_back("omega"), data.columns.emplace_back();
  std::mt19937 generator(3);
  std::normal_distribution<double> normal(0, 0.5);
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const std::size_t at = std::max<std::size_t>(10 * i, 1);
    data.columns[2].push_back((fine.columns[1][at + 1] - fine.columns[1][at - 1]) / 2e-3 + normal(generator));
  }
  const IdentificationResult result = run_identification(p, {data});
  INFO(result.message);
  REQUIRE(result.ok());
  const auto& fit = result.experiments[0].channels;
  CHECK(fit[0].sigma_is_estimated);
  CHECK(fit[0].sigma == Approx(0.004).epsilon(0.15));
  CHECK(fit[1].sigma == Approx(0.5).epsilon(0.15));
  // Stationary: every channel's mean square of z is (N - P)/N.
  for (const ChannelFit& c : fit) CHECK(c.rms_scaled * c.rms_scaled == Approx(598. / 602).epsilon(1e-5));
  CHECK(result.statistics.residual_variance == Approx(1).epsilon(1e-4));
  CHECK(std::abs(result.parameters[0].value - 64) < 4 * result.parameters[0].std_error);

  // The same as with these sigmas given; and far from the fit with equal ones.
  Problem given = p;
  auto& fixed = given.identification->experiments[0].channels;
  for (std::size_t c = 0; c < 2; ++c) fixed[c].estimate_sigma = SigmaEstimate::none, fixed[c].sigma = fit[c].sigma;
  const IdentificationResult same = run_identification(given, {data});
  for (ChannelSpec& c : fixed) c.sigma = 1.0;
  const IdentificationResult equal = run_identification(given, {data});
  for (std::size_t k = 0; k < 4; ++k) {
    CHECK(result.parameters[k].value == Approx(same.parameters[k].value).epsilon(1e-6));
    CHECK(result.parameters[k].std_error == Approx(same.parameters[k].std_error).epsilon(1e-3));
  }
  CHECK(equal.parameters[0].std_error > 3 * result.parameters[0].std_error);
  CHECK_FALSE(same.experiments[0].channels[0].sigma_is_estimated);
}

TEST_CASE("one sigma for a column of all experiments, at the cost of a fit with given sigmas",
          "[identification][sigma]") {
  Problem p = fit_problem();
  p.identification->experiments.push_back(pendulum::experiment("run2", {"theta0", "omega0"}));
  for (ExperimentSpec& e : p.identification->experiments) {
    e.channels[0].estimate_sigma = SigmaEstimate::shared, e.channels[0].sigma = 1.0;
    e.channels.push_back(e.channels[0]);  // the same angle, by a worse sensor
    e.channels[1].column = "worse";
  }
  std::vector<CsvTable> data{noisy(4), noisy(5)};
  for (CsvTable& table : data) {
    table.header.push_back("worse"), table.columns.push_back(noisy(6).columns[1]);
    std::mt19937 generator(9);
    std::normal_distribution<double> normal(0, 0.1);
    for (double& x : table.columns[2]) x += normal(generator);
  }
  const IdentificationResult shared = run_identification(p, data);
  INFO(shared.message);
  REQUIRE(shared.ok());
  const auto sigma = [&](std::size_t e, std::size_t c) { return shared.experiments[e].channels[c].sigma; };
  for (const std::size_t c : {0u, 1u}) {
    CHECK(sigma(0, c) == sigma(1, c));
    const auto& one = shared.experiments[0].channels[c];
    const auto& other = shared.experiments[1].channels[c];
    const double n = 602, f = (1204. - 6) / 1204;
    CHECK(sigma(0, c) == Approx(std::sqrt(301 * (one.rms * one.rms + other.rms * other.rms) / (n * f))).epsilon(1e-9));
    for (ExperimentSpec& e : p.identification->experiments)
      e.channels[c].sigma = sigma(0, c), e.channels[c].estimate_sigma = SigmaEstimate::none;
  }
  CHECK(sigma(0, 0) == Approx(0.01).epsilon(0.1));
  CHECK(sigma(0, 1) == Approx(0.1).epsilon(0.1));
  const IdentificationResult known = run_identification(p, data);
  for (std::size_t k = 0; k < known.parameters.size(); ++k)
    CHECK(shared.parameters[k].value == Approx(known.parameters[k].value).epsilon(1e-6));
  WARN(shared.evaluations << " evaluations, with given sigmas " << known.evaluations);
  CHECK(shared.evaluations <= 2 * known.evaluations);
  // The likelihoods are equal, two parameters are counted for the sigmas, one for the scale of given ones.
  CHECK(shared.aic == Approx(known.aic + 2).margin(0.1));
  CHECK(shared.bic > shared.aic);
}

TEST_CASE("under a robust loss sigma is that of the bulk, whatever the outliers", "[identification][sigma]") {
  Problem p = fit_problem();
  p.identification->experiments[0].channels[0].estimate_sigma = SigmaEstimate::own;
  p.identification->experiments[0].channels[0].sigma = 0.1;
  p.identification->loss = {LossType::huber};
  const IdentificationResult result = run_identification(p, {with_outliers(noisy(7), 11)});
  INFO(result.message);
  REQUIRE(result.ok());
  // 10 % of outliers raise the median of |r| by 13 %; its own scatter with 301 samples is 6 %.
  CHECK(result.experiments[0].channels[0].sigma == Approx(1.13 * kSigma).epsilon(0.18));
  p.identification->loss = {};
  CHECK(run_identification(p, {with_outliers(noisy(7), 11)}).experiments[0].channels[0].sigma > 5 * kSigma);
}

TEST_CASE("Tukey's loss finds its way from a sigma that is far too small, in the fit and where it validates",
          "[identification][loss][sigma]") {
  Problem p = fit_problem(64.5, 0.1);
  p.identification->loss = {LossType::tukey};
  p.identification->experiments[0].channels[0].estimate_sigma = SigmaEstimate::own;
  p.identification->experiments[0].channels[0].sigma = 1e-4;
  p.identification->experiments.push_back(pendulum::experiment("check", {"theta0", "omega0"}));
  p.identification->experiments[1].validate = true;
  p.identification->experiments[1].overrides = {{"theta0", 1.8}, {"omega0", 1.2}};  // 0.3 rad off: 27 sigma
  const IdentificationResult result = run_identification(p, {with_outliers(noisy(7), 11), with_outliers(noisy(8), 12)});
  INFO(result.message << "; " << result.experiments[1].message);
  REQUIRE(result.ok());
  CHECK(std::abs(result.parameters[0].value - 64) < 4 * result.parameters[0].std_error);
  CHECK(result.experiments[0].channels[0].sigma == Approx(1.13 * kSigma).epsilon(0.18));
  // Found, with the shared parameters as the other record has them, whose errors are not in its standard error.
  CHECK(result.experiments[1].refitted.at(0).value == Approx(1.53).margin(0.005));
}

TEST_CASE("an exact record has no sigma to estimate, and does not divide by it", "[identification][sigma]") {
  Problem p = fit_problem();
  p.identification->experiments[0].channels[0].estimate_sigma = SigmaEstimate::own;
  const IdentificationResult result = run_identification(p, {pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2)});
  CHECK(result.parameters[0].value == Approx(64).epsilon(1e-6));
  CHECK(std::isfinite(result.statistics.std_error(0)));
  CHECK(result.experiments[0].channels[0].sigma > 0);
}

TEST_CASE("of m g a/J only the quotient is determined, and it is called that", "[identification][identifiability]") {
  Problem p = fit_problem(64, 0.055);
  testing::add_parameters(p.scene, {{"m", 0.5}, {"g", 9.81}, {"a", 0.1}, {"J0", 0.5 * 9.81 * 0.1 / 63}});
  p.scene.gravity = {0.0, Expression::parse("-g"), 0.0};
  p.scene.bodies[0].mass = Expression::parse("m");
  p.scene.bodies[0].com = {0.0, Expression::parse("a"), 0.0};
  p.scene.bodies[0].inertia.zz = Expression::parse("J0 - m*a^2");
  std::get<Rsda>(p.scene.forces[0].kind).damping = Expression::parse("c*J0");
  p.identification->variables = {"m", "g", "a", "J0", "c"};
  const IdentificationResult result = run_identification(p, {noisy(1)});
  INFO(result.message);
  REQUIRE(result.ok());
  CHECK(result.statistics.unidentifiable == std::vector<std::string>{"m, g, a, J0: only m*g*a/J0 is determined"});
  CHECK(std::isfinite(result.parameters[4].std_error));
  const auto value = [&](std::size_t i) { return result.parameters[i].value; };
  CHECK(value(0) * value(1) * value(2) / value(3) == Approx(64).epsilon(1e-3));
}

TEST_CASE("the cost before and after is by the same sigmas and the same loss", "[identification][loss]") {
  const CsvTable data = noisy(7);
  Problem p = fit_problem();
  p.identification->experiments[0].channels[0].sigma = 0.5;
  p.identification->experiments[0].channels[0].estimate_sigma = SigmaEstimate::own;
  const LossType loss = GENERATE(LossType::squared, LossType::tukey);
  const IdentificationResult result = fitted(p, {loss}, data);
  INFO(result.message);
  REQUIRE(result.ok());
  const double sigma = result.experiments[0].channels[0].sigma;
  CHECK(result.experiments[0].channels[0].sigma_is_estimated);
  CHECK(sigma == Approx(kSigma).epsilon(0.2));
  p.identification->experiments[0].channels[0].sigma = sigma;
  Eigen::VectorXd start(4);
  start << 64.5, 0.08, 1.5, 1.5;
  const Experiment run(p.scene, p.identification->experiments[0], "here", data, start,
                       {{0, 0}, {1, 1}, {2, 2}, {3, 3}});
  const Loss by{loss};
  double cost = 0;
  for (const double z : run.residuals(start).z) cost += 0.5 * by.at(z * z).rho;
  CHECK(result.cost_initial == Approx(cost).epsilon(1e-9));
  CHECK(result.cost_final < result.cost_initial);
  // Each iteration as well, each once.
  REQUIRE(result.history.size() > 2);
  CHECK(result.history.front().cost == result.cost_initial);
  CHECK(result.history.back().cost == Approx(result.cost_final).epsilon(1e-9));
  for (std::size_t k = 0; k < result.history.size(); ++k) {
    INFO("row " << k);
    CHECK(result.history[k].iteration == static_cast<int>(k));
    CHECK(result.history[k].cost >= result.cost_final * (1 - 1e-6));
  }
}

TEST_CASE("a fit of wild data under a loss without pull far out is no fit", "[identification][loss]") {
  CsvTable data = noisy(3);
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> wild(-1e3, 1e3);
  for (double& x : data.columns[1]) x = wild(generator);
  const IdentificationResult result = fitted(fit_problem(), {LossType::tukey}, data);
  INFO(result.message);
  CHECK_FALSE(result.ok());
  for (const FittedParameter& p : result.parameters) CHECK(std::isnan(p.std_error));
  CHECK(result.statistics.correlation.size() == 0);
  CHECK_FALSE(result.statistics.none.empty());
}
