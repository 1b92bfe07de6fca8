// Many short frames in a loop: the covariance stays positive definite, |q| stays 1, the map stays bounded, float and
// double agree. A hundred thousand; LIBLOC_LONG=1 in the environment: a million, which takes a minute or two.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "libloc/core/random.hpp"
#include "libloc/estimators/slam_filter.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

const int kFrames = std::getenv("LIBLOC_LONG") != nullptr ? 1'000'000 : 100'000;
constexpr int kPoints = 28;
constexpr double kFrameS = 0.02;
constexpr double kRate = 0.5;  // [rad/s]
constexpr double kRadius = 2;  // [m]

struct Loop {
  SlamOptions options;
  std::vector<Eigen::Vector3d> points;

  Loop() {
    options.camera.name = "cam0";
    options.camera.width_px = 320;
    options.camera.height_px = 240;
    options.camera.intrinsics_px = {160, 160, 159.5, 119.5};
    options.map.max_features = 20;
    options.map.max_measured = 6;
    options.map.min_visible = 6;
    options.acceleration_density = 0.3;
    options.angular_acceleration_density = 0.1;
    options.sigma_px = 1;
    // Some of the points are known, or scale and place would wander as they may.
    for (int i = 0; i < kPoints; ++i) {
      const double angle = 2 * std::numbers::pi * i / kPoints;
      points.emplace_back((5 + i % 3) * std::cos(angle), (5 + i % 3) * std::sin(angle), 0.5 * (i % 5) - 1);
      if (i % 4 == 0) options.landmarks.push_back({i, points.back(), 0.01});
    }
    const Pose3 start = pose(0);
    options.position = start.translation;
    options.q_world_body = start.rotation;
    options.velocity = {0, kRadius * kRate, 0};
    options.angular_velocity = {0, -kRate, 0};
  }

  static Pose3 pose(double time_s) {
    const double angle = kRate * time_s;
    Eigen::Matrix3d axes;
    axes.col(2) = Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    axes.col(1) = -Eigen::Vector3d::UnitZ();
    axes.col(0) = axes.col(1).cross(axes.col(2));
    return {Eigen::Quaterniond(axes), kRadius * axes.col(2)};
  }
};

TEST(SlamLong, ManyFrames) {
  Loop loop;
  const Camera camera(loop.options.camera);
  SlamFilter twice[2] = {SlamFilter(loop.options), [&] {
                           SlamOptions single = loop.options;
                           single.precision = SlamPrecision::kFloat;
                           return SlamFilter(single);
                         }()};
  Random random(1);
  FeaturesMeasurement frame;
  double worst_norm = 0;
  double least_variance = 1;
  double least_correlation = 1;
  std::array<double, 2> sum_of_squares{};
  for (int i = 0; i < kFrames; ++i) {
    const double t = i * kFrameS;
    const Pose3 truth = Loop::pose(t);
    const Pose3 look = truth.inverse();
    frame.time_ns = 1 + static_cast<TimeNs>(i) * 20'000'000;
    frame.sequence = i;
    frame.features.clear();
    for (std::size_t k = 0; k < loop.points.size(); ++k) {
      const auto pixel = camera.project(look * loop.points[k]);
      if (!pixel || !camera.in_image(*pixel, 3)) continue;
      frame.features.push_back(
          {static_cast<std::int64_t>(k), *pixel + Eigen::Vector2d(random.normal(), random.normal())});
    }
    for (SlamFilter& filter : twice) {
      if (!filter.started()) {
        filter.start(frame.time_ns);
      } else {
        filter.propagate(frame.time_ns);
      }
      const SlamFrame& done = filter.update(frame);
      worst_norm = std::max(worst_norm, std::abs(filter.state().q_world_body.norm() - 1));
      ASSERT_LE(done.counts.map, 20);
    }
    for (std::size_t k = 0; k < 2; ++k) {
      sum_of_squares[k] += (twice[k].state().position - truth.translation).squaredNorm();
    }
    if (i % 1000 != 999) continue;
    for (const SlamFilter& filter : twice) {
      const Eigen::MatrixXd p = filter.covariance().dense();
      ASSERT_TRUE(p.allFinite()) << i;
      least_variance = std::min(least_variance, p.diagonal().minCoeff());
    }
    const Eigen::LLT<Eigen::MatrixXd> root(twice[0].covariance().dense());
    ASSERT_EQ(root.info(), Eigen::Success) << "not positive definite at " << i;
    // Float rounds each entry to 6e-8 of it: the smallest eigenvalue of the correlations is what that allows.
    const Eigen::MatrixXd p = twice[1].covariance().dense();
    const Eigen::VectorXd scale = p.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> values(scale.asDiagonal() * p * scale.asDiagonal(),
                                                                Eigen::EigenvaluesOnly);
    least_correlation = std::min(least_correlation, values.eigenvalues()[0]);
  }
  EXPECT_LT(worst_norm, 1e-12);
  EXPECT_GT(least_variance, 0);
  EXPECT_GT(least_correlation, -1e-3);
  RecordProperty("float_least_eigenvalue_of_correlations", std::to_string(least_correlation));
  // Five features of one pixel in a small picture: some 8 cm, and worse now and then. Which measurements are believed
  // differs at the edge of the gate, so that the two do not go the same way, but equally well.
  const std::array<double, 2> rms{std::sqrt(sum_of_squares[0] / kFrames), std::sqrt(sum_of_squares[1] / kFrames)};
  EXPECT_LT(rms[0], 0.4);
  EXPECT_LT(rms[1], 0.4);
  EXPECT_NEAR(rms[1], rms[0], 0.5 * rms[0]);
  for (const SlamFilter& filter : twice) {
    for (const NamedCount& count : filter.counts()) {
      if (count.name == "slam.failed_updates") {
        EXPECT_EQ(count.value, 0);
      }
    }
  }
  RecordProperty("rms_m", std::to_string(rms[0]));
  RecordProperty("rms_float_m", std::to_string(rms[1]));
}

}  // namespace
}  // namespace loc
