#include "core/linear/row_dependence.hpp"

#include <Eigen/SVD>
#include <catch2/catch.hpp>
#include <random>

#include "core/start/assembly.hpp"
#include "tests/core/linear/dense_redundancy.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

namespace {

constexpr double kThreshold = 1e-8;

using Random = std::mt19937;
double normal(Random& random) { return std::normal_distribution<double>()(random); }
int below(int n, Random& random) { return std::uniform_int_distribution<int>(0, n - 1)(random); }

struct SparseRows {
  int rows, bodies, width;
  std::vector<SparseEntry> entries;

  MatrixXd dense() const {
    MatrixXd J = MatrixXd::Zero(rows, bodies * width);
    for (const SparseEntry& e : entries) J(e.row, e.column) += e.value;
    return J;
  }
};

// Rows on one to three bodies each. Every third row is a sum of earlier ones, some rows are zero, some repeat. `small`
// multiplies every third part of a row.
SparseRows arbitrary_rows(Random& random, double small = 1) {
  SparseRows J{0, 1 + below(9, random), 2 + below(6, random), {}};
  J.rows = below(3 * J.bodies * J.width / 2 + 1, random);
  MatrixXd all = MatrixXd::Zero(J.rows, J.bodies * J.width);
  for (int i = 0; i < J.rows; ++i) {
    const int kind = below(6, random);
    if (i > 0 && kind < 2) {
      const int terms = 1 + below(3, random);
      for (int k = 0; k < terms; ++k) all.row(i) += normal(random) * all.row(below(i, random));
    } else if (kind > 2 || i % 7 != 0) {
      const int parts = 1 + below(3, random);
      for (int k = 0; k < parts; ++k) {
        const int body = below(J.bodies, random);
        const double size = small == 1 || below(3, random) > 0 ? 1 : small;
        for (int c = 0; c < J.width; ++c)
          all(i, J.width * body + c) += below(3, random) == 0 ? 0 : size * normal(random);
      }
    }
    for (int c = 0; c < all.cols(); ++c)
      if (all(i, c) != 0) J.entries.push_back({i, c, all(i, c)});
  }
  return J;
}

VectorField field(const Vector3d& x) { return {x(0), x(1), x(2)}; }

Vector3d direction(Random& random) { return Vector3d(normal(random), normal(random), normal(random)).normalized(); }

// Bodies anywhere, held by a tree of joints and up to four joints more. The joints are closed where the bodies are.
// Parallel axes make loops redundant in every direction out of their plane.
Scene arbitrary_scene(Random& random) {
  Scene scene;
  const int bodies = 1 + below(12, random), more = below(5, random);
  const bool parallel = below(2, random) == 0;
  const double size = std::pow(10.0, below(5, random) - 2);
  const Vector3d common = direction(random);
  std::vector<Vector3d> r{Vector3d::Zero()};
  std::vector<Quaterniond> p{Quaterniond::Identity()};
  for (int i = 1; i <= bodies; ++i) {
    r.push_back(size * Vector3d(normal(random), normal(random), normal(random)));
    p.push_back(Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized());
    const Quaterniond& turn = p.back();
    scene.bodies.push_back(body("b" + std::to_string(i), vec("0", "0", "0"), field(r.back()),
                                EulerParametersField{{turn.w(), turn.x(), turn.y(), turn.z()}}));
  }
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  for (int k = 0; k < bodies + more; ++k) {
    const bool tree = k < bodies;
    const int body2 = tree ? k + 1 : 1 + below(bodies, random);
    int body1 = tree ? below(k + 1, random) : below(bodies + 1, random);
    if (body1 == body2) body1 = 0;
    Joint j;
    j.name = "j" + std::to_string(k);
    j.type = std::vector<std::string>{"revolute", "spherical", "cylindrical", "fixed",
                                      "translational"}[at(below(5, random))];
    if (parallel && j.type == "spherical") j.type = "revolute";
    j.body1 = body1 == 0 ? "ground" : "b" + std::to_string(body1), j.body2 = "b" + std::to_string(body2);
    const Vector3d point = size * Vector3d(normal(random), normal(random), normal(random));
    const Vector3d axis = parallel ? common : direction(random);
    const auto seen = [&](int b, const Vector3d& x) { return field(p[at(b)].conjugate() * x); };
    j.point1 = seen(body1, point - r[at(body1)]), j.point2 = seen(body2, point - r[at(body2)]);
    if (j.type != "spherical" && j.type != "fixed") j.axis1 = seen(body1, axis), j.axis2 = seen(body2, axis);
    scene.joints.push_back(j);
  }
  return scene;
}

}  // namespace

