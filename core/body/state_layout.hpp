// Where the numbers of a body stand in the state y = (q, v) of n bodies: q has 7 per body, (r_g, p), and v = qdot.
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
};

}  // namespace mbsopt
