#include "core/dynamics/kinematics.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/body/euler_parameters.hpp"
#include "core/dynamics/assembly.hpp"
#include "core/dynamics/motion_solver.hpp"
#include "core/dynamics/projection.hpp"
#include "core/sensor/body_at.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLargestTurn = 0.1;         // of an Euler parameter in one step
constexpr double kRelativeCorrection = 0.2;  // of the predictor, against the step
constexpr double kSmallCorrection = 1e-6;    // always accepted
constexpr double kViolation = 1e-9;
constexpr double kRankThreshold = 1e-7;  // rows of J scaled to unit length

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

class Kinematics {
 public:
  Kinematics(const Mechanism& mechanism, const FormulationSettings& formulation)
      : d_(mechanism.data()),
        motion_(mechanism, formulation),
        projector_(mechanism, Projection::position_velocity),
        rows_(d_),
        solution_(projector_.solution()),
        y_hat_(mechanism.states()),
        y_next_(mechanism.states()) {}

  void start(double t, const VectorXd& y, const VectorXd& angles) { t_ = t, y_ = y, angles_ = angles; }
  StatePoint point() { return {t_, y_, angles_, &motion_}; }
  const VectorXd& y() const { return y_; }
  double t() const { return t_; }

  // Largest step allowed by the velocities.
  double step_limit() const {
    double fastest = 0;
    for (int i = 0; i < d_.n; ++i) {
      fastest = std::max(fastest, y_.segment<4>(7 * (d_.n + i) + 3).lpNorm<Eigen::Infinity>());
    }
    return fastest > 0 ? kLargestTurn / fastest : INFINITY;
  }

  // One step; false where Newton does not converge or the correction says that the step is too long.
  bool advance(double h, double t1) {
    const Index half = 7 * d_.n;
    const Motion& m = motion_.motion(point());
    const bool accelerated = std::all_of(m.z.begin(), m.z.end(), [](const Vec<6>& z) {
      return z.allFinite() && z.cwiseAbs().maxCoeff() < 1e8;  // not so next to a singular position
    });
    for (int i = 0; i < d_.n; ++i) {
      const Index q = 7 * i;
      Vec<7> a = Vec<7>::Zero();
      if (accelerated) {
        const Vec<6>& z = m.z[static_cast<std::size_t>(i)];
        const Vector4d p = y_.segment<4>(q + 3), pdot = y_.segment<4>(half + q + 3);
        a << z.head<3>(), 0.5 * G_transposed_times(p, z.tail<3>()) - pdot.squaredNorm() * p;
      }
      y_hat_.segment<7>(q) = y_.segment<7>(q) + h * y_.segment<7>(half + q) + 0.5 * h * h * a;
      y_hat_.segment<7>(half + q) = y_.segment<7>(half + q) + h * a;
    }
    if (!projector_.project(t1, angles_, y_hat_, y_next_, solution_)) return false;
    const double step = (y_hat_.head(half) - y_.head(half)).lpNorm<Eigen::Infinity>();
    const double correction = (y_next_.head(half) - y_hat_.head(half)).lpNorm<Eigen::Infinity>();
    if (correction > std::max(kSmallCorrection, kRelativeCorrection * step)) return false;
    if (projector_.position_violation(t1, angles_, y_next_) > kViolation) return false;
    t_ = t1;
    y_ = y_next_;
    for (std::size_t k = 0; k < d_.angles.size(); ++k) {
      const JointAngle& a = d_.angles[k];
      double& angle = angles_(static_cast<Index>(k));
      angle = JointAngle::on_branch(a.jet(body_at(y_, a.body1).frame, body_at(y_, a.body2).frame).angle(), angle);
    }
    return true;
  }

  double position_violation() { return projector_.position_violation(t_, angles_, y_); }
  double velocity_violation() { return projector_.velocity_violation(t_, y_); }

