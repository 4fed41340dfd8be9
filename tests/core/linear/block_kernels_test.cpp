#include "core/linear/kernel_table.hpp"

#include <catch2/catch.hpp>

#include <Eigen/Core>
#include <random>
#include <vector>

using namespace mbsopt;

namespace {

constexpr int kDirections = 4;  // in lanes
template <int Columns>          // one vector, or lanes
using Numbers = Eigen::Matrix<double, Eigen::Dynamic, Columns, Columns == 1 ? Eigen::ColMajor : Eigen::RowMajor>;
using Rows = Numbers<kDirections>;

// Numbers in [-1, 1].
template <int Columns = kDirections>
Numbers<Columns> random_rows(Eigen::Index rows, int seed) {
  std::mt19937 generator(static_cast<unsigned>(seed));
  std::uniform_real_distribution<double> number(-1, 1);
  return Numbers<Columns>::NullaryExpr(rows, Columns, [&] { return number(generator); });
}
std::vector<double> random_numbers(std::size_t count, int seed) {
  const Numbers<1> x = random_rows<1>(static_cast<Eigen::Index>(count), seed);
  return {x.begin(), x.end()};
}

void require_equal(const Eigen::MatrixXd& x, const Eigen::MatrixXd& expected) {
  REQUIRE((x - expected).cwiseAbs().maxCoeff() < 1e-13 * (1 + expected.cwiseAbs().maxCoeff()));
}

// What the processor at hand chooses from.
std::vector<const BlockKernels*> all_kernels() {
  std::vector<const BlockKernels*> all{&portable_block_kernels()};
  if (avx2_block_kernels()) {
    all.push_back(avx2_block_kernels());
  } else {
    WARN("no AVX2 here: only the portable loops are tested");
  }
  return all;
}

// Three bodies, the last one tied to both others: body order 2, 0, 1; L of two blocks below the diagonal.
template <int N>
struct Factor {
  std::vector<int> order{2, 0, 1}, first_block{0, 1, 2, 2}, body{1, 1};
  std::vector<double> W = random_numbers(3 * N * N, 1), L = random_numbers(2 * N * N, 2), D = random_numbers(3 * N, 3);

  Factor() {
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t j = 0; j < N; ++j) {
        for (std::size_t i = 0; i <= j; ++i) W[N * N * k + N * j + i] = 0;  // inv(L) below the diagonal alone
      }
    }
  }
  FactorView view() const { return {3, order.data(), first_block.data(), body.data(), W.data(), L.data(), D.data()}; }
  // inv(S) = W' inv(D) W with W = inv(L) as a whole.
  Eigen::MatrixXd inverse() const {
    Eigen::MatrixXd forward = Eigen::MatrixXd::Identity(3 * N, 3 * N);
    const auto at = [](const std::vector<double>& of, int k) {
      return Eigen::Map<const Eigen::Matrix<double, N, N>>(of.data() + N * N * k);
    };
    Eigen::VectorXd inverse_D(3 * N);
    for (int k = 0; k < 3; ++k) {
      const int b = N * order[static_cast<std::size_t>(k)];
      Eigen::MatrixXd of_k = Eigen::MatrixXd::Identity(3 * N, 3 * N), below = of_k;
      of_k.block(b, b, N, N) = at(W, k).template triangularView<Eigen::UnitLower>();
      if (k < 2) below.block(N, b, N, N) = -at(L, k);
      forward = below * of_k * forward;
      for (int i = 0; i < N; ++i) inverse_D(b + i) = D[static_cast<std::size_t>(N * k + i)];
    }
    return forward.transpose() * inverse_D.asDiagonal() * forward;
  }
};

template <int N, int Columns>
void test_solve(void (*solve)(const FactorView&, double*)) {
  const Factor<N> factor;
  Numbers<Columns> x = random_rows<Columns>(3 * N, 4);
  const Eigen::MatrixXd expected = factor.inverse() * x;
  solve(factor.view(), x.data());
  require_equal(x, expected);
}

// A joint of the ground and body 1 (a full row, one of a single displacement), one of bodies 1 and 2 (a row without
// displacements, two full ones), and one of body 2 and the ground, which shares the last row.
struct InSpace {
  std::vector<RowsInSpace::Group> groups{{0, 1, 0, 0, 2}, {1, 2, 2, 2, 3}, {2, 0, 4, 5, 1}};
  std::vector<RowsInSpace::Columns> columns{{0, 3}, {1, 2}, {3, 3}, {0, 3}, {0, 3}, {0, 3}};
  std::vector<RowsInSpace::Body> bodies{{2.0, {1, 0.1, 0.2, 0.1, 2, 0.3, 0.2, 0.3, 3}},
                                        {3.0, {2, 0.2, 0.1, 0.2, 1, 0.1, 0.1, 0.1, 4}}};
  std::vector<double> J1 = random_numbers(36, 5), J2 = random_numbers(36, 6);  // per block row
  static constexpr int rows = 5, unknowns = 12;

