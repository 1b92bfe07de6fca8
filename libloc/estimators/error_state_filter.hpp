// Error-state Kalman filter: an IMU propagates attitude, position, velocity and biases, whatever else measures
// corrects them: odometry without scale (visual odometry), GPS, velocity, height, heading, rest.
//
// State  q p v bg ba | s | c | T_body_odometry | clones; the blocks after the first | are chosen at construction.
//   s   odometry's unit per metre (scale), constant or a random walk
//   c   drift of absolute odometry, first-order Gauss-Markov, in the odometry's unit
//   T_body_odometry   where the odometry's sensor sits
//   clones   poses of the past, for odometry that is relative to them
// Error  theta p v bg ba | s | c | theta_o l_o | (theta p) of each clone; theta on the right, q_true = q * Exp(theta).
// Propagation: filter/imu_propagation.hpp. Measurements (q_o, l_o the odometry's mounting):
//   absolute odometry   z_p = s (p + R l_o) + c,  z_q = q * q_o
//   relative odometry   z_p = s R_0^T (p_1 - p_0) of the odometry's poses,  z_q = q_0^-1 q_1 of them
//   GPS                 z = p + R l,  z_v = v + R ((w - bg) x l)
//   velocity            z = v, or R^T v in body axes;   height  z = p_z;   heading  z = so3::heading(q)
// Update: Joseph form, injection, reset of the attitude error with G = I - [dtheta]x/2. Each measurement passes a
// chi-square gate first.
//
// Not observable: heading and position without GPS or absolute odometry (their covariance grows, and says so); the
// scale without acceleration.
//
// Time. A measurement between two IMU samples waits for the second, and the step is split at its time. One that comes
// late, up to history_ns, is put where it belongs and everything since is computed anew: the result is the same as if
// it had come in order. What is older is refused and counted. Measurements of equal time are applied in the order of
// FusionSource.
// Source: J. Sola, "Quaternion kinematics for the error-state Kalman filter", arXiv:1711.02508; clones: S. Roumeliotis,
// J. Burdick, "Stochastic cloning", ICRA 2002.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "libloc/core/named_count.hpp"
#include "libloc/filter/imu_propagation.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

struct ErrorStateOptions {
  ImuNoise noise;  ///< densities; the turn-on sigmas are not used here (the start's covariance is given)
  Eigen::Vector3d gravity{0, 0, -9.80665};  ///< in world [m/s^2]
  ImuIntegration integration = ImuIntegration::kMidpoint;
  ImuSampling sampling = ImuSampling::kPoint;

  bool estimate_scale = true;
  double scale_random_walk = 0;  ///< [1/sqrt(s)], of the scale in units of itself (of log s)
  bool estimate_drift = false;
  double drift_sigma = 1;             ///< steady state, one component [odometry's unit]
  double drift_time_constant_s = 10;  ///< of the drift's correlation [s]
  bool estimate_extrinsics = false;
  int clones = 0;  ///< past poses that are kept; 1 is enough for odometry from frame to frame

  bool gate = true;
  double gate_probability = 0.9999;  ///< share of good measurements that pass the gate
  bool reset_jacobian = true;        ///< G after an update; false: G = I

