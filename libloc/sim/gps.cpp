#include "libloc/sim/gps.hpp"

#include "libloc/core/check.hpp"

namespace loc {
namespace {

// Each a generator of its own, so that one kind of error can be switched on without changing the others.
enum Draw : std::uint64_t { kPosition, kVelocity, kColoured };

Eigen::Vector3d enu(double horizontal, double vertical) {
  return {horizontal, horizontal, vertical};
}

}  // namespace

GpsModel GpsModel::single() {
  GpsModel m;
  m.sigma_horizontal = 0.5;
  m.sigma_vertical = 1;
  m.coloured_sigma_horizontal = 1.5;
  m.coloured_sigma_vertical = 3;
  return m;
}

GpsModel GpsModel::rtk() {
  GpsModel m;
  m.rate_hz = 5;
  m.sigma_horizontal = 0.01;
  m.sigma_vertical = 0.02;
  m.sigma_velocity_horizontal = 0.03;
  m.sigma_velocity_vertical = 0.05;
  m.fix = GpsFixType::kFixed;
  m.satellites = 16;
  return m;
}

void GpsModel::check() const {
  require_positive("gps.rate_hz", rate_hz);
  require(rate_hz <= 1000, "gps.rate_hz", rate_hz, "must not exceed 1000");
  require_not_negative("gps.sigma_horizontal", sigma_horizontal);
  require_not_negative("gps.sigma_vertical", sigma_vertical);
  require_not_negative("gps.coloured_sigma_horizontal", coloured_sigma_horizontal);
  require_not_negative("gps.coloured_sigma_vertical", coloured_sigma_vertical);
  require_positive("gps.coloured_time_s", coloured_time_s);
  require_not_negative("gps.sigma_velocity_horizontal", sigma_velocity_horizontal);
  require_not_negative("gps.sigma_velocity_vertical", sigma_velocity_vertical);
  for (const double x : antenna_in_body) require_finite("gps.antenna_in_body", x);
  require_not_negative("gps.latency_s", latency_s);
  require_finite("gps.stamp_delay_s", stamp_delay_s);
  check_intervals("gps.outages", outages);
  require(fix >= GpsFixType::k3d && fix <= GpsFixType::kFixed, "gps.fix", static_cast<double>(fix),
          "must be a fix in three dimensions (3 to 6)");
  require(satellites >= -1 && satellites <= 200, "gps.satellites", satellites, "must be in [-1, 200]");
  origin.check();
}

GpsSimulator::GpsSimulator(const GpsModel& model, Random random)
    : model_((model.check(), model)),
      frame_(model.origin),
      position_(random.fork(kPosition)),
      velocity_(random.fork(kVelocity)),
      coloured_(enu(model.coloured_sigma_horizontal, model.coloured_sigma_vertical), model.coloured_time_s,
                random.fork(kColoured)),
      truth_{coloured_.value()} {}

std::optional<GpsMeasurement> GpsSimulator::measure(const MotionState& state) {
  if (last_time_s_) {
    require(state.time_s > *last_time_s_, "time_s", state.time_s, "must be after the last epoch's");
    truth_.coloured_error = coloured_.advance(state.time_s - *last_time_s_);
  }
  last_time_s_ = state.time_s;
  // Drawn at every epoch, so that outages leave the errors of the other ones as they were.
  const Eigen::Vector3d sigma = enu(model_.sigma_horizontal, model_.sigma_vertical);
  const Eigen::Vector3d sigma_velocity = enu(model_.sigma_velocity_horizontal, model_.sigma_velocity_vertical);
  const Eigen::Vector3d position_error = sigma.cwiseProduct(position_.normal3()) + truth_.coloured_error;
  const Eigen::Vector3d velocity_error = sigma_velocity.cwiseProduct(velocity_.normal3());
  if (contains(model_.outages, state.time_s)) return std::nullopt;

  const TimeNs since_start = from_seconds(state.time_s);
  const Eigen::Vector3d antenna = state.T_world_body * model_.antenna_in_body;
  const GeodeticPoint place = frame_.to_geodetic(antenna);
  // East, north and up of the antenna's place are not quite those of the origin.
  const Eigen::Matrix3d R_world_enu = frame_.R_local_enu(place);
  const GeodeticPoint told = frame_.to_geodetic(antenna + R_world_enu * position_error);
  GpsMeasurement m;
  m.time_ns = since_start + from_seconds(model_.stamp_delay_s);
  m.host_time_ns = since_start + from_seconds(model_.latency_s);
  m.fix = model_.fix;
  m.satellites = model_.satellites;
  m.gps_time_ns = model_.start_gps_time_ns + since_start;
  m.latitude = told.latitude;
  m.longitude = told.longitude;
  m.altitude = told.altitude;
  const Eigen::Vector3d coloured = enu(model_.coloured_sigma_horizontal, model_.coloured_sigma_vertical);
  m.position_cov = (sigma.cwiseAbs2() + coloured.cwiseAbs2()).asDiagonal();
  if (model_.with_velocity) {
    const Eigen::Vector3d velocity =
        state.velocity + state.T_world_body.rotation * state.angular_velocity.cross(model_.antenna_in_body);
    m.velocity_enu = R_world_enu.transpose() * velocity + velocity_error;
    m.velocity_cov = sigma_velocity.cwiseAbs2().asDiagonal();
  }
  return m;
}

}  // namespace loc
