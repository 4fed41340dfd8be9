#include "core/expression/program.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstdint>
#include <tuple>
#include <unordered_set>

#include "core/expression/did_you_mean.hpp"
#include "core/expression/syntax_tree.hpp"

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
  return all;
}

// Turns a tree and the definitions it uses into instructions: equal sub-expressions become one (value numbering),
// constants are folded, and factors that cannot matter (x^0, 0 x) drop out, so that used_inputs() is structural.
class ProgramBuilder {
 public:
  ProgramBuilder(const Symbols& symbols, Program& program) : symbols_(symbols), program_(program) {}

  void build(const Expression& expression) {
    const int result = emit(expression);
    keep_only_what_reaches(result);
  }

 private:
  using Instruction = Program::Instruction;
  static constexpr int kDeepestDefinitions = 500;

  int emit(const Expression& expression) {
    const std::vector<SyntaxNode>& nodes = expression.tree().nodes;
    std::vector<int> at(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const SyntaxNode& node = nodes[i];
      const int a = node.a < 0 ? -1 : at[static_cast<std::size_t>(node.a)];
      const int b = node.b < 0 ? -1 : at[static_cast<std::size_t>(node.b)];
      if (node.operation == Operation::number)
        at[i] = number(node.value);
      else if (node.operation == Operation::name)
        at[i] = name(node.name);
      else
        at[i] = operation(node.operation, a, b);
    }
    return at.back();
  }

  int name(const std::string& name) {
    if (const int input = symbols_.input(name); input >= 0) return add({Operation::name, input, -1, 0});
    const Expression* const definition = symbols_.definition(name);
    if (!definition)
      throw UnknownName("unknown name '" + name + "'" + did_you_mean(name, symbols_.names()) + known_names(), name);
    if (const auto it = done_.find(name); it != done_.end()) return it->second;
    if (!open_.insert(name).second) throw UnknownName("the definition '" + name + "' refers to itself", name);
    if (open_.size() > kDeepestDefinitions)
      throw UnknownName("definitions nest deeper than " + std::to_string(kDeepestDefinitions) + " levels", name);
    const int result = emit(*definition);
    open_.erase(name);
    done_.emplace(name, result);
    return result;
  }

  std::string known_names() const {
    constexpr std::size_t kListed = 12;
    std::vector<std::string> names = symbols_.names();
    if (names.empty()) return "; no names are defined here";
    const bool more = names.size() > kListed;
    if (more) names.resize(kListed);
    return "; known here: " + joined(names) + (more ? ", ..." : "");
  }

  int operation(Operation operation, int a, int b) {
    const bool binary = operands(operation) == 2;
    if (is_number(a) && (!binary || is_number(b)))
      return number(apply(operation, constant(a), binary ? constant(b) : 0));
    switch (operation) {
      case Operation::add:
        if (is(a, 0)) return b;
        if (is(b, 0)) return a;
        break;
      case Operation::subtract:
        if (is(b, 0)) return a;
        break;
      case Operation::multiply:
        if (is(a, 0) || is(b, 1)) return a;
        if (is(b, 0) || is(a, 1)) return b;
        break;
      case Operation::divide:
        if (is(b, 1) || is(a, 0)) return a;
        break;
      case Operation::power:
        if (is(b, 0)) return number(1);
        if (is(b, 1)) return a;
        if (is(b, 2)) return this->operation(Operation::multiply, a, a);
        break;
      default:
        break;
    }
    if ((operation == Operation::add || operation == Operation::multiply) && a > b) std::swap(a, b);
    return add({operation, a, b, 0});
  }

  int number(double value) { return add({Operation::number, -1, -1, value}); }

  int add(const Instruction& instruction) {
    const auto key = std::make_tuple(static_cast<int>(instruction.operation), instruction.a, instruction.b,
                                     std::bit_cast<std::uint64_t>(instruction.constant));
    const auto [it, is_new] = known_.emplace(key, static_cast<int>(code().size()));
    if (is_new) code().push_back(instruction);
    return it->second;
  }

  void keep_only_what_reaches(int result) {
    std::vector<int> moved(code().size(), -1);
    std::vector<char> needed(code().size(), 0);
    needed[static_cast<std::size_t>(result)] = 1;
    for (int i = result; i >= 0; --i) {
      const Instruction& instruction = code()[static_cast<std::size_t>(i)];
      if (!needed[static_cast<std::size_t>(i)] || operands(instruction.operation) == 0) continue;
      needed[static_cast<std::size_t>(instruction.a)] = 1;
      if (instruction.b >= 0) needed[static_cast<std::size_t>(instruction.b)] = 1;
    }
    std::vector<Instruction> kept;
    for (std::size_t i = 0; i <= static_cast<std::size_t>(result); ++i) {
      if (!needed[i]) continue;
      Instruction instruction = code()[i];
      if (operands(instruction.operation) > 0) {
        instruction.a = moved[static_cast<std::size_t>(instruction.a)];
        if (instruction.b >= 0) instruction.b = moved[static_cast<std::size_t>(instruction.b)];
      }
      if (instruction.operation == Operation::name) program_.used_inputs_.push_back(instruction.a);
      moved[i] = static_cast<int>(kept.size());
      kept.push_back(instruction);
    }
    code() = std::move(kept);
    std::sort(program_.used_inputs_.begin(), program_.used_inputs_.end());
  }

