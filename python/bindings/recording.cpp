#include "recording.hpp"

namespace locpy {
namespace {

void append(std::vector<double>& to, const Eigen::Vector3d& v) {
  to.insert(to.end(), v.data(), v.data() + 3);
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
    const Eigen::Quaterniond& q = m.q_world_body;
    for (const double value : {q.w(), q.x(), q.y(), q.z()}) to.reference.q_world_body_wxyz.push_back(value);
    append(to.reference.position, m.position);
    append(to.reference.velocity, m.velocity);
    to.reference.score.push_back(m.score ? 1 : 0);
  }
  void operator()(const loc::GpsMeasurement& m) const {
    to.gps.times_ns.push_back(m.time_ns);
    append(to.gps.latitude_longitude_altitude, {m.latitude, m.longitude, m.altitude});
    append(to.gps.velocity_enu, m.velocity_enu);
    to.gps.fix.push_back(static_cast<std::int8_t>(m.fix));
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
