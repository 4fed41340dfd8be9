#include "optim/solver/sqp_solver.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <vector>

#include "optim/solver/optimality.hpp"
#include "tests/optim/small_programs.hpp"

using namespace mbsopt;
using mbsopt::testing::vector;

namespace {

using Function = std::function<double(const Eigen::VectorXd& x)>;

// Derivatives of smooth functions by differences of 1e-6: exact to 1e-10.
Eigen::VectorXd gradient(const Function& f, const Eigen::VectorXd& x) {
  constexpr double h = 1e-5;
  Eigen::VectorXd g(x.size());
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const Eigen::VectorXd e = h * Eigen::VectorXd::Unit(x.size(), k);
    g(k) = (8 * (f(x + e) - f(x - e)) - (f(x + 2 * e) - f(x - 2 * e))) / (12 * h);
  }
  return g;
}

// The largest of some functions, limited by the largest of others and by plain ones.
struct Written : NonlinearProgram {
  Written(Eigen::Index n, std::vector<Function> f, std::vector<Function> c,
          std::vector<std::vector<Function>> peaks = {})
      : NonlinearProgram(n, static_cast<Eigen::Index>(c.size() + peaks.size())), f_(f), c_(c), peaks_(peaks) {}
  void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
    p.f = add_pieces(f_, NlpPiece::kObjective, x, p, p.f_x);
    for (std::size_t i = 0; i < c_.size(); ++i) {
      p.c(static_cast<Eigen::Index>(i)) = c_[i](x);
      p.c_x.row(static_cast<Eigen::Index>(i)) = gradient(c_[i], x).transpose();
    }
    for (std::size_t i = 0; i < peaks_.size(); ++i) {
      const Eigen::Index row = static_cast<Eigen::Index>(c_.size() + i);
      Eigen::VectorXd slope;
      p.c(row) = add_pieces(peaks_[i], row, x, p, slope);
      p.c_x.row(row) = slope.transpose();
    }
  }

 private:
  static double add_pieces(const std::vector<Function>& of, Eigen::Index row, const Eigen::VectorXd& x, NlpPoint& p,
                           Eigen::VectorXd& slope) {
    std::vector<NlpPiece> pieces;
    for (std::size_t j = 0; j < of.size(); ++j)
      pieces.push_back({row, 1, of[j](x), gradient(of[j], x), static_cast<double>(j)});
    std::ranges::stable_sort(pieces, std::greater(), &NlpPiece::value);
    slope = pieces[0].gradient;
    const double value = pieces[0].value;
    if (pieces.size() > 1) p.pieces.insert(p.pieces.end(), pieces.begin(), pieces.end());
    return value;
  }
  std::vector<Function> f_, c_;
  std::vector<std::vector<Function>> peaks_;
};

double sq(double x) { return x * x; }

}  // namespace

