// State and normal equations of the camera-IMU calibration. Internal to calib.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
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
  std::int32_t id = 0;      // as it was given
  std::int32_t number = 0;  // on the target: another one when the picture's numbers began at another end
};
/// A picture, or a band of its rows when the rows have times of their own.
struct FrameRow {
  std::size_t camera = 0;
  std::size_t view = 0;  // of the camera's recording
  double t_s = 0;        // of the camera's clock, on the common origin
  double lines = 0;      // rows from the middle of the image to that of the band
  double drift_s = 0;    // time of the camera since the middle of its recording, where a drift adds nothing
  double sigma_px = 0;
  std::vector<FrameCorner> corners;
};
/// Each picture as so many bands, with the mean row of the corners as theirs. @param heights_px of the cameras' images
std::vector<FrameRow> split_rows(const std::vector<FrameRow>& frames, std::span<const double> heights_px, int bands);

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
  double bias_time_s(int knot) const { return grid.start_s + knot * bias_spacing_s(); }
};
/// A grid whose end is the end of its last window: the spacing is the one that was asked for or a little less. Biases
/// get knots at least every hundred segments or so.
ChainPlan plan_chain(double begin_s, double end_s, double spacing_s, int order, double bias_spacing_s);

struct CameraState {
  Eigen::Quaterniond R_camera_imu = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t_camera_imu = Eigen::Vector3d::Zero();
  double offset_s = 0;
  double drift = 0;  // of the offset [s/s]
  double line_delay_s = 0;
  CameraCalibration camera;  // its intrinsics
};

struct CameraImuState {
  RotationForm form = RotationForm::kCumulative;
  std::vector<Eigen::Quaterniond> rotations;  // control points of the cumulative form
  Eigen::Quaterniond mean = Eigen::Quaterniond::Identity();
  Eigen::MatrixXd angles;     // control points of the three angles, 3 x n
  Eigen::MatrixXd positions;  // control points, 3 x n
  Eigen::MatrixXd biases;     // gyroscope above accelerometer, 6 x bias knots
  std::vector<CameraState> cameras;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // in target
  double target_scale = 1;                            // the target's true size over what it was said to be
  Eigen::Matrix3d gyro_matrix = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d accel_matrix = Eigen::Matrix3d::Identity();  // lower triangle

  double time_of(const FrameRow& frame) const {
    const CameraState& c = cameras[frame.camera];
    return frame.t_s + c.offset_s + c.drift * frame.drift_s + c.line_delay_s * frame.lines;
  }
};

/// What is unknown besides the mounting of each camera and the direction of gravity.
struct SharedChoice {
  bool intrinsics = false;
  bool line_delay = false;
  bool drift = false;
  bool gravity_size = false;
  bool target_scale = false;
  bool imu_matrices = false;
};

/// The first seven of a camera: rotation of the camera (on the right), its translation, offset.
enum Mounting : int { kTurn = 0, kShift = 3, kOffset = 6, kMountingSize = 7 };

/// Where the shared unknowns are; -1: there is none of that kind. Those of a camera lie together, and those that the
/// IMU's readings depend on.
struct SharedLayout {
  struct OfCamera {
    int first = 0;  // Mounting
    int drift = -1;
    int line_delay = -1;
    int intrinsics = -1;
    int intrinsics_size = 0;
    int size = 0;
  };
  std::vector<OfCamera> cameras;
  int gravity = 0;  // direction, two
  int gravity_size = -1;
  int target_scale = -1;
  int gyro_matrix = -1;   // nine, row by row
  int accel_matrix = -1;  // six, lower triangle row by row
  int size = 0;

  int imu_size() const { return size - gravity; }
};
SharedLayout shared_layout(std::span<const CameraState> cameras, const SharedChoice& choice);

/// Two directions across gravity.
Eigen::Matrix<double, 3, 2> across(const Eigen::Vector3d& gravity);

