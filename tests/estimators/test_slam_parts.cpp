// The parts of the SLAM filter: motion models, observation, birth of a feature, association. Jacobians against central
// differences, noise against its composition over other steps.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/estimators/slam_observation.hpp"
#include "libloc/estimators/slam_ransac.hpp"
#include "libloc/estimators/slam_state.hpp"
#include "libloc/geometry/so3.hpp"
#include "support/numeric_jacobian.hpp"

namespace loc {
namespace {

constexpr double kStep = 1e-6;

CameraCalibration pinhole() {
  CameraCalibration out;
  out.name = "cam0";
  out.width_px = 640;
  out.height_px = 480;
  out.intrinsics_px = {400, 410, 320, 240};
  return out;
}

CameraCalibration strong_radtan() {
  CameraCalibration out = pinhole();
  out.distortion_model = DistortionModel::kRadtan;
  out.distortion = {-0.28, 0.08, 2e-3, -1e-3};
  return out;
}

CameraCalibration fisheye() {
  CameraCalibration out = pinhole();
  out.intrinsics_px = {260, 261, 320, 240};
  out.distortion_model = DistortionModel::kEquidistant;
  out.distortion = {0.01, -0.004, 0.002, -0.0005};
  return out;
}

SlamOptions options_of(SlamMotion motion, bool extras = true) {
  SlamOptions out;
  out.motion = motion;
  out.camera = pinhole();
  out.estimate_extrinsics = extras;
  out.estimate_time_offset = extras;
  return out;
}

SlamState some_state(Random& random) {
  SlamState out;
  out.q_world_body = random.rotation();
  out.position = random.normal3();
  out.velocity = random.normal3();
  out.angular_velocity = random.normal3();
  out.gyroscope_bias = 0.1 * random.normal3();
  out.accelerometer_bias = 0.1 * random.normal3();
  out.T_body_camera = {random.rotation(), 0.2 * random.normal3()};
  return out;
}

Eigen::VectorXd unit(int dim, int i, double step) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(dim);
  out[i] = step;
  return out;
}

TEST(SlamState, BoxplusAndBoxminus) {
  Random random(1);
  for (const SlamMotion motion : {SlamMotion::kConstantVelocity, SlamMotion::kInertial}) {
    const SlamLayout layout(options_of(motion));
    EXPECT_EQ(layout.dim, motion == SlamMotion::kInertial ? 22 : 19);
    const SlamState a = some_state(random);
    SlamState b = a;
    Eigen::VectorXd error(layout.dim);
    for (int i = 0; i < layout.dim; ++i) error[i] = random.uniform(-0.5, 0.5);
    boxplus(b, layout, error);
    EXPECT_TRUE(test::near(boxminus(b, a, layout), error, 1e-12));
  }
  const SlamLayout plain(options_of(SlamMotion::kInertial, false));
  EXPECT_EQ(plain.dim, 15);
  EXPECT_EQ(plain.time_offset, -1);
}

// F of the constant-velocity model, also at rest, where the derivative by the rate is 0/0 in closed form.
TEST(SlamState, ConstantVelocityTransition) {
  Random random(2);
  const SlamLayout layout(options_of(SlamMotion::kConstantVelocity));
  for (const double rate : {0.0, 1e-9, 1e-3, 0.5, 3.0}) {
    SlamState start = some_state(random);
    start.angular_velocity = rate * random.direction();
    SlamTransition transition(layout);
    SlamState end = start;
    transition.move(end, 0.07, 1, 1);
    for (int i = 0; i < layout.dim; ++i) {
      const auto moved = [&](double step) {
        SlamState x = start;
        boxplus(x, layout, unit(layout.dim, i, step));
        SlamTransition scratch(layout);
        scratch.move(x, 0.07, 1, 1);
        return boxminus(x, end, layout);
      };
      const Eigen::VectorXd column = (moved(kStep) - moved(-kStep)) / (2 * kStep);
      EXPECT_TRUE(test::near(Eigen::VectorXd(transition.f().col(i)), column, 1e-8))
          << "rate " << rate << " error " << i;
    }
  }
}

TEST(SlamState, InertialTransition) {
  Random random(3);
  const SlamLayout layout(options_of(SlamMotion::kInertial));
  const Eigen::Vector3d gravity(0, 0, -9.81);
  const SlamState start = some_state(random);
  const auto move = [&](SlamState& x, SlamTransition& transition) {
    for (int k = 0; k < 5; ++k) {
      const Eigen::Vector3d rate(0.3 + 0.1 * k, -0.2, 0.5);
      const Eigen::Vector3d force(1, -0.5 * k, 9.5);
      transition.move(x, {rate - x.gyroscope_bias, force - x.accelerometer_bias, 0.001}, {1e-6, 1e-5, 1e-8, 1e-9, 1e-7},
                      gravity);
    }
  };
  SlamTransition transition(layout);
  SlamState end = start;
  move(end, transition);
  for (int i = 0; i < layout.dim; ++i) {
    const auto moved = [&](double step) {
      SlamState x = start;
      boxplus(x, layout, unit(layout.dim, i, step));
      SlamTransition scratch(layout);
      move(x, scratch);
      return boxminus(x, end, layout);
    };
    const Eigen::VectorXd column = (moved(kStep) - moved(-kStep)) / (2 * kStep);
    // Second order in the step of the IMU is left out (imu_propagation.hpp).
    EXPECT_TRUE(test::near(Eigen::VectorXd(transition.f().col(i)), column, 1e-4)) << i;
  }
  // Q: gathered over five steps it is what five single ones make of each other.
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(layout.dim, layout.dim);
  SlamState x = start;
  for (int k = 0; k < 5; ++k) {
    SlamTransition one(layout);
    const Eigen::Vector3d rate(0.3 + 0.1 * k, -0.2, 0.5);
    const Eigen::Vector3d force(1, -0.5 * k, 9.5);
    one.move(x, {rate - x.gyroscope_bias, force - x.accelerometer_bias, 0.001}, {1e-6, 1e-5, 1e-8, 1e-9, 1e-7},
             gravity);
    q = (one.f() * q * one.f().transpose() + one.q()).eval();
  }
  EXPECT_TRUE(test::near(transition.q(), q, 1e-15));
}

// Continuous densities: ten short steps are one long one, at another frame rate nothing changes.
TEST(SlamState, NoiseDoesNotDependOnTheFrameRate) {
  const SlamLayout layout(options_of(SlamMotion::kConstantVelocity, false));
  SlamState a;
  a.velocity = {1, 2, 3};
  SlamState b = a;
  SlamTransition once(layout);
  once.move(a, 1.0, 0.7, 0.3);
  SlamTransition often(layout);
  for (int i = 0; i < 10; ++i) often.move(b, 0.1, 0.7, 0.3);
  EXPECT_TRUE(test::near(once.f(), often.f(), 1e-12));
  EXPECT_TRUE(test::near(once.q(), often.q(), 1e-12));
  // Position after 1 s of white acceleration: density^2 / 3.
  EXPECT_NEAR(once.q()(kPosition, kPosition), 0.49 / 3, 1e-12);
  EXPECT_NEAR(once.q()(kTheta, kAngularVelocity), 0.09 / 2, 1e-12);
}

struct View {
  SlamState state;
  SlamPoint point;
};

// A point that the camera sees at this pixel.
View view_of(Random& random, const Camera& camera, const Eigen::Vector2d& pixel, double inverse_depth, bool converted) {
  View out{some_state(random), {}};
  const Pose3 look = out.state.T_world_camera();
  const auto seen = camera.unproject(pixel);
  EXPECT_TRUE(seen) << pixel.transpose();
  if (!seen) return out;
  const Eigen::Vector3d& ray = *seen;
  out.point.converted = converted;
  if (converted) {
    out.point.position = look * (ray / inverse_depth);
    return out;
  }
  // First seen from somewhere else.
  InverseDepthPoint& p = out.point.inverse_depth;
  const double size = inverse_depth == 0 ? 0 : 1;
  p.anchor = look.translation + 0.4 * size * random.normal3();
  const Eigen::Vector3d to = inverse_depth == 0 ? Eigen::Vector3d(look.rotation * ray)
                                                : Eigen::Vector3d(look * (ray / inverse_depth) - p.anchor);
  p.frame = frame_of_ray(to);
  p.inverse_depth = inverse_depth == 0 ? 0 : 1 / to.norm();
  return out;
}

TEST(SlamObservation, JacobiansAtCentreAndBordersOfAllLenses) {
  Random random(4);
  for (const CameraCalibration& calibration : {pinhole(), strong_radtan(), fisheye()}) {
    const Camera camera(calibration);
    for (const SlamMotion motion : {SlamMotion::kConstantVelocity, SlamMotion::kInertial}) {
      const SlamLayout layout(options_of(motion));
      for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(320, 240), Eigen::Vector2d(1, 2), Eigen::Vector2d(638, 5),
                                           Eigen::Vector2d(3, 477), Eigen::Vector2d(637, 478)}) {
        for (const double inverse_depth : {2.0, 0.3, 1e-4, 0.0}) {
          for (const bool converted : {false, true}) {
            if (converted && inverse_depth < 0.1) continue;
            const View view = view_of(random, camera, pixel, inverse_depth, converted);
            const auto predicted = predict(view.state, camera, view.point);
            ASSERT_TRUE(predicted) << calibration.intrinsics_px.transpose();
            EXPECT_TRUE(test::near(*predicted, pixel, 1e-6));
            const auto jacobian = jacobian_of(view.state, layout, camera, view.point);
            ASSERT_TRUE(jacobian);
            const double scale = 400 * std::max(1.0, inverse_depth);
            for (int i = 0; i < layout.dim; ++i) {
              if (i == layout.time_offset) continue;
              const auto moved = [&](double step) {
                SlamState x = view.state;
                boxplus(x, layout, unit(layout.dim, i, step));
                return *predict(x, camera, view.point);
              };
              const Eigen::Vector2d column = (moved(kStep) - moved(-kStep)) / (2 * kStep);
              EXPECT_TRUE(test::near(Eigen::Vector2d(jacobian->head.col(i)), column, 1e-5 * scale)) << i;
            }
            // A camera that is late by a moment sees from where the body is then.
            const auto later = [&](double dt) {
              SlamState x = view.state;
              x.position += dt * x.velocity;
              x.q_world_body = so3::boxplus(x.q_world_body, dt * x.angular_velocity);
              return *predict(x, camera, view.point);
            };
            const Eigen::Vector2d by_time = (later(kStep) - later(-kStep)) / (2 * kStep);
            EXPECT_TRUE(test::near(Eigen::Vector2d(jacobian->head.col(layout.time_offset)), by_time, 1e-4 * scale));
            for (int i = 0; i < view.point.dim(); ++i) {
              const auto moved = [&](double step) {
                SlamPoint p = view.point;
                p.boxplus(unit(p.dim(), i, step));
                return *predict(view.state, camera, p);
              };
              const Eigen::Vector2d column = (moved(kStep) - moved(-kStep)) / (2 * kStep);
              EXPECT_TRUE(test::near(Eigen::Vector2d(jacobian->block.col(i)), column, 1e-5 * scale)) << i;
            }
          }
        }
      }
    }
  }
}

