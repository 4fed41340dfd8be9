#include "core/start/equilibrium.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/dynamics/spatial_dynamics.hpp"
#include "core/force/forces.hpp"
#include "core/linear/dense.hpp"
#include "core/projection/projection.hpp"
#include "core/sensor/body_at.hpp"
#include "core/start/assembly_equations.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostEquilibriumIterations = 500;
constexpr double kLargestStep = 0.2;         // of a coordinate at once [lengths of the mechanism, rad]
constexpr double kRestRankThreshold = 1e-8;  // rows of J scaled to unit length
constexpr double kTolerance = 1e-11;         // of the last Newton step [lengths of the mechanism, rad]
constexpr double kPredicted = 0.5;           // of the forces: a downhill step with a larger difference is too long
constexpr double kWellPredicted = 0.1;       // and one that differs less may be followed by a longer one

class Statics {
 public:
  Statics(const Mechanism& mechanism, double t, const VectorXd& q_guess, const VectorXd& angles)
      : d_(mechanism.data()),
        t_(t),
        layout_{d_.n},
        dynamics_(mechanism, FormulationSettings{}),
        projector_(make_projector(mechanism, Projection::position_velocity)),
        equations_(d_, AssemblyLevel::position, t),
        angles_(angles),
        ydot_(layout_.size()) {
    dynamics_.terms().hold_laws();
    length_ = length_at(at_rest_in(q_guess));
  }

  // q_dir = T(p) xi, columns
  MatrixXd to_q(const VectorXd& q, const MatrixXd& xi) const {
    MatrixXd out(layout_.positions(), xi.cols());
    for (int i = 1; i <= d_.n; ++i) {
      const Vector4d p = q.segment<4>(layout_.p(i));
      for (Index k = 0; k < xi.cols(); ++k) {
        const Vec<6> of_body = xi.col(k).segment<6>(layout_.z(i));
        out.col(k).segment<3>(layout_.q(i)) = of_body.head<3>();
        out.col(k).segment<4>(layout_.p(i)) = 0.5 * G_transposed_times(p, of_body.tail<3>());
      }
    }
    return out;
  }

  bool evaluate(const VectorXd& q) {
    y_ = at_rest_in(q);
    if (!dynamics_.evaluate(t_, y_, angles_, ydot_)) return false;
    dynamics_.linearise_here();
    z_.resize(freedoms_);
    Index row = 0;
    for (const Vec<6>& z : dynamics_.z()) z_.segment<6>(row) = z, row += 6;
    return z_.allFinite();
  }