  TimeNs history_ns = 500'000'000;  ///< how late a measurement may come
  /// A longer step between IMU samples is bridged: integrated, with the noise of bridge_* on top, and counted.
  TimeNs max_step_ns = 100'000'000;
  /// A longer one is not integrated: predict() refuses, and the filter must be started again.
  TimeNs max_bridge_ns = 1'000'000'000;
  double bridge_angular_velocity_sigma = 0.5;  ///< how far rate and force may be from the mean of the samples at
  double bridge_specific_force_sigma = 3;      ///< both ends of a bridged step [rad/s], [m/s^2]

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Where the blocks of the error state stand; -1: not in the state.
struct ErrorStateLayout {
  int scale = -1;       ///< 1
  int drift = -1;       ///< 3
  int extrinsics = -1;  ///< 6: attitude, position
  int clones = -1;      ///< 6 each: theta, p
  int size = kInertialDim;
};

struct ErrorStateState {
  InertialState inertial;
  double scale = 1;                                 ///< odometry's unit per metre
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();  ///< [odometry's unit]
  Pose3 T_body_odometry;
};

/// What a measurement came from; equal times are applied in this order.
enum class FusionSource : std::uint8_t {
  kOdometry,
  kRelativeOdometry,
  kGps,
  kMeasuredVelocity,
  kZeroVelocity,
  kHeight,
  kHeading,
  kModel
};
inline constexpr std::size_t kFusionSources = 8;
const char* fusion_source_name(FusionSource source);

enum class FusionOutcome : std::uint8_t {
  kAccepted,
  kGated,          ///< NIS beyond the gate: not applied
  kWaiting,        ///< newer than the newest IMU sample: applied by predict(), see finished()
  kTooLate,        ///< older than the history, or than the start
  kNotFinite,      ///< a number is NaN or infinite, or a quaternion is not of norm 1
  kBadCovariance,  ///< not symmetric and positive definite
  kNoClone,        ///< relative to a pose that is not kept, or that there is no place for besides others in use
  kNotStarted,
  kTooEarly,    ///< further ahead of the newest IMU sample than a step may be long (max_bridge_ns)
  kModelFailed  ///< the model threw, or gave sizes that do not fit: left out, and said by an exception
};
const char* fusion_outcome_name(FusionOutcome outcome);

/// What became of a measurement.
struct FusionResult {
  static constexpr int kMaxDim = 6;
  FusionSource source = FusionSource::kModel;
  FusionOutcome outcome = FusionOutcome::kNotStarted;
  TimeNs time_ns = kNoTime;
  int dof = 0;            ///< size of the residual
  double nis = kUnknown;  ///< residual^T S^-1 residual
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxDim, 1> residual;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxDim, kMaxDim> innovation_cov;  ///< S = H P H^T + R
  bool accepted() const { return outcome == FusionOutcome::kAccepted; }
};

enum class PredictOutcome : std::uint8_t {
  kPredicted,
  kFirst,              ///< of its kind since the start: kept, nothing to integrate yet
  kBridged,            ///< after a gap up to max_bridge_ns
  kGap,                ///< after a longer one: refused, start() again
  kNotFinite,          ///< refused
  kTimeNotIncreasing,  ///< refused: not after the last sample, or before the start
  kNotStarted          ///< refused
};

/// A measurement of one's own: residual z - h(x), H with respect to the error state, R. It is called again when
/// history is computed anew, and must give the same for the same state.
struct Linearisation {
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, FusionResult::kMaxDim, 1> residual;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, FusionResult::kMaxDim> jacobian;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, FusionResult::kMaxDim, FusionResult::kMaxDim> noise_cov;
};
using MeasurementModel =
    std::function<void(const ErrorStateState& state, const ErrorStateLayout& layout, Linearisation& linearisation)>;

enum class VelocityFrame : std::uint8_t { kWorld, kBody };

class ErrorStateFilter {
 public:
  /// @throws std::invalid_argument as ErrorStateOptions::check.
  explicit ErrorStateFilter(const ErrorStateOptions& options = {});
  ErrorStateFilter(const ErrorStateFilter& other);
  ErrorStateFilter& operator=(const ErrorStateFilter& other);
  ErrorStateFilter(ErrorStateFilter&&) noexcept;
  ErrorStateFilter& operator=(ErrorStateFilter&&) noexcept;
  ~ErrorStateFilter();

  const ErrorStateOptions& options() const;
  const ErrorStateLayout& layout() const;

  /// Starts, or starts anew, at a time; history and clones are forgotten, counts are kept.
  /// @param covariance of the error state, layout().size square; rows of clones are ignored
  /// @throws std::invalid_argument unless finite, symmetric, positive semidefinite and of that size.
  void start(TimeNs time_ns, const ErrorStateState& state, const Eigen::Ref<const Eigen::MatrixXd>& covariance);
  bool started() const;

