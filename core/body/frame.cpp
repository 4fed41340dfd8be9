#include "core/body/frame.hpp"

namespace mbsopt {
namespace {

// B(p, w') entry by entry for each direction w'.
void set_B(const Vector4d& p, const Lanes<4>& w, double scale, Lanes<9>& out) {
  const double e0 = 2 * scale * p(0), e1 = 2 * scale * p(1), e2 = 2 * scale * p(2), e3 = 2 * scale * p(3);
  const auto w0 = w.row(0), w1 = w.row(1), w2 = w.row(2), w3 = w.row(3);
  out.row(0) = e0 * w0 + e1 * w1 - e2 * w2 - e3 * w3;
  out.row(4) = e0 * w0 - e1 * w1 + e2 * w2 - e3 * w3;
  out.row(8) = e0 * w0 - e1 * w1 - e2 * w2 + e3 * w3;
  out.row(1) = e1 * w2 + e2 * w1 - e0 * w3 - e3 * w0;
  out.row(3) = e1 * w2 + e2 * w1 + e0 * w3 + e3 * w0;
  out.row(2) = e1 * w3 + e3 * w1 + e0 * w2 + e2 * w0;
  out.row(6) = e1 * w3 + e3 * w1 - e0 * w2 - e2 * w0;
  out.row(5) = e2 * w3 + e3 * w2 - e0 * w1 - e1 * w0;
  out.row(7) = e2 * w3 + e3 * w2 + e0 * w1 + e1 * w0;
}

}  // namespace

void set_tangent(const BodyState& body, const Lanes<7>& q_dir, const Lanes<7>& v_dir, FrameTangent& out) {
  const Lanes<4> p_dir = q_dir.bottomRows<4>(), pdot_dir = v_dir.bottomRows<4>();
  out.r = q_dir.topRows<3>();
  out.rdot = v_dir.topRows<3>();
  set_B(body.p, p_dir, 1, out.A);
  Lanes<9> other;
  set_B(body.p, pdot_dir, 1, out.Adot);
  set_B(body.pdot, p_dir, 1, other);
  out.Adot += other;
  // pddot' = 1/2 G(p')' omegadot - 2 (pdot'pdot') p - (pdot'pdot) p'
  const Vector3d& w = body.omegadot;
  Lanes<4>& pddot_dir = out.pddot;
  pddot_dir.row(0) = -0.5 * (w(0) * p_dir.row(1) + w(1) * p_dir.row(2) + w(2) * p_dir.row(3));
  pddot_dir.row(1) = 0.5 * (w(0) * p_dir.row(0) + w(2) * p_dir.row(2) - w(1) * p_dir.row(3));
  pddot_dir.row(2) = 0.5 * (w(1) * p_dir.row(0) + w(0) * p_dir.row(3) - w(2) * p_dir.row(1));
  pddot_dir.row(3) = 0.5 * (w(2) * p_dir.row(0) + w(1) * p_dir.row(1) - w(0) * p_dir.row(2));
  const Lanes<1> spin = 2 * (body.pdot(0) * pdot_dir.row(0) + body.pdot(1) * pdot_dir.row(1) +
                             body.pdot(2) * pdot_dir.row(2) + body.pdot(3) * pdot_dir.row(3));
  for (int i = 0; i < 4; ++i) pddot_dir.row(i) -= body.p(i) * spin + body.pdot.squaredNorm() * p_dir.row(i);
  // Addot' = B(p, pddot') + B(p', pddot) + 2 B(pdot, pdot')
  set_B(body.p, pddot_dir, 1, out.Addot);
  set_B(body.pddot(), p_dir, 1, other);
  out.Addot += other;
  set_B(body.pdot, pdot_dir, 2, other);
  out.Addot += other;
  out.p = p_dir, out.pdot = pdot_dir;
}

}  // namespace mbsopt
