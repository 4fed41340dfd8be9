#include "core/start/assembly_modes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/body/euler_parameters.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/start/assembly_problems.hpp"

namespace mbsopt {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr int kFruitless = 40;  // guesses in a row that find nothing new: a mode that one in ten finds is missed 1:70
constexpr int kMost = 400;      // guesses
constexpr double kSame = 1e-6;  // distance of equal modes, relative to the size of the mechanism

// a times b
Vector4d product(const Vector4d& a, const Vector4d& b) {
  Vector4d c;
  c << a(0) * b(0) - a.tail<3>().dot(b.tail<3>()),
      a(0) * b.tail<3>() + b(0) * a.tail<3>() + Vector3d(a.tail<3>()).cross(Vector3d(b.tail<3>()));
  return c;
}

double distance(const VectorXd& a, const VectorXd& b) {
  double sum = 0;
  for (Index i = 0; i < a.size(); i += 7) {
    const Vector4d p = a.segment<4>(i + 3), other = b.segment<4>(i + 3);
    sum += (a.segment<3>(i) - b.segment<3>(i)).squaredNorm() + (A(p) - A(other)).squaredNorm();
  }
  return std::sqrt(sum);
}

// The guess with every body turned; the standard's distributions differ from library to library.
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
      q.segment<4>(i + 3) = product(turn, q.segment<4>(i + 3));
    }
    return q;
  }

 private:
  double unit() { return static_cast<double>(generator_() >> 11) * 0x1p-53; }

  const MechanismData& data_;
  std::mt19937_64 generator_{1};  // the same modes in every run
};

// The orientation turned in the body's axes; numbers p where the field has no place for the turn.
OrientationField turned(const OrientationField& given, const Vector4d& turn, const Vector4d& p) {
  const auto* const e = std::get_if<EulerParametersField>(&given);
  if (e && !std::ranges::all_of(e->e, &Field::is_number)) {
    const auto [a, b, c, d] = e->e;
    const Expression t0(turn(0)), t1(turn(1)), t2(turn(2)), t3(turn(3));
    return EulerParametersField{{a * t0 - b * t1 - c * t2 - d * t3, a * t1 + b * t0 + c * t3 - d * t2,
                                 a * t2 - b * t3 + c * t0 + d * t1, a * t3 + b * t2 - c * t1 + d * t0}};
  }
  const auto* const about = std::get_if<AxisAngleField>(&given);
  if (about && std::ranges::all_of(about->axis, &Field::is_number)) {
    constexpr double kParallel = 1e-9;
    const Vector3d axis =
        Vector3d(about->axis[0].number(), about->axis[1].number(), about->axis[2].number()).normalized();
    const Vector3d v = turn.tail<3>();
    if (axis.cross(v).norm() <= kParallel)
      return AxisAngleField{about->axis, about->angle + Expression(2 * std::atan2(axis.dot(v), turn(0)))};
  }
  return EulerParametersField{{p(0), p(1), p(2), p(3)}};
}

}  // namespace

std::vector<AssemblyMode> assembly_modes(const Mechanism& mechanism, double t) {
  const MechanismData& d = mechanism.data();
  const VectorXd guess = position_guess(d);
  std::vector<AssemblyMode> modes;
  RandomTurns turns(d);
  for (int k = 0, fruitless = 0; k < kMost && fruitless < kFruitless; ++k, ++fruitless) {
    AssemblyEquations equations(d, AssemblyLevel::position, t);
    PositionProblem positions(equations);
    const VectorXd from = k == 0 ? guess : turns.of(guess);
    VectorXd y = VectorXd::Zero(2 * from.size());
    y.head(from.size()) = from;
    equations.start_branches(y);
    NearestPoint found = nearest_point(positions, from, Decomposition::now, d.assembly_iterations);
    const bool settled = found.status == NearestPointStatus::found && found.linearisation.rank() == found.x.size();
    if (!settled) {
      if (k == 0) return {};
      continue;
    }
    const double size = 1 + found.x.lpNorm<Eigen::Infinity>();
    const bool known =
        std::ranges::any_of(modes, [&](const AssemblyMode& mode) { return distance(mode.q, found.x) <= kSame * size; });
    if (known) continue;
    modes.push_back({found.x, k == 0 ? 0 : distance(modes[0].q, found.x)});
    fruitless = 0;
  }
  std::ranges::sort(modes, {}, &AssemblyMode::distance);
  return modes;
}

void set_guess(Scene& scene, const Mechanism& mechanism, const AssemblyMode& mode) {
  const MechanismData& d = mechanism.data();
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    Body& body = scene.bodies[i];
    const BodyData& given = d.bodies[i + 1];
    const Vec<7> q = mode.q.segment<7>(7 * static_cast<Index>(i));
    const Vector4d p0 = given.q.tail<4>(), p = q.tail<4>();
    const Vector3d r0 = given.q.head<3>() - A(p0) * given.com, r = q.head<3>() - A(p) * given.com;  // of the origin
    for (Index k = 0; k < 3; ++k) {
      Field& x = body.position[static_cast<std::size_t>(k)];
      x = x.is_number() ? Field(r(k)) : Field(x + Expression(r(k) - r0(k)));
    }
    Vector4d inverse = p0;
    inverse.tail<3>() *= -1;
    const Vector4d turn = product(inverse, p);  // in the body's axes
    body.orientation = turned(body.orientation, turn, p);
  }
}

}  // namespace mbsopt
