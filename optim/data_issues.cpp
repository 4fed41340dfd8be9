#include "optim/data_issues.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "core/scene/scene_path.hpp"

namespace mbsopt {
namespace {

class DataCheck {
 public:
  DataCheck(const ExperimentSpec& experiment, const std::string& place, const CsvTable& data)
      : experiment_(experiment), place_(place), data_(data) {}

  std::vector<SceneIssue> issues(double simulation_start) {
    attempt(place_ + ".time", [&] { data_.column(experiment_.time); });
    for (std::size_t c = 0; c < experiment_.channels.size(); ++c)
      attempt(child_path(place_ + ".channels", c) + ".column", [&] { data_.column(experiment_.channels[c].column); });
    if (issues_.empty()) attempt(place_ + ".data", [&] { ascending_times(data_, experiment_.time); });
    if (issues_.empty()) check_samples(experiment_.start_time.value_or(simulation_start));
    return std::move(issues_);
  }

 private:
  template <class F>
  void attempt(const std::string& path, F&& look) {
    try {
      look();
    } catch (const CsvError& error) {
      issues_.push_back({path, error.what()});
    }
  }

  void check_samples(double start) {
    const std::vector<double>& t = data_.column(experiment_.time);
    const double end = experiment_.end_time.value_or(std::numeric_limits<double>::infinity());
    for (const ChannelSpec& channel : experiment_.channels) {
      const std::vector<double>& measured = data_.column(channel.column);
      for (std::size_t row = 0; row < t.size(); ++row)
        if (t[row] > start && t[row] <= end && !std::isnan(measured[row])) return;
    }
    const std::string span =
        t.empty() ? "it has no rows" : fmt::format("its times run from {} to {} s", t.front(), t.back());
    issues_.push_back(
        {place_ + ".data", fmt::format("{} has no sample after the start at {} s{}; {}", data_.name, start,
                                       std::isfinite(end) ? fmt::format(" and until {} s", end) : "", span)});
  }

  const ExperimentSpec& experiment_;
  const std::string& place_;
  const CsvTable& data_;
  std::vector<SceneIssue> issues_;
};

}  // namespace

std::vector<SceneIssue> find_data_issues(const ExperimentSpec& experiment, const std::string& place,
                                         const CsvTable& data, double start_time) {
  return DataCheck(experiment, place, data).issues(start_time);
}

}  // namespace mbsopt
