#include "core/integrate/tableaus.hpp"

#include <algorithm>

namespace mbsopt {
namespace {

template <int S, int T>
constexpr Method method(const Tableau<S, T>& rk) {
  constexpr auto nonzero = [](double x) { return x != 0; };
  Method m{rk.name,         rk.order, rk.dense_order,    S, T, rk.c.data(), rk.A[0].data(), rk.b.data(),
           rk.error.data(), nullptr,  rk.dense[0].data()};
  m.adaptive = std::any_of(rk.error.begin(), rk.error.end(), nonzero);
  if (std::any_of(rk.error_low.begin(), rk.error_low.end(), nonzero)) m.error_low = rk.error_low.data();
  return m;
}

constexpr std::array kMethods{method(kRk4), method(kDopri5), method(kDopri853)};

}  // namespace

const Method* explicit_method(std::string_view name) {
  const auto found = std::find_if(kMethods.begin(), kMethods.end(), [&](const Method& m) { return m.name == name; });
  return found == kMethods.end() ? nullptr : &*found;
}

std::span<const Method> explicit_methods() { return kMethods; }

}  // namespace mbsopt
