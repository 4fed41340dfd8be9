#include "optim/check/user_terms.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
#include "core/expression/curve.hpp"
#include "core/expression/program_switches.hpp"
#include "core/expression/syntax_tree.hpp"
#include "core/force/bound_force.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/simulate/simulation.hpp"
#include "optim/differences/difference_ladder.hpp"
#include "optim/differences/verdict.hpp"
#include "optim/objective/expression_cost.hpp"
#include "optim/objective/sampled_motion.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kStates = 4;         // of the motion, and its start
constexpr int kRungs = 12;         // from a hundredth of the size down to 5e-6 of it
constexpr double kLargest = 1e-2;  // of the size of the moving coordinates
constexpr double kWrong = 1e-6;    // of the derivative: ladders reach 1e-9 and better

// A direction in (q, v) of k bodies, with its name.
struct Direction {
  VectorXd q, v;
  bool of_rates = false;  // v alone
  bool turns = false;     // an angle or its rate; else a length or its rate
  std::string name;       // "x of 'crank'"
};

// The rate of p in a turn about an axis of the body at 1 rad/s.
Vector4d turned(const Vector4d& p, int axis) { return 0.5 * G_transposed_times(p, Vector3d::Unit(axis)); }

// q and v have 7 numbers each for the named bodies.
std::vector<Direction> directions(const VectorXd& q, const VectorXd& v, const std::vector<std::string>& bodies) {
  constexpr const char* kAxes[] = {"x", "y", "z"};
  std::vector<Direction> all;
  const StateLayout layout{static_cast<int>(bodies.size())};
  int number = 0;
  for (const std::string& body : bodies) {
    const Index at = layout.q(++number);
    const Vector4d p = q.segment<4>(at + 3), pdot = v.segment<4>(at + 3);
    for (int axis = 0; axis < 3; ++axis) {
      const VectorXd none = VectorXd::Zero(q.size());
      VectorXd move = none, turn = none, rate_of_turn = none;
      move(at + axis) = 1;
      turn.segment<4>(at + 3) = turned(p, axis);
      rate_of_turn.segment<4>(at + 3) = -turn.segment<4>(at + 3).dot(pdot) * p;
      const std::string place = fmt::format("{} of '{}'", kAxes[axis], body);
      all.push_back({move, none, false, false, place});
      all.push_back({none, move, true, false, "the rate of " + place});
      all.push_back(
          {none, turn, true, true, fmt::format("the angular velocity of '{}' about its {}", body, kAxes[axis])});
      all.push_back({turn, rate_of_turn, false, true, fmt::format("a turn of '{}' about its {}", body, kAxes[axis])});
    }
  }
  return all;
}

class UserTerms {
 public:
  UserTerms(const Scene& scene, const std::vector<Objective>& objectives,
            const std::vector<std::shared_ptr<const UserForce>>& user_forces)
      : scene_(scene),
        objectives_(objectives),
        user_forces_(user_forces),
        rho_(parameter_values(scene)),
        mechanism_(mechanism_at(rho_)) {}

  std::vector<std::string> find(const std::function<bool(double)>& progress) {
    SampledMotion motion;
    motion.times = sample_times(scene_.simulation, kStates);
    motion.times.insert(motion.times.begin(), scene_.simulation.start_time);
    RunOptions options;
    options.progress = progress;
    if (!simulate(mechanism_, scene_.simulation, {}, record_motion(mechanism_, motion), options).ok()) return {};
    length_ = speed_ = 0;
    const Index n = motion.states.rows() / 2;
    for (Index i = 0; i < n; i += 7) {
      length_ = std::max(length_, motion.states.middleRows(i, 3).cwiseAbs().maxCoeff());
      speed_ = std::max(speed_, motion.states.middleRows(n + i, 3).cwiseAbs().maxCoeff());
    }
    if (length_ == 0) length_ = 1;
    if (speed_ == 0) speed_ = length_;  // per second
    for (Index i = 0; i < motion.states.cols(); ++i) {
      const double t = motion.times[static_cast<std::size_t>(i)];
      const VectorXd angles = motion.angles.col(i);
      for (std::size_t f = 0; f < mechanism_.data().user_forces.size(); ++f) check_force(f, t, motion.states.col(i));
      for (const Drive& drive : scene_.drives) check_law(drive, t);
      for (const Objective& o : objectives_)
        if (o.is_written_in_cpp()) check_objective(o, t, motion.states.col(i), angles, i + 1 == motion.states.cols());
    }
    return std::move(wrong_);
  }

 private:
  // Every parameter is active: named forces have derivatives in their parameters.
  Mechanism mechanism_at(const VectorXd& rho) const { return Mechanism(scene_, rho, {}, user_forces_); }

