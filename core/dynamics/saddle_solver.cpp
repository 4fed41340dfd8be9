#include "core/dynamics/saddle_solver.hpp"

#include <algorithm>
#include <cmath>

namespace mbsopt {
namespace {

// A pass that reduces the residual by less than this factor ends the refinement. The residual is rounding, the position
// is singular, or redundant rows disagree.
constexpr double kStagnation = 0.97;
// A pass that gains less than kSlow is near a singular position. The remaining residual there moves x far along the
// freedom that opens. So refinement continues to kRounding, whatever tolerance suffices elsewhere.
constexpr double kSlow = 1e-6, kRounding = 1e-14;

// z_r *= 1 - c alpha_r of each row r.
template <class Y>
void reduce(double c, const Eigen::VectorXd& alpha, Y& z) {
  for (Eigen::Index r = 0; r < alpha.size(); ++r) entries(z)[r] *= 1 - c * alpha(r);
}

// Takes back the last pass, which added correction to x and -alpha residual to nu.
template <class X, class Y>
void take_back(const Eigen::VectorXd& alpha, std::vector<X>& x, Y& nu, const Y& residual,
               const std::vector<X>& correction) {
  for (std::size_t i = 0; i < x.size(); ++i) x[i] -= correction[i];
  for (Eigen::Index r = 0; r < alpha.size(); ++r) entries(nu)[r] += alpha(r) * entries(residual)[r];
}

// A residual above this, relative as in Settings, is more than rounding.
constexpr double kDisagreement = 1e-14;

}  // namespace

template <class Rows>
BlockSaddleSolver<Rows>::BlockSaddleSolver(const MechanismData& data, const Eigen::VectorXd& alpha, double c,
                                           const Added& added)
    : rows_(data), S_(rows_.matrix()), alpha_(alpha), c_(c), added_(added) {
  const std::size_t n = static_cast<std::size_t>(data.n);
  residual_.setZero(rows_.count());
  residual_lanes_.setZero(rows_.count(), kLanes);
  correction_.resize(n);
  correction_lanes_.resize(n);
}

template <class Rows>
bool BlockSaddleSolver<Rows>::factor(const Frames& frames, Eigen::VectorXd* phi_ddot) {
  rows_.assemble(frames, alpha_, S_, phi_ddot);
  for (const AddedMass<kUnknowns>& a : added_) S_.diagonal(a.body - 1) += a.M;
  ++factorisations_;
  return S_.factor();
}

template <class Rows>
template <class X, class Y>
void BlockSaddleSolver<Rows>::solve_any(const std::vector<X>& b, const Y& g, const Settings& settings,
                                        std::vector<X>& x, Y& nu, Y& residual, std::vector<X>& correction) {
  if (g.rows() == 0) {
    x = b;
    S_.solve(std::span(x));
    return;
  }
  residual = g;
  const SaddleIterate at{alpha_.data(), b[0].data(),     x[0].data(),
                         nu.data(),     residual.data(), static_cast<std::size_t>(alpha_.size())};
  const double size_of_g = g.cwiseAbs().maxCoeff();
  refine(at, true, size_of_g, settings, x, nu, residual, correction);
  if (c_ > 0 && residual_ratio_ > kDisagreement) {
    nu -= residual / c_;
    residual.setZero();
    refine(at, false, size_of_g, settings, x, nu, residual, correction);
  }
}

template <class Rows>
template <class X, class Y>
void BlockSaddleSolver<Rows>::refine(const SaddleIterate& at, bool from_zero, double size_of_g,
                                     const Settings& settings, std::vector<X>& x, Y& nu, Y& residual,
                                     std::vector<X>& correction) {
  double before = INFINITY;
  for (int k = 0;; ++k) {
    const bool first = from_zero && k == 0, last = k >= settings.most, decides = last || k + 1 >= settings.least;
    rows_.load(at, first, correction);  // b - M x - J'nu + J' alpha residual
    for (const AddedMass<kUnknowns>& a : added_) {
      if (!first) correction[static_cast<std::size_t>(a.body) - 1] -= a.M * x[static_cast<std::size_t>(a.body) - 1];
    }
    S_.solve(std::span<X>(correction));
    SaddleSizes sizes = rows_.correct(at, first, correction);
    if (c_ > 0) reduce(c_, alpha_, residual);
    if (!decides) continue;
    if (c_ > 0) sizes.residual = residual.cwiseAbs().maxCoeff();
    const double now = sizes.residual;
    if (last || k >= settings.least) {
      const double size = std::max(sizes.x, size_of_g);
      residual_ratio_ = size > 0 ? now / size : 0.0;
      residual_size_ = now;
      const double tolerance = now > kSlow * before ? std::min(settings.tolerance, kRounding) : settings.tolerance;
      if (residual_ratio_ <= tolerance) return;
      if (!(now < kStagnation * before)) {
        if (c_ == 0 && k > settings.least) take_back(alpha_, x, nu, residual, correction);
        return;
      }
      if (last) return;
    }
    before = now;
  }
}

template <class Rows>
void BlockSaddleSolver<Rows>::solve(const Vector& b, const Eigen::VectorXd& g, const Settings& settings, Vector& x,
                                    Eigen::VectorXd& nu) {
  solve_any(b, g, settings, x, nu, residual_, correction_);
}
template <class Rows>
void BlockSaddleSolver<Rows>::solve(const LaneVector& b, const LaneRows& g, const Settings& settings, LaneVector& x,
                                    LaneRows& nu) {
  solve_any(b, g, settings, x, nu, residual_lanes_, correction_lanes_);
}

template class BlockSaddleSolver<ConstraintRows>;
template class BlockSaddleSolver<PlanarRows>;

}  // namespace mbsopt
