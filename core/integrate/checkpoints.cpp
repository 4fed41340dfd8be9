#include "core/integrate/checkpoints.hpp"

#include <algorithm>

namespace mbsopt {
namespace {

constexpr std::size_t kBlock = 24;                           // of an allocation beside its contents, at most [bytes]
constexpr std::size_t kStepListed = 32;                      // times and sizes in the list of steps, with room to grow
constexpr std::size_t kLeastSteps = 2, kLeastSnapshots = 8;  // below these no budget can push

std::size_t bytes_of(const StoredStep& step) { return step.bytes() + 2 * kBlock; }
std::size_t bytes_of(const Snapshot& s) {
  return sizeof(s) + sizeof(double) * static_cast<std::size_t>(s.y0.size() + s.angles.size()) + 3 * kBlock;
}

}  // namespace

// With r the least number such that beta(s, r) >= N, the optimal m are about N beta(s, r - 1)/beta(s, r) = N r/(s + r).
long binomial_split(long blocks, long snapshots) {
  long r = 0;
  for (double beta = 1; beta < static_cast<double>(blocks); ++r)
    beta *= static_cast<double>(snapshots + r + 1) / static_cast<double>(r + 1);
  return std::clamp(blocks * r / (snapshots + r), 1L, blocks - 1);
}

Checkpoints::Checkpoints(const Method& method, double budget_mib)
    : rk_(method), budget_(static_cast<std::size_t>(std::min(budget_mib, 1e9) * 1024 * 1024)) {}

std::size_t Checkpoints::listed() const {
  return static_cast<std::size_t>(steps_) * kStepListed + events_.size() * sizeof(std::pair<long, SampleEvent>);
}

std::size_t Checkpoints::limit() const {
  const std::size_t least = kLeastSteps * step_bytes_ + kLeastSnapshots * snapshot_bytes_;
  return budget_ > listed() + least ? budget_ - listed() : least;
}

void Checkpoints::count(std::size_t more) {
  bytes_ += more;
  peak_ = std::max(peak_, bytes_ + listed());
}

void Checkpoints::add(Snapshot s) {
  count(bytes_of(s));
  snapshots_.push_back(std::move(s));
}

void Checkpoints::keep(const Step& step, std::span<const SampleEvent> events) {
  if (steps_ == 0) {
    Step with_dense_output = step;
    with_dense_output.dense = true;
    step_bytes_ = bytes_of(StoredStep(with_dense_output, rk_, {}));
    snapshot_bytes_ = bytes_of(Snapshot{0, step.y0, step.angles0});
  }
  const long index = steps_++;
  if (every_ == 0 && bytes_ + step_bytes_ > limit()) turn_steps_into_snapshots();
  if (every_ == 0) {
    kept_.emplace_back(step, rk_, events);
    return count(bytes_of(kept_.back()));
  }
  for (const SampleEvent& e : events)
    if (e.cost) events_.emplace_back(index, e);
  if (index % every_ != 0) return;
  add({index, step.y0, step.angles0});
  thin_out();
}

void Checkpoints::turn_steps_into_snapshots() {
  every_ = 1;
  for (long index = 0; !kept_.empty(); ++index) {
    const StoredStep& step = kept_.front();
    bytes_ -= bytes_of(step);
    for (const SampleEvent& e : step.samples) events_.emplace_back(index, e);
    add({index, step.y0(), step.angles0()});
    kept_.pop_front();
  }
  thin_out();
}

void Checkpoints::thin_out() {
  while (bytes_ > limit() / 2 && snapshots_.size() > kLeastSnapshots / 2) {
    every_ *= 2;
    std::erase_if(snapshots_, [&](const Snapshot& s) { return s.step % every_ != 0; });
    bytes_ = 0;
    for (const Snapshot& s : snapshots_) bytes_ += bytes_of(s);
  }
}

bool Checkpoints::go_back(const Replay& replay, const StepBack& back) {
  replay_ = replay;
  back_ = back;
  if (!back_over_kept()) return false;
  for (long last = steps_; !snapshots_.empty();) {
    if (!reverse(snapshots_.back(), last)) return false;
    last = snapshots_.back().step;
    bytes_ -= bytes_of(snapshots_.back());
    snapshots_.pop_back();
  }
  return true;
}

bool Checkpoints::back_over_kept() {
  while (!kept_.empty()) {
    if (!back_(kept_.back())) return false;
    bytes_ -= bytes_of(kept_.back());
    kept_.pop_back();
  }
  return true;
}

bool Checkpoints::reverse(const Snapshot& from, long last) {
  const std::size_t length = static_cast<std::size_t>(last - from.step),
                    free = std::max(limit(), bytes_ + step_bytes_) - bytes_;
  if (length * step_bytes_ <= free) return run_again(from, from.step, last) && back_over_kept();
  const std::size_t block = std::max<std::size_t>(free / 2 / step_bytes_, 1);
  const std::size_t left = free - block * step_bytes_;
  return reverse_blocks(from, last, static_cast<long>(block), 1 + static_cast<long>(left / snapshot_bytes_));
}

bool Checkpoints::reverse_blocks(const Snapshot& from, long last, long block, long snapshots) {
  const long blocks = (last - from.step + block - 1) / block;
  if (snapshots <= 1 || blocks == 1) {
    for (long k = blocks; k-- > 0; last = from.step + k * block) {
      if (!run_again(from, from.step + k * block, last) || !back_over_kept()) return false;
    }
    return true;
  }
  const long split = from.step + block * binomial_split(blocks, snapshots);
  if (!run_again(from, split, split)) return false;
  const Snapshot middle = again_.end;
  count(bytes_of(middle));
  if (!reverse_blocks(middle, last, block, snapshots - 1)) return false;
  bytes_ -= bytes_of(middle);
  return reverse_blocks(from, middle.step, block, snapshots);
}

bool Checkpoints::run_again(const Snapshot& from, long first, long last) {
  again_ = {from.step, first, last, {}};
  recomputed_ += last - from.step;
  return replay_(from, last, *this);
}

std::span<const std::pair<long, SampleEvent>> Checkpoints::samples() const {
  const auto step = &std::pair<long, SampleEvent>::first;
  const auto begin = std::ranges::lower_bound(events_, again_.index, {}, step);
  const auto end = std::ranges::upper_bound(events_, again_.index, {}, step);
  return {begin, end};
}

std::string Checkpoints::look_at(const SeenStep& step) {
  if (again_.index >= again_.first) {
    std::vector<SampleEvent> events;
    for (const auto& [of, event] : samples()) events.push_back(event);
    kept_.emplace_back(*step.stages, rk_, events);
    count(bytes_of(kept_.back()));
  }
  if (++again_.index == again_.last) {
    again_.end.step = again_.last;
    again_.end.y0 = step.to.y;
    again_.end.angles = step.to.angles;
  }
  return {};
}

}  // namespace mbsopt
