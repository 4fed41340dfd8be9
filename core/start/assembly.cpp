#include "core/start/assembly.hpp"

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/constraint/unit_norm.hpp"
#include "core/linear/row_dependence.hpp"
#include "core/linear/sparse_projection.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/mechanism/rounded_loops.hpp"
#include "core/mechanism/sensor_gradient.hpp"
#include "core/projection/projection.hpp"
#include "core/start/assembly_equations.hpp"
#include "core/start/equilibrium.hpp"
#include "core/start/nearest_point.hpp"

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Triplet = Eigen::Triplet<double, Index>;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// pdot = 1/2 E(p)' omega_G as a matrix on p.
Mat<4, 4> rate_matrix(const Vector3d& omega_G) {
  Mat<4, 4> W;
  W << 0, -omega_G.transpose(), omega_G, skew(omega_G);
  return 0.5 * W;
}

// rdot = velocity + omega_G x A(p) com
VectorXd velocity_guess(const MechanismData& d, const VectorXd& q) {
  const StateLayout layout{d.n};
  VectorXd v(layout.positions());
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& body = d.bodies[at(i)];
    const Vector4d p = q.segment<4>(layout.p(i));
    v.segment<3>(layout.q(i)) = body.velocity + body.angular_velocity.cross(A(p) * body.com);
    v.segment<4>(layout.p(i)) = rate_matrix(body.angular_velocity) * p;
  }
  return v;
}

// Derivative of rows of a field: out += M (d field/d rho)
template <int Rows, int N>
void add_field(const MechanismData& d, int slot, const Mat<Rows, N>& M, Eigen::Ref<MatrixXd> out) {
  if (slot < 0) return;
  for (std::size_t k = 0; k < d.active.size(); ++k) {
    out.col(d.active[k]) += M * d.theta_rho.col(static_cast<Index>(k)).segment<N>(slot);
  }
}

MatrixXd position_guess_rho(const MechanismData& d) {
  const StateLayout layout{d.n};
  MatrixXd out = MatrixXd::Zero(layout.positions(), d.rho.size());
  for (int i = 1; i <= d.n; ++i) {
    add_field<7, 7>(d, d.bodies[at(i)].slot_q, Mat<7, 7>::Identity(), out.middleRows(layout.q(i), 7));
  }
  return out;
}

// Adds the blocks of each body in its own p to v_q.
void add_velocity_guess_derivatives(const MechanismData& d, const VectorXd& q, std::vector<Triplet>& v_q,
                                    MatrixXd& v_rho) {
  const StateLayout layout{d.n};
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& body = d.bodies[at(i)];
    const Vector4d p = q.segment<4>(layout.p(i));
    const Matrix3d W = skew(body.angular_velocity);
    const Vector3d arm = A(p) * body.com, e = p.tail<3>();
    Mat<7, 4> of_p;
    of_p << W * N(p, body.com), rate_matrix(body.angular_velocity);
    for (Index r = 0; r < 7; ++r)
      for (Index c = 0; c < 4; ++c) v_q.emplace_back(layout.q(i) + r, layout.p(i) + c, of_p(r, c));
    Mat<7, 3> from_omega;
    from_omega.topRows<3>() = -skew(arm);
    from_omega.row(3) = -0.5 * e.transpose();
    from_omega.bottomRows<3>() = 0.5 * (p(0) * Matrix3d::Identity() - skew(e));
    add_field<3, 3>(d, body.slot_velocity, Matrix3d::Identity(), v_rho.middleRows(layout.q(i), 3));
    add_field<3, 3>(d, body.slot_com, W * A(p), v_rho.middleRows(layout.q(i), 3));
    add_field<7, 3>(d, body.slot_angular_velocity, from_omega, v_rho.middleRows(layout.q(i), 7));
  }
}

}  // namespace

struct Assembly::Solution {
  Solution(const Mechanism& m, double t, Modes sought)
      : mechanism(m),
        start(t),
        modes(sought),
        data(m.data()),
        layout{data.n},
        position(data, AssemblyLevel::position, t),
        velocity(data, AssemblyLevel::velocity, t) {
    solve();
    if (!result.ok && !data.rounded.made && !data.rounded.joints.empty()) result.message += "; " + in_words(data);
    set_angles();
  }

