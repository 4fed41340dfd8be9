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
#include "core/linear/dense.hpp"
#include "core/mechanism/constraint_gradient.hpp"
#include "core/mechanism/sensor_kinds.hpp"

namespace mbsopt {
namespace {

struct Scaled {
  std::vector<Frame> frames;
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

  out.frames = frames_at(y);
  out.J = jacobian_in_motions(d, out.frames);
  for (Eigen::Index k = 3; k < out.J.cols(); k += 6) out.J.middleCols<3>(k) /= out.length;
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
  double evaluate(const MechanismData& d, const StatePoint& state, SensorGradient* to) const override {
    const Scaled x = scaled(d, state.y);
    if (!to || x.J.size() == 0) return x.smallest;
    // The rows w_i, then in J's own columns.
    const Eigen::VectorXd factor = (x.norms.array() > 0).select(x.left.cwiseQuotient(x.norms), 0);
    Eigen::MatrixXd W = factor.cwiseProduct(-x.J * x.right).asDiagonal() * x.J;
    W += factor * x.right.transpose();
    double L_bar = 0;
    const StateLayout layout{d.n};
    for (int body = 1; body <= d.n; ++body) {
      auto turns = W.middleCols<3>(layout.z(body) + 3);
      L_bar -= x.norms.dot(turns.cwiseProduct(x.J.middleCols<3>(layout.z(body) + 3)).rowwise().sum()) / x.length;
      turns /= x.length;
    }
    for (const Constraint& c : d.constraints)
      for (int i = 0; i < c.rows(); ++i) {
        const auto part = [&](int body) {
          return body > 0 ? Vec<6>(W.block<1, 6>(c.row + i, layout.z(body)).transpose()) : Vec<6>(Vec<6>::Zero());
        };
        add_virtual_work_gradient(c, x.frames[at(c.body1)], x.frames[at(c.body2)], part(c.body1), part(c.body2),
                                  ConstraintVector::Unit(c.rows(), i), *to);
      }
    for_each_point(
        d, [&](const Vector3d& s, int slot) { to->add_slot<3>(slot, Vec<3>(L_bar / (x.points * x.length) * s)); });
    return x.smallest;
  }
};

}  // namespace

std::unique_ptr<SensorFunction> make_smallest_singular_value(Compilation&, const Sensor&, const std::string&) {
  return std::make_unique<SingularValueFunction>();
}

}  // namespace mbsopt
