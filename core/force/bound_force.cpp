#include "core/force/bound_force.hpp"

#include "core/force/named_throw.hpp"

namespace mbsopt {

template <class F>
void BoundForce::add_in_rho(F&& f, const VecIn& rho, MatOut out) const {
  named_throw(name_, [&] {
    if (!values_) return f(rho, out);
    Eigen::MatrixXd of_p = Eigen::MatrixXd::Zero(out.rows(), values_->p.size());
    f(VecIn(values_->p), MatOut(of_p));
    out += of_p * values_->p_rho;
  });
}

void BoundForce::Q(double t, VecIn q, VecIn v, VecIn rho, VecOut Q) const {
  named_throw(name_, [&] { force_->Q(t, q, v, own(rho), Q); });
}
void BoundForce::K(double t, VecIn q, VecIn v, VecIn rho, MatOut K) const {
  named_throw(name_, [&] { force_->K(t, q, v, own(rho), K); });
}
void BoundForce::C(double t, VecIn q, VecIn v, VecIn rho, MatOut C) const {
  named_throw(name_, [&] { force_->C(t, q, v, own(rho), C); });
}
void BoundForce::Q_rho(double t, VecIn q, VecIn v, VecIn rho, MatOut Q_rho) const {
  add_in_rho([&](const VecIn& p, MatOut out) { force_->Q_rho(t, q, v, p, out); }, rho, Q_rho);
}

void BoundForce::L(VecIn q, VecIn v, VecIn z, VecIn rho, VecOut L) const {
  named_throw(name_, [&] { force_->inertia()->L(q, v, z, own(rho), L); });
}
void BoundForce::M(VecIn q, VecIn rho, MatOut M) const {
  named_throw(name_, [&] { force_->inertia()->M(q, own(rho), M); });
}
void BoundForce::L_q(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_q) const {
  named_throw(name_, [&] { force_->inertia()->L_q(q, v, z, own(rho), L_q); });
}
void BoundForce::L_v(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_v) const {
  named_throw(name_, [&] { force_->inertia()->L_v(q, v, z, own(rho), L_v); });
}
void BoundForce::L_rho(VecIn q, VecIn v, VecIn z, VecIn rho, MatOut L_rho) const {
  add_in_rho([&](const VecIn& p, MatOut out) { force_->inertia()->L_rho(q, v, z, p, out); }, rho, L_rho);
}

std::vector<std::string> bodies_of(const UserForceSpec& force) {
  return force.bodies.empty() && force.term ? force.term->bodies() : force.bodies;
}

}  // namespace mbsopt
