// An Expression compiled against a table of symbols: a straight list of operations. It has a value, an exact gradient
// (reverse sweep) and exact directional derivatives of both (forward over reverse, for second order).
//
//   Symbols symbols;
//   int L = symbols.add_input("L");
//   symbols.add_definition("half", Expression::parse("L/2"));
//   Program program(Expression::parse("half^2"), symbols);
//   Program::Scratch scratch = program.scratch();
//   double x[] = {3.0}, g[] = {0.0};
//   double value = program.add_gradient(x, 1.0, g, scratch);   // 2.25, g[0] = 1.5
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/expression/curve.hpp"
#include "core/expression/expression.hpp"
#include "core/expression/operation.hpp"

namespace mbsopt {

// The names in an expression: inputs (numbered in the order added) and definitions (sub-expressions of them). A name is
// one of both and is added once; otherwise Symbols throws std::invalid_argument.
class Symbols {
 public:
  int add_input(const std::string& name);  // index of the input
  void add_definition(const std::string& name, const Expression& expression);
  // Adds a definition that counts among the inputs, so that the next inputs keep their numbers. No program reads it.
  void add_defined_input(const std::string& name, const Expression& expression);
  int inputs() const { return static_cast<int>(input_names_.size()); }
  const std::vector<std::string>& input_names() const { return input_names_; }
  int input(std::string_view name) const;                     // its index, -1 when there is none
  const Expression* definition(std::string_view name) const;  // nullptr when there is none
  std::vector<std::string> names() const;                     // all of them, sorted

 private:
  struct Meaning {
    int input = -1;
    std::optional<Expression> definition = {};
  };
  void add(const std::string& name, Meaning meaning);
  std::vector<std::string> input_names_;
  std::unordered_map<std::string, Meaning> meanings_;
};

inline constexpr int kDeepestDefinitions = 500;  // definitions within each other: programs are built by recursion

// A name that the table does not hold, or a definition that refers to itself (directly or through others).
class UnknownName : public std::runtime_error {
 public:
  UnknownName(const std::string& what, std::string unknown) : std::runtime_error(what), name(std::move(unknown)) {}
  std::string name;
};

class Program {
 public:
  struct Instruction {
    Operation operation = Operation::number;
    int a = -1, b = -1;   // operands: earlier instructions; of a name: the index of the input
    double constant = 0;  // of a number; of a curve: its place among the curves
  };
  // A derivative of a function through samples.
  struct CurveUse {
    std::shared_ptr<const Curve> curve;
    int order = 0;
    bool operator==(const CurveUse&) const = default;
  };

  // A scratch is sized once and serves every evaluation of one thread. It fits any program that is not larger than its
  // maker.
  struct Scratch {
    std::vector<double> value, adjoint;
    std::vector<Tangent> tangent, adjoint_tangent;  // of values and adjoints
  };

  Program() = default;                                            // the constant 0
  Program(const Expression& expression, const Symbols& symbols);  // throws UnknownName

  Scratch scratch() const;
  void grow(Scratch& scratch) const;  // makes a shared scratch large enough for this program, too

  double value(std::span<const double> x, Scratch& scratch) const;
  // Returns the value; gradient += scale * d value / d x   (gradient: size of x)
  double add_gradient(std::span<const double> x, double scale, std::span<double> gradient, Scratch& scratch) const;
  // Forward over reverse: gradient += scale * g, gradient_tangent += scale * (d g / d x) x_tangent. Returns the tangent
  // of the value.
  double add_gradient_tangent(std::span<const double> x, std::span<const double> x_tangent, double scale,
                              std::span<double> gradient, std::span<double> gradient_tangent, Scratch& scratch) const;

  // Returns the program of d value / d x[input], which can be differentiated again. operation.hpp defines it at kinks.
  Program derivative(int input) const;

  bool is_constant() const { return used_inputs_.empty(); }
  const std::vector<int>& used_inputs() const { return used_inputs_; }  // sorted; structurally present
  bool uses(int input) const;

  // The instructions in the order of evaluation; the last one gives the value. `value` of a scratch has one number
  // each.
  const std::vector<Instruction>& code() const { return code_; }
  const CurveUse& curve_of(const Instruction& in) const { return curves_[static_cast<std::size_t>(in.constant)]; }

 private:
  friend class ProgramBuilder;
  // The sweeps for numbers T: double, or Tangent for the derivatives of all in one direction. inputs(i) is an input;
  // add(i, bar) receives the derivative of scale times the result in it.
  template <class T, class Inputs>
  T sweep(Inputs&& inputs, std::vector<T>& value) const;
  template <class T, class Add>
  void sweep_back(double scale, const std::vector<T>& value, std::vector<T>& adjoint, Add&& add) const;
  std::vector<Instruction> code_;
  std::size_t room_ = 0;  // in a scratch at least: with other branches it has as many instructions
  std::vector<int> used_inputs_;
  std::vector<CurveUse> curves_;
};

}  // namespace mbsopt
