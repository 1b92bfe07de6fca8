// Inside of the error-state filter: the state with its covariance at one time (Core), the measurements as plain data
// that can be applied again (Correction), and their models.
#pragma once

#include <array>

#include "libloc/estimators/error_state_filter.hpp"
#include "libloc/filter/gated_update.hpp"

namespace loc::error_state {

inline constexpr int kMaxClones = 6;

/// What a fuse_*() call said. Which fields hold something depends on the source.
struct Correction {
  FusionSource source = FusionSource::kModel;
  bool keeps_pose = false;  ///< no measurement: keep_pose()
  TimeNs time_ns = kNoTime;
  TimeNs start_time_ns = kNoTime;                                ///< relative odometry
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();              ///< position, velocity, rate
  Eigen::Matrix3d vector_cov = Eigen::Matrix3d::Zero();          ///< of vector
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();            ///< GPS
  Eigen::Matrix3d second_cov = Eigen::Matrix3d::Zero();          ///< of the rotation, or of the GPS's velocity
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< odometry
  Eigen::Vector3d lever = Eigen::Vector3d::Zero();               ///< antenna in body
  bool has_vector = true;
  bool has_velocity = false;
  VelocityFrame frame = VelocityFrame::kWorld;
  double value = 0;  ///< height, heading
  double sigma = 0;
  MeasurementModel model;

  FusionOutcome outcome = FusionOutcome::kWaiting;  ///< when it was applied last
  std::uint64_t id = 0;
};

struct ImuSample {
  TimeNs time_ns = kNoTime;
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();
};

struct Clone {
  TimeNs time_ns = kNoTime;  ///< kNoTime: the place is free
  Pose3 pose;
};

/// State, covariance and time. Assignment allocates nothing once the sizes are the same.
struct Core {
  TimeNs time_ns = kNoTime;
  ErrorStateState state;
  std::array<Clone, kMaxClones> clones;
  Eigen::MatrixXd covariance;
  ImuSample last_imu;  ///< at time_ns when it has one (between samples: interpolated)
  bool has_imu = false;
};

/// What does not change while the filter runs, and working memory.
class Machine {
 public:
  explicit Machine(const ErrorStateOptions& options);

  const ErrorStateOptions& options() const { return options_; }
  const ErrorStateLayout& layout() const { return layout_; }

  /// From core.time_ns to time_ns, which is at most that of the sample. @param gap_s length of the whole step between
  /// samples when it is a bridged one, otherwise 0
  void step(Core& core, const ImuSample& next, TimeNs time_ns, double gap_s) const;
  /// Passes the gate and updates. The result's residual and S are filled when it came to that.
  FusionResult apply(Core& core, const Correction& correction);
  /// The same without the update.
  FusionResult examine(const Core& core, const Correction& correction);
  /// Keeps the pose of core's time; the oldest gives way.
  void clone(Core& core) const;

  /// Residual, H and R at this state. @returns false when it is relative to a pose that is not kept.
  bool linearise(const Core& core, const Correction& correction, Observation& observation);

 private:
  void linearise_absolute(const Core& core, const Correction& c, Observation& o) const;
  void linearise_relative(const Core& core, const Clone& from, int from_column, const Correction& c,
                          Observation& o) const;
  void linearise_gps(const Core& core, const Correction& c, Observation& o) const;
  void linearise_model(const Core& core, const Correction& c, Observation& o);
  void inject(Core& core);
  void reset_attitude(Core& core, int column, const Eigen::Vector3d& theta) const;

  ErrorStateOptions options_;
  ErrorStateLayout layout_;
  std::array<double, kMaxUpdateDim + 1> gate_{};  // of NIS, by size of the residual
  Observation observation_;
  Innovation innovation_;
  Eigen::VectorXd correction_;
  Linearisation linearisation_;
};

/// Not finite, or not positive definite: what makes a measurement useless before it is looked at. kAccepted: fine.
FusionOutcome judge(const Correction& correction);

}  // namespace loc::error_state
