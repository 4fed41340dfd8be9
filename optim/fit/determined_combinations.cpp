#include "optim/fit/determined_combinations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>

#include "core/expression/did_you_mean.hpp"
#include "core/linear/dense.hpp"
#include "optim/fit/sums_of_products.hpp"

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
    if (!terms) terms = sums_of_products(Q_, rho_, size_, names_, units_);
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
