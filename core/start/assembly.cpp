#include "core/start/assembly.hpp"

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
#include "core/projection/projection.hpp"
#include "core/start/assembly_equations.hpp"
#include "core/start/assembly_problems.hpp"
#include "core/start/assembly_report.hpp"
#include "core/start/equilibrium.hpp"
#include "core/start/nearest_point.hpp"

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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

// v_q holds a block per body in its own p; that of the ground is not set.
void velocity_guess_derivatives(const MechanismData& d, const VectorXd& q, std::vector<Mat<7, 4>>& v_q,
                                MatrixXd& v_rho) {
  const StateLayout layout{d.n};
  v_q.resize(d.bodies.size());
  v_rho = MatrixXd::Zero(q.size(), d.rho.size());
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& body = d.bodies[at(i)];
    const Vector4d p = q.segment<4>(layout.p(i));
    const Matrix3d W = skew(body.angular_velocity);
    const Vector3d arm = A(p) * body.com, e = p.tail<3>();
    v_q[at(i)] << W * N(p, body.com), rate_matrix(body.angular_velocity);
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
    PositionProblem positions(position);
    const VectorXd guess = position_guess(data);
    result.y.head(N) = guess;
    position.start_branches(result.y);
    if (solve_in_plane()) return;
    if (modes == Modes::of_guess) {
      result.message = "the mechanism does not close in the assembly mode of its guess";
      return;
    }
    q.emplace(nearest_point(positions, guess, data.assembly_iterations));
    result.y.head(N) = q->x;
    result.iterations = q->iterations;
    result.residual = q->F.size() > 0 ? q->F.lpNorm<Eigen::Infinity>() : 0.0;
    if (q->status != NearestPointStatus::found) {
      result.message = assembly_failure(data, AssemblyLevel::position, position, *q);
      return;
    }
    if (data.equilibrium) return rest_in_equilibrium();
    velocity.set_angles(position.followed_angles());
    VelocityProblem velocities(velocity, q->x);
    v.emplace(nearest_point(velocities, velocity_guess(data, q->x), data.assembly_iterations));
    result.y.tail(N) = v->x;
    result.iterations += v->iterations;
    result.residual = std::max(result.residual, v->F.lpNorm<Eigen::Infinity>());
    if (v->status != NearestPointStatus::found) {
      result.message = assembly_failure(data, AssemblyLevel::velocity, velocity, *v);
      return;
    }
    result.ok = true;
  }

  // Takes damped Newton steps on three unknowns per body if a planar mechanism has no freedom. They lead to the
  // assembly mode of the guess, in the sense of the sign of det Phi_q. Returns false if they do not converge or violate
  // an equation: the guess may lie out of the plane.
  bool solve_in_plane() {
    constexpr double kSatisfied = 1e-11;  // of the equations, per unit of y, as in nearest_point.cpp
    const bool determined = data.planar && data.planar->rows.size() == 3 * static_cast<std::size_t>(data.n);
    if (!determined || data.equilibrium || !position.targets().empty() || !velocity.targets().empty()) return false;
    const Index N = layout.positions();
    VectorXd y_guess = result.y, y = result.y;
    y_guess.tail(N) = velocity_guess(data, result.y.head(N));
    const std::unique_ptr<Projector> projector =
        make_projector(mechanism, Projection::position_velocity, Model::planar, Free::nothing);
    if (!projector->assemble(start, position.angles(), y_guess, y)) return false;
    const auto found = [&](const AssemblyEquations& equations, const VectorXd& x) {
      NearestPoint point;
      point.status = NearestPointStatus::found, point.determined = true, point.linearised = false;
      point.x = x, point.F = equations.values(y), point.nu = VectorXd::Zero(point.F.size());
      return point;
    };
    const NearestPoint at = found(position, y.head(N)), moving = found(velocity, y.tail(N));
    const double left = std::max(at.F.lpNorm<Eigen::Infinity>(), moving.F.lpNorm<Eigen::Infinity>());
    if (!(left <= kSatisfied * (1 + y.lpNorm<Eigen::Infinity>()))) return false;
    position.continue_branches(y);
    velocity.set_angles(position.followed_angles());
    result.y = y, result.residual = left, result.iterations = static_cast<int>(projector->factorisations());
    q = at, v = moving;
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

  // Sparse factors differentiate a large mechanism whose guess satisfies everything, in the time of a few steps. The
  // dense decomposition below takes as long as a run.
  struct Sparse {
    SparseProjection q, v;
    std::vector<SparseEntry> v_b_q;  // -F_q at velocity level
    MatrixXd q_b_rho, q_g_rho, v_b_rho, v_g_rho;
    std::vector<Mat<7, 4>> v_g_q;  // per body, in its own p
  };
  static constexpr int kManyBodies = 12;
  bool is_sparse() const { return data.n >= kManyBodies && !q->linearised && !v->linearised; }
  Sparse sparse_derivatives() const {
    const Index N = layout.positions();
    AssemblyEquations::SparseGradients F = position.sparse_gradients(result.y), G = velocity.sparse_gradients(result.y);
    std::vector<SparseEntry> G_q, G_v;
    for (const SparseEntry& e : G.y) {
      if (e.column < N) {
        G_q.push_back({e.row, e.column, -e.value});
      } else {
        G_v.push_back({e.row, static_cast<int>(e.column - N), e.value});
      }
    }
    Sparse s{SparseProjection(position.rows(), N, F.y),
             SparseProjection(velocity.rows(), N, G_v),
             std::move(G_q),
             -F.rho,
             position_guess_rho(data),
             -G.rho,
             {},
             {}};
    velocity_guess_derivatives(data, q->x, s.v_g_q, s.v_g_rho);
    return s;
  }
  MatrixXd sparse_tangent() const {
    const Sparse s = sparse_derivatives();
    const MatrixXd q_rho = s.q.solve(s.q_b_rho, s.q_g_rho);
    MatrixXd b = s.v_b_rho, g = s.v_g_rho;
    for (const SparseEntry& e : s.v_b_q) b.row(e.row) += e.value * q_rho.row(e.column);
    for (int i = 1; i <= data.n; ++i) {
      g.middleRows<7>(layout.q(i)) += s.v_g_q[at(i)] * q_rho.middleRows<4>(layout.p(i));
    }
    MatrixXd y_rho(result.y.size(), data.rho.size());
    y_rho << q_rho, s.v.solve(b, g);
    return y_rho;
  }
  void add_sparse_adjoint(const MatrixXd& y_bar, MatrixXd& rho_bar) const {
    const Sparse s = sparse_derivatives();
    const Index N = layout.positions();
    MatrixXd b_bar, g_bar, q_bar = y_bar.topRows(N);
    s.v.solve_transposed(y_bar.bottomRows(N), b_bar, g_bar);
    rho_bar += s.v_b_rho.transpose() * b_bar + s.v_g_rho.transpose() * g_bar;
    for (const SparseEntry& e : s.v_b_q) q_bar.row(e.column) += e.value * b_bar.row(e.row);
    for (int i = 1; i <= data.n; ++i) {
      q_bar.middleRows<4>(layout.p(i)) += s.v_g_q[at(i)].transpose() * g_bar.middleRows<7>(layout.q(i));
    }
    s.q.solve_transposed(q_bar, b_bar, g_bar);
    rho_bar += s.q_b_rho.transpose() * b_bar + s.q_g_rho.transpose() * g_bar;
  }

  // Call this before the linearisations of q and v are used.
  void linearise_both() {
    PositionProblem positions(position);
    linearise(positions, *q);
    VelocityProblem velocities(velocity, q->x);
    linearise(velocities, *v);
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
      return target.sensor->angle() < 0 && evaluate(data, target.sensor, start, result.y, continued) !=
                                               evaluate(data, target.sensor, start, result.y, position.angles());
    };
    if (std::ranges::any_of(position.targets(), is_turned)) position.set_angles(continued);
    result.angles = position.angles();
    for (const AssemblyTarget& target : position.targets()) {
      if (target.sensor->angle() < 0) continue;
      double& angle = result.angles(target.sensor->angle());
      angle = Angle::on_branch(angle, target.value);
    }
    position.settle_shared_rows(result.y, result.angles);
  }

  // Right-hand sides of both linear systems (nearest_point_linearisation.hpp). Those of v need q' as well:
  //   J_q q' = -q_F_rho,           H_q q' + .. = q_g_rho
  //   J_v v' = -F_q q' - F_rho,    H_v v' + .. = g_q q' + g_rho
  struct Derivatives {
    MatrixXd q_b_rho, q_g_rho, v_b_q, v_b_rho, v_g_q, v_g_rho;
  };
  Derivatives derivatives() const {
    const Index N = layout.positions(), P = data.rho.size();
    const auto is_free = [](const NearestPoint& point) { return point.linearisation.null_space().cols() > 0; };
    Derivatives d{{}, MatrixXd::Zero(N, P), {}, {}, MatrixXd::Zero(N, N), MatrixXd::Zero(N, P)};
    d.q_b_rho = -position.gradients(result.y).rho;
    if (is_free(*q)) d.q_g_rho = position_guess_rho(data) - position.second(result.y, q->nu).rho;
    const AssemblyEquations::Gradients F = velocity.gradients(result.y);
    d.v_b_q = -F.y.leftCols(N);
    d.v_b_rho = -F.rho;
    if (!is_free(*v)) return d;
    const AssemblyEquations::Gradients S = velocity.second(result.y, v->nu);
    std::vector<Mat<7, 4>> v_guess_q;
    velocity_guess_derivatives(data, q->x, v_guess_q, d.v_g_rho);
    d.v_g_q = -S.y.leftCols(N);
    for (int i = 1; i <= data.n; ++i) d.v_g_q.block<7, 4>(layout.q(i), layout.p(i)) += v_guess_q[at(i)];
    d.v_g_rho -= S.rho;
    return d;
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
  if (s.is_sparse()) return s.sparse_tangent();
  s.linearise_both();
  const Solution::Derivatives d = s.derivatives();
  const MatrixXd q_rho = s.q->linearisation.solve(d.q_b_rho, d.q_g_rho);
  y_rho << q_rho, s.v->linearisation.solve(d.v_b_q * q_rho + d.v_b_rho, d.v_g_q * q_rho + d.v_g_rho);
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
  if (s.is_sparse()) return s.add_sparse_adjoint(y_bar, rho_bar);
  s.linearise_both();
  const Solution::Derivatives d = s.derivatives();
  MatrixXd b_bar, g_bar;
  s.v->linearisation.solve_transposed(y_bar.bottomRows(N), b_bar, g_bar);
  rho_bar += d.v_b_rho.transpose() * b_bar + d.v_g_rho.transpose() * g_bar;
  const MatrixXd q_bar = y_bar.topRows(N) + d.v_b_q.transpose() * b_bar + d.v_g_q.transpose() * g_bar;
  s.q->linearisation.solve_transposed(q_bar, b_bar, g_bar);
  rho_bar += d.q_b_rho.transpose() * b_bar + d.q_g_rho.transpose() * g_bar;
}

