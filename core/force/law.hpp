// A force's law: a scalar function of a length and its rate (or an angle and its rate), of time and of parameters, with
// its derivatives. It is the linear law  k (x - x0) + c xdot + f0  or a user's expression.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/expression/program.hpp"
#include "core/linear/parameter_block.hpp"

namespace mbsopt {

struct Law {
  static constexpr int kFields = 4;
  double k = 0, c = 0, x0 = 0, f0 = 0;  // [N/m, N s/m, m, N] or [N m/rad, N m s/rad, rad, N m]
  int slot = -1;                        // first of the four rows k, c, x0, f0 among the differentiated fields
  std::optional<Program> program;       // inputs: all parameters, then x, xdot, t

  // Reusable numbers of one evaluation. gradient holds the entries of all parameters, then x, xdot, t.
  struct Scratch {
    std::vector<double> inputs, gradient;
    Program::Scratch program;
  };

  struct Point {
    double x, xdot;
  };
  struct Value {
    double f, f_x, f_xdot;
  };

  double value(double t, const Eigen::VectorXd& rho, double x, double xdot, Scratch& s) const;

  // Returns f with derivatives. Those of a program in the parameters stay in s.gradient.
  Value derivatives(double t, const Eigen::VectorXd& rho, double x, double xdot, Scratch& s) const;

  // k (x - x0)^2/2, its derivatives in x and in (k, c, x0, f0); an expression has none.
  double potential(double x) const { return program ? 0.0 : 0.5 * k * (x - x0) * (x - x0); }
  double potential_slope(double x) const { return program ? 0.0 : k * (x - x0); }
  Vec<4> potential_gradient(double x) const;
  double stiffness() const { return k; }
  bool conserves_energy() const { return !program && c == 0 && f0 == 0; }

  // df/d(k, c, x0, f0) of the linear law.
  Vec<4> field_gradient(double x, double xdot) const;

  // theta_bar, rho_bar += f_bar df/d(fields, parameters), after derivatives() at the same point.
  void add_field_gradient(double x, double xdot, double f_bar, const Scratch& s, Eigen::VectorXd& theta_bar,
                          Eigen::VectorXd& rho_bar) const;

  // Returns whether f changes in the block at fixed x, xdot.
  bool moves(const ParameterBlock& block) const { return program || block.moves(slot, kFields); }

  // The tangent of f through the law's own fields (directions of k, c, x0, f0; null if constant). A program adds the
  // tangent through the parameters, whose directions are the rows of rho_dir(parameter).
  template <class RhoDirection>
  Lanes<1> field_tangent(const Point& at, const Lanes<4>* fields, RhoDirection&& rho_dir, const Scratch& s) const {
    Lanes<1> df = Lanes<1>::Zero();
    if (program) {
      for (const int input : program->used_inputs()) {
        const std::size_t i = static_cast<std::size_t>(input);
        if (i + 3 < s.gradient.size()) df += s.gradient[i] * rho_dir(input);
      }
    } else if (fields) {
      df = field_gradient(at.x, at.xdot).transpose() * *fields;
    }
    return df;
  }

 private:
  void set_inputs(double t, const Eigen::VectorXd& rho, double x, double xdot, Scratch& s) const;
};

}  // namespace mbsopt
