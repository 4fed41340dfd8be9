// The 15 nodes of the Gauss-Kronrod rule in (0, 1), ascending, with the weights of both of its formulas.
//   integral of g over h:   K = h sum_k kronrod_k g_k (degree 22),   G = h sum_k gauss_k g_k (degree 13)
// Piessens, de Doncker-Kapenga, Ueberhuber, Kahaner, "QUADPACK", Springer (1983), section 2.2.
#pragma once

#include <array>
#include <span>

namespace mbsopt {

inline constexpr int kNodes = 15;

struct KronrodRule {
  std::array<double, kNodes> nodes, kronrod, gauss;  // the weights of each formula have the sum 1
};
const KronrodRule& kronrod_rule();

// An integral over a panel of length h, from g at the nodes.
struct PanelIntegral {
  double value = 0;     // K
  double absolute = 0;  // of |g|
  double error = 0;     // estimated from |K - G| as QUADPACK does
};
PanelIntegral integrate_panel(std::span<const double> g, double h);

}  // namespace mbsopt
