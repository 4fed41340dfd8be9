#include "core/constraint/angle.hpp"

#include <cmath>
#include <numbers>

namespace mbsopt {

double Angle::on_branch(double angle, double reference) {
  constexpr double turn = 2 * std::numbers::pi;
  return angle + turn * std::round((reference - angle) / turn);
}

void Angle::phi(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  Vec<1> C, S;
  cosine().phi(f1, f2, C), sine().phi(f1, f2, S);
  out(0) = std::atan2(S(0), C(0));
}

void Angle::phi_dot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  Vec<1> C, S, Cd, Sd;
  cosine().phi(f1, f2, C), sine().phi(f1, f2, S), cosine().phi_dot(f1, f2, Cd), sine().phi_dot(f1, f2, Sd);
  out(0) = (C(0) * Sd(0) - S(0) * Cd(0)) / (C(0) * C(0) + S(0) * S(0));
}

void Angle::phi_ddot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  const Jet j = jet(f1, f2);
  out(0) = (j.C * j.Sdd - j.S * j.Cdd) / j.D - 2 * j.E * j.N / (j.D * j.D);
}

void Angle::jacobian(const Frame& f1, const Frame& f2, Mat<1, 6>& J1, Mat<1, 6>& J2) const {
  Vec<1> C, S;
  cosine().phi(f1, f2, C), sine().phi(f1, f2, S);
  const double D = C(0) * C(0) + S(0) * S(0);
  Mat<1, 6> JC1, JC2;
  cosine().jacobian(f1, f2, JC1, JC2);
  sine().jacobian(f1, f2, J1, J2);
  J1 = (C(0) * J1 - S(0) * JC1) / D;
  J2 = (C(0) * J2 - S(0) * JC2) / D;
}

void Angle::pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                      GeometryBar& s) const {
  const Jet j = jet(f1, f2);
  const double lambda = z.lambda(0), mu0 = z.mu0(0), mu1 = z.mu1(0), mu2 = z.mu2(0), D = j.D, D2 = D * D;
  Multipliers<1> C, S;  // of the two dot-1
  C.lambda(0) = -lambda * j.S / D, S.lambda(0) = lambda * j.C / D;
  C.mu2(0) = -mu2 * j.S / D, S.mu2(0) = mu2 * j.C / D;
  C.mu1(0) = -mu1 * j.S / D - 2 * mu2 * (j.C * j.N - j.S * j.E) / D2;
  S.mu1(0) = mu1 * j.C / D - 2 * mu2 * (j.S * j.N + j.C * j.E) / D2;
  // Derivatives of (C S_x - S C_x)/D for x = eta, dot, ddot, of atan2, and of the last term of Phiddot, in C and in S.
  auto by_C = [&](double C_x, double S_x) { return S_x / D - 2 * j.C * (j.C * S_x - j.S * C_x) / D2; };
  auto by_S = [&](double C_x, double S_x) { return -C_x / D - 2 * j.S * (j.C * S_x - j.S * C_x) / D2; };
  const double EN = 8 * j.E * j.N / (D2 * D);
  C.mu0(0) = -mu0 * j.S / D + lambda * by_C(j.Ce, j.Se) + mu1 * by_C(j.Cd, j.Sd) +
             mu2 * (by_C(j.Cdd, j.Sdd) - 2 * (j.Cd * j.N + j.E * j.Sd) / D2 + j.C * EN);
  S.mu0(0) = mu0 * j.C / D + lambda * by_S(j.Ce, j.Se) + mu1 * by_S(j.Cd, j.Sd) +
             mu2 * (by_S(j.Cdd, j.Sdd) - 2 * (j.Sd * j.N - j.E * j.Cd) / D2 + j.S * EN);
  cosine().pull_back(f1, f2, C, bar1, bar2, s);
  GeometryBar of_sine;
  sine().pull_back(f1, f2, S, bar1, bar2, of_sine);
  s.s3 += of_sine.s1;
  s.s2 += of_sine.s2;
}

void Angle::tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
                    const GeometryTangent& s, const Vec<1>& lambda, PrimitiveTangent<1>& out) const {
  const Jet j = jet(f1, f2);
  const double D = j.D, wC = -lambda(0) * j.S / D, wS = lambda(0) * j.C / D;
  PrimitiveTangent<1> C, S;
  cosine().tangent(f1, f2, t1, t2, {s.s1, s.s2, nullptr}, Vec<1>(wC), C);
  sine().tangent(f1, f2, t1, t2, {s.s3, s.s2, nullptr}, Vec<1>(wS), S);
  const Lanes<1> dD = 2 * (j.C * C.phi + j.S * S.phi);
  out.phi = (j.C * S.phi - j.S * C.phi) / D;
  const double rate = j.N / D, M = j.C * j.Sdd - j.S * j.Cdd;
  const Lanes<1> dN = j.Sd * C.phi + j.C * S.phi_dot - j.Cd * S.phi - j.S * C.phi_dot;
  const Lanes<1> dE = j.Cd * C.phi + j.C * C.phi_dot + j.Sd * S.phi + j.S * S.phi_dot;
  const Lanes<1> dM = j.Sdd * C.phi + j.C * S.phi_ddot - j.Cdd * S.phi - j.S * C.phi_ddot;
  out.phi_dot = (dN - rate * dD) / D;
  out.phi_ddot = (dM - (M / D) * dD) / D - 2 * (dE * j.N + j.E * dN) / (D * D) + (4 * j.E * j.N / (D * D * D)) * dD;
  // (J'lambda)' = J_C' wC' + J_S' wS' + the loads' own tangents at fixed weights
  const Lanes<1> dwC = -(lambda(0) * S.phi + wC * dD) / D, dwS = (lambda(0) * C.phi - wS * dD) / D;
  Mat<1, 6> JC1, JC2, JS1, JS2;
  cosine().jacobian(f1, f2, JC1, JC2);
  sine().jacobian(f1, f2, JS1, JS2);
  out.load1 = C.load1 + S.load1 + JC1.transpose() * dwC + JS1.transpose() * dwS;
  out.load2 = C.load2 + S.load2 + JC2.transpose() * dwC + JS2.transpose() * dwS;
}

Angle::Jet Angle::jet(const Frame& f1, const Frame& f2) const {
  auto values = [&](const Dot1& p, double& x, double& xd, double& xdd, double& xe) {
    Vec<1> v;
    p.phi(f1, f2, v), x = v(0);
    p.phi_dot(f1, f2, v), xd = v(0);
    p.phi_ddot(f1, f2, v), xdd = v(0);
    xe = p.change(f1, f2);
  };
  Jet j;
  values(cosine(), j.C, j.Cd, j.Cdd, j.Ce);
  values(sine(), j.S, j.Sd, j.Sdd, j.Se);
  j.D = j.C * j.C + j.S * j.S;
  j.N = j.C * j.Sd - j.S * j.Cd;
  j.E = j.C * j.Cd + j.S * j.Sd;
  return j;
}

}  // namespace mbsopt
