// The smallest singular value of the scaled Jacobian of joints and drives: it is 0 where they release a motion.   [-]
//   J    rows of Phi, columns (delta r [m], L delta theta) of each body: turns are measured at the length L
//   j_i  row i of J,  J^ its rows of length 1: j^_i = j_i/|j_i|
//   J^ = sum_k sigma_k u_k v_k',  sigma the least of the min(rows, columns) values
//   dsigma = u'dJ^ v = sum_i w_i'dj_i,   w_i = u_i/|j_i| (v - (j^_i'v) j^_i)
//   L^2 = sum |s|^2/N over the points of joints seen from the centres of mass
//   dsigma/dL = -1/L sum_i (w_i'j_i)_theta
// Redundant equations beside a free motion give 0 everywhere; in a driven mechanism they do no harm. A sigma that
// occurs twice has no derivative; the gradient is then that of one of the two. Source of dsigma: G. H. Golub, C. F. Van
// Loan, "Matrix Computations", section 8.6.
#include <cmath>

#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/linear/dense.hpp"
#include "core/mechanism/sensor_kinds.hpp"
#include "core/mechanism/virtual_work.hpp"

namespace mbsopt {
namespace {

struct Scaled {
  Eigen::MatrixXd J;            // rows of length 1
  Eigen::VectorXd norms;        // |j_i|
  double length = 1;            // L [m]
  int points = 0;               // N
  double smallest = 0;          // sigma
  Eigen::VectorXd left, right;  // u, v
};

template <class Use>
void for_each_point(const MechanismData& d, const Use& use) {
  for (const Constraint& c : d.constraints)
    if (const auto* p = std::get_if<Coincidence>(&c.primitive)) {
      if (c.body1 > 0) use(p->s1, c.slot1);
      if (c.body2 > 0) use(p->s2, c.slot2);
    }
}

Scaled scaled(const MechanismData& d, const Eigen::VectorXd& y) {
  Scaled out;
  double sum = 0;
  for_each_point(d, [&](const Vector3d& s, int) { sum += s.squaredNorm(), ++out.points; });
  if (sum > 0) out.length = std::sqrt(sum / out.points);

  const StateLayout layout{d.n};
  out.J = Eigen::MatrixXd::Zero(d.m, 6 * d.n);
  for (const Constraint& c : d.constraints) {
    const BodyAt b1 = body_at(y, c.body1), b2 = body_at(y, c.body2);
    std::visit(
        [&]<class P>(const P& p) {
          Mat<P::kRows, 6> J1, J2;
          p.jacobian(b1.frame, b2.frame, J1, J2);
          J1.template rightCols<3>() /= out.length, J2.template rightCols<3>() /= out.length;
          if (c.body1 > 0) out.J.block<P::kRows, 6>(c.row, layout.z(c.body1)) += c.factor * J1;
          if (c.body2 > 0) out.J.block<P::kRows, 6>(c.row, layout.z(c.body2)) += c.factor * J2;
        },
        c.primitive);
  }
  out.norms = out.J.rowwise().norm();
  for (Eigen::Index i = 0; i < out.J.rows(); ++i)
    if (out.norms(i) > 0) out.J.row(i) /= out.norms(i);
  if (out.J.size() == 0) return out;
  LeastSingular least = least_singular(out.J);
  out.smallest = least.value;
  out.left = std::move(least.u);
  out.right = std::move(least.v);
  return out;
}

struct SingularValueFunction final : SensorFunction {
  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    const Scaled x = scaled(d, at.y);
    if (!to || x.J.size() == 0) return x.smallest;
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(x.J.rows(), x.J.cols());  // w_i, then J's own columns
    const StateLayout layout{d.n};
    double L_bar = 0;
    for (Eigen::Index i = 0; i < W.rows(); ++i) {
      if (!(x.norms(i) > 0)) continue;
      const Eigen::RowVectorXd j = x.J.row(i);
      W.row(i) = x.left(i) / x.norms(i) * (x.right.transpose() - j.dot(x.right) * j);
      for (int body = 1; body <= d.n; ++body) {
        const Eigen::Index theta = layout.z(body) + 3;
        L_bar -= x.norms(i) / x.length * W.row(i).segment<3>(theta).dot(j.segment<3>(theta));
        W.row(i).segment<3>(theta) /= x.length;
      }
    }
    for (const Constraint& c : d.constraints)
      for (int i = 0; i < c.rows(); ++i) add_row(c, i, W.row(c.row + i).transpose(), at.y, *to);
    for_each_point(
        d, [&](const Vector3d& s, int slot) { to->add_slot<3>(slot, Vec<3>(L_bar / (x.points * x.length) * s)); });
    return x.smallest;
  }

 private:
  // Adds the gradient of w'j of row i of a constraint; w is a virtual displacement of all bodies.
  static void add_row(const Constraint& c, int i, const Eigen::VectorXd& w, const Eigen::VectorXd& y,
                      SensorGradient& to) {
    const auto part = [&](int body) {
      return body > 0 ? Vec<6>(w.segment<6>(StateLayout{to.data.n}.z(body))) : Vec<6>(Vec<6>::Zero());
    };
    add_virtual_work_gradient(c, y, part(c.body1), part(c.body2), ConstraintRows::Unit(c.rows(), i), to);
  }
};

}  // namespace

std::unique_ptr<SensorFunction> make_smallest_singular_value(Compilation&, const Sensor&, const std::string&) {
  return std::make_unique<SingularValueFunction>();
}

}  // namespace mbsopt
