#include "bench/reference_motion.hpp"

#include "bench/models.hpp"
#include "bench/repeated.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/state_point.hpp"
#include "core/start/assembly.hpp"

namespace mbsopt::bench {
namespace {

constexpr double kEnd = 10;  // [s]

std::vector<double> sample_times() {
  std::vector<double> times;
  for (int i = 0; i <= 200; ++i) times.push_back(kEnd * i / 200);
  return times;
}

std::vector<Eigen::Matrix3Xd> motion(const Scene& scene, const std::vector<double>& times) {
  std::vector<Eigen::Matrix3Xd> centres(times.size());
  const Mechanism mechanism(scene, Eigen::VectorXd(0));
  const auto observe = [&](std::size_t index, const StatePoint& at) {
    centres[index].resize(3, mechanism.bodies());
    for (int i = 0; i < mechanism.bodies(); ++i) centres[index].col(i) = at.y.segment<3>(7 * i);
  };
  const SimulationResult result = simulate(mechanism, scene.simulation, {}, {times, observe});
  if (!result.ok()) centres.clear();
  return centres;
}

void set_tolerance(Scene& scene, const std::string& method, double rtol) {
  IntegratorSettings& integrator = scene.simulation.integrator;
  integrator.type = method, integrator.rtol = rtol, integrator.atol = 1e-2 * rtol;
}

}  // namespace

double ReferenceMotion::distance(const std::vector<Eigen::Matrix3Xd>& motion) const {
  if (motion.size() != centres.size()) return INFINITY;
  double most = 0;
  for (std::size_t k = 0; k < centres.size(); ++k) {
    const double now = (motion[k] - centres[k]).colwise().norm().maxCoeff<Eigen::PropagateNaN>();
    if (!std::isfinite(now)) return INFINITY;
    most = std::max(most, now);
  }
  return most;
}

ReferenceMotion motion_of_four_bars(int windows) {
  ReferenceMotion reference{sample_times(), {}};
  for (const double chi : four_bars_angles(windows, reference.times)) {
    Eigen::Matrix3Xd at(3, 2 * windows + 1);
    const Vector3d tip(std::sin(chi), std::cos(chi), 0);
    for (int i = 0; i <= windows; ++i) at.col(i) = Vector3d(i, 0, 0) + tip / 2;
    for (int i = 1; i <= windows; ++i) at.col(windows + i) = Vector3d(i - 0.5, 0, 0) + tip;
    reference.centres.push_back(at);
  }
  return reference;
}

ReferenceMotion motion_of_bricard() {
  Scene scene = scene_of(bricard());
  scene.simulation.end_time = kEnd;
  ReferenceMotion reference{sample_times(), {}};
  set_tolerance(scene, "dopri853", 1e-12);
  reference.centres = motion(scene, reference.times);
  set_tolerance(scene, "verner6", 1e-11);
  reference.apart = reference.distance(motion(scene, reference.times));
  return reference;
}

MeasuredRuns::MeasuredRuns(const Linkage& linkage, const std::string& model, const ReferenceMotion& reference)
    : scene_(scene_of(linkage)), reference_(reference) {
  choose_model(scene_.simulation, model);
  scene_.simulation.end_time = kEnd;
}

MeasuredRun MeasuredRuns::run(const std::string& method, double rtol) {
  MeasuredRun run{method, rtol, error(method, rtol), INFINITY, {}};
  const Mechanism mechanism(scene_, Eigen::VectorXd(0));
  std::vector<double> seconds;
  for (int i = 0; i < 5; ++i) {
    const ThreadClock clock;
    run.statistics = simulate(mechanism, scene_.simulation).statistics;
    seconds.push_back(clock.seconds());
  }
  run.seconds = median(std::move(seconds));
  return run;
}

MeasuredRun MeasuredRuns::fastest(double wanted) {
  MeasuredRun best;
  const double finer = std::sqrt(0.1);
  for (const char* method : {"dopri5", "verner6", "dopri853"}) {
    bool met = error(method, 1e-4) <= wanted;
    for (double rtol = 1e-4; rtol > 1e-11; rtol *= finer) {
      const bool next = error(method, finer * rtol) <= wanted;
      if (met && next) {
        const MeasuredRun candidate = run(method, rtol);
        if (candidate.seconds < best.seconds) best = candidate;
        break;
      }
      met = next;
    }
  }
  return best;
}

double MeasuredRuns::start_seconds() const {
  const Mechanism mechanism(scene_, Eigen::VectorXd(0));
  return median_seconds([&] { Assembly(mechanism, 0); }, 3);
}

double MeasuredRuns::error(const std::string& method, double rtol) {
  set_tolerance(scene_, method, rtol);
  return reference_.distance(motion(scene_, reference_.times));
}

}  // namespace mbsopt::bench
