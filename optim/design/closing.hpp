// Leads a start that does not close to parameters at which the linkage closes at all instants of a design.
//
//   e_k(rho) = |Phi|/sqrt(m) at the nearest approach: the least over q of |Phi(q, t_k, rho)|      0 where it closes
//   de_k     = Phi'Phi_rho/(|Phi| sqrt(m))                                     q is stationary, so that dq drops out
//   step p:    least |p| in units of the bounds' ranges with  e_k + de_k p = -max e  at all open instants, within
//   bounds
//
// Each step aims as far beyond closing as the worst instant lacks. Such reflections end in the interior of a convex set
// after finitely many steps; projections end on its border, the dead points. Motzkin and Schoenberg, Canadian Journal
// of Mathematics 6 (1954) 393.
//
//   const ClosedStart start = close_start(program);
//   if (start.closes) use(start.x);
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "optim/design/design_program.hpp"

namespace mbsopt::inline optim {

struct ClosedStart {
  Eigen::VectorXd x;    // scaled variables
  bool closes = false;  // at all instants, and whether it could be told
  int steps = 0;        // 0: it was not moved
  double defect = 0;    // max e_k at the start [m, rad]
};

// At which it looks: those of samples, or uniform ones where there are none, and halfway between.
std::vector<double> closing_instants(const Evaluator& evaluator);

// From the start of the program. go_on: asked before every step.
ClosedStart close_start(const DesignProgram& program, const std::function<bool()>& go_on = {});

}  // namespace mbsopt::inline optim
