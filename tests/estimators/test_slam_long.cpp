// A million short frames in a loop: the covariance stays positive definite, |q| stays 1, the map stays bounded, float
// and double agree.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "libloc/core/random.hpp"
#include "libloc/estimators/slam_filter.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr int kFrames = 1'000'000;
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
    options.map.max_features = 8;
    options.map.max_measured = 4;
    options.map.min_visible = 4;
    options.acceleration_density = 0.3;
    options.angular_acceleration_density = 0.1;
    options.sigma_px = 1;
    // Three of the points are known, or scale and place would wander as they may.
    for (int i = 0; i < 14; ++i) {
      const double angle = 2 * std::numbers::pi * i / 14;
      points.emplace_back(6 * std::cos(angle), 6 * std::sin(angle), i % 2 == 0 ? 1 : -1);
      if (i % 5 == 0) options.landmarks.push_back({i, points.back(), 0.01});
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

TEST(SlamLong, AMillionFrames) {
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
  double worst_difference = 0;
  double least_variance = 1;
  double sum_of_squares = 0;
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
      ASSERT_LE(done.counts.map, 8);
    }
    const Eigen::Vector3d error = twice[0].state().position - truth.translation;
    sum_of_squares += error.squaredNorm();
    if (i > 500) {
      worst_difference = std::max(worst_difference, (twice[0].state().position - twice[1].state().position).norm());
    }
    if (i % 1000 != 999) continue;
    for (const SlamFilter& filter : twice) {
      const Eigen::MatrixXd p = filter.covariance().dense();
      ASSERT_TRUE(p.allFinite()) << i;
      const Eigen::LLT<Eigen::MatrixXd> root(p);
      ASSERT_EQ(root.info(), Eigen::Success) << "not positive definite at " << i;
      least_variance = std::min(least_variance, p.diagonal().minCoeff());
    }
  }
  EXPECT_LT(worst_norm, 1e-12);
  EXPECT_GT(least_variance, 0);
  EXPECT_LT(std::sqrt(sum_of_squares / kFrames), 0.1);
  EXPECT_LT(worst_difference, 0.1);
  for (const SlamFilter& filter : twice) {
    for (const NamedCount& count : filter.counts()) {
      if (count.name == "slam.failed_updates") {
        EXPECT_EQ(count.value, 0);
      }
    }
  }
  RecordProperty("rms_m", std::to_string(std::sqrt(sum_of_squares / kFrames)));
  RecordProperty("float_difference_m", std::to_string(worst_difference));
}

}  // namespace
}  // namespace loc
