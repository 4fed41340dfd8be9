#include "app/results/window_results.hpp"

#include <fmt/format.h>

#include "core/expression/counted.hpp"

namespace mbsopt {

void add_windows(Run& run, const Problem& cut) {
  for (const ExperimentSpec& e : cut.identification->experiments) {
    if (!e.origin) continue;
    Json& windows = run.result["windows"][e.origin->experiment];
    if (windows.is_null()) windows = {{"start_time", *e.start_time}};
    windows["count"] = e.origin->number, windows["end_time"] = *e.end_time;
  }
  if (!run.result.contains("windows")) return;
  for (const auto& [name, windows] : run.result["windows"].items())
    run.context.out << fmt::format("{}: {} from {:g} to {:g} s\n", name,
                                   counted(windows["count"].get<std::size_t>(), "window"),
                                   windows["start_time"].get<double>(), windows["end_time"].get<double>());
}

}  // namespace mbsopt
