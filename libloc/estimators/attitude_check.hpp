// A second opinion on orientation, by Madgwick's filter from the IMU and the magnetometer alone: whether an estimate's
// vertical is that of the accelerometers, and where its axes point by the magnetometer.
//
// The accelerometers of a body that speeds up say a wrong vertical for a while, so that the difference is averaged over
// average_s, and must be larger than both max_tilt and what the estimate's own deviation allows.
#pragma once

#include <cstdint>
#include <optional>

#include "libloc/core/fifo.hpp"
#include "libloc/estimators/estimate.hpp"
#include "libloc/estimators/madgwick.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

struct AttitudeCheckOptions {
  double average_s = 5;
  double max_tilt = 0.12;       ///< [rad]
  double deviations = 3;        ///< of the estimate's tilt that are allowed on top
  double start_s = 5;           ///< after which Madgwick's filter is believed
  double heading_sigma = 0.25;  ///< of a magnetic heading: declination and iron [rad]
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

class AttitudeCheck {
 public:
  /// @throws std::invalid_argument as AttitudeCheckOptions::check.
  explicit AttitudeCheck(const AttitudeCheckOptions& options = {});

  /// IMU samples and those of a magnetometer, each in time order; others are left aside.
  void see(const Measurement& measurement);
  /// An estimate whose world has z up, at the time of one of the IMU samples of the last second.
  /// @returns kTiltDoubtful while they disagree, otherwise 0
  std::uint32_t compare(const Estimate& estimate);
  /// Where the x axis of the estimate's world points by the magnetometer, from (magnetic) east to north [rad]; nothing
  /// while there is none that can be believed. Its deviation is options.heading_sigma.
  std::optional<double> heading_of_world(const Estimate& estimate) const;
  double tilt() const { return difference_.norm(); }  ///< averaged [rad]
  const AttitudeCheckOptions& options() const { return options_; }
  void reset();

 private:
  // What Madgwick's filter said after a sample. An estimate may rest upon an older sample than the last one.
  struct Opinion {
    TimeNs time_ns = kNoTime;
    Eigen::Quaterniond q_world_body;
    bool has_north = false;
  };
  const Opinion* at(const Estimate& estimate) const;

  AttitudeCheckOptions options_;
  MadgwickFilter filter_;
  TimeNs begin_ns_ = kNoTime;
  Fifo<Opinion> opinions_;  // of the last second
  TimeNs compared_ns_ = kNoTime;
  Eigen::Vector3d difference_ = Eigen::Vector3d::Zero();  // of the verticals, averaged, axes of world
  double averaged_s_ = 0;
};

}  // namespace loc
