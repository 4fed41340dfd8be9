#include "core/start/equilibrium.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/dynamics/acceleration_tangents.hpp"
#include "core/expression/time_parts.hpp"
#include "core/force/forces.hpp"
#include "core/linear/dense.hpp"
#include "core/mechanism/followed_angles.hpp"
#include "core/projection/projection.hpp"
#include "core/start/assembly_equations.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostIterations = 5000;        // chains that slide along stiff stops take some hundreds
constexpr double kLargestStep = 0.2;         // of a coordinate at once [lengths of the mechanism, rad]
constexpr double kProbes = 0.05;             // the places along a step at which forces are computed [the same]
constexpr double kNearPlaces = 1e-3;         // of a step: places as near to each other are one
constexpr double kBeside = 1e-5;             // from the equilibrium, to see where the forces drive it [the same]
constexpr double kTolerance = 1e-11;         // of the last Newton step [lengths of the mechanism, rad]
constexpr double kRoundingOfForces = 1e-14;  // of the terms of a force: a few additions
constexpr double kLargestError = 0.5;        // of a step, relative to it: the linear equations predict the rest
constexpr double kAimedError = 0.25;         // the next step has about this one
constexpr double kFastest = 0.02;            // of sigma: its largest change from a step to the next

class Statics {
 public:
  Statics(const Mechanism& mechanism, double t, const VectorXd& q_guess, const VectorXd& angles)
      : mechanism_(mechanism),
        d_(mechanism.data()),
        t_(t),
        layout_{d_.n},
        dynamics_(mechanism, FormulationSettings{}),
        projector_(make_projector(mechanism, Projection::position_velocity)),
        angles_(angles),
        ydot_(layout_.size()) {
    dynamics_.terms().hold_laws();
    length_ = length_at(at_rest_in(q_guess));
  }

  bool evaluate(const VectorXd& q) {
    y_ = at_rest_in(q);
    if (!dynamics_.evaluate(t_, y_, angles_, ydot_)) return false;
    dynamics_.linearise_here();
    z_ = flat(dynamics_.z());
    return z_.allFinite();
  }

  // Tangents of z: along the columns of xi, and in the parameters.
  MatrixXd z_along(const MatrixXd& xi) {
    MatrixXd directions = MatrixXd::Zero(layout_.size(), xi.cols());
    directions.topRows(layout_.positions()) = rates_of_poses(y_.head(layout_.positions()), xi);
    return acceleration_tangents(dynamics_, directions, Accelerations::z);
  }
  MatrixXd z_of_parameters() { return acceleration_of_parameters(dynamics_, Accelerations::z); }

  // A basis of the motions xi that joints and drives leave free: J xi = 0.
  MatrixXd free_motions() const { return null_space(unit_rows(d_, frames_at(y_)).J, UnitRows::kRankThreshold); }
  // xi_p': the motion with the parameters that the joints ask for. J xi_p' = -Phi_rho
  MatrixXd motion_of_parameters() const {
    AssemblyEquations equations(d_, AssemblyLevel::position, t_);
    equations.start_branches(y_);
    return JointSolver(d_, frames_at(y_)).solve(-equations.gradients(y_).rho.topRows(d_.m));
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
    continue_angles(d_, y, angles_);
    return true;
  }

  const VectorXd& z() const { return z_; }
  VectorXd loads() const { return flat(dynamics_.loads()); }

  const VectorXd& angles() const { return angles_; }
  void set_angles(const VectorXd& angles) { angles_ = angles; }

  // The parts, 0 to 1, of the way from q to q + change between which laws of forces have no pulse, step or kink, as far
  // as what they read changes evenly.
  std::vector<double> places_of_laws(const VectorXd& q, const VectorXd& change) {
    const VectorXd ends[2] = {at_rest_in(q), at_rest_in(q + change)};
    std::vector<double> places, inputs[2];
    const auto add = [&](const Program& law, auto&& append_motion) {
      for (const int end : {0, 1}) {
        inputs[end].assign(d_.rho.begin(), d_.rho.end());
        append_motion(ends[end], inputs[end]);
      }
      if (inputs[0] == inputs[1]) return;
      const std::vector<double> pieces = pieces_between(law, inputs[0], inputs[1]);
      places.insert(places.end(), pieces.begin(), pieces.end());
    };
    d_.forces->for_each([&]<class Kind>(const Kind& f, ForcePlace) {
      if constexpr (HasLaw<Kind>) {
        if (f.law.program)
          add(*f.law.program, [&](const VectorXd& y, std::vector<double>& of_law) {
            const auto [i, j] = f.bodies();
            const auto [x, xdot] = f.measured(angles_, body_at(y, i), body_at(y, j));
            of_law.insert(of_law.end(), {x, 0.0, t_});
          });
      }
    });
    for (const AppliedForce& f : d_.applied)
      for (const Program& component : f.components)
        add(component, [&](const VectorXd& y, std::vector<double>& of_law) {
          const int first = static_cast<int>(of_law.size()) + 1;  // sensor
          of_law.resize(of_law.size() + 1 + at(mechanism_.sensors()), t_);
          for (const int input : component.used_inputs())
            if (input >= first) of_law[at(input)] = mechanism_.sensor_value(input - first, {t_, y, angles_, nullptr});
        });
    return places;
  }

