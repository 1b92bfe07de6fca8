#include "libloc/calib/camera_imu_first_state.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "libloc/calib/euler_trajectory.hpp"
#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::calib {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kLeastForce = 0.5;  // of gravity, that the mean specific force is
constexpr double kStartSmoothing = 1e-4;
constexpr double kWidestPitch = 80 * std::numbers::pi / 180;
constexpr double kApart = 0.25;    // [s] from the next picture of a camera before, for another camera's to be needed
constexpr double kBridged = 0.45;  // [s] between two pictures, of a camera as slow as may be

std::size_t after(const RoughTrack& track, double t_s) {
  return static_cast<std::size_t>(std::ranges::upper_bound(track.times_s, t_s) - track.times_s.begin());
}

// From each picture to the next by the gyroscope, what is left over spread evenly.
Quaterniond attitude_at(const RoughTrack& track, const GyroTurns& gyro, double t_s) {
  const std::size_t next = after(track, t_s);
  const auto turned = [&](std::size_t from, double to_s) {
    return track.rotations[from] * gyro.between(track.times_s[from], to_s);
  };
  if (next == 0) return turned(0, t_s);
  const std::size_t last = next - 1;
  if (next == track.times_s.size()) return turned(last, t_s);
  const double share = (t_s - track.times_s[last]) / (track.times_s[next] - track.times_s[last]);
  const Vector3d left = so3::boxminus(track.rotations[next], turned(last, track.times_s[next]));
  return so3::boxplus(turned(last, t_s), share * left);
}

// Straight between two pictures that follow each other closely; none elsewhere.
std::optional<Vector3d> position_at(const RoughTrack& track, double t_s) {
  const std::size_t next = after(track, t_s);
  if (next == 0 || next == track.times_s.size()) return {};
  const std::size_t last = next - 1;
  const double span = track.times_s[next] - track.times_s[last];
  if (span > kBridged) return {};
  const double share = (t_s - track.times_s[last]) / span;
  return (1 - share) * track.positions[last] + share * track.positions[next];
}

bool stands_apart(const RoughTrack& track, double t_s) {
  const std::size_t next = after(track, t_s);
  return (next == 0 || t_s - track.times_s[next - 1] > kApart) &&
         (next == track.times_s.size() || track.times_s[next] - t_s > kApart);
}

void add_camera(const CameraImuRecording::OfCamera& camera, const CameraImuStart& start, RoughTrack& track) {
  Vector3d sum = Vector3d::Zero();
  double seen = 0;
  for (const CameraPoseSample& pose : camera.poses) {
    const auto imu = position_at(track, pose.t_s + start.time_offset_s);
    if (!imu) continue;
    sum += pose.T_target_camera.inverse() * *imu;
    seen += 1;
  }
  const Vector3d t_camera_imu = seen > 0 ? Vector3d(sum / seen) : Vector3d::Zero();
  track.t_camera_imu.push_back(t_camera_imu);
  RoughTrack all = track;
  for (const CameraPoseSample& pose : camera.poses) {
    const double t = pose.t_s + start.time_offset_s;
    if (!stands_apart(track, t)) continue;
    all.times_s.push_back(t);
    all.rotations.emplace_back(pose.T_target_camera.rotation * start.R_camera_imu);
    all.positions.emplace_back(pose.T_target_camera * t_camera_imu);
  }
  std::vector<std::size_t> order(all.times_s.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return all.times_s[i]; });
  track.times_s.clear();
  track.rotations.clear();
  track.positions.clear();
  for (const std::size_t i : order) {
    track.times_s.push_back(all.times_s[i]);
    track.rotations.push_back(all.rotations[i]);
    track.positions.push_back(all.positions[i]);
  }
}