  // Degrees of freedom that J leaves at the present position, and who owns the equations that depend on each other.
  SingularPosition rank_here() {
    std::vector<BodyState> states(static_cast<std::size_t>(d_.n) + 1);
    std::vector<Frame> frames(states.size());
    for (int i = 1; i <= d_.n; ++i) {
      set_position(y_.segment<7>(7 * (i - 1)), states[static_cast<std::size_t>(i)],
                   frames[static_cast<std::size_t>(i)]);
    }
    rows_.evaluate(frames);
    MatrixXd J = MatrixXd::Zero(d_.m, 6 * d_.n);
    for (const RowGroup& g : d_.groups) {
      for (int r = 0; r < g.rows; ++r) {
        if (g.body1 > 0) J.block<1, 6>(g.row + r, 6 * (g.body1 - 1)) += rows_.J1.row(g.block + r);
        if (g.body2 > 0) J.block<1, 6>(g.row + r, 6 * (g.body2 - 1)) += rows_.J2.row(g.block + r);
      }
    }
    for (Index r = 0; r < J.rows(); ++r) J.row(r) /= std::max(J.row(r).norm(), 1e-300);
    SingularPosition s;
    s.t = t_;
    Eigen::ColPivHouseholderQR<MatrixXd> qr;
    qr.setThreshold(kRankThreshold);
    qr.compute(J.transpose());
    s.rank_lost = static_cast<int>(6 * d_.n - qr.rank());
    if (s.rank_lost > 0) name_owners(J, s);
    return s;
  }

 private:
  // Equations with a share in a dependence that the generic position does not have: null vectors of J'.
  void name_owners(const MatrixXd& J, SingularPosition& s) const {
    const Eigen::JacobiSVD<MatrixXd> svd(J, Eigen::ComputeFullU);
    std::set<std::string> seen;
    for (Index k = 0; k < J.rows(); ++k) {
      if (k < svd.singularValues().size() && svd.singularValues()(k) > kRankThreshold) continue;
      for (const Constraint& c : d_.constraints) {
        if (svd.matrixU().col(k).segment(c.row, c.rows()).cwiseAbs().maxCoeff() < 1e-3) continue;
        const std::string owner = c.drive >= 0 ? "drive '" + d_.drive_names[static_cast<std::size_t>(c.drive)] + "'"
                                               : "joint '" + d_.joint_names[static_cast<std::size_t>(c.joint)] + "'";
        if (seen.insert(owner).second) s.owners.push_back(owner);
      }
    }
  }

  const MechanismData& d_;
  MotionSolver motion_;
  Projector projector_;
  ConstraintRows rows_;
  ProjectionSolution solution_;
  double t_ = 0;
  VectorXd y_, angles_, y_hat_, y_next_;
};

std::string joined_names(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

KinematicsResult solve_kinematics(const Mechanism& mechanism, const FormulationSettings& formulation,
                                  const std::vector<double>& times,
                                  const std::function<bool(std::size_t, const StatePoint&)>& observe) {
  KinematicsResult result;
  result.last_good_time = times.front();
  const Assembly assembly(mechanism, times.front());
  if (!assembly.result().ok) {
    result.message = assembly.result().message;
    return result;
  }
  const int freedoms = assembly.summary().degrees_of_freedom;
  Kinematics k(mechanism, formulation);
  k.start(times.front(), assembly.result().y, assembly.result().angles);
  if (freedoms > 0 && k.rank_here().rank_lost > 0) {
    result.message = "the drives leave " + std::to_string(freedoms) + (freedoms == 1 ? " degree" : " degrees") +
                     " of freedom at the start; kinematics needs all of them driven, by drives or by a condition on a "
                     "sensor (initial.conditions) for each. If the start is a singular position, begin beside it";
    return result;
  }
  for (std::size_t i = 0; i < times.size(); ++i) {
    double h = times[i] - k.t();
    while (k.t() < times[i]) {
      const double left = times[i] - k.t();
      h = std::min({h, left, k.step_limit()});
      const bool last = h >= left * (1 - 1e-12);
      if (k.advance(h, last ? times[i] : k.t() + h)) {
        ++result.steps;
        h *= 2;
        continue;
      }
      h /= 2;
      if (h < 1e-9 * std::max(1e-3, times.back() - times.front())) {
        const SingularPosition here = k.rank_here();
        result.message = "the positions cannot be continued beyond t = " + number(k.t()) + " s" +
                         (here.rank_lost > 0 ? ": a singular position, where the equations of " +
                                                   joined_names(here.owners) + " depend on each other"
                                             : "") +
                         ". A dead point that the drives cannot pass, or a position out of reach? Change the law, the "
                         "lengths, or drive another joint there";
        return result;
      }
    }
    result.last_good_time = k.t();
    result.max_position_violation = std::max(result.max_position_violation, k.position_violation());
    result.max_velocity_violation = std::max(result.max_velocity_violation, k.velocity_violation());
    SingularPosition here = k.rank_here();
    if (here.rank_lost > 0) result.singular.push_back(std::move(here));
    if (!observe(i, k.point())) {
      result.message = "stopped at t = " + number(k.t()) + " s";
      return result;
    }
  }
  result.ok = true;
  return result;
}

}  // namespace mbsopt