  void solve() {
    const Index N = layout.positions();
    result.y = VectorXd::Zero(2 * N);
    const VectorXd guess = position_guess(data);
    result.y.head(N) = guess;
    position.start_branches(result.y);
    if (solve_in_plane()) return;
    if (modes == Modes::of_guess) {
      result.message = "the mechanism does not close in the assembly mode of its guess";
      return;
    }
    if (!find(position, guess, q, result.y.head(N))) return;
    if (data.equilibrium) return rest_in_equilibrium();
    velocity.set_angles(position.followed_angles());
    velocity.hold(q->x);
    result.ok = find(velocity, velocity_guess(data, q->x), v, result.y.tail(N));
  }

  // Finds the unknowns of one level. Returns false with a message if there is no point nearest to their guess.
  bool find(AssemblyEquations& equations, const VectorXd& guess, std::optional<NearestPoint>& point,
            Eigen::Ref<VectorXd> unknowns) {
    point.emplace(nearest_point(equations, guess, data.assembly_iterations));
    unknowns = point->x;
    result.iterations += point->iterations;
    if (point->F.size() > 0) result.residual = std::max(result.residual, point->F.lpNorm<Eigen::Infinity>());
    if (point->status == NearestPointStatus::found) return true;
    result.message = assembly_failure(data, equations, *point);
    return false;
  }

  // Takes damped Newton steps on three unknowns per body if a planar mechanism has no freedom. They lead to the
  // assembly mode of the guess, in the sense of the sign of det Phi_q. Returns false if they do not converge or violate
  // an equation: the guess may lie out of the plane.
  bool solve_in_plane() {
    constexpr double kSatisfied = 1e-11;  // of the equations, per unit of y, as in nearest_point.cpp
    const bool determined = data.planar && data.planar->rows.size() == 3 * at(data.n);
    if (!determined || data.equilibrium || !position.targets().empty() || !velocity.targets().empty()) return false;
    const Index N = layout.positions();
    VectorXd y_guess = result.y, y = result.y;
    y_guess.tail(N) = velocity_guess(data, result.y.head(N));
    const std::unique_ptr<Projector> projector =
        make_projector(mechanism, Projection::position_velocity, Model::planar, Free::nothing);
    if (!projector->assemble(start, position.angles(), y_guess, y)) return false;
    const auto found = [&](const AssemblyEquations& equations, const VectorXd& x) {
      NearestPoint point;
      point.status = NearestPointStatus::found;
      point.determined = true;
      point.linearised = false;
      point.x = x;
      point.F = equations.values_at(y);
      point.nu = VectorXd::Zero(point.F.size());
      return point;
    };
    const NearestPoint at = found(position, y.head(N)), moving = found(velocity, y.tail(N));
    const double left = std::max(at.F.lpNorm<Eigen::Infinity>(), moving.F.lpNorm<Eigen::Infinity>());
    if (!(left <= kSatisfied * (1 + y.lpNorm<Eigen::Infinity>()))) return false;
    position.accept(y.head(N));
    velocity.hold(y.head(N));
    velocity.set_angles(position.followed_angles());
    result.y = y;
    result.residual = left;
    result.iterations = static_cast<int>(projector->factorisations());
    q = at;
    v = moving;
    return result.ok = result.in_mode = true;
  }

  // Moves from the nearest position that closes the joints to the equilibrium nearest to it.
  void rest_in_equilibrium() {
    position.start_branches(result.y);
    equilibrium = static_equilibrium(mechanism, start, q->x, position.angles());
    result.iterations += equilibrium.iterations;
    result.y.head(layout.positions()) = equilibrium.q;
    result.ok = equilibrium.ok;
    result.message = equilibrium.message;
  }

