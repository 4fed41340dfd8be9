// A motion is a null vector of J, six numbers (rdot, omega in body axes) per body. Rows of J are scaled to unit length.
// Rows couple bodies to groups; groups move independently of each other.
//
//   alone       null vectors L_b of the columns of body b: it moves while all others stand still
//   together    the null vectors N of the group without their parts in the L_b:  R = N - L L'N,  L = diag(L_b)
//
// A null vector may hold for an instant only, for example while a crank and its coupler are in line. So the analysis is
// repeated at a near position, to which a general motion leads. The motions reported are those of that position. If its
// number of degrees of freedom differs, nothing is reported.
//
// The L_b are independent of each other, so that R has the rank  columns of N - columns of L.
#include "core/start/free_motion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/expression/counted.hpp"
#include "core/linear/dense.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/projection/projection.hpp"
#include "core/start/nearest_point_linearisation.hpp"
#include "core/start/poses.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostBodies = 40;  // dense decompositions of 6n columns stay within milliseconds
constexpr double kStep = 1e-3;   // to the position near by [rad]: far above kZero, and within reach of Newton's steps
constexpr double kZero = 1e-6;   // of a motion's size: above the rounding of a null vector
constexpr std::size_t kMostNames = 8;  // in one sentence

struct JointPoint {
  std::string joint;
  Vector3d place;  // global [m]
};

class MotionNames {
 public:
  MotionNames(const MechanismData& data, const VectorXd& y)
      : d_(data), layout_{data.n}, frames_(frames_at(y)), points_(frames_.size()), J_(unit_rows(data, frames_).J) {
    for (const Constraint& c : d_.constraints) add_points(c);
  }

  struct Sentences {
    std::vector<std::string> alone, together;
    std::vector<Index> freedoms;  // of each body alone, and of each group
    Index all = 0;
  };
  Sentences sentences() {
    for (const std::vector<int>& group : groups()) add_group(group);
    return sentences_;
  }

  // d(q)/d(s) along a general motion of all groups: at most one radian, or one metre if nothing turns.
  VectorXd general_motion(const VectorXd& y) const {
    VectorXd xi = VectorXd::Zero(6 * layout_.n);
    double fastest = 0, turning = 0;
    for (const std::vector<int>& group : groups()) {
      const MatrixXd N = free_in(columns_of(group));
      const VectorXd weights = VectorXd::LinSpaced(N.cols(), 1, 2), motion = N * weights;
      for (std::size_t k = 0; k < group.size(); ++k) {
        const Vec<6> of_body = motion.segment<6>(6 * static_cast<Index>(k));
        xi.segment<6>(layout_.z(group[k])) = of_body;
        fastest = std::max(fastest, of_body.head<3>().norm());
        turning = std::max(turning, of_body.tail<3>().norm());
      }
    }
    const double size = turning > kZero * fastest ? turning : fastest;
    return rates_of_poses(y.head(layout_.positions()), size > 0 ? VectorXd(xi / size) : xi);
  }

 private:
  // Collects the points where joints touch their bodies.
  void add_points(const Constraint& c) {
    if (c.joint < 0) return;
    std::visit(
        [&]<class P>(const P& p) {
          if constexpr (std::is_same_v<P, Coincidence> || std::is_same_v<P, Distance>) {
            const std::string& name = d_.joint_names[at(c.joint)];
            if (c.body1 > 0) points_[at(c.body1)].push_back({name, frames_[at(c.body1)].point(p.s1)});
            if (c.body2 > 0) points_[at(c.body2)].push_back({name, frames_[at(c.body2)].point(p.s2)});
          }
        },
        c.primitive);
  }

  // The bodies that rows join, directly or by others.
  std::vector<std::vector<int>> groups() const {
    MatrixXd touches = MatrixXd::Zero(d_.m, d_.n);
    for (const Constraint& c : d_.constraints)
      for (const int body : {c.body1, c.body2})
        if (body > 0) touches(c.row, body - 1) = 1;
    std::vector<std::vector<int>> groups;
    for (const JoinedPart& part : joined_parts(touches)) {
      groups.emplace_back();
      for (const Index k : part.unknowns) groups.back().push_back(static_cast<int>(k) + 1);
    }
    return groups;
  }

  MatrixXd columns_of(const std::vector<int>& bodies) const {
    MatrixXd columns(J_.rows(), 6 * static_cast<Index>(bodies.size()));
    for (std::size_t k = 0; k < bodies.size(); ++k)
      columns.middleCols<6>(6 * static_cast<Index>(k)) = J_.middleCols<6>(layout_.z(bodies[k]));
    return columns;
  }
  static MatrixXd free_in(const MatrixXd& J) {
    if (J.size() == 0 || J.isZero(0)) return MatrixXd::Identity(J.cols(), J.cols());
    return null_space(J, UnitRows::kRankThreshold);
  }

  void add_group(const std::vector<int>& group) {
    MatrixXd R = free_in(columns_of(group));
    const Index all = R.cols();
    Index alone = 0;
    for (std::size_t k = 0; k < group.size(); ++k) {
      const MatrixXd L = free_in(columns_of({group[k]}));
      alone += L.cols();
      if (L.cols() > 0) add_alone(group[k], L);
      sentences_.freedoms.push_back(L.cols());
      auto part = R.middleRows<6>(6 * static_cast<Index>(k));
      part -= (L * (L.transpose() * part)).eval();
    }
    sentences_.freedoms.push_back(all);
    sentences_.all += all;
    if (alone < all) add_together(group, R, all - alone);
  }

