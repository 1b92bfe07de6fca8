// One text recording, row by row: heading, cells, times, counts. CSV and EuRoC both read through it. Internal to io.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "libloc/core/named_count.hpp"
#include "libloc/io/columns.hpp"
#include "libloc/io/csv.hpp"
#include "libloc/io/text_file.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc::io {

/// What one row held, at its time: something.
struct Row {
  bool empty() const { return !magnetometer && !gps && !odometry && !reference && !imu; }

  std::optional<MagnetometerMeasurement> magnetometer;
  std::optional<GpsMeasurement> gps;
  std::optional<OdometryMeasurement> odometry;
  std::optional<ReferenceMeasurement> reference;
  std::optional<ImuMeasurement> imu;
};

class Table {
 public:
  /// @param label of the rows in counts(): label + ".skipped.…"
  /// @throws DataError as open_csv; also when there is not one complete row.
  Table(const std::filesystem::path& path, const CsvOptions& options, std::string label);

  /// @throws DataError naming file, line, column and value.
  std::optional<Row> next();
  bool has(Quantity quantity) const;
  std::string where() const { return lines_.where(); }
  /// Added to counts.
  void add_counts(NamedCounts& counts) const;

 private:
  std::optional<Row> read_row();
  Row convert(TimeNs time_ns);
  std::optional<ReferenceMeasurement> convert_reference(TimeNs time_ns) const;
  std::optional<GpsMeasurement> convert_gps(TimeNs time_ns) const;
  std::optional<OdometryMeasurement> convert_odometry(TimeNs time_ns) const;
  std::int64_t take_integer(Quantity quantity, std::int64_t low, std::int64_t high, std::int64_t otherwise) const;
  void take_covariance(Quantity sigma, Eigen::Matrix3d& cov) const;
  Eigen::Quaterniond take_quaternion(Quantity quantity, const char* what, bool& any) const;
  [[noreturn]] void reject(Quantity quantity, std::size_t axis, const std::string& why) const;
  void drop_repeated(Row& row);
  bool take(Quantity quantity, double* values) const;

  LineReader lines_;
  std::string label_;
  std::vector<Column> columns_;
  std::vector<std::string_view> cells_;
  std::array<std::array<std::optional<std::size_t>, 4>, kQuantities> at_{};  // cell of each quantity and axis
  std::optional<Row> ahead_;
  TimeNs last_time_ns_ = kNoTime;  // of the last row that was given
  std::int64_t rows_back_ = 0;
  std::int64_t blank_ = 0;
  std::int64_t empty_ = 0;
  // magnetometer, gps, odometry, reference, imu
  static constexpr std::size_t kSensors = 5;
  std::array<TimeNs, kSensors> last_{kNoTime, kNoTime, kNoTime, kNoTime, kNoTime};
  std::array<std::int64_t, kSensors> repeated_{};
  std::array<std::int64_t, kSensors> read_{};
  std::array<std::int64_t, kSensors> not_finite_{};
};

}  // namespace loc::io
