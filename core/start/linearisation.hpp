// The motion near a state, linearised in the free coordinates:
//
//   delta q = N z,   delta v = N zdot + P z      Phi_q N = 0,  N'N = I;   Phi_q P = -(Phidot)_q N,  N'P = 0
//   d/dt (z, zdot) = A (z, zdot) + B u,   s = C (z, zdot) + D u
//
//   A = [ 0, I;  N'(a_q N + a_v P) + P'P,  N'a_v N ],   B = [0; N'a_u]
//
// a = qddot of the constrained equations (dynamics.hpp). N follows the motion without turning in itself (N'Ndot = 0).
// So P = Ndot, and P'P is the effect of its turning. Lengths in q count in units of the mechanism's size. An input u is
// a parameter that changes neither the joints nor the state: a force, a stiffness. If the state is not an equilibrium,
// the eigenvalues are those of the motion frozen there.
//
//   const Linearisation x = linearise(mechanism, formulation, {0, y, angles}, {rho_index}, {sensor_index});
//   x.eigenvalues(0).imag() / (2 * pi)       // [Hz]
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/state_point.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

struct Linearisation {
  Eigen::MatrixXd A, B, C, D;    // for f freedoms: 2f x 2f, 2f x inputs, outputs x 2f, outputs x inputs
  Eigen::MatrixXd basis;         // [N 0; P N]: 14n x 2f
  Eigen::VectorXcd eigenvalues;  // 2f [1/s], from slow to fast, the one with Im > 0 of a pair first
  Eigen::MatrixXcd modes;        // basis times the eigenvectors, 14n x 2f, of unit length
  Eigen::VectorXd errors;        // of the eigenvalues, by rounding: an estimate [1/s]
  double length = 0;             // the size of the mechanism [m]
  double distance = 0;           // of the equilibrium that A predicts, relative to the length
  double free_acceleration = 0;  // the part that no displacement balances, relative to the length [1/s^2]
  double gravity = 0;            // the same of gravity
  double largest_rate = 0;       // of turning, and speeds of centres of mass over the length [1/s]
};

// inputs are indices of active parameters, outputs those of sensors. Throws std::invalid_argument for an input that
// moves the joints or the start, and if the equations of motion cannot be solved.
Linearisation linearise(const Mechanism& mechanism, const FormulationSettings& formulation, const StatePoint& at,
                        const std::vector<int>& inputs, const std::vector<int>& outputs);

// C (s - A)^-1 B + D: outputs x inputs. s = 2 pi i f is the response at f [Hz], s = 0 the static one.
Eigen::MatrixXcd transfer(const Linearisation& x, std::complex<double> s);

// Returns whether the state rests and stays at rest, except for rounding.
bool is_equilibrium(const Linearisation& x);

// Natural frequency |lambda|/(2 pi) [Hz], and damping ratio -Re lambda/|lambda|: 0 for lambda = 0.
double frequency(std::complex<double> eigenvalue);
double damping_ratio(std::complex<double> eigenvalue);

}  // namespace mbsopt
