#include "core/dynamics/planar_constraints.hpp"

#include <algorithm>

#include "core/body/jet.hpp"
#include "core/constraint/constraint.hpp"
#include "core/linear/pairs.hpp"

namespace mbsopt {
namespace {

using Kind = PlanarConstraint::Kind;
using Order = PlanarConstraints::Order;

// The primitive's vectors, which are constant or have their own directions.
template <class S>
struct Vectors {
  Complex<S> s1, s2, s3;
};

template <class X>
const X& of(Order order, const Jet<X>& jet) {
  return order == Order::phi ? jet.x : order == Order::phi_dot ? jet.xd : jet.xdd;
}

// A body-fixed vector x = A s, and the separation of two points.
template <class T, class S>
Jet<Complex<T>> vector_of(const PlanarFrame<T>& f, const Complex<S>& s) {
  return {f.A * s, f.Adot * s, f.Addot * s};
}
template <class T, class S>
Jet<Complex<T>> separation(const PlanarFrame<T>& f1, const PlanarFrame<T>& f2, const Vectors<S>& s) {
  return {f2.r - f1.r + f2.A * s.s2 - f1.A * s.s1, f2.rdot - f1.rdot + f2.Adot * s.s2 - f1.Adot * s.s1,
          f2.Addot * s.s2 - f1.Addot * s.s1 + (f2.rddot - f1.rddot)};
}

// arg(A2 s2) - arg(A1 s1). It computes only the given order, because atan2 is slow.
template <class T, class S>
Jet<T> angle_between(Order order, const PlanarFrame<T>& f1, const PlanarFrame<T>& f2, const Vectors<S>& s) {
  if (order == Order::phi) {
    const Complex<T> x1 = f1.A * s.s1, x2 = f2.A * s.s2;
    return {angle_of(T(cross(x1, x2)), T(dot(x1, x2))), T(0), T(0)};
  }
  const Complex<T> over1 = inverse(f1.A), rate1 = f1.Adot * over1, over2 = inverse(f2.A), rate2 = f2.Adot * over2;
  return {T(0), T(rate2.im - rate1.im),
          T((f2.Addot * over2 - rate2 * rate2).im - (f1.Addot * over1 - rate1 * rate1).im)};
}

// The equation of each kind of single row.
template <class T, class S>
T phi_of(Order order, const PlanarConstraint& c, const PlanarFrame<T>& f1, const PlanarFrame<T>& f2,
         const Vectors<S>& s) {
  switch (c.kind) {
    case Kind::dot1:
      return of(order, product(vector_of(f1, s.s1), vector_of(f2, s.s2)));
    case Kind::dot2:
      return of(order, product(vector_of(f1, s.s3), separation(f1, f2, s)));
    case Kind::distance:
      return of(order, length(separation(f1, f2, s)));
    case Kind::angle:
      return c.sign * of(order, angle_between(order, f1, f2, s));
    case Kind::point:
      break;
  }
  return T(0);
}

template <class T, class S>
PlanarColumn<T> column_of(const PlanarConstraint& c, const PlanarFrame<T>& f1, const PlanarFrame<T>& f2,
                          const Vectors<S>& s) {
  using std::sqrt;
  const auto along = [&](const Complex<T>& u) {  // u'd
    return PlanarColumn<T>{-u, u, -cross(f1.A * s.s1, u), cross(f2.A * s.s2, u)};
  };
  switch (c.kind) {
    case Kind::dot1: {
      const T m = cross(f1.A * s.s1, f2.A * s.s2);
      return {{}, {}, m, -m};
    }
    case Kind::dot2: {
      const Complex<T> u = f1.A * s.s3;
      PlanarColumn<T> column = along(u);
      column.moment1 = column.moment1 + cross(u, separation(f1, f2, s).x);
      return column;
    }
    case Kind::distance: {
      const Complex<T> d = separation(f1, f2, s).x;
      const T l = sqrt(squared_norm(d));
      return along({d.re / l, d.im / l});
    }
    case Kind::angle:
      return {{}, {}, T(-c.sign), T(c.sign)};
    case Kind::point:
      break;
  }
  return {};
}

double on_branch(const PlanarConstraint& c, const RowLaws& laws, const Eigen::VectorXd& angles, double value) {
  if (c.kind != Kind::angle) return value;
  return Angle::on_branch(value, c.angle == Constraint::kNearestLaw ? laws.f_or_zero(c.row) : angles(c.angle));
}

Vectors<double> vectors(const PlanarConstraint& c) { return {c.s1, c.s2, c.s3}; }

// A vector with the directions of its slot; only directions in the plane count.
PlaneDual moving(const PlanarBody& body, const Plane& s, const Lanes<3>* ds) {
  if (!ds) return {s.re, s.im};
  return {dual(s.re, body.b1.transpose() * *ds), dual(s.im, body.b2.transpose() * *ds)};
}

// Two rows += sign Z s', s' the direction of a slot's vector.
template <class Row>
void add_vector_tangent(const ParameterBlock& block, int slot, const PlanarBody& body, double sign, const Plane& Z,
                        Row&& row, Row&& row2) {
  if (!block.moves(slot, 3)) return;
  const Lanes<3> ds = block.theta.middleRows<3>(slot);
  const Lanes<1> re = body.b1.transpose() * ds, im = body.b2.transpose() * ds;
  row += sign * (Z.re * re - Z.im * im);
  row2 += sign * (Z.re * im + Z.im * re);
}

// Adds the cotangents in Im w,  w = mu0 log A + mu1 Adot/A + mu2 (Addot/A - (Adot/A)^2) + lambda A_eta/A:  the
// cotangent of z in Im w is i conj(dw/dz).
void add_angle_bar(const PlanarFrame<double>& f, const RowWeights& z, PlanarFrameBar& bar) {
  const Plane over = inverse(f.A), rate = f.Adot * over, second = f.Addot * over;
  const Plane change{0, f.theta_eta};  // A_eta/A
  const auto add = [](Plane& to, const Plane& w_z) { to += times_i(conj(w_z)); };
  add(bar.A, over * (Plane{z.mu0, 0} - z.mu1 * rate - z.mu2 * (second - 2 * (rate * rate)) - z.lambda * change));
  add(bar.Adot, over * (Plane{z.mu1, 0} - (2 * z.mu2) * rate));
  add(bar.Addot, z.mu2 * over);
  add(bar.A_eta, z.lambda * over);
}

RowWeights times(double s, const RowWeights& z) { return {s * z.lambda, s * z.mu0, s * z.mu1, s * z.mu2}; }

// Add the cotangent of the separation of the primitive's points, or those of a single row, to the frames and vectors.
void add_separation_bar(const PlanarConstraint& c, const PlanarFrame<double>& f1, const PlanarFrame<double>& f2,
                        const MovedJet<Plane>& bar, PlanarFrameBar& bar1, PlanarFrameBar& bar2,
                        Vectors<double>& s_bar) {
  add_point_bar(f2, c.s2, bar, 1, bar2, s_bar.s2);
  add_point_bar(f1, c.s1, bar, -1, bar1, s_bar.s1);
}
void add_row_bar(const PlanarConstraint& c, const PlanarFrame<double>& f1, const PlanarFrame<double>& f2,
                 const RowWeights& z, PlanarFrameBar& bar1, PlanarFrameBar& bar2, Vectors<double>& s_bar) {
  const auto changed = [](const PlanarFrame<double>& f, const Plane& s) { return f.turned(f.A * s); };
  const auto moved = [&](const PlanarFrame<double>& f, const Plane& s) {
    return MovedJet<Plane>{vector_of(f, s), changed(f, s)};
  };
  const auto moved_separation = [&] {
    return MovedJet<Plane>{separation(f1, f2, vectors(c)), f2.r_eta - f1.r_eta + changed(f2, c.s2) - changed(f1, c.s1)};
  };
  switch (c.kind) {
    case Kind::dot1:
      add_vector_bar(f1, c.s1, product_bar(moved(f2, c.s2), z), 1, bar1, s_bar.s1);
      add_vector_bar(f2, c.s2, product_bar(moved(f1, c.s1), z), 1, bar2, s_bar.s2);
      break;
    case Kind::dot2:
      add_vector_bar(f1, c.s3, product_bar(moved_separation(), z), 1, bar1, s_bar.s3);
      add_separation_bar(c, f1, f2, product_bar(moved(f1, c.s3), z), bar1, bar2, s_bar);
      break;
    case Kind::distance:
      add_separation_bar(c, f1, f2, length_bar(moved_separation(), z), bar1, bar2, s_bar);
      break;
    case Kind::angle:
      add_angle_bar(f2, times(c.sign, z), bar2);
      add_angle_bar(f1, times(-c.sign, z), bar1);
      s_bar.s2 = times_i(conj((c.sign * z.mu0) * inverse(c.s2)));
      s_bar.s1 = times_i(conj((-c.sign * z.mu0) * inverse(c.s1)));
      break;
    case Kind::point:
      break;
  }
}

// J eta of a single row, for the virtual displacement in the frames.
double virtual_change(const PlanarConstraint& c, const PlanarFrame<double>& f1, const PlanarFrame<double>& f2) {
  const PlanarColumn<double> J = column_of(c, f1, f2, vectors(c));
  return dot(J.force1, f1.r_eta) + dot(J.force2, f2.r_eta) + J.moment1 * f1.theta_eta + J.moment2 * f2.theta_eta;
}

}  // namespace

PlanarColumn<double> jacobian_of_row(const PlanarConstraint& c, const PlanarFrame<double>& f1,
                                     const PlanarFrame<double>& f2) {
  return column_of(c, f1, f2, vectors(c));
}

// Phi or a time derivative of it, without laws. branch(c, value) puts an angle on its branch.
template <PlanarConstraints::Order order, class Branch>
void PlanarConstraints::evaluate(const Frames& frames, Branch&& branch, Eigen::VectorXd& out) const {
  out.setZero();
  for (const PlanarConstraint& c : model_->constraints) {
    const PlanarFrame<double>&f1 = frames[at(c.body1)], &f2 = frames[at(c.body2)];
    if (c.kind == Kind::point) {
      const Plane d = of(order, separation(f1, f2, vectors(c)));
      out(c.row) = d.re;
      out(c.row2) = d.im;
    } else {
      out(c.row) += c.factor * branch(c, phi_of(order, c, f1, f2, vectors(c)));
    }
  }
}

void PlanarConstraints::phi(const Frames& frames, const RowLaws& laws, const Eigen::VectorXd& angles,
                            Eigen::VectorXd& out) const {
  evaluate<Order::phi>(
      frames, [&](const PlanarConstraint& c, double x) { return on_branch(c, laws, angles, x); }, out);
  laws.subtract(0, out);
}
void PlanarConstraints::phi_dot(const Frames& frames, const RowLaws& laws, Eigen::VectorXd& out) const {
  evaluate<Order::phi_dot>(
      frames, [](const PlanarConstraint&, double x) { return x; }, out);
  laws.subtract(1, out);
}
void PlanarConstraints::phi_ddot(const Frames& frames, const RowLaws& laws, Eigen::VectorXd& out) const {
  evaluate<Order::phi_ddot>(
      frames, [](const PlanarConstraint&, double x) { return x; }, out);
  laws.subtract(2, out);
}

void PlanarConstraints::add_pull_back(const Frames& frames, RowLaws& laws, const Eigen::VectorXd& angles,
                                      const ConstraintWeights& weights, double scale, std::vector<PlanarFrameBar>& bars,
                                      Eigen::Ref<Eigen::VectorXd> theta_bar,
                                      Eigen::Ref<Eigen::VectorXd> rho_bar) const {
  const auto of = [&](const Eigen::VectorXd* z, int row) { return z ? scale * (*z)(row) : 0.0; };
  const auto point = [&](const Eigen::VectorXd* z, const PlanarConstraint& c) {
    return Plane{of(z, c.row), of(z, c.row2)};
  };
  for (const PlanarConstraint& c : model_->constraints) {
    const std::size_t i = at(c.body1), j = at(c.body2);
    const PlanarFrame<double>&f1 = frames[i], &f2 = frames[j];
    Vectors<double> s_bar;
    if (c.kind == Kind::point) {
      const MovedJet<Plane> bar{{point(weights.mu0, c), point(weights.mu1, c), point(weights.mu2, c)},
                                point(weights.lambda, c)};
      add_separation_bar(c, f1, f2, bar, bars[i], bars[j], s_bar);
    } else {
      const RowWeights unscaled{of(weights.lambda, c.row), of(weights.mu0, c.row), of(weights.mu1, c.row),
                                of(weights.mu2, c.row)};
      add_row_bar(c, f1, f2, times(c.factor, unscaled), bars[i], bars[j], s_bar);
      if (c.slot_factor >= 0) {
        const auto phi = [&](Order order) { return phi_of(order, c, f1, f2, vectors(c)); };
        theta_bar(c.slot_factor) += unscaled.lambda * virtual_change(c, f1, f2) +
                                    unscaled.mu0 * on_branch(c, laws, angles, phi(Order::phi)) +
                                    unscaled.mu1 * phi(Order::phi_dot) + unscaled.mu2 * phi(Order::phi_ddot);
      }
    }
    const auto keep = [&](int slot, std::size_t body, const Plane& bar) {
      if (slot >= 0) theta_bar.segment<3>(slot) += model_->bodies[body].in_body(bar);
    };
    keep(c.slot1, i, s_bar.s1);
    keep(c.slot2, j, s_bar.s2);
    keep(c.slot3, i, s_bar.s3);
  }
  laws.add_pull_back(weights.mu0, weights.mu1, weights.mu2, scale, theta_bar, rho_bar);
}

void PlanarConstraints::tangents(Order order, const DualFrames& frames, RowLaws& laws, const Eigen::VectorXd& angles,
                                 const ParameterBlock& block, const Eigen::VectorXd& lambda, ConstraintTangents& out,
                                 std::vector<Lanes<3>>& loads) const {
  for (LaneRows* x : {&out.phi, &out.phi_dot, &out.phi_ddot}) x->setZero();
  LaneRows& rows = order == Order::phi ? out.phi : order == Order::phi_dot ? out.phi_dot : out.phi_ddot;
  for (const PlanarConstraint& c : model_->constraints) {
    if (c.kind == Kind::point && order == Order::phi_ddot) continue;
    const std::size_t i = at(c.body1), j = at(c.body2);
    const PlanarFrame<Dual>&f1 = frames[i], &f2 = frames[j];
    const auto add_load = [&](std::size_t body, const PlaneDual& force, const Dual& moment) {
      loads[body].row(0) += lanes(force.re);
      loads[body].row(1) += lanes(force.im);
      loads[body].row(2) += lanes(moment);
    };
    const auto add = [&](const auto& s) {
      if (c.kind == Kind::point) {
        const PlaneDual d = of(order, separation(f1, f2, s));
        rows.row(c.row) += lanes(d.re);
        rows.row(c.row2) += lanes(d.im);
        const Plane l{lambda(c.row), lambda(c.row2)};
        loads[i].row(2) -= lanes(cross(f1.A * s.s1, l));
        loads[j].row(2) += lanes(cross(f2.A * s.s2, l));
        return;
      }
      Dual factor = c.factor;
      Lanes<1> storage;
      if (const Lanes<1>* change = block.field<1>(c.slot_factor, storage)) factor.derivatives() = change->transpose();
      Dual phi = phi_of(order, c, f1, f2, s);
      if (order == Order::phi) phi.value() = on_branch(c, laws, angles, phi.value());
      rows.row(c.row) += lanes(factor * phi);
      const Dual l = lambda(c.row) * factor;
      const auto J = column_of(c, f1, f2, s);
      add_load(i, l * J.force1, l * J.moment1);
      add_load(j, l * J.force2, l * J.moment2);
    };
    Lanes<3> d1, d2, d3;
    const Lanes<3>*s1 = block.field<3>(c.slot1, d1), *s2 = block.field<3>(c.slot2, d2),
          *s3 = block.field<3>(c.slot3, d3);
    if (s1 || s2 || s3) {
      const PlanarBody &b1 = model_->bodies[i], &b2 = model_->bodies[j];
      add(Vectors<Dual>{moving(b1, c.s1, s1), moving(b2, c.s2, s2), moving(b1, c.s3, s3)});
    } else {
      add(vectors(c));
    }
  }
  laws.subtract_tangents(block, {&out.phi, &out.phi_dot, &out.phi_ddot});
}

void PlanarConstraints::field_tangents(const Frames& frames, RowLaws& laws, const Eigen::VectorXd& angles,
                                       const ParameterBlock& block, LaneRows& phi) const {
  phi.setZero();
  const auto at_rest = [](const PlanarFrame<double>& f) {
    PlanarFrame<Dual> out;
    out.r = {f.r.re, f.r.im};
    out.A = {f.A.re, f.A.im};
    return out;
  };
  for (const PlanarConstraint& c : model_->constraints) {
    const std::size_t i = at(c.body1), j = at(c.body2);
    const PlanarBody &b1 = model_->bodies[i], &b2 = model_->bodies[j];
    if (c.kind == Kind::point) {
      add_vector_tangent(block, c.slot2, b2, 1, frames[j].A, phi.row(c.row), phi.row(c.row2));
      add_vector_tangent(block, c.slot1, b1, -1, frames[i].A, phi.row(c.row), phi.row(c.row2));
      continue;
    }
    Lanes<3> d1, d2, d3;
    Lanes<1> d_factor;
    const Lanes<3>*s1 = block.field<3>(c.slot1, d1), *s2 = block.field<3>(c.slot2, d2),
          *s3 = block.field<3>(c.slot3, d3);
    Dual factor = c.factor;
    const Lanes<1>* const change = block.field<1>(c.slot_factor, d_factor);
    if (change) factor.derivatives() = change->transpose();
    if (!s1 && !s2 && !s3 && !change) continue;
    const Vectors<Dual> s{moving(b1, c.s1, s1), moving(b2, c.s2, s2), moving(b1, c.s3, s3)};
    Dual value = phi_of(Order::phi, c, at_rest(frames[i]), at_rest(frames[j]), s);
    value.value() = on_branch(c, laws, angles, value.value());
    phi.row(c.row) += lanes(factor * value);
  }
  laws.subtract_tangents(block, {&phi});
}

void PlanarConstraints::set_point_moments(const Eigen::VectorXd& lambda, std::vector<Plane>& W) const {
  for (Plane& w : W) w = {};
  for (const PlanarConstraint& c : model_->constraints) {
    if (c.kind != Kind::point) continue;
    const Plane l{lambda(c.row), lambda(c.row2)};
    W[at(c.body1)] -= conj(c.s1) * l;
    W[at(c.body2)] += conj(c.s2) * l;
  }
}

void PlanarConstraints::subtract_point_tangents(const Frames& frames, const std::vector<Lanes<2>>& Addot_dirs,
                                                const ParameterBlock& block, const Eigen::VectorXd& lambda, LaneRows& c,
                                                std::vector<Lanes<3>>& b) const {
  LaneRow* rows = entries(c);
  for (const PlanarConstraint& p : model_->constraints) {
    if (p.kind != Kind::point) continue;
    LaneRow &first = rows[p.row], &second = rows[p.row2];
    if (p.body2 > 0) {
      const LaneRow* x = entries(Addot_dirs[at(p.body2)]);
      first -= p.s2.re * x[0] - p.s2.im * x[1];
      second -= p.s2.re * x[1] + p.s2.im * x[0];
    }
    if (p.body1 > 0) {
      const LaneRow* x = entries(Addot_dirs[at(p.body1)]);
      first += p.s1.re * x[0] - p.s1.im * x[1];
      second += p.s1.re * x[1] + p.s1.im * x[0];
    }
    const auto vector_moves = [&](int slot, int body, double sign) {
      if (!block.moves(slot, 3)) return;
      const PlanarBody& own = model_->bodies[at(body)];
      const PlanarFrame<double>& f = frames[at(body)];
      add_vector_tangent(block, slot, own, -sign, f.Addot, c.row(p.row), c.row(p.row2));
      if (body == 0) return;
      const Lanes<3> ds = block.theta.middleRows<3>(slot);
      const Lanes<1> re = own.b1.transpose() * ds, im = own.b2.transpose() * ds;
      const Plane w = conj(f.A) * Plane{lambda(p.row), lambda(p.row2)};  // cross(A s', l) = cross(s', conj(A) l)
      b[at(body - 1)].row(2) -= sign * (w.im * re - w.re * im);
    };
    vector_moves(p.slot2, p.body2, 1);
    vector_moves(p.slot1, p.body1, -1);
  }
}

void PlanarConstraints::mark_others(std::vector<bool>& bodies) const {
  for (const PlanarConstraint& c : model_->constraints) {
    if (c.kind != Kind::point) bodies[at(c.body1)] = bodies[at(c.body2)] = true;
  }
}

}  // namespace mbsopt
