#include "core/start/nearest_point_linearisation.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "core/mechanism/joint_graph.hpp"

namespace mbsopt {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kRelativeRounding = std::numeric_limits<double>::epsilon();

// An orthonormal basis of { x : J x / sizes = 0 }. The columns of W, orthonormal in units of the sizes, span it.
// Columns that turn no body (or, if lengths are large, move none) have a part of rounding in p (in r). In the units of
// x this part is eps/L for lengths L. It multiplies the large g of p beside the small g of r, so a part eps/L^2 of r
// would be wrong. The part is therefore set to zero exactly, unless J needs it. J needs the part of z if J times the
// rest exceeds rounding; then z - J+ J z contains it.
MatrixXd orthonormal_null_space(const MatrixXd& J, const OrthogonalDecomposition& J_transposed, const VectorXd& sizes) {
  const MatrixXd W = J_transposed.left_null_space();
  const double heavy = sizes.size() > 0 ? sizes.maxCoeff() : 0;
  std::vector<Eigen::Index> heavy_rows;
  for (Eigen::Index i = 0; i < sizes.size(); ++i) {
    if (sizes(i) == heavy) heavy_rows.push_back(i);
  }
  if (W.size() == 0 || heavy_rows.size() == static_cast<std::size_t>(sizes.size())) return orthonormal_columns(W);
  const LeftSingular parts = left_singular(W(heavy_rows, Eigen::all).transpose());
  const Eigen::Index both = (parts.values.array() > NearestPointLinearisation::kRankThreshold).count();
  MatrixXd light = W * parts.U.rightCols(W.cols() - both);
  light(heavy_rows, Eigen::all).setZero();
  const MatrixXd heavy_part = -J_transposed.solve_transposed(J * light), left = J * heavy_part;
  const double rounding = static_cast<double>(J.cols()) * kRelativeRounding;  // of sums along a row of length 1
  Eigen::Index coupled = 0;
  MatrixXd U = MatrixXd::Identity(light.cols(), light.cols());
  if (left.size() > 0 && left.lpNorm<Eigen::Infinity>() > rounding) {
    LeftSingular couplings = left_singular(left.transpose());
    coupled = (couplings.values.array() > rounding).count();
    U = std::move(couplings.U);
  }
  MatrixXd mixed(W.rows(), both + coupled), Z(W.rows(), W.cols());
  mixed << W * parts.U.leftCols(both), (light + heavy_part) * U.leftCols(coupled);
  Z << orthonormal_columns(sizes.asDiagonal() * mixed), orthonormal_columns(light * U.rightCols(U.cols() - coupled));
  return Z;
}

// Does the same part by part, so that each column is exactly zero outside its part. Rounding there would be multiplied
// by the second derivatives of another part's equations, which in a mechanism of micrometres are 1e12 times larger.
MatrixXd null_space_by_parts(const MatrixXd& J, const OrthogonalDecomposition& J_transposed, const VectorXd& sizes) {
  const std::vector<JoinedPart> parts = joined_parts(J);
  if (parts.size() == 1) return orthonormal_null_space(J, J_transposed, sizes);
  MatrixXd Z = MatrixXd::Zero(J.cols(), J.cols());
  Eigen::Index columns = 0;
  for (const JoinedPart& part : parts) {
    const MatrixXd own = J(part.rows, part.unknowns);
    const OrthogonalDecomposition decomposed(own.transpose(), NearestPointLinearisation::kRankThreshold);
    const MatrixXd free = orthonormal_null_space(own, decomposed, sizes(part.unknowns));
    Z(part.unknowns, Eigen::seqN(columns, free.cols())) = free;
    columns += free.cols();
  }
  return Z.leftCols(columns);
}

}  // namespace

std::vector<JoinedPart> joined_parts(const MatrixXd& A) {
  const int unknowns = static_cast<int>(A.cols()), rows = static_cast<int>(A.rows());
  Neighbours neighbours(at(unknowns + rows));
  for (int i = 0; i < rows; ++i)
    for (int k = 0; k < unknowns; ++k)
      if (A(i, k) != 0) join(k, unknowns + i, neighbours);
  std::vector<int> lengths(neighbours.size(), -1);
  std::vector<JoinedPart> parts;
  for (std::size_t first = 0; first < at(unknowns); ++first) {
    if (lengths[first] >= 0) continue;
    JoinedPart& part = parts.emplace_back();
    std::vector<std::size_t> reached = measure_paths(neighbours, first, lengths);
    std::ranges::sort(reached);
    for (const std::size_t k : reached) {
      const Eigen::Index place = static_cast<Eigen::Index>(k);
      k < at(unknowns) ? part.unknowns.push_back(place) : part.rows.push_back(place - unknowns);
    }
  }
  return parts;
}

