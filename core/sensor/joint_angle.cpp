#include "core/sensor/joint_angle.hpp"

#include <numbers>

namespace mbsopt {

JointAngle::Jet JointAngle::jet(const Frame& f1, const Frame& f2) const {
  Jet j;
  j.x = f1.A * x1, j.y = f1.A * y1, j.n = f2.A * n2;
  j.xd = f1.Adot * x1, j.yd = f1.Adot * y1, j.nd = f2.Adot * n2;
  j.x_eta = f1.A_eta * x1, j.y_eta = f1.A_eta * y1, j.n_eta = f2.A_eta * n2;
  j.C = j.n.dot(j.x), j.S = j.n.dot(j.y);
  j.Cd = j.nd.dot(j.x) + j.n.dot(j.xd), j.Sd = j.nd.dot(j.y) + j.n.dot(j.yd);
  j.C_eta = j.n_eta.dot(j.x) + j.n.dot(j.x_eta), j.S_eta = j.n_eta.dot(j.y) + j.n.dot(j.y_eta);
  j.D = j.C * j.C + j.S * j.S;
  return j;
}

double JointAngle::on_branch(double angle, double reference) {
  constexpr double turn = 2 * std::numbers::pi;
  return angle + turn * std::round((reference - angle) / turn);
}

void JointAngle::pull_back(const Frame& f1, const Frame& f2, const Jet& j, double angle_bar, double rate_bar,
                           double change_bar, FrameBar& bar1, FrameBar& bar2, SlotBars& s) const {
  const double D2 = j.D * j.D, cross = (j.S * j.S - j.C * j.C) / D2, twice = 2 * j.C * j.S / D2;
  // d rate: rate = theta_C Cd + theta_S Sd with theta_C = -S/D, theta_S = C/D
  auto C_of = [&](double Cd, double Sd) { return twice * Cd + cross * Sd; };
  auto S_of = [&](double Cd, double Sd) { return cross * Cd - twice * Sd; };
  const double C_bar = angle_bar * (-j.S / j.D) + rate_bar * C_of(j.Cd, j.Sd) + change_bar * C_of(j.C_eta, j.S_eta);
  const double S_bar = angle_bar * (j.C / j.D) + rate_bar * S_of(j.Cd, j.Sd) + change_bar * S_of(j.C_eta, j.S_eta);
  const double Cd_bar = rate_bar * (-j.S / j.D), Sd_bar = rate_bar * (j.C / j.D);
  const double Ce_bar = change_bar * (-j.S / j.D), Se_bar = change_bar * (j.C / j.D);
  add(f1, x1, C_bar * j.n + Cd_bar * j.nd + Ce_bar * j.n_eta, Cd_bar * j.n, Ce_bar * j.n, bar1, s.x1);
  add(f1, y1, S_bar * j.n + Sd_bar * j.nd + Se_bar * j.n_eta, Sd_bar * j.n, Se_bar * j.n, bar1, s.y1);
  add(f2, n2, C_bar * j.x + Cd_bar * j.xd + Ce_bar * j.x_eta + S_bar * j.y + Sd_bar * j.yd + Se_bar * j.y_eta,
      Cd_bar * j.x + Sd_bar * j.y, Ce_bar * j.x + Se_bar * j.y, bar2, s.n2);
}

void JointAngle::add(const Frame& f, const Vector3d& s, const Vector3d& x, const Vector3d& xd, const Vector3d& x_eta,
                     FrameBar& bar, Vector3d& s_bar) {
  bar.A += x * s.transpose();
  bar.Adot += xd * s.transpose();
  bar.A_eta += x_eta * s.transpose();
  s_bar += f.A.transpose() * x + f.Adot.transpose() * xd + f.A_eta.transpose() * x_eta;
}

}  // namespace mbsopt
