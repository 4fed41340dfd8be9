// A whole problem as plain data: scene, objectives and tasks. The reader in app/ fills it from a file; a C++ user may
// fill it by hand.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/run/cost.hpp"
#include "core/scene/scene.hpp"
#include "optim/problem/objective_kinds.hpp"
#include "optim/solver/robust_loss.hpp"

namespace mbsopt::inline optim {

struct ObjectiveSample {
  double time = 0;   // [s]
  Expression value;  // of t, sensors and parameters
};

// An eigenvalue of one mode of the motion near the initial state, an equilibrium (docs/linearisation.md).
struct EigenvalueSpec {
  std::optional<int> mode;          // from slow to fast, at the values of the file; the first
  std::string value = "frequency";  // [Hz], or "damping": its ratio; "least_" before it: the least of all modes
};

// The response to an input that swings, near the initial state (frequency_response.hpp).
struct FrequencyResponseSpec {
  std::string input, output;           // a parameter that acts through forces; a sensor
  std::string value = "max";           // or "rms", in the band; "amplitude" or "phase" at a frequency
  std::optional<double> from, to, at;  // [Hz]
  double spectrum = 1;                 // of the input, for rms [unit^2/Hz]
};

// The instant of a tracked row: its time, the instant nearest to it, or the nearest in the order of the rows.
enum class Timing { prescribed, free, ordered };

// Samples for a sensor to follow: adds the sum over the rows k of a file of weight (sensor(t_k) - column_k)^2.
struct TrackTerm : SampleColumn {
  std::string sensor;
  Field weight = 1.0;                  // of parameters
  Timing timing = Timing::prescribed;  // else the curve is over rows, from 0 (free_instants.hpp)
};

// Costs written in C++, by their name. Their rho holds their own parameters, in the order of this list. Their y is that
// of the bodies: (q, v), 7 numbers each per body.
struct UserCostSpec {
  std::string cost;
  std::vector<std::string> bodies;        // when empty all, in the order of the scene
  std::vector<TermParameter> parameters;  // the reader of the file puts them into the order of the term
  std::shared_ptr<const RunningCost> running = {};
  std::shared_ptr<const TerminalCost> terminal = {};
};

// psi = integral of running + terminal at the end time + sum of samples and track + parameters_only. Or it is, alone,
// one of the means of objective_kinds.hpp, an eigenvalue or a frequency response.
struct ObjectiveSpec {
  std::string name;
  std::optional<Expression> running, terminal, parameters_only;
  std::vector<ObjectiveSample> samples;
  std::vector<TrackTerm> track;
  Means means;
  std::optional<EigenvalueSpec> eigenvalue;  // alone
  std::optional<FrequencyResponseSpec> frequency_response;
  std::optional<double> sharpness;  // of an extreme [1/unit of the expression]
  static constexpr double kSharpness = 100;
  // Costs in C++ that replace all of the above. No file has them, but design, check and the others take them.
  std::shared_ptr<const RunningCost> running_in_cpp = {};
  std::shared_ptr<const TerminalCost> terminal_in_cpp = {};
  std::optional<UserCostSpec> user = {};  // the same by its name, in a file
  bool is_written_in_cpp() const { return running_in_cpp || terminal_in_cpp || user; }

  bool is_extreme() const { return mbsopt::is_extreme(means); }  // has a sharpness
  std::optional<Expression>& mean(std::string_view kind) { return mean_of(means, kind); }
};

// A limit on a named objective, or on a mean of an expression without a name (bounded_means.hpp).
struct ObjectiveBound {
  std::string objective;
  std::optional<double> lower = {}, upper = {};
  Means means = {};
  std::optional<double> sharpness = {};  // when absent kSharpness over the size of the bounds
  static constexpr double kSharpness = 100;
  std::optional<Expression> sampled = {};  // a limit at start_time + k every
  std::optional<double> every = {};        // [s]
};

// Whether a lower and an upper bound are one value.
bool is_equality(const auto& bound) { return bound.lower && bound.upper && *bound.lower == *bound.upper; }

struct OptimizerSpec {
  static constexpr const char* kLeastSquares = "least_squares";
  static constexpr const char* kAutomatic = "auto";
  std::string type = kAutomatic;  // or ipopt, sqp, least_squares (tracked_squares.hpp), or a method of NLopt
  double tolerance = 1e-6;
  std::optional<long> max_iterations;   // ipopt: 100 when absent
  std::optional<long> max_evaluations;  // NLopt: depends on the method, nlopt_solver.hpp
  std::string hessian = "lbfgs";        // of ipopt; or "exact", "gauss_newton"
  std::optional<long> seed;             // of methods that are random; drawn when absent
  bool warm_start = false;              // of ipopt: the given values are near the solution
  std::optional<long> lbfgs_history;    // pairs kept, 1 to 1000; of ipopt (20 when absent), lbfgs and mlsl
  static constexpr int kIpoptIterations = 100;
  // A field of ipopt asks for it.
  bool asks_for_ipopt() const {
    return type == "ipopt" || (type == kAutomatic && (hessian != "lbfgs" || warm_start || lbfgs_history));
  }
  bool is_sqp() const { return type == "sqp" || (type == kAutomatic && !asks_for_ipopt()); }
  std::string chosen() const { return is_sqp() ? "sqp" : asks_for_ipopt() ? "ipopt" : type; }
};

enum class StartSampling { latin_hypercube, sobol };

// Runs from several starts: first the given values, then points between the bounds.
struct MultistartSpec {
  int starts = 20;
  std::optional<long> seed;  // drawn when absent
  StartSampling sampling = StartSampling::latin_hypercube;
  bool all_branches = false;     // of a design: each start in every assembly mode
  bool until_all_found = false;  // `starts` are the most: an estimate of the optima that are left ends them before
};

// A drive that follows another law in one experiment or load case.
struct DriveLaw {
  std::string drive;
  Expression law;
  std::optional<SampledLaw> samples;
};

// Samples of a signal in one experiment or load case, which replace its own.
struct SignalSamples : SampleColumn {
  std::string name;  // of the signal
};

// One of several loads of a design: its differences from the problem.
struct CaseSpec {
  std::string name;
  double weight = 1;                       // factor of the minimised objective
  std::vector<Definition> overrides = {};  // parameters, as expressions of the parameters of the problem
  std::vector<DriveLaw> drives = {};       // instead of the scene's laws
  std::vector<SignalSamples> signals = {};
  std::vector<Condition> conditions = {};  // of the start; each replaces the scene's condition on its sensor
  std::optional<double> end_time = {};
};

// A part of a sum that is minimised: a named objective, or a mean of an expression (bounded_means.hpp).
struct WeightedObjective {
  std::string objective;
  double weight = 1;
  Means means = {};
};

struct DesignSpec {
  std::string minimize;                      // an objective; or, with minimize empty, one of the next three
  std::string maximize = {};                 // an objective
  std::vector<WeightedObjective> sum;        // that is minimised
  std::vector<std::string> largest_of;       // the largest of these objectives is minimised
  std::string over = "sum";                  // of load cases; or "max", smooth
  std::optional<double> sharpness = {};      // of this maximum [1/unit of the objective]
  static constexpr double kSharpness = 100;  // when absent: this over the largest value at the start
  std::vector<ObjectiveBound> subject_to;
  std::vector<std::string> variables;  // parameter names
  OptimizerSpec optimizer;
  std::optional<MultistartSpec> multistart;

