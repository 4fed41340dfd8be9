// Fixed-size vectors and matrices of the hot loops, and lanes: tangent directions that a loop processes together.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>  // cross
#include <cstddef>

namespace mbsopt {

template <int N>
using Vec = Eigen::Matrix<double, N, 1>;
template <int M, int N>
using Mat = Eigen::Matrix<double, M, N>;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;

// Tangent directions are processed kLanes at a time: row i of Lanes<N> holds the i-th component of each direction.
inline constexpr int kLanes = 4;
template <int N>
using Lanes = Eigen::Matrix<double, N, kLanes, Eigen::RowMajor>;

inline std::size_t at(int i) { return static_cast<std::size_t>(i); }  // of an array

inline Matrix3d skew(const Vector3d& a) {
  Matrix3d S;
  S << 0, -a(2), a(1), a(2), 0, -a(0), -a(1), a(0), 0;
  return S;
}

}  // namespace mbsopt
