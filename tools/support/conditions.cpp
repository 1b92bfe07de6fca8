#include "tools/support/conditions.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "libloc/estimators/estimate.hpp"
#include "tools/support/log.hpp"

namespace loc {
namespace {

constexpr double kOver = 0.5;   // not said for so long [s]
constexpr double kSetBack = 5;  // [s]

// What a person can do about it.
const char* hint_of(std::uint32_t bit) {
  switch (bit) {
    case kCalibrationDoubtful:
      return "calibrate the camera's intrinsics anew: loc-calibrate camera";
    case kStampsDoubtful:
      return "mend the stamps of either; a camera's: or add it to its time_offset_s in the rig";
    case kGpsStampsDoubtful:
      return "mend the stamps of GPS, or add it to time_offset_s of the GPS in the rig";
    default:
      return nullptr;
  }
}

}  // namespace

const std::array<Condition, Conditions::kConditions>& Conditions::known() {
  static constexpr std::array<Condition, kConditions> kAll = {
      {{kNoImages, "no images"},
       {kNoImu, "no IMU"},
       {kNoGps, "no GPS"},
       {kLost, "lost"},
       {kFewFeatures, "few features"},
       {kFeaturesRejected, "features rejected"},
       {kGpsRejected, "GPS rejected"},
       {kOdometryRejected, "odometry rejected"},
       {kCalibrationDoubtful, "calibration doubtful"},
       {kMapLinkUnknown, "link to the map from before unknown"},
       {kStampsDoubtful, "stamps of camera (odometry) and IMU doubtful"},
       {kGpsStampsDoubtful, "stamps of GPS doubtful"},
       {kTiltDoubtful, "tilt doubtful"},
       {kMagnetometerDisturbed, "magnetometer disturbed"}}};
  return kAll;
}

void Conditions::update(TimeNs time_ns, std::uint32_t status, const Detail& detail) {
  if (time_ns == kNoTime) return;
  if (now_ns_ != kNoTime && apart_s(now_ns_, time_ns) > kSetBack) {
    for (Track& track : tracks_) track.since_ns = track.seen_ns = kNoTime;
    held_.clear();
    changed_ = true;
    now_ns_ = time_ns;
  }
  now_ns_ = std::max(now_ns_, time_ns);
  if ((status & kRefound) != 0) log_info("event=refound time={}", format_seconds(now_ns_));
  bool changed = false;
  for (std::size_t i = 0; i < kConditions; ++i) {
    const Condition& condition = known()[i];
    Track& track = tracks_[i];
    if ((status & condition.bit) != 0) {
      track.seen_ns = now_ns_;
      if (track.since_ns != kNoTime) continue;
      track.since_ns = now_ns_;
      ++track.times;
      changed = true;
      track.detail = detail ? detail(condition.bit) : std::string();
      const char* hint = hint_of(condition.bit);
      log_warning("event=degraded condition=\"{}\" time={}{}{}", condition.name, format_seconds(now_ns_),
                  track.detail.empty() ? "" : " detail=\"" + track.detail + "\"",
                  hint == nullptr ? "" : " hint=\"" + std::string(hint) + "\"");
    } else if (track.since_ns != kNoTime && apart_s(now_ns_, track.seen_ns) > kOver) {
      log_info("event=restored condition=\"{}\" time={} after_s={:.3f}", condition.name, format_seconds(now_ns_),
               apart_s(track.seen_ns, track.since_ns));
      track.since_ns = kNoTime;
      changed = true;
    }
  }
  if (!changed) return;
  changed_ = true;
  held_.clear();
  for (std::size_t i = 0; i < kConditions; ++i) {
    if (tracks_[i].since_ns != kNoTime) held_.push_back({known()[i], tracks_[i].since_ns, tracks_[i].detail});
  }
}

void Conditions::set_silent(bool silent) {
  if (silent == silent_) return;
  silent_ = silent;
  changed_ = true;
  if (silent) {
    log_warning("event=degraded condition=\"no measurements\"");
  } else {
    log_info("event=restored condition=\"no measurements\"");
  }
}

std::uint32_t Conditions::status() const {
  std::uint32_t status = 0;
  for (const Held& held : held_) status |= held.condition.bit;
  return status;
}

bool Conditions::take_change() {
  return std::exchange(changed_, false);
}

NamedCounts Conditions::counts() const {
  NamedCounts out;
  for (std::size_t i = 0; i < kConditions; ++i) {
    if (tracks_[i].times == 0) continue;
    std::string name = std::string("condition.") + known()[i].name;
    std::replace(name.begin(), name.end(), ' ', '_');
    out.push_back({std::move(name), tracks_[i].times});
  }
  return out;
}

}  // namespace loc
