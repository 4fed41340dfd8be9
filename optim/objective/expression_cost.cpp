#include "optim/objective/expression_cost.hpp"

#include <algorithm>

#include "core/expression/program_switches.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/scene_facts.hpp"
#include "core/scene/signals.hpp"

namespace mbsopt::inline optim {

struct CostExpression::Compiled : SwitchedProgram {
  struct UsedSensor {
    int input;  // of the program
    int sensor;
  };
  int inputs = 0;
  int time = 0;                 // input of t
  std::vector<int> parameters;  // used directly
  std::vector<UsedSensor> sensors;
  bool slopes_read_sensors = false;  // whether the derivatives depend on the sensors' values
};

namespace {

// The numbers of one evaluation, one set per thread. They carry nothing from one call to the next.
struct Scratch {
  Program::Scratch program;
  std::vector<double> x, gradient;
  Eigen::VectorXd y_bar, rho_bar;

  void grow(const Program& p, int inputs) {
    const std::size_t n = static_cast<std::size_t>(inputs);
    if (x.size() < n) {
      x.resize(n);
      gradient.resize(n);
    }
    p.grow(program);
  }
};

Scratch& scratch_of_this_thread() {
  static thread_local Scratch scratch;
  return scratch;
}

template <class Compiled>
class ExpressionCost : public PointCost {
 public:
  ExpressionCost(std::shared_ptr<const Compiled> compiled, const Mechanism& mechanism)
      : compiled_(std::move(compiled)), mechanism_(mechanism) {
    const std::vector<int>& active = mechanism.data().active;
    for (const int k : compiled_->parameters)
      if (std::find(active.begin(), active.end(), k) != active.end()) active_.push_back(k);
    reads_motion_ =
        std::ranges::any_of(compiled_->sensors, [&](const auto& used) { return mechanism_.reads_motion(used.sensor); });
  }

  double value(const StatePoint& at) const override {
    Scratch& s = scratch_of_this_thread();
    set_inputs(at, s);
    return compiled_->program.value(inputs(s.x), s.program);
  }

  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const override {
    if (compiled_->slopes_read_sensors && compiled_->sensors.size() == 1 && !reads_motion_)
      return add_gradient_of_one(at, scale, y_bar, rho_bar);
    Scratch& s = scratch_of_this_thread();
    set_inputs(at, s, compiled_->slopes_read_sensors);
    for (const int i : compiled_->program.used_inputs()) s.gradient[index(i)] = 0;
    const double value = compiled_->program.add_gradient(inputs(s.x), scale, inputs(s.gradient), s.program);
    for (const int k : active_) rho_bar(k) += s.gradient[index(k)];
    for (const auto& [input, sensor] : compiled_->sensors) {
      const double weight = s.gradient[index(input)];
      if (weight != 0 || !compiled_->slopes_read_sensors)
        s.x[index(input)] = mechanism_.add_unfolded_gradient(sensor, at, weight, y_bar, rho_bar);
    }
    if (reads_motion_) at.motion->fold_bar(at, y_bar, rho_bar);
    return compiled_->slopes_read_sensors ? value : compiled_->program.value(inputs(s.x), s.program);
  }

  bool reads_positions() const override {
    return std::ranges::all_of(compiled_->sensors, [&](const auto& used) {
      return mechanism_.data().sensors[index(used.sensor)]->reads == Reads::positions;
    });
  }
  const Eigen::VectorXd* rho() const override { return &mechanism_.rho(); }
  const SwitchedProgram* program() const override { return compiled_.get(); }
  std::shared_ptr<const PointCost> bound_to(const Mechanism& mechanism, const Program* program) const override {
    if (!program) return std::make_shared<ExpressionCost>(compiled_, mechanism);
    auto changed = std::make_shared<Compiled>(*compiled_);
    changed->program = *program;
    std::erase_if(changed->parameters, [&](int k) { return !program->uses(k); });
    std::erase_if(changed->sensors, [&](const auto& used) { return !program->uses(used.input); });
    return std::make_shared<ExpressionCost>(std::move(changed), mechanism);
  }

 private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  // A thread's arrays serve any expression. A program gets as many numbers as it has inputs.
  std::span<double> inputs(std::vector<double>& x) const { return {x.data(), index(compiled_->inputs)}; }