  InSpace() {
    for (std::vector<double>* J : {&J1, &J2}) {
      (*J)[6] = (*J)[8] = 0;
      (*J)[12] = (*J)[13] = (*J)[14] = 0;
    }
  }
  RowsInSpace view() const {
    return {groups.data(), groups.size(), J1.data(), J2.data(), columns.data(), bodies.data(), bodies.size()};
  }
  Eigen::MatrixXd J() const {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(rows, unknowns);
    for (const RowsInSpace::Group& g : groups) {
      for (int r = 0; r < g.rows; ++r) {
        const Eigen::Map<const Eigen::RowVectorXd> a(J1.data() + 6 * (g.block + r), 6),
            b(J2.data() + 6 * (g.block + r), 6);
        if (g.body1 > 0) J.block(g.row + r, 6 * (g.body1 - 1), 1, 6) += a;
        if (g.body2 > 0) J.block(g.row + r, 6 * (g.body2 - 1), 1, 6) += b;
      }
    }
    return J;
  }
  Eigen::MatrixXd M() const {
    Eigen::MatrixXd M = Eigen::MatrixXd::Zero(unknowns, unknowns);
    for (int b = 0; b < 2; ++b) {
      const RowsInSpace::Body& body = bodies[static_cast<std::size_t>(b)];
      M.block(6 * b, 6 * b, 3, 3).diagonal().setConstant(body.mass);
      M.block(6 * b + 3, 6 * b + 3, 3, 3) = Eigen::Map<const Eigen::Matrix3d>(body.J);
    }
    return M;
  }
};

// A hinge of the ground and body 1, one of bodies 1 and 2, and a row of body 2.
struct InPlane {
  std::vector<RowsInPlane::Point> points{{0, 1, 0, 1, {0, 0}, {0.3, -0.4}}, {1, 2, 2, 3, {0.5, 0.6}, {-0.7, 0.8}}};
  std::vector<RowsInPlane::Entry> entries{{2, 4, {0.1, -0.2, 0.3}}};
  std::vector<RowsInPlane::Body> bodies{{2, 0.5}, {3, 0.7}};
  static constexpr int rows = 5, unknowns = 6;

  RowsInPlane view() const {
    return {points.data(), points.size(), entries.data(), entries.size(), bodies.data(), bodies.size()};
  }
  Eigen::MatrixXd J() const {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(5, 6);
    J.row(0) << 1, 0, 0.4, 0, 0, 0;
    J.row(1) << 0, 1, 0.3, 0, 0, 0;
    J.row(2) << -1, 0, 0.6, 1, 0, -0.8;
    J.row(3) << 0, -1, -0.5, 0, 1, -0.7;
    J.row(4) << 0, 0, 0, 0.1, -0.2, 0.3;
    return J;
  }
  Eigen::MatrixXd M() const {
    Eigen::VectorXd M(6);
    M << 2, 2, 0.5, 3, 3, 0.7;
    return M.asDiagonal();
  }
};

template <class Model, int Columns, class View>
void test_products(const RowKernels<View>& kernels) {
  const Model model;
  const Numbers<Columns> x = random_rows<Columns>(Model::unknowns, 7), lambda = random_rows<Columns>(Model::rows, 8);
  Numbers<Columns> y = lambda, of_x = x;
  kernels.subtract_times(model.view(), x.data(), y.data());
  require_equal(y, lambda - model.J() * x);
  kernels.subtract_transposed_times(model.view(), lambda.data(), of_x.data());
  require_equal(of_x, x - model.J().transpose() * lambda);
}