  // Tangents of z: in the directions xi (6n x 6n identity), and in the parameters.
  MatrixXd z_of_positions() {
    const MatrixXd directions = to_q(y_.head(layout_.positions()), MatrixXd::Identity(freedoms_, freedoms_));
    MatrixXd out(freedoms_, freedoms_);
    const ParameterBlock none = block_without_parameters(d_);
    LaneRows y_dir(layout_.size(), kLanes), ydot_dir(layout_.size(), kLanes);
    for (Index first = 0; first < freedoms_; first += kLanes) {
      y_dir.setZero();
      const Index lanes = std::min<Index>(kLanes, freedoms_ - first);
      y_dir.topLeftCorner(layout_.positions(), lanes) = directions.middleCols(first, lanes);
      dynamics_.tangent(none, y_dir, ydot_dir);
      Index row = 0;
      for (const Lanes<6>& z : dynamics_.z_tangent()) out.block(row, first, 6, lanes) = z.leftCols(lanes), row += 6;
    }
    return out;
  }
  MatrixXd z_of_parameters() {
    MatrixXd out = MatrixXd::Zero(freedoms_, d_.rho.size());
    const LaneRows y_dir = LaneRows::Zero(layout_.size(), kLanes);
    LaneRows ydot_dir(layout_.size(), kLanes);
    for (const ParameterBlock& block : parameter_blocks(d_)) {
      dynamics_.tangent(block, y_dir, ydot_dir);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (block.parameter[lane] < 0) continue;
        Index row = 0;
        for (const Lanes<6>& z : dynamics_.z_tangent()) {
          out.col(block.parameter[lane]).segment<6>(row) = z.col(lane), row += 6;
        }
      }
    }
    return out;
  }

  // J, its null space and Phi_rho at y.
  struct Rows {
    MatrixXd J, N, phi_rho;
    OrthogonalDecomposition J_scaled;
    VectorXd scale;
    MatrixXd particular(const MatrixXd& b) const {  // J xi = b
      if (J.rows() == 0) return MatrixXd::Zero(N.rows(), b.cols());
      return J_scaled.solve(scale.asDiagonal() * b);
    }
  };
  Rows rows() {
    Rows r;
    if (d_.m == 0) {
      r.J.resize(0, freedoms_), r.phi_rho.resize(0, d_.rho.size());
      r.N.setIdentity(freedoms_, freedoms_);
      return r;
    }
    equations_.start_branches(y_);
    const AssemblyEquations::Gradients g = equations_.gradients(y_);
    r.J = g.y.topLeftCorner(d_.m, layout_.positions()) *
          to_q(y_.head(layout_.positions()), MatrixXd::Identity(freedoms_, freedoms_));
    r.phi_rho = g.rho.topRows(d_.m);
    r.scale = r.J.rowwise().norm().cwiseMax(std::numeric_limits<double>::min()).cwiseInverse();
    r.J_scaled = OrthogonalDecomposition(r.scale.asDiagonal() * r.J, kRestRankThreshold);
    r.N = null_space(r.scale.asDiagonal() * r.J, kRestRankThreshold);
    return r;
  }

  MatrixXd mass_times(const MatrixXd& x) const {
    MatrixXd out(x.rows(), x.cols());
    for (int i = 1; i <= d_.n; ++i) {
      const BodyData& b = d_.bodies[at(i)];
      const Index r = layout_.z(i), theta = r + 3;
      out.middleRows(r, 3) = b.mass * x.middleRows(r, 3);
      out.middleRows(theta, 3) = b.J * x.middleRows(theta, 3);
    }
    return out;
  }

  // Moves q back onto the constraints.
  bool settle(VectorXd& q) {
    const VectorXd y_hat = at_rest_in(q);
    VectorXd y(layout_.size());
    ProjectionSolution solution = projector_->solution();
    if (!projector_->project(t_, angles_, y_hat, y, solution)) return false;
    q = y.head(layout_.positions());
    for (std::size_t k = 0; k < d_.angles.size(); ++k) {
      const JointAngle& a = d_.angles[k];
      double& angle = angles_(static_cast<Index>(k));
      angle = a.value_near(angle, body_at(y, a.body1).frame, body_at(y, a.body2).frame);
    }
    return true;
  }

  const VectorXd& z() const { return z_; }

  const VectorXd& angles() const { return angles_; }
  void set_angles(const VectorXd& angles) { angles_ = angles; }

  // The largest part of xi, in lengths of the mechanism and rad.
  double size_of(const VectorXd& xi) const {
    double size = 0;
    for (int i = 1; i <= d_.n; ++i) {
      const Index r = layout_.z(i), theta = r + 3;
      size = std::max(
          {size, xi.segment<3>(r).lpNorm<Eigen::Infinity>() / length_, xi.segment<3>(theta).lpNorm<Eigen::Infinity>()});
    }
    return xi.allFinite() ? size : INFINITY;
  }

  std::string what_is_left() const {
    Index i = 0;
    const double most = z_.cwiseAbs().maxCoeff(&i);
    return fmt::format(
        "at the end of the search body '{}' still has an acceleration of {:.3g} {}; does a spring or stop hold every "
        "free motion?",
        d_.body_names[static_cast<std::size_t>(i / 6 + 1)], most, i % 6 < 3 ? "m/s^2" : "rad/s^2");
  }

 private:
  // y = (q, 0)
  VectorXd at_rest_in(const VectorXd& q) const {
    VectorXd y = VectorXd::Zero(layout_.size());
    y.head(layout_.positions()) = q;
    return y;
  }

  // The longest arm of a joint, span of a spring or distance of a body from the first; 1 m if there is none.
  double length_at(const VectorXd& y) const {
    double length = 0;
    for (const Constraint& c : d_.constraints) {
      const auto* p = std::get_if<Coincidence>(&c.primitive);
      if (p && c.body1 > 0) length = std::max(length, p->s1.norm());
      if (p && c.body2 > 0) length = std::max(length, p->s2.norm());
    }
    for (const TsdaForce& f : d_.forces->of<TsdaForce>()) {
      length = std::max(length, f.span(body_at(y, f.body1).frame, body_at(y, f.body2).frame).l);
    }
    for (int i = 2; i <= d_.n; ++i) length = std::max(length, (y.segment<3>(layout_.q(i)) - y.head<3>()).norm());
    return length > 0 ? length : 1;
  }

  const MechanismData& d_;
  double t_;
  const StateLayout layout_;
  const Index freedoms_ = 6 * layout_.n;  // of the bodies without joints
  double length_ = 1;
  SpatialDynamics dynamics_;
  std::unique_ptr<Projector> projector_;
  AssemblyEquations equations_;
  VectorXd angles_, y_, ydot_, z_;
};

// N'M (sigma I - Z) N y = N'M z at one position: `stiffness` is -N'M Z N.
struct FreeMotion {
  MatrixXd N, stiffness, mass;
  VectorXd force;
  explicit FreeMotion(Statics& statics) : N(statics.rows().N) {
    if (N.cols() == 0) return;
    const MatrixXd NM = statics.mass_times(N).transpose();
    stiffness = -NM * (statics.z_of_positions() * N);
    mass = NM * N;
    force = NM * statics.z();
  }
  VectorXd step(double sigma) const { return OrthogonalDecomposition(stiffness + sigma * mass).solve(force); }
  bool goes_downhill(double sigma) const {
    const MatrixXd S = stiffness + sigma * mass;
    return symmetric_eigen(S + S.transpose()).values(0) > 0;
  }
};