TEST(SlamObservation, WhatIsBehindIsNotSeen) {
  const Camera camera(pinhole());
  SlamState state;
  SlamPoint point;
  point.converted = true;
  point.position = {0, 0, -2};
  EXPECT_FALSE(predict(state, camera, point));
  const SlamLayout layout(options_of(SlamMotion::kInertial));
  EXPECT_FALSE(jacobian_of(state, layout, camera, point));
  EXPECT_FALSE(make_feature(state, layout, camera, {kUnknown, 3}, 1, 0.1, 0.5));
}

// A new feature is where the pixel says, and its errors follow those of the head and of the pixel.
TEST(SlamObservation, BirthOfAFeature) {
  Random random(5);
  for (const CameraCalibration& calibration : {pinhole(), strong_radtan(), fisheye()}) {
    const Camera camera(calibration);
    const SlamLayout layout(options_of(SlamMotion::kInertial));
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(320, 240), Eigen::Vector2d(4, 6), Eigen::Vector2d(630, 470)}) {
      const SlamState state = some_state(random);
      const auto birth = make_feature(state, layout, camera, pixel, 0.7, 0.2, 0.4);
      ASSERT_TRUE(birth);
      SlamPoint point;
      point.inverse_depth = birth->point;
      EXPECT_TRUE(test::near(*predict(state, camera, point), pixel, 1e-6));
      EXPECT_EQ(birth->point.inverse_depth, 0.2);
      // Errors of another birth, in terms of this one's frame.
      const auto difference = [&](const SlamState& at, const Eigen::Vector2d& z) {
        const auto other = make_feature(at, layout, camera, z, 0.7, 0.2, 0.4);
        Eigen::Matrix<double, 6, 1> d;
        d.segment<3>(kAnchor) = other->point.anchor - birth->point.anchor;
        d.segment<2>(kRay) = birth->point.ray_basis().transpose() * other->point.ray();
        d[kInverseDepth] = other->point.inverse_depth - birth->point.inverse_depth;
        return d;
      };
      for (int i = 0; i < layout.dim; ++i) {
        const auto moved = [&](double step) {
          SlamState x = state;
          boxplus(x, layout, unit(layout.dim, i, step));
          if (i == layout.time_offset) {
            x.position += step * x.velocity;
            x.q_world_body = so3::boxplus(x.q_world_body, step * x.angular_velocity);
          }
          return difference(x, pixel);
        };
        const Eigen::VectorXd column = (moved(kStep) - moved(-kStep)) / (2 * kStep);
        EXPECT_TRUE(test::near(Eigen::VectorXd(birth->head_jacobian.col(i)), column, 1e-7)) << i;
      }
      Eigen::Matrix<double, 6, 2> by_pixel;
      for (int i = 0; i < 2; ++i) {
        const Eigen::Vector2d d = 1e-3 * Eigen::Vector2d::Unit(i);
        by_pixel.col(i) = (difference(state, pixel + d) - difference(state, pixel - d)) / 2e-3;
      }
      Eigen::Matrix<double, 6, 6> noise = 0.49 * by_pixel * by_pixel.transpose();
      noise(kInverseDepth, kInverseDepth) += 0.16;
      EXPECT_TRUE(test::near(birth->noise_cov, noise, 1e-8));
    }
  }
}

