#include "core/mechanism/rounded_loops.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "core/body/euler_parameters.hpp"
#include "core/constraint/constraint.hpp"
#include "core/linear/dense.hpp"
#include "core/linear/row_dependence.hpp"
#include "core/mechanism/joint_graph.hpp"
#include "core/mechanism/planar_model.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostBodies = 60;  // dense decompositions of 6n columns stay within a second
// Pivots of J up to this, times the tolerance, may be rounding. Smaller ones follow where that is too much, as for
// short links.
constexpr double kReaches[] = {100, 10, 1};
constexpr double kExact = 1e-12;  // what agrees as well has all digits

// The joints' equations. Lengths are in units of the mechanism's. Rows that tie joints or drive them are left out.
class Loops {
 public:
  // independent: no equation is redundant; open: the joints cannot be closed; exact: redundant ones agree; moved: they
  // do with the correction.
  enum class Outcome { independent, open, exact, moved, none };

  // With a plane, only motion and equations within it are looked at.
  Loops(const MechanismData& data, double threshold, const PlanarModel* plane = nullptr)
      : d_(data),
        threshold_(threshold),
        plane_(plane),
        width_(plane ? 3 : 6),
        lengths_(joint_lengths(data)),
        constant_(VectorXd::Zero(data.m)) {
    std::vector<int> terms(at(d_.m), 0);
    for (const Constraint& c : d_.constraints) ++terms[at(c.row)];
    for (const Constraint& c : d_.constraints) {
      if (c.drive >= 0 || terms[at(c.row)] > 1 || std::holds_alternative<Angle>(c.primitive)) continue;
      given_.push_back(c);
      for (int i = 0; i < c.rows(); ++i)
        rows_ += !plane_ || std::ranges::binary_search(plane_->rows, c.row + i) ? 1 : 0;
    }
    for (const RowLaw& law : d_.laws) constant_(law.row) = law.law.constant;
    set(VectorXd::Zero(12 * static_cast<Index>(d_.joint_names.size())));
    direction_ = VectorXd::Zero(6 * d_.n);
  }

  // Looks for redundant equations where the joints are closed: independent, open or none.
  Outcome look() {
    Position p = guess();
    evaluate(p);
    if (d_.n >= kManyBodies && is_closed(p)) return rank(p, threshold_) == rows_ ? Outcome::independent : Outcome::none;
    const bool is_near = close(p);
    if (stays_open(p)) return Outcome::open;
    return is_near && p.L.cols() == 0 ? Outcome::independent : Outcome::none;
  }

  // Finds the correction x of the numbers that closes the loops, unless they have all digits or stay open.
  Outcome search() {
    constexpr int kBatches = 8, kBatch = 6;
    std::vector<Position> all{guess()};
    if (agrees_at_sight(all[0])) return Outcome::exact;
    const bool is_near = close(all[0]);
    if (stays_open(all[0])) return Outcome::open;
    if (!is_near) return Outcome::none;
    if (all[0].L.cols() == 0) return Outcome::independent;
    if (agrees(all[0])) return Outcome::exact;
    redundant_ = all[0].L.cols();
    for (int batch = 0; batch < kBatches; ++batch) {
      std::vector<Position> fresh;
      Position here = all.back();
      for (int tries = 0; tries < 3 * kBatch && fresh.size() < kBatch; ++tries) {
        if (go_on(here)) {
          fresh.push_back(here);
        } else {
          here = all[0];
          direction_.setZero();
        }
      }
      if (fresh.size() < kBatch) return Outcome::none;
      for (const Position& p : fresh) redundant_ = std::min(redundant_, p.L.cols());
      const bool agree = std::ranges::all_of(fresh, [&](const Position& p) { return !is_regular(p) || agrees(p); });
      if (redundant_ == 0 || (agree && batch == 0)) return Outcome::exact;  // the start is next to a singular position
      all.insert(all.end(), fresh.begin(), fresh.end());  // also if they agree: their last digits count
      if (!fit(all)) return Outcome::none;
      if (agree) return Outcome::moved;
    }
    return Outcome::none;
  }

