// Constraint primitives, one by one, between two moving bodies: what a right-hand side asks of them (residual: Phiddot;
// jacobian), and what an adjoint does (pull_back).
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "core/constraint/constraint.hpp"

using namespace mbsopt;

namespace {

Frame moving_frame(double seed) {
  Vec<7> q, v;
  q << seed, 0.3, -0.2, Vector4d(0.8, 0.1 * seed, -0.3, 0.4).normalized();
  v << 0.1, seed, 0.3, 0.5, -0.2, 0.3, 0.1;
  v.tail<4>() -= q.tail<4>().dot(v.tail<4>()) * q.tail<4>();
  Vec<6> z;
  z << 1, 2, seed, 0.3, -0.4, 0.2;
  Frame frame;
  set_position(q, frame);
  set_velocity(v, frame);
  set_acceleration(z, frame);
  set_virtual(z, frame);
  return frame;
}

template <class P>
P primitive() {
  P p;
  if constexpr (requires { p.s1; }) p.s1 = Vector3d(0.6, 0.8, 0);
  if constexpr (requires { p.s2; }) p.s2 = Vector3d(0, 0.6, 0.8);
  if constexpr (requires { p.s3; }) p.s3 = Vector3d(0.8, 0, 0.6);
  return p;
}

template <class P>
void residual(benchmark::State& state) {
  const P p = primitive<P>();
  Frame f1 = moving_frame(0.5), f2 = moving_frame(1.5);
  Vec<P::kRows> phi_ddot;
  for (auto _ : state) {
    benchmark::DoNotOptimize(f1), benchmark::DoNotOptimize(f2);
    p.phi_ddot(f1, f2, phi_ddot);
    benchmark::DoNotOptimize(phi_ddot);
  }
}

template <class P>
void jacobian(benchmark::State& state) {
  const P p = primitive<P>();
  Frame f1 = moving_frame(0.5), f2 = moving_frame(1.5);
  Mat<P::kRows, 6> J1, J2;
  for (auto _ : state) {
    benchmark::DoNotOptimize(f1), benchmark::DoNotOptimize(f2);
    p.jacobian(f1, f2, J1, J2);
    benchmark::DoNotOptimize(J1), benchmark::DoNotOptimize(J2);
  }
}

template <class P>
void pull_back(benchmark::State& state) {
  const P p = primitive<P>();
  Frame f1 = moving_frame(0.5), f2 = moving_frame(1.5);
  Multipliers<P::kRows> z;
  z.lambda.setConstant(0.4), z.mu0.setZero(), z.mu1.setZero(), z.mu2.setConstant(-0.7);
  FrameBar bar1, bar2;
  bar1.set_zero(), bar2.set_zero();
  GeometryBar s;
  for (auto _ : state) {
    benchmark::DoNotOptimize(f1), benchmark::DoNotOptimize(f2);
    p.pull_back(f1, f2, z, bar1, bar2, s);
    benchmark::DoNotOptimize(bar1), benchmark::DoNotOptimize(bar2);
  }
}

template <class P>
bool add(const char* name) {
  benchmark::RegisterBenchmark(fmt::format("primitive/{}/residual", name).c_str(), residual<P>);
  benchmark::RegisterBenchmark(fmt::format("primitive/{}/jacobian", name).c_str(), jacobian<P>);
  benchmark::RegisterBenchmark(fmt::format("primitive/{}/pull_back", name).c_str(), pull_back<P>);
  return true;
}

const bool registered = add<Coincidence>("coincidence") && add<Dot1>("dot1") && add<Dot2>("dot2") &&
                        add<Distance>("distance") && add<Angle>("angle") && add<Coordinate>("coordinate");

}  // namespace
