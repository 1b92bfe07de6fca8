#include "libloc/io/euroc.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "libloc/core/check.hpp"
#include "libloc/io/image_list.hpp"
#include "libloc/io/table.hpp"

namespace loc {
namespace {

namespace fs = std::filesystem;

// One file of the recording, one sample ahead.
class Stream {
 public:
  Stream(const fs::path& path, StreamKind kind, const CsvOptions& options)
      : table_(path, options, stream_name(kind)), kind_(kind) {
    if (!table_.has(needed(kind))) throw DataError(path.string() + ": no columns of " + stream_name(kind));
  }

  // Read when it is asked for, so that a bad row does not take the good one before it along.
  const std::optional<Measurement>& head() {
    if (!loaded_) advance();
    loaded_ = true;
    return head_;
  }
  Measurement take() {
    loaded_ = false;
    return std::move(*head_);
  }
  void add_counts(NamedCounts& counts) const { table_.add_counts(counts); }

 private:
  static io::Quantity needed(StreamKind kind) {
    switch (kind) {
      case StreamKind::kImu:
        return io::Quantity::kAngularVelocity;
      case StreamKind::kMagnetometer:
        return io::Quantity::kMagneticField;
      case StreamKind::kGps:
        return io::Quantity::kLatitudeLongitude;
      case StreamKind::kOdometry:
        return io::Quantity::kOdometryPosition;
      default:
        return io::Quantity::kOrientation;
    }
  }

  template <class M>
  void take_over(const std::optional<M>& measurement) {
    if (measurement) head_ = *measurement;
  }

  void advance() {
    head_.reset();
    const auto row = table_.next();
    if (!row) return;
    switch (kind_) {
      case StreamKind::kImu:
        take_over(row->imu);
        break;
      case StreamKind::kMagnetometer:
        take_over(row->magnetometer);
        break;
      case StreamKind::kGps:
        take_over(row->gps);
        break;
      case StreamKind::kOdometry:
        take_over(row->odometry);
        break;
      default:
        take_over(row->reference);
    }
    if (!head_) throw DataError(table_.where() + ": no cells of " + stream_name(kind_));
    stamp_of(*head_).sequence = sequence_++;
  }

  io::Table table_;
  StreamKind kind_;
  std::optional<Measurement> head_;
  bool loaded_ = false;
  std::int64_t sequence_ = 0;
};

class EurocSource final : public MeasurementSource {
 public:
  EurocSource(const fs::path& folder, const EurocOptions& options) {
    fs::path mav = folder;
    if (fs::is_directory(io::status_of(folder / "mav0"))) mav = folder / "mav0";
    if (!fs::is_directory(io::status_of(mav))) throw DataError(folder.string() + ": no such folder");
    // In the order of equal times. EuRoC counts nanoseconds throughout, though not every heading says so.
    CsvOptions csv;
    csv.time_unit = "ns";
    const auto open = [&](std::size_t place, bool wanted, const char* name, StreamKind kind) {
      const fs::path file = mav / name / "data.csv";
      if (wanted && fs::exists(io::status_of(file))) streams_[place].emplace(file, kind, csv);
    };
    open(0, options.read_magnetometer, "mag0", StreamKind::kMagnetometer);
    open(1, options.read_gps, "gps0", StreamKind::kGps);
    open(2, options.read_odometry, "odometry0", StreamKind::kOdometry);
    open(3, options.read_reference, "state_groundtruth_estimate0", StreamKind::kReference);
    open(4, true, "imu0", StreamKind::kImu);
    if (std::ranges::any_of(streams_, [](const auto& stream) { return stream.has_value(); })) return;
    // Pictures alone are a recording, too; anything else is most likely the wrong folder.
    if (!euroc_cameras(mav).empty()) return;
    const fs::path imu = mav / "imu0" / "data.csv";
    throw DataError(imu.string() + ": no such file, nor any other stream; an EuRoC recording has them in mav0");
  }

  std::optional<Measurement> next() override {
    Stream* first = nullptr;
    for (auto& stream : streams_) {
      if (!stream || !stream->head()) continue;
      if (first == nullptr || stamp_of(*stream->head()).time_ns < stamp_of(*first->head()).time_ns) first = &*stream;
    }
    if (first == nullptr) return std::nullopt;
    return first->take();
  }

  NamedCounts counts() const override {
    NamedCounts counts;
    for (const auto& stream : streams_) {
      if (stream) stream->add_counts(counts);
    }
    if (!streams_[4]) counts.push_back({"imu.absent", 1});
    return counts;
  }

 private:
  std::array<std::optional<Stream>, 5> streams_;
};

}  // namespace

std::unique_ptr<MeasurementSource> open_euroc(const fs::path& folder, const EurocOptions& options) {
  return std::make_unique<EurocSource>(folder, options);
}

}  // namespace loc
