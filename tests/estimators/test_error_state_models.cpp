// The parts of the error-state filter, one by one: Jacobians against central differences, the covariance's propagation
// and update against the plain matrix formulas, the sign of everything that has one.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <functional>
#include <numbers>

#include "libloc/core/random.hpp"
#include "libloc/estimators/error_state_detail.hpp"
#include "libloc/geometry/so3.hpp"
#include "support/numeric_jacobian.hpp"

namespace loc {
namespace {

using error_state::Clone;
using error_state::Core;
using error_state::Correction;
using error_state::Machine;
using test::near;

Eigen::MatrixXd random_covariance(int n, Random& random) {
  Eigen::MatrixXd a(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) a(i, j) = random.normal();
  }
  Eigen::MatrixXd p = a * a.transpose() / n + 0.1 * Eigen::MatrixXd::Identity(n, n);
  p.triangularView<Eigen::StrictlyUpper>() = p.transpose();
  return p;
}

Eigen::Matrix3d random_covariance3(Random& random) {
  return random_covariance(3, random);
}

ErrorStateOptions everything() {
  ErrorStateOptions options;
  options.estimate_drift = true;
  options.estimate_extrinsics = true;
  options.clones = 2;
  return options;
}

// A state with nothing at zero, and two poses kept.
Core random_core(const ErrorStateLayout& layout, Random& random) {
  Core core;
  core.time_ns = 5'000'000'000;
  InertialState& x = core.state.inertial;
  x.q_world_body = random.rotation();
  x.position = 10 * random.normal3();
  x.velocity = 5 * random.normal3();
  x.gyroscope_bias = 0.1 * random.normal3();
  x.accelerometer_bias = 0.3 * random.normal3();
  core.state.scale = 1.7;
  core.state.drift = random.normal3();
  core.state.T_body_odometry = {random.rotation(), random.normal3()};
  core.clones[0] = {4'000'000'000, {random.rotation(), 10 * random.normal3()}};
  core.clones[1] = {4'500'000'000, {random.rotation(), 10 * random.normal3()}};
  core.last_imu.angular_velocity = random.normal3();
  core.has_imu = true;
  core.covariance = random_covariance(layout.size, random);
  return core;
}

// The error state is what this adds.
Core plus(Core core, const ErrorStateLayout& layout, const Eigen::VectorXd& d) {
  InertialState& x = core.state.inertial;
  const auto part = [&](int column) { return Eigen::Vector3d(d.segment<3>(column)); };
  x.q_world_body = so3::boxplus(x.q_world_body, part(kTheta));
  x.position += part(kPosition);
  x.velocity += part(kVelocity);
  x.gyroscope_bias += part(kGyroscopeBias);
  x.accelerometer_bias += part(kAccelerometerBias);
  if (layout.scale >= 0) core.state.scale += d[layout.scale];
  if (layout.drift >= 0) core.state.drift += part(layout.drift);
  if (layout.extrinsics >= 0) {
    Pose3& mount = core.state.T_body_odometry;
    mount.rotation = so3::boxplus(mount.rotation, part(layout.extrinsics));
    mount.translation += part(layout.extrinsics + 3);
  }
  for (int i = 0; layout.clones >= 0 && layout.clones + 6 * i < layout.size; ++i) {
    Clone& clone = core.clones[i];
    clone.pose.rotation = so3::boxplus(clone.pose.rotation, part(layout.clones + 6 * i));
    clone.pose.translation += part(layout.clones + 6 * i + 3);
  }
  return core;
}

Eigen::MatrixXd dense_jacobian(const Observation& o, int columns) {
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(o.dim(), columns);
  for (int i = 0; i < o.count(); ++i) h(o.entries()[i].row, o.entries()[i].column) += o.entries()[i].value;
  return h;
}

// H against -d residual / d error, for a measurement that the state predicts exactly: there the models are linearised.
void check_jacobian(const ErrorStateOptions& options, const std::function<Correction(const Core&, Random&)>& exact) {
  Machine machine(options);
  const ErrorStateLayout& layout = machine.layout();
  Random random(7);
  for (int round = 0; round < 20; ++round) {
    const Core core = random_core(layout, random);
    const Correction correction = exact(core, random);
    Observation o;
    ASSERT_TRUE(machine.linearise(core, correction, o));
    const int dim = o.dim();
    EXPECT_LT(o.residual.head(dim).norm(), 1e-12) << "the measurement is not what the state predicts";
    const Eigen::MatrixXd analytic = dense_jacobian(o, layout.size);
    Eigen::MatrixXd numeric(dim, layout.size);
    constexpr double kStep = 1e-6;
    for (int i = 0; i < layout.size; ++i) {
      const Eigen::VectorXd d = kStep * Eigen::VectorXd::Unit(layout.size, i);
      Observation forth;
      Observation back;
      ASSERT_TRUE(machine.linearise(plus(core, layout, d), correction, forth));
      ASSERT_TRUE(machine.linearise(plus(core, layout, -d), correction, back));
      numeric.col(i) = -(forth.residual.head(dim) - back.residual.head(dim)) / (2 * kStep);
    }
    EXPECT_TRUE(near(analytic, numeric, 2e-8 * (1 + analytic.cwiseAbs().maxCoeff())));
  }
}

Correction absolute(const Core& core, Random& random) {
  Correction c;
  c.source = FusionSource::kOdometry;
  const InertialState& x = core.state.inertial;
  c.vector =
      core.state.scale * (x.position + x.q_world_body * core.state.T_body_odometry.translation) + core.state.drift;
  c.rotation = x.q_world_body * core.state.T_body_odometry.rotation;
  c.vector_cov = random_covariance3(random);
  c.second_cov = random_covariance3(random);
  return c;
}

TEST(ErrorStateJacobian, AbsoluteOdometry) {
  check_jacobian(everything(), absolute);
}

TEST(ErrorStateJacobian, RelativeOdometry) {
  check_jacobian(everything(), [](const Core& core, Random& random) {
    Correction c;
    c.source = FusionSource::kRelativeOdometry;
    c.start_time_ns = 4'500'000'000;
    const Pose3 T_world_body{core.state.inertial.q_world_body, core.state.inertial.position};
    const Pose3& mount = core.state.T_body_odometry;
    const Pose3 way = (core.clones[1].pose * mount).inverse() * (T_world_body * mount);
    c.vector = core.state.scale * way.translation;
    c.rotation = way.rotation;
    c.vector_cov = random_covariance3(random);
    c.second_cov = random_covariance3(random);
    return c;
  });
}

TEST(ErrorStateJacobian, Gps) {
  for (const bool with_position : {true, false}) {
    for (const bool with_velocity : {true, false}) {
      if (!with_position && !with_velocity) continue;
      check_jacobian(everything(), [=](const Core& core, Random& random) {
        Correction c;
        c.source = FusionSource::kGps;
        c.lever = random.normal3();
        const InertialState& x = core.state.inertial;
        c.has_vector = with_position;
        c.vector = x.position + x.q_world_body * c.lever;
        c.has_velocity = with_velocity;
        c.velocity = x.velocity + x.q_world_body * (core.last_imu.angular_velocity - x.gyroscope_bias).cross(c.lever);
        c.vector_cov = random_covariance3(random);
        c.second_cov = random_covariance3(random);
        return c;
      });
    }
  }
}

TEST(ErrorStateJacobian, Velocity) {
  for (const VelocityFrame frame : {VelocityFrame::kWorld, VelocityFrame::kBody}) {
    check_jacobian(everything(), [=](const Core& core, Random& random) {
      Correction c;
      c.source = FusionSource::kMeasuredVelocity;
      c.frame = frame;
      const InertialState& x = core.state.inertial;
      c.vector = frame == VelocityFrame::kWorld ? x.velocity : Eigen::Vector3d(x.q_world_body.conjugate() * x.velocity);
      c.vector_cov = random_covariance3(random);
      return c;
    });
  }
}

TEST(ErrorStateJacobian, RestHeightHeading) {
  check_jacobian(everything(), [](const Core& core, Random& /*random*/) {
    Correction c;
    c.source = FusionSource::kHeight;
    c.value = core.state.inertial.position.z();
    c.sigma = 0.1;
    return c;
  });
  check_jacobian(everything(), [](const Core& core, Random& /*random*/) {
    Correction c;
    c.source = FusionSource::kHeading;
    c.value = so3::heading(core.state.inertial.q_world_body) + 2 * std::numbers::pi;  // any turn of it
    c.sigma = 0.1;
    return c;
  });
  // Rest predicts zero whatever the state is, so the state is put to rest.
  Machine machine(everything());
  Random random(3);
  Core core = random_core(machine.layout(), random);
  Correction c;
  c.source = FusionSource::kZeroVelocity;
  c.vector_cov = 1e-4 * Eigen::Matrix3d::Identity();
  c.has_velocity = true;
  c.velocity = core.last_imu.angular_velocity;
  c.second_cov = 1e-6 * Eigen::Matrix3d::Identity();
  Observation o;
  ASSERT_TRUE(machine.linearise(core, c, o));
  EXPECT_EQ(o.residual.head<3>(), -core.state.inertial.velocity);
  EXPECT_EQ(o.residual.tail<3>(), core.last_imu.angular_velocity - core.state.inertial.gyroscope_bias);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(6, machine.layout().size);
  expected.block<3, 3>(0, kVelocity).setIdentity();
  expected.block<3, 3>(3, kGyroscopeBias).setIdentity();
  EXPECT_EQ(dense_jacobian(o, machine.layout().size), expected);
}

// F of a step against central differences through the step itself. The analytic F takes the attitude in the middle of
// the step as that of the estimate, so it is right to the first order of the turn: hence the short steps.
TEST(InertialPropagation, JacobianAgainstDifferences) {
  Random random(11);
  const Eigen::Vector3d gravity(0, 0, -9.81);
  for (const double dt : {1e-3, 1e-4}) {
    for (int round = 0; round < 20; ++round) {
      InertialState start;
      start.q_world_body = random.rotation();
      start.velocity = random.normal3();
      const Eigen::Vector3d rate = random.normal3();
      const Eigen::Vector3d force = 10 * random.normal3();
      const auto end_of = [&](const Eigen::VectorXd& d) {
        InertialState x = start;
        x.q_world_body = so3::boxplus(x.q_world_body, d.segment<3>(kTheta));
        x.position += d.segment<3>(kPosition);
        x.velocity += d.segment<3>(kVelocity);
        propagate(x, {rate - d.segment<3>(kGyroscopeBias), force - d.segment<3>(kAccelerometerBias), dt}, gravity,
                  ImuIntegration::kMidpoint);
        x.gyroscope_bias += d.segment<3>(kGyroscopeBias);
        x.accelerometer_bias += d.segment<3>(kAccelerometerBias);
        return x;
      };
      InertialState end = start;
      const Eigen::MatrixXd analytic = dense(propagate(end, {rate, force, dt}, gravity, ImuIntegration::kMidpoint));
      Eigen::MatrixXd numeric(kInertialDim, kInertialDim);
      constexpr double kStep = 1e-5;
      for (int i = 0; i < kInertialDim; ++i) {
        const Eigen::VectorXd d = kStep * Eigen::VectorXd::Unit(kInertialDim, i);
        const InertialState a = end_of(d);
        const InertialState b = end_of(-d);
        Eigen::VectorXd column(kInertialDim);
        column << so3::boxminus(a.q_world_body, end.q_world_body) - so3::boxminus(b.q_world_body, end.q_world_body),
            a.position - b.position, a.velocity - b.velocity, a.gyroscope_bias - b.gyroscope_bias,
            a.accelerometer_bias - b.accelerometer_bias;
        numeric.col(i) = column / (2 * kStep);
      }
      // Second order in dt is left out: |f| |w| dt^2 of the velocity.
      EXPECT_TRUE(near(analytic, numeric, 60 * dt * dt + 1e-9));
    }
  }
}

TEST(InertialPropagation, CovarianceIsFPFt) {
  Random random(5);
  for (const int size : {15, 16, 19, 20, 22, 37, 49}) {
    for (const ImuIntegration integration : {ImuIntegration::kMidpoint, ImuIntegration::kEuler}) {
      InertialState x;
      x.q_world_body = random.rotation();
      const InertialJacobian jacobian =
          propagate(x, {random.normal3(), 10 * random.normal3(), 0.01}, {0, 0, -9.81}, integration);
      Eigen::MatrixXd f = Eigen::MatrixXd::Identity(size, size);
      f.topLeftCorner<kInertialDim, kInertialDim>() = dense(jacobian);
      Eigen::MatrixXd p = random_covariance(size, random);
      Eigen::MatrixXd expected = f * p * f.transpose();
      InertialStepNoise noise{1, 2, 3, 4, 5};
      expected.diagonal().segment<3>(kTheta).array() += 1;
      expected.diagonal().segment<3>(kVelocity).array() += 2;
      expected.diagonal().segment<3>(kPosition).array() += 3;
      expected.diagonal().segment<3>(kGyroscopeBias).array() += 4;
      expected.diagonal().segment<3>(kAccelerometerBias).array() += 5;
      propagate_covariance(p, jacobian, noise);
      EXPECT_TRUE(near(p, expected, 1e-12)) << size;
      EXPECT_TRUE(p == p.transpose());
    }
  }
}

TEST(GatedUpdate, IsTheTextbooks) {
  Random random(6);
  for (const int size : {15, 16, 19, 21, 64}) {
    for (int dim = 1; dim <= kMaxUpdateDim; ++dim) {
      Eigen::MatrixXd p = random_covariance(size, random);
      Observation o;
      o.begin(dim);
      Eigen::MatrixXd h(dim, size);
      for (int j = 0; j < size; ++j) {
        for (int i = 0; i < dim; ++i) {
          h(i, j) = random.uniform() < 0.5 ? 0 : random.normal();
          o.add(i, j, h(i, j));
        }
      }
      const Eigen::MatrixXd r = random_covariance(dim, random);
      o.noise_cov.topLeftCorner(dim, dim) = r;
      for (int i = 0; i < dim; ++i) o.residual[i] = random.normal();
      const Eigen::MatrixXd s = h * p * h.transpose() + r;
      const Eigen::MatrixXd k = p * h.transpose() * s.inverse();
      const Eigen::MatrixXd expected = p - k * s * k.transpose();
      Innovation innovation;
      ASSERT_TRUE(innovate(p, o, innovation));
      EXPECT_NEAR(innovation.nis, o.residual.head(dim).dot(s.inverse() * o.residual.head(dim)), 1e-9 * size);
      Eigen::VectorXd dx(size);
      joseph_update(p, o, innovation, dx);
      EXPECT_TRUE(near(dx, Eigen::VectorXd(k * o.residual.head(dim)), 1e-11 * size));
      EXPECT_TRUE(near(p, expected, 1e-11 * size)) << size << " " << dim;
      EXPECT_TRUE(p == p.transpose());
    }
  }
}

// A start that knows nothing and a sensor that is very good: P - K H P comes out negative here.
TEST(GatedUpdate, KeepsTheCovariancePositive) {
  const int size = 16;
  Eigen::MatrixXd p = 1e12 * Eigen::MatrixXd::Identity(size, size);
  Observation o;
  o.begin(6);
  for (int i = 0; i < 6; ++i) {
    o.add(i, i, 1.0);
    o.noise_cov(i, i) = 1e-6;
    o.residual[i] = 0;
  }
  Eigen::VectorXd dx(size);
  for (int round = 0; round < 5; ++round) {
    Innovation innovation;
    ASSERT_TRUE(innovate(p, o, innovation));
    joseph_update(p, o, innovation, dx);
    EXPECT_GT(p.diagonal().minCoeff(), 0) << round;
    EXPECT_NEAR(p(0, 0), 1e-6 / (round + 1), 1e-12) << round;
  }
}

TEST(GatedUpdate, RefusesWhatIsNotACovariance) {
  Eigen::MatrixXd p = Eigen::MatrixXd::Identity(15, 15);
  Observation o;
  o.begin(3);
  o.add3(0, kPosition, 1.0);
  o.residual.setZero();
  o.noise_cov.topLeftCorner<3, 3>() = -2 * Eigen::Matrix3d::Identity();
  Innovation innovation;
  EXPECT_FALSE(innovate(p, o, innovation));
}

}  // namespace
}  // namespace loc
