#include "core/mechanism/row_laws.hpp"

#include <algorithm>

namespace mbsopt {

RowLaws::RowLaws(const MechanismData& data) : data_(&data), jets_(data.laws.size()) {
  if (data.laws.empty()) return;
  law_of_row_.assign(at(data.m), -1);
  inputs_.assign(data.rho.begin(), data.rho.end());
  inputs_.push_back(0);
  gradient_.resize(inputs_.size());
  for (std::size_t k = 0; k < data.laws.size(); ++k) {
    row_of_law_.push_back(data.laws[k].row);
    law_of_row_[at(data.laws[k].row)] = static_cast<int>(k);
    if (!data.laws[k].law.programs) continue;
    for (const Program& p : *data.laws[k].law.programs) p.grow(scratch_);
  }
}

RowLaws::RowLaws(const MechanismData& data, const std::vector<int>& rows) : RowLaws(data) {
  std::vector<int> laws(law_of_row_.empty() ? 0 : rows.size(), -1);
  for (std::size_t k = 0; k < laws.size(); ++k) {
    laws[k] = law_of_row_[at(rows[k])];
    if (laws[k] >= 0) row_of_law_[at(laws[k])] = static_cast<int>(k);
  }
  law_of_row_ = std::move(laws);
}

void RowLaws::set_time(double t) {
  if (jets_.empty()) return;
  inputs_.back() = t;
  for (std::size_t k = 0; k < jets_.size(); ++k) {
    jets_[k] = data_->laws[k].law.at(inputs_, scratch_);
    if (held_) jets_[k][1] = jets_[k][2] = 0;
  }
}

void RowLaws::add_pull_back(const Eigen::VectorXd* mu0, const Eigen::VectorXd* mu1, const Eigen::VectorXd* mu2,
                            double scale, Eigen::Ref<Eigen::VectorXd> theta_bar, Eigen::Ref<Eigen::VectorXd> rho_bar) {
  const Eigen::VectorXd* const mu[] = {mu0, mu1, mu2};
  for (std::size_t k = 0; k < jets_.size(); ++k) {
    const TimeLaw& law = data_->laws[k].law;
    const int row = row_of_law_[k];
    if (law.slot >= 0 && mu0) theta_bar(law.slot) -= scale * (*mu0)(row);
    if (!law.programs) continue;
    for (std::size_t order = 0; order < (held_ ? 1u : 3u); ++order) {
      if (!mu[order]) continue;
      std::fill(gradient_.begin(), gradient_.end(), 0.0);
      const Program& program = (*law.programs)[order];
      program.add_gradient(inputs_, -scale * (*mu[order])(row), gradient_, scratch_);
      for (const int input : program.used_inputs()) {
        if (input < rho_bar.size()) rho_bar(input) += gradient_[at(input)];
      }
    }
  }
}

void RowLaws::add_gradient(std::size_t order, int row, double weight, Eigen::Ref<Eigen::VectorXd> rho_bar) const {
  if (!has_law(row)) return;
  const TimeLaw& law = data_->laws[index_of(row)].law;
  if (order == 0) FieldGradient{data_->theta_rho, data_->active, weight, rho_bar}.add<1>(law.slot, Vec<1>(1));
  if (!law.programs) return;
  const Program& program = (*law.programs)[order];
  Program::Scratch scratch = program.scratch();
  std::vector<double> gradient(inputs_.size(), 0.0);
  program.add_gradient(inputs_, weight, gradient, scratch);
  for (const int k : data_->active) rho_bar(k) += gradient[at(k)];
}

void RowLaws::subtract_tangents(const ParameterBlock& block, std::initializer_list<LaneRows*> out) {
  LaneRows* const* const rows = out.begin();  // of Phi, Phidot, Phiddot
  const int P = static_cast<int>(data_->rho.size());
  for (std::size_t k = 0; k < jets_.size(); ++k) {
    const TimeLaw& law = data_->laws[k].law;
    const int row = row_of_law_[k];
    Lanes<1> storage;
    if (const Lanes<1>* constant = block.field<1>(law.slot, storage)) rows[0]->row(row) -= *constant;
    if (!law.programs) continue;
    for (std::size_t order = 0; order < (held_ ? 1u : out.size()); ++order) {
      std::fill(gradient_.begin(), gradient_.end(), 0.0);
      const Program& program = (*law.programs)[order];
      program.add_gradient(inputs_, 1, gradient_, scratch_);
      for (const int input : program.used_inputs()) {
        if (input < P) rows[order]->row(row) -= gradient_[at(input)] * block.direction(input);
      }
    }
  }
}

}  // namespace mbsopt
