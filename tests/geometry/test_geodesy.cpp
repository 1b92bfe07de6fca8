#include <gtest/gtest.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "libloc/core/random.hpp"
#include "libloc/geometry/geodesy.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using test::near;
constexpr double kPi = std::numbers::pi;
constexpr double kDeg = kPi / 180;
// Axes of WGS 84 [m].
constexpr double kA = 6378137.0;
constexpr double kB = 6356752.314245179;

// The textbook formula, through the radius of curvature in the prime vertical.
Eigen::Vector3d textbook_earth(const GeodeticPoint& p) {
  const double e2 = 1 - kB * kB / (kA * kA);
  const double n = kA / std::sqrt(1 - e2 * std::sin(p.latitude) * std::sin(p.latitude));
  return {(n + p.altitude) * std::cos(p.latitude) * std::cos(p.longitude),
          (n + p.altitude) * std::cos(p.latitude) * std::sin(p.longitude),
          (n * (1 - e2) + p.altitude) * std::sin(p.latitude)};
}

TEST(Geodesy, EarthAxesAtKnownPlaces) {
  EXPECT_TRUE(near(earth_from_geodetic({0, 0, 0}), Eigen::Vector3d(kA, 0, 0), 1e-9));
  EXPECT_TRUE(near(earth_from_geodetic({0, kPi / 2, 10}), Eigen::Vector3d(0, kA + 10, 0), 1e-9));
  EXPECT_TRUE(near(earth_from_geodetic({kPi / 2, 0, 0}), Eigen::Vector3d(0, 0, kB), 1e-9));
  EXPECT_TRUE(near(earth_from_geodetic({-kPi / 2, 1, 7}), Eigen::Vector3d(0, 0, -kB - 7), 1e-9));
}

TEST(Geodesy, AgreesWithTheTextbookAndWithLocalCartesian) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const GeodeticPoint origin{random.uniform(-1.5, 1.5), random.uniform(-kPi, kPi), random.uniform(-100, 5000)};
    const double far = i % 2 == 0 ? 1e-4 : 1.0;
    const GeodeticPoint point{std::clamp(origin.latitude + far * random.uniform(-1, 1), -1.57, 1.57),
                              origin.longitude + far * random.uniform(-1, 1),
                              origin.altitude + 1000 * random.uniform(-1, 1)};
    EXPECT_TRUE(near(earth_from_geodetic(point), textbook_earth(point), 1e-8));

    const LocalFrame frame(origin);
    const GeographicLib::LocalCartesian plane(origin.latitude / kDeg, origin.longitude / kDeg, origin.altitude);
    Eigen::Vector3d expected;
    plane.Forward(point.latitude / kDeg, point.longitude / kDeg, point.altitude, expected.x(), expected.y(),
                  expected.z());
    const Eigen::Vector3d local = frame.to_local(point);
    EXPECT_TRUE(near(local, expected, 2e-8));
    EXPECT_TRUE(near(frame.to_local(point.latitude, point.longitude, point.altitude), local, 0));

    const GeodeticPoint back = frame.to_geodetic(local);
    EXPECT_NEAR(back.latitude, point.latitude, 1e-14);
    EXPECT_NEAR(std::remainder(back.longitude - point.longitude, 2 * kPi), 0, 1e-13);
    EXPECT_NEAR(back.altitude, point.altitude, 1e-8);
  }
}

