#include "core/expression/program.hpp"

#include <algorithm>
#include <cassert>

namespace mbsopt {

void Symbols::add(const std::string& name, Meaning meaning) {
  if (!meanings_.emplace(name, std::move(meaning)).second)
    throw std::invalid_argument("the name '" + name + "' is added twice");
}

int Symbols::add_input(const std::string& name) {
  add(name, {inputs()});
  input_names_.push_back(name);
  return inputs() - 1;
}

void Symbols::add_definition(const std::string& name, const Expression& expression) { add(name, {-1, expression}); }

void Symbols::add_defined_input(const std::string& name, const Expression& expression) {
  add_definition(name, expression);
  input_names_.push_back(name);
}

int Symbols::input(std::string_view name) const {
  const auto it = meanings_.find(std::string(name));
  return it == meanings_.end() ? -1 : it->second.input;
}

const Expression* Symbols::definition(std::string_view name) const {
  const auto it = meanings_.find(std::string(name));
  return it != meanings_.end() && it->second.definition ? &*it->second.definition : nullptr;
}

std::vector<std::string> Symbols::names() const {
  std::vector<std::string> all;
  for (const auto& [name, meaning] : meanings_) all.push_back(name);
  std::ranges::sort(all);
  return all;
}

Program::Scratch Program::scratch() const {
  Scratch scratch;
  grow(scratch);
  return scratch;
}

void Program::grow(Scratch& scratch) const {
  const auto grow = [&](auto& array) {
    if (const std::size_t room = std::max(room_, code_.size()); array.size() < room) array.resize(room);
  };
  grow(scratch.value);
  grow(scratch.adjoint);
  grow(scratch.tangent);
  grow(scratch.adjoint_tangent);
}

namespace {

double value_of(const Program::CurveUse& f, double a) { return f.curve->at(a, f.order); }
Tangent value_of(const Program::CurveUse& f, const Tangent& a) {
  return Tangent(f.curve->at(a.x, f.order), calculus::seeded(a.dx, f.curve->at(a.x, f.order + 1)));
}
Tangent apply(Operation operation, const Tangent& a, const Tangent& b) { return Tangent::of(operation, a, b); }

}  // namespace

template <class T, class Inputs>
T Program::sweep(Inputs&& inputs, std::vector<T>& value) const {
  assert(value.size() >= code_.size());
  const std::size_t size = code_.size();
  T* const v = value.data();
  for (std::size_t i = 0; i < size; ++i) {
    const Instruction& in = code_[i];
    if (in.operation == Operation::number)
      v[i] = T{in.constant};
    else if (in.operation == Operation::name)
      v[i] = inputs(static_cast<std::size_t>(in.a));
    else if (in.operation == Operation::curve)
      v[i] = value_of(curve_of(in), v[in.a]);
    else
      v[i] = apply(in.operation, v[in.a], in.b < 0 ? T{} : v[in.b]);
  }
  return v[size - 1];
}

//   a_bar += v_bar f_a,  b_bar += v_bar f_b
template <class T, class Add>
void Program::sweep_back(double scale, const std::vector<T>& value, std::vector<T>& adjoint, Add&& add) const {
  using calculus::seeded;
  const T* const v = value.data();
  T* const bar = adjoint.data();
  std::fill(bar, bar + code_.size(), T{});
  bar[code_.size() - 1] = T{scale};
  for (std::size_t i = code_.size(); i-- > 0;) {
    const Instruction& in = code_[i];
    const T seed = bar[i];
    if (seed == T{} || in.operation == Operation::number) continue;
    if (in.operation == Operation::name) {
      add(static_cast<std::size_t>(in.a), seed);
      continue;
    }
    Partials<T> f{T{}, T{}};
    if (in.operation == Operation::curve)
      f.a = value_of({curve_of(in).curve, curve_of(in).order + 1}, v[in.a]);
    else
      f = partials(in.operation, v[in.a], in.b < 0 ? T{} : v[in.b], v[i]);
    bar[in.a] += seeded(seed, f.a);
    if (in.b >= 0) bar[in.b] += seeded(seed, f.b);
  }
}

double Program::value(std::span<const double> x, Scratch& scratch) const {
  return code_.empty() ? 0 : sweep([&](std::size_t i) { return x[i]; }, scratch.value);
}

double Program::add_gradient(std::span<const double> x, double scale, std::span<double> gradient,
                             Scratch& scratch) const {
  assert(gradient.size() == x.size());
  if (code_.empty()) return 0;
  const double result = value(x, scratch);
  sweep_back(scale, scratch.value, scratch.adjoint, [&](std::size_t i, double bar) { gradient[i] += bar; });
  return result;
}

double Program::add_gradient_tangent(std::span<const double> x, std::span<const double> x_tangent, double scale,
                                     std::span<double> gradient, std::span<double> gradient_tangent,
                                     Scratch& scratch) const {
  assert(gradient.size() == x.size() && x_tangent.size() == x.size() && gradient_tangent.size() == x.size());
  if (code_.empty()) return 0;
  const Tangent result = sweep([&](std::size_t i) { return Tangent(x[i], x_tangent[i]); }, scratch.tangent);
  sweep_back(scale, scratch.tangent, scratch.adjoint_tangent, [&](std::size_t i, const Tangent& bar) {
    gradient[i] += bar.x;
    gradient_tangent[i] += bar.dx;
  });
  return result.dx;
}

bool Program::uses(int input) const { return std::binary_search(used_inputs_.begin(), used_inputs_.end(), input); }

}  // namespace mbsopt
