// The ranks of mpirun other than 0 serve rank 0.
#include <fmt/format.h>

#include <chrono>
#include <deque>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "app/json/read_problem.hpp"
#include "app/run/provenance.hpp"
#include "app/starts/design_starts.hpp"
#include "app/starts/identify_starts.hpp"
#include "app/starts/ranks.hpp"
#include "app/starts/sweep_blocks.hpp"
#include "app/terminal/exit_code.hpp"
#include "app/terminal/interrupt.hpp"
#include "optim/machine/process_pool.hpp"

namespace mbsopt::inline app {
namespace {

void set_integrator(Problem& problem, const Json& integrator) {
  SimulationSettings& settings = problem.scene.simulation;
  settings.accuracy.reset();
  settings.integrator.type = integrator.at("type").get<std::string>();
  settings.integrator.rtol = integrator.at("rtol").get<double>();
  settings.integrator.atol = integrator.at("atol").get<double>();
}

std::function<Json(int)> work_of(const Json& work, const NamedTerms& terms) {
  const std::string file = work.at("problem_file"), command = work.at("command");
  Problem problem = read_problem(file, work.at("sets").get<std::vector<std::string>>(), nullptr,
                                 {terms, work.at("allow_plugins").get<bool>()});
  set_integrator(problem, work.at("integrator"));
  const Json& task = work.at("task");
  std::vector<std::string> files = data_files(problem, terms);
  if (const std::string points = task.value("points", ""); !points.empty()) files.push_back(points);
  const Json here = provenance({}, "", file, files);
  for (const char* key : {"input_sha256", "data_sha256"})
    if (here.value(key, Json()) != work.at(key))
      throw std::runtime_error(
          fmt::format("{}: it, or a file that it names, has another content here than on rank 0", file));
  return (command == "design"  ? design_start_work(problem, task)
          : command == "sweep" ? sweep_work(problem, task)
                               : identify_start_work(problem, task))
      .record;
}

class Server {
 public:
  Server(Ranks& ranks, const NamedTerms& terms) : ranks_(ranks), terms_(terms) {}

  void run() {
    while (!dismissed_) {
      while (const std::optional<Ranks::Message> message = ranks_.receive()) take(read_json(message->text));
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
  void tell(const Json& message) { ranks_.send(0, json_text(message)); }

  void take(const Json& message) {
    if (message.contains("dismissed")) dismissed_ = true;
    if (message.contains("stop")) stop();
    try {
      if (message.contains("work")) {
        const Json& work = message["work"];
        pool_.emplace(work.at("workers").get<int>(),
                      [record = work_of(work, terms_)](int start) { return json_text(record(start)); });
      }
      if (message.contains("start") && pool_) waiting_.push_back(message["start"].get<int>());
    } catch (const std::exception& error) {
      tell({{"failed", error.what()}});
    }
  }

  // Drops the waiting starts, and stops the running ones.
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
  const NamedTerms& terms_;
  std::optional<ProcessPool> pool_;
  std::deque<int> waiting_;  // starts for which the system has given no process yet
  bool dismissed_ = false, told_of_interrupt_ = false;
};

}  // namespace

int serve(Ranks& ranks, const NamedTerms& terms) {
  const InterruptGuard guard;
  Server(ranks, terms).run();
  return kDone;
}

void dismiss(Ranks& ranks) {
  for (int rank = 1; rank < ranks.size(); ++rank) ranks.send(rank, json_text(Json{{"dismissed", true}}));
}

}  // namespace mbsopt::inline app
