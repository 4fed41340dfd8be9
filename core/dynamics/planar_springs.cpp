#include "core/dynamics/planar_springs.hpp"

#include <cmath>

#include "core/body/state_layout.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/planar_model.hpp"

namespace mbsopt {

PlanarSprings::PlanarSprings(const MechanismData& data) : data_(data) {
  for (const TsdaForce& f : data.forces->of<TsdaForce>()) {
    const std::size_t i = static_cast<std::size_t>(f.body1), j = static_cast<std::size_t>(f.body2);
    const PlanarBody &b1 = data.planar->bodies[i], &b2 = data.planar->bodies[j];
    springs_.push_back({&f, i, j, b1.in_plane(f.s1), b2.in_plane(f.s2)});
    points_in_plane_ = points_in_plane_ && b1.n.dot(f.s1) == 0 && b2.n.dot(f.s2) == 0;
  }
}

bool PlanarSprings::lie_in_plane(const Eigen::VectorXd& y) const {
  if (!points_in_plane_) return false;
  const StateLayout layout{data_.n};
  const auto height = [&](std::size_t body) { return body == 0 ? 0.0 : y(layout.q(body) + data_.planar->n); };
  for (const Spring& s : springs_) {
    if (height(s.body1) != height(s.body2)) return false;
  }
  return true;
}

SpringSpan<Plane> PlanarSprings::span(const Spring& s, const std::vector<PlanarFrame<double>>& frames) {
  const PlanarFrame<double>&f1 = frames[s.body1], &f2 = frames[s.body2];
  return {f2.r - f1.r + f2.A * s.s2 - f1.A * s.s1, f2.rdot - f1.rdot + f2.Adot * s.s2 - f1.Adot * s.s1};
}

void PlanarSprings::add_loads(double t, const std::vector<PlanarFrame<double>>& frames, Law::Scratch& scratch,
                              std::vector<Vec<3>>& loads) const {
  for (const Spring& s : springs_) {
    const SpringSpan<Plane> x = span(s, frames);
    const Plane F = s.force->law.value(t, data_.rho, x.l, x.ldot, scratch) * x.u;
    const auto add = [&](std::size_t body, const Plane& at, const Plane& force) {
      if (body == 0) return;
      Vec<3>& load = loads[body - 1];
      load(0) += force.re;
      load(1) += force.im;
      load(2) += cross(frames[body].A * at, force);
    };
    add(s.body1, s.s1, F);
    add(s.body2, s.s2, -F);
  }
}

// With l' = u'd' and ldot' = u'ddot' + (ddot - ldot u)'d'/l:
//   F = f(l, ldot) u,   K = u (f_x u + f_xdot (ddot - ldot u)/l)' + f/l (I - u u'),   C = f_xdot u u'
PlanarTension PlanarSprings::tension(std::size_t spring, double t, const std::vector<PlanarFrame<double>>& frames,
                                     Law::Scratch& scratch) const {
  const Spring& s = springs_[spring];
  const SpringSpan<Plane> x = span(s, frames);
  PlanarTension out{s.body1, s.body2, s.s1, s.s2, {}, Mat<2, 2>::Zero(), Mat<2, 2>::Zero()};
  if (x.l == 0) {
    if (s.force->is_k_times_d()) out.K.diagonal().setConstant(s.force->law.k);
    return out;
  }
  const Law::Value f = s.force->law.derivatives(t, data_.rho, x.l, x.ldot, scratch);
  const auto vector = [](const Plane& z) { return Vec<2>(z.re, z.im); };
  const Vec<2> u = vector(x.u);
  out.F = f.f * x.u;
  out.K = u * (f.f_x * u + (f.f_xdot / x.l) * vector(x.ddot - x.ldot * x.u)).transpose();
  out.K += (f.f / x.l) * (Mat<2, 2>::Identity() - u * u.transpose());
  out.C = f.f_xdot * u * u.transpose();
  return out;
}

// The planar form of TsdaForce::pull_back.
void PlanarSprings::add_pull_back(double t, const std::vector<PlanarFrame<double>>& frames, Law::Scratch& scratch,
                                  std::vector<PlanarFrameBar>& bars, Eigen::VectorXd& theta_bar,
                                  Eigen::VectorXd& rho_bar) const {
  for (const Spring& s : springs_) {
    const SpringSpan<Plane> x = span(s, frames);
    const auto moved = [&](std::size_t body, const Plane& at) {
      return frames[body].r_eta + frames[body].turned(frames[body].A * at);
    };
    const Plane d_eta = moved(s.body2, s.s2) - moved(s.body1, s.s1);
    const std::optional<MovedJet<Plane>> bar = s.force->work_bar(t, data_.rho, x, d_eta, scratch, theta_bar, rho_bar);
    if (!bar) continue;
    const auto add = [&](std::size_t body, const Plane& at, double sign, int slot) {
      Plane s_bar;
      add_point_bar(frames[body], at, *bar, sign, bars[body], s_bar);
      if (slot >= 0) theta_bar.segment<3>(slot) += data_.planar->bodies[body].in_body(s_bar);
    };
    add(s.body2, s.s2, 1, s.force->slot2);
    add(s.body1, s.s1, -1, s.force->slot1);
  }
}

}  // namespace mbsopt