TEST_CASE("rows found independent are those that Gram-Schmidt on whole rows finds", "[row_dependence]") {
  Random random(1);
  for (int sample = 0; sample < 400; ++sample) {
    const SparseRows J = arbitrary_rows(random);
    const RowDependence found = row_dependence(J.rows, J.bodies, J.width, J.entries, kThreshold);
    INFO(sample << ": " << J.rows << " rows, " << J.bodies << " bodies of " << J.width);
    REQUIRE(found.independent == dense_independent_rows(J.dense(), kThreshold));
    REQUIRE(found.rank == std::count(found.independent.begin(), found.independent.end(), true));
    REQUIRE(static_cast<int>(found.unreached.size()) == J.bodies * J.width - found.rank);
  }
}

TEST_CASE("parts of rows that are nearly zero do not hide dependence", "[row_dependence]") {
  Random random(2);
  int clear = 0;
  for (int sample = 0; sample < 1500; ++sample) {
    const SparseRows J = arbitrary_rows(random, 3e-8);
    if (J.rows == 0) continue;
    MatrixXd dense = J.dense();
    for (auto row : dense.rowwise())
      if (row.norm() > 0) row.normalize();
    const Eigen::VectorXd s = Eigen::JacobiSVD<MatrixXd>(dense).singularValues();
    if (((s.array() > 1e-12) && (s.array() < 1e-3)).any()) continue;
    ++clear;
    INFO(sample << ": " << J.rows << " rows, " << J.bodies << " bodies of " << J.width);
    CHECK(row_dependence(J.rows, J.bodies, J.width, J.entries, kThreshold).rank == (s.array() > 1e-3).count());
  }
  CHECK(clear > 300);
}

TEST_CASE("a direction that no row reaches is found at its body", "[row_dependence]") {
  const std::vector<SparseEntry> J{
      {0, 0, 1}, {0, 3, -1}, {1, 1, 2}, {2, 2, 1}, {2, 1, 1}};  // two bodies of two columns
  const RowDependence found = row_dependence(3, 2, 2, J, kThreshold);
  CHECK(found.rank == 3);
  REQUIRE(found.unreached.size() == 1);
  const int column = 2 * found.unreached[0].body + found.unreached[0].column;
  CHECK((column == 0 || column == 3));
}

TEST_CASE("rank and redundant equations of scenes built at random are those of dense rows", "[row_dependence]") {
  Random random(2);
  int redundant = 0;
  for (int sample = 0; sample < 300; ++sample) {
    const Scene scene = arbitrary_scene(random);
    const Mechanism mechanism(scene, nominal(scene));
    const Assembly assembly(mechanism, 0);
    const ModelSummary found = assembly.summary();
    const DenseRedundancy dense = dense_redundancy(mechanism.data(), 0, assembly.result().y);
    INFO(sample << ": " << scene.bodies.size() << " bodies, " << scene.joints.size() << " joints");
    CHECK(found.rank == dense.rank);
    CHECK(found.redundant == dense.redundant);
    redundant += dense.redundant.empty() ? 0 : 1;
  }
  CHECK(redundant > 50);
}
