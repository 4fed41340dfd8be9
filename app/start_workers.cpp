#include "app/start_workers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <numeric>
#include <stdexcept>
#include <thread>

#include "app/design_starts.hpp"
#include "app/exit_code.hpp"
#include "app/identify_starts.hpp"
#include "app/interrupt.hpp"
#include "app/json/read_problem.hpp"
#include "app/provenance.hpp"

namespace mbsopt {
namespace {

using Clock = std::chrono::steady_clock;

// Between looks at what has come from other ranks. MPI itself would wait at full speed.
constexpr int kPollMilliseconds = 5;
// mpirun kills a second after it has asked to end: until then what there is must have been written.
constexpr std::chrono::milliseconds kPatience{300};

// Messages, all of JSON:
//   to a rank   {"work": {...}} {"start": 7} {"stop": true} {"dismissed": true}
//   to rank 0   {"reply": 7, "ok": true, "text": "..."} {"interrupted": true} {"failed": "why"}

// As rank 0 may have chosen it (accuracy_results.hpp).
Json integrator_of(const Problem& problem) {
  const IntegratorSettings& s = problem.scene.simulation.integrator;
  return {{"type", s.type}, {"rtol", s.rtol}, {"atol", s.atol}};
}

void set_integrator(Problem& problem, const Json& integrator) {
  SimulationSettings& settings = problem.scene.simulation;
  settings.accuracy.reset();
  settings.integrator.type = integrator.at("type").get<std::string>();
  settings.integrator.rtol = integrator.at("rtol").get<double>(),
  settings.integrator.atol = integrator.at("atol").get<double>();
}

Json work_message(const Run& run, const Json& task, int workers) {
  const CommandContext& context = run.context;
  return {{"work",
           {{"command", context.command},
            {"problem_file", context.options.problem_file},
            {"sets", context.options.sets},
            {"input_sha256", run.result["provenance"]["input_sha256"]},
            {"data_sha256", run.result["provenance"].value("data_sha256", Json())},
            {"workers", workers},
            {"integrator", integrator_of(run.problem)},
            {"task", task}}}};
}

// Rank 0's view of the others.
class OtherRanks {
 public:
  OtherRanks(Ranks& ranks, int workers) : ranks_(ranks), workers_(workers), busy_(ranks_size(), 0) {}

  void tell(const Json& message) {
    for (int rank = 1; rank < ranks_.size(); ++rank) ranks_.send(rank, message.dump());
  }
  bool idle() const {
    return std::all_of(busy_.begin(), busy_.end(), [](int jobs) { return jobs == 0; });
  }
  // The rank with the fewest starts under way, where one has room.
  bool start(int job) {
    const auto least = std::min_element(busy_.begin() + 1, busy_.end());
    if (*least >= workers_) return false;
    ranks_.send(static_cast<int>(least - busy_.begin()), Json{{"start", job}}.dump());
    ++*least;
    return true;
  }
  std::vector<JobReply> ended() {
    std::vector<JobReply> replies;
    while (const std::optional<Ranks::Message> message = ranks_.receive()) {
      const Json json = Json::parse(message->text);
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
                      const std::function<void(const JobReply&)>& done) {
  OtherRanks others(ranks, workers);
  others.tell(work_message(run, work.task, workers));
  ProcessPool here(workers, [&](int start) { return work.record(start).dump(); });
  auto next = starts.begin();
  std::optional<Clock::time_point> stopped;
  while (!here.idle() || !others.idle() || (next != starts.end() && !stopped)) {
    while (!stopped && next != starts.end() && others.start(*next)) ++next;
    while (!stopped && next != starts.end() && here.has_room() && here.start(*next)) ++next;
    for (const JobReply& reply : here.ended(kPollMilliseconds)) done(reply);
    for (const JobReply& reply : others.ended()) done(reply);
    if (!stopped && interrupted()) {
      stopped = Clock::now();
      here.stop(), others.tell({{"stop", true}});
    }
    if (stopped && here.idle() && Clock::now() - *stopped > kPatience) break;
  }
}

std::function<Json(int)> work_of(const Json& work) {
  const std::string file = work.at("problem_file"), command = work.at("command");
  Problem problem = read_problem(file, work.at("sets").get<std::vector<std::string>>());
  set_integrator(problem, work.at("integrator"));
  const Json here = provenance({}, "", file, data_files(problem));
  for (const char* key : {"input_sha256", "data_sha256"})
    if (here.value(key, Json()) != work.at(key))
      throw std::runtime_error(
          fmt::format("{}: it, or a file that it names, has another content here than on rank 0", file));
  return command == "design" ? design_start_work(problem, work.at("task")).record
                             : identify_start_work(problem, work.at("task")).record;
}

class Server {
 public:
  explicit Server(Ranks& ranks) : ranks_(ranks) {}

  void run() {
    while (!dismissed_) {
      while (const std::optional<Ranks::Message> message = ranks_.receive()) take(Json::parse(message->text));
      start_what_waits();
      send_what_has_ended();
      if (interrupted() && !told_of_interrupt_) {
        told_of_interrupt_ = true;
        stop();
        tell({{"interrupted", true}});
      }
    }
  }

 private:
  void tell(const Json& message) { ranks_.send(0, message.dump(-1, ' ', false, Json::error_handler_t::replace)); }

  void take(const Json& message) {
    if (message.contains("dismissed")) dismissed_ = true;
    if (message.contains("stop")) stop();
    try {
      if (message.contains("work")) {
        const Json& work = message["work"];
        pool_.emplace(work.at("workers").get<int>(),
                      [record = work_of(work)](int start) { return record(start).dump(); });
      }
      if (message.contains("start") && pool_) waiting_.push_back(message["start"].get<int>());
    } catch (const std::exception& error) {
      tell({{"failed", error.what()}});
    }
  }

  // Drops the starts that wait, and stops those that run.
  void stop() {
    waiting_.clear();
    if (pool_) pool_->stop();
  }

  void start_what_waits() {
    try {
      while (!waiting_.empty() && pool_->has_room() && pool_->start(waiting_.front())) waiting_.pop_front();
    } catch (const std::exception& error) {
      waiting_.clear();
      tell({{"failed", error.what()}});
    }
  }

  void send_what_has_ended() {
    if (!pool_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(kPollMilliseconds));
      return;
    }
    for (const JobReply& reply : pool_->ended(kPollMilliseconds))
      tell({{"reply", reply.job}, {"ok", reply.ok}, {"text", reply.text}});
  }

  Ranks& ranks_;
  std::optional<ProcessPool> pool_;
  std::deque<int> waiting_;  // starts for which the system has given no process yet
  bool dismissed_ = false, told_of_interrupt_ = false;
};

// Under mpirun the number of ranks says how many starts are under way.
int workers_of(const Run& run) {
  const int asked = run.context.options.threads;
  if (asked > 0) return asked;
  return run.context.ranks ? 1 : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

}  // namespace

void compute_starts(Run& run, const std::vector<int>& starts, const StartWork& work,
                    const std::function<void(const JobReply&)>& done) {
  if (run.context.ranks) return compute_on_ranks(run, *run.context.ranks, workers_of(run), starts, work, done);
  run_in_processes(
      starts, workers_of(run), [&](int start) { return work.record(start).dump(); }, done,
      [] { return !interrupted(); });
}

int serve(Ranks& ranks) {
  const InterruptGuard guard;
  Server(ranks).run();
  return kDone;
}

void dismiss(Ranks& ranks) {
  for (int rank = 1; rank < ranks.size(); ++rank) ranks.send(rank, Json{{"dismissed", true}}.dump());
}

}  // namespace mbsopt
