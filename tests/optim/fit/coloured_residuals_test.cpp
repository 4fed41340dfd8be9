// Standard errors of fits whose residuals are correlated in time.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "optim/fit/identification.hpp"
#include "optim/fit/recovery.hpp"
#include "optim/fit/windows.hpp"
#include "tests/optim/pendulum.hpp"
#include "tests/optim/repetitions.hpp"

using namespace mbsopt;

namespace {

// A process of first order with the correlation time tau, by steps of 1 ms, beside white noise.
std::vector<double> coloured_noise(std::size_t n, double tau, double sigma, double white, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  const double a = std::exp(-1e-3 / tau);
  std::vector<double> noise(n);
  double x = sigma * normal(generator);
  for (double& e : noise) {
    e = x + white * normal(generator);
    x = a * x + std::sqrt(1 - a * a) * sigma * normal(generator);
  }
  return noise;
}

// Rows of a record of 1 ms from `start` on for 4 s, every `stride` ms.
CsvTable part_of(const CsvTable& whole, const std::vector<double>& noise, std::size_t start, std::size_t stride) {
  CsvTable table;
  table.name = "part", table.header = whole.header, table.columns.resize(2);
  for (std::size_t i = start; i <= start + 4000; i += stride) {
    table.columns[0].push_back(whole.columns[0][i] - whole.columns[0][start]);
    table.columns[1].push_back(whole.columns[1][i] + noise[i]);
    table.lines.push_back(table.lines.size() + 2);
  }
  return table;
}

IdentificationResult fit_of(const CsvTable& whole, const std::vector<double>& noise, std::size_t start,
                            std::size_t stride) {
  const std::vector<double>& theta = whole.columns[1];
  Problem p = pendulum::problem(64.2, 0.06, theta[start], (theta[start + 1] - theta[start]) / 1e-3);
  p.scene.simulation.integrator.rtol = 1e-7;
  p.identification.emplace();
  p.identification->variables = {"w2", "c"};
  p.identification->experiments = {pendulum::experiment("run1", {"theta0", "omega0"})};
  return run_identification(p, {part_of(whole, noise, start, stride)});
}

}  // namespace

TEST_CASE("parts of a record with coloured noise agree within what they claim", "[covariance]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const CsvTable whole = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 8.01, 1);
  constexpr unsigned kRecords = 30;
  int pairs = 0, agree = 0, covered = 0, agree_as_white = 0;
  for (const double tau : {0.05, 0.3})
    for (unsigned seed = 0; seed < kRecords; ++seed) {
      const std::vector<double> noise = coloured_noise(whole.rows(), tau, 0.01, 0.003, seed);
      const IdentificationResult one = fit_of(whole, noise, 0, 20), other = fit_of(whole, noise, 4000, 20);
      REQUIRE((one.ok() && other.ok()));
      CHECK(one.statistics.covariance_type == CovarianceType::newey_west);
      for (std::size_t k = 0; k < 2; ++k) {
        const FittedParameter &a = one.parameters[k], &b = other.parameters[k];
        const double apart = std::abs(a.value - b.value), error = std::hypot(a.std_error, b.std_error);
        const double truth = k == 0 ? 64 : 0.055;
        const auto white = [k](const IdentificationResult& fit) {
          return fit.parameters[k].std_error / std::sqrt(fit.statistics.inflation(static_cast<Eigen::Index>(k)));
        };
        ++pairs, agree += apart < 3 * error, agree_as_white += apart < 3 * std::hypot(white(one), white(other));
        covered += (a.ci95[0] <= truth && truth <= a.ci95[1]) + (b.ci95[0] <= truth && truth <= b.ci95[1]);
      }
    }
  WARN(agree << " of " << pairs << " agree, " << agree_as_white << " as white; " << covered << " of " << 2 * pairs
             << " intervals");
  CHECK(agree >= 0.95 * pairs);
  CHECK(covered >= 0.88 * 2 * pairs);  // measured 92 to 97 %; 240 intervals of 95 % scatter by 1.4 %
  CHECK(agree_as_white < 0.9 * pairs);
}

TEST_CASE("standard errors of one motion do not shrink with its sampling rate", "[covariance]") {
  const CsvTable whole = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 4.01, 1);
  const std::vector<double> noise = coloured_noise(whole.rows(), 0.2, 0.01, 0, 3);
  const IdentificationResult slow = fit_of(whole, noise, 0, 20), fast = fit_of(whole, noise, 0, 2);
  for (std::size_t k = 0; k < 4; ++k) {
    CHECK(fast.parameters[k].std_error == Approx(slow.parameters[k].std_error).epsilon(0.1));
    const Eigen::Index i = static_cast<Eigen::Index>(k);
    CHECK(fast.statistics.inflation(i) > 5 * slow.statistics.inflation(i));  // as white they would: by sqrt(10)
  }
}

namespace {

// A slider's record of 10 s with noise of first order, in windows of 1 s or whole.
struct Decay {
  Problem problem = repetitions::slider(50, 0.4);
  std::vector<CsvTable> data;
  Decay(bool windows, bool continuity, double tau) {
    problem.scene.simulation.integrator.rtol = 1e-6;  // far below the noise of 2 %
    problem.scene.simulation.integrator.atol = 1e-8;
    problem.identification.emplace();
    problem.identification->variables = {"k", "c"};
    problem.identification->experiments = {repetitions::slider_run("run", {"x0", "v0"})};
    problem.identification->experiments[0].overrides = {{"v0", 0.1}};
    if (windows) problem.identification->experiments[0].windows = WindowsSpec{1, {}, {}, continuity};
    data = {repetitions::damped_decay(25, 0.2, 0.2, 0.1, 10, 0.02)};
    const std::vector<double> noise = coloured_noise(10001, tau, 0.005, tau > 0.01 ? 0 : 0.005, 5);
    for (std::size_t i = 0; i < data[0].rows(); ++i) data[0].columns[1][i] += noise[20 * i];
  }
};

}  // namespace

