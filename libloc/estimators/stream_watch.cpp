#include "libloc/estimators/stream_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr double kFollow = 0.1;  // of an interval, to the usual one
constexpr double kFarthest =
    5;  // a sample further back is another time line; further ahead, a second one must agree [s]

}  // namespace

StreamWatch::StreamWatch(StreamWatchOptions options)
    : limits_{options.imu_s, options.images_s, options.gps_s}, intervals_(options.intervals) {
  require_positive("imu_s", options.imu_s);
  require_positive("images_s", options.images_s);
  require_positive("gps_s", options.gps_s);
  require_positive("intervals", options.intervals);
  for (const StreamKind kind : options.needed) {
    if (const Group group = group_of(kind); group != kGroups) needed_[group] = true;
  }
}

StreamWatch::Group StreamWatch::group_of(StreamKind kind) {
  switch (kind) {
    case StreamKind::kImu:
      return kImuGroup;
    case StreamKind::kImage:
    case StreamKind::kFeatures:
      return kImageGroup;
    case StreamKind::kGps:
      return kGpsGroup;
    default:
      return kGroups;
  }
}

void StreamWatch::see(const Measurement& measurement) {
  const Group group = group_of(kind_of(measurement));
  const TimeNs time = stamp_of(measurement).time_ns;
  if (group == kGroups || time == kNoTime) return;
  if (newest_ns_ != kNoTime) {
    const double ahead = apart_s(time, newest_ns_);
    // A receiver whose clock is another one says nothing of the others' time.
    if (group == kGpsGroup && std::abs(ahead) > kFarthest) return;
    if (ahead < -kFarthest) reset();
    if (ahead > kFarthest && !std::exchange(far_ahead_, true)) return;
  }
  far_ahead_ = false;
  if (first_ns_ == kNoTime) first_ns_ = time;
  newest_ns_ = std::max(newest_ns_, time);
  Stream& stream = streams_[group];
  if (stream.last_ns != kNoTime && time > stream.last_ns) {
    const double interval = apart_s(time, stream.last_ns);
    // An outage is no interval.
    if (stream.interval_s == 0) {
      stream.interval_s = interval;
    } else if (interval < intervals_ * stream.interval_s) {
      stream.interval_s += kFollow * (interval - stream.interval_s);
    }
  }
  stream.last_ns = std::max(stream.last_ns, time);
}

std::uint32_t StreamWatch::status() const {
  constexpr std::array<std::uint32_t, kGroups> kBits = {kNoImu, kNoImages, kNoGps};
  std::uint32_t status = 0;
  for (std::size_t i = 0; i < kGroups; ++i) {
    const Stream& stream = streams_[i];
    if (stream.last_ns == kNoTime && !needed_[i]) continue;
    const TimeNs since = stream.last_ns != kNoTime ? stream.last_ns : first_ns_;
    if (since == kNoTime) continue;
    const double limit = std::max(limits_[i], intervals_ * stream.interval_s);
    if (apart_s(newest_ns_, since) > limit) status |= kBits[i];
  }
  return status;
}

void StreamWatch::reset() {
  streams_ = {};
  first_ns_ = newest_ns_ = kNoTime;
  far_ahead_ = false;
}

}  // namespace loc
