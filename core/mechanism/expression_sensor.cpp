// An expression e of parameters, t and other sensors s as a sensor.
//   e_y = sum_k e_sk s_k,y               e_rho = e_rho + sum_k e_sk s_k,rho
//   edot = sum_k e_sk sdot_k  if the s_k are of positions and e does not contain t: the tangent of e along sdot, whose
//   derivatives are those of e_s sdot in s and rho, and e_s in sdot
// An expression of expressions is compiled into one, so that all s_k are sensors of other quantities.
#include <algorithm>

#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/program_sensors.hpp"
#include "core/mechanism/sensor_gradient.hpp"
#include "core/mechanism/sensor_kinds.hpp"
#include "core/scene/scene_facts.hpp"

namespace mbsopt {
namespace {

// The numbers of one evaluation, one set per thread. They carry nothing from one call to the next, and grow at the
// first call only.
struct Scratch {
  Program::Scratch program;
  std::vector<double> x, xdot, x_bar, xdot_bar;  // inputs, their rates, and gradients in both

  Scratch& grown(const Program& p, std::size_t inputs) {
    for (std::vector<double>* numbers : {&x, &xdot, &x_bar, &xdot_bar})
      if (numbers->size() < inputs) numbers->resize(inputs);
    p.grow(program);
    return *this;
  }
};

Scratch& scratch_of_this_thread() {
  static thread_local Scratch scratch;
  return scratch;
}

struct ExpressionSensor final : SensorFunction {
  struct Below {
    std::size_t input;
    SensorPtr sensor, rate;  // no rate where the expression has none
  };
  Program program;
  std::size_t inputs = 0, time = 0;
  std::vector<std::size_t> parameters;  // used by the expression itself
  std::vector<Below> below;
  bool is_rate = false;

  double evaluate(const MechanismData& d, const StatePoint& at, SensorGradient* to) const override {
    Scratch& s = scratch_of_this_thread().grown(program, inputs);
    for (std::vector<double>* numbers : {&s.xdot, &s.x_bar, &s.xdot_bar}) std::fill_n(numbers->begin(), inputs, 0.0);
    for (const std::size_t k : parameters) s.x[k] = d.rho(static_cast<Eigen::Index>(k));
    s.x[time] = at.t;
    for (const Below& b : below) {
      s.x[b.input] = b.sensor->evaluate(d, at, nullptr);
      if (is_rate) s.xdot[b.input] = b.rate->evaluate(d, at, nullptr);
    }
    if (!to && !is_rate) return program.value(span(s.x), s.program);
    const double result =
        is_rate ? program.add_gradient_tangent(span(s.x), span(s.xdot), 1, span(s.xdot_bar), span(s.x_bar), s.program)
                : program.add_gradient(span(s.x), 1, span(s.x_bar), s.program);
    if (!to) return result;
    for (const int k : d.active) to->rho_bar(k) += to->scale * s.x_bar[static_cast<std::size_t>(k)];
    if (to->t_bar) *to->t_bar += to->scale * s.x_bar[time];
    const auto add = [&](const SensorPtr& sensor, double weight) {
      SensorGradient part{d, to->scale * weight, to->y_bar, to->rho_bar, to->t_bar};
      if (part.scale != 0) sensor->evaluate(d, at, &part);
    };
    for (const auto& [input, sensor, rate] : below) {
      add(sensor, s.x_bar[input]);
      if (is_rate) add(rate, s.xdot_bar[input]);
    }
    return result;
  }

  std::vector<int> bodies(const MechanismData& d) const override {
    std::vector<int> all{0};
    for (const Below& b : below) {
      const std::vector<int> read = b.sensor->bodies(d);
      if (read.empty()) return {};  // all of them
      all.insert(all.end(), read.begin(), read.end());
    }
    return all;
  }

  SensorPtr rate(const MechanismData& d) const override {
    if (reads != Reads::positions) return nullptr;
    return changed(*this, [&](ExpressionSensor& r) {
      r.is_rate = true;
      for (Below& b : r.below) b.rate = b.sensor->rate(d);
    });
  }

 private:
  std::span<double> span(std::vector<double>& x) const { return {x.data(), inputs}; }
};

std::unique_ptr<ExpressionSensor> sensor_of(Program program, std::size_t parameters, std::span<const SensorPtr> sensors,
                                            std::size_t inputs) {
  auto out = std::make_unique<ExpressionSensor>();
  out->program = std::move(program);
  out->inputs = inputs;
  out->time = parameters;
  for (const int i : out->program.used_inputs()) {
    const std::size_t input = static_cast<std::size_t>(i);
    if (input < out->time)
      out->parameters.push_back(input);
    else if (input > out->time)
      out->below.push_back({input, sensors[input - out->time - 1], nullptr});
    else
      out->reads = Reads::time_and_state;
  }
  for (const ExpressionSensor::Below& b : out->below) out->reads = std::max(out->reads, b.sensor->reads);
  // A condition's equation must be linear in the velocities; an expression of them may not be.
  if (out->reads == Reads::velocities) out->reads = Reads::state;
  return out;
}

}  // namespace

std::unique_ptr<SensorFunction> make_expression(Compilation& model, const Sensor& s, const std::string& where) {
  Symbols symbols = model.fields.symbols();
  add_time_and_sensors(symbols, model.scene);
  Program program;
  try {
    program = Program(s.value, symbols);
  } catch (const UnknownName& e) {
    throw SceneError(where + ".value: " + e.what());
  }
  return sensor_of(std::move(program), static_cast<std::size_t>(symbols.input("t")), model.data.sensors,
                   static_cast<std::size_t>(symbols.inputs()));
}

SensorPtr expression_sensor(const MechanismData& data, Program program) {
  const std::size_t parameters = static_cast<std::size_t>(data.rho.size());
  return sensor_of(std::move(program), parameters, data.sensors, parameters + 1 + data.sensors.size());
}

}  // namespace mbsopt
