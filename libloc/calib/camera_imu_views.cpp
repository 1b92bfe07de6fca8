#include "libloc/calib/camera_imu_views.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "libloc/calib/camera_bundle.hpp"
#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::calib {
namespace {

using Eigen::Vector3d;

constexpr int kLeastCorners = 6;
constexpr double kWorstPose = 5;  // [px] rms of a picture's corners
constexpr double kPoseHuber = 1;  // [px]
constexpr double kFollows = 0.5;  // [s] between two pictures in which a rig does not turn by half a turn
constexpr double kMargin = 0.5;   // [s] of IMU samples beyond the pictures
constexpr double kInside = 0.02;  // [s] that pictures keep from the ends
constexpr double kLongGap = 4;    // [s] without samples, or without pictures and their margins, that is cut out
constexpr double kClosedGap = 1;  // [s] that is left of it: pictures beside it may move while their offset is found
constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr double kFarApart = 600e9;  // [ns] between stamps: no gap of one recording
constexpr double kCentury = 3.2e18;  // [ns]: beyond, differences of times are none

// The longest rising sequence of times: a stamp that jumps away and back is left out, however far it jumped. @returns
// places in order (Fredman 1975).
std::vector<std::size_t> rising(std::span<const TimeNs> times) {
  constexpr auto kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> last;  // of a sequence of each length, the one that ends lowest
  std::vector<std::size_t> before(times.size(), kNone);
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto at = std::ranges::lower_bound(last, times[i], {}, [&](std::size_t k) { return times[k]; });
    if (at != last.begin()) before[i] = *std::prev(at);
    if (at == last.end()) {
      last.push_back(i);
    } else if (times[*at] != times[i]) {
      *at = i;
    }
  }
  std::vector<std::size_t> out;
  for (std::size_t i = last.empty() ? kNone : last.back(); i != kNone; i = before[i]) out.push_back(i);
  std::ranges::reverse(out);
  return out;
}

// [first, last) of the longest part without a gap that no recording has.
std::pair<std::size_t, std::size_t> together(std::span<const TimeNs> rising_times) {
  std::pair<std::size_t, std::size_t> best{0, 0};
  std::size_t first = 0;
  for (std::size_t i = 1; i <= rising_times.size(); ++i) {
    const bool ends = i == rising_times.size() ||
                      static_cast<double>(rising_times[i]) - static_cast<double>(rising_times[i - 1]) > kFarApart;
    if (!ends) continue;
    if (i - first > best.second - best.first) best = {first, i};
    first = i;
  }
  return best;
}

std::vector<ImuRow> read_imu(std::span<const ImuMeasurement> imu, TimeNs& origin, NamedCounts& counts) {
  std::vector<const ImuMeasurement*> finite;
  for (const ImuMeasurement& m : imu) {
    if (m.time_ns != kNoTime && m.angular_velocity.allFinite() && m.specific_force.allFinite()) finite.push_back(&m);
  }
  std::vector<TimeNs> times;
  times.reserve(finite.size());
  for (const ImuMeasurement* m : finite) times.push_back(m->time_ns);
  const std::vector<std::size_t> order = rising(times);
  std::vector<TimeNs> rising_times;
  rising_times.reserve(order.size());
  for (const std::size_t i : order) rising_times.push_back(times[i]);
  const auto [first, last] = together(rising_times);
  counts.push_back({"imu.skipped.not_finite", std::ssize(imu) - std::ssize(finite)});
  counts.push_back({"imu.skipped.time_not_later", std::ssize(times) - std::ssize(order)});
  counts.push_back({"imu.skipped.time_far_off", std::ssize(order) - static_cast<std::int64_t>(last - first)});
  if (last - first < 2) throw DataError("there are " + std::to_string(last - first) + " IMU samples that can be used");
  origin = rising_times[first];
  std::vector<ImuRow> out;
  for (std::size_t i = first; i < last; ++i) {
    const ImuMeasurement& m = *finite[order[i]];
    out.push_back({to_seconds(m.time_ns - origin), m.angular_velocity, m.specific_force});
  }
  return out;
}