  // Reports the worst wrong entry of a derivative along one direction, once for each `what`.
  void compare(const std::string& what, const std::string& along, double t, double step,
               const std::function<VectorXd(double)>& f, const VectorXd& given) {
    if (std::find(said_.begin(), said_.end(), what) != said_.end()) return;
    const auto at = [&](double h) -> std::optional<VectorXd> {
      VectorXd value = f(h);
      if (!value.allFinite()) return std::nullopt;
      return value;
    };
    const LadderDerivative d = difference_ladder(at, given.size(), {step, kRungs, 0});
    const double entry = std::max(given.cwiseAbs().maxCoeff(), d.derivative.cwiseAbs().maxCoeff());
    for (Index i = 0; i < given.size(); ++i) {
      if (!d.has_estimate(i) || passes(verdict_of(given(i), d.error(i), d.derivative(i), entry, kWrong))) continue;
      said_.push_back(what);
      wrong_.push_back(
          fmt::format("{} is wrong: at t = {:.6g} s, along {}, its entry {} is {:.6g}, differences say {:.6g}", what, t,
                      along, i, given(i), d.derivative(i)));
      return;
    }
  }

  double step_of(const Direction& d) const {
    const double moved = (d.of_rates ? d.v : d.q).cwiseAbs().maxCoeff();
    const double size = d.of_rates ? speed_ : length_;
    return kLargest / moved * (d.turns ? size / length_ : size);
  }

  // A value along the motion, and the names of its derivatives.
  struct Term {
    std::string f_q, f_v, f_rho;
    std::function<VectorXd(const Mechanism& there, const VectorXd& rho, const VectorXd& q, const VectorXd& v)> f;
  };

  void compare_all(const Term& term, double t, const VectorXd& q, const VectorXd& v,
                   const std::vector<std::string>& bodies, const MatrixXd& f_q, const MatrixXd& f_v,
                   const MatrixXd& f_rho) {
    std::vector<std::string> names{term.f_v};
    if (term.f_q != term.f_v) names.push_back(term.f_q);  // after f_v, which turns use, too
    const std::vector<Direction> all = directions(q, v, bodies);
    for (const std::string& name : names)
      for (const Direction& d : all)
        if (name == (d.of_rates ? term.f_v : term.f_q))
          compare(
              name, d.name, t, step_of(d), [&](double h) { return term.f(mechanism_, rho_, q + h * d.q, v + h * d.v); },
              f_q * d.q + f_v * d.v);
    for (std::size_t k = 0; k < scene_.parameters.size(); ++k) {
      const Index column = static_cast<Index>(k);
      compare(
          term.f_rho, "'" + scene_.parameters[k].name + "'", t,
          kLargest * typical_size(scene_.parameters[k], rho_(column)),
          [&](double h) {
            const VectorXd rho = rho_ + h * VectorXd::Unit(rho_.size(), column);
            return term.f(mechanism_at(rho), rho, q, v);
          },
          f_rho.col(column));
    }
  }

  void check_force(std::size_t index, double t, const VectorXd& y) {
    const UserForceData& data = mechanism_.data().user_forces[index];
    const BoundForce& force = *data.force;
    const std::vector<std::string> bodies = force.bodies();
    const StateLayout own{static_cast<int>(bodies.size())}, whole = StateLayout::of(y);
    const Index size = own.positions();
    VectorXd q(size), v(size);
    int number = 0;
    for (const int body : data.bodies) {
      const Index at = own.q(++number);
      q.segment<7>(at) = y.segment<7>(whole.q(body)), v.segment<7>(at) = y.segment<7>(whole.v(body));
    }
    const std::string name = fmt::format("{} (on '{}'): its ", force.name(), fmt::join(bodies, "', '"));
    const auto Q = [&](const Mechanism& there, const VectorXd& rho, const VectorXd& q_at, const VectorXd& v_at) {
      VectorXd value = VectorXd::Zero(size);
      there.data().user_forces[index].force->Q(t, q_at, v_at, rho, value);
      return value;
    };
    MatrixXd K = MatrixXd::Zero(size, size), C = K, Q_rho = MatrixXd::Zero(size, rho_.size());
    force.K(t, q, v, rho_, K);
    force.C(t, q, v, rho_, C);
    force.Q_rho(t, q, v, rho_, Q_rho);
    compare_all({name + "K = -dQ/dq", name + "C = -dQ/dv", name + "Q_rho", Q}, t, q, v, bodies, -K, -C, Q_rho);
    if (force.inertia()) check_inertia(index, name, t, q, v, bodies);
  }