  RoundedLoops finding() {
    constexpr double kNamed = 0.1;  // of the largest change
    RoundedLoops found;
    std::vector<double> parts(d_.joint_names.size(), 0.0);
    for_each_vector(given_, x_, [&](int joint, double length, const Vec<6>& x, const Vector3d& s) {
      const double change = (length * x.head<3>() + x.tail<3>().cross(s)).norm();
      double& largest = length > 0 ? found.shift : found.turn;
      largest = std::max(largest, change);
      parts[at(joint)] = std::max(parts[at(joint)], length > 0 ? change / lengths_.whole : change);
    });
    found.part = *std::ranges::max_element(parts);
    for (std::size_t j = 0; j < parts.size(); ++j)
      if (parts[j] > kNamed * found.part) found.joints.push_back(static_cast<int>(j));
    return found;
  }

  void write(std::vector<Constraint>& constraints) const {
    auto next = moved_.begin();
    for (Constraint& c : constraints)
      if (next != moved_.end() && c.row == next->row) c.primitive = (next++)->primitive;
  }

 private:
  struct Position {
    VectorXd q, Phi;                 // q: (r, p) per body
    MatrixXd J, Phi_x, L;            // columns of J: shifts in lengths, turns in body axes
    OrthogonalDecomposition factor;  // of J
    double gap = 0;                  // |L'Phi|, |L'J|
  };

  static constexpr int kManyBodies = 12;  // dense decompositions of fewer take less than a step

  Position guess() const {
    Position p;
    p.q.resize(7 * d_.n);
    for (int i = 1; i <= d_.n; ++i) {
      p.q.segment<7>(7 * (i - 1)) = d_.bodies[at(i)].q;
      if (plane_) p.q.segment<4>(7 * (i - 1) + 3) = plane_->bodies[at(i)].p_a;
    }
    return p;
  }

  // Returns whether no correction within the threshold closes the joints: it moves two points and two axes each.
  bool stays_open(const Position& p) const {
    constexpr double kMoves = 10;
    return p.Phi.lpNorm<Eigen::Infinity>() > kMoves * threshold_;
  }
  bool is_regular(const Position& p) const { return p.L.cols() == redundant_; }
  bool agrees(const Position& p) const { return p.gap <= exact(p); }
  double exact(const Position& p) const {  // coordinates far from the origin have coarser digits
    return std::max(kExact, 1e-15 * p.q.lpNorm<Eigen::Infinity>() / lengths_.whole);
  }

  bool is_closed(const Position& p) const { return p.Phi.lpNorm<Eigen::Infinity>() <= exact(p); }

  // Decides for many bodies, without dense decompositions, whether the guess shows no rounding.
  bool agrees_at_sight(Position& guess) const {
    if (d_.n < kManyBodies) return false;
    evaluate(guess);
    const int seen = rank(guess, threshold_);
    return seen == rows_ || (is_closed(guess) && rank(guess, kExact) == seen);
  }
  int rank(const Position& p, double threshold) const {
    std::vector<SparseEntry> J;
    for (int i = 0; i < rows_; ++i)
      for (int k = 0; k < width_ * d_.n; ++k)
        if (p.J(i, k) != 0) J.push_back({i, k, p.J(i, k)});
    return row_dependence(rows_, d_.n, width_, J, threshold).rank;
  }

  // Calls f(joint, length of the body for a point or 0 for a direction, x of its joint's side, vector).
  template <class F>
  void for_each_vector(std::vector<Constraint>& constraints, const VectorXd& x, F&& f) const {
    for (Constraint& c : constraints) {
      const auto call = [&](int side, bool is_point, Vector3d& s) {
        const double length = lengths_.bodies[at(side == 0 ? c.body1 : c.body2)];
        f(c.joint, is_point ? length : 0.0, Vec<6>(x.segment<6>(12 * c.joint + 6 * side)), s);
      };
      std::visit(
          [&]<class P>(P& p) {
            if constexpr (requires { p.s1; }) {
              constexpr bool kPoints = !std::is_same_v<P, Dot1>;
              call(0, kPoints, p.s1);
              call(1, kPoints, p.s2);
              if constexpr (requires { p.s3; }) call(0, false, p.s3);
            }
          },
          c.primitive);
    }
  }