  std::vector<Instruction>& code() { return program_.code_; }
  bool is_number(int i) { return code()[static_cast<std::size_t>(i)].operation == Operation::number; }
  double constant(int i) { return code()[static_cast<std::size_t>(i)].constant; }
  bool is(int i, double value) { return is_number(i) && constant(i) == value; }

  struct KeyHash {
    std::size_t operator()(const std::tuple<int, int, int, std::uint64_t>& key) const {
      std::uint64_t h = std::get<3>(key);
      for (const int part : {std::get<0>(key), std::get<1>(key), std::get<2>(key)})
        h = (h ^ static_cast<std::uint64_t>(part + 2)) * 0x9E3779B97F4A7C15ull + (h >> 29);
      return static_cast<std::size_t>(h);
    }
  };

  const Symbols& symbols_;
  Program& program_;
  std::unordered_map<std::tuple<int, int, int, std::uint64_t>, int, KeyHash> known_;
  std::unordered_map<std::string, int> done_;  // definitions, by name
  std::unordered_set<std::string> open_;       // definitions being emitted
};

Program::Program(const Expression& expression, const Symbols& symbols) {
  ProgramBuilder(symbols, *this).build(expression);
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

void Program::sweep_values(std::span<const double> x, double* value) const {
  const std::size_t size = code_.size();
  for (std::size_t i = 0; i < size; ++i) {
    const Instruction& in = code_[i];
    if (in.operation == Operation::number)
      value[i] = in.constant;
    else if (in.operation == Operation::name)
      value[i] = x[static_cast<std::size_t>(in.a)];
    else
      value[i] = apply(in.operation, value[in.a], in.b < 0 ? 0 : value[in.b]);
  }
}

double Program::value(std::span<const double> x, Scratch& scratch) const {
  if (code_.empty()) return 0;
  assert(scratch.value.size() >= code_.size());
  sweep_values(x, scratch.value.data());
  return scratch.value[code_.size() - 1];
}

namespace {
// A zero seed stays zero whatever it is multiplied by: what does not reach the result does not disturb its derivative.
double seeded(double seed, double factor) { return seed == 0 ? 0 : seed * factor; }
}  // namespace

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
    const FirstPartials d = first_partials(in.operation, value[in.a], in.b < 0 ? 0 : value[in.b], value[i]);
    adjoint[in.a] += seed * d.a;
    if (in.b >= 0) adjoint[in.b] += seed * d.b;
  }
  return result;
}

//   tangent:          v' = f_a a' + f_b b'
//   adjoint:          a_bar += v_bar f_a
//   adjoint tangent:  a_bar' += v_bar' f_a + v_bar (f_aa a' + f_ab b')        (and the same for b)
double Program::add_gradient_tangent(std::span<const double> x, std::span<const double> x_tangent, double scale,
                                     std::span<double> gradient, std::span<double> gradient_tangent,
                                     Scratch& scratch) const {
  if (code_.empty()) return 0;
  assert(scratch.value.size() >= code_.size() && gradient.size() == x.size());
  assert(x_tangent.size() == x.size() && gradient_tangent.size() == x.size());
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
      const FirstPartials d = first_partials(in.operation, value[in.a], in.b < 0 ? 0 : value[in.b], value[i]);
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
    const double a = value[in.a], b = in.b < 0 ? 0 : value[in.b];
    const double a_tangent = tangent[in.a], b_tangent = in.b < 0 ? 0 : tangent[in.b];
    const FirstPartials d = first_partials(in.operation, a, b, value[i]);
    const SecondPartials dd = second_partials(in.operation, a, b, value[i]);
    adjoint[in.a] += seeded(seed, d.a);
    adjoint_tangent[in.a] +=
        seeded(seed_tangent, d.a) + seeded(seed, seeded(a_tangent, dd.aa) + seeded(b_tangent, dd.ab));
    if (in.b < 0) continue;
    adjoint[in.b] += seeded(seed, d.b);
    adjoint_tangent[in.b] +=
        seeded(seed_tangent, d.b) + seeded(seed, seeded(a_tangent, dd.ab) + seeded(b_tangent, dd.bb));
  }
  return tangent[size - 1];
}

bool Program::uses(int input) const { return std::binary_search(used_inputs_.begin(), used_inputs_.end(), input); }

}  // namespace mbsopt
