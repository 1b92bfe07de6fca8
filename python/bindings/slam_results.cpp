#include "slam_results.hpp"

#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <array>
#include <utility>

#include "columns.hpp"
#include "recording.hpp"

namespace locpy {
namespace {

using loc::SlamCounts;
using loc::SlamFeature;
using loc::SlamFrame;
using loc::SlamLandmark;
using loc::SlamMapPoint;

struct CountField {
  const char* name;
  std::int64_t SlamCounts::*member;
  const char* doc;
};
constexpr std::array<CountField, 9> kCountFields{{
    {"in_frame", &SlamCounts::in_frame, "features that the frame has"},
    {"visible", &SlamCounts::visible, "of the map, expected in view"},
    {"measured", &SlamCounts::measured, "used, rescued ones included"},
    {"rescued", &SlamCounts::rescued, "used, after the others had moved the camera to where it agrees"},
    {"rejected", &SlamCounts::rejected, "not believed"},
    {"added", &SlamCounts::added, "to the map"},
    {"converted", &SlamCounts::converted, "from inverse depth to XYZ"},
    {"deleted", &SlamCounts::deleted, "from the map"},
    {"map", &SlamCounts::map, "features afterwards"},
}};

Eigen::Vector4d wxyz_of(const Eigen::Quaterniond& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}

void append(std::vector<double>& to, const Eigen::Vector3d& v) {
  to.insert(to.end(), v.data(), v.data() + 3);
}

void append(std::vector<double>& to, const Eigen::Quaterniond& q) {
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) to.push_back(value);
}

}  // namespace

SlamFeatureArrays arrays_of(const std::vector<SlamFeature>& features) {
  return {
      .id = column<std::int64_t>(features, [](const SlamFeature& f) { return f.id; }),
      .state = column<std::uint8_t>(features, [](const SlamFeature& f) { return static_cast<std::uint8_t>(f.state); }),
      .pixel_px = rows<2>(features, [](const SlamFeature& f) { return f.pixel_px; }),
      .predicted_px = rows<2>(features, [](const SlamFeature& f) { return f.predicted_px; }),
      .estimated_px = rows<2>(features, [](const SlamFeature& f) { return f.estimated_px; }),
      .innovation_cov = matrices<2>(features, [](const SlamFeature& f) { return f.innovation_cov; }),
      .inverse_depth = column<double>(features, [](const SlamFeature& f) { return f.inverse_depth; }),
      .sigma_inverse_depth = column<double>(features, [](const SlamFeature& f) { return f.sigma_inverse_depth; }),
      .converted = column<bool>(features, [](const SlamFeature& f) { return f.converted; }),
  };
}

SlamMapArrays arrays_of(const std::vector<SlamMapPoint>& map) {
  using P = SlamMapPoint;
  const auto rho = [](const P& p) { return p.converted ? loc::kUnknown : p.inverse_depth.inverse_depth; };
  const auto anchor = [](const P& p) -> Eigen::Vector3d {
    if (p.converted) return Eigen::Vector3d::Constant(loc::kUnknown);
    return p.inverse_depth.anchor;
  };
  const auto frame = [](const P& p) -> Eigen::Vector4d {
    if (p.converted) return Eigen::Vector4d::Constant(loc::kUnknown);
    return wxyz_of(p.inverse_depth.frame);
  };
  return {
      .id = column<std::int64_t>(map, [](const P& p) { return p.id; }),
      .converted = column<bool>(map, [](const P& p) { return p.converted; }),
      .position = rows<3>(map, [](const P& p) { return p.position; }),
      .position_cov = matrices<3>(map, [](const P& p) { return p.position_cov; }),
      .anchor = rows<3>(map, anchor),
      .frame_wxyz = rows<4>(map, frame),
      .inverse_depth = column<double>(map, rho),
      .inverse_depth_cov = matrices<loc::kInverseDepthDim>(map, [](const P& p) { return p.inverse_depth_cov; }),
      .measured = column<std::int64_t>(map, [](const P& p) { return p.measured; }),
      .last_measured_ns = column<loc::TimeNs>(map, [](const P& p) { return p.last_measured_ns; }),
      .landmark = column<bool>(map, [](const P& p) { return p.landmark; }),
  };
}