NearestPointLinearisation::NearestPointLinearisation(const MatrixXd& J, const VectorXd& sizes) : J_(J), sizes_(sizes) {
  const UnitRows rows(J * sizes.asDiagonal());
  scale_ = rows.scale;
  J_transposed_ = OrthogonalDecomposition(rows.J.transpose(), kRankThreshold);
  Z_ = null_space_by_parts(rows.J, J_transposed_, sizes);
}

MatrixXd NearestPointLinearisation::multipliers(const MatrixXd& g) const {
  return scale_.asDiagonal() * J_transposed_.solve(sizes_.asDiagonal() * g);
}
// Rounding leaves an error of eps L in r and eps in p. So the rows of the smaller size (r of tiny mechanisms) determine
// the part of nu that they can. The other rows determine the rest, which is larger. A second pass over the first rows
// removes its rounding.
VectorXd NearestPointLinearisation::multipliers_at(const VectorXd& away) const {
  const double smallest = sizes_.minCoeff();
  if (smallest == sizes_.maxCoeff()) return multipliers(away);
  std::vector<Eigen::Index> fine, coarse;
  for (Eigen::Index i = 0; i < sizes_.size(); ++i) (sizes_(i) == smallest ? fine : coarse).push_back(i);
  const MatrixXd A = sizes_.asDiagonal() * J_.transpose() * scale_.asDiagonal();
  const VectorXd b = sizes_.cwiseProduct(away);
  const MatrixXd A_fine = A(fine, Eigen::all), A_coarse = A(coarse, Eigen::all);
  const OrthogonalDecomposition fine_rows(A_fine, kRankThreshold);
  VectorXd nu = fine_rows.solve(b(fine));
  const MatrixXd N = mbsopt::null_space(A_fine, kRankThreshold);
  if (N.cols() > 0) {
    nu += N * OrthogonalDecomposition(A_coarse * N, kRankThreshold).solve(b(coarse) - A_coarse * nu);
    nu += fine_rows.solve(b(fine) - A_fine * nu);
  }
  return scale_.cwiseProduct(nu);
}
MatrixXd NearestPointLinearisation::particular(const MatrixXd& b) const {
  return sizes_.asDiagonal() * J_transposed_.solve_transposed(scale_.asDiagonal() * b);
}
MatrixXd NearestPointLinearisation::pseudo_inverse_times(const MatrixXd& b) const {
  const MatrixXd x = particular(b), along = Z_.transpose() * x;
  return x - Z_ * along;
}

void NearestPointLinearisation::set_hessian(const MatrixXd& H) {
  H_ = H;
  if (Z_.cols() == 0) {
    lambda_.resize(0);
    V_.resize(0, 0);
    return;
  }
  const MatrixXd HZ = H * Z_, M = Z_.transpose() * HZ;
  auto [values, vectors] = symmetric_eigen(0.5 * (M + M.transpose()));
  lambda_ = std::move(values);
  V_ = std::move(vectors);
}

// Z V inv(lambda) V'Z' gap, by products of plain matrices: each other form of a product is compiled anew.
MatrixXd NearestPointLinearisation::free_part(const MatrixXd& gap) const {
  const MatrixXd reduced = Z_.transpose() * gap;
  MatrixXd modes = V_.transpose() * reduced;
  modes.array().colwise() /= lambda_.array();
  const MatrixXd free = V_ * modes;
  return Z_ * free;
}

MatrixXd NearestPointLinearisation::solve(const MatrixXd& b, const MatrixXd& g) const {
  const MatrixXd x = particular(b), gap = g - H_ * x;
  return x + free_part(gap);
}

void NearestPointLinearisation::solve_transposed(const MatrixXd& x_bar, MatrixXd& b_bar, MatrixXd& g_bar) const {
  g_bar = free_part(x_bar);
  b_bar = multipliers(x_bar - H_.transpose() * g_bar);
}

double NearestPointLinearisation::rounding(const MatrixXd& x, const MatrixXd& g) const {
  if (Z_.cols() == 0) return 0;
  const MatrixXd Z = Z_.cwiseAbs(), V = V_.cwiseAbs(), H = H_.cwiseAbs(), x_size = x.cwiseAbs(), ZV = Z_ * V_;
  const MatrixXd terms = g.cwiseAbs() + H * x_size, reduced = Z.transpose() * terms;
  MatrixXd along = V.transpose() * reduced;
  along.array().colwise() /= lambda_.array().abs();
  const MatrixXd modes = ZV.cwiseAbs(), error = modes * along;
  double worst = 0;
  for (Eigen::Index k = 0; k < x.cols(); ++k) {
    const double size = x_size.col(k).cwiseQuotient(sizes_).maxCoeff();
    if (size > 0) worst = std::max(worst, kRelativeRounding * error.col(k).cwiseQuotient(sizes_).maxCoeff() / size);
  }
  return worst;
}

}  // namespace mbsopt