// The pose of a picture by its corners alone, or why there is none.
std::string pose_of(const CameraCalibration& camera, BundleView& view) {
  if (view.corners.empty()) return "no corners";
  if (static_cast<int>(view.corners.size()) < kLeastCorners || !find_pose(camera, view, kPoseHuber)) {
    return "its corners give no pose";
  }
  double sum = 0;
  for (const auto& r : residuals_of(Camera(camera), view)) {
    if (r) sum += r->squaredNorm();
  }
  if (std::sqrt(sum / static_cast<double>(view.corners.size())) > kWorstPose) return "no pose explains its corners";
  return "";
}

// Pictures with a time that no other has, in its order; less those far from most. Says in reports what became of
// others.
std::vector<std::size_t> in_time(std::span<const TargetView> views, std::vector<CameraImuView>& reports) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (views[i].time_ns == kNoTime) {
      reports[i].reason = "it has no time";
    } else {
      order.push_back(i);
    }
  }
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return views[i].time_ns; });
  std::vector<std::size_t> unique;
  std::vector<TimeNs> times;
  for (const std::size_t i : order) {
    if (!times.empty() && views[i].time_ns == times.back()) {
      reports[i].reason = "its time is that of another picture";
      continue;
    }
    unique.push_back(i);
    times.push_back(views[i].time_ns);
  }
  const auto [first, last] = together(times);
  for (std::size_t i = 0; i < unique.size(); ++i) {
    if (i < first || i >= last) reports[unique[i]].reason = "its time is more than ten minutes from most others";
  }
  return {unique.begin() + static_cast<std::ptrdiff_t>(first), unique.begin() + static_cast<std::ptrdiff_t>(last)};
}

CameraImuRecording::OfCamera read_camera(const CalibrationTarget& target, const CameraRecording& recording,
                                         std::size_t camera, TimeNs imu_origin, double corner_sigma_px,
                                         std::vector<CameraImuView>& reports) {
  reports.resize(recording.views.size());
  for (const TargetView& view : recording.views) view.check(target);
  const std::vector<std::size_t> order = in_time(recording.views, reports);
  CameraImuRecording::OfCamera out;
  if (order.empty()) return out;
  const TimeNs origin = recording.views[order.front()].time_ns;
  if (std::abs(static_cast<double>(imu_origin) - static_cast<double>(origin)) > kCentury) {
    throw DataError(recording.camera.name + ": its pictures begin at " + std::to_string(origin) +
                    " ns, the IMU's samples at " + std::to_string(imu_origin) + " ns: more than a century apart");
  }
  out.origin_offset_s = to_seconds(imu_origin - origin);
  for (const std::size_t i : order) {
    const TargetView& view = recording.views[i];
    BundleView seen;
    FrameRow frame{.camera = camera,
                   .view = i,
                   .t_s = to_seconds(view.time_ns - origin),
                   .sigma_px = corner_sigma_px,
                   .corners = {}};
    for (const TargetCorner& corner : view.corners) {
      seen.corners.push_back({corner.id, target.corner(corner.id), corner.pixel_px, true});
      frame.corners.push_back({seen.corners.back().point, corner.pixel_px, corner.id, corner.id});
    }
    reports[i].reason = pose_of(recording.camera, seen);
    if (!reports[i].reason.empty()) continue;
    out.poses.push_back({frame.t_s, seen.T_camera_target.inverse()});
    out.frames.push_back(std::move(frame));
  }
  return out;
}

// Turns of a target that looks the same after it: the corner's new number, and coordinates of the same place by the new
// numbers.
struct Renumbering {
  std::vector<int> id;
  Pose3 T_new_old;
};

