// One function per file of bindings: each adds the classes and functions of one folder of libloc/ to the module.
#pragma once

#include <pybind11/pybind11.h>

namespace locpy {

void bind_core(pybind11::module_& m);
void bind_calib_inertial(pybind11::module_& m);
void bind_camera(pybind11::module_& m);
void bind_camera_calibration(pybind11::module_& m);
void bind_camera_imu(pybind11::module_& m);
void bind_spline(pybind11::module_& m);
void bind_vision(pybind11::module_& m);
void bind_geo_export(pybind11::module_& m);
void bind_map_anchor(pybind11::module_& m);
void bind_geometry(pybind11::module_& m);
void bind_sensors(pybind11::module_& m);
void bind_estimators(pybind11::module_& m);
void bind_error_state(pybind11::module_& m);
void bind_slam_options(pybind11::module_& m);
void bind_slam(pybind11::module_& m);
void bind_slam_files(pybind11::module_& m);
void bind_image_slam(pybind11::module_& m);
void bind_ellipsoid(pybind11::module_& m);
void bind_clock(pybind11::module_& m);
void bind_eval(pybind11::module_& m);
void bind_io(pybind11::module_& m);
void bind_nmea(pybind11::module_& m);
void bind_msgs(pybind11::module_& m);
void bind_simulated_sensors(pybind11::module_& m);
void bind_motion(pybind11::module_& m);

}  // namespace locpy
