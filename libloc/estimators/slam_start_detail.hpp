// Inside of SlamStart: the window as plain data (Problem), its parts (motion, closed form, refinement), each for
// itself. Axes are those of body at frame 0 ("start"), lengths metres.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "libloc/filter/imu_propagation.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/sensors/imu_noise.hpp"

namespace loc::slam_start {

/// One feature in one frame.
struct Observation {
  int frame = 0;
  Eigen::Vector2d pixel_px;
  Eigen::Vector3d ray;  ///< unit vector in camera
  bool used = true;     ///< false: an outlier
};

struct Track {
  std::int64_t id = -1;
  std::vector<Observation> observations;  ///< in order of time
};

struct Problem {
  const Camera* camera = nullptr;
  Pose3 T_body_camera;
  double gravity = 9.80665;
  ImuNoise noise;
  double gyroscope_bias_sigma = 0.2;  ///< [rad/s]
  std::vector<double> times_s;        ///< of the frames, the first is 0
  std::vector<double> sigma_px;       ///< of the frames
  std::vector<InertialStep> steps;    ///< from the first frame to the last, biases not removed
  std::vector<std::size_t> step_end;  ///< of each frame: so many steps lead to it
  std::vector<Track> tracks;

  int frames() const { return static_cast<int>(times_s.size()); }
  /// Deviation of a ray [rad], of an observation in the middle of the image.
  double ray_sigma() const;
};

/// Where the integrals of the IMU lead to: attitude in start, and position without v0 and gravity.
struct FrameMotion {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d shift;                  ///< s_i [m]
  Eigen::Matrix<double, 6, 6> by_biases;  ///< of (theta, s) by (bg, ba); theta on the right
};

/// Integrates the steps as loc::propagate does.
std::vector<FrameMotion> integrate(const Problem& problem, const Eigen::Vector3d& gyroscope_bias,
                                   const Eigen::Vector3d& accelerometer_bias);

/// Covariance of the errors (theta, p) of the poses of frames 1, 2, ... that the IMU's noise and the walk of its biases
/// make, all with all: 6 (frames - 1) square.
Eigen::MatrixXd pose_covariance(const Problem& problem, const Eigen::Vector3d& gyroscope_bias,
                                const Eigen::Vector3d& accelerometer_bias);

/// Marks observations that jump away from where their neighbours in the track let expect them.
void mark_jumps(Problem& problem);

/// The gyroscope's bias that explains most by turning alone, and what that leaves: the median over the tracks of the
/// largest angle between rays, in deviations of a ray.
struct RotationOnly {
  Eigen::Vector3d gyroscope_bias;
  double parallax;
};
RotationOnly rotation_only(const Problem& problem);

/// Step (1). @returns rad/s; not finite when the frames tell nothing.
Eigen::Vector3d epipolar_gyroscope_bias(const Problem& problem);

struct ClosedForm {
  Eigen::Vector3d velocity;                            ///< of body at frame 0, in start [m/s]
  Eigen::Vector3d gravity;                             ///< in start [m/s^2]
  std::vector<std::optional<Eigen::Vector3d>> points;  ///< of each track, in start [m]
};
/// Step (2). nullopt when the equations are singular.
std::optional<ClosedForm> closed_form(const Problem& problem, const Eigen::Vector3d& gyroscope_bias);

/// Unknowns of step (3). A point is origin + direction / inverse_distance, origin the place of the camera at frame 0.
struct Point {
  Eigen::Vector3d direction;    ///< unit vector
  double inverse_distance = 0;  ///< [1/m]
  bool used = true;
};
struct Unknowns {
  Eigen::Vector3d velocity;  ///< in start [m/s]
  Eigen::Vector3d down;      ///< unit vector of gravity in start
  Eigen::Vector3d gyroscope_bias;
  Eigen::Vector3d accelerometer_bias;
  Eigen::VectorXd noise;  ///< errors (theta, p) of the poses of frames 1, 2, ...
  std::vector<Point> points;
};

// Where the motion's unknowns stand: velocity, two of the direction of gravity, biases.
inline constexpr int kStartVelocity = 0;
inline constexpr int kStartDown = 3;
inline constexpr int kStartGyroscopeBias = 5;
inline constexpr int kStartAccelerometerBias = 8;
inline constexpr int kStartDim = 11;

/// Two unit vectors orthogonal to a unit vector.
Eigen::Matrix<double, 3, 2> tangent(const Eigen::Vector3d& unit);

/// Pose of body at a frame in start, and its derivative (theta on the right, p) by the motion's unknowns.
struct PoseModel {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d position;
  Eigen::Matrix<double, 6, kStartDim> by_motion;
};
std::vector<PoseModel> pose_models(const Problem& problem, const Unknowns& x);

/// Pixel of a point from a pose of body, with its derivatives by the pose (theta, p) and by the point (two along
/// tangent(direction), inverse distance).
struct PixelModel {
  Eigen::Vector2d pixel_px;
  Eigen::Matrix<double, 2, 6> by_pose;
  Eigen::Matrix<double, 2, 3> by_point;
};
std::optional<PixelModel> pixel_model(const Problem& problem, const Eigen::Matrix3d& rotation,
                                      const Eigen::Vector3d& position, const Point& point);

struct Refined {
  Unknowns x;
  bool converged = false;
  int iterations = 0;
  double residual_px_rms = 0;
  double sigma_ratio = 1;
  int observations = 0;  ///< used
  int outliers = 0;
  int features = 0;
  double condition = 0;
  double scale_sigma = 0;
  double parallax = 0;  ///< median over the features of the largest, in deviations
  double cost = 0;      ///< over all observations, squared deviations as stated, each bounded: to compare minima by
  double behind = 0;    ///< share of the features whose inverse distance is negative by three deviations
  Eigen::Matrix<double, kStartDim, kStartDim> covariance;
  std::vector<double> inverse_distance_sigma;  ///< of each point
  std::vector<Track> tracks;                   ///< as marked
};
/// Step (3). nullopt when a factorisation fails or too few observations are left.
std::optional<Refined> refine(Problem problem, const Eigen::Vector3d& gyroscope_bias, const ClosedForm& start);

}  // namespace loc::slam_start
