#include "core/start/assembly_modes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <string>

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/mechanism/field_values.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/projection/projection.hpp"
#include "core/start/assembly.hpp"
#include "core/start/assembly_equations.hpp"

namespace mbsopt {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr int kFruitless = 40;  // guesses in a row that find nothing new: a mode that one in ten finds is missed 1:70;
                                // those that end inside out say nothing
constexpr int kMost = 400;      // guesses
constexpr double kOpen = 1e-6;  // |Phi| of a nearest approach, relative to the size: it is not closed there
constexpr double kSame = 1e-6;  // distance of equal modes, relative to the size of the mechanism

double size_of(const VectorXd& x) { return x.lpNorm<Eigen::Infinity>(); }

double distance(const VectorXd& a, const VectorXd& b) {
  double sum = 0;
  for (Index i = 0; i < a.size(); i += 7) {
    const Vector4d p = a.segment<4>(i + 3), other = b.segment<4>(i + 3);
    sum += (a.segment<3>(i) - b.segment<3>(i)).squaredNorm() + (A(p) - A(other)).squaredNorm();
  }
  return std::sqrt(sum);
}

// Returns whether a joint holds only because an axis or a normal is opposite to that in the first mode. Two or more dot
// products of a joint prevent a motion between the two.
bool is_inside_out(const MechanismData& d, const VectorXd& first, const VectorXd& q) {
  const StateLayout layout{d.n};
  const auto axes = [&](const VectorXd& at, int body) {
    return body == 0 ? Matrix3d(Matrix3d::Identity()) : Matrix3d(A(Vector4d(at.segment<4>(layout.p(body)))));
  };
  std::vector<int> products(d.joint_names.size(), 0);
  for (const Constraint& c : d.constraints)
    if (c.joint >= 0 && std::holds_alternative<Dot1>(c.primitive)) ++products[at(c.joint)];
  return std::ranges::any_of(d.constraints, [&](const Constraint& c) {
    const auto* const dot1 = std::get_if<Dot1>(&c.primitive);
    if (!dot1 || c.joint < 0 || products[at(c.joint)] < 2) return false;
    const auto seen = [&](const VectorXd& at) -> Vector3d {  // from body 1
      return axes(at, c.body1).transpose() * (axes(at, c.body2) * dot1->s2);
    };
    return seen(first).dot(seen(q)) < 0;
  });
}

// The guess with every body turned. The standard's distributions are not used, because they differ between libraries.
class RandomTurns {
 public:
  explicit RandomTurns(const MechanismData& data) : data_(data) {}

  VectorXd of(VectorXd q) {
    for (Index i = 0; i < q.size(); i += 7) {
      Vector4d turn;
      if (data_.planar) {
        const double half = std::numbers::pi * unit();
        turn << std::cos(half), std::sin(half) * Vector3d::Unit(data_.planar->n);
      } else {  // evenly over all rotations: Shoemake, "Uniform random rotations", Graphics Gems III (1992)
        const double u = unit(), a = 2 * std::numbers::pi * unit(), b = 2 * std::numbers::pi * unit();
        turn << std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a), std::sqrt(u) * std::sin(b),
            std::sqrt(u) * std::cos(b);
      }
      q.segment<4>(i + 3) = quaternion_product(turn, Vector4d(q.segment<4>(i + 3)));
    }
    return q;
  }

 private:
  double unit() { return static_cast<double>(generator_() >> 11) * 0x1p-53; }

  const MechanismData& data_;
  std::mt19937_64 generator_{1};  // the same modes in every run
};

using Quaternion = std::array<Expression, 4>;

Expression of(const std::string& function, const Expression& x) {
  return Expression::parse(function + "(" + x.text() + ")");
}