TEST(Geodesy, EastNorthUpPointWhereTheySay) {
  const LocalFrame frame(43.6 * kDeg, 1.44 * kDeg, 150);  // Toulouse
  EXPECT_TRUE(near(frame.to_local(43.6 * kDeg, 1.44 * kDeg, 150), Eigen::Vector3d::Zero(), 1e-8));
  EXPECT_TRUE(near(frame.to_local(43.6 * kDeg, 1.44 * kDeg, 151), Eigen::Vector3d::UnitZ(), 1e-8));
  const Eigen::Vector3d east = frame.to_local(43.6 * kDeg, 1.441 * kDeg, 150);
  EXPECT_NEAR(east.x(), 80.745, 1e-3);  // (6388314 + 150) m * cos(43.6 deg) * 1.745329e-5
  EXPECT_NEAR(east.y(), 0, 1e-3);
  const Eigen::Vector3d north = frame.to_local(43.601 * kDeg, 1.44 * kDeg, 150);
  EXPECT_NEAR(north.y(), 111.107, 1e-3);  // (6365810 + 150) m * 1.745329e-5
  EXPECT_NEAR(north.x(), 0, 1e-9);
  // The plane does not bend with the ground.
  const Eigen::Vector3d curved = frame.to_local(frame.to_geodetic({1000, 0, 0}));
  EXPECT_TRUE(near(curved, Eigen::Vector3d(1000, 0, 0), 1e-8));
  EXPECT_NEAR(frame.to_geodetic({1000, 0, 0}).altitude, 150 + 0.0783, 1e-3);
}

TEST(Geodesy, AxesOfAPlace) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const GeodeticPoint p{random.uniform(-1.5, 1.5), random.uniform(-kPi, kPi), random.uniform(0, 1000)};
    const Eigen::Matrix3d r = R_earth_enu(p);
    EXPECT_TRUE(near(r.transpose() * r, Eigen::Matrix3d::Identity(), 1e-15));
    EXPECT_NEAR(r.determinant(), 1, 1e-14);
    // Up is the way that altitude moves a point; east and north those of longitude and latitude.
    const double d = 1e-5;
    const Eigen::Vector3d up = earth_from_geodetic({p.latitude, p.longitude, p.altitude + 1}) - earth_from_geodetic(p);
    EXPECT_TRUE(near(r.col(2), up, 1e-8));
    const Eigen::Vector3d east = earth_from_geodetic({p.latitude, p.longitude + d, p.altitude}) -
                                 earth_from_geodetic({p.latitude, p.longitude - d, p.altitude});
    EXPECT_TRUE(near(r.col(0), east.normalized(), 1e-8));
    const Eigen::Vector3d north = earth_from_geodetic({p.latitude + d, p.longitude, p.altitude}) -
                                  earth_from_geodetic({p.latitude - d, p.longitude, p.altitude});
    EXPECT_TRUE(near(r.col(1), north.normalized(), 1e-8));

    const LocalFrame frame(p);
    EXPECT_TRUE(near(frame.R_local_enu(p), Eigen::Matrix3d::Identity(), 1e-15));
  }
  // One degree further north, up leans one degree north and north leans down.
  const LocalFrame frame(0.5, 0.2, 0);
  const Eigen::Matrix3d r = frame.R_local_enu({0.5 + kDeg, 0.2, 0});
  EXPECT_TRUE(near(r.col(2), Eigen::Vector3d(0, std::sin(kDeg), std::cos(kDeg)), 1e-14));
  EXPECT_TRUE(near(r.col(1), Eigen::Vector3d(0, std::cos(kDeg), -std::sin(kDeg)), 1e-14));
}

TEST(Geodesy, RefusesWhatIsNoPlace) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(LocalFrame(1.6, 0, 0), std::invalid_argument);
  EXPECT_THROW(LocalFrame(43.6, 1.44, 150), std::invalid_argument);  // degrees
  EXPECT_THROW(LocalFrame(nan, 0, 0), std::invalid_argument);
  EXPECT_THROW(LocalFrame(0, std::numeric_limits<double>::infinity(), 0), std::invalid_argument);
  EXPECT_THROW(LocalFrame(0, 0, nan), std::invalid_argument);
  const LocalFrame frame(0.5, 0.5, 0);
  EXPECT_THROW(frame.to_local(nan, 0, 0), std::invalid_argument);
  EXPECT_THROW(frame.to_local(-1.6, 0, 0), std::invalid_argument);
  EXPECT_THROW(frame.to_geodetic({0, nan, 0}), std::invalid_argument);
  EXPECT_THROW(frame.R_local_enu({2, 0, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace loc