TEST_CASE("tied windows have the standard errors and the recovery of the whole record", "[covariance][recovery]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  for (const double tau : {0.001, 0.3}) {
    const Decay whole(false, false, tau), untied(true, false, tau), tied(true, true, tau);
    const IdentificationResult one = run_identification(whole.problem, whole.data),
                               free = run_identification(untied.problem, untied.data),
                               other = run_identification(tied.problem, tied.data);
    REQUIRE((one.ok() && free.ok() && other.ok()));
    const CutProblem cut = cut_into_windows(tied.problem, tied.data),
                     cut_free = cut_into_windows(untied.problem, untied.data);
    const RecoveryOptions options{.seeds = 40};
    const Recovery of_one = recover(whole.problem, whole.data, one, options),
                   of_other = recover(cut.problem, cut.data, other, options),
                   of_free = recover(cut_free.problem, cut_free.data, free, options);
    for (std::size_t k = 0; k < 2; ++k) {
      const double error = one.parameters[k].std_error;
      INFO(tau << " " << one.parameters[k].name << ": whole " << error << ", tied " << other.parameters[k].std_error
               << ", untied " << free.parameters[k].std_error << "; scatters " << of_one.parameters[k].scatter << ", "
               << of_other.parameters[k].scatter << ", " << of_free.parameters[k].scatter);
      CHECK(other.parameters[k].value == Approx(one.parameters[k].value).epsilon(1e-4));
      CHECK(other.parameters[k].std_error == Approx(error).epsilon(0.02));
      // The table by ten blocks; of the untied ones these cross windows, which gives up to 40 % less.
      CHECK(of_one.parameters[k].scatter == Approx(error).epsilon(0.25));
      CHECK(of_free.parameters[k].scatter == Approx(free.parameters[k].std_error).epsilon(0.4));
      CHECK(of_other.parameters[k].scatter == Approx(of_one.parameters[k].scatter).epsilon(0.02));
    }
  }
}

TEST_CASE("many short records tell the variance by their scatter, whatever happens within each", "[covariance]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  // A slider is released 24 times; its sensor has a slow error, another one each time, that outlives a tenth of a
  // record.
  constexpr unsigned kRepetitions = 12;
  Eigen::ArrayXd k(kRepetitions), error(kRepetitions);
  for (unsigned repetition = 0; repetition < kRepetitions; ++repetition) {
    Problem p = repetitions::slider(50, 1.2);
    p.identification.emplace();
    p.identification->variables = {"k", "c"};
    std::vector<CsvTable> data;
    for (unsigned e = 0; e < 24; ++e) {
      p.identification->experiments.push_back(repetitions::slider_run("run" + std::to_string(e), {"x0", "v0"}));
      data.push_back(repetitions::damped_decay(25, 0.6, 0.2, 0.1, 2, 0.05));
      const std::vector<double> noise = coloured_noise(2001, 0.3, 0.005, 0, 24 * repetition + e);
      for (std::size_t i = 0; i < data.back().rows(); ++i) data.back().columns[1][i] += noise[50 * i];
    }
    const IdentificationResult fit = run_identification(p, data);
    INFO(fit.message);
    REQUIRE(fit.ok());
    CHECK(fit.statistics.covariance_type == CovarianceType::windows);
    k(repetition) = fit.parameters[0].value, error(repetition) = fit.parameters[0].std_error;
    CHECK(fit.parameters[2].std_error > 0);  // free in one record: what this record gives
  }
  const double scatter = std::sqrt((k - k.mean()).square().sum() / (kRepetitions - 1));
  INFO("scatter " << scatter << ", standard errors " << std::sqrt(error.square().mean()));
  // Eleven degrees of freedom: the scatter by itself is known to 21 %.
  CHECK(std::sqrt(error.square().mean()) == Approx(scatter).epsilon(0.5));
  CHECK(std::abs(k.mean() - 50) < 4 * scatter / std::sqrt(static_cast<double>(kRepetitions)));
}

TEST_CASE("known parameters are found again from simulated records", "[recovery]") {
  const repetitions::Study study = repetitions::studies()[1];
  const std::vector<CsvTable> data = repetitions::repeated(study, 3);
  const IdentificationResult fit = run_identification(study.problem, data);
  REQUIRE(fit.ok());
  const Recovery recovery = recover(study.problem, data, fit, {.seeds = 60});
  CHECK(recovery.fits == 60);
  REQUIRE(recovery.parameters.size() == fit.parameters.size());
  for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
    const RecoveredParameter& p = recovery.parameters[k];
    INFO(p.name << ": bias " << p.bias() << ", scatter " << p.scatter << ", share " << p.share);
    CHECK(p.truth == fit.parameters[k].value);
    CHECK(std::abs(p.bias()) < 4 * p.scatter / std::sqrt(60.));
    CHECK(p.scatter == Approx(fit.parameters[k].std_error).epsilon(0.35));  // of 60: 9 %, beside that of the record
    CHECK(p.share >= 0.85);                                                 // 60 intervals of 95 %: 2.8 %
  }
}
