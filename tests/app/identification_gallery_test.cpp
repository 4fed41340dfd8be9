// The problems that identify what made their records (data/make_identification_records.sh).
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "app/terminal/exit_code.hpp"
#include "core/scene/inertia_check.hpp"
#include "optim/problem/csv_table.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

nlohmann::json identified(const TemporaryFolder& folder, const std::string& name,
                          const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments{"identify", file_of(name).string(), "--out", folder.file("out"), "--quiet"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const CommandOutcome outcome = run_command(arguments);
  INFO(name << "\n" << outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  return json_of(folder.path / "out/result.json");
}

// Each within 3.5 standard errors of what made the record: noise that does worse comes once in 2000.
void check_against(const nlohmann::json& result, const std::map<std::string, double>& truth) {
  CHECK(result.at("parameters").size() == truth.size());
  for (const auto& [name, value] : truth) {
    const auto& p = result.at("parameters").at(name);
    INFO(name << ": " << p.at("value") << " +- " << p.at("std_error"));
    CHECK(std::abs(p.at("value").get<double>() - value) < 3.5 * p.at("std_error").get<double>());
    CHECK(p.at("at_bound").is_null());
  }
  CHECK(result.at("identifiability").at("unidentifiable").empty());
}

}  // namespace

TEST_CASE("a known load tells mass, stiffness and damping apart", "[gallery][identification]") {
  const TemporaryFolder folder;
  const auto result = identified(folder, "spring_damper/identify");
  check_against(result, {{"m", 4},
                         {"k", 250},
                         {"c", 3},
                         {"empty.x0", 0.12},
                         {"empty.v0", 0.05},
                         {"loaded.x0", 0.09},
                         {"loaded.v0", -0.1}});
  const auto& channel = result.at("experiments").at("loaded").at("channels").at("x");
  CHECK(channel.at("sigma_is_estimated") == true);
  CHECK(channel.at("sigma").get<double>() == Approx(0.001).epsilon(0.2));
  CHECK(channel.at("residuals").at("in_words") == "white");
}

TEST_CASE("without the load only ratios to the mass are determined, and that is said", "[gallery][identification]") {
  const TemporaryFolder folder;
  const auto result =
      identified(folder, "spring_damper/identify", {"--set", "identification.experiments[1].role=validate"});
  CHECK(result.at("identifiability").at("unidentifiable") ==
        nlohmann::json::array({"m, k, c: only m/c and k/c are determined"}));
  CHECK(result.at("parameters").at("m").at("std_error").is_null());
}

TEST_CASE("ten inertial numbers of a body come from the motion of two markers", "[gallery][identification]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  const auto result = identified(folder, "double_pendulum/identify_inertia");
  check_against(result, {{"m", 1.8},
                         {"cx", 0.03},
                         {"cy", -0.02},
                         {"cz", -0.25},
                         {"ex", 0.05},
                         {"ey", 0.08},
                         {"ez", 0.12},
                         {"sxy", 0.01},
                         {"sxz", -0.02},
                         {"syz", 0.015}});

  // All that the fit went through were possible bodies, also from a poor start.
  const TemporaryFolder poor;
  run_command({"identify", file_of("double_pendulum/identify_inertia").string(), "--out", poor.file("out"), "--quiet",
               "--set", "parameters.ex.value=0.3", "--set", "parameters.ez.value=0.02", "--set",
               "parameters.sxz.value=0.1", "--set", "identification.optimizer.max_iterations=8"});
  for (const TemporaryFolder* each : {&folder, &poor}) {
    const CsvTable history = read_csv(each->file("out/history.csv"));
    REQUIRE(history.rows() > 5);
    for (std::size_t row = 0; row < history.rows(); ++row) {
      const auto value = [&](const char* name) { return history.column(name)[row]; };
      const double m = value("m"), x = value("ex"), y = value("ey"), z = value("ez");
      const double xy = value("sxy"), xz = value("sxz"), yz = value("syz");
      const double Sxx = x * x + xy * xy + xz * xz, Syy = y * y + yz * yz, Szz = z * z;
      CHECK(m > 0);
      CHECK(inertia_problem(
                {m * (Syy + Szz), m * (Sxx + Szz), m * (Sxx + Syy), -m * (xy * y + xz * yz), -m * xz * z, -m * yz * z})
                .empty());
    }
  }
}

TEST_CASE("a damper's law, and how late its sensor is, come from two rides on roads of their own",
          "[gallery][identification]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const TemporaryFolder folder;
  const auto result = identified(folder, "damper/identify_law");
  check_against(result, {{"k", 18000}, {"c", 1500}, {"r", 600}, {"vs", 0.4}, {"tau", 0.012}});
  // The roads are found from the folder of the results, too.
  const CommandOutcome again =
      run_command({"identify", folder.file("out/optimized.json"), "--out", folder.file("again"), "--quiet", "--set",
                   "identification.optimizer.max_iterations=1"});
  CHECK(again.exit_code != kBadInput);
  CHECK(json_of(folder.path / "again/result.json").at("optimizer").at("objective_initial").get<double>() ==
        Approx(result.at("optimizer").at("objective_final").get<double>()).epsilon(1e-6));
  // With the road of the other ride the record is not explained.
  const CommandOutcome swapped =
      run_command({"identify", file_of("damper/identify_law").string(), "--out", folder.file("swapped"), "--quiet",
                   "--set", "identification.experiments[0].drives[0].law.csv=../../data/identification/road_fast.csv",
                   "--set", "identification.optimizer.max_iterations=3"});
  CHECK(json_of(folder.path / "swapped/result.json").at("optimizer").at("objective_final").get<double>() >
        100 * result.at("optimizer").at("objective_final").get<double>());
}

TEST_CASE("a gyroscope's drift and the clock of its logger come with the pendulum's numbers",
          "[gallery][identification]") {
  const TemporaryFolder folder;
  const auto result = identified(folder, "pendulum/gyroscope");
  check_against(result, {{"J", 0.00334},
                         {"k", 1.8e-4},
                         {"late", 0.03},
                         {"fast", 0.002},
                         {"offset", 0.05},
                         {"drift", 0.01},
                         {"swing.theta0", 1.52},
                         {"swing.omega0", 1.85}});
  // A clock that is as fast as the encoder's does not explain the rate.
  const TemporaryFolder other;
  const auto one_clock =
      identified(other, "pendulum/gyroscope", {"--set", "parameters.fast.lower=0", "--set", "parameters.fast.upper=0"});
  const auto rms = [](const nlohmann::json& r) {
    return r.at("experiments").at("swing").at("channels").at("omega").at("rms").get<double>();
  };
  CHECK(rms(result) < 0.022);
  CHECK(rms(one_clock) > 2 * rms(result));
}

TEST_CASE("friction comes from a run-down with gross errors, in a CSV file with decimal commas",
          "[gallery][identification]") {
  const TemporaryFolder folder;
  const auto result = identified(folder, "friction/identify", {"--recover", "3"});
  check_against(result, {{"coulomb", 1.2}, {"viscous", 0.05}, {"slip", 0.4}, {"run_down.omega0", 20}});
  CHECK(result.at("parameters").at("slip").at("prior").at("mean") == 0.5);
  CHECK(result.at("statistics").at("degrees_of_freedom") == 301 + 1 - 4);
  // 15 gross errors, and of the others the 18 % that are beyond 1.345 sigma.
  const double beyond = result.at("experiments").at("run_down").at("channels").at("omega").at("beyond_scale");
  CHECK(beyond == Approx(15 + 0.18 * 286).margin(20));

  // The fits of simulated records lie about the estimate.
  const auto& slip = result.at("recovery").at("slip");
  CHECK(slip.at("ci95").at(0).get<double>() < slip.at("mean").get<double>());
  CHECK(slip.at("ci95").at(1).get<double>() > slip.at("mean").get<double>());
  CHECK_THAT(content_of(folder.path / "out/report.html"),
             Contains("Are the residuals noise?") && Contains("(estimated)"));

  // The square believes the gross errors.
  const TemporaryFolder other;
  const auto squared = identified(other, "friction/identify", {"--set", "identification.loss.type=squared"});
  CHECK(std::abs(squared.at("parameters").at("coulomb").at("value").get<double>() - 1.2) >
        3 * std::abs(result.at("parameters").at("coulomb").at("value").get<double>() - 1.2));
  CHECK(squared.at("experiments").at("run_down").at("channels").at("omega").at("sigma").get<double>() > 0.3);
}

TEST_CASE("inverse dynamics: torques of the smoothed motion give the arm's numbers, and start the forward fit",
          "[gallery][identification]") {
  const TemporaryFolder folder;
  // Whatever the start, since the residuals are linear.
  const auto result = identified(folder, "double_pendulum/inverse_dynamics",
                                 {"--set", "parameters.h1.value=0.6", "--set", "parameters.J1.value=0.4", "--set",
                                  "parameters.h2.value=0.05", "--set", "parameters.coulomb1.value=0.6"});
  CHECK(result.at("optimizer").at("evaluations") <= 5);
  const std::map<std::string, double> truth{{"h1", 0.25}, {"J1", 0.06},      {"h2", 0.16},
                                            {"J2", 0.05}, {"coulomb1", 0.1}, {"coulomb2", 0.08}};
  std::vector<std::string> starts;
  for (const auto& [name, value] : truth) {
    INFO(name);
    const double found = result.at("parameters").at(name).at("value");
    CHECK(found == Approx(value).epsilon(name.starts_with("coulomb") ? 0.1 : 0.01));
    starts.insert(starts.end(), {"--set", "parameters." + name + ".value=" + std::to_string(found)});
  }
  const TemporaryFolder other;
  const auto forward = identified(other, "double_pendulum/identify_windows", starts);
  CHECK(forward.at("optimizer").at("evaluations") <= 6);
}

TEST_CASE("before the fit: what the columns hold, and what they would determine", "[identification][command]") {
  const TemporaryFolder folder;
  const auto result = identified(folder, "spring_damper/identify", {"--preflight"});
  const auto& channel = result.at("preflight").at("channels").at(1);
  CHECK(channel.at("experiment") == "loaded");
  CHECK(channel.at("samples") == 151);
  CHECK(channel.at("interval").get<double>() == Approx(0.02));
  CHECK(channel.at("largest_gap").get<double>() == Approx(0.02));
  CHECK(channel.at("rms_scaled").get<double>() > 1);
  // As the fit says, for the sigma that it finds: a tenth of the given one. The start is not the optimum.
  const TemporaryFolder other;
  const auto fit = identified(other, "spring_damper/identify", {"--recover", "3"});
  for (const char* name : {"m", "k", "c"})
    CHECK(result.at("preflight").at("parameters").at(name).at("predicted_std_error").get<double>() ==
          Approx(10 * fit.at("parameters").at(name).at("std_error").get<double>()).epsilon(0.6));
  CHECK(!result.contains("parameters"));
  CHECK(channel.at("unit") == "m");
  // The fit simulates its start without derivatives, so that its residuals differ by rounding.
  nlohmann::json of_fit = fit.at("preflight").at("channels"), of_preflight = result.at("preflight").at("channels");
  for (std::size_t k = 0; k < of_preflight.size(); ++k)
    CHECK(of_fit.at(k).at("rms_scaled").get<double>() ==
          Approx(of_preflight[k].at("rms_scaled").get<double>()).epsilon(1e-12));
  for (nlohmann::json* table : {&of_fit, &of_preflight})
    for (nlohmann::json& row : *table) row.erase("rms_scaled");
  CHECK(of_fit == of_preflight);
  CHECK(fit.at("covariance") == "white");
  CHECK(fit.at("recovery").at("m").at("truth") == fit.at("parameters").at("m").at("value"));
  CHECK(fit.at("recovery").at("m").at("fits") == 3);

  const TemporaryFolder without;
  const auto alone = identified(without, "spring_damper/identify",
                                {"--preflight", "--set", "identification.experiments[1].role=validate"});
  CHECK(alone.at("identifiability").at("unidentifiable") ==
        nlohmann::json::array({"m, k, c: only m/c and k/c are determined"}));
}

TEST_CASE("the table of columns leaves out what a fitted delay may take before the start, as the fit does",
          "[identification][command]") {
  const TemporaryFolder folder, other;
  const auto fit = identified(folder, "damper/identify_law"),
             only = identified(other, "damper/identify_law", {"--preflight"});
  for (std::size_t e = 0; e < 2; ++e) {
    const nlohmann::json &row = fit.at("preflight").at("channels").at(e),
                         &of_preflight = only.at("preflight").at("channels").at(e);
    const std::string name = row.at("experiment");
    CHECK(row.at("samples") == 199);  // of 201 rows
    CHECK(row.at("samples") == fit.at("experiments").at(name).at("channels").at("z").at("samples"));
    CHECK(row.at("samples") == of_preflight.at("samples"));
    CHECK(row.at("rms_scaled").get<double>() == Approx(of_preflight.at("rms_scaled").get<double>()).epsilon(1e-9));
  }
}

// Its angle wraps at 180 degrees, which is said; that it is in degrees, the header says.
TEST_CASE("a column that states its unit is not asked whether it is in degrees", "[identification][command]") {
  const TemporaryFolder folder;
  const auto result = identified(folder, "pendulum/motor",
                                 {"--preflight", "--set", "identification.experiments[1].channels[0].unwrap=false"});
  const std::string warnings = result.at("warnings").dump();
  CHECK_THAT(warnings, Contains("by about a turn") && !Contains("in degrees?"));
  CHECK(result.at("preflight").at("channels").at(1).at("unit") == "rad");
}

TEST_CASE("the standard errors that are asked for are given, or refused with the place", "[identification][command]") {
  const TemporaryFolder folder;
  const auto result = identified(folder, "spring_damper/identify", {"--set", "identification.covariance=newey_west"});
  CHECK(result.at("covariance") == "newey_west");
  CHECK(result.at("parameters").at("m").at("variance_inflation").get<double>() != 1);
  const TemporaryFolder one;
  const CommandOutcome outcome =
      run_command({"identify", file_of("friction/identify").string(), "--out", one.file("out"), "--quiet", "--set",
                   "identification.covariance=windows"});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("identification.covariance: is \"windows\", which compares experiments"));
  const CommandOutcome word =
      run_command({"validate", file_of("spring_damper/identify").string(), "--out", one.file("none"), "--set",
                   "identification.experiments[0].channels[0].estimate_sigma=sharde"});
  CHECK(word.exit_code == kBadInput);
  CHECK_THAT(word.err, Contains("estimate_sigma") && Contains("did you mean 'shared'?"));
}

