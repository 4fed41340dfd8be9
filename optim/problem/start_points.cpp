#include "optim/problem/start_points.hpp"

#include <boost/random/sobol.hpp>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <utility>

#include "optim/problem/variable_scaling.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;

// The standard's distributions differ between libraries; its generators do not.
class Random {
 public:
  explicit Random(long seed) : generator_(static_cast<std::uint64_t>(seed)) {}
  double unit() { return static_cast<double>(generator_() >> 11) * 0x1p-53; }  // in [0, 1)
  Index below(Index n) { return std::min(static_cast<Index>(unit() * static_cast<double>(n)), n - 1); }

 private:
  std::mt19937_64 generator_;
};

Eigen::MatrixXd latin_hypercube(Index dimension, Index count, Random& random) {
  Eigen::MatrixXd points(dimension, count);
  std::vector<Index> slice(static_cast<std::size_t>(count));
  for (Index k = 0; k < dimension; ++k) {
    std::iota(slice.begin(), slice.end(), Index{0});
    for (Index j = count - 1; j > 0; --j)  // Fisher and Yates
      std::swap(slice[static_cast<std::size_t>(j)], slice[static_cast<std::size_t>(random.below(j + 1))]);
    for (Index j = 0; j < count; ++j)
      points(k, j) =
          (static_cast<double>(slice[static_cast<std::size_t>(j)]) + random.unit()) / static_cast<double>(count);
  }
  return points;
}

Eigen::MatrixXd shifted_sobol(Index dimension, Index count, Random& random) {
  Eigen::VectorXd shift(dimension);
  for (double& s : shift) s = random.unit();
  boost::random::sobol sequence(static_cast<std::size_t>(dimension));
  Eigen::MatrixXd points(dimension, count);
  for (Index j = 0; j < count; ++j) {
    for (Index k = 0; k < dimension; ++k) {
      const double u = static_cast<double>(sequence() >> 11) * 0x1p-53 + shift(k);
      points(k, j) = u - std::floor(u);
    }
  }
  return points;
}

}  // namespace

Eigen::MatrixXd unit_points(StartSampling sampling, Index dimension, Index count, long seed) {
  Random random(seed);
  if (dimension == 0 || count == 0) return Eigen::MatrixXd(dimension, count);
  return sampling == StartSampling::sobol ? shifted_sobol(dimension, count, random)
                                          : latin_hypercube(dimension, count, random);
}

std::vector<Eigen::VectorXd> start_values(const std::vector<Parameter>& parameters, const MultistartSpec& spec,
                                          long seed) {
  const VariableScaling scaling(parameters);
  std::vector<Eigen::VectorXd> starts(1, Eigen::VectorXd(scaling.size()));
  for (Index k = 0; k < scaling.size(); ++k) starts[0](k) = parameters[static_cast<std::size_t>(k)].value;
  const Eigen::MatrixXd points = unit_points(spec.sampling, scaling.size(), spec.starts - 1, seed);
  const Eigen::VectorXd width = scaling.x_upper() - scaling.x_lower();
  for (const auto& u : points.colwise()) starts.push_back(scaling.to_rho(scaling.x_lower() + u.cwiseProduct(width)));
  return starts;
}

}  // namespace mbsopt::inline optim
