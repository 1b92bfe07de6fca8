#include "libloc/io/table.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "libloc/core/check.hpp"

namespace loc::io {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
enum : std::size_t { kMagnetometerRow = 0, kGpsRow = 1, kOdometryRow = 2, kReferenceRow = 3, kImuRow = 4 };
constexpr std::array<const char*, 5> kRowNames{"magnetometer", "gps", "odometry", "reference", "imu"};

}  // namespace

Table::Table(const std::filesystem::path& path, const CsvOptions& options, std::string label)
    : lines_(path), label_(std::move(label)) {
  auto heading = lines_.next();
  while (heading && trim(*heading).empty()) {
    ++blank_;
    heading = lines_.next();
  }
  if (!heading) throw DataError(path.string() + ": the heading line has no end");
  if (trim(*heading).starts_with('#') && heading->find(',') == std::string_view::npos) {
    throw DataError(lines_.where() + ": a comment, not a heading: the first line must name the columns");
  }
  columns_ = parse_heading(*heading, lines_.where(), options);
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    at_[static_cast<std::size_t>(columns_[i].quantity)][columns_[i].axis] = i;
  }
  ahead_ = read_row();
  if (!ahead_) throw DataError(path.string() + ": no complete row under the heading");
}

bool Table::has(Quantity quantity) const {
  return at_[static_cast<std::size_t>(quantity)][0].has_value();
}

std::optional<Row> Table::next() {
  std::optional<Row> row = std::move(ahead_);
  ahead_.reset();
  if (!row) row = read_row();
  if (row) {
    const std::array<bool, kSensors> present{row->magnetometer.has_value(), row->gps.has_value(),
                                             row->odometry.has_value(), row->reference.has_value(),
                                             row->imu.has_value()};
    for (std::size_t i = 0; i < present.size(); ++i) {
      if (present[i]) ++read_[i];
    }
    if (row->magnetometer && !row->magnetometer->magnetic_field.allFinite()) ++not_finite_[kMagnetometerRow];
    if (row->gps && !(std::isfinite(row->gps->latitude) && std::isfinite(row->gps->longitude))) ++not_finite_[kGpsRow];
    if (row->odometry && !(row->odometry->position.allFinite() &&
                           (!has(Quantity::kOdometryOrientation) || row->odometry->rotation.coeffs().allFinite()))) {
      ++not_finite_[kOdometryRow];
    }
    if (row->imu && !(row->imu->angular_velocity.allFinite() && row->imu->specific_force.allFinite())) {
      ++not_finite_[kImuRow];
    }
    if (row->reference && ((has(Quantity::kOrientation) && !row->reference->q_world_body.coeffs().allFinite()) ||
                           (has(Quantity::kPosition) && !row->reference->position.allFinite()))) {
      ++not_finite_[kReferenceRow];
    }
  }
  return row;
}

std::optional<Row> Table::read_row() {
  while (const auto line = lines_.next()) {
    if (trim(*line).empty()) {
      ++blank_;
      continue;
    }
    split_cells(*line, cells_);
    if (cells_.size() != columns_.size()) {
      throw DataError(lines_.where() + ": " + std::to_string(cells_.size()) + " cells where the heading has " +
                      std::to_string(columns_.size()));
    }
    const std::size_t time_cell = *at_[static_cast<std::size_t>(Quantity::kTime)][0];
    const Column& time_column = columns_[time_cell];
    const auto time_ns = parse_time(cells_[time_cell], time_column.time_exponent);
    if (!time_ns) {
      throw DataError(lines_.where() + ": column '" + time_column.heading + "': '" + std::string(cells_[time_cell]) +
                      "' is not a time");
    }
    // All of the row is read even when it is skipped then: damage must show.
    Row row = convert(*time_ns);
    if (row.empty()) {
      ++empty_;
      continue;
    }
    if (*time_ns < last_time_ns_) {
      ++rows_back_;
      continue;
    }
    drop_repeated(row);
    if (row.empty()) continue;
    last_time_ns_ = *time_ns;
    return row;
  }
  return std::nullopt;
}

// Rows may share a time, one for each sensor. Times are compared sensor by sensor, so that none is lost for another.
void Table::drop_repeated(Row& row) {
  const auto check = [&](auto& measurement, std::size_t i) {
    if (!measurement) return;
    if (measurement->time_ns <= last_[i]) {  // false for the first: kNoTime is before every time
      ++repeated_[i];
      measurement.reset();
    } else {
      last_[i] = measurement->time_ns;
    }
  };
  check(row.magnetometer, kMagnetometerRow);
  check(row.gps, kGpsRow);
  check(row.odometry, kOdometryRow);
  check(row.reference, kReferenceRow);
  check(row.imu, kImuRow);
}