template <class Model, int Columns, class View>
void test_pass(const RowKernels<View>& kernels) {
  const Model model;
  for (const bool first : {true, false}) {
    const Eigen::VectorXd alpha = Eigen::VectorXd::LinSpaced(Model::rows, 1, 2);
    const Numbers<Columns> b = random_rows<Columns>(Model::unknowns, 9), dx = random_rows<Columns>(Model::unknowns, 10);
    Numbers<Columns> x = random_rows<Columns>(Model::unknowns, 11), nu = random_rows<Columns>(Model::rows, 12),
                     residual = random_rows<Columns>(Model::rows, 13);
    const Eigen::MatrixXd x0 = first ? Eigen::MatrixXd::Zero(x.rows(), Columns) : Eigen::MatrixXd(x);
    const Eigen::MatrixXd nu0 = first ? Eigen::MatrixXd::Zero(nu.rows(), Columns) : Eigen::MatrixXd(nu);
    const Eigen::MatrixXd residual0 = residual;
    const SaddleIterate at{alpha.data(), b.data(),        x.data(),
                           nu.data(),    residual.data(), static_cast<std::size_t>(Model::rows)};

    Numbers<Columns> correction = random_rows<Columns>(Model::unknowns, 14);
    kernels.load(model.view(), at, first, correction.data());
    require_equal(correction, b - model.M() * x0 - model.J().transpose() * (nu0 - alpha.asDiagonal() * residual0));

    const SaddleSizes sizes = kernels.correct(model.view(), at, first, dx.data());
    const Eigen::MatrixXd left = residual0 - model.J() * dx;
    require_equal(x, x0 + dx);
    require_equal(residual, left);
    require_equal(nu, nu0 - alpha.asDiagonal() * left);
    REQUIRE(sizes.x == x.cwiseAbs().maxCoeff());
    REQUIRE(sizes.residual == residual.cwiseAbs().maxCoeff());
  }
}

template <int N>
void test_motion(void (*add)(const MotionBlockView<N>*, const MotionPlace*, const int*, std::size_t, std::size_t,
                             const double*, double*)) {
  enum { r = 1, p = 2, rdot = 4, pdot = 8 };
  const std::vector<int> parts{p | pdot, r | p | rdot | pdot, 0, r, rdot, 0, r, rdot, p, 0, pdot};
  const std::vector<MotionPlace> places{{0, 0}, {0, 1}, {1, 0}, {1, 1}, {1, 2}, {2, 0},
                                        {2, 1}, {2, 2}, {3, 0}, {3, 1}, {3, 2}};
  const std::vector<int> first_place{0, 2, 5, 8, 11};
  std::vector<MotionBlockView<N>> blocks(parts.size());
  const Rows y = random_rows(42, 15), start = random_rows(4 * N, 16);
  Eigen::MatrixXd expected = start;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    MotionBlockView<N>& b = blocks[k];
    b.parts = parts[k];
    const std::vector<double> q = random_numbers(7 * N, 17 + 2 * static_cast<int>(k)),
                              v = random_numbers(7 * N, 18 + 2 * static_cast<int>(k));
    for (int j = 0; j < 7; ++j) {
      for (int i = 0; i < N; ++i) {
        const std::size_t at = static_cast<std::size_t>(i + N * j);
        b.q[at] = b.parts & (j < 3 ? r : p) ? q[at] : 0;
        b.v[at] = b.parts & (j < 3 ? rdot : pdot) ? v[at] : 0;
        expected.row(N * places[k].row + i) +=
            b.q[at] * y.row(7 * places[k].body + j) + b.v[at] * y.row(21 + 7 * places[k].body + j);
      }
    }
  }
  Rows out = start;
  add(blocks.data(), places.data(), first_place.data(), 4, 3, y.data(), out.data());
  require_equal(out, expected);
}

}  // namespace

TEST_CASE("loops of the block solvers solve with a factor, vectors and lanes, for whatever processor") {
  for (const BlockKernels* kernels : all_kernels()) {
    test_solve<6, 1>(kernels->in_space.solve);
    test_solve<3, 1>(kernels->in_plane.solve);
    test_solve<6, kDirections>(kernels->lanes_in_space.solve);
    test_solve<3, kDirections>(kernels->lanes_in_plane.solve);
  }
}

