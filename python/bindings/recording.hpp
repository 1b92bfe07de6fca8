// A whole recording as NumPy arrays, one set of them per stream.
#pragma once

#include <pybind11/numpy.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "libloc/io/source.hpp"

namespace locpy {

namespace py = pybind11;

std::map<std::string, std::int64_t> as_map(const loc::NamedCounts& counts);

/// Hands the vector over to Python: no copy. @param columns 0: one dimension.
template <class T>
py::array_t<T> hand_over(std::vector<T>&& values, py::ssize_t columns = 0) {
  auto owned = std::make_unique<std::vector<T>>(std::move(values));
  T* data = owned->data();
  const auto size = static_cast<py::ssize_t>(owned->size());
  const py::capsule owner(owned.release(), [](void* vector) { delete static_cast<std::vector<T>*>(vector); });
  if (columns == 0) return py::array_t<T>(size, data, owner);
  return py::array_t<T>({size / columns, columns}, data, owner);
}

struct ImuColumns {
  std::vector<loc::TimeNs> times_ns;
  std::vector<double> angular_velocity;
  std::vector<double> specific_force;
};
struct MagnetometerColumns {
  std::vector<loc::TimeNs> times_ns;
  std::vector<double> magnetic_field;
};
struct ReferenceColumns {
  std::vector<loc::TimeNs> times_ns;
  std::vector<double> q_world_body_wxyz;
  std::vector<double> position;
  std::vector<double> velocity;
  std::vector<std::uint8_t> score;
};
struct GpsColumns {
  std::vector<loc::TimeNs> times_ns;
  std::vector<double> latitude_longitude_altitude;
  std::vector<double> position_cov;  // rows of the matrices, one after the other
  std::vector<double> velocity_enu;
  std::vector<double> velocity_cov;
  std::vector<std::int8_t> fix;
};

struct OdometryColumns {
  std::vector<loc::TimeNs> times_ns;
  std::vector<loc::TimeNs> start_times_ns;
  std::vector<double> position;
  std::vector<double> q_wxyz;
  std::vector<double> position_cov;  // rows of the matrices, one after the other
  std::vector<double> orientation_cov;
};
struct FeaturesColumns {
  std::vector<loc::TimeNs> times_ns;
  std::vector<std::int32_t> camera;
  std::vector<double> sigma_px;
  std::vector<std::int64_t> first{0};  // of each frame in the arrays below, and one past the last
  std::vector<std::int64_t> id;
  std::vector<double> pixel_px;
};

struct Columns {
  ImuColumns imu;
  MagnetometerColumns magnetometer;
  ReferenceColumns reference;
  GpsColumns gps;
  OdometryColumns odometry;
  FeaturesColumns features;
  std::int64_t images = 0;

  void add(const loc::Measurement& measurement);
};

}  // namespace locpy
