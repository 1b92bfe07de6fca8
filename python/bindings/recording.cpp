#include "recording.hpp"

namespace locpy {
namespace {

void append(std::vector<double>& to, const Eigen::Vector3d& v) {
  to.insert(to.end(), v.data(), v.data() + 3);
}

void append(std::vector<double>& to, const Eigen::Quaterniond& q) {
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) to.push_back(value);
}

void append(std::vector<double>& to, const Eigen::Matrix3d& m) {
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) to.push_back(m(i, j));
  }
}

struct Adder {
  Columns& to;

  void operator()(const loc::ImuMeasurement& m) const {
    to.imu.times_ns.push_back(m.time_ns);
    append(to.imu.angular_velocity, m.angular_velocity);
    append(to.imu.specific_force, m.specific_force);
  }
  void operator()(const loc::MagnetometerMeasurement& m) const {
    to.magnetometer.times_ns.push_back(m.time_ns);
    append(to.magnetometer.magnetic_field, m.magnetic_field);
  }
  void operator()(const loc::ReferenceMeasurement& m) const {
    to.reference.times_ns.push_back(m.time_ns);
    append(to.reference.q_world_body_wxyz, m.q_world_body);
    append(to.reference.position, m.position);
    append(to.reference.velocity, m.velocity);
    to.reference.score.push_back(m.score ? 1 : 0);
  }
  void operator()(const loc::GpsMeasurement& m) const {
    to.gps.times_ns.push_back(m.time_ns);
    append(to.gps.latitude_longitude_altitude, Eigen::Vector3d(m.latitude, m.longitude, m.altitude));
    append(to.gps.position_cov, m.position_cov);
    append(to.gps.velocity_enu, m.velocity_enu);
    append(to.gps.velocity_cov, m.velocity_cov);
    to.gps.fix.push_back(static_cast<std::int8_t>(m.fix));
  }
  void operator()(const loc::OdometryMeasurement& m) const {
    to.odometry.times_ns.push_back(m.time_ns);
    to.odometry.start_times_ns.push_back(m.start_time_ns);
    append(to.odometry.position, m.position);
    append(to.odometry.q_wxyz, m.rotation);
    append(to.odometry.position_cov, m.position_cov);
    append(to.odometry.orientation_cov, m.orientation_cov);
  }
  void operator()(const loc::FeaturesMeasurement& m) const {
    to.features.times_ns.push_back(m.time_ns);
    to.features.camera.push_back(m.camera);
    to.features.sigma_px.push_back(m.sigma_px);
    for (const loc::FeatureObservation& feature : m.features) {
      to.features.id.push_back(feature.id);
      to.features.pixel_px.push_back(feature.pixel_px.x());
      to.features.pixel_px.push_back(feature.pixel_px.y());
    }
    to.features.first.push_back(static_cast<std::int64_t>(to.features.id.size()));
  }
  void operator()(const loc::ImageMeasurement& /*m*/) const { ++to.images; }
};

}  // namespace

void Columns::add(const loc::Measurement& measurement) {
  std::visit(Adder{*this}, measurement);
}

std::map<std::string, std::int64_t> as_map(const loc::NamedCounts& counts) {
  std::map<std::string, std::int64_t> out;
  for (const loc::NamedCount& count : counts) out[count.name] = count.value;
  return out;
}

}  // namespace locpy
