// Estimates against an independent least-squares solver on the same residuals: MINPACK's lmder as Eigen has it.
#include <catch2/catch.hpp>
#include <unsupported/Eigen/NonLinearOptimization>

#include "optim/fit/experiment.hpp"
#include "optim/fit/identification.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "tests/optim/repetitions.hpp"

using namespace mbsopt;

namespace {

// The residuals of all experiments in plain parameters: neither the stack nor the scaling of the identification.
struct Residuals {
  std::vector<Experiment> experiments;
  Eigen::Index unknowns, samples = 0;

  Residuals(const repetitions::Study& study, const std::vector<CsvTable>& data,
            const std::vector<UnknownParameter>& all)
      : unknowns(static_cast<Eigen::Index>(all.size())) {
    const Scene& scene = study.problem.scene;
    const IdentificationSpec& spec = *study.problem.identification;
    for (std::size_t e = 0; e < data.size(); ++e) {
      experiments.emplace_back(scene, spec.experiments[e], "here", data[e], testing::nominal(scene),
                               unknowns_in(scene, spec, e, all));
      samples += static_cast<Eigen::Index>(experiments.back().samples().size());
    }
  }
  Eigen::Index inputs() const { return unknowns; }
  Eigen::Index values() const { return samples; }
  int operator()(const Eigen::VectorXd& u, Eigen::VectorXd& z) const { return fill(u, &z, nullptr); }
  int df(const Eigen::VectorXd& u, Eigen::MatrixXd& J) const { return fill(u, nullptr, &J); }
  int fill(const Eigen::VectorXd& u, Eigen::VectorXd* z, Eigen::MatrixXd* J) const {
    Eigen::Index row = 0;
    for (const Experiment& e : experiments) {
      const Experiment::Residuals r = e.residuals(u);
      if (!r.ok) return -1;
      if (z) z->segment(row, r.z.size()) = r.z;
      if (J) J->middleRows(row, r.z.size()) = r.z_u;
      row += r.z.size();
    }
    return 0;
  }
};

}  // namespace

TEST_CASE("estimates are those of MINPACK on the same residuals", "[identification]") {
  for (repetitions::Study& study : repetitions::studies()) {
    Scene& scene = study.problem.scene;
    scene.simulation.integrator.rtol = 1e-10, scene.simulation.integrator.atol = 1e-12;
    study.problem.identification->tolerance = 1e-14;
    // A start off the truth.
    scene.parameters[0].value *= 1.02, scene.parameters[1].value *= 1.3;
    const std::vector<CsvTable> data = repetitions::repeated(study, 7);
    const IdentificationResult ours = run_identification(study.problem, data);
    INFO(study.name << ": " << ours.message);
    REQUIRE(ours.ok());

    const std::vector<UnknownParameter> unknowns = unknowns_of_fit(scene, *study.problem.identification);
    Residuals residuals(study, data, unknowns);
    Eigen::LevenbergMarquardt<Residuals> minpack(residuals);
    minpack.parameters.xtol = minpack.parameters.ftol = 1e-15;
    Eigen::VectorXd u = start_of(unknowns);
    minpack.minimize(u);
    for (Eigen::Index k = 0; k < u.size(); ++k) {
      const FittedParameter& p = ours.parameters[static_cast<std::size_t>(k)];
      INFO(p.name << ": " << p.value << " here, " << u(k) << " there, standard error " << p.std_error);
      CHECK(std::abs(p.value - u(k)) < 1e-6 * std::max(std::abs(u(k)), p.std_error));
    }
    CHECK(ours.cost_final == Approx(0.5 * minpack.fvec.squaredNorm()).epsilon(1e-10));
    // Its covariance, too.
    const Eigen::VectorXd solution = u;
    Eigen::MatrixXd J(residuals.samples, residuals.unknowns);
    residuals.df(solution, J);
    const double s2 = minpack.fvec.squaredNorm() / static_cast<double>(residuals.samples - residuals.unknowns);
    const Eigen::VectorXd size = J.colwise().norm().transpose().cwiseInverse();
    const Eigen::MatrixXd scaled = J * size.asDiagonal();
    const Eigen::MatrixXd covariance = s2 * (scaled.transpose() * scaled).inverse();
    for (Eigen::Index k = 0; k < u.size(); ++k)
      CHECK(ours.parameters[static_cast<std::size_t>(k)].std_error ==
            Approx(size(k) * std::sqrt(covariance(k, k))).epsilon(1e-5));
  }
}
