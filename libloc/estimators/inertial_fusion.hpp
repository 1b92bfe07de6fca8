// IMU, GPS, odometry and magnetometer to a metric trajectory: what a user needs around the error-state filter
// (error_state_filter.hpp, which has the equations). Starts by itself, knows rest, survives gaps, and does not stay
// lost.
//
// World: z up. With GPS x is east and y north, and the first fix is the origin. Otherwise the body is at the origin at
// the start, and its heading there is 0 unless a magnetometer or the options say it (kValidHeading tells). Presets of
// the visual-inertial example: the same, with the axes of the absolute odometry.
// Start: fusion_start.hpp, from the first second; what came in this second is fused then. While GPS is there and the
// heading is not known, a bank of filters looks for it (heading_bank.hpp).
// Odometry: absolute (in a world of its own, whose scale and drift are estimated) as long as nothing else ties the
// world to the Earth; from then on, or as the options say, as relative poses of past and present, for which only its
// scale matters. Rest: stand_still.hpp; the velocity is zero then, unless the filter itself knows better (the gate).
// Gaps of the IMU: up to filter.max_step_ns nothing; up to max_bridge_ns bridged with more noise and reported
// (kBridged, kGap); beyond that a new start, which keeps position, heading and biases with the uncertainty that they
// have by then (kReinitialised).
// Rejections: a source that is gated reject_count times in a row over reject_time_s is believed again: the covariance
// is widened by what it says (kRecovered), and if that does not help, the filter starts anew where GPS says.
// Stamps of GPS that are off: gps_lag_watch.hpp compares the way of the fixes with that of the IMU by itself, from the
// filter's state at the beginning of each window (kGpsStampsDoubtful). Of odometry: stamp_watch.hpp (kStampsDoubtful).
//
// Not observable: heading without GPS motion, magnetometer or absolute odometry; scale without acceleration. After a
// start in motion with odometry alone, velocity and scale can only be found together, which a linearised filter gets
// wrong: position, velocity and scale are not marked valid then until GPS comes. Start at rest, or give the start.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "libloc/estimators/error_state_filter.hpp"
#include "libloc/estimators/estimate.hpp"
#include "libloc/estimators/estimator.hpp"
#include "libloc/estimators/fusion_start.hpp"
#include "libloc/estimators/gps_lag_watch.hpp"
#include "libloc/estimators/gps_position.hpp"
#include "libloc/estimators/heading_bank.hpp"
#include "libloc/estimators/stamp_watch.hpp"
#include "libloc/estimators/stand_still.hpp"
#include "libloc/geometry/geodesy.hpp"

namespace loc {

enum class OdometryUse : std::uint8_t {
  kAutomatic,  ///< absolute while it alone ties the world, relative afterwards
  kAbsolute,   ///< its world is ours
  kRelative    ///< only the motion between two poses
};
const char* odometry_use_name(OdometryUse use);
/// "auto", "absolute", "relative". @throws std::invalid_argument naming the text.
OdometryUse parse_odometry_use(std::string_view name);

/// A start that is known, in place of the one from the first second.
struct GivenStart {
  ErrorStateState state;
  Eigen::MatrixXd covariance;  ///< of the filter's whole error state
};

struct InertialFusionOptions : GpsErrorModel {
  ErrorStateOptions filter;
  FusionStartOptions start;
  StandStillOptions stand_still;
  HeadingBankOptions heading_bank;
  std::optional<GivenStart> given_start;  ///< at the first IMU sample
  /// Of world; without it the first fix is the origin (of a given start: it makes the fix agree with the state).
  std::optional<GeodeticPoint> origin;

  bool use_gps = true;
  bool use_gps_velocity = true;
  double gps_max_ahead_s = 1;  ///< A fix that is further ahead of the IMU belongs to another clock. [s]

  bool use_odometry = true;
  OdometryUse odometry = OdometryUse::kAutomatic;
  double odometry_position_sigma = 0.05;                    ///< of one that does not say [odometry's unit]
  double odometry_orientation_sigma = 0.01;                 ///< of one that does not say [rad]
  std::optional<Eigen::Matrix3d> odometry_position_cov;     ///< in place of what the odometry says
  std::optional<Eigen::Matrix3d> odometry_orientation_cov;  ///< in place of what the odometry says
  /// Absolute poses that are used as relative ones: the shortest time between two that are compared. [s]
  double odometry_interval_s = 0.2;
  double scale = 1;                ///< of the odometry at the start
  double scale_sigma = 1.5;        ///< its deviation
  double drift_start_sigma = 0.1;  ///< of the drift, where it is estimated [odometry's unit]

  bool use_magnetometer = true;

  bool zero_velocity = true;
  double zero_velocity_sigma = 0.02;    ///< [m/s]
  double zero_rate_sigma_floor = 1e-4;  ///< what a body at rest may turn, earth rate included [rad/s]

  double max_angular_velocity = 70;         ///< A sample with more is an error of the sensor: skipped. [rad/s]
  double max_specific_force = 500;          ///< The same. [m/s^2]
  double gap_acceleration_sigma = 3;        ///< what the body may do in a gap that is not bridged [m/s^2]
  double gap_angular_velocity_sigma = 0.5;  ///< [rad/s]

  int reject_count = 8;      ///< rejections of a source in a row …
  double reject_time_s = 4;  ///< … over at least this time: the covariance is widened [s]

