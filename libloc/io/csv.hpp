// Recordings of one's own as comma-separated text: the first line names the columns and their units, every other line
// is one sample. Headings are written `name [unit]` or `name_unit`; case does not matter; a leading # is allowed.
//
//   what                  names                                                      units
//   time                  time, timestamp, t, ts                                     ns, us, ms, s
//   angular velocity      wx wy wz, gx gy gz, gyr_x.., gyro_x.., w_rs_s_x.., omega_x.. rad/s, deg/s (rad_s, deg_s, dps)
//   specific force        ax ay az, acc_x.., a_rs_s_x.., alpha_x..                     m/s^2, g, mg (m_s2, g, mg)
//   magnetic field        mx my mz, mag_x..                                          T, mT, uT, nT, gauss, mgauss, arb
//   reference orientation qw qx qy qz, q_rs_w.. (Hamilton, body to world)            none
//   reference position    px py pz, p_rs_r_x..                                       m
//   reference velocity    vx vy vz, v_rs_r_x..                                       m/s
//   score                 score (0 or 1: compare with the reference here)            none
//   GPS fix               latitude longitude, lat lon (WGS 84)                       deg, rad
//                         altitude, alt (above the ellipsoid)                        m
//                         ve vn vu (velocity east, north, up)                        m/s
//                         sigma_e sigma_n sigma_u, sigma_ve sigma_vn sigma_vu        m, m/s
//                         fix (a number, as GpsFixType), satellites                  none
//   odometry              odo_px odo_py odo_pz (absolute: body in world; relative:   m, unit (both: odometry's own)
//                         body in the axes of body at odo_start)
//                         odo_qw odo_qx odo_qy odo_qz                                none
//                         odo_start (empty: absolute)                                as time
//                         odo_sigma_px.., odo_sigma_theta_x..                        m or unit, rad or deg
//   not used              b_w_rs_s_x.., b_a_rs_s_x.. (EuRoC's reference biases)      any
//
// time_ns,wx_rad_s,... is the same as #timestamp [ns],wx [rad s^-1],...: this is EuRoC's own form, too. The unit [arb]
// of a magnetic field is what the sensor counts in; CsvOptions tells how many tesla that is. Columns come in any order
// and number; a time and one complete triad (or latitude and longitude) are needed. The cells of one triad may all be
// empty (a magnetometer at its own rate), never some of them. A deviation fills the diagonal of a covariance; what has
// none is NaN there, and correlations have no columns (LCM logs hold them). A fix without the column fix is 3-D when it
// has an altitude, otherwise 2-D. Comments: only the heading may begin with #. Blank lines before it are passed over.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "libloc/estimators/estimate.hpp"
#include "libloc/io/source.hpp"

namespace loc {

/// Units of columns whose heading has none; written as in the table above. Empty: such a column is an error.
struct CsvOptions {
  std::string time_unit;
  std::string angular_velocity_unit;
  std::string specific_force_unit;
  std::string magnetic_field_unit;
  double tesla_per_unit = 0;  ///< [T], for the unit arb; 0: arb is an error.
};

/// A recording in one file; measurements of one time come row by row, within a row magnetometer, GPS, odometry,
/// reference, IMU.
/// Rows may share a time (one sensor per row). Skipped and counted: rows that go back in time
/// ("rows.skipped.time_not_increasing"), in a row of the same time as the one before a sensor that was there already
/// ("imu.skipped.time_not_increasing"), rows that hold no measurement ("rows.skipped.empty") or nothing at all
/// ("rows.skipped.blank"), a last line without its line end ("rows.skipped.no_line_end"). Values that are not finite
/// pass and are counted ("imu.not_finite").
/// @throws DataError naming file, line, column and value: here for the heading, from next() for a row.
std::unique_ptr<MeasurementSource> open_csv(const std::filesystem::path& path, const CsvOptions& options = {});

/// Writes estimates, one line each: time_ns, quaternion w x y z, position [m], velocity [m/s], angular velocity
/// [rad/s], biases [rad/s, m/s^2], the deviations of the 15 errors (theta [rad], position, velocity, biases), the bits
/// valid and status, sequence, the odometry's scale and its deviation, the origin of world [rad, rad, m]. What an
/// estimate does not hold is left empty. Numbers are written so that reading gives the same double.
class CsvWriter {
 public:
  /// @throws DataError when the file cannot be written.
  explicit CsvWriter(const std::filesystem::path& path);
  void write(const Estimate& estimate);
  /// Everything is on its way to the disk; @throws DataError when it is not (disk full).
  void flush();

 private:
  std::filesystem::path path_;
  std::ofstream file_;
};

}  // namespace loc
