#include "optim/differences/difference_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <mutex>

#include "optim/machine/on_threads.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt {
namespace {

constexpr double kStep = 1e-3;     // of the variable's size
constexpr double kShorter = 16;    // times
constexpr double kApart = 1e-2;    // of a derivative: an optimiser does not mind less
constexpr double kMatters = 1e-3;  // of the group's largest derivative
constexpr double kTrust = 10;      // times an estimated error

using Eigen::VectorXd;

struct Difference {
  VectorXd slope, bend;  // bend: |f(h) - 2 f(0) + f(-h)|/(2 h)
  double h = 0;
};

}  // namespace

ComparedVariable compared_variable(const std::string& name, const Parameter& at) {
  ComparedVariable v{name, typical_size(at, at.value)};
  if (at.lower) v.below = at.value - *at.lower;
  if (at.upper) v.above = *at.upper - at.value;
  return v;
}

std::vector<std::string> DifferenceComparison::warnings() const {
  VectorXd f_error;
  Eigen::MatrixXd f_rho_error;
  std::once_flag asked;
  const auto ask_for_errors = [&] {
    VectorXd tight_f;
    Eigen::MatrixXd tight_f_rho;
    f_error = VectorXd::Zero(f.size()), f_rho_error = Eigen::MatrixXd::Zero(f_rho.rows(), f_rho.cols());
    if (tighter && tighter(tight_f, tight_f_rho) && tight_f.size() == f.size())
      f_error = (tight_f - f).cwiseAbs(), f_rho_error = (tight_f_rho - f_rho).cwiseAbs();
  };

  const auto difference = [&](std::size_t k, double wanted) -> std::optional<Difference> {
    const Variable& v = variables[k];
    const double nearer = std::min(v.below, v.above), farther = std::max(v.below, v.above);
    Difference d;
    if (nearer >= wanted / kShorter) {
      d.h = std::min(wanted, nearer);
      const std::optional<VectorXd> plus = at(k, d.h), minus = at(k, -d.h);
      if (!plus || !minus) return std::nullopt;
      d.slope = (*plus - *minus) / (2 * d.h);
      d.bend = (*plus - 2 * f + *minus).cwiseAbs() / (2 * d.h);
      return d;
    }
    // On a bound: away from it, (4 f(h/2) - f(h) - 3 f(0))/h.
    d.h = std::min(wanted, farther);
    const double h = v.above >= v.below ? d.h : -d.h;
    const std::optional<VectorXd> half = at(k, h / 2), whole = at(k, h);
    if (!half || !whole) return std::nullopt;
    d.slope = (4 * *half - *whole - 3 * f) / h;
    d.bend = (*whole - 2 * *half + f).cwiseAbs() / (0.5 * d.h);
    return d;
  };
  const auto size_of_group = [&](const Group& g) {
    double largest = 0;
    for (std::size_t k = 0; k < variables.size(); ++k)
      largest = std::max(largest,
                         variables[k].size * f_rho.col(static_cast<Eigen::Index>(k)).segment(g.first, g.rows).norm());
    return largest;
  };
  // By how much more than allowed; `errors` counts those of the integrator.
  const auto disagrees = [&](const Group& g, std::size_t k, const Difference& d, bool errors) {
    const auto of = [&](const auto& x) { return x.segment(g.first, g.rows).norm(); };
    const VectorXd exact = f_rho.col(static_cast<Eigen::Index>(k));
    double allowed = std::max(
        {kApart * of(exact), kApart * of(d.slope), of(d.bend), kMatters * size_of_group(g) / variables[k].size});
    if (errors) allowed += kTrust * (of(f_error) / d.h + of(VectorXd(f_rho_error.col(static_cast<Eigen::Index>(k)))));
    return of(VectorXd(d.slope - exact)) > allowed;
  };

  const auto compare = [&](std::size_t k) -> std::vector<std::string> {
    std::vector<std::string> said;
    if (go_on && !go_on()) return {};
    const Variable& v = variables[k];
    if (!(std::max(v.below, v.above) > 0)) return {};  // its bounds leave it where it is
    std::optional<Difference> d = difference(k, kStep * v.size);
    if (!d) d = difference(k, kStep / kShorter * v.size);
    if (go_on && !go_on()) return {};
    if (!d)
      return {
          fmt::format("the derivatives in '{}' were not compared with a difference: next to the start it cannot be "
                      "evaluated",
                      v.name)};
    std::optional<Difference> shorter;
    for (const Group& g : groups) {
      if (!disagrees(g, k, *d, false)) continue;
      if (!shorter) shorter = difference(k, kStep / kShorter * v.size);
      if (!shorter || !disagrees(g, k, *shorter, false)) continue;
      std::call_once(asked, ask_for_errors);
      if (!disagrees(g, k, *d, true)) continue;
      const bool one = g.rows == 1;
      const VectorXd exact = f_rho.col(static_cast<Eigen::Index>(k)).segment(g.first, g.rows);
      const VectorXd slope = d->slope.segment(g.first, g.rows);
      said.push_back(fmt::format(
          "the derivative of {} in '{}' is {}{:.6g} at the start, but a difference over {:.2g} says {:.6g}{}: "
          "something is not smooth here (a jump whose instant moves, a limit, an impact), or the steps do not resolve "
          "it. An optimiser follows the derivative; 'mbsopt check' tells more",
          g.name, v.name, one ? "" : "of size ", one ? exact(0) : exact.norm(), d->h, one ? slope(0) : slope.norm(),
          one ? "" : fmt::format(" (apart by {:.6g})", (slope - exact).norm())));
    }
    return said;
  };
  std::vector<std::vector<std::string>> of_variables(variables.size());
  on_threads(variables.size(), threads, [&](std::size_t k) { of_variables[k] = compare(k); });
  if (go_on && !go_on()) return {};
  std::vector<std::string> said;
  for (std::vector<std::string>& sentences : of_variables) std::ranges::move(sentences, std::back_inserter(said));
  return said;
}

}  // namespace mbsopt