  // A condition's angle is on the turn that the condition names, so that a measured angle starts at its measured value.
  // Other angles are within half a turn of zero, and the last angle of a gear is on the branch that the gear needs. A
  // condition on an expression of angles may hold only on other turns; angles then keep those to which they were
  // continued.
  void set_angles() {
    if (equilibrium.ok) return void(result.angles = equilibrium.angles);  // the forces balance at these
    const VectorXd continued = position.followed_angles();
    position.start_branches(result.y);
    const auto is_turned = [&](const AssemblyTarget& target) {
      return target.sensor()->angle() < 0 && evaluate(data, target.sensor(), start, result.y, continued) !=
                                                 evaluate(data, target.sensor(), start, result.y, position.angles());
    };
    if (std::ranges::any_of(position.targets(), is_turned)) position.set_angles(continued);
    result.angles = position.angles();
    for (const AssemblyTarget& target : position.targets()) {
      if (target.sensor()->angle() < 0) continue;
      double& angle = result.angles(target.sensor()->angle());
      angle = Angle::on_branch(angle, target.condition->value);
    }
    position.settle_shared_rows(result.y, result.angles);
  }

  // Both linear systems (nearest_point_linearisation.hpp). The right-hand sides of v need q' as well:
  //   J_q q' = -q_F_rho,           H_q q' + .. = q_g_rho
  //   J_v v' = -F_q q' - F_rho,    H_v v' + .. = g_q q' + g_rho
  struct Derivatives {
    std::vector<SparseEntry> q_J, v_J;
    MatrixXd q_b_rho, q_g_rho, v_b_rho, v_g_rho;
    Eigen::SparseMatrix<double> v_b_q, v_g_q;  // -F_q and g_q at velocity level
  };
  Derivatives derivatives() const {
    const Index N = layout.positions(), P = data.rho.size();
    const auto is_free = [](const NearestPoint& point) {
      return !point.linearised || point.linearisation.null_space().cols() > 0;
    };
    Derivatives d;
    d.q_J = position.entries(result.y, &d.q_b_rho);
    std::vector<Triplet> b_q, g_q;
    for (const SparseEntry& e : velocity.entries(result.y, &d.v_b_rho)) {
      if (e.column < N)
        b_q.emplace_back(e.row, e.column, -e.value);
      else
        d.v_J.push_back({e.row, static_cast<int>(e.column - N), e.value});
    }
    d.q_b_rho *= -1;
    d.v_b_rho *= -1;
    d.q_g_rho = d.v_g_rho = MatrixXd::Zero(N, P);
    if (is_free(*q)) d.q_g_rho = position_guess_rho(data);
    if (is_free(*q) && q->nu.any()) d.q_g_rho -= position.second(result.y, q->nu).rho;
    if (is_free(*v)) add_velocity_guess_derivatives(data, q->x, g_q, d.v_g_rho);
    d.v_b_q.resize(velocity.rows(), N);
    d.v_b_q.setFromTriplets(b_q.begin(), b_q.end());
    d.v_g_q.resize(N, N);
    d.v_g_q.setFromTriplets(g_q.begin(), g_q.end());
    if (!is_free(*v) || !v->nu.any()) return d;
    const AssemblyEquations::Gradients S = velocity.second(result.y, v->nu);  // of J_v'nu
    d.v_g_q -= Eigen::SparseMatrix<double>(S.y.leftCols(N).sparseView());
    d.v_g_rho -= S.rho;
    return d;
  }
  struct Tangents {
    MatrixXd q, v, v_b_of_q, v_g;  // q', v' and the right-hand sides of v': -F_q q', g_q q' + g_rho
  };
  template <class System>
  static Tangents tangents(const System& q, const System& v, const Derivatives& d) {
    Tangents t;
    t.q = q.solve(d.q_b_rho, d.q_g_rho);
    t.v_b_of_q = d.v_b_q * t.q;
    t.v_g = d.v_g_rho + d.v_g_q * t.q;
    t.v = v.solve(t.v_b_of_q + d.v_b_rho, t.v_g);
    return t;
  }

