// What SLAM says (estimators/slam_frame) as NumPy arrays: features of a frame, the map, all frames of a recording.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "libloc/estimators/slam_filter.hpp"

namespace locpy {

struct SlamFeatureArrays {
  py::array_t<std::int64_t> id;
  py::array_t<std::uint8_t> state;
  py::array_t<double> pixel_px, predicted_px, estimated_px, innovation_cov, inverse_depth, sigma_inverse_depth;
  py::array_t<bool> converted;
};

struct SlamMapArrays {
  py::array_t<std::int64_t> id;
  py::array_t<bool> converted;
  py::array_t<double> position, position_cov, anchor, frame_wxyz, inverse_depth, inverse_depth_cov;
  py::array_t<std::int64_t> measured;
  py::array_t<loc::TimeNs> last_measured_ns;
  py::array_t<bool> landmark;
};

struct SlamLandmarkArrays {
  py::array_t<std::int64_t> id, offset;
  py::array_t<bool> converted, known;
  py::array_t<double> position, anchor, frame_wxyz, inverse_depth;
  py::array_t<std::int64_t> measured;
  py::array_t<loc::TimeNs> last_measured_ns;
};

struct SlamRun {
  py::array_t<loc::TimeNs> time_ns;
  py::array_t<std::int64_t> sequence;
  py::array_t<std::uint32_t> valid, status;
  py::array_t<double> q_world_body_wxyz, position, velocity, angular_velocity, gyroscope_bias, accelerometer_bias;
  py::array_t<double> covariance, camera_position, q_world_camera_wxyz;
  py::array_t<double> reprojection_before_px, reprojection_after_px, nis, time_spent_s;
  py::array_t<std::int32_t> nis_dim;
  py::dict counts;
  std::map<std::string, std::int64_t> totals;
  py::array_t<std::int64_t> first;
  SlamFeatureArrays features;
  SlamMapArrays map;
  std::optional<loc::SlamSnapshot> snapshot;
  bool stopped = false;
};

/// Collects frames without the GIL.
struct SlamColumns {
  bool with_covariance = true;
  bool with_features = false;
  std::vector<loc::TimeNs> time_ns;
  std::vector<std::int64_t> sequence;
  std::vector<std::uint32_t> valid, status;
  std::vector<double> q, position, velocity, angular_velocity, gyroscope_bias, accelerometer_bias;
  std::vector<double> covariance, camera_position, camera_q, before, after, nis, time_spent;
  std::vector<std::int32_t> nis_dim;
  std::vector<std::vector<std::int64_t>> counts;  // one of each field of SlamCounts
  std::vector<std::int64_t> first{0};
  std::vector<loc::SlamFeature> features;
  int covariance_dim = 0;

  void add(const loc::SlamFrame& frame, const loc::Estimate& estimate);
  SlamRun take();
};

SlamFeatureArrays arrays_of(const std::vector<loc::SlamFeature>& features);
SlamMapArrays arrays_of(const std::vector<loc::SlamMapPoint>& map);
SlamLandmarkArrays arrays_of(const std::vector<loc::SlamLandmark>& landmarks);

void bind_slam_results(py::module_& m);

}  // namespace locpy
