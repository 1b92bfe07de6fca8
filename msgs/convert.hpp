// Between the LCM types (package loc) and the plain structs of libloc: the only place that knows both.
// from_message() throws DataError, naming the field and its value, for what no sensor can have sent (a size that does
// not match, a time that is not set, a latitude in degrees, a quaternion whose norm is farther than 1e-2 from 1; within
// that it is normalised, within 1e-9 it is kept bit for bit). NaN in a measurement passes, because estimators count and
// report it themselves.
#pragma once

#include <optional>
#include <string>

#include "libloc/estimators/estimate.hpp"
#include "libloc/sensors/clock_line.hpp"
#include "libloc/sensors/measurements.hpp"
#include "loc/clock_t.hpp"
#include "loc/estimate_t.hpp"
#include "loc/fusion_t.hpp"
#include "loc/gps_fix_t.hpp"
#include "loc/image_t.hpp"
#include "loc/imu_t.hpp"
#include "loc/magnetometer_t.hpp"
#include "loc/odometry_t.hpp"
#include "loc/reference_t.hpp"
#include "loc/tracks_t.hpp"

namespace loc {

imu_t to_message(const ImuMeasurement& m);
magnetometer_t to_message(const MagnetometerMeasurement& m);
image_t to_message(const ImageMeasurement& m);
gps_fix_t to_message(const GpsMeasurement& m);
reference_t to_message(const ReferenceMeasurement& m);
odometry_t to_message(const OdometryMeasurement& m);
tracks_t to_message(const FeaturesMeasurement& m);
/// @param method, world as in estimate_t
estimate_t to_message(const Estimate& e, const std::string& method, const std::string& world);
/// What an estimate_t does not hold: readers of estimates need not know of it, and estimate_t stays what it is.
/// @returns nullopt for an estimate that has no scale and no origin.
std::optional<fusion_t> to_fusion_message(const Estimate& e);

/// The line only: who sends it, when, and how good it is, is filled in by the sender.
clock_t to_message(const ClockLine& line);

ImuMeasurement from_message(const imu_t& m);
MagnetometerMeasurement from_message(const magnetometer_t& m);
ImageMeasurement from_message(const image_t& m);
GpsMeasurement from_message(const gps_fix_t& m);
ReferenceMeasurement from_message(const reference_t& m);
OdometryMeasurement from_message(const odometry_t& m);
FeaturesMeasurement from_message(const tracks_t& m);
Estimate from_message(const estimate_t& m);
/// Fills in scale and origin. @throws DataError also when it belongs to another estimate (time, sequence).
void add_message(const fusion_t& m, Estimate& e);
ClockLine from_message(const clock_t& m);

/// Channel of each stream, unless the user names another: LOC_IMU, LOC_MAGNETOMETER, LOC_IMAGE, LOC_GPS, LOC_REFERENCE,
/// LOC_ODOMETRY, LOC_TRACKS (features).
const char* default_channel(StreamKind kind);
inline constexpr const char* kEstimateChannel = "LOC_ESTIMATE";
inline constexpr const char* kFusionChannel = "LOC_FUSION";
inline constexpr const char* kStatisticsChannel = "LOC_STATISTICS";
inline constexpr const char* kClockChannel = "LOC_CLOCK";
inline constexpr const char* kSourceStatusChannel = "LOC_SOURCE_STATUS";

}  // namespace loc