// True when the cells hold the quantity, false when all are empty (or there is no such column).
bool Table::take(Quantity quantity, double* values) const {
  if (!has(quantity)) return false;
  std::size_t empty = 0;
  const std::size_t axes = axes_of(quantity);
  for (std::size_t axis = 0; axis < axes; ++axis) {
    const std::size_t cell = *at_[static_cast<std::size_t>(quantity)][axis];
    if (cells_[cell].empty()) {
      ++empty;
      continue;
    }
    const auto value = parse_number(cells_[cell]);
    if (!value) {
      throw DataError(lines_.where() + ": column '" + columns_[cell].heading + "': '" + std::string(cells_[cell]) +
                      "' is not a number");
    }
    values[axis] = *value * columns_[cell].to_si;
  }
  if (empty != 0 && empty != axes) {
    const std::size_t cell = *at_[static_cast<std::size_t>(quantity)][0];
    throw DataError(lines_.where() + ": column '" + columns_[cell].heading + "' and its fellows: some cells are empty");
  }
  return empty == 0;
}

Row Table::convert(TimeNs time_ns) {
  Row row;
  Eigen::Vector3d a;
  Eigen::Vector3d b;
  const bool has_rate = take(Quantity::kAngularVelocity, a.data());
  const bool has_force = take(Quantity::kSpecificForce, b.data());
  if (has_rate != has_force) {
    throw DataError(lines_.where() + ": angular velocity and specific force: one is empty, the other is not");
  }
  if (has_rate) {
    row.imu.emplace();
    row.imu->time_ns = time_ns;
    row.imu->angular_velocity = a;
    row.imu->specific_force = b;
  }
  if (take(Quantity::kMagneticField, a.data())) {
    row.magnetometer.emplace();
    row.magnetometer->time_ns = time_ns;
    row.magnetometer->magnetic_field = a;
  }

  row.gps = convert_gps(time_ns);
  row.odometry = convert_odometry(time_ns);
  row.reference = convert_reference(time_ns);
  return row;
}

void Table::reject(Quantity quantity, std::size_t axis, const std::string& why) const {
  const std::size_t cell = *at_[static_cast<std::size_t>(quantity)][axis];
  throw DataError(lines_.where() + ": column '" + columns_[cell].heading + "': '" + std::string(cells_[cell]) +
                  "': " + why);
}

// Normalised; NaN where the cells are NaN or empty, and then any stays as it was.
Eigen::Quaterniond Table::take_quaternion(Quantity quantity, const char* what, bool& any) const {
  std::array<double, 4> wxyz{kNan, kNan, kNan, kNan};
  if (!take(quantity, wxyz.data())) return {kNan, kNan, kNan, kNan};
  any = true;
  const Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  if (std::abs(q.norm() - 1) > 1e-2) {  // false for NaN, which passes
    throw DataError(lines_.where() + ": " + what + " quaternion with norm " + to_text(q.norm()) + ": must be 1");
  }
  return std::isfinite(q.norm()) ? q.normalized() : Eigen::Quaterniond(kNan, kNan, kNan, kNan);
}

std::int64_t Table::take_integer(Quantity quantity, std::int64_t low, std::int64_t high, std::int64_t otherwise) const {
  double value = 0;
  if (!take(quantity, &value)) return otherwise;
  if (!(value >= static_cast<double>(low) && value <= static_cast<double>(high) && value == std::floor(value))) {
    reject(quantity, 0, "must be a whole number in [" + std::to_string(low) + ", " + std::to_string(high) + "]");
  }
  return static_cast<std::int64_t>(value);
}

void Table::take_covariance(Quantity sigma, Eigen::Matrix3d& cov) const {
  Eigen::Vector3d s;
  if (!take(sigma, s.data())) return;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (s[i] < 0) reject(sigma, static_cast<std::size_t>(i), "a deviation must not be negative");
  }
  cov = s.cwiseAbs2().asDiagonal();
}