// ---- association: a head of three numbers, of which each measurement sees two with some noise

struct Sight {
  MapCovariance covariance{false, 3, 3, 80};
  std::vector<BlockMeasurement> measurements;
  std::vector<int> which;
  std::vector<double> residual;
};

Sight sight_of(Random& random, const Eigen::Vector3d& error, int right, const std::vector<Eigen::Vector2d>& wrong) {
  Sight out;
  out.covariance.reset(25 * Eigen::Matrix3d::Identity());
  const auto add = [&](const Eigen::Vector2d* residual) {
    BlockMeasurement m;
    m.rows = 2;
    m.head.setZero();
    m.head.block<2, 2>(0, 0).setIdentity();
    m.head(0, 2) = random.uniform(-0.05, 0.05);
    m.head(1, 2) = random.uniform(-0.05, 0.05);
    m.noise_cov.setIdentity();
    const Eigen::Vector2d noise(random.normal(), random.normal());
    const Eigen::Vector2d r =
        residual != nullptr ? *residual : Eigen::Vector2d(m.head.topLeftCorner<2, 3>() * error + noise);
    out.which.push_back(static_cast<int>(out.measurements.size()));
    out.measurements.push_back(m);
    out.residual.push_back(r[0]);
    out.residual.push_back(r[1]);
  };
  for (const Eigen::Vector2d& r : wrong) add(&r);
  for (int i = 0; i < right; ++i) add(nullptr);
  out.covariance.innovate(out.measurements, out.which);
  return out;
}