  // Does evaluate() at q moved by xi.
  bool evaluate_beside(const VectorXd& q, const VectorXd& xi) {
    const VectorXd angles = angles_;
    VectorXd beside = q + rates_of_poses(q, xi);
    const bool moved = settle(beside) && evaluate(beside);
    angles_ = angles;
    return moved;
  }

  // The largest part of xi, in lengths of the mechanism and rad, and its body, counted from 1.
  double size_of(const VectorXd& xi, int* body = nullptr) const {
    VectorXd sizes = xi.cwiseAbs();
    for (int i = 1; i <= d_.n; ++i) sizes.segment<3>(layout_.z(i)) /= length_;
    Index most = 0;
    const double size = sizes.maxCoeff(&most);
    if (body) *body = static_cast<int>(most / 6) + 1;
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
      length = std::max(length, f.span(body_at(y, f.body1), body_at(y, f.body2)).l);
    }
    for (int i = 2; i <= d_.n; ++i) length = std::max(length, (y.segment<3>(layout_.q(i)) - y.head<3>()).norm());
    return length > 0 ? length : 1;
  }

  const Mechanism& mechanism_;
  const MechanismData& d_;
  double t_;
  const StateLayout layout_;
  double length_ = 1;
  SpatialDynamics dynamics_;
  std::unique_ptr<Projector> projector_;
  VectorXd angles_, y_, ydot_, z_;
};

// N'M (sigma I - Z) N y = N'M z at one position. N is orthonormal in M, so that sigma y is a force.
struct FreeMotion {
  MatrixXd N, NM, stiffness;    // stiffness: -N'M Z N
  VectorXd force, force_terms;  // N'M z; |N|'|f|, whose rounding it carries
  bool regular = true;          // N'M N is
  double growth = 0;            // of the overdamped motion y' = -stiffness y; 0 if it decays

  explicit FreeMotion(Statics& statics) : N(statics.free_motions()) {
    if (N.cols() == 0) return;
    const MatrixXd L = cholesky_factor(N.transpose() * statics.mass_times(N));
    regular = L.size() > 0;
    if (!regular) return;
    N = N * inverse(L).transpose();
    NM = statics.mass_times(N).transpose();
    stiffness = -NM * statics.z_along(N);
    force = NM * statics.z();
    force_terms = N.cwiseAbs().transpose() * statics.loads().cwiseAbs();
    if (cholesky_factor(stiffness + stiffness.transpose()).size() == 0)
      growth = std::max(0.0, -general_eigen(stiffness).values.real().minCoeff());
  }
  OrthogonalDecomposition damped(double sigma) const {
    return OrthogonalDecomposition(stiffness + sigma * MatrixXd::Identity(N.cols(), N.cols()));
  }
  // Returns whether F is rounding of the loads, and of stiff springs over a displacement of norm y.
  bool is_rounding(const VectorXd& F, double y) const {
    return (F.array().abs() <= kRoundingOfForces * (force_terms.array() + y * stiffness.norm())).all();
  }
};

// Returns the error of the step y from q: along it, the forces differ from the linear ones, force - c stiffness y at
// the part c. The error is the step of these differences, relative to y. It is infinite if the mechanism cannot be
// moved so. q becomes the end of the step.
double error_along(Statics& statics, const FreeMotion& free, const OrthogonalDecomposition& damped, const VectorXd& y,
                   VectorXd& q) {
  const VectorXd from = q, change = free.stiffness * y;
  const MatrixXd direction = rates_of_poses(from, free.N * y);
  const double size = statics.size_of(free.N * y);
  const int parts = 1 + static_cast<int>(size / kProbes);
  std::vector<double> places = statics.places_of_laws(from, direction);
  for (int k = 1; k <= parts; ++k) places.push_back(static_cast<double>(k) / parts);
  std::ranges::sort(places);
  double error = 0, last = 0;
  for (const double c : places) {
    if (error >= kLargestError) break;
    if (c < last + kNearPlaces && !(c == 1 && last < 1)) continue;
    last = c;
    q = from + c * direction;
    if (!statics.settle(q) || !statics.evaluate(q)) return INFINITY;
    const VectorXd difference = free.NM * statics.z() - free.force + c * change;
    error = std::max(error, statics.size_of(free.N * damped.solve(difference)) / size);
  }
  return error;
}

