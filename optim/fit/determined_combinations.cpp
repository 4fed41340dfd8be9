#include "optim/fit/determined_combinations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>

#include "core/expression/did_you_mean.hpp"
#include "core/expression/dimension.hpp"
#include "core/linear/dense.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kPart = 1e-4;  // parts smaller than this are zero, and ratios this near are equal

bool is_near(double a, double b) { return std::abs(a - b) <= kPart * std::max({1.0, std::abs(a), std::abs(b)}); }

// Orthogonal projector onto the directions.
MatrixXd projector(const MatrixXd& null_space) {
  const MatrixXd Q = orthogonal_factor(null_space, null_space.cols());
  return Q * Q.transpose();
}

// Rows spanning the same space, each with a 1 (its pivot) where the others have 0, as early as possible.
MatrixXd reduced_rows(MatrixXd rows, std::vector<Index>& pivots) {
  for (Index k = 0; k < rows.cols() && static_cast<Index>(pivots.size()) < rows.rows(); ++k) {
    const Index next = static_cast<Index>(pivots.size()), left = rows.rows() - next;
    Index pivot = 0;
    const double largest = rows.col(k).tail(left).cwiseAbs().maxCoeff(&pivot);
    if (largest <= kPart * rows.bottomRows(left).cwiseAbs().maxCoeff()) continue;
    rows.row(next).swap(rows.row(next + pivot));
    rows.row(next) /= rows(next, k);
    for (Index i = 0; i < rows.rows(); ++i)
      if (i != next) rows.row(i) -= rows(i, k) * rows.row(next);
    pivots.push_back(k);
  }
  return rows.unaryExpr([](double x) { return std::abs(x) < kPart ? 0.0 : x; });
}

// "m1 - 0.04*m2" of terms and their factors; the first factor is positive.
std::string sum_in_words(const std::vector<double>& factors, const std::vector<std::string>& terms) {
  std::string sum;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (i > 0) sum += factors[i] < 0 ? " - " : " + ";
    if (std::abs(factors[i]) != 1) sum += fmt::format("{:.4g}*", std::abs(factors[i]));
    sum += terms[i];
  }
  return sum;
}

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

// Combinations of parameters that are sums of products, such as the base parameters of a mechanism:
//
//   I1 + m1*a1^2 + 0.04*m2,   m1*a1 + 0.2*m2,   I2 + m2*a2^2,   m2*a2
//
// Given is the space of their gradients at one point. A sum of terms belongs to it if its gradient leaves nothing
// orthogonal to the space. Terms are p, p^2, p q, p^2 q. Their coefficients are 1 or -1 between terms of one unit. The
// last one may be any number if the space leaves out at least two directions: a chance match would need two numbers to
// agree. Sums need the units of all parameters. They are searched in order of their length, until their gradients span
// the space.
class ProductSearch {
 public:
  // Q: orthonormal columns, the gradients times size, a row per parameter. units: "" where not known.
  ProductSearch(const MatrixXd& Q, const VectorXd& rho, const VectorXd& size, const std::vector<std::string>& names,
                const std::vector<std::string>& units)
      : Q_(Q), rho_(rho), size_(size), names_(names) {
    for (const std::string& unit : units)
      if (const std::optional<Unit> known = unit.empty() ? std::nullopt : parse_unit(unit))
        dimensions_.push_back(known->dimension);
    all_units_ = static_cast<Index>(dimensions_.size()) == rho.size();
  }

  // nullopt: no such sums span the space.
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

class Group {
 public:
  Group(const std::vector<Index>& members, const MatrixXd& P, const VectorXd& rho, const VectorXd& size,
        const std::vector<std::string>& names, const std::vector<std::string>& units)
      : rho_(rho(members)), size_(size(members)) {
    for (const Index k : members) {
      names_.push_back(names[static_cast<std::size_t>(k)]);
      units_.push_back(units.empty() ? "" : units[static_cast<std::size_t>(k)]);
    }
    // A projector's singular values are 1 and 0.
    const LeftSingular svd = left_singular(P(members, members));
    Q_ = svd.U.rightCols((svd.values.array() <= 0.5).count());
    rows_ = reduced_rows(Q_.transpose(), pivots_);
  }

  std::string in_words() const {
    if (rows_.rows() == 0)
      return fmt::format("{}: {} not influence what is measured", joined(names_), names_.size() == 1 ? "does" : "do");
    std::optional<std::vector<std::string>> terms = in_sums();
    if (!terms) terms = in_products();
    if (!terms) terms = ProductSearch(Q_, rho_, size_, names_, units_).run();
    if (!terms) terms = linear_terms();
    std::string list = terms->front();
    for (std::size_t i = 1; i < terms->size(); ++i) list += (i + 1 == terms->size() ? " and " : ", ") + (*terms)[i];
    return fmt::format("{}: only {} {} determined", joined(names_), list, terms->size() == 1 ? "is" : "are");
  }