  // x turns a joint's place about the centre of mass of its body, and shifts it.
  void set(const VectorXd& x) {
    x_ = x;
    moved_ = given_;
    for_each_vector(moved_, x_, [](int, double length, const Vec<6>& by, Vector3d& s) {
      Vector4d turn;
      turn << 1, 0.5 * by.tail<3>();
      s = (A(turn.normalized()) * s + length * by.head<3>()).eval();
    });
  }

  // Calls f(row, constraint, value, its gradient in the displacements of both bodies) for the equations.
  template <class F>
  void for_each_equation(const VectorXd& q, F&& f) const {
    std::vector<Frame> frames(at(d_.n) + 1);
    for (int i = 1; i <= d_.n; ++i) set_position(q.segment<7>(7 * (i - 1)), frames[at(i)]);
    Index row = 0;
    for (const Constraint& c : moved_) {
      const double unit = c.quantity() == RowQuantity::length ? 1 / lengths_.whole : 1;
      std::visit(
          [&]<class P>(const P& primitive) {
            constexpr int m = P::kRows;
            Vec<m> phi;
            Mat<m, 6> gradient[2];
            primitive.phi(frames[at(c.body1)], frames[at(c.body2)], phi);
            primitive.jacobian(frames[at(c.body1)], frames[at(c.body2)], gradient[0], gradient[1]);
            for (int i = 0; i < m; ++i) {
              if (plane_ && !std::ranges::binary_search(plane_->rows, c.row + i)) continue;
              f(row++, c, unit * (phi(i) - constant_(c.row + i)),
                std::array<Vec<6>, 2>{unit * gradient[0].row(i), unit * gradient[1].row(i)});
            }
          },
          c.primitive);
    }
  }

  // The gradient in the columns of J: of a body in the plane, shifts along t1 and t2 and the turn about n.
  using OfBody = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, 6>;
  OfBody in_columns(int body, const Vec<6>& gradient) const {
    OfBody out(width_);
    if (plane_)
      out << lengths_.whole * gradient(plane_->t1), lengths_.whole * gradient(plane_->t2),
          gradient.tail<3>().dot(plane_->bodies[at(body)].n);
    else
      out << lengths_.whole * gradient.head<3>().transpose(), gradient.tail<3>().transpose();
    return out;
  }

  // A joint's equation sees x as a displacement of its body alone, so that Phi_x consists of the same blocks as J.
  void evaluate(Position& p, bool with_x = false) const {
    p.Phi.setZero(rows_);
    p.J.setZero(rows_, width_ * d_.n);
    if (with_x) p.Phi_x.setZero(rows_, x_.size());
    for_each_equation(p.q, [&](Index row, const Constraint& c, double phi, const std::array<Vec<6>, 2>& gradient) {
      p.Phi(row) = phi;
      for (const int side : {0, 1}) {
        const int body = side == 0 ? c.body1 : c.body2;
        const Vec<6>& g = gradient[at(side)];
        if (body > 0) p.J.row(row).segment(width_ * (body - 1), width_) = in_columns(body, g);
        if (!with_x) continue;
        const Matrix3d turned = body > 0 ? A(Vector4d(p.q.segment<4>(7 * (body - 1) + 3))) : Matrix3d::Identity();
        p.Phi_x.row(row).segment<6>(12 * c.joint + 6 * side)
            << lengths_.bodies[at(body)] * g.head<3>().transpose() * turned,
            g.tail<3>().transpose();
      }
    });
  }

  VectorXd in_space(const VectorXd& step) const {
    VectorXd out = VectorXd::Zero(6 * d_.n);
    for (int i = 0; i < d_.n; ++i) {
      out(6 * i + plane_->t1) = step(3 * i);
      out(6 * i + plane_->t2) = step(3 * i + 1);
      out.segment<3>(6 * i + 3) = step(3 * i + 2) * plane_->bodies[at(i + 1)].n;
    }
    return out;
  }

  void displace(VectorXd& q, const VectorXd& step) const {
    for (Index i = 0; i < d_.n; ++i) {
      q.segment<3>(7 * i) += lengths_.whole * step.segment<3>(6 * i);
      const Vector4d p = q.segment<4>(7 * i + 3);
      q.segment<4>(7 * i + 3) = (p + 0.5 * G_transposed_times(p, step.segment<3>(6 * i + 3))).normalized();
    }
  }

