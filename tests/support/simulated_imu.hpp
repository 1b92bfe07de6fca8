// A body that turns with a given rate, sampled exactly: the rate is constant over each step, the last step's attitude
// is the truth of the sample. Enough to test orientation filters against.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <utility>

#include "libloc/core/random.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc::test {

struct SimulatedImu {
  TimeNs dt_ns = 5'000'000;
  Eigen::Vector3d gravity_reaction{0, 0, 9.80665};  // in world: specific force at rest
  Eigen::Vector3d field{0, 20e-6, -40e-6};          // in world
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();
  double sigma_gyroscope = 0;
  double sigma_accelerometer = 0;
  double sigma_magnetometer = 0;
  Random random{1};

  TimeNs time_ns = 0;
  std::int64_t sequence = 0;
  Eigen::Quaterniond q_world_body = Eigen::Quaterniond::Identity();
  ImuMeasurement imu;
  MagnetometerMeasurement magnetometer;

  /// Turns for one step with the rate [rad/s, body], then samples. @param acceleration of the body in world [m/s^2]
  void step(const Eigen::Vector3d& rate, const Eigen::Vector3d& acceleration = Eigen::Vector3d::Zero()) {
    q_world_body = so3::boxplus(q_world_body, rate * to_seconds(dt_ns));
    time_ns += dt_ns;
    imu.time_ns = magnetometer.time_ns = time_ns;
    imu.sequence = magnetometer.sequence = sequence++;
    imu.angular_velocity = rate + gyroscope_bias + sigma_gyroscope * random.normal3();
    imu.specific_force =
        q_world_body.conjugate() * (gravity_reaction + acceleration) + sigma_accelerometer * random.normal3();
    magnetometer.magnetic_field = q_world_body.conjugate() * field + sigma_magnetometer * random.normal3();
  }
};

}  // namespace loc::test
