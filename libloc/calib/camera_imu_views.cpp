#include "libloc/calib/camera_imu_views.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
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
constexpr std::int64_t kNoView = -1;

std::vector<ImuRow> read_imu(std::span<const ImuMeasurement> imu, TimeNs& origin, NamedCounts& counts) {
  std::vector<ImuRow> out;
  std::int64_t not_finite = 0;
  std::int64_t not_later = 0;
  TimeNs last = kNoTime;
  for (const ImuMeasurement& m : imu) {
    if (m.time_ns == kNoTime || !m.angular_velocity.allFinite() || !m.specific_force.allFinite()) {
      ++not_finite;
      continue;
    }
    if (!out.empty() && m.time_ns <= last) {
      ++not_later;
      continue;
    }
    if (out.empty()) origin = m.time_ns;
    last = m.time_ns;
    out.push_back({to_seconds(m.time_ns - origin), m.angular_velocity, m.specific_force});
  }
  counts.push_back({"imu.skipped.not_finite", not_finite});
  counts.push_back({"imu.skipped.time_not_later", not_later});
  if (out.size() < 2) throw DataError("there are " + std::to_string(out.size()) + " IMU samples that can be used");
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

CameraImuRecording::OfCamera read_camera(const CalibrationTarget& target, const CameraRecording& recording,
                                         std::size_t camera, TimeNs origin, double corner_sigma_px,
                                         std::vector<CameraImuView>& reports) {
  reports.resize(recording.views.size());
  std::vector<std::size_t> order(recording.views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return recording.views[i].time_ns; });
  CameraImuRecording::OfCamera out;
  std::int64_t last = kNoView;
  for (const std::size_t i : order) {
    const TargetView& view = recording.views[i];
    view.check(target);
    if (view.time_ns == kNoTime) {
      reports[i].reason = "it has no time";
      continue;
    }
    if (last != kNoView && view.time_ns == recording.views[static_cast<std::size_t>(last)].time_ns) {
      reports[i].reason = "its time is that of another picture";
      continue;
    }
    last = static_cast<std::int64_t>(i);
    BundleView seen;
    FrameRow frame{camera, i, to_seconds(view.time_ns - origin), 0, corner_sigma_px, {}};
    for (const TargetCorner& corner : view.corners) {
      seen.corners.push_back({corner.id, target.corner(corner.id), corner.pixel_px, true});
      frame.corners.push_back({seen.corners.back().point, corner.pixel_px, corner.id});
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

int unify_numbers(const CalibrationTarget& target, const MeanRate& gyro, const CameraImuStart* start,
                  CameraImuRecording::OfCamera& camera) {
  const std::vector<Renumbering> turns = renumberings(target);
  if (turns.empty()) return 0;
  int changed = 0;
  for (std::size_t i = 1; i < camera.poses.size(); ++i) {
    const CameraPoseSample& before = camera.poses[i - 1];
    CameraPoseSample& pose = camera.poses[i];
    Eigen::Quaterniond expected = before.T_target_camera.rotation;
    if (start != nullptr) {
      const Eigen::Quaterniond turn =
          turn_between(gyro, start->gyroscope_bias, before.t_s + start->time_offset_s, pose.t_s + start->time_offset_s);
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
    pose.T_target_camera = best->T_new_old * pose.T_target_camera;
    for (FrameCorner& corner : camera.frames[i].corners) {
      corner.id = best->id[static_cast<std::size_t>(corner.id)];
      corner.point = target.corner(corner.id);
    }
    ++changed;
  }
  return changed;
}

}  // namespace loc::calib
