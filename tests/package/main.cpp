#include "core/expression/expression.hpp"
#include "optim/problem.hpp"

int main() {
  mbsopt::Problem problem;
  problem.scene.gravity[2] = mbsopt::Expression::parse("-2*3");
  return problem.scene.gravity[2].number() == -6 ? 0 : 1;
}
