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
  bool empty() const { return !magnetometer && !reference && !imu; }

  std::optional<MagnetometerMeasurement> magnetometer;
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
  // magnetometer, reference, imu
  std::array<TimeNs, 3> last_{kNoTime, kNoTime, kNoTime};
  std::array<std::int64_t, 3> repeated_{};
  std::array<std::int64_t, 3> read_{};
  std::array<std::int64_t, 3> not_finite_{};
};

}  // namespace loc::io
