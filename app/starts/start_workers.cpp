#include "app/starts/start_workers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <numeric>
#include <stdexcept>

#include "app/results/case_results.hpp"
#include "app/terminal/interrupt.hpp"

namespace mbsopt::inline app {
namespace {

using Clock = std::chrono::steady_clock;

// mpirun kills a second after its request to end. All results must be written before.
constexpr std::chrono::milliseconds kPatience{300};

// Rank 0 may have chosen the integrator (accuracy_results.hpp).
Json integrator_of(const Problem& problem) {
  const IntegratorSettings& s = problem.scene.simulation.integrator;
  return {{"type", s.type}, {"rtol", s.rtol}, {"atol", s.atol}};
}

Json work_message(const Run& run, const Json& task, int workers) {
  const CommandContext& context = run.context;
  return {{"work",
           {{"command", context.command},
            {"problem_file", context.options.problem_file},
            {"sets", context.options.sets},
            {"allow_plugins", context.options.allow_plugins},
            {"input_sha256", run.result["provenance"]["input_sha256"]},
            {"data_sha256", run.result["provenance"].value("data_sha256", Json())},
            {"workers", workers},
            {"integrator", integrator_of(run.problem)},
            {"task", task}}}};
}

// The other ranks as rank 0 sees them.
class OtherRanks {
 public:
  OtherRanks(Ranks& ranks, int workers) : ranks_(ranks), workers_(workers), busy_(ranks_size(), 0) {}

  void tell(const Json& message) {
    for (int rank = 1; rank < ranks_.size(); ++rank) ranks_.send(rank, json_text(message));
  }
  bool idle() const {
    return std::all_of(busy_.begin(), busy_.end(), [](int jobs) { return jobs == 0; });
  }
  // Gives the job to the rank with the fewest running starts, if one has room.
  bool start(int job) {
    const auto least = std::min_element(busy_.begin() + 1, busy_.end());
    if (*least >= workers_) return false;
    ranks_.send(static_cast<int>(least - busy_.begin()), json_text(Json{{"start", job}}));
    ++*least;
    return true;
  }
  std::vector<JobReply> ended() {
    std::vector<JobReply> replies;
    while (const std::optional<Ranks::Message> message = ranks_.receive()) {
      const Json json = read_json(message->text);
      if (json.contains("failed"))
        throw std::runtime_error(fmt::format("rank {}: {}", message->from, json["failed"].get<std::string>()));
      if (json.contains("interrupted")) interrupt();  // who ends one rank, ends the run
      if (!json.contains("reply")) continue;
      --busy_[static_cast<std::size_t>(message->from)];
      replies.push_back({json["reply"].get<int>(), json["ok"].get<bool>(), json["text"].get<std::string>()});
    }
    return replies;
  }

 private:
  std::size_t ranks_size() const { return static_cast<std::size_t>(ranks_.size()); }

  Ranks& ranks_;
  int workers_;
  std::vector<int> busy_;  // starts under way, per rank
};

void compute_on_ranks(Run& run, Ranks& ranks, int workers, const std::vector<int>& starts, const StartWork& work,
                      const std::function<void(const JobReply&)>& done, const std::function<void()>& waiting) {
  OtherRanks others(ranks, workers);
  others.tell(work_message(run, work.task, workers));
  ProcessPool here(workers, [&](int start) { return json_text(work.record(start)); });
  auto next = starts.begin();
  std::optional<Clock::time_point> stopped;
  const auto fill = [&] {
    while (!stopped && next != starts.end() && others.start(*next)) ++next;
    while (!stopped && next != starts.end() && here.has_room() && here.start(*next)) ++next;
  };
  fill();
  while (!here.idle() || !others.idle() || (next != starts.end() && !stopped)) {
    std::vector<JobReply> replies = here.ended(kPollMilliseconds);
    std::ranges::move(others.ended(), std::back_inserter(replies));
    fill();  // before done(), which may wait for a disk
    for (const JobReply& reply : replies) done(reply);
    waiting();
    if (!stopped && interrupted()) {
      stopped = Clock::now();
      here.stop(), others.tell({{"stop", true}});
    }
    if (stopped && here.idle() && Clock::now() - *stopped > kPatience) break;
  }
}

// Under mpirun the number of ranks determines how many starts run at a time.
int workers_of(const Run& run) { return run.context.ranks && run.context.options.threads == 0 ? 1 : case_threads(run); }

}  // namespace

void compute_starts(Run& run, const std::vector<int>& starts, const StartWork& work,
                    const std::function<void(const JobReply&)>& done, const std::function<void()>& waiting) {
  if (run.context.ranks) return compute_on_ranks(run, *run.context.ranks, workers_of(run), starts, work, done, waiting);
  run_in_processes(
      starts, workers_of(run), [&](int start) { return json_text(work.record(start)); }, done,
      [&] {
        waiting();
        return !interrupted();
      });
}

}  // namespace mbsopt::inline app