SlamLandmarkArrays arrays_of(const std::vector<SlamLandmark>& landmarks) {
  using L = SlamLandmark;
  return {
      .id = column<std::int64_t>(landmarks, [](const L& l) { return l.id; }),
      .offset = column<std::int64_t>(landmarks, [](const L& l) { return l.offset; }),
      .converted = column<bool>(landmarks, [](const L& l) { return l.point.converted; }),
      .known = column<bool>(landmarks, [](const L& l) { return l.known; }),
      .position = rows<3>(landmarks, [](const L& l) { return l.point.position; }),
      .anchor = rows<3>(landmarks, [](const L& l) { return l.point.inverse_depth.anchor; }),
      .frame_wxyz = rows<4>(landmarks, [](const L& l) { return wxyz_of(l.point.inverse_depth.frame); }),
      .inverse_depth = column<double>(landmarks, [](const L& l) { return l.point.inverse_depth.inverse_depth; }),
      .measured = column<std::int64_t>(landmarks, [](const L& l) { return l.measured; }),
      .last_measured_ns = column<loc::TimeNs>(landmarks, [](const L& l) { return l.last_measured_ns; }),
  };
}

void SlamColumns::add(const SlamFrame& frame, const loc::Estimate& estimate) {
  counts.resize(kCountFields.size());
  time_ns.push_back(frame.time_ns);
  sequence.push_back(frame.sequence);
  valid.push_back(estimate.valid);
  status.push_back(estimate.status);
  append(q, estimate.q_world_body);
  append(position, estimate.position);
  append(velocity, estimate.velocity);
  append(angular_velocity, estimate.angular_velocity);
  append(gyroscope_bias, estimate.gyroscope_bias);
  append(accelerometer_bias, estimate.accelerometer_bias);
  append(camera_position, frame.camera_position);
  append(camera_q, frame.q_world_camera);
  before.push_back(frame.reprojection_before_px);
  after.push_back(frame.reprojection_after_px);
  nis.push_back(frame.nis);
  nis_dim.push_back(frame.nis_dim);
  time_spent.push_back(frame.time_spent_s);
  for (std::size_t i = 0; i < kCountFields.size(); ++i) counts[i].push_back(frame.counts.*kCountFields[i].member);
  if (with_covariance) {
    covariance_dim = estimate.covariance_dim;
    for (int i = 0; i < covariance_dim; ++i) {
      for (int j = 0; j < covariance_dim; ++j) covariance.push_back(estimate.covariance(i, j));
    }
  }
  if (with_features) features.insert(features.end(), frame.features.begin(), frame.features.end());
  first.push_back(static_cast<std::int64_t>(features.size()));
}

SlamRun SlamColumns::take() {
  counts.resize(kCountFields.size());
  const auto n = static_cast<py::ssize_t>(time_ns.size());
  SlamRun out;
  out.time_ns = hand_over(std::move(time_ns));
  out.sequence = hand_over(std::move(sequence));
  out.valid = hand_over(std::move(valid));
  out.status = hand_over(std::move(status));
  out.q_world_body_wxyz = hand_over(std::move(q), 4);
  out.position = hand_over(std::move(position), 3);
  out.velocity = hand_over(std::move(velocity), 3);
  out.angular_velocity = hand_over(std::move(angular_velocity), 3);
  out.gyroscope_bias = hand_over(std::move(gyroscope_bias), 3);
  out.accelerometer_bias = hand_over(std::move(accelerometer_bias), 3);
  out.camera_position = hand_over(std::move(camera_position), 3);
  out.q_world_camera_wxyz = hand_over(std::move(camera_q), 4);
  out.reprojection_before_px = hand_over(std::move(before));
  out.reprojection_after_px = hand_over(std::move(after));
  out.nis = hand_over(std::move(nis));
  out.nis_dim = hand_over(std::move(nis_dim));
  out.time_spent_s = hand_over(std::move(time_spent));
  for (std::size_t i = 0; i < kCountFields.size(); ++i) {
    out.counts[kCountFields[i].name] = hand_over(std::move(counts[i]));
  }
  const py::ssize_t dim = covariance_dim;
  out.covariance = hand_over(std::move(covariance)).reshape({dim > 0 ? n : 0, dim, dim});
  out.first = hand_over(std::move(first));
  out.features = arrays_of(features);
  return out;
}

