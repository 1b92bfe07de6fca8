// Ties the map of SLAM to the Earth: poses in the map and GPS fixes in, poses in the world out. It works downstream of
// SLAM, which knows nothing of it: the way gone since the last pose carries the state on, fixes correct it.
//
//   state  g  place of the body in the world [m]        g+ = g + s A (p+ - p)        p: place in the map
//          A  takes map to world (a turn about the vertical where an IMU has levelled the map)
//          s  metres a unit of the map (about 1 with an IMU, anything for a camera alone)
//   fix    z = g - s A (p - p(t)) + A R(t) l,  w = s A v(t) + A R(t) (omega x l)      t: time of the fix, l: lever arm
// The drift of the map is a random walk of g, A and s with the way gone; while the camera is lost, what the pose's own
// covariance grows by is added.
//
// World: x east, y north, z up of the first fix, or of options.origin. Before it is found (the first fixes, and until
// the way gone tells the heading) poses stay as they are in the map.
// Outages: the map carries on, with the uncertainty that it drifts by. Outliers: gate; a receiver that is rejected for
// long is believed again, first by a wider covariance, then by a new start (kRecovered, kReinitialised).
// Stamps of GPS that are off: gps_lag_watch.hpp compares the way of the fixes with that in the map
// (kGpsStampsDoubtful). Late fixes: up to history_s; a fix ahead of the last pose waits for the next one. Fixes must
// come roughly in order. Lost and found again: if fixes came in the meantime the place they gave is kept, otherwise the
// map's. Lost and gone on in new surroundings (kMapLinkUnknown): place and scale are those of a guess, which fixes
// correct.
//
// Not observable: heading while the body stands still; scale and tilt of a camera's map from a straight way (the tilt
// is taken to be upright, within tilt_sigma).
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "libloc/core/fifo.hpp"
#include "libloc/core/named_count.hpp"
#include "libloc/estimators/estimate.hpp"
#include "libloc/estimators/gps_lag_watch.hpp"
#include "libloc/estimators/gps_position.hpp"
#include "libloc/estimators/map_anchor_start.hpp"
#include "libloc/estimators/slam_frame.hpp"
#include "libloc/filter/gated_update.hpp"

namespace loc {

struct MapAnchorOptions : GpsErrorModel {
  /// The map is in metres (IMU); otherwise the length of its unit and its tilt are found, too.
  bool scale_known = true;
  double scale_sigma = 0.02;  ///< of a scale that is known, relative
  double tilt_sigma = 0;      ///< of the map's z against the vertical [rad]
  /// Of world; without it the first fix is the origin.
  std::optional<GeodeticPoint> origin;
  bool use_gps_velocity = true;

  // By which the map drifts, per root of a metre gone.
  double position_walk = 0.01;  ///< [m/sqrt(m)]
  double heading_walk = 0.001;  ///< [rad/sqrt(m)]
  double tilt_walk = 0;         ///< [rad/sqrt(m)]
  double scale_walk = 0.001;    ///< relative [1/sqrt(m)]

  double start_heading_sigma = 0.1;  ///< The start is found once the heading is known so well, … [rad]
  double start_scale_sigma = 0.15;   ///< … and a scale that was not known, relative.
  std::size_t start_fixes = 256;     ///< remembered for it

  double gate_probability = 0.999;  ///< of a good fix to pass
  int reject_count = 3;             ///< rejections in a row …
  double reject_time_s = 4;         ///< … over at least this time: the covariance is widened [s]
  double history_s = 1;             ///< A fix may be so late. [s]
  double gps_max_ahead_s = 1;       ///< A fix that is further ahead of the poses belongs to another clock. [s]
  double outage_s = 3;              ///< without a good fix: kNoGps [s]

  /// For real sensors. @param inertial whether the map is levelled and in metres
  static MapAnchorOptions robust(bool inertial);
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

class MapAnchor {
 public:
  /// @throws std::invalid_argument as MapAnchorOptions::check.
  explicit MapAnchor(const MapAnchorOptions& options);

  /// The next pose in the map, in the order of time.
  void move(const Estimate& in_map);
  /// A fix, in time, late or ahead of the poses. It counts at once, or with the next pose.
  void fuse(const GpsMeasurement& gps);
  /// Something else than GPS says where the map's x axis points, from east to north: used for the start only. [rad]
  void hint_heading(double heading, double sigma);
  /// The map begins anew, in another unit and elsewhere; the world stays.
  void forget_map();
  void reset();

