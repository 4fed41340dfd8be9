// Steps past singular positions, where the constraints' Jacobian J loses rank for an instant (a four-bar lies flat).
//
// At a distance d from such a position, t* - t in time, a state has errors e/d in the directions that are about to be
// free, e: rounding. These errors obey d u' + 2 d' u = 0, u' = 2 u/(t* - t). The stages of an explicit step past t*
// magnify them one after another, by h/(t + c_i h - t*) each. The product depends on where the stages lie, not on how
// short the step is. Derivatives lose another 1/h^3 or so. So steps stay long, with sizes that put t* where the tableau
// magnifies least, at theta = (t* - t)/h.
//
// The response of the constraint forces to a fixed load (Projector::response) has a pole at t*. Its inverse goes
// through zero there, which tells t*.
//
//   SingularPassage passage(method, constraints);
//   h = passage.propose(t, wanted, most);  // attempt it; then, with the response at its end:
//   if (passage.well_placed(t, h, wanted, most, response)) passage.accept();
//   // otherwise again, with what propose() says now
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>

#include "core/tableau/tableaus.hpp"

namespace mbsopt {

class SingularPassage {
 public:
  // rk: explicit; outlives this. constraints: entries of a response.
  SingularPassage(const Method& rk, Eigen::Index constraints) : rk_(rk) {
    for (Place* p : {&before_, &last_, &now_, &tried_}) p->response.setZero(constraints);
  }

  void forget();  // what went before
  // wanted: the size that accuracy asks for; most: what no step exceeds, at least that.
  bool well_placed(double t, double h, double wanted, double most, const Eigen::VectorXd& response);
  void accept();
  // A step from t of the wanted size at most, or a little more, with regard to the next singular position.
  double propose(double t, double wanted, double most) const;
  // Whether a step from t by h is one that passes a singular position, or a neighbour of one.
  bool near(double t, double h) const;
  // Whether one was passed after t.
  bool passed_since(double t) const { return behind_ >= t; }

  // Where a step's t* is best, 0 to 1.
  double best_theta();
  // The largest acceleration over its stage's distance from t*, in a step and in an equal one after it. At the start u
  // is 1 over the distance, and its derivatives are another 1 over the distance.
  double magnified(double theta) const;

 private:
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  struct Place {
    double t = 0, inverse = 0;
    Eigen::VectorXd response;
    bool known = false;
  };
  struct Estimate {
    double t = kNone;      // t*
    double reach = kNone;  // from the nearest place that it is made of: the smaller, the better
  };
  Estimate estimate() const;
  // A theta next to which least is magnified, and what is at most.
  struct Passage {
    double theta, magnified;
  };
  struct Choice {
    double h, rounding;
  };
  double uncertain(double theta) const;  // what is magnified at most, next to theta
  Choice choose(double left, double h, double most) const;
  void tabulate();
  // The error that a step leaves, of a size relative to that of its neighbours: accelerations next to t* are off by
  // 1/d^3.
  static double rounding_of(double magnified, double size) { return magnified / (size * size * size); }

  const Method& rk_;
  static constexpr int kMostGood = Method::kMaxStages;
  std::array<Passage, kMostGood> good_{};
  int good_count_ = -1;                // found when first needed
  Place before_, last_, now_, tried_;  // where the last two accepted steps, the one looked at, and one that is
                                       // tried again end
  double most_ = 0;                    // the largest inverse so far
  Estimate found_, ahead_;             // the next t*: by all of them, and before this step
  double behind_ = -kNone;             // the one before
};

}  // namespace mbsopt