// Three angles that go on from sample to sample. @throws DataError where the second is too wide.
Eigen::MatrixXd continuous_angles(const Quaterniond& mean, std::span<const Pose3> poses) {
  Eigen::MatrixXd out(3, static_cast<Eigen::Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    Vector3d phi = angles_of(mean.conjugate() * poses[i].rotation);
    if (std::abs(phi.y()) > kWidestPitch) {
      throw DataError("the rig turned by " + to_text(std::abs(phi.y()) * 180 / std::numbers::pi, 3) +
                      " deg from its mean attitude: too wide a motion for three angles, take the cumulative form");
    }
    for (const int axis : {0, 2}) {
      if (i > 0) {
        const double turns = (out(axis, column - 1) - phi[axis]) / (2 * std::numbers::pi);
        phi[axis] += 2 * std::numbers::pi * std::round(turns);
      }
    }
    out.col(column) = phi;
  }
  return out;
}

}  // namespace

RoughTrack rough_track(const CalibrationTarget& target, std::span<const CameraImuStart> starts, const GyroTurns& gyro,
                       CameraImuRecording& recording) {
  RoughTrack track;
  for (std::size_t c = 0; c < starts.size(); ++c) {
    CameraImuRecording::OfCamera& camera = recording.cameras[c];
    if (c > 0) {
      std::vector<Quaterniond> expected;
      for (const CameraPoseSample& pose : camera.poses) {
        expected.push_back(attitude_at(track, gyro, pose.t_s + starts[c].time_offset_s) *
                           starts[c].R_camera_imu.conjugate());
      }
      align_numbers(target, expected, camera);
    }
    add_camera(camera, starts[c], track);
  }
  return track;
}

CameraImuState first_state(const CameraImuRecording& recording, const RoughTrack& track, const GyroTurns& gyro,
                           const ChainPlan& plan, std::span<const CameraRecording> cameras,
                           std::span<const CameraImuStart> starts, RotationForm form, double gravity) {
  CameraImuState state;
  state.form = form;
  std::vector<double> times;
  std::vector<Pose3> samples;
  for (int i = 0; i <= 2 * plan.grid.segments; ++i) {  // two in a segment
    times.push_back(plan.grid.start_s + i * plan.grid.spacing_s / 2);
    samples.push_back({attitude_at(track, gyro, times.back()), Vector3d::Zero()});
  }
  if (state.form == RotationForm::kThreeAngles) {
    state.mean = mean_rotation(track.rotations);
    state.angles = fit_vectors(plan.grid, times, continuous_angles(state.mean, samples), kStartSmoothing);
  } else {
    state.rotations = fit_rotations(plan.grid, times, samples, kStartSmoothing);
  }
  Eigen::MatrixXd positions(3, static_cast<Eigen::Index>(track.positions.size()));
  for (std::size_t i = 0; i < track.positions.size(); ++i) {
    positions.col(static_cast<Eigen::Index>(i)) = track.positions[i];
  }
  state.positions = fit_vectors(plan.grid, track.times_s, positions, kStartSmoothing);
  state.biases = Eigen::MatrixXd::Zero(6, plan.bias_knots());
  state.biases.topRows(3).colwise() = starts.front().gyroscope_bias;
  Vector3d force = Vector3d::Zero();
  for (const ImuRow& row : recording.imu) force += attitude_at(track, gyro, row.t_s) * row.accel;
  force /= static_cast<double>(recording.imu.size());
  const double share = force.norm() / gravity;
  if (!(share > kLeastForce && share < 1 / kLeastForce)) {
    throw DataError("the accelerometer's mean is " + to_text(force.norm(), 3) + " m/s^2, not about " +
                    to_text(gravity, 3) + ": check its unit (m/s^2), its axes, and that it is there");
  }
  state.gravity = -force.normalized() * gravity;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    CameraState camera;
    camera.R_camera_imu = starts[c].R_camera_imu;
    camera.t_camera_imu = track.t_camera_imu[c];
    camera.offset_s = starts[c].time_offset_s;
    camera.camera = cameras[c].camera;
    state.cameras.push_back(std::move(camera));
  }
  return state;
}

}  // namespace loc::calib