std::vector<Renumbering> renumberings(const CalibrationTarget& target) {
  std::vector<Renumbering> out;
  if (target.has_direction()) return out;
  const int quarters = target.columns == target.rows ? 4 : 2;
  const Vector3d middle = 0.5 * (target.corner(0) + target.corner(target.corner_count() - 1));
  for (int q = 1; q < quarters; ++q) {
    const Eigen::Quaterniond R = so3::exp(Vector3d(0, 0, 2 * std::numbers::pi * q / quarters));
    Renumbering turn{{}, {R, middle - R * middle}};
    for (int id = 0; id < target.corner_count(); ++id) {
      const Vector3d place = (turn.T_new_old * target.corner(id)) / target.size_m;
      turn.id.push_back(static_cast<int>(std::lround(place.y())) * target.columns +
                        static_cast<int>(std::lround(place.x())));
    }
    out.push_back(std::move(turn));
  }
  return out;
}

void renumber(const CalibrationTarget& target, const Renumbering& turn, CameraPoseSample& pose, FrameRow& frame) {
  pose.T_target_camera = turn.T_new_old * pose.T_target_camera;
  for (FrameCorner& corner : frame.corners) {
    corner.number = turn.id[static_cast<std::size_t>(corner.number)];
    corner.point = target.corner(corner.number);
  }
}

// Also in a short gap.
bool has_samples_at(std::span<const ImuRow> imu, double t_s) {
  const auto next = std::ranges::lower_bound(imu, t_s, {}, &ImuRow::t_s);
  if (next == imu.begin() || next == imu.end()) return false;
  const double since = t_s - std::prev(next)->t_s;
  const double until = next->t_s - t_s;
  const bool at_end = t_s - imu.front().t_s < kInside || imu.back().t_s - t_s < kInside;
  return !at_end && (since + until <= kLongGap || std::min(since, until) < kInside);
}

void close_gaps(CameraImuRecording& recording, const CameraImuFit& fit) {
  std::vector<ImuRow>& imu = recording.imu;
  double cut = 0;
  std::vector<CameraImuRecording::Seam> true_times;  // the seams where they are before anything moves
  for (std::size_t i = 1; i < imu.size(); ++i) {
    const double from = imu[i - 1].t_s + cut;
    const double gap = imu[i].t_s - from;
    if (gap > kLongGap) {
      true_times.push_back({from, gap - kClosedGap});
      recording.seams.push_back({imu[i - 1].t_s, gap - kClosedGap});
      cut += gap - kClosedGap;
    }
    imu[i].t_s -= cut;
  }
  for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
    CameraImuRecording::OfCamera& camera = recording.cameras[c];
    const double d = fit.cameras[c].start.time_offset_s;
    for (std::size_t i = 0; i < camera.frames.size(); ++i) {
      double behind = 0;
      for (const auto& seam : true_times) {
        if (camera.frames[i].t_s + d > seam.at_s + seam.cut_s / 2) behind += seam.cut_s;
      }
      camera.frames[i].t_s -= behind;
      camera.poses[i].t_s -= behind;
    }
  }
}

}  // namespace

CameraImuRecording read_recording(const CalibrationTarget& target, std::span<const CameraRecording> cameras,
                                  std::span<const ImuMeasurement> imu, double corner_sigma_px, CameraImuFit& fit) {
  CameraImuRecording out;
  out.imu = read_imu(imu, out.origin, fit.counts);
  fit.cameras.resize(cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    out.cameras.push_back(read_camera(target, cameras[c], c, out.origin, corner_sigma_px, fit.cameras[c].views));
  }
  return out;
}

TimeNs CameraImuRecording::time_of(double t_s) const {
  double cut = 0;
  for (const Seam& seam : seams) {
    if (t_s > seam.at_s) cut += seam.cut_s;
  }
  return origin + from_seconds(t_s + cut);
}