namespace {

// Marks columns of right-hand sides b for which J x = b has no solution. `left` is the part of b that a solution
// leaves, rows scaled to unit length. b is the sum of pieces, which may cancel.
void note_unmet(const MatrixXd& left, const VectorXd& row_scale, std::initializer_list<MatrixXd> pieces,
                const MechanismData& data, std::vector<bool>& unmet) {
  const double kOpen = std::max(1e-7, 1e3 * data.rounded.part);  // of b: assembly leaves a loop open by far less
  constexpr double kRounding = 1e-12;                            // of b, in the units of J: sin(pi) is not zero
  if (left.rows() == 0) return;
  for (Index k = 0; k < left.cols(); ++k) {
    double size = 0;
    for (const MatrixXd& piece : pieces) size += row_scale.cwiseProduct(piece.col(k)).norm();
    if (left.col(k).norm() > kOpen * size + kRounding * row_scale.maxCoeff()) unmet[static_cast<std::size_t>(k)] = true;
  }
}

}  // namespace

std::vector<int> Assembly::obstructed() const {
  Solution& s = *solution_;
  if (!s.result.ok) return {};
  const Index N = s.layout.positions(), P = s.data.rho.size();
  std::vector<bool> unmet(static_cast<std::size_t>(P), false);
  if (s.data.equilibrium) {
    const AssemblyEquations::Gradients F = s.position.gradients(s.result.y);
    const MatrixXd J = F.y.leftCols(N);
    const NearestPointLinearisation at(J, sizes_of_poses(J));
    note_unmet(at.left(-F.rho), at.row_scale(), {F.rho}, s.data, unmet);
  } else if (s.is_sparse()) {
    const Solution::Sparse d = s.sparse_derivatives();
    const MatrixXd q_rho = d.q.solve(d.q_b_rho, d.q_g_rho);
    note_unmet(d.q.left(d.q_b_rho, q_rho), d.q.row_scale(), {d.q_b_rho}, s.data, unmet);
    MatrixXd turned = MatrixXd::Zero(d.v_b_rho.rows(), P);
    for (const SparseEntry& e : d.v_b_q) turned.row(e.row) += e.value * q_rho.row(e.column);
    const MatrixXd b = turned + d.v_b_rho;
    note_unmet(d.v.left(b, d.v.solve(b, d.v_g_rho)), d.v.row_scale(), {turned, d.v_b_rho}, s.data, unmet);
  } else {
    s.linearise_both();
    const Solution::Derivatives d = s.derivatives();
    const NearestPointLinearisation &q = s.q->linearisation, &v = s.v->linearisation;
    note_unmet(q.left(d.q_b_rho), q.row_scale(), {d.q_b_rho}, s.data, unmet);
    const MatrixXd turned = d.v_b_q * q.solve(d.q_b_rho, d.q_g_rho), b = turned + d.v_b_rho;
    note_unmet(v.left(b), v.row_scale(), {turned, d.v_b_rho}, s.data, unmet);
  }
  std::vector<int> parameters;
  for (Index k = 0; k < P; ++k) {
    if (unmet[static_cast<std::size_t>(k)]) parameters.push_back(static_cast<int>(k));
  }
  return parameters;
}