  void add_together(const std::vector<int>& group, const MatrixXd& R, Index freedoms) {
    std::vector<std::string> moving;
    for (std::size_t k = 0; k < group.size(); ++k)
      if (R.middleRows<6>(6 * static_cast<Index>(k)).norm() > kZero * R.norm()) moving.push_back(name(group[k]));
    if (moving.empty()) return;
    const std::string who = moving.size() > kMostNames ? fmt::format("{} bodies", moving.size())
                                                       : fmt::format("{}", fmt::join(moving, ", "));
    const char* const verb = moving.size() == 1 ? "moves" : "move together";
    sentences_.together.push_back(freedoms == 1 ? fmt::format("{} {}", who, verb)
                                                : fmt::format("{} {} with {} degrees of freedom", who, verb, freedoms));
  }

  void add_alone(int body, const MatrixXd& L) {
    if (L.cols() == 6) return sentences_.alone.push_back(name(body) + " moves freely");
    if (L.cols() == 1) return sentences_.alone.push_back(name(body) + " " + one_motion(body, L));
    for (const JointPoint& point : points_[at(body)]) {
      const Vector3d s = frames_[at(body)].A.transpose() * (point.place - frames_[at(body)].r);
      double fastest = 0;
      for (Index k = 0; k < L.cols(); ++k) {
        const Vector3d omega = L.col(k).tail<3>();
        fastest = std::max(fastest, (L.col(k).head<3>() + frames_[at(body)].A * omega.cross(s)).norm());
      }
      if (L.cols() == 3 && fastest < kZero * (1 + s.norm()))
        return sentences_.alone.push_back(fmt::format("{} turns freely about joint '{}'", name(body), point.joint));
    }
    sentences_.alone.push_back(fmt::format("{} moves alone with {} degrees of freedom", name(body), L.cols()));
  }

  // v belongs to the centre of mass. The axis goes along w through c = r + w x v/w'w, where the body's velocity is
  // (w'v/w'w) w. It is zero if the body turns without sliding.
  std::string one_motion(int body, const VectorXd& motion) const {
    const Frame& f = frames_[at(body)];
    const Vector3d v = motion.head<3>(), w = f.A * motion.tail<3>();
    double size = 0;
    for (const JointPoint& point : points_[at(body)]) size = std::max(size, (point.place - f.r).norm());
    if (size == 0) size = 1;
    if (w.norm() * size < kZero * v.norm()) return "slides along " + direction(v);
    if (std::abs(w.dot(v)) > kZero * w.squaredNorm() * size) return "turns about and slides along " + direction(w);
    const Vector3d c = f.r + w.cross(v) / w.squaredNorm(), u = w.normalized();
    std::vector<const JointPoint*> on_axis;
    for (const JointPoint& point : points_[at(body)]) {
      const auto same = [&](const JointPoint* other) { return (other->place - point.place).norm() < kZero * size; };
      if ((point.place - c).cross(u).norm() < kZero * size && std::none_of(on_axis.begin(), on_axis.end(), same))
        on_axis.push_back(&point);
    }
    if (on_axis.size() >= 2)
      return fmt::format("turns about the axis through joints '{}' and '{}'", on_axis[0]->joint, on_axis[1]->joint);
    if (on_axis.size() == 1)
      return fmt::format("turns about the axis through joint '{}' along {}", on_axis[0]->joint, direction(w));
    return "turns about an axis along " + direction(w);
  }

  // The sign makes the largest component positive. Components of rounding size are zero.
  static std::string direction(const Vector3d& x) {
    Index largest = 0;
    x.cwiseAbs().maxCoeff(&largest);
    Vector3d u = x.normalized() * (x(largest) < 0 ? -1 : 1);
    for (double& component : u)
      if (std::abs(component) < kZero) component = 0;
    return fmt::format("[{:.3g}, {:.3g}, {:.3g}]", u(0), u(1), u(2));
  }

  std::string name(int body) const { return "'" + d_.body_names[at(body)] + "'"; }

  const MechanismData& d_;
  const StateLayout layout_;
  std::vector<Frame> frames_;                    // [0] is the ground
  std::vector<std::vector<JointPoint>> points_;  // by body
  MatrixXd J_;
  Sentences sentences_;
};

}  // namespace

std::vector<std::string> free_motions(const Mechanism& mechanism, const Assembly& assembly, double start_time,
                                      int degrees_of_freedom) {
  const MechanismData& data = mechanism.data();
  if (degrees_of_freedom == 0 || data.n > kMostBodies || !assembly.result().ok) return {};
  const VectorXd& y = assembly.result().y;
  MotionNames here(data, y);
  VectorXd moved = y, closed = y;
  moved.head(StateLayout{data.n}.positions()) += kStep * here.general_motion(y);
  const std::unique_ptr<Projector> projector = make_projector(mechanism, Projection::position_velocity);
  ProjectionSolution solution = projector->solution();
  if (!projector->project(start_time, assembly.result().angles, moved, closed, solution)) return {};
  const MotionNames::Sentences at_start = here.sentences(), near_by = MotionNames(data, closed).sentences();
  if (at_start.all != degrees_of_freedom || near_by.all != degrees_of_freedom) return {};
  // A user knows the axes at the start, so these are named.
  std::vector<std::string> all = at_start.freedoms == near_by.freedoms ? at_start.alone : near_by.alone;
  all.insert(all.end(), near_by.together.begin(), near_by.together.end());
  return all;
}

std::string freedoms_in_words(const Mechanism& mechanism, const Assembly& assembly, double start_time) {
  const int freedoms = assembly.summary().degrees_of_freedom;
  const std::vector<std::string> motions = free_motions(mechanism, assembly, start_time, freedoms);
  return fmt::format("{}{}{}", counted(freedoms, "degree of freedom", "degrees of freedom"),
                     motions.empty() ? "" : ": ", fmt::join(motions, "; "));
}

}  // namespace mbsopt
