// Mean, deviation and correlation of noise in three axes.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <vector>

namespace loc::test {

using Vectors = std::vector<Eigen::Vector3d>;

// Of all components about a known mean.
inline double sigma(const Vectors& values, const Eigen::Vector3d& mean = Eigen::Vector3d::Zero()) {
  double sum = 0;
  for (const Eigen::Vector3d& v : values) sum += (v - mean).squaredNorm();
  return std::sqrt(sum / (3 * static_cast<double>(values.size())));
}

inline Eigen::Vector3d mean(const Vectors& values) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

// Autocorrelation at a lag, of all components.
inline double correlation(const Vectors& values, std::size_t lag) {
  double product = 0;
  double square = 0;
  for (std::size_t i = 0; i + lag < values.size(); ++i) {
    product += values[i].dot(values[i + lag]);
    square += values[i].squaredNorm();
  }
  return product / square;
}

}  // namespace loc::test
