#include "libloc/sim/magnetometer.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"

namespace loc {

Eigen::Vector3d MagneticDipole::field_at(const Eigen::Vector3d& place) const {
  constexpr double kMuOver4Pi = 1e-7;  // [T m/A]
  const Eigen::Vector3d r = place - position;
  const double distance = r.norm();
  // At the very centre there is no direction; the field on the axis stands for it.
  const Eigen::Vector3d direction = distance > 0 ? Eigen::Vector3d(r / distance) : moment.stableNormalized();
  const double far = std::max(distance, radius);
  return kMuOver4Pi / (far * far * far) * (3 * moment.dot(direction) * direction - moment);
}

void MagnetometerModel::check() const {
  require_positive("magnetometer.rate_hz", rate_hz);
  require(rate_hz <= 1e4, "magnetometer.rate_hz", rate_hz, "must not exceed 1e4");
  for (const double x : field) require_finite("magnetometer.field", x);
  for (const double x : hard_iron) require_finite("magnetometer.hard_iron", x);
  require(soft_iron.allFinite() && std::abs(soft_iron.determinant()) > 1e-6,
          "magnetometer.soft_iron: must be finite and not singular");
  require_not_negative("magnetometer.sigma", sigma);
  require(range > 0, "magnetometer.range", range, "must be positive");
  require_not_negative("magnetometer.resolution", resolution);
  require(resolution <= range, "magnetometer.resolution", resolution, "must not exceed the range");
  for (const FieldDisturbance& d : disturbances) {
    check_intervals("magnetometer.disturbances", {d.when});
    for (const double x : d.field) require_finite("magnetometer.disturbances.field", x);
  }
  for (const MagneticDipole& d : dipoles) {
    require(d.position.allFinite() && d.moment.allFinite(), "magnetometer.dipoles: must be finite");
    require_positive("magnetometer.dipoles.radius", d.radius);
  }
}

MagnetometerCalibration MagnetometerModel::calibration() const {
  check();
  MagnetometerCalibration c;
  c.triad.bias = hard_iron;
  c.triad.matrix = soft_iron.inverse();
  return c;
}

MagnetometerSimulator::MagnetometerSimulator(const MagnetometerModel& model, Random random)
    : model_((model.check(), model)), random_(random) {}

Eigen::Vector3d MagnetometerSimulator::true_field(double time_s, const Eigen::Vector3d& position) const {
  Eigen::Vector3d field = model_.field;
  for (const FieldDisturbance& d : model_.disturbances) {
    if (d.when.contains(time_s)) field += d.field;
  }
  for (const MagneticDipole& d : model_.dipoles) field += d.field_at(position);
  return field;
}

MagnetometerMeasurement MagnetometerSimulator::measure(const MotionState& state) {
  const Eigen::Vector3d body =
      state.T_world_body.rotation.conjugate() * true_field(state.time_s, state.T_world_body.translation);
  MagnetometerMeasurement m;
  m.time_ns = from_seconds(state.time_s);
  m.magnetic_field = round_reading(model_.soft_iron * body + model_.hard_iron + model_.sigma * random_.normal3(),
                                   model_.range, model_.resolution)
                         .value;
  return m;
}

}  // namespace loc
