// A scene from a file with a force written in C++: the motion, the gradient of its objective, and the equations of
// motion at the start.
#include <cstdio>
#include <mbsopt/mbsopt.hpp>

#include "drag.hpp"

int main(int, char** argv) {
  const mbsopt::Problem problem = mbsopt::read_problem(argv[1]);
  mbsopt::EvaluatorOptions options;
  options.user_forces = {std::make_shared<Drag>()};
  mbsopt::Evaluator evaluator(problem.scene, mbsopt::objectives_of(problem), {"L", "drag"}, options);
  const mbsopt::Evaluation& e = evaluator.gradients(evaluator.start());
  if (!e.ok) return std::fprintf(stderr, "%s\n", e.message.c_str()), 1;
  std::printf("travel %.9f, d/dL %.6f, d/ddrag %.6f\n", e.psi(0), e.psi_rho(0, 0), e.psi_rho(0, 1));

  const mbsopt::Mechanism mechanism(problem.scene, evaluator.start(), {}, options.user_forces);
  const mbsopt::Assembly start(mechanism, 0);
  const mbsopt::StateQuery at(mechanism, problem.scene.simulation.formulation,
                              {0, start.result().y, start.result().angles});
  const Eigen::VectorXd residual = at.M() * at.qddot() + at.Phi_q().transpose() * at.lambda() - at.Q();
  std::printf("angular acceleration %.6f rad/s^2, residual %.0e\n", at.body("rod").omegadot(2), residual.norm());
  return residual.norm() < 1e-9 && e.psi_rho.allFinite() ? 0 : 1;
}