namespace {

void bind_arrays(py::module_& m) {
  py::native_enum<loc::SlamFeatureState>(m, "SlamFeatureState", "enum.IntEnum", "What became of a feature in a frame.")
      .value("PREDICTED", loc::SlamFeatureState::kPredicted, "expected in view, and not measured")
      .value("MEASURED", loc::SlamFeatureState::kMeasured, "used")
      .value("RESCUED", loc::SlamFeatureState::kRescued,
             "used, after the others had moved the camera to where it agrees")
      .value("REJECTED", loc::SlamFeatureState::kRejected, "its measurement is not believed")
      .value("NEW", loc::SlamFeatureState::kNew, "added to the map in this frame")
      .finalize();
  using F = SlamFeatureArrays;
  py::class_<F>(m, "SlamFeatureArrays", "Features of a frame, a row each.")
      .def_readonly("id", &F::id, "(M,) int64")
      .def_readonly("state", &F::state, "(M,) uint8, SlamFeatureState")
      .def_readonly("pixel_px", &F::pixel_px, "(M, 2) as measured; NaN when it was not")
      .def_readonly("predicted_px", &F::predicted_px, "(M, 2) before the update")
      .def_readonly("estimated_px", &F::estimated_px, "(M, 2) after it")
      .def_readonly("innovation_cov", &F::innovation_cov, "(M, 2, 2) of measured less predicted [px^2]")
      .def_readonly("inverse_depth", &F::inverse_depth, "(M,) [1/m]; of an XYZ point: of its distance")
      .def_readonly("sigma_inverse_depth", &F::sigma_inverse_depth, "(M,) its deviation; NaN for an XYZ point")
      .def_readonly("converted", &F::converted, "(M,) bool: is an XYZ point");
  using M = SlamMapArrays;
  py::class_<M>(m, "SlamMapArrays", "Features of the map, a row each. What a point does not have is NaN.")
      .def_readonly("id", &M::id, "(K,) int64")
      .def_readonly("converted", &M::converted, "(K,) bool: is an XYZ point; otherwise inverse depth")
      .def_readonly("position", &M::position, "(K, 3) in world [m]; NaN where the inverse depth is not positive")
      .def_readonly("position_cov", &M::position_cov, "(K, 3, 3) [m^2]")
      .def_readonly("anchor", &M::anchor, "(K, 3) in world [m]: where the camera was when it saw the point first")
      .def_readonly("frame_wxyz", &M::frame_wxyz, "(K, 4): the third axis is the ray from the anchor")
      .def_readonly("inverse_depth", &M::inverse_depth, "(K,) [1/m] along the ray")
      .def_readonly("inverse_depth_cov", &M::inverse_depth_cov, "(K, 6, 6): anchor, two of the ray, inverse depth")
      .def_readonly("measured", &M::measured, "(K,) frames in which it was used")
      .def_readonly("last_measured_ns", &M::last_measured_ns, "(K,) int64; the smallest int64 (NO_TIME): never")
      .def_readonly("landmark", &M::landmark, "(K,) bool: was known beforehand")
      .def("__len__", [](const M& self) { return self.id.size(); });
  using L = SlamLandmarkArrays;
  py::class_<L>(m, "SlamLandmarkArrays", "Features of a SlamSnapshot, a row each.")
      .def_readonly("id", &L::id, "(K,) int64")
      .def_readonly("offset", &L::offset, "(K,) int64: row of the covariance where its errors begin")
      .def_readonly("converted", &L::converted, "(K,) bool: three errors, of position; otherwise six")
      .def_readonly("known", &L::known, "(K,) bool: its place was given")
      .def_readonly("position", &L::position, "(K, 3) in world [m], when converted")
      .def_readonly("anchor", &L::anchor, "(K, 3) in world [m], unless converted")
      .def_readonly("frame_wxyz", &L::frame_wxyz, "(K, 4): the third axis is the ray")
      .def_readonly("inverse_depth", &L::inverse_depth, "(K,) [1/m]")
      .def_readonly("measured", &L::measured, "(K,) frames in which it was used")
      .def_readonly("last_measured_ns", &L::last_measured_ns, "(K,) int64; the smallest int64 (NO_TIME): never");
}

void bind_frame(py::module_& m) {
  py::class_<SlamCounts> counts(m, "SlamCounts", "Numbers of features in one frame.");
  for (const CountField& field : kCountFields) counts.def_readonly(field.name, field.member, field.doc);
  using F = SlamFrame;
  py::class_<F>(m, "SlamFrame", "What SLAM says about one frame.")
      .def_readonly("time_ns", &F::time_ns)
      .def_readonly("sequence", &F::sequence)
      .def_readonly("camera", &F::camera)
      .def_readonly("estimate", &F::estimate, "after the update; pose of body")
      .def_property_readonly(
          "camera_position", [](const F& f) { return to_array(f.camera_position); }, "(3,) of camera in world [m]")
      .def_property_readonly("q_world_camera_wxyz", [](const F& f) { return to_wxyz(f.q_world_camera); })
      .def_readonly("reprojection_before_px", &F::reprojection_before_px,
                    "root of the mean square of |measured - predicted|, of those used; NaN without any")
      .def_readonly("reprojection_after_px", &F::reprojection_after_px, "the same after the update")
      .def_readonly("nis", &F::nis, "of all that was used")
      .def_readonly("nis_dim", &F::nis_dim, "numbers in it")
      .def_readonly("counts", &F::counts)
      .def_readonly("time_spent_s", &F::time_spent_s, "by the filter")
      .def_property_readonly("features", [](const F& f) { return arrays_of(f.features); });
  using S = loc::SlamSnapshot;
  py::class_<S>(m, "SlamSnapshot", "All that a filter knows; restore() goes on from there.")
      .def_property_readonly("time_ns", [](const S& s) { return optional_time(s.time_ns); })
      .def_property_readonly("q_world_body_wxyz", [](const S& s) { return to_wxyz(s.state.q_world_body); })
      .def_property_readonly("position", [](const S& s) { return to_array(s.state.position); })
      .def_property_readonly("velocity", [](const S& s) { return to_array(s.state.velocity); })
      .def_property_readonly("angular_velocity", [](const S& s) { return to_array(s.state.angular_velocity); })
      .def_property_readonly("gyroscope_bias", [](const S& s) { return to_array(s.state.gyroscope_bias); })
      .def_property_readonly("accelerometer_bias", [](const S& s) { return to_array(s.state.accelerometer_bias); })
      .def_property_readonly("T_body_camera", [](const S& s) { return s.state.T_body_camera; })
      .def_property_readonly("time_offset_s", [](const S& s) { return s.state.time_offset_s; })
      .def_property_readonly("landmarks", [](const S& s) { return arrays_of(s.landmarks); })
      .def_property_readonly(
          "covariance", [](const S& s) { return to_matrix_array(s.covariance); },
          "(n, n) of the errors: theta [rad, body axes], position, velocity, angular velocity or the biases of "
          "gyroscope and accelerometer; then, where estimated, rotation and place of the camera in body, its clock; "
          "then the features at their offsets.");
}

void bind_run(py::module_& m) {
  using R = SlamRun;
  py::class_<R>(m, "SlamRun", "What a whole recording gives: a row for each frame that was used.")
      .def_readonly("time_ns", &R::time_ns, "(N,) int64")
      .def_readonly("sequence", &R::sequence, "(N,) int64: row of the frame in what was given")
      .def_readonly("valid", &R::valid, "(N,) uint32, EstimateValid")
      .def_readonly("status", &R::status, "(N,) uint32, EstimateStatus")
      .def_readonly("q_world_body_wxyz", &R::q_world_body_wxyz, "(N, 4)")
      .def_readonly("position", &R::position, "(N, 3) of body in world [m]")
      .def_readonly("velocity", &R::velocity, "(N, 3) in world [m/s]")
      .def_readonly("angular_velocity", &R::angular_velocity, "(N, 3) in body [rad/s]")
      .def_readonly("gyroscope_bias", &R::gyroscope_bias, "(N, 3) [rad/s]; NaN without an IMU")
      .def_readonly("accelerometer_bias", &R::accelerometer_bias, "(N, 3) [m/s^2]; NaN without an IMU")
      .def_readonly("covariance", &R::covariance,
                    "(N, d, d) of the error (theta [rad, body axes], p, v, bg, ba), d = 9 without an IMU, 15 with one")
      .def_readonly("camera_position", &R::camera_position, "(N, 3) of camera in world [m]")
      .def_readonly("q_world_camera_wxyz", &R::q_world_camera_wxyz, "(N, 4)")
      .def_readonly("reprojection_before_px", &R::reprojection_before_px, "(N,); NaN where nothing was used")
      .def_readonly("reprojection_after_px", &R::reprojection_after_px, "(N,)")
      .def_readonly("nis", &R::nis, "(N,) of all that was used")
      .def_readonly("nis_dim", &R::nis_dim, "(N,) numbers in it")
      .def_readonly("time_spent_s", &R::time_spent_s, "(N,) by the filter")
      .def_readonly("counts", &R::counts, "{field of SlamCounts: (N,) int64}")
      .def_readonly("totals", &R::totals, "counts() of the estimator at the end: what was used and skipped, and why")
      .def_readonly("first", &R::first, "(N + 1,): features of frame i are rows first[i]:first[i + 1]")
      .def_readonly("features", &R::features, "SlamFeatureArrays of all frames, when asked for")
      .def_readonly("map", &R::map, "SlamMapArrays, at the end")
      .def_readonly("snapshot", &R::snapshot, "SlamSnapshot at the end, to go on from; None before the start.")
      .def_readonly("stopped", &R::stopped, "progress() asked for it")
      .def("__len__", [](const R& r) { return r.time_ns.size(); });
}

}  // namespace

void bind_slam_results(py::module_& m) {
  bind_arrays(m);
  bind_frame(m);
  bind_run(m);
}

}  // namespace locpy