TEST_CASE("loops of the block solvers factor blocks of six, for whatever processor") {
  using Block = Eigen::Matrix<double, 6, 6>;
  for (const BlockKernels* kernels : all_kernels()) {
    const Block X = Eigen::Map<const Block>(random_numbers(36, 41).data());
    const Block A = X * X.transpose() + Block::Identity();
    Block W = A.triangularView<Eigen::Lower>();
    Eigen::Matrix<double, 6, 1> inverse_D;
    REQUIRE(kernels->factor_diagonal(W.data(), inverse_D.data()));
    REQUIRE(W.triangularView<Eigen::Upper>().toDenseMatrix().cwiseAbs().maxCoeff() == 0);
    const Block inverse_L = W + Block::Identity();
    const Block D = inverse_D.cwiseInverse().asDiagonal();
    REQUIRE((inverse_L * A * inverse_L.transpose() - D).cwiseAbs().maxCoeff() < 1e-13 * A.norm());

    Block of_below = Eigen::Map<const Block>(random_numbers(36, 42).data()), LD;
    const Block below = of_below;
    kernels->divide(W.data(), inverse_D.data(), of_below.data(), LD.data());
    REQUIRE((LD - below * inverse_L.transpose()).norm() < 1e-13 * (1 + LD.norm()));
    REQUIRE((of_below * D - LD).norm() < 1e-13 * (1 + LD.norm()));

    Block C = Block::Ones();
    kernels->subtract_product(LD.data(), of_below.data(), C.data());
    REQUIRE((C - (Block::Ones() - LD * of_below.transpose())).norm() < 1e-12 * (1 + C.norm()));

    Block not_positive = -Block::Identity();
    REQUIRE_FALSE(kernels->factor_diagonal(not_positive.data(), inverse_D.data()));
  }
}

TEST_CASE("loops of the block solvers add squares of rows and leave out their empty columns, for whatever processor") {
  using Block = Eigen::Matrix<double, 6, 6>;
  using SixRows = Eigen::Matrix<double, 3, 6, Eigen::RowMajor>;
  const InSpace model;
  const SixRows a = Eigen::Map<const SixRows>(model.J1.data()), b = Eigen::Map<const SixRows>(model.J2.data());
  const Eigen::Vector3d alpha(1, 2, 3);
  for (const BlockKernels* kernels : all_kernels()) {
    Block aa = Block::Ones(), bb = aa, ab = aa;
    kernels->add_weighted_squares(3, alpha.data(), model.columns.data(), a.data(), b.data(), aa.data(), bb.data(),
                                  ab.data());
    REQUIRE((aa - Block::Ones() - a.transpose() * alpha.asDiagonal() * a).norm() < 1e-13);
    REQUIRE((bb - Block::Ones() - b.transpose() * alpha.asDiagonal() * b).norm() < 1e-13);
    REQUIRE((ab - Block::Ones() - a.transpose() * alpha.asDiagonal() * b).norm() < 1e-13);
    kernels->add_weighted_squares(3, alpha.data(), model.columns.data(), a.data(), b.data(), aa.data(), nullptr,
                                  nullptr);
    REQUIRE((aa - Block::Ones() - 2 * a.transpose() * alpha.asDiagonal() * a).norm() < 1e-13);
  }
}

TEST_CASE(
    "loops of the block solvers multiply by the constraints' Jacobian and its transpose, for whatever processor") {
  for (const BlockKernels* kernels : all_kernels()) {
    test_products<InSpace, 1>(kernels->in_space);
    test_products<InPlane, 1>(kernels->in_plane);
    test_products<InSpace, kDirections>(kernels->lanes_in_space);
    test_products<InPlane, kDirections>(kernels->lanes_in_plane);
  }
}

TEST_CASE("loops of the block solvers take a pass of the saddle-point solver, for whatever processor") {
  for (const BlockKernels* kernels : all_kernels()) {
    test_pass<InSpace, 1>(kernels->in_space);
    test_pass<InPlane, 1>(kernels->in_plane);
    test_pass<InSpace, kDirections>(kernels->lanes_in_space);
    test_pass<InPlane, kDirections>(kernels->lanes_in_plane);
  }
}

TEST_CASE(
    "loops of the block solvers multiply by blocks of motion and leave out their empty parts, for whatever processor") {
  for (const BlockKernels* kernels : all_kernels()) {
    test_motion<6>(kernels->add_motion_of_bodies);
    test_motion<1>(kernels->add_motion_of_rows);
  }
}

TEST_CASE("loops of the block solvers sum the stages of positions and velocities at once, for whatever processor") {
  for (const BlockKernels* kernels : all_kernels()) {
    for (const Eigen::Index rows : {1, 3, 4, 9}) {
      const Rows k0 = random_rows(rows, 30), k1 = random_rows(rows, 31), v0 = random_rows(rows, 32);
      Rows q = random_rows(rows, 33), v = random_rows(rows, 34);
      const Eigen::MatrixXd q0 = q;
      const double* const k[] = {k0.data(), k1.data()};
      const double c[] = {0.5, -2}, d[] = {0, 3};
      kernels->sum_stages(static_cast<std::size_t>(rows), 2, k, c, d, q.data(), v0.data(), q.data(), v.data());
      require_equal(q, q0 + 0.5 * k0 - 2 * k1);
      require_equal(v, v0 + 3 * k1);
    }
  }
}
