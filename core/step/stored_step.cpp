#include "core/step/stored_step.hpp"

#include <algorithm>

namespace mbsopt {
namespace {

// f(numbers, how many) of every part that is kept.
template <class StepType, class Function>
void for_each_part(StepType& step, int stages, Function&& f) {
  const auto whole = [&](auto& x) { f(x.data(), x.size()); };
  whole(step.y0);
  whole(step.angles0);
  whole(step.y_hat);
  whole(step.y1);
  const Eigen::Index half = step.y0.size() / 2;
  for (int i = 0; i < stages; ++i) f(step.K.col(i).data() + half, half);
  f(step.lambda.data(), step.lambda.rows() * stages);
  for (auto* x : {&step.projection.delta, &step.projection.u}) {
    if (!x->empty()) f(x->front().data(), 6 * static_cast<Eigen::Index>(x->size()));
  }
  whole(step.projection.nu);
  whole(step.projection.kappa);
}

}  // namespace

StoredStep::StoredStep(const Step& step, const Method& rk, std::span<const SampleEvent> events)
    : t(step.t), h(step.h), t1(step.t1), dense(step.dense), states_(step.y0.size()), angles_(step.angles0.size()) {
  const int stages = step.stages(rk);
  for_each_part(step, stages, [&](const double*, Eigen::Index size) { count_ += size; });
  numbers_ = std::make_unique_for_overwrite<double[]>(static_cast<std::size_t>(count_));
  double* to = numbers_.get();
  for_each_part(step, stages, [&](const double* from, Eigen::Index size) { to = std::copy_n(from, size, to); });
  for (const SampleEvent& e : events) {
    if (e.cost) samples.push_back(e);
  }
}

void StoredStep::restore(const Method& rk, Step& step) const {
  step.t = t;
  step.h = h;
  step.t1 = t1;
  step.dense = dense;
  const double* from = numbers_.get();
  for_each_part(step, step.stages(rk), [&](double* to, Eigen::Index size) {
    std::copy_n(from, size, to);
    from += size;
  });
}

std::size_t StoredStep::bytes() const {
  return sizeof(*this) + sizeof(double) * static_cast<std::size_t>(count_) + sizeof(SampleEvent) * samples.size();
}

}  // namespace mbsopt