  // Evaluates the sensor once, with its gradient, before the slope is known.
  double add_gradient_of_one(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const {
    Scratch& s = scratch_of_this_thread();
    set_inputs(at, s, false);
    const auto& [input, sensor] = compiled_->sensors.front();
    s.y_bar.setZero(y_bar.size());
    s.rho_bar.setZero(rho_bar.size());
    s.x[index(input)] = mechanism_.add_unfolded_gradient(sensor, at, 1, s.y_bar, s.rho_bar);
    for (const int i : compiled_->program.used_inputs()) s.gradient[index(i)] = 0;
    const double value = compiled_->program.add_gradient(inputs(s.x), scale, inputs(s.gradient), s.program);
    for (const int k : active_) rho_bar(k) += s.gradient[index(k)];
    const double weight = s.gradient[index(input)];
    if (weight != 0) y_bar += weight * s.y_bar, rho_bar += weight * s.rho_bar;
    return value;
  }

  void set_inputs(const StatePoint& at, Scratch& s, bool with_sensors = true) const {
    s.grow(compiled_->program, compiled_->inputs);
    for (const int k : compiled_->parameters) s.x[index(k)] = mechanism_.rho()(k);
    s.x[index(compiled_->time)] = at.t;
    for (const auto& [input, sensor] : compiled_->sensors)
      s.x[index(input)] = with_sensors ? mechanism_.sensor_value(sensor, at) : 0;
  }

  std::shared_ptr<const Compiled> compiled_;
  Mechanism mechanism_;      // shares the compiled scene
  std::vector<int> active_;  // parameters used directly with respect to which derivatives are wanted
  bool reads_motion_ = false;
};

}  // namespace

Symbols parameter_symbols(const Scene& scene) {
  Symbols symbols;
  for (const Parameter& p : scene.parameters) symbols.add_input(p.name);
  for (const Definition& d : scene.definitions) symbols.add_definition(d.name, d.value);
  return symbols;
}

Symbols time_symbols(const Scene& scene) {
  Symbols symbols = parameter_symbols(scene);
  symbols.add_input("t");
  add_signals(symbols, scene);
  return symbols;
}

Symbols cost_symbols(const Scene& scene) {
  Symbols symbols = parameter_symbols(scene);
  add_time_and_sensors(symbols, scene);
  add_signals(symbols, scene);
  return symbols;
}

CostExpression::CostExpression(const Expression& expression, const Scene& scene) {
  const Symbols symbols = cost_symbols(scene);
  auto compiled = std::make_shared<Compiled>();
  compiled->program = Program(expression, symbols);
  compiled->switches = switches_of(compiled->program);
  compiled->inputs = symbols.inputs();
  compiled->time = symbols.input("t");
  for (const int i : compiled->program.used_inputs()) {
    if (i < compiled->time) compiled->parameters.push_back(i);
    if (i > compiled->time) compiled->sensors.push_back({i, i - compiled->time - 1});
  }
  const auto is_sensor = [&](int input) { return input > compiled->time; };
  if (!compiled->sensors.empty())
    compiled->slopes_read_sensors = std::ranges::any_of(compiled->program.used_inputs(), [&](int i) {
      return i != compiled->time && std::ranges::any_of(compiled->program.derivative(i).used_inputs(), is_sensor);
    });
  if (compiled->program.is_constant()) {
    Program::Scratch scratch = compiled->program.scratch();
    is_zero_ = compiled->program.value({}, scratch) == 0;
  }
  compiled_ = std::move(compiled);
}

bool CostExpression::is_linear() const {
  const auto varies = [&](int input) { return input != compiled_->time; };
  for (const int i : compiled_->program.used_inputs()) {
    if (!varies(i)) continue;
    const Program slope = compiled_->program.derivative(i);
    if (std::any_of(slope.used_inputs().begin(), slope.used_inputs().end(), varies)) return false;
  }
  return true;
}

SecondOrder CostExpression::second_order(const Mechanism& mechanism, const StatePoint& at, const Eigen::MatrixXd& y_rho,
                                         const std::vector<int>& variables) const {
  const Program& program = compiled_->program;
  const Eigen::Index n = static_cast<Eigen::Index>(variables.size());
  Eigen::VectorXd u = Eigen::VectorXd::Zero(compiled_->inputs);
  Eigen::MatrixXd U = Eigen::MatrixXd::Zero(compiled_->inputs, n);
  u(compiled_->time) = at.t;
  for (const int k : compiled_->parameters) {
    u(k) = mechanism.rho()(k);
    for (Eigen::Index j = 0; j < n; ++j) U(k, j) = variables[static_cast<std::size_t>(j)] == k ? 1 : 0;
  }
  Eigen::VectorXd y_bar(y_rho.rows()), rho_bar(mechanism.rho().size());
  for (const auto& [input, sensor] : compiled_->sensors) {
    y_bar.setZero();
    rho_bar.setZero();
    u(input) = mechanism.add_sensor_gradient(sensor, at, 1, y_bar, rho_bar);
    for (Eigen::Index j = 0; j < n; ++j) {
      const int k = variables[static_cast<std::size_t>(j)];
      U(input, j) = y_bar.dot(y_rho.col(k)) + rho_bar(k);
    }
  }
  Program::Scratch scratch = program.scratch();
  Eigen::VectorXd e_u, e_uj, direction(u.size());
  Eigen::MatrixXd e_uu = Eigen::MatrixXd::Zero(u.size(), u.size());
  SecondOrder result{program.value(numbers_of(u), scratch), Eigen::VectorXd::Zero(n), {}};
  for (const int i : program.used_inputs()) {
    if (i == compiled_->time) continue;
    direction.setZero();
    direction(i) = 1;
    e_u.setZero(u.size());
    e_uj.setZero(u.size());
    program.add_gradient_tangent(numbers_of(u), numbers_of(direction), 1, numbers_of(e_u), numbers_of(e_uj), scratch);
    e_uu.col(i) = e_uj;
    result.first += e_u(i) * U.row(i).transpose();
  }
  result.second = U.transpose() * e_uu * U;
  return result;
}

std::shared_ptr<const PointCost> CostExpression::bind(const Mechanism& mechanism) const {
  return std::make_shared<ExpressionCost<Compiled>>(compiled_, mechanism);
}

}  // namespace mbsopt::inline optim