 private:
  // rows_ with each parameter in the given unit instead of its size; pivots stay 1.
  std::vector<VectorXd> rows_in(const VectorXd& unit_over_size) const {
    std::vector<VectorXd> rows;
    for (const Index pivot : pivots_)
      rows.push_back(rows_.row(std::ssize(rows)).transpose().cwiseProduct(unit_over_size) / unit_over_size(pivot));
    return rows;
  }
  std::vector<VectorXd> absolute_rows() const { return rows_in(size_.cwiseInverse()); }       // in changes d rho
  std::vector<VectorXd> relative_rows() const { return rows_in(rho_.cwiseQuotient(size_)); }  // in d rho/rho

  std::optional<std::vector<std::string>> in_sums() const {
    for (const VectorXd& row : absolute_rows()) {
      std::set<std::string> units{""};  // of a sum: one, or unknown
      for (Index k = 0; k < row.size(); ++k) {
        if (row(k) == 0) continue;
        units.insert(units_[static_cast<std::size_t>(k)]);
        if (!is_near(std::abs(row(k)), 1) || units.size() > 2) return std::nullopt;
      }
    }
    return linear_terms();
  }

  std::optional<std::vector<std::string>> in_products() const {
    if ((rho_.array() == 0).any()) return std::nullopt;
    constexpr double kDenominators[] = {1, 2, 3};
    std::vector<std::string> terms;
    for (const VectorXd& exponents : relative_rows()) {
      const auto* const d = std::ranges::find_if(kDenominators, [&](double factor) {
        const VectorXd scaled = factor * exponents;
        return std::all_of(scaled.begin(), scaled.end(),
                           [](double x) { return is_near(x, std::round(x)) && std::abs(x) < 6.5; });
      });
      if (d == std::end(kDenominators)) return std::nullopt;
      terms.push_back(product(*d * exponents));
    }
    return terms;
  }

  std::string product(const VectorXd& exponents) const {
    std::string above, below;
    int factors_below = 0;
    for (Index k = 0; k < exponents.size(); ++k) {
      const long e = std::lround(exponents(k));
      if (e == 0) continue;
      std::string& part = e > 0 ? above : below;
      if (!part.empty()) part += '*';
      part += names_[static_cast<std::size_t>(k)];
      if (std::abs(e) > 1) part += fmt::format("^{}", std::abs(e));
      factors_below += e < 0;
    }
    if (below.empty()) return above;
    return above + (factors_below > 1 ? "/(" + below + ")" : "/" + below);
  }

  std::vector<std::string> linear_terms() const {
    std::vector<std::string> terms;
    for (const VectorXd& row : absolute_rows()) {
      std::vector<double> factors;
      std::vector<std::string> names;
      for (Index k = 0; k < row.size(); ++k) {
        if (row(k) == 0) continue;
        factors.push_back(is_near(std::abs(row(k)), 1) ? std::copysign(1, row(k)) : row(k));
        names.push_back(names_[static_cast<std::size_t>(k)]);
      }
      terms.push_back(sum_in_words(factors, names));
    }
    return terms;
  }

  std::vector<std::string> names_, units_;
  VectorXd rho_, size_;
  MatrixXd Q_, rows_;  // determined combinations, in changes over sizes: orthonormal columns, and reduced rows
  std::vector<Index> pivots_;
};

}  // namespace

std::vector<bool> changed_parameters(const MatrixXd& null_space) {
  std::vector<bool> changed(static_cast<std::size_t>(null_space.rows()), false);
  if (null_space.cols() == 0) return changed;
  const MatrixXd P = projector(null_space);
  for (Index k = 0; k < P.rows(); ++k) changed[static_cast<std::size_t>(k)] = std::sqrt(std::abs(P(k, k))) > kPart;
  return changed;
}

std::vector<std::string> determined_combinations(const MatrixXd& null_space, const VectorXd& rho, const VectorXd& size,
                                                 const std::vector<std::string>& names,
                                                 const std::vector<std::string>& units) {
  std::vector<std::string> words;
  if (null_space.cols() == 0) return words;
  const MatrixXd P = projector(null_space);
  const std::vector<bool> changed = changed_parameters(null_space);
  std::vector<Index> group(changed.size());  // by its first member
  std::iota(group.begin(), group.end(), Index{0});
  for (std::size_t i = 0; i < group.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      if (!changed[i] || !changed[k] || std::abs(P(static_cast<Index>(i), static_cast<Index>(k))) <= kPart) continue;
      const auto [first, second] = std::minmax({group[i], group[k]});
      std::replace(group.begin(), group.end(), Index{second}, Index{first});
    }
  for (std::size_t k = 0; k < group.size(); ++k) {
    if (!changed[k] || group[k] != static_cast<Index>(k)) continue;
    std::vector<Index> members;
    for (std::size_t i = k; i < group.size(); ++i)
      if (changed[i] && group[i] == group[k]) members.push_back(static_cast<Index>(i));
    words.push_back(Group(members, P, rho, size, names, units).in_words());
  }
  return words;
}

}  // namespace mbsopt::inline optim