struct CameraImuCost {
  double gyro = 0;  // each is half a sum of squares (corners: of what the loss leaves)
  double accel = 0;
  double corner = 0;
  double bias = 0;
  double smoothing = 0;
  double prior = 0;
  double total() const { return gyro + accel + corner + bias + smoothing + prior; }
};

/// What is known of a camera's intrinsics before.
struct IntrinsicsPrior {
  Vector8d mean;
  Vector8d sigma;  // infinite: nothing
};

class CameraImuProblem {
 public:
  CameraImuProblem(std::vector<ImuRow> imu, std::vector<FrameRow> frames, const CameraImuSigmas& sigmas,
                   double loss_sigmas, const ChainPlan& plan);

  const ChainPlan& plan() const { return plan_; }
  const std::vector<ImuRow>& imu() const { return imu_; }
  std::vector<FrameRow>& frames() { return frames_; }
  const std::vector<FrameRow>& frames() const { return frames_; }
  CameraImuSigmas& sigmas() { return sigmas_; }
  /// Of each camera; none: no prior.
  std::vector<IntrinsicsPrior>& priors() { return priors_; }
  /// Factor on the deviation of each of the biases' steps; none: 1.
  std::vector<double>& bias_growth() { return bias_growth_; }
  ChainLayout layout(const SharedLayout& shared) const;

  CameraImuCost cost(const CameraImuState& state) const { return evaluate(state, nullptr, nullptr); }
  /// Cost and normal equations.
  CameraImuCost linearise(const CameraImuState& state, const SharedLayout& shared, ChainSystem& system) const {
    return evaluate(state, &shared, &system);
  }
  CameraImuState stepped(const CameraImuState& state, const SharedLayout& shared, const ChainStep& step) const;

  /// Attitude and place at a time of the IMU's clock.
  Pose3 pose_at(const CameraImuState& state, double t_s) const;
  /// Predicted less read, over their deviations: 6 x samples.
  Eigen::MatrixXd imu_residuals(const CameraImuState& state) const;
  /// Predicted less found, of each frame: 2 x corners, in pixels; NaN where there is no projection.
  std::vector<Eigen::MatrixXd> corner_residuals(const CameraImuState& state) const;

 private:
  struct Scratch;
  Scratch scratch_of(const CameraImuState& state) const;
  CameraImuCost evaluate(const CameraImuState& state, const SharedLayout* shared, ChainSystem* system) const;
  RotationState rotation_of(const CameraImuState& state, const Scratch& scratch, int segment,
                            const SplineWeights& weights, const SplineWeights& cumulative, RotationJacobians* by) const;
  void add_imu(const CameraImuState& state, int segment, const SharedLayout* shared, Scratch& scratch,
               ChainSystem* system, CameraImuCost& cost) const;
  void add_frame(const CameraImuState& state, const FrameRow& frame, const SharedLayout* shared, Scratch& scratch,
                 ChainSystem* system, CameraImuCost& cost) const;
  void add_smoothing(const CameraImuState& state, int segment, Scratch& scratch, ChainSystem* system,
                     CameraImuCost& cost) const;
  void add_biases(const CameraImuState& state, ChainSystem* system, CameraImuCost& cost) const;
  void add_priors(const CameraImuState& state, const SharedLayout* shared, ChainSystem* system,
                  CameraImuCost& cost) const;
  int window_of(int segment) const;
  int control_place(int window, int control) const;
  int bias_place(int window, int knot) const;

  std::vector<ImuRow> imu_;
  std::vector<FrameRow> frames_;
  CameraImuSigmas sigmas_;
  double loss_;
  ChainPlan plan_;
  std::vector<IntrinsicsPrior> priors_;
  std::vector<double> bias_growth_;
  std::vector<std::size_t> first_imu_;  // of each segment; one more
  std::vector<SplineWeights> imu_weights_;
  std::vector<SplineWeights> imu_cumulative_;
};

}  // namespace loc::calib