  // Takes Gauss-Newton steps of least length to the nearest position of least violation.
  bool close(Position& p) const {
    constexpr int kMost = 30;
    constexpr double kLongest = 0.5, kClosed = 1e-9;  // below kClosed steps may end at rounding
    double before = INFINITY;
    for (int k = 0; k < kMost; ++k) {
      evaluate(p);
      p.factor.compute(p.J, threshold_);
      VectorXd step = -p.factor.solve(p.Phi);
      const double longest = step.lpNorm<Eigen::Infinity>();
      if (!std::isfinite(longest)) return false;
      if (longest <= exact(p) || (longest <= kClosed && longest > 0.5 * before)) {
        p.L = p.factor.left_null_space();
        if (p.L.cols() > 0)
          p.gap = std::max((p.L.transpose() * p.Phi).lpNorm<Eigen::Infinity>(),
                           (p.L.transpose() * p.J).lpNorm<Eigen::Infinity>());
        return true;
      }
      before = longest;
      step *= std::min(1.0, kLongest / longest);
      displace(p.q, plane_ ? in_space(step) : step);
    }
    return false;
  }

  // Moves on along the motion, in much the same direction.
  bool go_on(Position& p) {
    constexpr double kStride = 0.2, kDrift = 0.3;  // of a turn or the length; of the direction
    const MatrixXd Z = p.factor.null_space();
    if (Z.cols() == 0) return true;
    const double drift = direction_.isZero(0) ? 1 : kDrift;
    for (double& w : direction_) w += drift * (0x1p-62 * static_cast<double>(random_() >> 1) - 1);
    direction_ = (Z * (Z.transpose() * direction_)).eval();
    direction_ /= direction_.lpNorm<Eigen::Infinity>();
    displace(p.q, kStride * direction_);
    return close(p);
  }

  // Chooses x so that the equations agree at all positions, which follow. Directions of x that act by less than the
  // error of the geometry are not seen in it yet.
  bool fit(std::vector<Position>& all) {
    constexpr int kMost = 10;
    constexpr double kSeen = 1e3, kLeast = 1e-3;  // of the gap; of the threshold, as L has an error of rounding over it
    double before = INFINITY;
    for (int k = 0; k < kMost; ++k) {
      double gap = 0;
      MatrixXd A(redundant_ * static_cast<Index>(all.size()), x_.size());
      VectorXd b(A.rows());
      Index row = 0;
      for (Position& p : all) {
        if (!close(p)) return false;
        if (!is_regular(p)) continue;
        evaluate(p, true);
        gap = std::max(gap, p.gap);
        A.middleRows(row, redundant_) = p.L.transpose() * p.Phi_x;
        b.segment(row, redundant_) = A.middleRows(row, redundant_) * x_ - p.L.transpose() * p.Phi;
        row += redundant_;
      }
      const double seen = std::clamp(kSeen * gap, kLeast * threshold_, threshold_);
      const VectorXd x = OrthogonalDecomposition(A.topRows(row), seen).solve(b.head(row));
      const double change = (x - x_).lpNorm<Eigen::Infinity>();
      set(x);
      if (x.lpNorm<Eigen::Infinity>() > threshold_) return false;
      if (change <= 1e-15 || (gap <= kExact && change > 0.5 * before)) break;
      before = change;
    }
    return true;
  }

  const MechanismData& d_;
  const double threshold_;
  const PlanarModel* plane_;
  const int width_;  // columns of J per body
  const JointLengths lengths_;
  VectorXd constant_;  // of the rows' laws
  std::vector<Constraint> given_, moved_;
  int rows_ = 0;
  std::vector<int> kept_;   // rows within the plane
  Index redundant_ = 0;     // equations at regular positions
  VectorXd x_, direction_;  // x per joint and side: shift in lengths of the body, turn
  std::mt19937_64 random_{1};
};