bool at_rest(double size, double sigma, double acceleration) {
  return size < kTolerance && sigma < 1e-3 * (1 + acceleration);
}

constexpr const char* kNoAccelerations = "the accelerations cannot be computed on the way";

// Pseudo-transient continuation: sigma falls with the remaining acceleration. It takes a few iterations if the
// acceleration falls steadily. Returns an empty string if q is the equilibrium, else the reason.
std::string continue_to_rest(Statics& statics, VectorXd& q, int& iterations) {
  double sigma = 0, before = 0;
  for (int k = 0; k < kMostEquilibriumIterations; ++k, ++iterations) {
    if (!statics.evaluate(q)) return kNoAccelerations;
    const double now = statics.size_of(statics.z());
    sigma = k == 0 ? now / kLargestStep : sigma * std::min(now / before, 4.0);
    if (sigma < 1e-9 * (1 + now)) sigma = 0;
    before = now;
    const FreeMotion free(statics);
    if (free.N.cols() == 0 || now == 0) return {};
    const VectorXd xi = free.N * free.step(sigma);
    const double size = statics.size_of(xi);
    if (!std::isfinite(size)) return "a step towards it is not finite";
    q += statics.to_q(q, (size > kLargestStep ? kLargestStep / size : 1.0) * xi);
    if (!statics.settle(q)) return "the joints cannot be kept closed on the way to it";
    if (at_rest(size, sigma, now)) return {};
  }
  return statics.what_is_left();
}

// Does the same if the acceleration rises and falls on the way. Each step is one of the overdamped motion. It goes
// downhill, and is so short that the linear equations predict the forces at its end.
std::string go_downhill(Statics& statics, VectorXd& q, int& iterations) {
  if (!statics.evaluate(q)) return kNoAccelerations;
  double sigma = statics.size_of(statics.z()) / kLargestStep;
  for (int tries = 0; tries < 2 * kMostEquilibriumIterations;) {
    const FreeMotion free(statics);
    const double now = statics.size_of(statics.z());
    if (free.N.cols() == 0 || now == 0) return {};
    const VectorXd angles = statics.angles();
    for (bool taken = false; !taken && tries < 2 * kMostEquilibriumIterations; ++tries, ++iterations) {
      const VectorXd y = free.step(sigma), xi = free.N * y;
      const double size = statics.size_of(xi);
      double difference = INFINITY;
      VectorXd trial = q + statics.to_q(q, xi);
      if (size < kLargestStep && free.goes_downhill(sigma) && statics.settle(trial) && statics.evaluate(trial)) {
        const VectorXd force = statics.mass_times(free.N).transpose() * statics.z();
        difference = size < kTolerance ? 0 : (force - sigma * (free.mass * y)).norm() / free.force.norm();
      }
      taken = difference < kPredicted;
      if (taken) {
        q = trial;
        if (at_rest(size, sigma, now)) return {};
        if (difference < kWellPredicted) sigma /= 10;
      } else {
        statics.set_angles(angles);
        sigma = std::max(4 * sigma, 1e-9 * (1 + now));
      }
    }
  }
  if (!statics.evaluate(q)) return kNoAccelerations;
  return statics.what_is_left();
}

}  // namespace

Equilibrium static_equilibrium(const Mechanism& mechanism, double t, const VectorXd& q_guess, const VectorXd& angles) {
  Equilibrium e;
  e.q = q_guess;
  Statics statics(mechanism, t, q_guess, angles);
  auto fail = [&](std::string message) {
    e.message = "static equilibrium not found: " + std::move(message);
    return e;
  };
  std::string why = continue_to_rest(statics, e.q, e.iterations);
  if (!why.empty()) {
    e.q = q_guess;
    statics.set_angles(angles);
    why = go_downhill(statics, e.q, e.iterations);
  }
  if (!why.empty()) return fail(why);
  if (!statics.evaluate(e.q)) return fail("the accelerations cannot be computed there");
  const Statics::Rows rows = statics.rows();
  const MatrixXd particular = rows.particular(-rows.phi_rho);
  MatrixXd xi_rho = particular;
  if (rows.N.cols() > 0) {
    const MatrixXd Z = statics.z_of_positions(), NM = rows.N.transpose();
    const MatrixXd reduced = NM * statics.mass_times(-(Z * rows.N));
    const MatrixXd right = NM * statics.mass_times(statics.z_of_parameters() + Z * particular);
    xi_rho += rows.N * OrthogonalDecomposition(reduced).solve(right);
  }
  e.q_rho = statics.to_q(e.q, xi_rho);
  e.ok = true;
  return e;
}

}  // namespace mbsopt
