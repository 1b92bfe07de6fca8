// State and normal equations of the camera-IMU calibration. Internal to calib.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "libloc/calib/camera_imu_start.hpp"
#include "libloc/calib/chain_system.hpp"
#include "libloc/calib/spline_detail.hpp"
#include "libloc/calib/spline_grid.hpp"
#include "libloc/geometry/camera.hpp"

namespace loc::calib {

struct FrameCorner {
  Eigen::Vector3d point;  // in target
  Eigen::Vector2d pixel;
};
struct FrameRow {
  double t_s = 0;  // of the camera's clock, on the common origin
  double sigma_px = 0;
  std::vector<FrameCorner> corners;
};

/// Deviations of one reading each, and of a bias's step from one knot to the next.
struct CameraImuSigmas {
  double gyro = 0;
  double accel = 0;
  double gyro_bias_step = 0;
  double accel_bias_step = 0;
};

/// Where windows, nodes and bias knots are on the spline's grid.
struct ChainPlan {
  SplineGrid grid;
  int segments_per_window = 0;
  int windows = 0;
  int biases_per_window = 1;  // knots from one window to the next

  double bias_spacing_s() const { return grid.spacing_s * segments_per_window / biases_per_window; }
  int bias_knots() const { return windows * biases_per_window + 1; }
};
/// A grid whose end is the end of its last window: the spacing is what comes next to the one that was asked for.
ChainPlan plan_chain(double begin_s, double end_s, double spacing_s, int order, double bias_spacing_s);

struct CameraImuState {
  std::vector<Eigen::Quaterniond> rotations;  // control points
  Eigen::MatrixXd positions;                  // likewise, 3 x n
  Eigen::MatrixXd biases;                     // gyroscope above accelerometer, 6 x bias knots
  Eigen::Quaterniond R_camera_imu = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t_camera_imu = Eigen::Vector3d::Zero();
  double offset_s = 0;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // in target
};

/// The shared unknowns: rotation of the camera (on the right), its translation, offset, direction of gravity.
enum Shared : int { kTurn = 0, kShift = 3, kOffset = 6, kGravity = 7, kSharedSize = 9 };

/// Two directions across gravity.
Eigen::Matrix<double, 3, 2> across(const Eigen::Vector3d& gravity);

struct CameraImuCost {
  double gyro = 0;  // each is half a sum of squares (corners: of what the loss leaves)
  double accel = 0;
  double corner = 0;
  double bias = 0;
  double smoothing = 0;
  double total() const { return gyro + accel + corner + bias + smoothing; }
};

class CameraImuProblem {
 public:
  CameraImuProblem(Camera camera, std::vector<ImuRow> imu, std::vector<FrameRow> frames, const CameraImuSigmas& sigmas,
                   double loss_sigmas, const ChainPlan& plan);

  const ChainPlan& plan() const { return plan_; }
  const std::vector<ImuRow>& imu() const { return imu_; }
  std::vector<FrameRow>& frames() { return frames_; }
  const std::vector<FrameRow>& frames() const { return frames_; }
  CameraImuSigmas& sigmas() { return sigmas_; }
  ChainLayout layout() const;

  /// Cost, and with a system also normal equations.
  CameraImuCost evaluate(const CameraImuState& state, ChainSystem* system) const;
  CameraImuState stepped(const CameraImuState& state, const ChainStep& step) const;

  /// Residuals over their deviations. @{
  Eigen::MatrixXd imu_residuals(const CameraImuState& state) const;                  // 6 x samples
  std::vector<Eigen::MatrixXd> corner_residuals(const CameraImuState& state) const;  // 2 x corners, in pixels
                                                                                     /// @}

 private:
  struct Scratch;
  void add_imu(const CameraImuState& state, int segment, Scratch& scratch, ChainSystem* system,
               CameraImuCost& cost) const;
  void add_frame(const CameraImuState& state, const FrameRow& frame, Scratch& scratch, ChainSystem* system,
                 CameraImuCost& cost) const;
  void add_smoothing(const CameraImuState& state, int segment, Scratch& scratch, ChainSystem* system,
                     CameraImuCost& cost) const;
  void add_biases(const CameraImuState& state, ChainSystem* system, CameraImuCost& cost) const;
  int window_of(int segment) const;
  int control_place(int window, int control) const;
  int bias_place(int window, int knot) const;

  Camera camera_;
  std::vector<ImuRow> imu_;
  std::vector<FrameRow> frames_;
  CameraImuSigmas sigmas_;
  double loss_;
  ChainPlan plan_;
  std::vector<std::size_t> first_imu_;  // of each segment; one more
  std::vector<SplineWeights> imu_weights_;
  std::vector<SplineWeights> imu_cumulative_;
};

}  // namespace loc::calib