  // The accelerations have the size that moves the body by its length within a second.
  void check_inertia(std::size_t index, const std::string& name, double t, const VectorXd& q, const VectorXd& v,
                     const std::vector<std::string>& bodies) {
    VectorXd z(6);
    z << length_ * Vector3d(1, -0.7, 0.4), Vector3d(0.6, -1, 0.8);
    const auto load_of = [&](const Mechanism& there) -> const InertialLoad& {
      return *there.data().user_forces[index].force->inertia();
    };
    const auto L = [&](const Mechanism& there, const VectorXd& rho, const VectorXd& q_at, const VectorXd& v_at,
                       const VectorXd& z_at) {
      VectorXd value = VectorXd::Zero(6);
      load_of(there).L(q_at, v_at, z_at, rho, value);
      return value;
    };
    const InertialLoad& load = load_of(mechanism_);
    MatrixXd M = MatrixXd::Zero(6, 6), L_q = MatrixXd::Zero(6, 7), L_v = L_q, L_rho = MatrixXd::Zero(6, rho_.size());
    load.M(q, rho_, M);
    load.L_q(q, v, z, rho_, L_q);
    load.L_v(q, v, z, rho_, L_v);
    load.L_rho(q, v, z, rho_, L_rho);
    for (Index k = 0; k < 6; ++k)
      compare(
          name + "M = -dL/dz", fmt::format("acceleration {}", k), t, kLargest * (k < 3 ? length_ : 1),
          [&](double h) { return L(mechanism_, rho_, q, v, z + h * VectorXd::Unit(6, k)); }, -M.col(k));
    const auto at_z = [&](const Mechanism& there, const VectorXd& rho, const VectorXd& q_at, const VectorXd& v_at) {
      return L(there, rho, q_at, v_at, z);
    };
    compare_all({name + "L_q", name + "L_v", name + "L_rho", at_z}, t, q, v, bodies, L_q, L_v, L_rho);
  }

  // Checks the derivatives, up to the third, of functions written in C++ that the law calls. Gradients read these.
  void check_law(const Drive& drive, double t) {
    std::vector<double> inputs(rho_.begin(), rho_.end());
    inputs.push_back(t);
    for (const auto& [use, argument] : sampled_functions_of(Program(drive.law, time_symbols(scene_)))) {
      const Curve& f = *use.curve;
      if (!f.is_routine()) continue;
      Program::Scratch scratch = argument.scratch();
      const double x = argument.value(inputs, scratch);
      for (int order = 1; order <= 3; ++order)
        compare(
            fmt::format("drive '{}': derivative {} of its law's function", drive.name, order), "its argument", t,
            kLargest * std::max(1.0, std::abs(x)),
            [&](double h) { return VectorXd::Constant(1, f.at(x + h, order - 1)); },
            VectorXd::Constant(1, f.at(x, order)));
    }
  }

  void check_objective(const Objective& objective, double t, const VectorXd& y, const VectorXd& angles, bool end) {
    const std::string name = "objective '" + objective.name() + "': its ";
    check_cost(objective, &Cost::running, name + "running", t, y, angles);
    if (end) check_cost(objective, &Cost::terminal, name + "terminal", t, y, angles);
  }

  void check_cost(const Objective& objective, std::shared_ptr<const PointCost> Cost::*part, const std::string& name,
                  double t, const VectorXd& y, const VectorXd& angles) {
    const std::shared_ptr<const PointCost> cost = objective.cost(mechanism_).*part;
    if (!cost) return;
    const Index n = y.size() / 2;
    std::vector<std::string> bodies;
    for (const Body& body : scene_.bodies) bodies.push_back(body.name);
    VectorXd y_bar = VectorXd::Zero(y.size()), rho_bar = VectorXd::Zero(rho_.size());
    cost->add_gradient({t, y, angles}, 1, y_bar, rho_bar);
    const auto f = [&](const Mechanism& there, const VectorXd&, const VectorXd& q, const VectorXd& v) {
      VectorXd y_there(y.size());
      y_there << q, v;
      const auto bound = &there == &mechanism_ ? cost : objective.cost(there).*part;
      return VectorXd::Constant(1, bound->value({t, y_there, angles}));
    };
    const std::string in_y = name + " cost's gradient in y", in_rho = name + " cost's gradient in rho";
    compare_all({in_y, in_y, in_rho, f}, t, y.head(n), y.tail(n), bodies, y_bar.head(n).transpose(),
                y_bar.tail(n).transpose(), rho_bar.transpose());
  }

  const Scene& scene_;
  const std::vector<Objective>& objectives_;
  const std::vector<std::shared_ptr<const UserForce>>& user_forces_;
  VectorXd rho_;
  const Mechanism mechanism_;
  double length_ = 1, speed_ = 1;
  std::vector<std::string> said_, wrong_;
};

}  // namespace

std::vector<std::string> wrong_user_terms(const Scene& scene, const std::vector<Objective>& objectives,
                                          const std::vector<std::shared_ptr<const UserForce>>& user_forces,
                                          const std::function<bool(double t)>& progress) {
  const auto calls_routine = [](const Drive& drive) {
    return std::ranges::any_of(drive.law.tree().nodes,
                               [](const SyntaxNode& n) { return n.curve && n.curve->is_routine(); });
  };
  const auto is_named = [](const Force& force) { return std::holds_alternative<UserForceSpec>(force.kind); };
  if (user_forces.empty() && std::ranges::none_of(objectives, &Objective::is_written_in_cpp) &&
      std::ranges::none_of(scene.forces, is_named) && std::ranges::none_of(scene.drives, calls_routine))
    return {};
  return UserTerms(scene, objectives, user_forces).find(progress);
}

}  // namespace mbsopt::inline optim
