#include "app/starts/start_workers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/results/case_results.hpp"
#include "app/terminal/interrupt.hpp"
#include "optim/machine/process_pool.hpp"

namespace mbsopt::inline app {
namespace {

// mpirun kills a second after its request to end. All results must be written before.
constexpr std::chrono::milliseconds kPatience{300};

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
            {"integrator", to_json(run.problem.scene.simulation.integrator)},  // which rank 0 may have chosen
            {"task", task}}}};
}

// The other ranks as rank 0 sees them.
class OtherRanks : public RemoteWorkers {
 public:
  OtherRanks(Ranks& ranks, int workers, const Json& work)
      : ranks_(ranks), workers_(workers), busy_(static_cast<std::size_t>(ranks.size()), 0) {
    tell(work);
  }

  // Gives the job to the rank with the fewest running starts, if one has room.
  bool start(int job) override {
    const auto least = std::min_element(busy_.begin() + 1, busy_.end());
    if (*least >= workers_) return false;
    ranks_.send(static_cast<int>(least - busy_.begin()), json_text(Json{{"start", job}}));
    ++*least;
    return true;
  }
  std::vector<JobReply> ended() override {
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
  bool idle() const override {
    return std::ranges::all_of(busy_, [](int jobs) { return jobs == 0; }) ||
           (stopped_ && Clock::now() - *stopped_ > kPatience);
  }
  void stop() override {
    tell({{"stop", true}});
    stopped_ = Clock::now();
  }

 private:
  void tell(const Json& message) {
    for (int rank = 1; rank < ranks_.size(); ++rank) ranks_.send(rank, json_text(message));
  }

  using Clock = std::chrono::steady_clock;

  Ranks& ranks_;
  int workers_;
  std::vector<int> busy_;  // starts under way, per rank
  std::optional<Clock::time_point> stopped_;
};

}  // namespace

bool compute_starts(LongRun& long_run, int first, int last, const StartWork& work,
                    const std::function<void(const Json& record)>& done, const std::function<void()>& waiting) {
  Run& run = long_run.run;
  std::set<int> finished;
  for (const Json& record : long_run.earlier().of("start")) finished.insert(record.at("start").get<int>());
  std::vector<int> starts;
  for (int start = first; start < last; ++start)
    if (!finished.contains(start)) starts.push_back(start);
  std::size_t whole = 0;
  const auto keep = [&](const JobReply& reply) {
    const Json record = reply.ok ? read_json(reply.text)
                                 : Json{{"start", reply.job},
                                        {"status", interrupted() ? "stopped" : "failed"},
                                        {"message", reply.text},
                                        {"objective", nullptr}};
    if (record["status"] != "stopped") {
      ++whole;
      if (reply.ok) long_run.add("start", record);
    }
    done(record);
  };
  Ranks* const ranks = run.context.ranks;
  // Under mpirun the number of ranks determines how many starts run at a time.
  const int workers = ranks && run.context.options.threads == 0 ? 1 : case_threads(run);
  std::optional<OtherRanks> others;
  if (ranks) others.emplace(*ranks, workers, work_message(run, work.task, workers));
  run_in_processes(
      starts, workers, [&](int start) { return json_text(work.record(start)); }, keep,
      [&] {
        waiting();
        return !interrupted();
      },
      others ? &*others : nullptr);
  return whole == starts.size();
}

}  // namespace mbsopt::inline app
