// A body that rests, then speeds up along a circle and goes on at constant speed: all of its IMU, in closed form, for
// tests of estimators that start, rest and move. World is ENU; the body's axes are turned against the vehicle's (x
// forward, z up) by any mounting.
#pragma once

#include <cmath>

#include "libloc/core/random.hpp"
#include "libloc/geometry/geodesy.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc::test {

struct DrivenCircle {
  double rest_s = 3;
  double speed_up_s = 4;
  double speed = 8;       // [m/s]
  double radius = 25;     // [m]; infinity: straight on
  double heading0 = 0.7;  // of the vehicle, from east to north [rad]
  Eigen::Quaterniond q_vehicle_body = Eigen::Quaterniond::Identity();
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();
  TimeNs start_ns = 1'700'000'000'000'000'000;

  struct State {
    Pose3 T_world_body;
    Eigen::Vector3d velocity;  // in world
    Eigen::Vector3d rate;      // in body
    Eigen::Vector3d force;     // in body
  };

  State at(double t) const {
    // Speed by a half cosine, so that the acceleration does not jump.
    const double u = std::clamp((t - rest_s) / speed_up_s, 0.0, 1.0);
    const double k = M_PI / speed_up_s;
    const double v = 0.5 * speed * (1 - std::cos(M_PI * u));
    const double a = u > 0 && u < 1 ? 0.5 * speed * k * std::sin(M_PI * u) : 0;
    const double tau = u * speed_up_s;
    double s = 0.5 * speed * (tau - std::sin(k * tau) / k);
    if (t > rest_s + speed_up_s) s += speed * (t - rest_s - speed_up_s);
    const bool straight = std::isinf(radius);
    const double turn = straight ? 0 : s / radius;
    const double heading = heading0 + turn;
    const Eigen::Vector3d along(std::cos(heading), std::sin(heading), 0);
    const Eigen::Vector3d across(-std::sin(heading), std::cos(heading), 0);
    const Eigen::Vector3d centre = straight
                                       ? Eigen::Vector3d::Zero().eval()
                                       : Eigen::Vector3d(-radius * std::sin(heading0), radius * std::cos(heading0), 0);
    State out;
    out.T_world_body.translation = straight ? Eigen::Vector3d(s * along) : Eigen::Vector3d(centre - radius * across);
    const Eigen::Quaterniond q_world_vehicle(Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()));
    out.T_world_body.rotation = q_world_vehicle * q_vehicle_body;
    out.velocity = v * along;
    const Eigen::Vector3d acceleration = a * along + (straight ? 0 : v * v / radius) * across;
    const Eigen::Quaterniond to_body = out.T_world_body.rotation.inverse();
    out.rate = to_body * Eigen::Vector3d(0, 0, straight ? 0 : v / radius);
    out.force = to_body * (acceleration + Eigen::Vector3d(0, 0, 9.80665));
    return out;
  }

  TimeNs time(double t) const { return start_ns + static_cast<TimeNs>(std::llround(t * 1e9)); }

  ImuMeasurement imu(double t, double rate_hz, const ImuNoise& noise, Random& random) const {
    const State x = at(t);
    const DiscreteImuNoise sample = discretise(noise, 1 / rate_hz);
    ImuMeasurement out;
    out.time_ns = time(t);
    out.sequence = std::llround(t * rate_hz);
    out.angular_velocity = x.rate + gyroscope_bias + sample.sigma_angular_velocity * random.normal3();
    out.specific_force = x.force + accelerometer_bias + sample.sigma_specific_force * random.normal3();
    return out;
  }

  GpsMeasurement gps(double t, double sigma, double velocity_sigma, const LocalFrame& world, Random& random) const {
    const State x = at(t);
    const GeodeticPoint place = world.to_geodetic(x.T_world_body.translation + sigma * random.normal3());
    GpsMeasurement out;
    out.time_ns = time(t);
    out.fix = GpsFixType::k3d;
    out.latitude = place.latitude;
    out.longitude = place.longitude;
    out.altitude = place.altitude;
    out.position_cov = sigma * sigma * Eigen::Matrix3d::Identity();
    if (velocity_sigma > 0) {
      out.velocity_enu = x.velocity + velocity_sigma * random.normal3();
      out.velocity_cov = velocity_sigma * velocity_sigma * Eigen::Matrix3d::Identity();
    }
    return out;
  }
};

}  // namespace loc::test
