// Compiles expressions, and derivatives and parts of programs, into instructions.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>

#include "core/expression/branching.hpp"
#include "core/expression/did_you_mean.hpp"
#include "core/expression/program.hpp"
#include "core/expression/syntax_tree.hpp"

namespace mbsopt {

// Turns a tree and its definitions into instructions. Equal sub-expressions become one (value numbering), and constants
// are folded. Factors without effect (x^0, 0 x) disappear, so that used_inputs() is structural.
class ProgramBuilder {
 public:
  ProgramBuilder(const Symbols& symbols, Program& program) : symbols_(symbols), program_(program) {}

  void build(const Expression& expression) {
    const int result = emit(expression);
    keep_only_what_reaches(result);
  }

  // The derivative of another program in one of its inputs, by the chain rule applied to each instruction.
  void build_derivative(const Program& of, int input);

  // The value of an instruction of another program, or what `how` makes of it and of a second one: its cosine (cos),
  // its reciprocal (divide), its negative (negate), their difference (subtract), or its distance from a number
  // (number).
  void build_part(const Program& of, int a, Operation how = Operation::name, int b = -1, double from = 0);

  // Another program with branches held (branches.hpp).
  void build_with_branches(const Program& of, std::span<const Branching> branchings, std::span<const int> sides);

 private:
  using Instruction = Program::Instruction;

  int emit(const Expression& expression) {
    const std::vector<SyntaxNode>& nodes = expression.tree().nodes;
    std::vector<int> at(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const SyntaxNode& node = nodes[i];
      const int a = node.a < 0 ? -1 : at[static_cast<std::size_t>(node.a)];
      const int b = node.b < 0 ? -1 : at[static_cast<std::size_t>(node.b)];
      if (node.operation == Operation::curve)
        at[i] = curve({node.curve, 0}, a);
      else if (node.operation == Operation::number)
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
    if (!open_.insert(name).second) throw UnknownName("'" + name + "' refers to itself", name);
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

  // A derivative of a function through samples, at a.
  int curve(const Program::CurveUse& use, int a) {
    if (use.order > use.curve->degree()) return number(0);
    if (is_number(a)) return number(use.curve->at(constant(a), use.order));
    std::vector<Program::CurveUse>& all = program_.curves_;
    const auto place = std::find(all.begin(), all.end(), use) - all.begin();
    if (place == static_cast<std::ptrdiff_t>(all.size())) all.push_back(use);
    return add({Operation::curve, a, -1, static_cast<double>(place)});
  }

  // Copies an instruction of another program; a and b are its operands in this program.
  int copied(const Program& of, const Instruction& in, int a, int b) {
    if (in.operation == Operation::number) return number(in.constant);
    if (in.operation == Operation::name) return add({Operation::name, in.a, -1, 0});
    return in.operation == Operation::curve ? curve(of.curve_of(in), a) : operation(in.operation, a, b);
  }

  int number(double value) { return add({Operation::number, -1, -1, value}); }

  // An instruction of this builder as a number of partials().
  struct Term : Arithmetic<Term> {
    ProgramBuilder* builder;
    int at;

    Term(ProgramBuilder* of, int instruction) : builder(of), at(instruction) {}
    static Term of(Operation operation, const Term& a, const Term& b) {
      return {a.builder, a.builder->operation(operation, a.at, operands(operation) == 2 ? b.at : -1)};
    }
    Term beside(double x) const { return {builder, builder->number(x)}; }
    friend Term constant(double x, const Term& like) { return like.beside(x); }
    friend Term product(const Term& a, const Term& b) { return a * b; }
    friend Term quotient(const Term& a, const Term& b) { return a / b; }
  };

  // Its number; that of an equal instruction if there is one. A table of numbers with open addressing, at most half
  // full.
  int add(const Instruction& instruction) {
    if (2 * code().size() >= known_.size()) {
      known_.assign(std::max<std::size_t>(64, 4 * code().size()), -1);
      for (std::size_t i = 0; i < code().size(); ++i) place_of(code()[i]) = static_cast<int>(i);
    }
    int& known = place_of(instruction);
    if (known < 0) {
      known = static_cast<int>(code().size());
      code().push_back(instruction);
    }
    return known;
  }

  int& place_of(const Instruction& in) {
    const std::uint64_t bits = std::bit_cast<std::uint64_t>(in.constant);
    std::uint64_t h = bits;
    for (const int part : {static_cast<int>(in.operation), in.a, in.b})
      h = (h ^ static_cast<std::uint64_t>(part + 2)) * 0x9E3779B97F4A7C15ull + (h >> 29);
    const auto is_same = [&](const Instruction& other) {
      return other.operation == in.operation && other.a == in.a && other.b == in.b &&
             std::bit_cast<std::uint64_t>(other.constant) == bits;
    };
    for (std::size_t k = h % known_.size();; k = (k + 1) % known_.size())
      if (known_[k] < 0 || is_same(code()[static_cast<std::size_t>(known_[k])])) return known_[k];
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
  // -(a - b) is b - a, and -(-a) is a.
  int negative(int i) {
    const Instruction in = code()[static_cast<std::size_t>(i)];
    if (in.operation == Operation::negate) return in.a;
    if (in.operation == Operation::subtract) return operation(Operation::subtract, in.b, in.a);
    return operation(Operation::negate, i, -1);
  }
  int quotient_without(int a, int b);
  int piece(const Program::CurveUse& use, int argument, std::span<const Branching> samples, std::span<const int> sides);
  bool is(int i, double value) { return is_number(i) && constant(i) == value; }

  const Symbols& symbols_;
  Program& program_;
  std::vector<int> known_;                     // numbers of instructions, by their hash; -1: free
  std::unordered_map<std::string, int> done_;  // definitions, by name
  std::unordered_set<std::string> open_;       // definitions being emitted
};

}  // namespace mbsopt