std::optional<GpsMeasurement> Table::convert_gps(TimeNs time_ns) const {
  GpsMeasurement gps;
  gps.time_ns = time_ns;
  Eigen::Vector2d place(kNan, kNan);
  bool any = take(Quantity::kLatitudeLongitude, place.data());
  any = take(Quantity::kAltitude, &gps.altitude) || any;
  any = take(Quantity::kGpsVelocity, gps.velocity_enu.data()) || any;
  if (std::abs(place.x()) > std::numbers::pi / 2) {
    reject(Quantity::kLatitudeLongitude, 0, "must be within 90 degrees of the equator");
  }
  if (std::abs(place.y()) > 2 * std::numbers::pi) {
    reject(Quantity::kLatitudeLongitude, 1, "must be within 360 degrees");
  }
  gps.latitude = place.x();
  gps.longitude = place.y();
  const GpsFixType by_content = std::isnan(gps.latitude)   ? GpsFixType::kNone
                                : std::isnan(gps.altitude) ? GpsFixType::k2d
                                                           : GpsFixType::k3d;
  gps.fix = static_cast<GpsFixType>(take_integer(Quantity::kGpsFix, static_cast<std::int64_t>(GpsFixType::kNone),
                                                 static_cast<std::int64_t>(GpsFixType::kFixed),
                                                 static_cast<std::int64_t>(by_content)));
  gps.satellites = static_cast<std::int32_t>(take_integer(Quantity::kSatellites, -1, 1000, -1));
  take_covariance(Quantity::kGpsSigma, gps.position_cov);
  take_covariance(Quantity::kGpsVelocitySigma, gps.velocity_cov);
  if (!any) return std::nullopt;
  return gps;
}

std::optional<OdometryMeasurement> Table::convert_odometry(TimeNs time_ns) const {
  OdometryMeasurement odometry;
  odometry.time_ns = time_ns;
  bool any = take(Quantity::kOdometryPosition, odometry.position.data());
  odometry.rotation = take_quaternion(Quantity::kOdometryOrientation, "odometry", any);
  take_covariance(Quantity::kOdometryPositionSigma, odometry.position_cov);
  take_covariance(Quantity::kOdometryOrientationSigma, odometry.orientation_cov);
  if (has(Quantity::kOdometryStart)) {
    const std::size_t cell = *at_[static_cast<std::size_t>(Quantity::kOdometryStart)][0];
    if (!cells_[cell].empty()) {
      const auto start_ns = parse_time(cells_[cell], columns_[cell].time_exponent);
      if (!start_ns) reject(Quantity::kOdometryStart, 0, "is not a time");
      if (*start_ns >= time_ns) reject(Quantity::kOdometryStart, 0, "must be before the time of its row");
      odometry.start_time_ns = *start_ns;
    }
  }
  if (!any) return std::nullopt;
  return odometry;
}

std::optional<ReferenceMeasurement> Table::convert_reference(TimeNs time_ns) const {
  ReferenceMeasurement reference;
  reference.time_ns = time_ns;
  double score = 1;
  bool any = false;
  reference.q_world_body = take_quaternion(Quantity::kOrientation, "reference", any);
  any = take(Quantity::kPosition, reference.position.data()) || any;
  any = take(Quantity::kVelocity, reference.velocity.data()) || any;
  if (take(Quantity::kScore, &score)) {
    if (score != 0 && score != 1) {
      throw DataError(lines_.where() + ": score = " + to_text(score) + ": must be 0 or 1");
    }
    reference.score = score == 1;
  }
  if (!any) return std::nullopt;
  return reference;
}

void Table::add_counts(NamedCounts& counts) const {
  for (std::size_t i = 0; i < read_.size(); ++i) {
    if (read_[i] > 0) counts.push_back({std::string(kRowNames[i]) + ".read", read_[i]});
    if (not_finite_[i] > 0) counts.push_back({std::string(kRowNames[i]) + ".not_finite", not_finite_[i]});
  }
  // A file of one sensor is labelled with the sensor's name: then both are one count.
  std::int64_t rows_back = rows_back_;
  for (std::size_t i = 0; i < repeated_.size(); ++i) {
    std::int64_t skipped = repeated_[i];
    if (label_ == kRowNames[i]) skipped += std::exchange(rows_back, 0);
    if (skipped > 0) counts.push_back({std::string(kRowNames[i]) + ".skipped.time_not_increasing", skipped});
  }
  if (rows_back > 0) counts.push_back({label_ + ".skipped.time_not_increasing", rows_back});
  if (empty_ > 0) counts.push_back({label_ + ".skipped.empty", empty_});
  if (blank_ > 0) counts.push_back({label_ + ".skipped.blank", blank_});
  if (lines_.cut_tail()) counts.push_back({label_ + ".skipped.no_line_end", 1});
}

}  // namespace loc::io
