// Whatever the readings, an ellipsoid comes back or a refusal with its reason.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libloc/calib/ellipsoid.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"

namespace loc::test {

inline void expect_ellipsoids_or_refusals(int runs) {
  Random random(9);
  int refused = 0;
  int given = 0;
  for (int run = 0; run < runs; ++run) {
    const int n = 4 + static_cast<int>(random.uniform() * 60);
    const int kind = run % 8;
    Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> readings(n, 3);
    const Eigen::Vector3d direction = random.direction();
    const Eigen::Vector3d centre = std::pow(10, random.uniform(-8, 8)) * random.direction();
    for (int i = 0; i < n; ++i) {
      Eigen::Vector3d p = random.direction();
      const Eigen::Vector3d any = random.normal3();
      switch (kind) {
        case 0:  // no ellipsoid at all
          p = any;
          break;
        case 1:  // a plane, nearly or exactly
          p -= direction * direction.dot(p) * (run % 16 == 1 ? 1.0 : 0.999);
          break;
        case 2:  // a line
          p = direction * any.x();
          break;
        case 3:  // a hyperboloid
          p = Eigen::Vector3d(std::cosh(any.x()) * std::cos(any.y()), std::cosh(any.x()) * std::sin(any.y()),
                              std::sinh(any.x()));
          break;
        case 4:  // a small cap with much noise
          p = (direction + 0.2 * p).normalized() + 0.05 * any;
          break;
        case 5:  // half of it outliers
          if (i % 2 == 0) p += any;
          break;
        case 6:  // one point
          p = direction;
          break;
        default:  // a very flat one
          p.z() *= 1e-3;
          break;
      }
      readings.row(i) = (p + centre).transpose();
    }
    for (const EllipsoidMethod method :
         {EllipsoidMethod::kLsq, EllipsoidMethod::kRobust, EllipsoidMethod::kAls, EllipsoidMethod::kSphere}) {
      if (method != EllipsoidMethod::kRobust && run % 4 != 0) continue;
      const EllipsoidFit fit = fit_ellipsoid(readings, {.method = method});
      if (!fit.is_ellipsoid) {
        EXPECT_EQ(fit.quality.verdict, Verdict::kRefused);
        EXPECT_FALSE(fit.quality.reasons.empty());
        EXPECT_TRUE(fit.centre.array().isNaN().all());
        EXPECT_THROW(fit.triad(), DataError);
        ++refused;
        continue;
      }
      ++given;
      ASSERT_TRUE(fit.centre.allFinite() && fit.matrix.allFinite()) << "kind " << kind;
      ASSERT_GT(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(fit.matrix).eigenvalues()[0], 0) << "kind " << kind;
      // What the data cannot tell is not passed off as known.
      if (kind == 1 || kind == 2 || kind == 6 || (fit.readings >= 30 && (kind == 0 || kind == 3))) {
        EXPECT_EQ(fit.quality.verdict, Verdict::kRefused) << "kind " << kind;
      }
    }
  }
  EXPECT_GT(refused, runs / 100);
  EXPECT_GT(given, runs / 10);
}

}  // namespace loc::test