  /// The next IMU sample. The first after the start is only kept when it is of the start's time; when it is later, the
  /// step from the start to it uses it alone.
  PredictOutcome predict(const ImuMeasurement& imu);

  /// Absolute odometry: position in the odometry's unit, attitude q_world_odometry (= q_world_body * q_body_odometry).
  FusionResult fuse_vo(TimeNs time_ns, const Eigen::Vector3d& position, const Eigen::Matrix3d& position_cov,
                       const Eigen::Quaterniond& q_world_odometry, const Eigen::Matrix3d& orientation_cov);
  /// Odometry from t0 to t1: pose of the sensor at t1 in its axes at t0. Needs options.clones >= 1. The pose at t0 is
  /// kept from an earlier call whose t1 it was, or from keep_pose(), or taken from the history.
  FusionResult fuse_vo_relative(TimeNs time0_ns, TimeNs time1_ns, const Eigen::Vector3d& position,
                                const Eigen::Matrix3d& position_cov, const Eigen::Quaterniond& rotation,
                                const Eigen::Matrix3d& orientation_cov);
  /// Keeps the pose of this time for relative odometry; the oldest kept one gives way.
  FusionResult keep_pose(TimeNs time_ns);
  /// Either or both of position and velocity; one that is not measured is NaN in all of its components.
  /// @param antenna lever arm in body axes [m]
  FusionResult fuse_gps(TimeNs time_ns, const Eigen::Vector3d& position, const Eigen::Matrix3d& position_cov,
                        const Eigen::Vector3d& antenna = Eigen::Vector3d::Zero(),
                        const Eigen::Vector3d& velocity = Eigen::Vector3d::Constant(kUnknown),
                        const Eigen::Matrix3d& velocity_cov = Eigen::Matrix3d::Constant(kUnknown));
  FusionResult fuse_velocity(TimeNs time_ns, const Eigen::Vector3d& velocity, const Eigen::Matrix3d& velocity_cov,
                             VelocityFrame frame = VelocityFrame::kWorld);
  /// At rest: velocity zero, and the gyroscope reads its bias.
  /// @param angular_velocity as measured (mean over the rest so far) [rad/s]; NaN: velocity alone
  FusionResult fuse_zero_velocity(TimeNs time_ns, double velocity_sigma,
                                  const Eigen::Vector3d& angular_velocity = Eigen::Vector3d::Constant(kUnknown),
                                  double angular_velocity_sigma = kUnknown);
  FusionResult fuse_height(TimeNs time_ns, double height, double sigma);    ///< [m], z of world
  FusionResult fuse_heading(TimeNs time_ns, double heading, double sigma);  ///< [rad], as so3::heading

  /// Any other measurement. @throws std::invalid_argument when the model's sizes do not fit, and what the model throws;
  /// predict() and later fuse_*() throw it when the measurement waited, or is applied anew. The filter then goes on
  /// without this measurement.
  FusionResult correct(TimeNs time_ns, MeasurementModel model);
  /// What correct() would find now (residual, S, NIS, whether the gate lets it pass), without applying it.
  FusionResult residual(const MeasurementModel& model) const;

  /// What became of the measurements that waited: those that the last predict() applied.
  const std::vector<FusionResult>& finished() const;

  TimeNs time_ns() const;  ///< of the state: of the newest IMU sample, or the start
  const ErrorStateState& state() const;
  const Eigen::MatrixXd& covariance() const;
  /// Rate of the newest IMU sample, bias removed [rad/s]; NaN before the first.
  Eigen::Vector3d angular_velocity() const;
  /// Adds to the variances, of all of layout().size: a filter that rejects everything is made to listen again.
  /// History is forgotten. @throws std::invalid_argument unless finite, not negative and of that size.
  void widen(const Eigen::Ref<const Eigen::VectorXd>& variances);

  /// "predict.bridged", "gps.gated", "odometry.too_late", …
  NamedCounts counts() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace loc