void keep_common(CameraImuRecording& recording, CameraImuFit& fit) {
  std::vector<ImuRow>& imu = recording.imu;
  // Pictures at times of the IMU.
  std::vector<double> pictures;
  for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
    CameraImuRecording::OfCamera& camera = recording.cameras[c];
    const double d = fit.cameras[c].start.time_offset_s;
    std::vector<FrameRow> frames;
    std::vector<CameraPoseSample> poses;
    for (std::size_t i = 0; i < camera.frames.size(); ++i) {
      const double t = camera.frames[i].t_s + d;
      if (!has_samples_at(imu, t)) {
        fit.cameras[c].views[camera.frames[i].view].reason = "no IMU samples at its time";
        continue;
      }
      pictures.push_back(t);
      frames.push_back(std::move(camera.frames[i]));
      poses.push_back(camera.poses[i]);
    }
    if (frames.empty()) {
      throw DataError(fit.cameras[c].camera.name + ": no picture with the target has IMU samples at its time");
    }
    const double middle = (frames.front().t_s + frames.back().t_s) / 2;
    for (FrameRow& frame : frames) frame.drift_s = frame.t_s - middle;
    camera.frames = std::move(frames);
    camera.poses = std::move(poses);
  }
  std::ranges::sort(pictures);
  const auto before = std::ssize(imu);
  std::erase_if(imu, [&](const ImuRow& row) {
    const auto next = std::ranges::lower_bound(pictures, row.t_s);
    const double since = next == pictures.begin() ? kFar : row.t_s - *std::prev(next);
    const double until = next == pictures.end() ? kFar : *next - row.t_s;
    return std::min(since, until) > kMargin && since + until > kLongGap + 2 * kMargin;
  });
  fit.counts.push_back({"imu.skipped.no_pictures", before - std::ssize(imu)});
  fit.counts.push_back({"imu.used", std::ssize(imu)});
  close_gaps(recording, fit);
}

int unify_numbers(const CalibrationTarget& target, const GyroTurns* gyro, const CameraImuStart* start,
                  CameraImuRecording::OfCamera& camera) {
  const std::vector<Renumbering> turns = renumberings(target);
  if (turns.empty()) return 0;
  int changed = 0;
  for (std::size_t i = 1; i < camera.poses.size(); ++i) {
    const CameraPoseSample& before = camera.poses[i - 1];
    CameraPoseSample& pose = camera.poses[i];
    Eigen::Quaterniond expected = before.T_target_camera.rotation;
    if (start != nullptr) {
      const Eigen::Quaterniond turn = gyro->between(before.t_s + start->time_offset_s, pose.t_s + start->time_offset_s);
      expected = expected * start->R_camera_imu * turn * start->R_camera_imu.conjugate();
    } else if (pose.t_s - before.t_s > kFollows) {
      continue;
    }
    const Renumbering* best = nullptr;
    double least = so3::angle_between(expected, pose.T_target_camera.rotation);
    for (const Renumbering& turn : turns) {
      const double angle = so3::angle_between(expected, turn.T_new_old.rotation * pose.T_target_camera.rotation);
      if (angle < least) {
        least = angle;
        best = &turn;
      }
    }
    if (best == nullptr) continue;
    renumber(target, *best, pose, camera.frames[i]);
    ++changed;
  }
  return changed;
}

void align_numbers(const CalibrationTarget& target, std::span<const Eigen::Quaterniond> expected,
                   CameraImuRecording::OfCamera& camera) {
  const std::vector<Renumbering> turns = renumberings(target);
  const auto misfit = [&](const Eigen::Quaterniond& turn) {
    double sum = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      sum += so3::angle_between(expected[i], turn * camera.poses[i].T_target_camera.rotation);
    }
    return sum;
  };
  const Renumbering* best = nullptr;
  double least = misfit(Eigen::Quaterniond::Identity());
  for (const Renumbering& turn : turns) {
    const double sum = misfit(turn.T_new_old.rotation);
    if (sum >= least) continue;
    least = sum;
    best = &turn;
  }
  if (best == nullptr) return;
  for (std::size_t i = 0; i < camera.poses.size(); ++i) renumber(target, *best, camera.poses[i], camera.frames[i]);
}

}  // namespace loc::calib