TEST_CASE("fields of losses, priors, drives and inertia that make no sense are found with their place",
          "[identification][json]") {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& name, const std::string& set) {
    const CommandOutcome outcome =
        run_command({"validate", file_of(name).string(), "--out", folder.file("none"), "--set", set});
    CHECK(outcome.exit_code == kBadInput);
    return outcome.err;
  };
  CHECK_THAT(refusal("friction/identify", "identification.loss.scale=-1"),
             Contains("identification.loss.scale: is -1, it must be greater than 0"));
  CHECK_THAT(refusal("friction/identify", R"(identification.loss={"type": "squared", "scale": 2})"),
             Contains("identification.loss.scale: is given with the loss 'squared', which has none"));
  CHECK_THAT(refusal("friction/identify", "identification.loss.type=hubert"),
             Contains("identification.loss.type") && Contains("did you mean 'huber'?"));
  CHECK_THAT(refusal("friction/identify", "parameters.slip.prior.sigma=0"),
             Contains("parameters.slip.prior.sigma: is 0, it must be greater than 0"));
  CHECK_THAT(refusal("friction/identify", R"(parameters.slip.prior={"mean": 1})"),
             Contains("parameters.slip.prior.sigma: is missing"));
  CHECK_THAT(refusal("friction/identify", "identification.sigma_is_known=true"),
             Contains("identification.experiments[0].channels[0].estimate_sigma: asks for an estimate, but "
                      "identification.sigma_is_known is true"));
  CHECK_THAT(refusal("damper/identify_law", "identification.experiments[0].drives[0].drive=rode"),
             Contains("identification.experiments[0].drives[0].drive") && Contains("did you mean 'ride'?"));
  CHECK_THAT(refusal("damper/identify_law", "identification.experiments[1].drives[0].law.column=raod"),
             Contains("identification.experiments[1].drives[0].law.csv") && Contains("has no column 'raod'"));
  CHECK_THAT(refusal("damper/identify_law", "identification.experiments[0].channels[0].delay=1 [m]"),
             Contains("identification.experiments[0].channels[0].delay") && Contains("dimension"));
  CHECK_THAT(refusal("double_pendulum/identify_inertia", "bodies[1].inertia.consistent.y=2 [kg]"),
             Contains("bodies[1].inertia.consistent.y") && Contains("dimension"));
  CHECK_THAT(refusal("double_pendulum/identify_inertia", R"(bodies[1].inertia={"consistent": {"x": 1, "y": 1}})"),
             Contains("bodies[1].inertia.consistent.z: is missing"));
  CHECK_THAT(refusal("double_pendulum/identify_inertia",
                     R"(bodies[1].inertia={"consistent": {"x": 1, "y": 1, "z": 1}, "xx": 1})"),
             Contains("must be the only key"));
}