  // Returns the terms whose weighted sum, or largest, is minimised. To maximise f is to minimise -f.
  std::vector<WeightedObjective> terms() const;
  double sign() const { return maximize.empty() ? 1 : -1; }
  std::string name() const;  // of what is sought: "comfort", "mass + 0.01 travel", "largest of a, b"
  bool uses(const std::string& objective) const;
};

// A channel's sigma is given (none), estimated in each experiment (own), or estimated for all channels of its column
// (shared).
enum class SigmaEstimate { none, own, shared };

struct ChannelSpec {
  std::string column, sensor;
  std::string unit = {};                               // instead of the one in the header; empty: this, else SI
  bool unwrap = false;                                 // the column jumps by turns, which the sensor counts
  Field sigma = 1.0, gain = 1.0, bias = 0.0;           // expressions over parameters
  Field delay = 0.0;                                   // [s]; gain, bias and delay may also use t and signals
  SigmaEstimate estimate_sigma = SigmaEstimate::none;  // sigma is where the estimate starts
};

// Cuts an experiment into windows, each with a start of its own (optim/fit/windows.hpp).
struct WindowsSpec {
  double length = 1;                           // [s]
  std::optional<double> start_time, end_time;  // instead of the experiment's
  bool continuity = false;                     // each ends where the next one starts
};

// The experiment and window of the problem file that an experiment is made from.
struct WindowOrigin {
  std::string experiment;  // its name
  std::size_t number = 1;  // from 1
  bool continues = false;  // into the next experiment: its end is the start of that
};

struct ExperimentSpec {
  std::string name;
  std::vector<std::string> data;               // CSV files, resolved against the problem file's folder
  std::string time = "t";                      // their time column
  std::string time_unit = {};                  // unit of the times, as in SampleColumn
  std::optional<double> time_zero = {};        // as of a SampleColumn; first: of the first file
  std::optional<double> start_time, end_time;  // instead of the simulation's; rows outside are left out
  std::vector<ChannelSpec> channels;
  std::vector<std::pair<std::string, double>> overrides;  // parameter values of this experiment
  std::vector<SignalSamples> signals;                     // of this experiment, instead of the scene's
  std::vector<DriveLaw> drives;                           // of this experiment, instead of the scene's laws
  std::vector<std::string> free;                          // parameters with a value of their own here
  std::optional<WindowsSpec> windows = {};                // its windows
  std::optional<WindowOrigin> origin = {};                // set if it is a window
  std::string place = {};                                 // path in the problem file; empty: by its number
  bool validate = false;                                  // role: scored (only "free" refitted), not fitted
};

// The assumption of standard errors on the residuals: independent noise, noise that is correlated in time, or noise
// that is independent between experiments only. `automatic` decides by tests of the residuals.
enum class CovarianceType { automatic, white, newey_west, windows };

struct IdentificationSpec {
  std::vector<ExperimentSpec> experiments;
  std::vector<std::string> variables;
  bool sigma_is_known = false;
  CovarianceType covariance = CovarianceType::automatic;
  Loss loss;
  std::optional<MultistartSpec> multistart;
  double tolerance = 1e-10;
  int max_iterations = 100;
};

struct Problem {
  Scene scene;
  std::vector<ObjectiveSpec> objectives;
  std::vector<CaseSpec> cases;  // load_cases.hpp
  std::optional<DesignSpec> design;
  std::optional<IdentificationSpec> identification;
  std::vector<std::string> plugins = {};       // shared libraries of named_terms.hpp, resolved as data files are
  std::vector<std::string> columns_read = {};  // conversions to SI, in words
};

}  // namespace mbsopt::inline optim
