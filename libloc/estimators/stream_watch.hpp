// Which streams an estimator has to go on without: what is silent, on the clock of the measurements themselves, so that
// a recording tells the same as the live run.
#pragma once

#include <array>
#include <vector>

#include "libloc/estimators/estimate.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

struct StreamWatchOptions {
  // Silence beyond this, and beyond some of the stream's usual intervals, is an outage.
  double imu_s = 0.2;
  double images_s = 0.5;  ///< pictures, or tracks of them
  double gps_s = 3;
  double intervals = 5;
  /// Without these the estimator is not whole from the start; others are missed once they have been there.
  std::vector<StreamKind> needed;
};

class StreamWatch {
 public:
  explicit StreamWatch(StreamWatchOptions options = {});

  /// A measurement, in time or late. What has no time is left aside.
  void see(const Measurement& measurement);
  /// kNoImu, kNoImages, kNoGps: as of the newest measurement of all.
  std::uint32_t status() const;
  TimeNs newest_ns() const { return newest_ns_; }
  void reset();

 private:
  enum Group : std::uint8_t { kImuGroup, kImageGroup, kGpsGroup, kGroups };
  struct Stream {
    TimeNs last_ns = kNoTime;
    double interval_s = 0;  // usual
  };
  static Group group_of(StreamKind kind);

  std::array<double, kGroups> limits_;
  std::array<bool, kGroups> needed_{};
  double intervals_;
  std::array<Stream, kGroups> streams_{};
  TimeNs first_ns_ = kNoTime;
  TimeNs newest_ns_ = kNoTime;
  bool far_ahead_ = false;  // the last sample
};

}  // namespace loc