  bool anchored() const { return anchored_; }
  /// Which map it is that poses are of: another number after each new beginning.
  std::int64_t map_number() const { return map_number_; }
  /// GPS has been there, fix or not.
  bool has_gps() const { return newest_gps_ns_ != kNoTime; }
  const AnchorState& state() const { return x_; }
  /// Of state(), in the order of map_anchor_start.hpp; of no meaning before the start.
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  const std::optional<LocalFrame>& world() const { return world_; }

  /// Poses, frames and points of the map as they are in the world by what is known now; unchanged before the start.
  /// What is later or earlier than the last pose may be given, too. Covariances: those of the map, with the heading and
  /// the place replaced by the anchor's.
  Estimate in_world(const Estimate& in_map) const;
  void put_in_world(SlamFrame& frame) const;
  void put_in_world(SlamMapPoint& point) const;

  /// What the fixes say of their own stamps.
  const GpsLagWatch& lag_watch() const { return lag_; }
  /// EstimateStatus of what happened since the last call.
  std::uint32_t take_status();
  NamedCounts counts() const;

 private:
  using Jacobian = Eigen::Matrix<double, 3, kAnchorDim>;
  struct Pose {
    TimeNs time_ns = kNoTime;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    Eigen::Matrix3d velocity_cov = Eigen::Matrix3d::Zero();
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
    double way = 0;
  };
  // What there was when the camera got lost.
  struct Before {
    AnchorState state;
    Eigen::MatrixXd covariance;
    Eigen::Vector3d in_map = Eigen::Vector3d::Zero();
    std::int64_t fixes = 0;
    bool linked = true;  // to the map that it is found again in
  };

  bool refused(GpsRefusal refusal);
  void carry(const Estimate& in_map, bool found);
  static void go(const Eigen::Vector3d& in_map, AnchorState& state, Eigen::MatrixXd& covariance);
  void drift(double way);
  void see_doubt(const Estimate& in_map);
  void find_back();
  void change_surroundings();
  void forget_foreign_fixes(TimeNs time_ns);
  void take_waiting();
  std::optional<Pose> pose_at(TimeNs time_ns) const;
  void take(const GpsPosition& received, const Pose& pose);
  void see_lag(const GpsPosition& fix, const Pose& pose);
  bool update(const Eigen::Vector3d& residual, const Jacobian& J, const Eigen::Matrix3d& cov, int rows);
  void doubt(TimeNs time_ns, const Eigen::Vector3d& residual);
  void look_for_start();
  Eigen::Vector3d to_world(const Eigen::Vector3d& way) const { return x_.scale * (x_.q_world_map * way); }
  static Jacobian place_jacobian(const Eigen::Vector3d& way);

  MapAnchorOptions options_;
  double gate_2_;
  double gate_3_;
  AnchorState x_;
  Eigen::MatrixXd covariance_;
  bool anchored_ = false;
  std::int64_t map_number_ = 0;
  bool searching_ = false;     // for another start, because this one was wrong
  TimeNs begun_ns_ = kNoTime;  // fix with which it started
  double tried_at_way_ = -1;
  std::optional<LocalFrame> world_;
  std::optional<double> heading_hint_;
  double heading_hint_sigma_ = 0;

  Pose last_;
  TimeNs first_ns_ = kNoTime;                             // pose
  double way_ = 0;                                        // gone in the map [unit]
  Eigen::Vector3d drifted_at_ = Eigen::Vector3d::Zero();  // place in the map up to which the drift is counted
  Fifo<Pose> history_;
  Fifo<GpsPosition> waiting_;      // for poses
  std::vector<AnchorPair> pairs_;  // for a start
  GpsLagWatch lag_;
  Eigen::Matrix3d lag_to_world_ = Eigen::Matrix3d::Identity();  // map to world, as it was when its window began
  Eigen::Vector3d lag_from_ = Eigen::Vector3d::Zero();          // place in the map then
  TimeNs before_ns_ = kNoTime;                                  // of the fix before
  TimeNs newest_gps_ns_ = kNoTime;
  TimeNs last_good_ns_ = kNoTime;  // fix
  int rejected_in_a_row_ = 0;
  TimeNs rejected_since_ns_ = kNoTime;
  int widened_ = 0;  // times, since a fix was accepted
  std::int64_t accepted_ = 0;

  bool lost_ = false;
  bool linked_ = true;            // what is seen now, to the map from before
  std::optional<Before> before_;  // it got lost
  double good_position_variance_ = kUnknown;
  double good_heading_variance_ = kUnknown;
  double grown_position_ = 0;  // of the variances since then, taken into account
  double grown_heading_ = 0;

  Observation observation_;
  Innovation innovation_;
  Eigen::VectorXd correction_;
  std::uint32_t status_ = 0;
  std::map<std::string, std::int64_t> counts_;
};

}  // namespace loc