// Hock and Schittkowski, "Test Examples for Nonlinear Programming Codes" (1981), problems 71, 100 and 43.
TEST_CASE("sqp solves published programs in few evaluations", "[sqp]") {
  SECTION("71") {
    Written problem(4, {[](const auto& x) { return x(0) * x(3) * (x(0) + x(1) + x(2)) + x(2); }},
                    {[](const auto& x) { return x.prod(); }, [](const auto& x) { return x.squaredNorm(); }});
    problem.x_lower.setConstant(1);
    problem.x_upper.setConstant(5);
    problem.c_lower << 25, 40;
    problem.c_upper(1) = 40;
    const NlpResult result = solve_with_sqp(problem, vector({1, 5, 5, 1}));
    CHECK(result.status == SolverStatus::converged);
    CHECK(result.point.f == Approx(17.0140173).epsilon(1e-7));
    CHECK(result.evaluations < 40);
  }
  SECTION("100") {
    Written problem(
        7, {[](const auto& x) {
          return sq(x(0) - 10) + 5 * sq(x(1) - 12) + std::pow(x(2), 4) + 3 * sq(x(3) - 11) + 10 * std::pow(x(4), 6) +
                 7 * sq(x(5)) + std::pow(x(6), 4) - 4 * x(5) * x(6) - 10 * x(5) - 8 * x(6);
        }},
        {[](const auto& x) { return 127 - 2 * sq(x(0)) - 3 * std::pow(x(1), 4) - x(2) - 4 * sq(x(3)) - 5 * x(4); },
         [](const auto& x) { return 282 - 7 * x(0) - 3 * x(1) - 10 * sq(x(2)) - x(3) + x(4); },
         [](const auto& x) { return 196 - 23 * x(0) - sq(x(1)) - 6 * sq(x(5)) + 8 * x(6); },
         [](const auto& x) {
           return -4 * sq(x(0)) - sq(x(1)) + 3 * x(0) * x(1) - 2 * sq(x(2)) - 5 * x(5) + 11 * x(6);
         }});
    problem.c_lower.setZero();
    const NlpResult result = solve_with_sqp(problem, vector({1, 2, 0, 4, 0, 1, 1}));
    CHECK(result.status == SolverStatus::converged);
    CHECK(result.point.f == Approx(680.6300573).epsilon(1e-7));
    CHECK(result.evaluations < 50);
  }
  SECTION("43") {
    Written problem(4, {[](const auto& x) {
                      return sq(x(0)) + sq(x(1)) + 2 * sq(x(2)) + sq(x(3)) - 5 * x(0) - 5 * x(1) - 21 * x(2) + 7 * x(3);
                    }},
                    {[](const auto& x) { return 8 - x.squaredNorm() - x(0) + x(1) - x(2) + x(3); },
                     [](const auto& x) { return 10 - sq(x(0)) - 2 * sq(x(1)) - sq(x(2)) - 2 * sq(x(3)) + x(0) + x(3); },
                     [](const auto& x) { return 5 - 2 * sq(x(0)) - sq(x(1)) - sq(x(2)) - 2 * x(0) + x(1) + x(3); }});
    problem.c_lower.setZero();
    const NlpResult result = solve_with_sqp(problem, vector({0, 0, 0, 0}));
    CHECK(result.status == SolverStatus::converged);
    CHECK(result.point.f == Approx(-44).epsilon(1e-7));
    CHECK(result.evaluations < 30);
  }
}

// Charalambous and Bandler, "Non-linear minimax optimization as a sequence of least pth optimization", International
// Journal of Systems Science 7 (1976) 377: problems 1 and 2; f is 1.9522245 and 2.
TEST_CASE("sqp finds the least of a largest", "[sqp]") {
  const Function third = [](const auto& x) { return 2 * std::exp(x(1) - x(0)); };
  const Function second = [](const auto& x) { return sq(2 - x(0)) + sq(2 - x(1)); };
  SECTION("at a kink of two") {
    Written problem(2, {[](const auto& x) { return sq(x(0)) + std::pow(x(1), 4); }, second, third}, {});
    const NlpResult result = solve_with_sqp(problem, vector({2, 2}));
    CHECK(result.status == SolverStatus::converged);
    CHECK(result.point.f == Approx(1.9522245).epsilon(1e-7));
    CHECK(result.evaluations < 25);
  }
  SECTION("at a vertex of three") {
    Written problem(2, {[](const auto& x) { return std::pow(x(0), 4) + sq(x(1)); }, second, third}, {});
    const NlpResult result = solve_with_sqp(problem, vector({2, 2}));
    CHECK(result.status == SolverStatus::converged);
    CHECK(result.point.f == Approx(2).epsilon(1e-7));
    CHECK((result.x - vector({1, 1})).norm() < 1e-5);
    CHECK(result.evaluations < 15);
  }
  SECTION("as a limit, with its price") {
    Written problem(
        2, {[](const auto& x) { return -x(0) - 2 * x(1); }}, {},
        {{[](const auto& x) { return x.squaredNorm(); }, [](const auto& x) { return sq(x(0)) + 4 * x(1); }}});
    problem.c_upper.setConstant(4);
    const NlpResult result = solve_with_sqp(problem, vector({0.1, 0.1}));
    CHECK(result.status == SolverStatus::converged);
    CHECK(std::max(result.x.squaredNorm(), sq(result.x(0)) + 4 * result.x(1)) == Approx(4).epsilon(1e-7));
    // On x0^2 + 4 x1 = 4: least -x0 - 2 + x0^2/2 at x0 = 1, where |x|^2 is below 4 still.
    CHECK(result.x(0) == Approx(1).epsilon(1e-5));
    CHECK(stationarity(problem, result.x, result.point).multipliers(0) == Approx(0.5).epsilon(1e-5));
  }
}