Quaternion rotation(const VectorField& axis, const Field& angle) {
  const Expression half = Expression(0.5) * angle, c = of("cos", half);
  const Expression length = of("sqrt", axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  const Expression s = of("sin", half) * of("1/", length);
  return {c, s * axis[0], s * axis[1], s * axis[2]};
}

Quaternion quaternion(const OrientationField& field) {
  if (const auto* const e = std::get_if<EulerParametersField>(&field)) return e->e;
  if (const auto* const about = std::get_if<AxisAngleField>(&field)) return rotation(about->axis, about->angle);
  const VectorField& rpy = std::get<RollPitchYawField>(field).rpy;
  return quaternion_product(rotation({0.0, 0.0, 1.0}, rpy[2]),
                            quaternion_product(rotation({0.0, 1.0, 0.0}, rpy[1]), rotation({1.0, 0.0, 0.0}, rpy[0])));
}

// The orientation turned in global axes.
OrientationField turned(const OrientationField& given, const Vector4d& turn) {
  const auto* const about = std::get_if<AxisAngleField>(&given);
  if (about && std::ranges::all_of(about->axis, &Field::is_number)) {
    constexpr double kParallel = 1e-9;
    const Vector3d axis =
        Vector3d(about->axis[0].number(), about->axis[1].number(), about->axis[2].number()).normalized();
    const Vector3d v = turn.tail<3>();
    if (axis.cross(v).norm() <= kParallel)
      return AxisAngleField{about->axis, about->angle + Expression(2 * std::atan2(axis.dot(v), turn(0)))};
  }
  return EulerParametersField{quaternion_product({turn(0), turn(1), turn(2), turn(3)}, quaternion(given))};
}

}  // namespace

std::vector<AssemblyMode> assembly_modes(const Mechanism& mechanism, double t, const std::function<bool()>& go_on) {
  const MechanismData& d = mechanism.data();
  const Assembly given(mechanism, t);
  if (given.result().ok ? given.degrees_of_freedom() > 0 : d.drive_names.empty()) return {};
  const VectorXd guess = position_guess(d);
  std::vector<AssemblyMode> modes;
  if (given.result().ok) modes.push_back({given.result().y.head(guess.size()), 0});
  RandomTurns turns(d);
  const std::unique_ptr<Projector> projector = make_projector(mechanism, Projection::position_velocity,
                                                              d.planar ? Model::planar : Model::spatial, Free::nothing);
  VectorXd theta_bar = VectorXd::Zero(d.slots()), rho_bar = VectorXd::Zero(d.rho.size());
  for (int k = 1, fruitless = 0; k < kMost && fruitless < kFruitless; ++k) {
    if (go_on && !go_on()) break;
    AssemblyEquations equations(d, AssemblyLevel::position, t);
    VectorXd y = VectorXd::Zero(2 * guess.size());
    y.head(guess.size()) = turns.of(guess);
    equations.start_branches(y);
    ++fruitless;
    if (projector->approach(t, equations.angles(), y, theta_bar, rho_bar) > kOpen * (1 + size_of(y))) continue;
    NearestPoint found = nearest_point(equations, y.head(guess.size()), d.assembly_iterations);
    if (found.status != NearestPointStatus::found) continue;
    if (!found.determined) linearise(equations, found);
    if (!found.determined && found.linearisation.rank() < found.x.size()) continue;
    if (!modes.empty() && is_inside_out(d, modes[0].q, found.x)) {
      --fruitless;
      continue;
    }
    const double size = 1 + size_of(found.x);
    if (std::ranges::any_of(modes, [&](const AssemblyMode& m) { return distance(m.q, found.x) <= kSame * size; }))
      continue;
    modes.push_back({found.x, modes.empty() ? 0 : distance(modes[0].q, found.x)});
    fruitless = 0;
  }
  std::ranges::sort(modes, {}, &AssemblyMode::distance);
  return modes;
}

void set_guess(Scene& scene, const Mechanism& mechanism, const AssemblyMode& mode) {
  const MechanismData& d = mechanism.data();
  const StateLayout layout{d.n};
  std::size_t k = 0;
  for (Body& body : scene.bodies) {
    const BodyData& given = d.bodies[++k];
    const Vec<7> q = mode.q.segment<7>(layout.q(k));
    const Vector4d p0 = given.q.tail<4>(), p = q.tail<4>();
    const Vector3d r0 = given.q.head<3>() - A(p0) * given.com, r = q.head<3>() - A(p) * given.com;  // of the origin
    for (Index i = 0; i < 3; ++i) {
      Field& x = body.position[static_cast<std::size_t>(i)];
      x = x.is_number() ? Field(r(i)) : Field(x + Expression(r(i) - r0(i)));
    }
    const Vector4d inverse(p0(0), -p0(1), -p0(2), -p0(3));
    body.orientation = turned(body.orientation, quaternion_product(p, inverse));
  }
}

}  // namespace mbsopt