double Assembly::rounding() const {
  Solution& s = *solution_;
  if (!s.result.ok || s.data.equilibrium || s.data.n >= Solution::kManyBodies) return 0;
  s.linearise_both();
  const Solution::Derivatives d = s.derivatives();
  const NearestPointLinearisation &q = s.q->linearisation, &v = s.v->linearisation;
  const MatrixXd q_rho = q.solve(d.q_b_rho, d.q_g_rho), v_g = d.v_g_q * q_rho + d.v_g_rho;
  return std::max(q.rounding(q_rho, d.q_g_rho), v.rounding(v.solve(d.v_b_q * q_rho + d.v_b_rho, v_g), v_g));
}

std::vector<std::string> Assembly::equilibrium_warnings() const {
  const Solution& s = *solution_;
  if (!s.equilibrium.ok) return {};
  return mbsopt::equilibrium_warnings(s.mechanism, s.start, s.equilibrium.q, s.equilibrium.angles);
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
  std::vector<SparseEntry> J = solution_->position.sparse_gradients(solution_->result.y).y;
  std::erase_if(J, [&](const SparseEntry& e) { return e.row >= equations || e.column >= coordinates; });
  for (SparseEntry& e : J) e.row = place(e.row);
  const RowDependence found = row_dependence(equations, d.n, 7, J, NearestPointLinearisation::kRankThreshold);
  const std::size_t joints = d.joint_names.size();
  std::vector<int> rows(joints + d.drive_names.size(), 0), redundant(rows.size(), 0);
  int next_row = 0;
  for (const Constraint& c : d.constraints) {
    if (c.row < next_row) continue;  // a further term of a row already seen
    next_row = c.row + c.rows();
    const std::size_t owner =
        c.drive >= 0 ? joints + static_cast<std::size_t>(c.drive) : static_cast<std::size_t>(c.joint);
    rows[owner] += c.rows();
    for (int i = 0; i < c.rows(); ++i)
      redundant[owner] += found.independent[static_cast<std::size_t>(place(c.row + i))] ? 0 : 1;
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
