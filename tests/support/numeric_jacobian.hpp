// The one check of Jacobians: central differences through boxplus and boxminus. Works for vectors, rotations
// (Eigen::Quaterniond, perturbed on the right) and Pose3, as argument and as result.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "libloc/geometry/pose3.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::test {

template <int N>
Eigen::Matrix<double, N, 1> plus(const Eigen::Matrix<double, N, 1>& x, const Eigen::Matrix<double, N, 1>& d) {
  return x + d;
}
inline Eigen::Quaterniond plus(const Eigen::Quaterniond& q, const Eigen::Vector3d& d) {
  return so3::boxplus(q, d);
}
inline Pose3 plus(const Pose3& pose, const Vector6d& d) {
  return pose.boxplus(d);
}

template <int N>
Eigen::Matrix<double, N, 1> minus(const Eigen::Matrix<double, N, 1>& a, const Eigen::Matrix<double, N, 1>& b) {
  return a - b;
}
inline Eigen::Vector3d minus(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return so3::boxminus(a, b);
}
inline Vector6d minus(const Pose3& a, const Pose3& b) {
  return a.boxminus(b);
}

/// d minus(f(plus(x, d)), f(x)) / d d at d = 0. The error is of the order of step^2 and 1e-16 / step.
template <class Function, class X>
auto numeric_jacobian(const Function& f, const X& x, double step = 1e-5) {
  using Delta = decltype(minus(x, x));
  const auto fx = f(x);
  using Result = decltype(minus(fx, fx));
  Eigen::Matrix<double, Result::RowsAtCompileTime, Delta::RowsAtCompileTime> jacobian;
  for (int i = 0; i < Delta::RowsAtCompileTime; ++i) {
    const Delta d = step * Delta::Unit(i);
    jacobian.col(i) = (minus(f(plus(x, d)), fx) - minus(f(plus(x, Delta(-d))), fx)) / (2 * step);
  }
  return jacobian;
}

/// For EXPECT_TRUE: says where two matrices differ most.
template <class A, class B>
::testing::AssertionResult near(const A& actual, const B& expected, double tolerance) {
  if (actual.rows() != expected.rows() || actual.cols() != expected.cols()) {
    return ::testing::AssertionFailure() << "sizes " << actual.rows() << "x" << actual.cols() << " and "
                                         << expected.rows() << "x" << expected.cols();
  }
  const auto difference = (actual - expected).cwiseAbs().eval();
  // The comparison is false for NaN.
  if ((difference.array() <= tolerance).all()) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "differs by " << difference.maxCoeff() << " > " << tolerance << "\nactual\n"
                                       << actual << "\nexpected\n"
                                       << expected;
}

}  // namespace loc::test
