#include "optim/objective/frequency_response.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <stdexcept>

#include "core/start/assembly.hpp"
#include "optim/differences/difference_ladder.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

std::complex<double> response(const Linearisation& x, double f) { return transfer(x, {0, kTurn * f})(0, 0); }

// d|H|^2/df up to a factor: Re(conj(H) H_f),  H_s = -C (s - A)^-2 B
double slope(const Linearisation& x, double f) {
  const std::complex<double> s(0, kTurn * f);
  Eigen::MatrixXcd left = -x.A;
  left.diagonal().array() += s;
  const Eigen::PartialPivLU<Eigen::MatrixXcd> factor(left);
  const Eigen::MatrixXcd X = factor.solve(x.B.cast<std::complex<double>>());
  const std::complex<double> H = (x.C * X + x.D)(0, 0), H_s = -(x.C * factor.solve(X))(0, 0);
  return (std::conj(H) * std::complex<double>(0, 1) * H_s).real();
}

template <class Element>
int index_of(const std::vector<Element>& elements, const std::string& name) {
  const auto found = std::ranges::find(elements, name, &Element::name);
  if (found == elements.end()) throw std::invalid_argument("frequency_response: there is no '" + name + "'");
  return static_cast<int>(found - elements.begin());
}

}  // namespace

FrequencyResponse::FrequencyResponse(const Scene& scene, const FrequencyResponseSpec& spec)
    : scene_(scene),
      spec_(spec),
      input_(index_of(scene.parameters, spec.input)),
      output_(index_of(scene.sensors, spec.output)),
      programs_(std::make_shared<ScenePrograms>(scene_)) {}

Linearisation FrequencyResponse::linearised(const VectorXd& rho, const UserForces& forces) const {
  std::vector<bool> active(scene_.parameters.size(), false);
  active[static_cast<std::size_t>(input_)] = true;
  const Mechanism mechanism(scene_, rho, active, forces, programs_);
  const double t = scene_.simulation.start_time;
  const Assembly start(mechanism, t);
  if (!start.result().ok) throw std::runtime_error(start.result().message);
  try {
    Linearisation x = linearise(mechanism, scene_.simulation.formulation, {t, start.result().y, start.result().angles},
                                {input_}, {output_});
    if (is_equilibrium(x)) return x;
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(error.what());
  }
  throw std::runtime_error(
      "the initial state is no equilibrium, so there is no response near it: set initial.equilibrium");
}

// Resonances and their flanks, and between them as many as a smooth curve needs.
std::vector<double> FrequencyResponse::frequencies(const Linearisation& x) const {
  constexpr int kBetween = 100;
  constexpr double kFlanks[] = {-3, -1, -0.3, 0, 0.3, 1, 3};  // in widths of a resonance, zeta f
  const double from = *spec_.from, to = *spec_.to;
  std::vector<double> all{from, to};
  for (int k = 1; k < kBetween; ++k) all.push_back(from + (to - from) * k / kBetween);
  for (const std::complex<double>& lambda : x.eigenvalues) {
    const double f = frequency(lambda), width = std::abs(lambda.real()) / kTurn;
    for (const double flank : kFlanks)
      if (const double here = f + flank * width; here > from && here < to) all.push_back(here);
  }
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

double FrequencyResponse::rms(const Linearisation& x) const {
  constexpr double kExact = 1e-10;
  constexpr unsigned kDepth = 10;
  const std::vector<double> all = frequencies(x);
  double sum = 0;
  for (std::size_t k = 1; k < all.size(); ++k)
    sum += boost::math::quadrature::gauss_kronrod<double, 15>::integrate(
        [&](double f) { return std::norm(response(x, f)); }, all[k - 1], all[k], kDepth, kExact);
  return std::sqrt(spec_.spectrum * sum);
}

double FrequencyResponse::value_at(const Linearisation& x, double f) const {
  if (spec_.value == "rms") return rms(x);
  const std::complex<double> H = response(x, f);
  return spec_.value == "phase" ? std::arg(H) : std::abs(H);
}

// The highest first.
std::vector<FrequencyResponse::Peak> FrequencyResponse::peaks_of(const Linearisation& x) const {
  constexpr std::size_t kMost = 8;
  const std::vector<double> f = frequencies(x);
  std::vector<double> sizes;
  for (const double here : f) sizes.push_back(std::abs(response(x, here)));
  std::vector<Peak> peaks;
  for (std::size_t k = 0; k < f.size(); ++k) {
    const bool rises = k == 0 || sizes[k] >= sizes[k - 1], falls = k + 1 == f.size() || sizes[k] > sizes[k + 1];
    if (!rises || !falls) continue;
    Peak peak{f[k], sizes[k], {}};
    if (k > 0 && k + 1 < f.size()) {  // to rounding, as the gradient is that at this frequency
      const double before = slope(x, f[k - 1]), after = slope(x, f[k + 1]);
      std::uintmax_t turns = 100;
      if (before > 0 && after < 0)
        peak.frequency =
            boost::math::tools::toms748_solve([&](double here) { return slope(x, here); }, f[k - 1], f[k + 1], before,
                                              after, boost::math::tools::eps_tolerance<double>(50), turns)
                .first;
      peak.value = std::abs(response(x, peak.frequency));
    }
    peaks.push_back(peak);
  }
  std::ranges::stable_sort(peaks, std::greater(), &Peak::value);
  if (peaks.size() > kMost) peaks.resize(kMost);
  return peaks;
}

double FrequencyResponse::value(const VectorXd& rho, const UserForces& forces) const {
  return peaks(rho, forces, {}).front().value;
}

std::vector<FrequencyResponse::Peak> FrequencyResponse::peaks(const VectorXd& rho, const UserForces& forces,
                                                              const std::vector<int>& variables) const {
  constexpr double kStep = 1e-2;  // of a parameter; rungs below it extrapolate to some 1e-10
  constexpr int kRungs = 6;
  const Linearisation here = linearised(rho, forces);
  const double f = spec_.at.value_or(0);
  std::vector<Peak> peaks = is_largest() ? peaks_of(here) : std::vector<Peak>{{f, value_at(here, f), {}}};
  for (Peak& peak : peaks) peak.gradient.setZero(static_cast<Index>(variables.size()));
  for (std::size_t v = 0; v < variables.size(); ++v) {
    const double size = typical_size(scene_.parameters[static_cast<std::size_t>(variables[v])], rho(variables[v]));
    const auto at = [&](double h) -> std::optional<VectorXd> {
      VectorXd beside = rho;
      beside(variables[v]) += h;
      try {
        const Linearisation x = linearised(beside, forces);
        VectorXd values(static_cast<Index>(peaks.size()));
        for (std::size_t k = 0; k < peaks.size(); ++k) values(static_cast<Index>(k)) = value_at(x, peaks[k].frequency);
        if (spec_.value == "phase")  // on the turn of the value itself
          values(0) = peaks[0].value + std::remainder(values(0) - peaks[0].value, kTurn);
        return values;
      } catch (const std::runtime_error&) {
        return std::nullopt;
      }
    };
    const LadderDerivative slope = difference_ladder(at, static_cast<Index>(peaks.size()), {kStep * size, kRungs});
    if (!slope.derivative.allFinite()) throw std::runtime_error("the derivative of the response is not finite");
    for (std::size_t k = 0; k < peaks.size(); ++k)
      peaks[k].gradient(static_cast<Index>(v)) = slope.derivative(static_cast<Index>(k));
  }
  return peaks;
}

}  // namespace mbsopt::inline optim