// Returns whether all bodies can lie at heights over the plane that their joints agree on, to the last digit. A point,
// or a plane along the plane of motion, joins the heights of two bodies.
bool heights_agree(const MechanismData& d, const PlanarModel& plane) {
  std::vector<double> height(d.bodies.size(), NAN), size(d.bodies.size(), 0.0);
  height[0] = 0;
  for (bool goes_on = true; goes_on;) {
    goes_on = false;
    for (const Constraint& c : d.constraints) {
      const auto* point = std::get_if<Coincidence>(&c.primitive);
      const auto* dot2 = std::get_if<Dot2>(&c.primitive);
      if (!point && (!dot2 || std::ranges::binary_search(plane.rows, c.row))) continue;
      const Vector3d &s1 = point ? point->s1 : dot2->s1, &s2 = point ? point->s2 : dot2->s2;
      const std::size_t i = at(c.body1), k = at(c.body2);
      const double rise = plane.bodies[i].n.dot(s1) - plane.bodies[k].n.dot(s2);
      const double scale = std::max({size[i], size[k], s1.norm(), s2.norm()});
      if (std::isnan(height[i]) && std::isnan(height[k])) continue;
      if (std::isnan(height[k])) {
        height[k] = height[i] + rise, size[k] = scale, goes_on = true;
      } else if (std::isnan(height[i])) {
        height[i] = height[k] - rise, size[i] = scale, goes_on = true;
      } else if (!(std::abs(height[i] + rise - height[k]) <= kExact * scale)) {
        return false;
      }
    }
  }
  const auto lifts = [&](const RowLaw& law) { return !std::ranges::binary_search(plane.rows, law.row); };
  return std::ranges::none_of(height, [](double h) { return std::isnan(h); }) && std::ranges::none_of(d.laws, lifts);
}

}  // namespace

JointLengths joint_lengths(const MechanismData& data) {
  constexpr double kOnePoint = 1e-12;  // of the whole: rounding of equal points
  JointLengths lengths;
  std::vector<Eigen::AlignedBox3d> boxes(data.bodies.size());
  double most = 0;
  for (const Constraint& c : data.constraints) {
    c.for_each_point([&](int body, const Vector3d& s) {
      boxes[at(body)].extend(s);
      if (body > 0) most = std::max(most, s.stableNorm());
    });
  }
  for (const Eigen::AlignedBox3d& box : boxes) {
    lengths.bodies.push_back(box.isEmpty() ? 0 : box.sizes().stableNorm());
    most = std::max(most, lengths.bodies.back());
  }
  if (most > 0) lengths.whole = most;
  for (double& length : lengths.bodies)
    if (length <= kOnePoint * lengths.whole) length = lengths.whole;
  return lengths;
}

void close_rounded_loops(MechanismData& data, double tolerance, IndependentLoops& known) {
  if (!(tolerance > 0) || data.n == 0 || data.n > kMostBodies || known.in_space || !closes_loops(data)) return;
  using Outcome = Loops::Outcome;
  // Equations across the plane of a planar mechanism are redundant, and agree wherever the heights do.
  if (const PlanarModel* plane = data.planar.get(); plane && heights_agree(data, *plane)) {
    if (known.in_plane) return;
    const Outcome outcome = Loops(data, kReaches[0] * tolerance, plane).look();
    known.in_plane = outcome == Outcome::independent;
    if (outcome != Outcome::none) return;
  }
  for (const double reach : kReaches) {
    Loops loops(data, reach * tolerance);
    const Outcome outcome = loops.search();
    if (outcome == Outcome::none) continue;
    known.in_space = outcome == Outcome::independent;
    if (outcome != Outcome::moved) return;
    data.rounded = loops.finding();
    data.rounded.made = data.rounded.part <= tolerance;
    if (data.rounded.made) return loops.write(data.constraints);
  }
}

std::string in_words(const MechanismData& data) {
  constexpr std::size_t kShown = 8;
  const RoundedLoops& r = data.rounded;
  std::vector<std::string> names;
  for (const int j : r.joints) names.push_back("'" + data.joint_names[at(j)] + "'");
  if (names.size() > kShown) {
    names.resize(kShown);
    names.emplace_back("...");
  }
  return fmt::format(
             "the numbers of joints {} are rounded: the redundant equations of their loop agree only if points move by "
             "{:.1e} m and axes turn by {:.1e} rad. ",
             fmt::join(names, ", "), r.shift, r.turn) +
         (r.made ? "The nearest geometry in which they agree is taken. Write these numbers with all digits; "
                   "simulation.redundancy_tolerance 0 takes them literally"
                 : fmt::format("If this is rounding, set simulation.redundancy_tolerance (part of a length, rad) above "
                               "{:.1e}, or write these numbers with all digits",
                               r.part));
}

}  // namespace mbsopt
