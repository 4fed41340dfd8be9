#include "core/expression/program.hpp"

#include <algorithm>
#include <cassert>

namespace mbsopt {

int Symbols::add_input(const std::string& name) {
  if (input(name) >= 0 || definition(name)) throw std::invalid_argument("the name '" + name + "' is added twice");
  const int index = inputs();
  input_names_.push_back(name);
  index_.emplace(name, index);
  return index;
}

void Symbols::add_definition(const std::string& name, const Expression& expression) {
  if (input(name) >= 0 || definition(name)) throw std::invalid_argument("the name '" + name + "' is added twice");
  definitions_.emplace(name, expression);
}

void Symbols::add_defined_input(const std::string& name, const Expression& expression) {
  add_definition(name, expression);
  input_names_.push_back(name);
}

int Symbols::input(std::string_view name) const {
  const auto it = index_.find(std::string(name));
  return it == index_.end() ? -1 : it->second;
}

const Expression* Symbols::definition(std::string_view name) const {
  const auto it = definitions_.find(std::string(name));
  return it == definitions_.end() ? nullptr : &it->second;
}

std::vector<std::string> Symbols::names() const {
  std::vector<std::string> all = input_names_;
  for (const auto& [name, expression] : definitions_) all.push_back(name);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());  // defined inputs are both
  return all;
}

Program::Scratch Program::scratch() const {
  Scratch scratch;
  grow(scratch);
  return scratch;
}

void Program::grow(Scratch& scratch) const {
  for (std::vector<double>* array : {&scratch.value, &scratch.adjoint, &scratch.tangent, &scratch.adjoint_tangent})
    if (array->size() < code_.size()) array->resize(code_.size());
}

double Program::value_of(const Instruction& in, double a, double b) const {
  if (in.operation != Operation::curve) return apply(in.operation, a, b);
  const auto& [curve, order] = curve_of(in);
  return curve->at(a, order);
}

Partials<double> Program::partials_of(const Instruction& in, double a, double b, double value) const {
  if (in.operation != Operation::curve) return partials(in.operation, a, b, value);
  const auto& [curve, order] = curve_of(in);
  return {curve->at(a, order + 1), 0};
}

Partials<Tangent> Program::partials_of(const Instruction& in, Tangent a, Tangent b, Tangent value) const {
  if (in.operation != Operation::curve) return partials(in.operation, a, b, value);
  const auto& [curve, order] = curve_of(in);
  return {Tangent(curve->at(a.x, order + 1), calculus::seeded(a.dx, curve->at(a.x, order + 2))), Tangent()};
}

void Program::sweep_values(std::span<const double> x, double* value) const {
  const std::size_t size = code_.size();
  for (std::size_t i = 0; i < size; ++i) {
    const Instruction& in = code_[i];
    if (in.operation == Operation::number)
      value[i] = in.constant;
    else if (in.operation == Operation::name)
      value[i] = x[static_cast<std::size_t>(in.a)];
    else
      value[i] = value_of(in, value[in.a], in.b < 0 ? 0 : value[in.b]);
  }
}

double Program::value(std::span<const double> x, Scratch& scratch) const {
  if (code_.empty()) return 0;
  assert(scratch.value.size() >= code_.size());
  sweep_values(x, scratch.value.data());
  return scratch.value[code_.size() - 1];
}

double Program::add_gradient(std::span<const double> x, double scale, std::span<double> gradient,
                             Scratch& scratch) const {
  if (code_.empty()) return 0;
  assert(scratch.value.size() >= code_.size() && gradient.size() == x.size());
  double* const value = scratch.value.data();
  double* const adjoint = scratch.adjoint.data();
  sweep_values(x, value);
  const double result = value[code_.size() - 1];
  std::fill(adjoint, adjoint + code_.size(), 0.0);
  adjoint[code_.size() - 1] = scale;
  for (std::size_t i = code_.size(); i-- > 0;) {
    const Instruction& in = code_[i];
    const double seed = adjoint[i];
    if (seed == 0 || in.operation == Operation::number) continue;
    if (in.operation == Operation::name) {
      gradient[static_cast<std::size_t>(in.a)] += seed;
      continue;
    }
    const Partials<double> d = partials_of(in, value[in.a], in.b < 0 ? 0 : value[in.b], value[i]);
    adjoint[in.a] += seed * d.a;
    if (in.b >= 0) adjoint[in.b] += seed * d.b;
  }
  return result;
}

//   tangent:          v' = f_a a' + f_b b'
//   adjoint:          a_bar += v_bar f_a
//   adjoint tangent:  a_bar' += v_bar' f_a + v_bar f_a'                       (and the same for b)
// f_a' is the derivative of f_a along a' and b': partials() of numbers that carry it.
double Program::add_gradient_tangent(std::span<const double> x, std::span<const double> x_tangent, double scale,
                                     std::span<double> gradient, std::span<double> gradient_tangent,
                                     Scratch& scratch) const {
  if (code_.empty()) return 0;
  assert(scratch.value.size() >= code_.size() && gradient.size() == x.size());
  assert(x_tangent.size() == x.size() && gradient_tangent.size() == x.size());
  using calculus::seeded;
  const std::size_t size = code_.size();
  double* const value = scratch.value.data();
  double* const adjoint = scratch.adjoint.data();
  double* const tangent = scratch.tangent.data();
  double* const adjoint_tangent = scratch.adjoint_tangent.data();
  sweep_values(x, value);
  for (std::size_t i = 0; i < size; ++i) {
    const Instruction& in = code_[i];
    if (in.operation == Operation::number) {
      tangent[i] = 0;
    } else if (in.operation == Operation::name) {
      tangent[i] = x_tangent[static_cast<std::size_t>(in.a)];
    } else {
      const Partials<double> d = partials_of(in, value[in.a], in.b < 0 ? 0 : value[in.b], value[i]);
      tangent[i] = seeded(tangent[in.a], d.a) + (in.b < 0 ? 0 : seeded(tangent[in.b], d.b));
    }
  }
  std::fill(adjoint, adjoint + size, 0.0);
  std::fill(adjoint_tangent, adjoint_tangent + size, 0.0);
  adjoint[size - 1] = scale;
  for (std::size_t i = size; i-- > 0;) {
    const Instruction& in = code_[i];
    const double seed = adjoint[i], seed_tangent = adjoint_tangent[i];
    if ((seed == 0 && seed_tangent == 0) || in.operation == Operation::number) continue;
    if (in.operation == Operation::name) {
      gradient[static_cast<std::size_t>(in.a)] += seed;
      gradient_tangent[static_cast<std::size_t>(in.a)] += seed_tangent;
      continue;
    }
    const auto operand = [&](int k) { return k < 0 ? Tangent() : Tangent(value[k], tangent[k]); };
    const Partials<Tangent> d = partials_of(in, operand(in.a), operand(in.b), Tangent(value[i], tangent[i]));
    adjoint[in.a] += seeded(seed, d.a.x);
    adjoint_tangent[in.a] += seeded(seed_tangent, d.a.x) + seeded(seed, d.a.dx);
    if (in.b < 0) continue;
    adjoint[in.b] += seeded(seed, d.b.x);
    adjoint_tangent[in.b] += seeded(seed_tangent, d.b.x) + seeded(seed, d.b.dx);
  }
  return tangent[size - 1];
}

bool Program::uses(int input) const { return std::binary_search(used_inputs_.begin(), used_inputs_.end(), input); }

}  // namespace mbsopt