// Along a helix within two limits that bend: x0 = cos(4 x2), x1 = sin(4 x2).
TEST_CASE("sqp follows limits that bend in long steps", "[sqp]") {
  Written problem(3, {[](const auto& x) { return 1e-3 * sq(x(2) - 2); }},
                  {[](const auto& x) { return x(0) - std::cos(4 * x(2)); },
                   [](const auto& x) { return x(1) - std::sin(4 * x(2)); }});
  problem.c_lower.setZero();
  problem.c_upper.setZero();
  problem.f_scale = 250;
  const NlpResult result = solve_with_sqp(problem, vector({1, 0, 0}));
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x(2) == Approx(2).epsilon(1e-5));
  CHECK(result.evaluations < 60);
}

TEST_CASE("sqp says that limits exclude each other, at the point that violates them least", "[sqp]") {
  Written problem(2, {[](const auto& x) { return x(1); }},
                  {[](const auto& x) { return x.squaredNorm(); }, [](const auto& x) { return x(0); }});
  problem.c_upper(0) = 1;
  problem.c_lower(1) = 2;
  const NlpResult result = solve_with_sqp(problem, vector({0.3, 0.4}));
  CHECK(result.status == SolverStatus::infeasible);
  CHECK(result.evaluations < 40);
  // Beyond the circle x0^2 - 1 + 2 - x0 rises with x0 > 1/2, within it 2 - x0 falls: the least is at x0 = 1.
  CHECK(result.x(0) == Approx(1).epsilon(1e-3));
}

// Right of the start one piece falls less than the other rises, though the larger one falls: to 1.5 at x = 3.5.
TEST_CASE("sqp lowers the largest of pieces that contradict each other", "[sqp]") {
  Written program(
      1, {[](const auto& x) { return x(0); }}, {},
      {{[](const auto& x) { return 5 - x(0); }, [](const auto& x) { return 3 + 1.5 * x(0) - x(0) * x(0); }}});
  program.x_lower(0) = 0, program.x_upper(0) = 10;
  program.c_upper(0) = 1.5;
  const NlpResult result = solve_with_sqp(program, vector({0.0}), {});
  INFO(result.message);
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x(0) == Approx(3.5).epsilon(1e-8));
}

TEST_CASE("sqp goes round a point that cannot be evaluated, and ends on request", "[sqp]") {
  struct Fragile : NonlinearProgram {
    Fragile() : NonlinearProgram(1, 0) {}
    void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
      p.ok = x(0) >= 0.5;
      p.message = "the crank locks";
      p.f = 50 * (x(0) - std::log(x(0)));
      p.f_x << 50 - 50 / x(0);
    }
  } problem;
  const NlpResult result = solve_with_sqp(problem, vector({4}));
  CHECK(result.status == SolverStatus::converged);
  CHECK(result.x(0) == Approx(1).epsilon(1e-6));
  SqpOptions options;
  options.progress = [](const NlpProgress& p) { return p.iteration < 2; };
  CHECK(solve_with_sqp(problem, vector({4}), options).status == SolverStatus::stopped);
  CHECK(solve_with_sqp(problem, vector({0.1})).status == SolverStatus::failed);
}

TEST_CASE("sqp uses second derivatives that the program gives", "[sqp]") {
  struct Valley : NonlinearProgram {  // of a sum of squares: Gauss-Newton's matrix is exact at its end
    Valley() : NonlinearProgram(2, 0) {}
    void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
      const double a = 1 - x(0), b = 100 * (x(1) - x(0) * x(0));
      p.f = a * a + b * b;
      p.f_x << -2 * a - 400 * x(0) * b, 200 * b;
    }
    bool hessians(const Eigen::VectorXd& x, std::vector<Eigen::MatrixXd>& H) override {
      Eigen::Matrix2d J;
      J << -1, 0, -200 * x(0), 100;
      H = {2 * J.transpose() * J};
      return true;
    }
  } problem;
  SqpOptions options;
  options.has_hessians = true;
  const NlpResult result = solve_with_sqp(problem, vector({-1.2, 1}), options);
  CHECK(result.status == SolverStatus::converged);
  CHECK((result.x - vector({1, 1})).norm() < 1e-5);
  CHECK(result.evaluations < 120);
}
