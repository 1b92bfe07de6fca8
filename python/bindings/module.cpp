// The extension module libloc._core. Order matters: a class must be known before a signature names it.
#include "bindings.hpp"
#include "libloc/core/check.hpp"

PYBIND11_MODULE(_core, m) {
  m.doc() = "libloc's C++ core. Use it through the package libloc.";
  // std::invalid_argument, the caller's mistake, is a ValueError by pybind11's own rules.
  pybind11::register_exception<loc::DataError>(m, "DataError", PyExc_ValueError).doc() =
      "What is wrong in a file or message: where (file, line or byte), which field, which value.";
  locpy::bind_core(m);
  locpy::bind_geo_export(m);
  locpy::bind_geometry(m);
  locpy::bind_sensors(m);
  locpy::bind_estimators(m);
  locpy::bind_error_state(m);
  locpy::bind_ellipsoid(m);
  locpy::bind_clock(m);
  locpy::bind_calib_inertial(m);
  locpy::bind_eval(m);
  locpy::bind_io(m);
  locpy::bind_nmea(m);
  locpy::bind_msgs(m);
  locpy::bind_motion(m);
  locpy::bind_camera(m);
  locpy::bind_camera_calibration(m);
  locpy::bind_camera_imu(m);
  locpy::bind_spline(m);
  locpy::bind_vision(m);
  locpy::bind_slam_options(m);
  locpy::bind_slam(m);
  locpy::bind_map_anchor(m);
  locpy::bind_slam_files(m);
  locpy::bind_image_slam(m);
  locpy::bind_simulated_sensors(m);
}
