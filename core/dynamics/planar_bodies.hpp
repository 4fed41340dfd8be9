// Reads and writes the numbers of a planar body in the state y, with their tangents and cotangents. y has the layout of
// space (7 + 7 numbers per body). Components out of the plane keep their values in y and are at rest.
#pragma once

#include "core/mechanism/parameter_lanes.hpp"
#include "core/mechanism/planar_model.hpp"

namespace mbsopt {

class PlanarBodies {
 public:
  explicit PlanarBodies(const PlanarModel& model) : model_(&model) {}

  // first is the row of a body's r or p in y, or of their rates.
  template <class Y>
  Plane vector(const Y& y, Eigen::Index first) const {
    return {y(first + model_->t1), y(first + model_->t2)};
  }
  template <class Y>
  Plane turn(std::size_t body, const Y& y, Eigen::Index first) const {
    const PlanarBody& b = model_->bodies[body];
    return {b.p_a.dot(y.template segment<4>(first)), b.p_b.dot(y.template segment<4>(first))};
  }
  PlaneDual vector(const Plane& x, const LaneRows& y_dir, Eigen::Index first) const {
    return {dual(x.re, y_dir.row(first + model_->t1)), dual(x.im, y_dir.row(first + model_->t2))};
  }
  PlaneDual turn(std::size_t body, const Plane& P, const LaneRows& y_dir, Eigen::Index first) const {
    const PlanarBody& b = model_->bodies[body];
    const Lanes<4> p_dir = y_dir.middleRows<4>(first);
    return {dual(P.re, b.p_a.transpose() * p_dir), dual(P.im, b.p_b.transpose() * p_dir)};
  }

  template <class Y>
  void add_vector(const Plane& x, Eigen::Index first, Y&& y) const {
    y(first + model_->t1) += x.re;
    y(first + model_->t2) += x.im;
  }
  template <class Y>
  void add_turn(std::size_t body, const Plane& P, Eigen::Index first, Y&& y) const {
    const PlanarBody& b = model_->bodies[body];
    y.template segment<4>(first) += P.re * b.p_a + P.im * b.p_b;
  }
  void set_vector_direction(const Lanes<3>& x, Eigen::Index first, LaneRows& y_dir) const {
    y_dir.row(first + model_->t1) = x.row(0);
    y_dir.row(first + model_->t2) = x.row(1);
  }
  void add_turn_direction(std::size_t body, const PlaneDual& P, Eigen::Index first, LaneRows& y_dir) const {
    const PlanarBody& b = model_->bodies[body];
    y_dir.middleRows<4>(first) += b.p_a * lanes(P.re) + b.p_b * lanes(P.im);
  }

  // Reduces a load (force in global axes, moment in body axes) to the plane, and returns it to space.
  Vec<3> reduced(std::size_t body, const Vec<6>& load) const {
    return {load(model_->t1), load(model_->t2), model_->bodies[body].n.dot(load.tail<3>())};
  }
  Lanes<3> reduced(std::size_t body, const Lanes<6>& load) const {
    Lanes<3> out;
    out << load.row(model_->t1), load.row(model_->t2), model_->bodies[body].n.transpose() * load.bottomRows<3>();
    return out;
  }
  Vec<6> in_space(std::size_t body, const Vec<3>& x) const {
    Vec<6> out;
    out << model_->in_space({x(0), x(1)}), x(2) * model_->bodies[body].n;
    return out;
  }

  // The weights of the inertia's six numbers (xx yy zz xy xz yz) in n'J n.
  Vec<6> inertia_weights(std::size_t body) const {
    const Vector3d& n = model_->bodies[body].n;
    Vec<6> w;
    w << n(0) * n(0), n(1) * n(1), n(2) * n(2), 2 * n(0) * n(1), 2 * n(0) * n(2), 2 * n(1) * n(2);
    return w;
  }

 private:
  const PlanarModel* model_;
};

}  // namespace mbsopt
