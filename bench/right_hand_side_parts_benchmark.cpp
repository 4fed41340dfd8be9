// Where the time of a right-hand side goes, in nanoseconds per body: the parts of Dynamics::evaluate one by one, on
// arrays of their own.
//   frames          poses, their rates, accelerations at omegadot = 0
//   phi_ddot        Phiddot of all constraints
//   jacobian        J
//   assembly        S = M + J' alpha J
//   factor, solve   of S; solve: both passes, with their products with J
//   whole           Dynamics::evaluate;  linear_share: (assembly + factor + solve)/whole
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "bench/repeated.hpp"
#include "bench/right_hand_side.hpp"
#include "core/dynamics/constraint_rows.hpp"
#include "core/dynamics/constraint_terms.hpp"
#include "core/dynamics/saddle_solver.hpp"
#include "core/mechanism/row_laws.hpp"

using namespace mbsopt;
using namespace mbsopt::bench;

namespace {

void parts(benchmark::State& state, const Linkage& linkage) {
  RightHandSide whole = RightHandSide::of(linkage, "spatial");
  const MechanismData& data = whole.mechanism().data();
  const Eigen::VectorXd& y = whole.y();
  const std::size_t n = static_cast<std::size_t>(data.n);
  std::vector<Frame> frames(n + 1);
  const auto set_frames = [&] {
    const Vec<6> none = Vec<6>::Zero();
    for (int i = 1; i <= data.n; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      set_position(y.segment<7>(7 * (i - 1)), frames[k]);
      set_velocity(y.segment<7>(7 * (data.n + i - 1)), frames[k]);
      set_acceleration(none, frames[k]);
    }
  };
  RowLaws laws(data);
  laws.set_time(0);
  Eigen::VectorXd gamma(data.m), lambda(data.m);
  ConstraintRows rows(data);
  BlockCholesky S = rows.matrix();
  const FormulationSettings settings;
  const Eigen::VectorXd alpha = settings.alpha * data.row_alpha;
  SaddleSolver solver(data, alpha);
  std::vector<Vec<6>> b(n, Vec<6>::Zero()), x(n);
  for (std::size_t i = 0; i < n; ++i) b[i].head<3>() = data.bodies[i + 1].mass * data.gravity;
  const auto assemble = [&] { rows.assemble(frames, alpha, S); };
  for (auto _ : state) {
    const double per_body = 1e9 / linkage.size();
    const auto part = [&](const char* name, auto&& f) {
      const double ns = per_body * median_seconds(f);
      state.counters[name] = ns;
      return ns;
    };
    const double all = part("whole", [&] { benchmark::DoNotOptimize(whole()); });
    part("frames", set_frames);
    part("phi_ddot", [&] { ConstraintTerms(data).phi_ddot(frames, laws, gamma); });
    part("jacobian", [&] { rows.evaluate(frames); });
    const double assembly = part("assembly", assemble);
    const double assembly_and_factor = per_body * median_seconds([&] {
                                         assemble();
                                         benchmark::DoNotOptimize(S.factor());
                                       });
    state.counters["factor"] = assembly_and_factor - assembly;
    if (!solver.factor(frames)) return state.SkipWithError("S is not positive definite");
    const Eigen::VectorXd g = -gamma;
    const double solve = part("solve", [&] {
      solver.solve(b, g, {1, settings.iterations, settings.tolerance}, x, lambda);
    });
    state.counters["linear_share"] = (assembly_and_factor + solve) / all;
    state.counters["rows_per_body"] = static_cast<double>(data.m) / linkage.size();
    state.counters["blocks_per_body"] = static_cast<double>(S.fill_blocks()) / linkage.size();
  }
}

const bool registered = [] {
  const auto add = [](const std::string& name, const Linkage& linkage) {
    benchmark::RegisterBenchmark(("right_hand_side_parts/" + name).c_str(),
                                 [=](benchmark::State& state) { parts(state, linkage); })
        ->Iterations(1)
        ->Unit(benchmark::kMillisecond);
  };
  add("planar_chain/200", planar_chain(200));
  add("spatial_chain/200", spatial_chain(200));
  add("tree/200", tree(200));
  add("four_bars/40", four_bars(40));
  add("bricard", bricard());
  return true;
}();

}  // namespace