TEST(SlamAssociation, RightOnesAgreeAndWrongOnesDoNot) {
  Random random(6);
  SlamAssociationOptions options;
  options.gate_probability = 0.999;
  OnePointRansac ransac(options, SlamMotion::kInertial, 40);
  int lost = 0;
  for (std::uint64_t draw = 0; draw < 200; ++draw) {
    // The prior is off by up to 20, twelve of twenty agree on it, and eight are anywhere.
    const Eigen::Vector3d error(random.uniform(-10, 10), random.uniform(-10, 10), 0);
    std::vector<Eigen::Vector2d> wrong;
    while (wrong.size() < 8) {
      const Eigen::Vector2d r(random.uniform(-40, 40), random.uniform(-40, 40));
      if ((r - error.head<2>()).norm() > 8) wrong.push_back(r);
    }
    const Sight sight = sight_of(random, error, 12, wrong);
    const auto& agrees = ransac.run(sight.covariance, sight.residual, 1, draw);
    for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(agrees[i], 0) << "draw " << draw;
    for (std::size_t i = 8; i < 20; ++i) lost += agrees[i] == 0 ? 1 : 0;
  }
  // One measurement's own noise is in the hypothesis: some right ones miss, and are for the second look.
  EXPECT_LT(lost, 200 * 12 / 4);
}

