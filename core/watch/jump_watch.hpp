// Laws, components of forces and running costs that jump at an instant which parameters move. Frozen steps do not
// follow the instant, so derivatives omit the jump times its rate: they are wrong, often 0.
//
// A value can jump only where one of its switches goes through zero (program_switches.hpp). Between two states,
// bisection along the Hermite cubic finds the first zero. The states are at least a millionth of the run apart. A jump
// keeps its size at a hundredth of the distance from the zero; a continuous value does not. A later jump of the same
// function is reported if it depends on more: on another parameter, or also on the motion.
//
// Kinks are found in the same way. Steps across a kink give the value to their tolerance. Its derivative is that of the
// branches that the stages took, with an error of the order of the step. Along the cubic, the second difference over d,
// divided by d, is the change of slope for any d; that of a smooth function falls as d. A kink is noted as a jump of
// size 0. So is a spring near zero length that turns by more than 60 degrees in a step. Whether gradients are wrong is
// for others to decide (gradient_doubts.hpp).
//
// Runs with derivatives have this watch.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/expression/program.hpp"
#include "core/force/force_inputs.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/run/cost.hpp"
#include "core/scene/settings.hpp"
#include "core/watch/step_observer.hpp"

namespace mbsopt {

class JumpWatch final : public StepObserver {
 public:
  static constexpr double kApart = 1e-6;  // of the run: times and states have digits for distances within it

  JumpWatch(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
            MotionSource* motion, std::vector<Jump>& found);

  std::string begin(const StatePoint& at) override;
  std::string look_at(const SeenStep& step) override;

 private:
  enum class Inputs { sensors, law, time };  // the inputs beside parameters and t
  struct Switch {
    Program program;
    std::vector<int> parameters;  // active ones that it uses
    bool motion = false;          // it uses the state
    double last = 0, now = 0;     // its last sign other than 0; its present sign
    int searches = 0;
  };
  struct Function {
    Jump jump;  // the known part
    const Program* program;
    Inputs of;
    ForcePlace place;  // of a force with a law
    std::vector<Switch> switches;
    std::vector<int> parameters;         // named by its reported jumps
    bool motion = false;                 // some of them name the motion
    bool bends = false;                  // a kink was reported
    bool is_new(const Switch& s) const;  // names more
  };
  // switches are those of the program.
  void add(const Jump& jump, const Program& program, std::span<const Program> switches, Inputs of,
           ForcePlace place = {});
  void set_inputs(const Function& f, const StatePoint& at);
  void set_inputs_at(double theta, const Function& f);          // between the last state and the present one
  bool search(Function& f, Switch& s, double from, double to);  // whether a jump or kink was reported
  void look_at_directions();                                    // of springs
  double value(const Function& f, const Program& p, double theta);

  const Mechanism mechanism_;
  MotionSource* motion_;
  double apart_;  // [s]
  std::vector<Function> functions_;
  double t0_ = 0, t1_ = 0;
  Eigen::VectorXd y0_, y1_, y_, angles_;
  std::vector<double> inputs_;
  Program::Scratch scratch_;
  std::vector<Jump>& found_;  // of the result
};

}  // namespace mbsopt
