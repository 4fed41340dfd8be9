// Where the numbers of a body stand in the state y = (q, v) of n bodies: q has 7 per body, (r_g, p), and v = qdot.
// Accelerations qddot stand as q does. z = (rddot, omegadot) and virtual displacements have 6 per body.
// Bodies count from 1; the ground, 0, has no numbers.
//
//   const StateLayout layout{data.n};
//   const Vector4d pdot = y.segment<4>(layout.pdot(body));
#pragma once

#include <Eigen/Core>
#include <concepts>

namespace mbsopt {

struct StateLayout {
  int n;

  // The layout of a state, or of the rows of its directions.
  template <class Y>
  static StateLayout of(const Y& y) {
    return {static_cast<int>(y.rows() / 14)};
  }

  Eigen::Index size() const { return 14 * n; }      // of y
  Eigen::Index positions() const { return 7 * n; }  // of q; v begins there
  template <std::integral Body>
  Eigen::Index q(Body body) const {
    return 7 * (static_cast<Eigen::Index>(body) - 1);
  }
  template <std::integral Body>
  Eigen::Index p(Body body) const {
    return q(body) + 3;
  }
  template <std::integral Body>
  Eigen::Index v(Body body) const {
    return positions() + q(body);
  }
  template <std::integral Body>
  Eigen::Index pdot(Body body) const {
    return v(body) + 3;
  }
  template <std::integral Body>
  Eigen::Index z(Body body) const {
    return 6 * (static_cast<Eigen::Index>(body) - 1);
  }
};

}  // namespace mbsopt