  // Calls f(q, v, derivatives): q and v solve the linear systems. Sparse factors differentiate a large mechanism whose
  // guess satisfies everything, in the time of a few steps. The dense decomposition takes as long as a run.
  static constexpr int kManyBodies = 12;
  template <class F>
  void with_systems(F&& f) {
    const Index N = layout.positions();
    if (data.n >= kManyBodies && !q->linearised && !v->linearised) {
      const Derivatives d = derivatives();
      return f(SparseProjection(position.rows(), N, d.q_J), SparseProjection(velocity.rows(), N, d.v_J), d);
    }
    linearise(position, *q);
    linearise(velocity, *v);
    f(q->linearisation, v->linearisation, derivatives());
  }

  const Mechanism mechanism;
  double start;
  Modes modes;
  const MechanismData& data;
  const StateLayout layout;
  Equilibrium equilibrium;  // set if the scene starts from one
  AssemblyEquations position, velocity;
  std::optional<NearestPoint> q, v;
  AssemblyResult result;
};

Assembly::Assembly(const Mechanism& mechanism, double start_time, Modes modes)
    : solution_(std::make_unique<Solution>(mechanism, start_time, modes)) {}
Assembly::Assembly(Assembly&&) noexcept = default;
Assembly::~Assembly() = default;

const AssemblyResult& Assembly::result() const { return solution_->result; }

MatrixXd Assembly::tangent() const {
  Solution& s = *solution_;
  if (!s.result.ok) return MatrixXd::Constant(s.result.y.size(), s.data.rho.size(), kNaN);
  MatrixXd y_rho = MatrixXd::Zero(s.result.y.size(), s.data.rho.size());
  if (s.data.equilibrium) {
    y_rho.topRows(s.layout.positions()) = s.equilibrium.q_rho;
    return y_rho;
  }
  s.with_systems([&](const auto& q, const auto& v, const Solution::Derivatives& d) {
    const Solution::Tangents t = Solution::tangents(q, v, d);
    y_rho << t.q, t.v;
  });
  return y_rho;
}

void Assembly::add_adjoint(const MatrixXd& y_bar, MatrixXd& rho_bar) const {
  Solution& s = *solution_;
  if (!s.result.ok) {
    rho_bar.setConstant(kNaN);
    return;
  }
  const Index N = s.layout.positions();
  if (s.data.equilibrium) {
    rho_bar += s.equilibrium.q_rho.transpose() * y_bar.topRows(N);
    return;
  }
  s.with_systems([&](const auto& q, const auto& v, const Solution::Derivatives& d) {
    MatrixXd b_bar, g_bar;
    v.solve_transposed(y_bar.bottomRows(N), b_bar, g_bar);
    rho_bar += d.v_b_rho.transpose() * b_bar + d.v_g_rho.transpose() * g_bar;
    const MatrixXd q_bar = y_bar.topRows(N) + d.v_b_q.transpose() * b_bar + d.v_g_q.transpose() * g_bar;
    q.solve_transposed(q_bar, b_bar, g_bar);
    rho_bar += d.q_b_rho.transpose() * b_bar + d.q_g_rho.transpose() * g_bar;
  });
}

