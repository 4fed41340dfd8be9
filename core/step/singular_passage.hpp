// Steps past singular positions, where the constraints' Jacobian J loses rank for an instant (a four-bar lies flat).
//
// At a distance d = t* - t before such a position, rounding e limits how well a state satisfies the constraints: up to
// e/d in the directions that become free. The remaining error obeys d u' + 2 d' u = 0, u' = 2 u/(t* - t). The stages of
// an explicit step past t* magnify it, one after another, by h/(t + c_i h - t*) each. The magnification depends on
// where the stages lie, not on how short the step is. Derivatives lose another factor of about 1/h^3. So the step size
// is chosen to put t* where the tableau magnifies least, at theta = (t* - t)/h, and steps stay long.
//
// The response of the constraint forces to a fixed load (Projector::response) has a pole at t*: its inverse goes
// through zero and changes sign. This gives t*.
//
//   SingularPassage passage(method, constraints);
//   h = passage.propose(t, wanted, most);  // attempt it; then, with the response at its end:
//   if (passage.well_placed(t, h, wanted, most, response)) passage.accept();
//   // otherwise attempt the step that propose() returns now
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>

#include "core/tableau/tableaus.hpp"

namespace mbsopt {

class SingularPassage {
 public:
  // rk must be explicit and outlive this. constraints is the number of entries of a response.
  SingularPassage(const Method& rk, Eigen::Index constraints) : rk_(rk) {
    for (Place* p : {&before_, &last_, &now_, &tried_}) p->response.setZero(constraints);
  }

  void forget();  // what went before
  // wanted is the size for the accuracy. most is the largest size of any step, at least wanted.
  bool well_placed(double t, double h, double wanted, double most, const Eigen::VectorXd& response);
  void accept();
  // A step from t that regards the next singular position. It is at most the wanted size, or a little more.
  double propose(double t, double wanted, double most) const;
  // Returns whether a step from t by h passes a singular position, or is next to a step that does.
  bool near(double t, double h) const;
  // Returns whether a step passed one after t.
  bool passed_since(double t) const { return behind_ >= t; }

  // The best position of t* in a step, 0 to 1.
  double best_theta();
  // The largest acceleration over its stage's distance from t*, over the stages of a step and of one like it after it.
  // u is 1 over the distance at the start. Its derivatives have a further factor of 1 over the distance.
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
  // A theta with locally least magnification, and an upper bound of that next to it.
  struct Passage {
    double theta, magnified;
  };
  struct Choice {
    double h, rounding;
  };
  double uncertain(double theta) const;  // what is magnified at most, next to theta
  Choice choose(double left, double h, double most) const;
  void tabulate();
  // The error of a step whose size is relative to that of its neighbours: accelerations next to t* are off by 1/d^3.
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