// Follows the overdamped motion y' = N'M z by implicit Euler steps of the length 1/sigma, which grow to Newton steps.
// Returns an empty string if q is an equilibrium, else the reason.
std::string go_downhill(Statics& statics, VectorXd& q, int& iterations) {
  constexpr const char* kNoAccelerations = "the accelerations cannot be computed on the way";
  if (!statics.evaluate(q)) return kNoAccelerations;
  double sigma = statics.size_of(statics.z()) / kLargestStep;
  while (iterations < kMostIterations) {
    const FreeMotion free(statics);
    if (!free.regular) return "a free motion moves no mass";
    if (free.N.cols() == 0 || free.is_rounding(free.force, 0)) return {};
    // The Newton step leaves neutral motions alone. The forces along these have to vanish by themselves.
    const VectorXd newton = free.damped(0).solve(free.force), xi = free.N * newton;
    const double one_length = 1 / statics.size_of(free.N.rowwise().norm());
    if (statics.size_of(xi) < kTolerance && free.is_rounding(free.force - free.stiffness * newton, one_length)) {
      q += rates_of_poses(q, xi);
      return statics.settle(q) ? "" : "the joints cannot be kept closed there";
    }
    // A step is shorter than half the time in which the overdamped motion leaves an unstable equilibrium.
    sigma = std::max({sigma, 2 * free.growth, 1e-15 * free.stiffness.norm()});
    const VectorXd start = q, angles = statics.angles();
    double error = INFINITY;
    while (iterations < kMostIterations) {
      ++iterations;
      const OrthogonalDecomposition damped = free.damped(sigma);
      const VectorXd y = damped.solve(free.force);
      const double size = statics.size_of(free.N * y);
      if (size < kLargestStep) error = error_along(statics, free, damped, y, q);
      if (error < kLargestError) break;
      if (size < kTolerance) return fmt::format("the forces jump on the way; {}", statics.what_is_left());
      q = start;
      statics.set_angles(angles);
      sigma *= std::isfinite(error) ? std::clamp(error / kAimedError, 4., 64.) : 4;
    }
    sigma *= std::max(kFastest, error / kAimedError);
  }
  return statics.evaluate(q) ? statics.what_is_left() : kNoAccelerations;
}

// The body that moves most along a free motion on which the forces drive it away from the equilibrium q; else 0.
int leaving_body(Statics& statics, const FreeMotion& free, const VectorXd& q) {
  if (free.growth == 0) return 0;
  const GeneralEigen eigen = general_eigen(free.stiffness);
  Index k = 0;
  eigen.values.real().minCoeff(&k);
  // The real part v of the eigenvector, at the phase at which it is orthogonal to the imaginary one: there
  // v'stiffness v = Re(lambda) v'v.
  const Eigen::VectorXcd w = eigen.vectors.col(k);
  VectorXd v = (w * std::polar(1.0, -0.5 * std::arg(w.cwiseProduct(w).sum()))).real();
  v *= kBeside / statics.size_of(free.N * v);
  const VectorXd xi = free.N * v;
  const double rounding =
      kRoundingOfForces * (v.cwiseAbs().dot(free.force_terms) + free.stiffness.norm() * v.squaredNorm() / kBeside);
  for (const double side : {1.0, -1.0}) {
    if (!statics.evaluate_beside(q, side * xi) || !(side * v.dot(free.NM * statics.z()) > rounding)) continue;
    int body = 0;
    statics.size_of(xi, &body);
    return body;
  }
  return 0;
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
  if (const std::string why = go_downhill(statics, e.q, e.iterations); !why.empty()) return fail(why);
  if (!statics.evaluate(e.q)) return fail("the accelerations cannot be computed there");
  const FreeMotion free(statics);
  MatrixXd xi_rho = statics.motion_of_parameters();
  if (free.N.cols() > 0) {
    const MatrixXd right = free.NM * (statics.z_of_parameters() + statics.z_along(xi_rho));
    xi_rho += free.N * free.damped(0).solve(right);
  }
  e.q_rho = rates_of_poses(e.q, xi_rho);
  e.angles = statics.angles();
  e.ok = true;
  return e;
}

std::string equilibrium_warning(const Mechanism& mechanism, double t, const VectorXd& q, const VectorXd& angles) {
  Statics statics(mechanism, t, q, angles);
  if (!statics.evaluate(q)) return {};
  const FreeMotion free(statics);
  if (free.N.cols() == 0 || !free.regular) return {};
  const int body = leaving_body(statics, free, q);
  if (body == 0) return {};
  return fmt::format(
      "the static equilibrium is unstable: the forces drive body '{}' away as soon as it moves a little. The guess "
      "lies "
      "on the ridge between two valleys; move it into the valley that is meant",
      mechanism.data().body_names[at(body)]);
}

}  // namespace mbsopt
