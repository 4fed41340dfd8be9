#include "optim/fit/sums_of_products.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/expression/dimension.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kMostParameters = 10;  // 290 terms: their triples are looked at within a second
// Tolerance of a gradient: derivatives are exact to about 1e-10, and chance agrees to 1e-3 among some hundred terms.
constexpr double kNothing = 1e-6;

struct Term {
  std::string text;
  int degree = 0;
  VectorXd gradient, left;  // times size; what the space leaves of it
  std::optional<Dimension> dimension;
};

struct Sum {
  std::string text;
  double cost = 0;  // terms, then numbers, then degrees; a number stands before a term of low degree
  VectorXd gradient;
};

class ProductSearch {
 public:
  ProductSearch(const MatrixXd& Q, const VectorXd& rho, const VectorXd& size, const std::vector<std::string>& names,
                const std::vector<std::string>& units)
      : Q_(Q), rho_(rho), size_(size), names_(names) {
    for (const std::string& unit : units)
      if (const std::optional<Unit> known = unit.empty() ? std::nullopt : parse_unit(unit))
        dimensions_.push_back(known->dimension);
    all_units_ = static_cast<Index>(dimensions_.size()) == rho.size();
  }

  std::optional<std::vector<std::string>> run() {
    if (rho_.size() > kMostParameters) return std::nullopt;
    find_terms();
    find_sums();
    std::ranges::stable_sort(sums_, {}, &Sum::cost);
    std::vector<std::string> chosen;
    MatrixXd basis(rho_.size(), 0);
    for (const Sum& sum : sums_) {
      const VectorXd unit = sum.gradient.normalized(), rest = unit - basis * (basis.transpose() * unit);
      if (rest.norm() < kDependent) continue;
      basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
      basis.rightCols(1) = rest.normalized();
      chosen.push_back(sum.text);
      if (basis.cols() == Q_.cols()) return chosen;
    }
    return std::nullopt;
  }

 private:
  static constexpr double kDependent = 1e-4;

  void add_term(const std::vector<std::pair<Index, int>>& factors) {
    Term term;
    term.gradient.setZero(rho_.size());
    for (const auto& [k, power] : factors) {
      term.text += (term.text.empty() ? "" : "*") + names_[static_cast<std::size_t>(k)];
      if (power > 1) term.text += fmt::format("^{}", power);
      term.degree += power;
      term.gradient(k) = power * std::pow(rho_(k), power - 1) * size_(k);
      for (const auto& [other, other_power] : factors)
        if (other != k) term.gradient(k) *= std::pow(rho_(other), other_power);
      if (all_units_) {
        const Dimension own = pow(dimensions_[static_cast<std::size_t>(k)], power);
        term.dimension = term.dimension ? *term.dimension * own : own;
      }
    }
    if (!(term.gradient.norm() > 0) || !term.gradient.allFinite()) return;
    term.left = term.gradient - Q_ * (Q_.transpose() * term.gradient);
    terms_.push_back(std::move(term));
  }

  void find_terms() {
    const Index n = rho_.size();
    for (Index k = 0; k < n; ++k) add_term({{k, 1}});
    for (Index k = 0; k < n; ++k)
      for (Index l = 0; l < n; ++l) {
        if (k < l) add_term({{k, 1}, {l, 1}});
        if (k != l) add_term({{k, 1}, {l, 2}});
        if (k == l) add_term({{k, 2}});
      }
  }

  static bool of_one_unit(const Term& a, const Term& b) { return a.dimension == b.dimension; }

  // Takes the sum of these terms if the space leaves nothing of it. has_number: the last factor is neither 1 nor -1.
  void consider(const std::vector<const Term*>& terms, const std::vector<double>& factors, bool has_number) {
    VectorXd left = VectorXd::Zero(rho_.size()), gradient = left;
    double length = 0, degrees = 0;
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < terms.size(); ++i) {
      left += factors[i] * terms[i]->left;
      gradient += factors[i] * terms[i]->gradient;
      length = std::max(length, std::abs(factors[i]) * terms[i]->gradient.norm());
      degrees += terms[i]->degree;
      texts.push_back(terms[i]->text);
    }
    if (left.norm() > kNothing * length || gradient.norm() < kDependent * length) return;
    const double cost =
        100.0 * static_cast<double>(terms.size()) + (has_number ? 50 + terms.back()->degree : 0) + degrees;
    sums_.push_back({sum_in_words(factors, texts), cost, gradient});
  }

  // Adds a last term, with the factor that takes away most of the rest.
  void complete(std::vector<const Term*> terms, std::vector<double> factors, const Term& last) {
    VectorXd rest = VectorXd::Zero(rho_.size());
    for (std::size_t i = 0; i < terms.size(); ++i) rest += factors[i] * terms[i]->left;
    double x = -rest.dot(last.left) / last.left.squaredNorm();
    const bool is_sign = std::abs(std::abs(x) - 1) <= kNothing, with_numbers = rho_.size() - Q_.cols() >= 2;
    if (is_sign ? !of_one_unit(*terms.front(), last) : !with_numbers || x == 0) return;
    terms.push_back(&last);
    factors.push_back(is_sign ? std::copysign(1, x) : x);
    consider(terms, factors, !is_sign);
  }

  void find_sums() {
    std::vector<const Term*> open;  // that alone are not determined
    for (const Term& a : terms_)
      a.left.norm() <= kNothing* a.gradient.norm() ? consider({&a}, {1}, false) : open.push_back(&a);
    if (!all_units_) return;
    for (std::size_t i = 0; i < open.size(); ++i)
      for (std::size_t j = i + 1; j < open.size(); ++j) {
        complete({open[i]}, {1}, *open[j]);
        complete({open[j]}, {1}, *open[i]);
        if (!of_one_unit(*open[i], *open[j])) continue;
        for (std::size_t k = 0; k < open.size(); ++k)
          for (const double sign : {1., -1.})
            if (k != i && k != j) complete({open[i], open[j]}, {1, sign}, *open[k]);
      }
  }

  const MatrixXd& Q_;
  const VectorXd &rho_, &size_;
  const std::vector<std::string>& names_;
  std::vector<Dimension> dimensions_;
  bool all_units_ = false;
  std::vector<Term> terms_;
  std::vector<Sum> sums_;
};

}  // namespace

std::string sum_in_words(const std::vector<double>& factors, const std::vector<std::string>& terms) {
  std::string sum;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (i > 0) sum += factors[i] < 0 ? " - " : " + ";
    if (std::abs(factors[i]) != 1) sum += fmt::format("{:.4g}*", std::abs(factors[i]));
    sum += terms[i];
  }
  return sum;
}

std::optional<std::vector<std::string>> sums_of_products(const MatrixXd& Q, const VectorXd& rho, const VectorXd& size,
                                                         const std::vector<std::string>& names,
                                                         const std::vector<std::string>& units) {
  return ProductSearch(Q, rho, size, names, units).run();
}

}  // namespace mbsopt::inline optim
