// The largest |entry| of the constraint equations and the unit norms, and the equation that it belongs to.
#include <cmath>

#include "core/body/state_layout.hpp"
#include "core/constraint/unit_norm.hpp"
#include "core/mechanism/constraint_gradient.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

struct Violation {
  double amount = 0;  // signed
  int row = -1;       // of Phi, or -1
  int body = 0;       // of a unit norm, or 0
};

RowLaws laws_at(const MechanismData& d, double t) {
  RowLaws laws(d);
  laws.set_time(t);
  return laws;
}

Violation worst_violation(const MechanismData& d, double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  const RowLaws laws = laws_at(d, t);
  Violation worst;
  auto offer = [&](double phi, int row, int body) {
    if (std::abs(phi) > std::abs(worst.amount)) worst = {phi, row, body};
  };
  double sum = 0;
  for (std::size_t i = 0; i < d.constraints.size(); ++i) {
    const Constraint& c = d.constraints[i];
    const Frame b1 = body_at(y, c.body1), b2 = body_at(y, c.body2);
    const bool last_term = i + 1 == d.constraints.size() || d.constraints[i + 1].row != c.row;
    std::visit(
        [&](const auto& p) {
          const auto phi = phi_of(c, p, b1, b2, laws, angles);
          sum += c.factor * phi(0);
          if (!last_term) return;
          offer(sum - laws.f_or_zero(c.row), c.row, 0);
          for (int k = 1; k < phi.size(); ++k) offer(c.factor * phi(k), c.row + k, 0);
          sum = 0;
        },
        c.primitive);
  }
  const StateLayout layout{d.n};
  for (int i = 1; i <= d.n; ++i) offer(UnitNorm::phi(y.segment<4>(layout.p(i))), -1, i);
  return worst;
}

struct ViolationFunction final : SensorFunction {
  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    const Violation worst = worst_violation(d, at.t, at.y, at.angles);
    if (to) {
      SensorGradient of_amount{d, worst.amount < 0 ? -to->scale : to->scale, to->y_bar, to->rho_bar};
      add_gradient(worst, at, of_amount);
    }
    return std::abs(worst.amount);
  }

 private:
  static void add_gradient(const Violation& worst, const StatePoint& at, SensorGradient& to) {
    const MechanismData& d = to.data;
    const Eigen::VectorXd &y = at.y, &angles = at.angles;
    if (worst.body > 0) {
      const Eigen::Index p = StateLayout{d.n}.p(worst.body);
      to.y_bar.segment<4>(p) += to.scale * UnitNorm::phi_p(y.segment<4>(p));
    }
    if (worst.row < 0) return;
    const RowLaws laws = laws_at(d, at.t);
    laws.add_gradient(0, worst.row, -to.scale, to.rho_bar);
    for (const Constraint& c : d.constraints) {
      if (worst.row < c.row || worst.row >= c.row + c.rows()) continue;
      const Frame b1 = body_at(y, c.body1), b2 = body_at(y, c.body2);
      std::visit(
          [&]<class P>(const P& p) {
            Multipliers<P::kRows> z = Multipliers<P::kRows>::zero();
            z.mu0(worst.row - c.row) = c.factor;
            add_primitive_gradient(p, c, b1, b2, z, to);
            const double value = phi_of(c, p, b1, b2, laws, angles)(worst.row - c.row);
            to.add_slot<1>(c.slot_factor, Vec<1>(value));
          },
          c.primitive);
    }
  }
};

}  // namespace

std::unique_ptr<SensorFunction> make_violation(Compilation&, const Sensor&, const std::string&) {
  return std::make_unique<ViolationFunction>();
}

}  // namespace mbsopt
