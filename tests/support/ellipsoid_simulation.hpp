// Readings of a turned triad in a constant field, with known bias and shape, as in the comparison of methods: noise
// 0.5 % of the radius, soft iron with diagonal +-15 % and off-diagonal +-5 %, offset in a random direction.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "libloc/core/random.hpp"

namespace loc::test {

struct EllipsoidCase {
  std::string name;
  double cap = 1;            ///< share of the sphere's area that directions cover, a cap in a random direction
  bool one_axis = false;     ///< rotation about body z in a field of 60 deg dip, tilted by 10 deg (one sigma)
  double outlier_share = 0;  ///< moved in a random direction by 0.1 to 1 radius
  double offset = 0.6;       ///< of the centre, in radii
  int readings = 500;
  double noise = 0.005;  ///< of the radius
  double radius = 48e-6;
};

inline std::vector<EllipsoidCase> ellipsoid_cases() {
  return {{.name = "full sphere"},
          {.name = "60 % cap", .cap = 0.6},
          {.name = "60 % cap, 5 % outliers", .cap = 0.6, .outlier_share = 0.05},
          {.name = "30 % cap", .cap = 0.3},
          {.name = "one axis, dip 60 deg", .one_axis = true},
          {.name = "offset 1 R", .offset = 1},
          {.name = "offset 3 R", .offset = 3},
          {.name = "30 % cap, 5 % outliers", .cap = 0.3, .outlier_share = 0.05}};
}

struct EllipsoidSample {
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> readings;
  Eigen::Vector3d centre;
  Eigen::Matrix3d soft_iron;  ///< symmetric: reading = centre + radius * soft_iron * direction
  double radius;
};

inline EllipsoidSample simulate_ellipsoid(const EllipsoidCase& c, Random& random) {
  EllipsoidSample s;
  s.radius = c.radius;
  s.centre = c.offset * c.radius * random.direction();
  for (int i = 0; i < 3; ++i) {
    s.soft_iron(i, i) = 1 + random.uniform(-0.15, 0.15);
    for (int j = 0; j < i; ++j) s.soft_iron(i, j) = s.soft_iron(j, i) = random.uniform(-0.05, 0.05);
  }
  const Eigen::Quaterniond cap_rotation = random.rotation();
  const double dip = std::numbers::pi / 3;
  const Eigen::Vector3d field(std::cos(dip), 0, -std::sin(dip));
  s.readings.resize(c.readings, 3);
  for (int i = 0; i < c.readings; ++i) {
    Eigen::Vector3d u;
    if (c.one_axis) {
      const double turn = random.uniform(0, 2 * std::numbers::pi);
      const Eigen::Vector3d tilt = std::numbers::pi / 18 * Eigen::Vector3d(random.normal(), random.normal(), 0);
      const Eigen::AngleAxisd tilted(tilt.norm(), tilt.normalized());
      u = (tilted * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ())).inverse() * field;
    } else {
      // Uniform in the cap: z is uniform in [1 - 2 share, 1].
      const double z = random.uniform(1 - 2 * c.cap, 1);
      const double azimuth = random.uniform(0, 2 * std::numbers::pi);
      const double r = std::sqrt(std::max(0.0, 1 - z * z));
      u = cap_rotation * Eigen::Vector3d(r * std::cos(azimuth), r * std::sin(azimuth), z);
    }
    Eigen::Vector3d reading = s.centre + c.radius * (s.soft_iron * u + c.noise * random.normal3());
    if (random.uniform() < c.outlier_share) reading += random.uniform(0.1, 1.0) * c.radius * random.direction();
    s.readings.row(i) = reading.transpose();
  }
  return s;
}

/// Angle between corrected and true direction, root mean square over the whole sphere [deg].
inline double sphere_error_deg(const EllipsoidSample& s, const Eigen::Vector3d& centre, const Eigen::Matrix3d& matrix) {
  constexpr int kDirections = 400;
  double sum = 0;
  for (int i = 0; i < kDirections; ++i) {
    // Fibonacci's spiral: nearly uniform.
    const double z = 1 - (2 * i + 1.0) / kDirections;
    const double azimuth = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - z * z);
    const Eigen::Vector3d u(r * std::cos(azimuth), r * std::sin(azimuth), z);
    const Eigen::Vector3d corrected = matrix * (s.centre + s.radius * s.soft_iron * u - centre);
    const double angle = std::atan2(u.cross(corrected).norm(), u.dot(corrected));
    sum += angle * angle;
  }
  return std::sqrt(sum / kDirections) * 180 / std::numbers::pi;
}

}  // namespace loc::test