TEST(SlamAssociation, SameDrawsSameAnswer) {
  Random random(7);
  const Sight sight = sight_of(random, {3, -2, 0}, 12, {{20, 20}, {-15, 4}});
  OnePointRansac a({}, SlamMotion::kInertial, 40);
  OnePointRansac b({}, SlamMotion::kInertial, 40);
  const std::vector<char> first = a.run(sight.covariance, sight.residual, 1, 5);
  EXPECT_EQ(first, b.run(sight.covariance, sight.residual, 1, 5));
  EXPECT_GE(a.hypotheses(), 0);
}

// Each within its own gate, but not both: the prior is wide, and they contradict each other.
TEST(SlamAssociation, CompatibleTakesNoTwoThatContradict) {
  Random random(8);
  SlamAssociationOptions options;
  options.gate_probability = 0.99;
  OnePointRansac ransac(options, SlamMotion::kInertial, 40);
  const Sight sight = sight_of(random, {1, 1, 0}, 6, {{-9, 7}});
  const Eigen::Vector2d wrong(-9, 7);
  ASSERT_LT(wrong.squaredNorm() / 26, ransac.gate()) << "it would pass alone";
  const auto& compatible = ransac.compatible(sight.covariance, sight.residual);
  EXPECT_EQ(compatible[0], 0);
  EXPECT_GE(std::count(compatible.begin(), compatible.end(), 1), 5);
}

// What is taken is what the joint innovation covariance of those taken allows: the chi-square of all of them.
TEST(SlamAssociation, CompatibleIsTheJointTest) {
  Random random(9);
  SlamAssociationOptions options;
  options.gate_probability = 0.999;
  OnePointRansac ransac(options, SlamMotion::kInertial, 40);
  double sum = 0;
  for (int run = 0; run < 50; ++run) {
    const Sight sight = sight_of(random, 5 * random.normal3(), 15, {});
    const auto& compatible = ransac.compatible(sight.covariance, sight.residual);
    EXPECT_GE(std::count(compatible.begin(), compatible.end(), 1), 13);
    Eigen::MatrixXd s(30, 30);
    for (int i = 0; i < 30; ++i) {
      for (int j = 0; j < 30; ++j) s(i, j) = sight.covariance.s(i, j);
    }
    const Eigen::Map<const Eigen::VectorXd> r(sight.residual.data(), 30);
    sum += r.dot(s.ldlt().solve(r));
  }
  EXPECT_NEAR(sum / 50, 30, 3.5);
}

}  // namespace
}  // namespace loc
