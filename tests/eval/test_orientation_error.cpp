#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "libloc/eval/orientation_error.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

using Quaternions = std::vector<Eigen::Quaterniond>;
const double kNan = std::numeric_limits<double>::quiet_NaN();
const Eigen::Quaterniond kUnknownRotation(kNan, kNan, kNan, kNan);

TEST(OrientationError, IsTheDefinitionOfBroad) {
  Random random(1);
  Quaternions estimate;
  Quaternions reference;
  for (int i = 0; i < 500; ++i) {
    reference.push_back(random.rotation());
    estimate.push_back(random.rotation());
  }
  const OrientationError error = orientation_error(estimate, reference);
  double total = 0;
  double heading = 0;
  double inclination = 0;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const Eigen::Quaterniond q = estimate[i] * reference[i].conjugate();
    const double t = 2 * std::acos(std::min(1.0, std::abs(q.w())));
    const double h = 2 * std::atan(std::abs(q.z() / q.w()));
    const double n = 2 * std::acos(std::min(1.0, std::sqrt(q.w() * q.w() + q.z() * q.z())));
    EXPECT_NEAR(error.total[i], t, 1e-7);
    EXPECT_NEAR(error.heading[i], h, 1e-12);
    EXPECT_NEAR(error.inclination[i], n, 1e-7);
    total += t * t / 500;
    heading += h * h / 500;
    inclination += n * n / 500;
  }
  EXPECT_NEAR(error.total_rmse, std::sqrt(total), 1e-8);
  EXPECT_NEAR(error.heading_rmse, std::sqrt(heading), 1e-8);
  EXPECT_NEAR(error.inclination_rmse, std::sqrt(inclination), 1e-8);
  EXPECT_EQ(error.scored, 500);
}

TEST(OrientationError, SplitsATurnAboutWorldsVerticalFromATilt) {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Quaterniond reference = random.rotation();
    const double turn = random.uniform(-3, 3);
    const double tilt = random.uniform(0, 3);
    const double along = random.uniform(-3, 3);
    // In world axes, on the left; in body axes the axis of a turn would not be vertical.
    const Eigen::Quaterniond estimate =
        so3::exp({0, 0, turn}) * so3::exp(tilt * Eigen::Vector3d(std::cos(along), std::sin(along), 0)) * reference;
    const OrientationError error = orientation_error(Quaternions{estimate}, Quaternions{reference});
    EXPECT_NEAR(error.heading[0], std::abs(turn), 1e-12);
    EXPECT_NEAR(error.inclination[0], tilt, 1e-12);
    EXPECT_NEAR(error.total[0], so3::angle_between(estimate, reference), 1e-12);
  }
}

TEST(OrientationError, SmallErrorsKeepTheirDigits) {
  // acos(1 - 1e-18 / 8) is 0.
  const Quaternions reference = {Eigen::Quaterniond::Identity()};
  const OrientationError error = orientation_error(Quaternions{so3::exp({3e-9, 0, 4e-9})}, reference);
  EXPECT_NEAR(error.total[0], 5e-9, 1e-22);
  EXPECT_NEAR(error.heading[0], 4e-9, 1e-22);
  EXPECT_NEAR(error.inclination[0], 3e-9, 1e-22);
}

TEST(OrientationError, SignsOfTheQuaternionsDoNotMatter) {
  Random random(3);
  const Eigen::Quaterniond a = random.rotation();
  const Eigen::Quaterniond b = random.rotation();
  const OrientationError one = orientation_error(Quaternions{a}, Quaternions{b});
  const OrientationError other = orientation_error(Quaternions{Eigen::Quaterniond(-a.coeffs())}, Quaternions{b});
  EXPECT_EQ(one.total[0], other.total[0]);
  EXPECT_EQ(one.heading[0], other.heading[0]);
  EXPECT_EQ(one.inclination[0], other.inclination[0]);
}

TEST(OrientationError, AlignHeadingRemovesAConstantTurnOnly) {
  Random random(4);
  Quaternions estimate;
  Quaternions reference;
  std::vector<std::uint8_t> mask;
  for (int i = 0; i < 1000; ++i) {
    reference.push_back(random.rotation());
    const double heading = 3.1 + 0.1 * random.normal();  // on both sides of pi
    estimate.push_back(so3::exp({0, 0, heading}) * so3::exp({0.02, 0, 0}) * reference.back());
    mask.push_back(1);
  }
  // Outside the mask, and not part of the offset.
  for (int i = 0; i < 300; ++i) {
    reference.push_back(random.rotation());
    estimate.push_back(reference.back());
    mask.push_back(0);
  }
  OrientationErrorOptions options;
  options.align_heading = true;
  const OrientationError aligned = orientation_error(estimate, reference, mask, options);
  EXPECT_NEAR(std::remainder(aligned.heading_offset - 3.1, 2 * M_PI), 0, 0.015);
  EXPECT_NEAR(aligned.heading_rmse, 0.1, 0.01);
  EXPECT_NEAR(aligned.inclination_rmse, 0.02, 1e-12);
  EXPECT_NEAR(aligned.heading[1200], 3.1, 0.015);
  const OrientationError plain = orientation_error(estimate, reference, mask);
  EXPECT_EQ(plain.heading_offset, 0);
  EXPECT_GT(plain.heading_rmse, 2.9);
  EXPECT_NEAR(plain.inclination_rmse, 0.02, 1e-12);
}

TEST(OrientationError, ScoresWhereTheMaskIsAndBothAreKnown) {
  const Eigen::Quaterniond one = Eigen::Quaterniond::Identity();
  const Eigen::Quaterniond tilted = so3::exp({0.5, 0, 0});
  const Quaternions estimate = {tilted, one, kUnknownRotation, one, kUnknownRotation, tilted};
  const Quaternions reference = {one, one, one, kUnknownRotation, kUnknownRotation, one};
  const std::vector<std::uint8_t> mask = {1, 1, 1, 1, 1, 0};
  const OrientationError error = orientation_error(estimate, reference, mask);
  EXPECT_EQ(error.scored, 2);
  EXPECT_EQ(error.masked, 1);
  EXPECT_EQ(error.estimate_not_finite, 2);
  EXPECT_EQ(error.reference_not_finite, 1);
  EXPECT_NEAR(error.total_rmse, 0.5 / std::sqrt(2), 1e-14);
  EXPECT_NEAR(error.total[5], 0.5, 1e-15);
  EXPECT_TRUE(std::isnan(error.total[2]));
  EXPECT_TRUE(std::isnan(error.heading[3]));
}

TEST(OrientationError, RefusesBadInput) {
  const Quaternions two = {Eigen::Quaterniond::Identity(), Eigen::Quaterniond::Identity()};
  const Quaternions one = {Eigen::Quaterniond::Identity()};
  EXPECT_THROW(orientation_error(two, one), std::invalid_argument);
  EXPECT_THROW(orientation_error(two, two, std::vector<std::uint8_t>{1}), std::invalid_argument);
  EXPECT_THROW(orientation_error({}, {}), DataError);
  EXPECT_THROW(orientation_error(two, two, std::vector<std::uint8_t>{0, 0}), DataError);
  EXPECT_THROW(orientation_error(Quaternions{kUnknownRotation}, one), DataError);
  EXPECT_THROW(orientation_error(Quaternions{Eigen::Quaterniond(0, 0, 0, 0)}, one), DataError);
  EXPECT_THROW(orientation_error(one, Quaternions{Eigen::Quaterniond(1, 1, 0, 0)}), DataError);
}

}  // namespace
}  // namespace loc
