#include "core/dynamics/planar_rows.hpp"

#include <cassert>
#include <map>

namespace mbsopt {

PlanarRows::PlanarRows(const MechanismData& data) : model_(data.planar.get()) {
  for (std::size_t i = 1; i < model_->bodies.size(); ++i)
    bodies_.push_back({model_->bodies[i].mass, model_->bodies[i].inertia});
  std::map<int, std::vector<int>> bodies_of_row;  // moving bodies only
  for (const PlanarConstraint& c : model_->constraints) {
    if (c.kind == PlanarConstraint::Kind::point) continue;
    std::vector<int>& bodies = bodies_of_row[c.row];
    for (const int body : {c.body1, c.body2}) {
      if (body > 0 && std::find(bodies.begin(), bodies.end(), body) == bodies.end()) bodies.push_back(body);
    }
  }
  std::map<int, int> first_entry;
  for (const auto& [row, bodies] : bodies_of_row) {
    const int first = static_cast<int>(entries_.size());
    first_entry[row] = first;
    for (std::size_t j = 0; j < bodies.size(); ++j) {
      entries_.push_back({bodies[j], row, {}});
      for (std::size_t i = 0; i < j; ++i) {
        pairs_.push_back({first + static_cast<int>(i), first + static_cast<int>(j), edges_.size()});
        edges_.emplace_back(bodies[i] - 1, bodies[j] - 1);
      }
    }
  }
  for (std::size_t k = 0; k < model_->constraints.size(); ++k) {
    const PlanarConstraint& c = model_->constraints[k];
    const int constraint = static_cast<int>(k);
    if (c.kind == PlanarConstraint::Kind::point) {
      points_.push_back({c.body1, c.body2, c.row, c.row2, {}, {}});
      point_places_.push_back({constraint, edges_.size()});
      if (c.body1 > 0 && c.body2 > 0) edges_.emplace_back(c.body1 - 1, c.body2 - 1);
      continue;
    }
    const std::vector<int>& bodies = bodies_of_row[c.row];
    const auto entry = [&](int body) {
      if (body == 0) return -1;
      return first_entry[c.row] + static_cast<int>(std::find(bodies.begin(), bodies.end(), body) - bodies.begin());
    };
    singles_.push_back({constraint, entry(c.body1), entry(c.body2)});
  }
}

void PlanarRows::evaluate(const Frames& frames) {
  for (std::size_t k = 0; k < points_.size(); ++k) {
    Point& p = points_[k];
    const PlanarConstraint& c = model_->constraints[at(point_places_[k].constraint)];
    const Plane x1 = frames[at(p.body1)].A * c.s1, x2 = frames[at(p.body2)].A * c.s2;
    p.x1[0] = x1.re;
    p.x1[1] = x1.im;
    p.x2[0] = x2.re;
    p.x2[1] = x2.im;
  }
  for (Entry& e : entries_) e.J[0] = e.J[1] = e.J[2] = 0;
  for (const Single& s : singles_) {
    const PlanarConstraint& c = model_->constraints[at(s.constraint)];
    const PlanarColumn<double> column = jacobian_of_row(c, frames[at(c.body1)], frames[at(c.body2)]);
    const auto add = [&](int entry, const Plane& force, double moment) {
      if (entry < 0) return;
      double* J = entries_[at(entry)].J;
      J[0] += c.factor * force.re;
      J[1] += c.factor * force.im;
      J[2] += c.factor * moment;
    };
    add(s.entry1, column.force1, column.moment1);
    add(s.entry2, column.force2, column.moment2);
  }
}

void PlanarRows::write_dense(Eigen::MatrixXd& J) const {
  J.setZero(count(), 3 * static_cast<Eigen::Index>(bodies_.size()));
  const auto add_point = [&](const Point& p, int body, double sign, const double* x) {  // sign (I, i x)
    if (body == 0) return;
    const Eigen::Index first = 3 * (body - 1);
    J(p.row, first) += sign;
    J(p.row2, first + 1) += sign;
    J(p.row, first + 2) -= sign * x[1];
    J(p.row2, first + 2) += sign * x[0];
  };
  for (const Point& p : points_) {
    add_point(p, p.body1, -1, p.x1);
    add_point(p, p.body2, 1, p.x2);
  }
  for (const Entry& e : entries_)
    for (int k = 0; k < 3; ++k) J(e.row, 3 * (e.body - 1) + k) += e.J[k];
}

void PlanarRows::assemble(const Frames& frames, const Eigen::VectorXd& alpha, BlockCholesky<3>& S,
                          [[maybe_unused]] Eigen::VectorXd* phi_ddot) {
  assert(!phi_ddot);
  evaluate(frames);
  set_mass(S);
  add_weighted_square(alpha, S);
}

void PlanarRows::set_mass(BlockCholesky<3>& S) const {
  S.set_off_diagonals_to_zero();
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const RowsInPlane::Body& b = bodies_[i];
    S.diagonal(static_cast<int>(i)) << b.mass, 0, 0, 0, b.mass, 0, 0, 0, b.inertia;
  }
}

void PlanarRows::add_weighted_square(const Eigen::VectorXd& alpha, BlockCholesky<3>& S) const {
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const Point& p = points_[k];
    const double a = alpha(p.row), b = alpha(p.row2);
    const auto add_square = [&](int body, const double* x) {
      if (body == 0) return;
      Mat<3, 3>& D = S.diagonal(body - 1);  // its lower triangle is what is read
      D(0, 0) += a;
      D(1, 1) += b;
      D(2, 0) -= a * x[1];
      D(2, 1) += b * x[0];
      D(2, 2) += a * x[1] * x[1] + b * x[0] * x[0];
    };
    add_square(p.body1, p.x1);
    add_square(p.body2, p.x2);
    if (p.body1 == 0 || p.body2 == 0) continue;
    Mat<3, 3> X;
    X << -a, 0, a * p.x2[1],  //
        0, -b, -b * p.x2[0],  //
        a * p.x1[1], -b * p.x1[0], -(a * p.x1[1] * p.x2[1] + b * p.x1[0] * p.x2[0]);
    S.add_off_diagonal(point_places_[k].handle, X);
  }
  for (const Entry& e : entries_) {
    const double a = alpha(e.row);
    Mat<3, 3>& D = S.diagonal(e.body - 1);
    for (int j = 0; j < 3; ++j) {
      for (int i = j; i < 3; ++i) D(i, j) += a * e.J[i] * e.J[j];
    }
  }
  for (const Pair& p : pairs_) {
    const Entry &e = entries_[at(p.entry1)], &f = entries_[at(p.entry2)];
    Mat<3, 3> X;
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) X(i, j) = alpha(e.row) * e.J[i] * f.J[j];
    }
    S.add_off_diagonal(p.handle, X);
  }
}

}  // namespace mbsopt
