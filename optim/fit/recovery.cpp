#include "optim/fit/recovery.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <random>
#include <utility>

#include "optim/fit/score_variance.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "optim/machine/on_threads.hpp"

namespace mbsopt::inline optim {
namespace {

// One channel of a motion: where its samples stand in the tables, what the model says there, and what it leaves.
struct ResampledChannel {
  std::size_t column;
  std::vector<std::pair<std::size_t, std::size_t>> rows;  // tables, and rows of these
  std::vector<double> model, noise;
};

std::vector<ResampledChannel> records_of(const Problem& problem, const std::vector<CsvTable>& data,
                                         const IdentificationResult& fit) {
  const std::vector<ExperimentSpec>& experiments = problem.identification->experiments;
  const RecordChannels channels = record_channels(*problem.identification);
  std::vector<ResampledChannel> records;
  for (const auto& [e, c] : channels.all)
    records.push_back({data[e].find_column(experiments[e].channels[c].column), {}, {}, {}});
  for (const ResidualRow& sample : fit.residuals) {
    ResampledChannel& record = records[channels.first[sample.experiment] + sample.channel];
    record.rows.emplace_back(sample.experiment, sample.row);
    record.model.push_back(sample.model);
    record.noise.push_back(sample.measured - sample.model);
  }
  // Residuals of a fit are smaller than the noise, by the parameters that took part of it: sqrt(N/(N - P)), where
  // equations that tie windows count for less of P.
  const auto priors = std::ranges::count_if(fit.parameters, [](const auto& p) { return p.prior.has_value(); });
  const double N = static_cast<double>(fit.samples);
  const double left = static_cast<double>(fit.statistics.degrees_of_freedom - priors);
  const double larger = left > 0 ? std::sqrt(N / left) : 1;
  for (ResampledChannel& record : records) {
    if (record.noise.empty()) continue;
    Eigen::Map<Eigen::ArrayXd> noise(record.noise.data(), std::ssize(record.noise));
    noise = larger * (noise - noise.mean());
  }
  return records;
}

void simulate_noise(const ResampledChannel& record, std::size_t block, std::mt19937& generator,
                    std::vector<CsvTable>& tables) {
  const std::size_t n = record.rows.size();
  std::size_t from = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (i % block == 0) from = generator() % n;
    const auto [table, row] = record.rows[i];
    tables[table].columns[record.column][row] = record.model[i] + record.noise[(from + i % block) % n];
  }
}

// Leaves out the experiments that validate.
void keep_fitted(Problem& problem, std::vector<CsvTable>& data) {
  std::vector<ExperimentSpec>& experiments = problem.identification->experiments;
  for (std::size_t e = experiments.size(); e-- > 0;)
    if (experiments[e].validate) {
      experiments.erase(experiments.begin() + static_cast<std::ptrdiff_t>(e));
      data.erase(data.begin() + static_cast<std::ptrdiff_t>(e));
    }
}

// Interpolates linearly between the order statistics.
double percentile(std::vector<double>& values, double part) {
  std::ranges::sort(values);
  const double at = part * static_cast<double>(values.size() - 1);
  const std::size_t below = static_cast<std::size_t>(at), above = std::min(below + 1, values.size() - 1);
  return values[below] + (at - static_cast<double>(below)) * (values[above] - values[below]);
}

}  // namespace

Recovery recover(const Problem& problem, const std::vector<CsvTable>& data, const IdentificationResult& fit,
                 const RecoveryOptions& options) {
  const std::vector<ResampledChannel> records = records_of(problem, data, fit);
  const bool in_blocks = fit.statistics.covariance_type != CovarianceType::white;
  std::mutex progress_lock;
  std::atomic<bool> stopped = false;
  int done = 0;
  std::vector<IdentificationResult> results(static_cast<std::size_t>(options.seeds));
  on_threads(results.size(), options.threads, [&](std::size_t job) {
    if (stopped) return;
    std::mt19937 generator(static_cast<unsigned>(job + 1));
    std::vector<CsvTable> simulated = data;
    for (const ResampledChannel& record : records) {
      const auto block = static_cast<std::size_t>(kLagPart * static_cast<double>(record.rows.size()));
      simulate_noise(record, in_blocks ? std::max<std::size_t>(1, block) : 1, generator, simulated);
    }
    Problem again = problem;
    keep_fitted(again, simulated);
    IdentificationOptions identification;
    identification.user_forces = options.user_forces;
    identification.simulation_progress = [&](double t) {
      const std::scoped_lock lock(progress_lock);
      if (options.simulation_progress && !options.simulation_progress(t)) stopped = true;
      return !stopped;
    };
    results[job] = run_identification(again, simulated, identification);
    const std::scoped_lock lock(progress_lock);
    if (options.progress && !options.progress(++done)) stopped = true;
  });

  const std::size_t P = fit.parameters.size();
  std::vector<std::vector<double>> found(P);
  Recovery recovery;
  for (const FittedParameter& p : fit.parameters) recovery.parameters.push_back({p.name, p.unit, p.value});
  for (const IdentificationResult& result : results) {
    if (result.parameters.empty() || result.status == SolverStatus::stopped) continue;
    result.ok() ? ++recovery.fits : ++recovery.failed;
    for (std::size_t k = 0; result.ok() && k < P; ++k) {
      const FittedParameter& p = result.parameters[k];
      const double truth = fit.parameters[k].value;
      found[k].push_back(p.value);
      recovery.parameters[k].share += p.ci95[0] <= truth && truth <= p.ci95[1];
    }
  }
  if (recovery.fits < 2) recovery.parameters.clear();
  for (std::size_t k = 0; k < recovery.parameters.size(); ++k) {
    RecoveredParameter& p = recovery.parameters[k];
    const Eigen::Map<const Eigen::ArrayXd> values(found[k].data(), recovery.fits);
    p.mean = values.mean();
    p.scatter = std::sqrt((values - p.mean).square().sum() / (recovery.fits - 1));
    p.share /= recovery.fits;
    p.ci95[0] = percentile(found[k], 0.025);
    p.ci95[1] = percentile(found[k], 0.975);
  }
  return recovery;
}

}  // namespace mbsopt::inline optim
