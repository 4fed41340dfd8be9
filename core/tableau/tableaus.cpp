#include "core/tableau/tableaus.hpp"

#include <algorithm>

#include "core/tableau/dopri853_tableau.hpp"
#include "core/tableau/explicit_tableaus.hpp"
#include "core/tableau/implicit_tableaus.hpp"
#include "core/tableau/rosenbrock_tableaus.hpp"
#include "core/tableau/verner6_tableau.hpp"

namespace mbsopt {
namespace {

constexpr std::array kGaussNodes{0.1127016653792583, 0.5, 0.8872983346207417};  // on [0, 1], exact to degree 5
constexpr std::array kGaussWeights{5.0 / 18, 4.0 / 9, 5.0 / 18};

constexpr bool any_nonzero(std::span<const double> x) {
  return std::any_of(x.begin(), x.end(), [](double v) { return v != 0; });
}

// Finds the smallest blocks on the diagonal of A that have only zeros to their right.
template <int S, int T>
constexpr void find_groups(const Tableau<S, T>& rk, Method& m) {
  for (int first = 0; first < T; first = m.group[static_cast<std::size_t>(m.groups - 1)].last + 1) {
    int last = first;
    for (int i = first; i <= last; ++i) {
      for (int j = last + 1; j < T; ++j) {
        if (rk.A[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] != 0) last = j;
      }
    }
    m.group[static_cast<std::size_t>(m.groups)] = {first, last};
    ++m.groups;
    if (first < S) ++m.step_groups;
  }
}

template <std::size_t T>
constexpr bool has_equal_diagonal(const std::array<std::array<double, T>, T>& gamma) {
  for (std::size_t i = 0; i < T; ++i) {
    if (gamma[i][i] != gamma[0][0]) return false;
  }
  return true;
}

template <int S, int T>
constexpr bool ends_with_implicit_stage(const Tableau<S, T>& rk) {
  for (std::size_t i = 0; i < S; ++i) {
    if (rk.A[i][i] != 0 && std::equal(rk.b.begin(), rk.b.end(), rk.A[i].begin())) return true;
  }
  return false;
}

template <int S, int T>
constexpr bool ends_with_rosenbrock_stage(const Tableau<S, T>& rk) {
  if (rk.gamma[0][0] == 0) return false;
  for (std::size_t j = 0; j < S; ++j) {
    if (magnitude(rk.A[S - 1][j] + rk.gamma[S - 1][j] - rk.b[j]) > 1e-14) return false;
  }
  return true;
}

template <const auto& rk>
constexpr Method method() {
  constexpr std::size_t S = rk.b.size(), T = rk.c.size();
  static_assert(T <= Method::kMaxStages && rows_sum_to(rk.c, rk.A) && dense_ends_at_step(rk));
  static_assert(rows_sum_to(rk.gamma_sum, rk.gamma) && has_equal_diagonal(rk.gamma));
  Method m;
  m.name = rk.name;
  m.order = rk.order;
  m.dense_order = rk.dense_order;
  m.error_order = rk.error_order;
  m.stages = static_cast<int>(S);
  m.dense_stages = static_cast<int>(T);
  m.c = rk.c.data();
  m.A = rk.A[0].data();
  m.b = rk.b.data();
  m.error = rk.error.data();
  if (any_nonzero(rk.error_low)) m.error_low = rk.error_low.data();
  m.dense = rk.dense[0].data();
  m.nodes = m.stages;
  m.node_c = m.c;
  m.node_b = m.b;
  if (rk.gamma[0][0] != 0) {
    m.gamma = rk.gamma[0].data();
    m.gamma_sum = rk.gamma_sum.data();
    m.nodes = static_cast<int>(kGaussNodes.size());
    m.node_c = kGaussNodes.data();
    m.node_b = kGaussWeights.data();
  }
  m.error_filter = rk.error_filter;
  m.adaptive = any_nonzero(rk.error);
  m.stiffly_accurate = ends_with_implicit_stage(rk) || ends_with_rosenbrock_stage(rk);
  find_groups(rk, m);
  return m;
}

// The explicit methods come first.
constexpr std::array kMethods{method<kEuler>(),     method<kRk2>(),    method<kBs3>(),     method<kRk4>(),
                              method<kDopri5>(),    method<kTsit5>(),  method<kVerner6>(), method<kDopri853>(),
                              method<kSdirk2>(),    method<kSdirk3>(), method<kSdirk4>(),  method<kGauss4>(),
                              method<kLobatto3c>(), method<kRodas4>(), method<kRadau5>(),  method<kRadau1a>(),
                              method<kGauss6>()};
std::size_t explicit_count() {
  static const auto count = std::ranges::count_if(kMethods, [](const Method& m) { return !m.implicit(); });
  return static_cast<std::size_t>(count);
}

const Method* find(std::span<const Method> methods, std::string_view name) {
  const auto found = std::find_if(methods.begin(), methods.end(), [&](const Method& m) { return m.name == name; });
  return found == methods.end() ? nullptr : &*found;
}

}  // namespace

std::span<const Method> runge_kutta_methods() { return kMethods; }
std::span<const Method> explicit_methods() { return runge_kutta_methods().first(explicit_count()); }
std::span<const Method> implicit_methods() { return runge_kutta_methods().subspan(explicit_count()); }

const Method* runge_kutta_method(std::string_view name) { return find(runge_kutta_methods(), name); }
const Method* explicit_method(std::string_view name) { return find(explicit_methods(), name); }

}  // namespace mbsopt
