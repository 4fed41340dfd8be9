// What the cases of all forces share: laws written once more for any scalar, and two bodies in an arbitrary state.
//
// A case has its state in one vector x, the force made from it (place), its virtual work for any scalar (work), and the
// force's own loads, pull_back and tangent; forces_test.cpp compares them.
#pragma once

#include "core/body/euler_parameters.hpp"
#include "core/force/force_inputs.hpp"
#include "core/force/forces.hpp"
#include "tests/core/body/textbook_body.hpp"

namespace mbsopt::testing {

inline constexpr double kTime = 0.7;

// k (x - x0) + c xdot + f0: four fields.
struct LinearLaw {
  static constexpr int kFields = 4, kParameters = 0;
  using ForceLaw = Law;
  template <class T>
  static T value(const std::vector<T>& at, std::size_t k, const T& x, const T& xdot) {
    return at[k] * (x - at[k + 2]) + at[k + 1] * xdot + at[k + 3];
  }
  static void fill(Law& law, const Eigen::VectorXd& at, int first, int slot) {
    law.k = at(first), law.c = at(first + 1), law.x0 = at(first + 2), law.f0 = at(first + 3);
    law.slot = slot;
  }
};

// A user's expression of x, xdot, t and two parameters.
struct ProgramLaw {
  static constexpr int kFields = 0, kParameters = 2;
  using ForceLaw = Law;
  template <class T>
  static T value(const std::vector<T>& at, std::size_t k, const T& x, const T& xdot) {
    return at[k] * x * x * x + at[k + 1] * xdot * x - at[k] * at[k + 1] * T(kTime);
  }
  static void fill(Law& law, const Eigen::VectorXd&, int, int) {
    Symbols symbols;
    for (const char* name : {"a", "b", "x", "xdot", "t"}) symbols.add_input(name);
    law.program.emplace(Expression::parse("a*x^3 + b*xdot*x - a*b*t"), symbols);
  }
};

// Smoothed Coulomb and Stribeck friction and a viscous part: five fields.
struct DryFriction {
  static constexpr int kFields = 5, kParameters = 0;
  using ForceLaw = FrictionLaw;
  template <class T>
  static T value(const std::vector<T>& at, std::size_t k, const T&, const T& rate) {
    using std::exp, std::sqrt;
    const T part = rate / at[k + 4], level = at[k] + (at[k + 3] - at[k]) * exp(-part * part);
    return level * rate / sqrt(rate * rate + at[k + 1] * at[k + 1]) + at[k + 2] * rate;
  }
  static void fill(FrictionLaw& law, const Eigen::VectorXd& at, int first, int slot) {
    law.coulomb = at(first), law.smooth = at(first + 1), law.viscous = at(first + 2);
    law.breakaway = at(first + 3), law.stribeck = at(first + 4);
    law.slot = slot;
  }
};

// Two bodies in a state x = (q1, v1, q2, v2, geometry, law's fields or parameters), and virtual displacements.
struct Bodies {
  Eigen::VectorXd x;
  Vec<6> eta1, eta2;
  Frame f1, f2;

  Bodies(unsigned seed, Eigen::Index inputs) {
    Random random(seed);
    x = random.vector(inputs);
    eta1 = random.vector(6), eta2 = random.vector(6);
  }
  void place() {
    set(0, eta1, f1);
    set(14, eta2, f2);
  }
  template <class T>
  TextbookBody<T> textbook(const std::vector<T>& at, std::size_t first) const {
    TextbookBody<T> body{part<7>(at, first), part<7>(at, first + 7)};
    const Vec<6>& eta = first == 0 ? eta1 : eta2;
    for (std::size_t i = 0; i < 6; ++i) body.eta[i] = eta(static_cast<Eigen::Index>(i));
    return body;
  }

 private:
  void set(int first, const Vec<6>& eta, Frame& f) const {
    set_position(x.segment<7>(first), f);
    set_velocity(x.segment<7>(first + 7), f);
    set_virtual(eta, f);
  }
};

struct Loads {
  Vec<6> load1 = Vec<6>::Zero(), load2 = Vec<6>::Zero();
};
struct LoadTangents {
  Lanes<6> load1 = Lanes<6>::Zero(), load2 = Lanes<6>::Zero();
};

// Where a law's inputs lie: fields in theta after the geometry, parameters in rho.
template <class L>
struct LawScratch {
  Law::Scratch scratch;
  Eigen::VectorXd rho, angles;
  ForceInputs inputs{kTime, rho, angles, scratch};
  LawScratch(const typename L::ForceLaw& law, const Eigen::VectorXd& at, int first, double angle = 0)
      : rho(at.segment(first, L::kParameters)), angles(Vec<1>(angle)) {
    scratch.inputs.resize(static_cast<std::size_t>(L::kParameters + 3));
    scratch.gradient.resize(scratch.inputs.size());
    if constexpr (requires { law.program; }) {
      if (law.program) scratch.program = law.program->scratch();
    }
  }
};

template <class C>
C moved(const C& c, const Eigen::VectorXd& to) {
  C other = c;
  other.x = to;
  other.place();
  return other;
}

// (rdot, omega_B) as a virtual displacement: what multiplies loads to power. Needs p'pdot = 0.
inline Vec<6> rigid_velocity(const Frame& f) {
  Vec<6> eta;
  eta << f.rdot, f.omega() / f.p.squaredNorm();
  return eta;
}

}  // namespace mbsopt::testing
