#include "optim/differences/difference_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <mutex>

#include "optim/machine/on_threads.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {
namespace {

constexpr double kStep = 1e-3;     // of the variable's size
constexpr double kShorter = 16;    // a second step is so many times shorter
constexpr double kApart = 1e-2;    // of a derivative: less is harmless for an optimiser
constexpr double kMatters = 1e-3;  // of the group's largest derivative
constexpr double kTrust = 10;      // times an estimated error

using Eigen::Index;
using Eigen::VectorXd;
using ComparedGroup = DifferenceComparison::Group;

VectorXd rows(const VectorXd& x, const ComparedGroup& group) { return x.segment(group.first, group.rows); }

struct Difference {
  VectorXd slope, bend;  // bend: |f(h) - 2 f(0) + f(-h)|/(2 h)
  double h = 0;
};

std::string in_words(const ComparedGroup& group, const std::string& variable, const VectorXd& exact,
                     const VectorXd& slope, double h) {
  const bool one = group.rows == 1;
  return fmt::format(
      "the derivative of {} in '{}' is {}{:.6g} at the start, but a difference over {:.2g} says {:.6g}{}: something is "
      "not smooth here (a jump whose instant moves, a limit, an impact), or the steps do not resolve it. An optimiser "
      "follows the derivative; 'mbsopt check' tells more",
      group.name, variable, one ? "" : "of size ", one ? exact(0) : exact.norm(), h, one ? slope(0) : slope.norm(),
      one ? "" : fmt::format(" (apart by {:.6g})", (slope - exact).norm()));
}

class Comparison {
 public:
  explicit Comparison(const DifferenceComparison& of) : of_(of) {}

  // Returns the warnings about one variable. Threads may call it at the same time for different variables.
  std::vector<std::string> sentences(std::size_t variable) {
    const auto abandoned = [this] { return of_.go_on && !of_.go_on(); };
    const ComparedVariable& v = of_.variables[variable];
    if (abandoned() || !(std::max(v.below, v.above) > 0)) return {};  // its bounds leave it where it is
    std::optional<Difference> d = difference(variable, kStep), shorter;
    if (!d) d = difference(variable, kStep / kShorter);
    if (abandoned()) return {};
    if (!d)
      return {fmt::format(
          "the derivatives in '{}' were not compared with a difference: next to the start it cannot be evaluated",
          v.name)};
    std::vector<std::string> said;
    for (const ComparedGroup& group : of_.groups) {
      if (!disagrees(group, variable, *d, nullptr)) continue;
      if (!shorter) shorter = difference(variable, kStep / kShorter);
      if (!shorter || !disagrees(group, variable, *shorter, nullptr)) continue;
      if (disagrees(group, variable, *d, &integrator_errors()))
        said.push_back(in_words(group, v.name, rows(of_.f_rho.col(static_cast<Index>(variable)), group),
                                rows(d->slope, group), d->h));
    }
    return said;
  }

 private:
  // step: of the variable's size. Returns nullopt if f cannot be evaluated beside the start.
  std::optional<Difference> difference(std::size_t variable, double step) const {
    const ComparedVariable& v = of_.variables[variable];
    const double wanted = step * v.size;
    const double nearer = std::min(v.below, v.above), farther = std::max(v.below, v.above);
    if (nearer >= wanted / kShorter) {
      const double h = std::min(wanted, nearer);
      const std::optional<VectorXd> plus = of_.at(variable, h), minus = of_.at(variable, -h);
      if (!plus || !minus) return std::nullopt;
      return Difference{(*plus - *minus) / (2 * h), (*plus - 2 * of_.f + *minus).cwiseAbs() / (2 * h), h};
    }
    // On a bound, the difference goes away from it: (4 f(h/2) - f(h) - 3 f(0))/h.
    const double size = std::min(wanted, farther), h = v.above >= v.below ? size : -size;
    const std::optional<VectorXd> half = of_.at(variable, h / 2), whole = of_.at(variable, h);
    if (!half || !whole) return std::nullopt;
    return Difference{(4 * *half - *whole - 3 * of_.f) / h, (*whole - 2 * *half + of_.f).cwiseAbs() / (0.5 * size),
                      size};
  }

  // errors: of f by the integrator, if they count.
  bool disagrees(const ComparedGroup& group, std::size_t variable, const Difference& d, const VectorXd* errors) const {
    const auto size = [&](const VectorXd& x) { return rows(x, group).norm(); };
    double largest = 0;  // derivative of the group
    for (std::size_t k = 0; k < of_.variables.size(); ++k)
      largest = std::max(largest, of_.variables[k].size * size(of_.f_rho.col(static_cast<Index>(k))));
    const VectorXd exact = of_.f_rho.col(static_cast<Index>(variable));
    double allowed = std::max({kApart * size(exact), kApart * size(d.slope), size(d.bend),
                               kMatters * largest / of_.variables[variable].size});
    if (errors) allowed += kTrust * size(*errors) / d.h;
    return size(d.slope - exact) > allowed;
  }

  const VectorXd& integrator_errors() {
    std::call_once(asked_, [&] {
      errors_.setZero(of_.f.size());
      const std::optional<VectorXd> f = of_.tighter ? of_.tighter() : std::nullopt;
      if (f && f->size() == of_.f.size()) errors_ = (*f - of_.f).cwiseAbs();
    });
    return errors_;
  }

  const DifferenceComparison& of_;
  std::once_flag asked_;
  VectorXd errors_;  // of f
};

}  // namespace

ComparedVariable compared_variable(const std::string& name, const Parameter& at) {
  ComparedVariable v{name, typical_size(at, at.value)};
  if (at.lower) v.below = at.value - *at.lower;
  if (at.upper) v.above = *at.upper - at.value;
  return v;
}

std::vector<std::string> DifferenceComparison::warnings() const {
  Comparison comparison(*this);
  std::vector<std::vector<std::string>> of_variables(variables.size());
  on_threads(variables.size(), threads, [&](std::size_t k) { of_variables[k] = comparison.sentences(k); });
  if (go_on && !go_on()) return {};
  std::vector<std::string> said;
  for (std::vector<std::string>& sentences : of_variables) std::ranges::move(sentences, std::back_inserter(said));
  return said;
}

}  // namespace mbsopt::inline optim