  /// For real sensors: gate, history, rest, drift of absolute odometry, one past pose for relative one.
  static InertialFusionOptions robust();
  /// "robust", or one of FusionPreset: "as_published", "16", "19", which start by themselves unless given_start is set.
  /// @throws std::invalid_argument for another name.
  static InertialFusionOptions preset(std::string_view name);
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

class InertialFusion {
 public:
  /// @throws std::invalid_argument as InertialFusionOptions::check.
  explicit InertialFusion(const InertialFusionOptions& options = InertialFusionOptions::robust());

  // Estimator concept. There is an estimate for every IMU sample after the start.
  bool process(const Measurement& measurement);
  Estimate estimate() const;
  NamedCounts counts() const;
  void reset();

  bool running() const { return running_; }
  bool heading_known() const { return heading_known_; }
  std::size_t hypotheses() const { return bank_.size(); }  ///< headings that are still tried
  const std::optional<LocalFrame>& world() const { return world_; }
  const ErrorStateFilter& filter() const { return bank_.best(); }
  const StandStillDetector& stand_still() const { return rest_; }
  /// What the fixes say of their own stamps.
  const GpsLagWatch& lag_watch() const { return lag_; }
  /// Whether the stamps of odometry and gyroscope fit (kStampsDoubtful).
  const StampWatch& stamp_watch() const { return stamps_; }
  const InertialFusionOptions& options() const { return options_; }

 private:
  // Rejections in a row of one source.
  struct Watch {
    int rejected = 0;           // in a row
    int accepted = 0;           // in a row
    TimeNs since_ns = kNoTime;  // of the first rejection
    int widened = 0;            // times, since it was last accepted for long
  };
  // What a new start takes over.
  struct Carried {
    TimeNs time_ns = kNoTime;
    ErrorStateState state;
    Eigen::VectorXd variances;
    double heading_variance = 0;
    bool heading_known = false;
  };

  bool process_imu(const ImuMeasurement& imu);
  bool collect(const ImuMeasurement& imu);
  void begin();
  void begin_given(const ImuMeasurement& imu);
  ErrorStateState first_state(const FusionStartEstimate& start, Eigen::MatrixXd& covariance);
  void carry_over(const FusionStartEstimate& start, ErrorStateState& state, Eigen::MatrixXd& covariance);
  void run_from(TimeNs time_ns, const std::vector<ImuMeasurement>& samples);
  bool step(const ImuMeasurement& imu);
  void start_anew(std::uint32_t status);
  void look_for_rest(const ImuMeasurement& imu);
  bool time_set_back(TimeNs time_ns);
  void skip(const char* count, std::uint32_t status);

  void process_other(const Measurement& measurement);
  void fuse(const GpsMeasurement& gps);
  bool refused(GpsRefusal refusal);
  void see_lag(const GpsPosition& fix);
  bool prepare(const GpsMeasurement& gps, GpsPosition& fix);
  void anchor(TimeNs time_ns, const Eigen::Vector3d& position, const Eigen::Matrix3d& position_cov);
  void fuse(const OdometryMeasurement& odometry);
  void look_for_motion(const OdometryMeasurement& odometry, const Eigen::Matrix3d& position_cov);
  bool early_motion() const;
  void fuse_absolute(const OdometryMeasurement& odometry, const Eigen::Matrix3d& position_cov,
                     const Eigen::Matrix3d& orientation_cov);
  void fuse_as_relative(const OdometryMeasurement& odometry, const Eigen::Matrix3d& position_cov,
                        const Eigen::Matrix3d& orientation_cov);
  void adopt_axes_of(const OdometryMeasurement& odometry, const Eigen::Matrix3d& position_cov,
                     const Eigen::Matrix3d& orientation_cov);
  void take_note(const FusionResult& result);
  void recover(const FusionResult& result, Watch& watch);

  InertialFusionOptions options_;
  HeadingBank bank_;
  FusionStart start_;
  StandStillDetector rest_;

  bool running_ = false;
  bool heading_known_ = false;     // tied to north
  bool tied_ = false;              // GPS has said where world is
  bool anchored_ = false;          // GPS positions are in our world
  bool follows_odometry_ = false;  // our world is that of the absolute odometry
  std::optional<LocalFrame> world_;
  std::optional<Carried> carried_;
  std::deque<Measurement> early_;  // others, that came while the start was collected

  std::optional<OdometryMeasurement> pose_before_;  // the absolute one that the next is compared with
  std::map<FusionSource, Watch> watches_;
  Eigen::Vector3d odometry_origin_ = Eigen::Vector3d::Zero();  // where our origin is in the odometry's world
  bool odometry_left_world_ = false;                           // it was rejected as an absolute one
  TimeNs rest_fused_ns_ = kNoTime;
  bool given_used_ = false;
  bool started_in_motion_ = false;  // and nothing has said since how long a metre of the odometry is
  bool odometry_used_ = false;
  OdometryMeasurement seen_;        // absolute pose that motion is looked for against
  TimeNs gps_before_ns_ = kNoTime;  // of the fix before this one
  StampWatch stamps_;               // of odometry
  GpsLagWatch lag_;
  ImuReckoning reckoning_;
  bool reckoning_used_ = false;  // a fix of the window was compared with it

  Stamp last_;
  std::uint32_t status_ = 0;
  std::uint32_t next_status_ = 0;  // for the next estimate
  TimeNs refused_ns_ = kNoTime;
  int refused_in_a_row_ = 0;
  std::int64_t imu_used_ = 0;
  std::map<std::string, std::int64_t> counts_;
};

static_assert(Estimator<InertialFusion>);

}  // namespace loc
