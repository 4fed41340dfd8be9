#include "core/mechanism/kinks_in_time.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/expression/program_switches.hpp"

namespace mbsopt {
namespace {

// f(a t + b) as a function of t; null if rounding makes samples coincide.
std::shared_ptr<const Curve> stretched(const Curve& f, double a, double b) {
  std::vector<double> t, y = f.y();
  for (const double x : f.x()) t.push_back((x - b) / a);
  if (a < 0) std::ranges::reverse(t), std::ranges::reverse(y);
  if (std::ranges::adjacent_find(t, std::greater_equal()) != t.end()) return nullptr;
  return std::make_shared<const Curve>(f.interpolation(), std::move(t), std::move(y));
}

}  // namespace

void add_kinks_in_time(const Program& program, int time, const Eigen::VectorXd& rho, std::vector<KinkedSignal>& kinks) {
  for (const auto& [use, argument] : sampled_functions_of(program)) {
    const auto& [curve, order] = use;
    if (curve->x().empty()) continue;  // a routine
    const Program slope = argument.derivative(time);
    KinkedSignal found{curve, 0, {}, curve->degree() - order};
    bool is_linear = argument.uses(time) && !slope.uses(time);
    for (const int input : argument.used_inputs()) {
      if (input == time) continue;
      is_linear = is_linear && input < rho.size();
      if (found.order <= 1) found.moved_by.push_back(input);
    }
    if (!is_linear) continue;
    std::vector<double> at_zero(rho.begin(), rho.end());
    at_zero.resize(std::max(at_zero.size(), static_cast<std::size_t>(time) + 1), 0.0);
    Program::Scratch scratch = argument.scratch();
    slope.grow(scratch);
    const double a = slope.value(at_zero, scratch), b = argument.value(at_zero, scratch);
    if (!std::isfinite(1 / a) || !std::isfinite(b / a)) continue;  // it does not change with time
    if (a == 1)
      found.delay = -b;
    else
      found.curve = stretched(*curve, a, b);
    if (!found.curve) continue;
    const auto is_same = [&](const KinkedSignal& k) { return k.curve == found.curve && k.delay == found.delay; };
    const auto known = std::ranges::find_if(kinks, is_same);
    if (known == kinks.end()) {
      kinks.push_back(std::move(found));
      continue;
    }
    known->order = std::min(known->order, found.order);
    for (const int input : found.moved_by)
      if (std::ranges::find(known->moved_by, input) == known->moved_by.end()) known->moved_by.push_back(input);
  }
}

}  // namespace mbsopt
