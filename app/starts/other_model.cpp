#include "app/starts/other_model.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "app/json/input_error.hpp"
#include "app/starts/identify_starts.hpp"

namespace mbsopt {

OtherModel::OtherModel(const std::string& file, const ReadOptions& options)
    : source_(read_problem_source(file, {})), problem_(read_problem(*source_, nullptr, options)) {
  if (!problem_.identification) throw std::invalid_argument(fmt::format("--compare: {} has no identification", file));
}

void OtherModel::check(const Scene& first, const IdentificationOptions& options) {
  problem_.scene.simulation.integrator = first.simulation.integrator;
  problem_.scene.simulation.accuracy.reset();
  try {
    cut_ = cut_into_windows(problem_, data_of(problem_), options.user_forces, options.simulation_progress);
    IdentificationOptions once = options;
    once.preflight = true, once.tests_angles = false;
    run_identification(cut_.problem, cut_.data, once);
  } catch (const std::invalid_argument& error) {
    const Finding whole{source_->file.string(), 0, 0, "", error.what()};
    throw InputError({source_->finding(error.what()).value_or(whole)});
  }
}

IdentificationResult OtherModel::fit(const IdentificationOptions& options) const {
  return run_identification(cut_.problem, cut_.data, options);
}

}  // namespace mbsopt
