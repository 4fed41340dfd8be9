#include "optim/solver/nlp_search.hpp"

#include <catch2/catch.hpp>

#include "optim/solver/nlopt_solver.hpp"
#include "tests/optim/small_programs.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// The values of f have an error that the derivatives do not have; x <= 1.
struct Noisy : NonlinearProgram {
  Noisy() : NonlinearProgram(1, 1) { c_upper(0) = 1; }
  void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
    const double a = x(0) - 0.5;
    p.f = 7 + a * a + (a > 0 ? 0 : 1e-7), p.f_x << 2 * a;
    p.c = x, p.c_x << 1;
  }
};

struct Search : NlpSearch {
  Search(NonlinearProgram& problem, NlpResult& result) : NlpSearch(problem, NloptOptions{}, result) {}
  double look(double x) { return NlpSearch::look(at(vector({x}), Wanted::derivatives)); }
  double best_x() const { return NlpSearch::best_x()(0); }
  using NlpSearch::has_solution, NlpSearch::take_solution;
};

}  // namespace

TEST_CASE("of points as good as the best the most stationary one is the solution", "[nlp_search]") {
  Noisy problem;
  NlpResult result;
  Search search(problem, result);
  CHECK_FALSE(search.has_solution());
  CHECK(search.look(0.6) == Approx(0.2));
  CHECK(search.look(0.4999) == Approx(2e-4));  // stationary within noise, though f is higher than at the next point
  CHECK(search.look(0.5002) == Approx(4e-4));
  CHECK(search.look(0.51) > 1);  // f is worse than noise explains
  CHECK(search.best_x() == 0.5002);
  REQUIRE(search.has_solution());
  search.take_solution();
  CHECK(result.x(0) == 0.4999);
}
