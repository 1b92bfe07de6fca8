// In a file of its own: it compiles slowly.
#include "imu_jets.hpp"

#include <ceres/jet.h>

namespace loc::bench {
namespace {

template <class T>
Eigen::Quaternion<T> exponential(const Eigen::Matrix<T, 3, 1>& v) {
  const T square = v.squaredNorm();
  if (square < T(1e-14)) return Eigen::Quaternion<T>(T(1), v[0] * T(0.5), v[1] * T(0.5), v[2] * T(0.5));
  const T angle = sqrt(square);
  const T factor = sin(angle * T(0.5)) / angle;
  return Eigen::Quaternion<T>(cos(angle * T(0.5)), v[0] * factor, v[1] * factor, v[2] * factor);
}

template <class T>
Eigen::Matrix<T, 3, 1> logarithm(const Eigen::Quaternion<T>& q) {
  const T square = q.vec().squaredNorm();
  if (square < T(1e-14)) return q.vec() * (T(2) / q.w());
  const T norm = sqrt(square);
  return q.vec() * (T(2) * (q.w() < T(0) ? atan2(-norm, -q.w()) : atan2(norm, q.w())) / norm);
}

template <class T>
Eigen::Matrix<T, 6, 1> residuals_of(const ImuSegment& segment, const Eigen::Matrix<T, 6 * kJetOrder, 1>& x,
                                    const SplineWeights& weights, const SplineWeights& cumulative,
                                    const ImuResiduals& reading) {
  using Vector = Eigen::Matrix<T, 3, 1>;
  const auto control = [&](int j) {
    return segment.rotations[static_cast<std::size_t>(j)].cast<T>() * exponential<T>(x.template segment<3>(3 * j));
  };
  Eigen::Quaternion<T> before = control(0);
  Eigen::Quaternion<T> attitude = before;
  Vector rate = Vector::Zero();
  for (int j = 1; j < kJetOrder; ++j) {
    const auto k = static_cast<std::size_t>(j);
    const Eigen::Quaternion<T> next = control(j);
    const Vector difference = logarithm<T>(before.conjugate() * next);
    const Eigen::Quaternion<T> step = exponential<T>(difference * T(cumulative.value[k]));
    rate = step.conjugate() * rate + difference * T(cumulative.first[k]);
    attitude = attitude * step;
    before = next;
  }
  Vector acceleration = Vector::Zero();
  for (int j = 0; j < kJetOrder; ++j) {
    acceleration += (segment.positions.col(j).cast<T>() + x.template segment<3>(3 * (kJetOrder + j))) *
                    T(weights.second[static_cast<std::size_t>(j)]);
  }
  Eigen::Matrix<T, 6, 1> out;
  out << rate, attitude.conjugate() * Vector(acceleration - segment.gravity.cast<T>());
  return out - reading.cast<T>();
}

}  // namespace

void imu_by_jets(const ImuSegment& segment, const SplineWeights& weights, const SplineWeights& cumulative,
                 const ImuResiduals& reading, ImuResiduals& residuals, ImuJacobian& jacobian) {
  using Jet = ceres::Jet<double, 6 * kJetOrder>;
  Eigen::Matrix<Jet, 6 * kJetOrder, 1> x;
  for (int i = 0; i < x.size(); ++i) x[i] = Jet(0, i);
  const Eigen::Matrix<Jet, 6, 1> out = residuals_of<Jet>(segment, x, weights, cumulative, reading);
  for (int i = 0; i < 6; ++i) {
    residuals[i] = out[i].a;
    jacobian.row(i) = out[i].v.transpose();
  }
}

}  // namespace loc::bench
