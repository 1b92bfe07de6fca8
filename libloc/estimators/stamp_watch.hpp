// Tells whether the stamps of camera and gyroscope are of one time, by what both see of the turning of the body.
// From: IMU samples and frames of tracked features, each with its own stamp; the lens and the camera's attitude in
// body. Or, in place of the frames, poses of an odometry in axes of the body. The turn between two frames is fitted to
// the directions of the features (as if they were far away: what moves them besides has nothing to do with the
// gyroscope) and correlated with the turn that the gyroscope measured in the same interval moved by d, -2 s <= d <= 2
// s; both less their means, so that a bias does not count. Right stamps correlate best at d = 0; about the best d least
// squares tell it to milliseconds where the body turns quickly against its way. A doubt is a d that correlates clearly
// better than 0, or one of 20 ms and five deviations, several times in a row. Needs no start, no map and no filter,
// hence also works where a filter cannot start because of this. Nothing is said while the body hardly turns, or turns
// so evenly that several d would do.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "libloc/core/fifo.hpp"
#include "libloc/core/time.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

class StampWatch {
 public:
  /// @throws std::invalid_argument as CameraCalibration::check. Its time offset counts: d is what is left.
  explicit StampWatch(const CameraCalibration& camera);

  /// For odometry.
  StampWatch();

  /// All in ascending order, each for itself; what is not, and gaps, begin anew.
  void see(const ImuMeasurement& imu);
  void see(const FeaturesMeasurement& frame);
  /// Absolute poses or relative ones; those without a rotation say nothing.
  void see(const OdometryMeasurement& odometry);
  void reset();

  bool doubtful() const { return doubtful_; }
  /// What has to be added to the camera's (the odometry's) stamps, on top of its time offset, to fit the gyroscope [s];
  /// NaN: not known.
  double offset_s() const;
  /// Of the turns, at that offset: 1 when they are the same.
  double correlation() const { return correlation_; }
  /// The offset by least squares, whatever it is worth, and its deviation [s]; NaN: not known.
  double fine_s() const { return fine_s_; }
  double sigma_s() const { return sigma_s_; }

 private:
  struct Turn {
    TimeNs begin_ns = 0;
    TimeNs end_ns = 0;
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();  // of body, by the camera [rad/s]
  };

  void begin_anew();
  void follow(TimeNs time_ns);
  bool turn_between(const FeaturesMeasurement& frame, Eigen::Vector3d& turn) const;
  bool angle_at(TimeNs time_ns, Eigen::Vector3d& angle) const;
  bool correlate(TimeNs shift_ns, std::size_t from, std::size_t to, double& correlation);
  bool refine(std::size_t from, std::size_t to);
  void judge();

  std::optional<Camera> camera_;
  Eigen::Matrix3d body_camera_ = Eigen::Matrix3d::Identity();
  TimeNs offset_ns_ = 0;
  Fifo<Eigen::Vector3d> angles_;  // integral of the gyroscope's rate, on a grid of time
  TimeNs grid_ns_ = kNoTime;      // of the first one
  TimeNs imu_ns_ = kNoTime;
  Eigen::Vector3d angle_ = Eigen::Vector3d::Zero();
  Fifo<Turn> turns_;
  TimeNs frame_ns_ = kNoTime;
  Eigen::Quaterniond pose_ = Eigen::Quaterniond::Identity();    // of the last odometry
  std::vector<std::pair<std::int64_t, Eigen::Vector3d>> last_;  // identity, direction; ascending
  mutable std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> pairs_;
  std::vector<std::pair<TimeNs, double>> found_;  // offset, correlation
  TimeNs judged_ns_ = kNoTime;
  double before_s_ = kUnknown;  // what the last judgement found
  double offset_s_ = kUnknown;
  double correlation_ = kUnknown;
  double fine_s_ = kUnknown;
  double sigma_s_ = kUnknown;
  int fine_in_a_row_ = 0;
  bool doubtful_ = false;
};

}  // namespace loc
