#include "tools/support/fusion_options.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>

#include "libloc/core/check.hpp"
#include "libloc/estimators/fusion_preset.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr TimeNs kFarthestReference = 10'000'000;

GeodeticPoint parse_origin(const std::string& text) {
  std::array<double, 3> values{};
  const char* at = text.c_str();
  for (std::size_t i = 0; i < values.size(); ++i) {
    char* end = nullptr;
    values[i] = std::strtod(at, &end);
    const char expected = i + 1 < values.size() ? ',' : '\0';
    if (end == at || *end != expected) {
      throw UsageError("--origin '" + text + "': must be LATITUDE,LONGITUDE,ALTITUDE in degrees and metres");
    }
    at = end + 1;
  }
  const GeodeticPoint origin{values[0] * kDegree, values[1] * kDegree, values[2]};
  origin.check();
  return origin;
}

}  // namespace

void add_fusion_options(CLI::App& app, FusionArguments& arguments) {
  app.add_flag("--no-gps", arguments.no_gps, "error-state, SLAM: leave GPS aside");
  app.add_flag("--no-odometry", arguments.no_odometry, "error-state: leave odometry aside");
  app.add_flag("--no-zero-velocity", arguments.no_zero_velocity, "error-state: take no use of rest");
  arguments.odometry_option =
      app.add_option("--odometry", arguments.odometry,
                     "error-state: absolute (its world is ours), relative (only its motion), auto")
          ->check(CLI::IsMember({"auto", "absolute", "relative"}))
          ->capture_default_str();
  arguments.heading_option =
      app.add_option("--heading", arguments.heading_deg,
                     "error-state: heading at the start, from east to north [deg]; otherwise by magnetometer or GPS");
  app.add_option("--heading-sigma", arguments.heading_sigma_deg, "… its deviation [deg]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--declination", arguments.declination_deg, "error-state: magnetic declination, east positive [deg]")
      ->capture_default_str();
  arguments.gps_sigma_option = app.add_option("--gps-sigma", arguments.gps_sigma,
                                              "error-state, SLAM: horizontal deviation of a fix that states none [m]")
                                   ->check(CLI::PositiveNumber);
  app.add_option(
      "--origin", arguments.origin,
      "error-state, SLAM: LATITUDE,LONGITUDE,ALTITUDE of world's origin [deg, deg, m]; otherwise the first fix");
}

InertialFusionOptions fusion_options(const FusionArguments& arguments, const std::string& preset, const Rig& rig) {
  InertialFusionOptions options = InertialFusionOptions::preset(preset);
  options.use_gps = !arguments.no_gps;
  options.use_odometry = !arguments.no_odometry;
  if (arguments.no_zero_velocity) options.zero_velocity = false;
  if (arguments.odometry_option->count() > 0) options.odometry = parse_odometry_use(arguments.odometry);
  if (arguments.heading_option->count() > 0) options.start.heading = arguments.heading_deg * kDegree;
  options.start.heading_sigma = arguments.heading_sigma_deg * kDegree;
  options.start.magnetic_declination = arguments.declination_deg * kDegree;
  if (arguments.gps_sigma_option->count() > 0) options.gps_sigma = arguments.gps_sigma;
  if (!arguments.origin.empty()) options.origin = parse_origin(arguments.origin);
  if (rig.gps) {
    options.gps_antenna = rig.gps->antenna_in_body;
    if (std::isfinite(rig.gps->time_offset_sigma_s)) options.gps_time_sigma = rig.gps->time_offset_sigma_s;
  }
  // Guesses in the rig are no better than the preset's.
  if (rig.imu && !rig.imu->noise_measured.empty() && preset == "robust") options.filter.noise = rig.imu->noise;
  options.check();
  return options;
}

MapAnchorOptions anchor_options(const FusionArguments& arguments, bool inertial, const Rig& rig) {
  MapAnchorOptions options = MapAnchorOptions::robust(inertial);
  if (arguments.gps_sigma_option->count() > 0) options.gps_sigma = arguments.gps_sigma;
  if (!arguments.origin.empty()) options.origin = parse_origin(arguments.origin);
  if (rig.gps) {
    options.gps_antenna = rig.gps->antenna_in_body;
    if (std::isfinite(rig.gps->time_offset_sigma_s)) options.gps_time_sigma = rig.gps->time_offset_sigma_s;
  }
  options.check();
  return options;
}

GivenStart start_from_reference(MeasurementSource& source, const InertialFusionOptions& options,
                                const std::string& preset) {
  std::optional<TimeNs> first;
  std::optional<ReferenceMeasurement> nearest;
  const auto distance = [&](TimeNs time) { return std::abs(to_seconds(time) - to_seconds(*first)); };
  std::vector<ReferenceMeasurement> before;
  while (const auto measurement = source.next()) {
    if (const auto* imu = std::get_if<ImuMeasurement>(&*measurement); imu != nullptr && !first) {
      first = imu->time_ns;
    }
    if (const auto* reference = std::get_if<ReferenceMeasurement>(&*measurement)) before.push_back(*reference);
    if (!first) {
      if (before.size() > 1) before.erase(before.begin());
      continue;
    }
    for (const ReferenceMeasurement& reference : before) {
      if (!nearest || distance(reference.time_ns) < distance(nearest->time_ns)) nearest = reference;
    }
    before.clear();
    const TimeNs time = stamp_of(*measurement).time_ns;
    if (time - *first > kFarthestReference) break;
  }
  if (!nearest || distance(nearest->time_ns) > to_seconds(kFarthestReference)) {
    throw DataError("--start reference: the recording has no reference within 10 ms of its first IMU sample");
  }
  const ReferenceMeasurement& x = *nearest;
  if (!x.q_world_body.coeffs().allFinite() || !x.position.allFinite() || !x.velocity.allFinite()) {
    throw DataError("--start reference: the reference at " + std::to_string(x.time_ns) +
                    " ns does not know attitude, position and velocity");
  }
  GivenStart start;
  start.state.inertial.q_world_body = x.q_world_body;
  start.state.inertial.position = x.position;
  start.state.inertial.velocity = x.velocity;
  start.state.scale = options.scale;
  const int size = ErrorStateFilter(options.filter).layout().size;
  const Eigen::MatrixXd known = FusionPreset::by_name(preset == "robust" ? "19" : preset).start_cov;
  start.covariance = Eigen::MatrixXd::Zero(size, size);
  const Eigen::Index common = std::min<Eigen::Index>(size, known.rows());
  start.covariance.topLeftCorner(common, common) = known.topLeftCorner(common, common);
  if (preset == "robust") {
    const auto set = [&](int at, double sigma) {
      start.covariance.diagonal().segment<3>(at).setConstant(sigma * sigma);
    };
    set(kGyroscopeBias, options.filter.noise.gyroscope_bias_sigma);
    set(kAccelerometerBias, options.filter.noise.accelerometer_bias_sigma);
  }
  return start;
}

}  // namespace loc