std::vector<int> Assembly::obstructed() const {
  Solution& s = *solution_;
  if (!s.result.ok) return {};
  const double kOpen = std::max(1e-7, 1e3 * s.data.rounded.part);  // of b: assembly leaves a loop open by far less
  constexpr double kRounding = 1e-12;                              // of b, in the units of J: sin(pi) is not zero
  std::vector<int> parameters;
  // Adds the columns of b that x leaves: J x = b has no solution. b is the sum of pieces, which may cancel.
  const auto add = [&](const auto& system, const MatrixXd& x, std::initializer_list<MatrixXd> pieces) {
    MatrixXd b = *pieces.begin();
    if (pieces.size() > 1) b += *(pieces.begin() + 1);
    if (b.rows() == 0) return;
    const VectorXd& scale = system.row_scale();
    const MatrixXd left = system.left(b, x);
    for (Index k = 0; k < b.cols(); ++k) {
      double size = 0;
      for (const MatrixXd& piece : pieces) size += scale.cwiseProduct(piece.col(k)).norm();
      if (left.col(k).norm() > kOpen * size + kRounding * scale.maxCoeff()) parameters.push_back(static_cast<int>(k));
    }
  };
  if (s.data.equilibrium) {
    const AssemblyEquations::Gradients F = s.position.gradients(s.result.y);
    const MatrixXd J = F.y.leftCols(s.layout.positions());
    const NearestPointLinearisation q(J, s.position.sizes(J));
    add(q, q.pseudo_inverse_times(-F.rho), {-F.rho});
  } else {
    s.with_systems([&](const auto& q, const auto& v, const Solution::Derivatives& d) {
      const Solution::Tangents t = Solution::tangents(q, v, d);
      add(q, t.q, {d.q_b_rho});
      add(v, t.v, {t.v_b_of_q, d.v_b_rho});
    });
  }
  std::ranges::sort(parameters);
  parameters.erase(std::unique(parameters.begin(), parameters.end()), parameters.end());
  return parameters;
}

double Assembly::rounding() const {
  Solution& s = *solution_;
  if (!s.result.ok || s.data.equilibrium || s.data.n >= Solution::kManyBodies) return 0;
  double rounding = 0;
  s.with_systems([&]<class System>(const System& q, const System& v, const Solution::Derivatives& d) {
    if constexpr (std::is_same_v<System, NearestPointLinearisation>) {
      const Solution::Tangents t = Solution::tangents(q, v, d);
      rounding = std::max(q.rounding(t.q, d.q_g_rho), v.rounding(t.v, t.v_g));
    }
  });
  return rounding;
}

std::string Assembly::equilibrium_warning() const {
  const Solution& s = *solution_;
  if (!s.equilibrium.ok) return {};
  return mbsopt::equilibrium_warning(s.mechanism, s.start, s.equilibrium.q, s.equilibrium.angles);
}

int Assembly::degrees_of_freedom() const {
  const Solution& s = *solution_;
  const bool joints_alone = s.position.targets().empty();
  return s.q && s.q->determined && joints_alone ? 0 : summary().degrees_of_freedom;
}

// Takes rows in file order, unit norms first. A row in the span of earlier rows is redundant.
ModelSummary Assembly::summary() const {
  const MechanismData& d = solution_->data;
  const int equations = d.m + d.n, coordinates = static_cast<int>(solution_->layout.positions());
  const auto place = [&](int row) { return row < d.m ? row + d.n : row - d.m; };
  std::vector<SparseEntry> J = solution_->position.entries(solution_->result.y);
  std::erase_if(J, [&](const SparseEntry& e) { return e.row >= equations || e.column >= coordinates; });
  for (SparseEntry& e : J) e.row = place(e.row);
  const RowDependence found = row_dependence(equations, d.n, 7, J, NearestPointLinearisation::kRankThreshold);
  const std::size_t joints = d.joint_names.size();
  std::vector<int> rows(joints + d.drive_names.size(), 0), redundant(rows.size(), 0);
  int next_row = 0;
  for (const Constraint& c : d.constraints) {
    if (c.row < next_row) continue;  // a further term of a row already seen
    next_row = c.row + c.rows();
    const std::size_t owner = c.drive >= 0 ? joints + at(c.drive) : at(c.joint);
    rows[owner] += c.rows();
    for (int i = 0; i < c.rows(); ++i) redundant[owner] += found.independent[at(place(c.row + i))] ? 0 : 1;
  }
  ModelSummary summary;
  summary.bodies = d.n;
  summary.equations = equations;
  summary.rank = found.rank;
  summary.degrees_of_freedom = coordinates - summary.rank;
  for (std::size_t j = 0; j < rows.size(); ++j) {
    if (redundant[j] == 0) continue;
    summary.redundant.push_back((j < joints ? d.joint_names[j] : d.drive_names[j - joints]) + " (" +
                                std::to_string(redundant[j]) + " of " + std::to_string(rows[j]) + ")");
  }
  return summary;
}

}  // namespace mbsopt
