// estimators/slam_options, and points by inverse depth (geometry/inverse_depth).
#include "libloc/estimators/slam_options.hpp"

#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fields.hpp"
#include "libloc/geometry/inverse_depth.hpp"
#include "properties.hpp"

namespace locpy {
namespace {

using loc::InverseDepthPoint;
using loc::KnownLandmark;
using loc::SlamAssociationOptions;
using loc::SlamMapOptions;
using loc::SlamOptions;

void bind_enumerations(py::module_& m) {
  py::native_enum<loc::SlamMotion>(m, "SlamMotion", "enum.IntEnum", "What the filter knows of the motion.")
      .value("CONSTANT_VELOCITY", loc::SlamMotion::kConstantVelocity, "camera alone: lengths in an unknown unit")
      .value("INERTIAL", loc::SlamMotion::kInertial, "an IMU: metres, and a world with z up")
      .finalize();
  py::native_enum<loc::SlamConsistency>(
      m, "SlamConsistency", "enum.IntEnum",
      "What keeps the filter from learning what it cannot know (place, heading) out of its linearisation errors.")
      .value("PLAIN", loc::SlamConsistency::kPlain, "nothing: Jacobians at the latest estimate")
      .value("FIRST_ESTIMATE", loc::SlamConsistency::kFirstEstimate, "Jacobians by the first estimates")
      .value("INVARIANT", loc::SlamConsistency::kInvariant, "right-invariant errors")
      .finalize();
  py::native_enum<loc::SlamPrecision>(m, "SlamPrecision", "enum.IntEnum", "Numbers of the covariance.")
      .value("DOUBLE", loc::SlamPrecision::kDouble)
      .value("FLOAT", loc::SlamPrecision::kFloat)
      .finalize();
}

void bind_map_options(py::module_& m) {
  using O = SlamMapOptions;
  py::class_<O>(m, "SlamMapOptions", "Which features the map has; every field is a keyword of the constructor.")
      .def(py::init([](const py::kwargs& fields) { return with_fields<O>("SlamMapOptions", fields); }),
           "TypeError for an unknown field, ValueError for a value out of range.")
      .def_readwrite("max_features", &O::max_features, "In the map; bounds memory and time.")
      .def_readwrite("max_measured", &O::max_measured, "In one frame: the most informative ones of those in view.")
      .def_readwrite("min_visible", &O::min_visible, "Fewer measured: features are added.")
      .def_readwrite("max_added", &O::max_added, "In one frame; the first one fills up to min_visible.")
      .def_readwrite("steer_after_frames", &O::steer_after_frames,
                     "While something hides many features at once, younger ones than that are estimated but move "
                     "nothing else. 0: off.")
      .def_readwrite("cover_radius", &O::cover_radius,
                     "Nothing joins the map so near to features that are expected but hidden, and they stay in it for "
                     "a while. A share of the picture's width; 0: off.")
      .def_readwrite("grid_columns", &O::grid_columns, "The picture's cells, over which new features are spread.")
      .def_readwrite("grid_rows", &O::grid_rows, "The same.")
      .def_readwrite("min_separation_px", &O::min_separation_px, "Of a new feature from those in the map [px].")
      .def_readwrite("border_px", &O::border_px, "Predicted nearer to the border: not expected to be seen [px].")
      .def_readwrite("inverse_depth", &O::inverse_depth, "Of a new feature (rho_0) [1/m].")
      .def_readwrite("sigma_inverse_depth", &O::sigma_inverse_depth,
                     "Its deviation (sigma_rho); 0 must lie well within 2 sigma [1/m].")
      .def_readwrite("depth_from_neighbours", &O::depth_from_neighbours,
                     "rho_0 of a new feature is the median of those that are known; its deviation grows with it.")
      .def_readwrite("max_linearity_index", &O::max_linearity_index, "Below it a feature becomes XYZ; 0: never.")
      .def_readwrite("delete_after_tries", &O::delete_after_tries,
                     "Frames in which a feature was expected, before it is judged.")
      .def_readwrite("delete_below_ratio", &O::delete_below_ratio, "Measured in less than this share of them: deleted.")
      .def("check", &O::check, "ValueError names a field that is out of range.");
}

void bind_association_options(py::module_& m) {
  using O = SlamAssociationOptions;
  py::class_<O>(m, "SlamAssociationOptions",
                "Which measurements are believed; every field is a keyword of the constructor.")
      .def(py::init([](const py::kwargs& fields) { return with_fields<O>("SlamAssociationOptions", fields); }),
           "TypeError for an unknown field, ValueError for a value out of range.")
      .def_readwrite("gate_probability", &O::gate_probability,
                     "Of a right measurement to pass (chi-square of 2); 0: what gate() says.")
      .def("gate", &O::gate, py::arg("motion"), "gate_probability, or its default for that motion model.")
      .def_readwrite("ransac", &O::ransac, "Hypotheses from one measurement each; without it the gate alone.")
      .def_readwrite("ransac_probability", &O::ransac_probability, "Of having tried one right measurement at least.")
      .def_readwrite("max_hypotheses", &O::max_hypotheses)
      .def_readwrite("seed", &O::seed, "Of the draws.")
      .def("check", &O::check, "ValueError names a field that is out of range.");
}

void bind_inertial_options(py::module_& m) {
  using R = loc::StandStillOptions;
  py::class_<R>(m, "StandStillOptions", "When an IMU is at rest; every field is a keyword of the constructor.")
      .def(py::init([](const py::kwargs& fields) { return with_fields<R>("StandStillOptions", fields); }),
           "TypeError for an unknown field, ValueError for a value out of range.")
      .def_readwrite("window_s", &R::window_s, "[s]")
      .def_readwrite("min_duration_s", &R::min_duration_s, "Calm for this long is rest; the window counts [s].")
      .def_readwrite("threshold", &R::threshold, "Of the test; 6 is white noise of the densities alone.")
      .def_readwrite("force_sigma_floor", &R::force_sigma_floor, "Of one sample: quantisation, a desk [m/s^2].")
      .def_readwrite("rate_sigma_floor", &R::rate_sigma_floor, "The same [rad/s].")
      .def_readwrite("max_angular_velocity", &R::max_angular_velocity, "Mean rate less the bias [rad/s].")
      .def_readwrite("max_force_error", &R::max_force_error, "Length of the mean force less gravity [m/s^2].")
      .def_readwrite("max_force_change", &R::max_force_change, "Of the mean force since this rest began [m/s^2].")
      .def_readwrite("max_rate_change", &R::max_rate_change, "Of the mean rate since this rest began [rad/s].")
      .def_readwrite("min_speed", &R::min_speed, "A speed that is surely higher says: not at rest [m/s].")
      .def("check", &R::check, "ValueError names a field that is out of range.");
  using S = loc::FusionStartOptions;
  py::class_<S>(m, "FusionStartOptions",
                "Start of an inertial filter from its first second; every field is a keyword of the constructor.")
      .def(py::init([](const py::kwargs& fields) { return with_fields<S>("FusionStartOptions", fields); }),
           "TypeError for an unknown field, ValueError for a value out of range.")
      .def_readwrite("duration_s", &S::duration_s, "So much of the data is looked at [s].")
      .def_readwrite("max_gap_s", &S::max_gap_s, "A longer step begins anew [s].")
      .def_readwrite("moving_acceleration_sigma", &S::moving_acceleration_sigma,
                     "Of the mean over duration_s, when not at rest [m/s^2].")
      .def_readwrite("moving_velocity_sigma", &S::moving_velocity_sigma, "[m/s]")
      .def_readwrite("still_velocity_sigma", &S::still_velocity_sigma, "[m/s]")
      .def_readwrite("tilt_sigma_floor", &S::tilt_sigma_floor, "[rad]")
      .def_readwrite("still_bias_sigma_floor", &S::still_bias_sigma_floor,
                     "Of the gyroscope's bias from a rest: earth rate, swaying [rad/s].")
      .def_readwrite("position_sigma", &S::position_sigma, "The start is the origin [m].")
      .def_readwrite("heading", &S::heading, "Of the body, from east to north [rad]; None: not known.")
      .def_readwrite("heading_sigma", &S::heading_sigma, "Of the one that is given [rad].")
      .def_readwrite("magnetic_declination", &S::magnetic_declination, "East of north positive [rad].")
      .def_readwrite("magnetic_heading_sigma", &S::magnetic_heading_sigma, "Iron nearby, declination [rad].")
      .def("check", &S::check, "ValueError names a field that is out of range.");
}

void bind_start_options(py::module_& m) {
  using O = loc::SlamStartOptions;
  py::class_<O>(m, "SlamStartOptions",
                "Start of InertialSlam in motion, from a window of IMU samples and tracks; every field is a keyword of "
                "the constructor.")
      .def(py::init([](const py::kwargs& fields) { return with_fields<O>("SlamStartOptions", fields); }),
           "TypeError for an unknown field, ValueError for a value out of range.")
      .def_readwrite("min_duration_s", &O::min_duration_s, "Of the frames that are looked at [s].")
      .def_readwrite("max_duration_s", &O::max_duration_s, "Older ones are forgotten [s].")
      .def_readwrite("min_frames", &O::min_frames)
      .def_readwrite("max_frames", &O::max_frames, "Of more, so many spread evenly are looked at.")
      .def_readwrite("min_features", &O::min_features)
      .def_readwrite("max_features", &O::max_features, "Those with the longest tracks.")
      .def_readwrite("min_observations", &O::min_observations, "Of a feature.")
      .def_readwrite("max_gap_s", &O::max_gap_s, "Between IMU samples; a longer one begins anew [s].")
      .def_readwrite("sigma_px", &O::sigma_px, "Not used by InertialSlam, which has its own [px].")
      .def_readwrite("max_sigma_ratio", &O::max_sigma_ratio, "Residuals may be so much larger than sigma_px says.")
      .def_readwrite("min_inliers", &O::min_inliers, "Share of observations that must fit.")
      .def_readwrite("min_parallax", &O::min_parallax,
                     "Median over the features of the largest, in deviations of an observation.")
      .def_readwrite("max_scale_sigma", &O::max_scale_sigma, "Relative deviation of the scale.")
      .def_readwrite("velocity_floor", &O::velocity_floor,
                     "A deviation of the velocity below max_scale_sigma times this is good enough [m/s].")
      .def_readwrite("max_tilt_sigma", &O::max_tilt_sigma, "[rad]")
      .def_readwrite("max_condition", &O::max_condition, "Of the normal equations.")
      .def_readwrite("gyroscope_bias_sigma", &O::gyroscope_bias_sigma, "Wide prior [rad/s].")
      .def_readwrite("sampling", &O::sampling, "ImuSampling: what an IMU sample says.")
      .def("check", &O::check, "ValueError names a field that is out of range.");
}

void bind_landmark(py::module_& m) {
  py::class_<KnownLandmark> c(m, "KnownLandmark",
                              "A point whose place in world is known: it gives the scale and ties the world.");
  c.def(py::init([](std::int64_t id, const ArrayLike& position, double sigma) {
          return KnownLandmark{.id = id, .position = vector3(position, "position"), .sigma = sigma};
        }),
        py::arg("id"), py::arg("position"), py::arg("sigma") = KnownLandmark{}.sigma)
      .def_readwrite("id", &KnownLandmark::id)
      .def_readwrite("sigma", &KnownLandmark::sigma, "Of each coordinate [m].");
  vector_property(c, "position", &KnownLandmark::position, "(3,) in world [m]");
}

/// As with_fields, but without check(): the default has no camera, and is there to be filled in.
std::unique_ptr<SlamOptions> slam_options(const py::kwargs& fields) {
  auto value = std::make_unique<SlamOptions>();
  set_fields("SlamOptions", *value, fields);
  if (fields.contains("camera")) value->check();
  return value;
}

void bind_slam_options_struct(py::module_& m) {
  using O = SlamOptions;
  py::class_<O> c(m, "SlamOptions",
                  "Options of MonoSlam and InertialSlam; every field is a keyword of the constructor: "
                  "SlamOptions(camera=rig.cameras[0], sigma_px=0.5). Structs inside can be changed in place: "
                  "options.map.max_features = 60.");
  c.def(py::init(&slam_options),
        "TypeError for an unknown field; ValueError for a value out of range, once a camera is given.")
      .def("__copy__", [](const O& o) { return O(o); })
      .def(
          "__deepcopy__", [](const O& o, const py::dict& /*memo*/) { return O(o); }, py::arg("memo"))
      .def_readwrite("motion", &O::motion)
      .def_readwrite("consistency", &O::consistency)
      .def_readwrite("precision", &O::precision)
      .def_readwrite("max_iterations", &O::max_iterations, "Of an update that is far from linear; 1: plain EKF.")
      .def_readwrite("camera", &O::camera,
                     "CameraCalibration: K with distortion, pose in body, clock. Without an IMU body is what moves "
                     "smoothly; T_body_camera may be the identity.")
      .def_readwrite("camera_index", &O::camera_index, "Which frames are ours.");
  vector_property(c, "position", &O::position, "Start: of body in world (3,) (X_cam) [m].");
  c.def_property(
      "q_world_body_wxyz",
      [](const O& o) -> std::optional<py::array_t<double>> {
        if (!o.q_world_body) return std::nullopt;
        return to_wxyz(*o.q_world_body);
      },
      [](O& o, const std::optional<ArrayLike>& q) {
        o.q_world_body.reset();
        if (q) o.q_world_body = quaternion(*q, "q_world_body_wxyz");
      },
      "Start (4,) (X_cam_rotation). None, the default: the camera looks along x of a world with z up.");
  vector_property(c, "velocity", &O::velocity, "Start: in world (3,) (X_cam_velocity) [m/s].");
  vector_property(c, "angular_velocity", &O::angular_velocity, "Start: in body (3,) (X_cam_angular_velocity) [rad/s].");
  c.def_readwrite("sigma_position", &O::sigma_position, "Of the start [m]; 0: world is where the camera began.")
      .def_readwrite("sigma_orientation", &O::sigma_orientation, "Of the start [rad].")
      .def_readwrite("sigma_velocity", &O::sigma_velocity, "Of the start, root of P_velocity [m/s].")
      .def_readwrite("sigma_angular_velocity", &O::sigma_angular_velocity, "Of the start, root of P_angular [rad/s].")
      .def_readwrite("acceleration_density", &O::acceleration_density, "Q, camera alone [m/s^2/sqrt(Hz)].")
      .def_readwrite("angular_acceleration_density", &O::angular_acceleration_density,
                     "Q, camera alone [rad/s^2/sqrt(Hz)].")
      .def_readwrite("imu_noise", &O::imu_noise, "Q, with an IMU; biases begin with its deviations.")
      .def_readwrite("imu_sampling", &O::imu_sampling, "ImuSampling: what a sample of the IMU says.")
      .def_readwrite("vibration_part", &O::vibration_part,
                     "So much of the variance by which readings differ from sample to sample counts as white noise of "
                     "the IMU.")
      .def_readwrite("gravity", &O::gravity, "[m/s^2]")
      .def_readwrite("sigma_px", &O::sigma_px, "R: deviation of one coordinate, of frames that do not say [px].")
      .def_readwrite("override_sigma", &O::override_sigma, "sigma_px also in place of what frames say.")
      .def_readwrite("second_order_noise", &O::second_order_noise,
                     "A pixel's variance grows by what the product of the errors of depth and way makes.")
      .def_readwrite("estimate_extrinsics", &O::estimate_extrinsics, "T_body_camera is part of the state.")
      .def_readwrite("sigma_extrinsic_rotation", &O::sigma_extrinsic_rotation, "[rad]")
      .def_readwrite("sigma_extrinsic_position", &O::sigma_extrinsic_position, "[m]")
      .def_readwrite("estimate_time_offset", &O::estimate_time_offset, "So is camera.time_offset_s.")
      .def_readwrite("sigma_time_offset", &O::sigma_time_offset, "[s]")
      .def_property(
          "landmarks", [](const O& o) { return o.landmarks; },
          [](O& o, std::vector<KnownLandmark> landmarks) { o.landmarks = std::move(landmarks); },
          "Copies of the known landmarks: assign a list to change them.")
      .def_readwrite("map", &O::map, "SlamMapOptions")
      .def_readwrite("association", &O::association, "SlamAssociationOptions")
      .def_readwrite("max_gap_s", &O::max_gap_s,
                     "Camera alone: after a longer pause between frames the motion is unknown [s].")
      .def_readwrite("start", &O::start, "With an IMU: FusionStartOptions, start from rest.")
      .def_readwrite("moving_start", &O::moving_start, "With an IMU: SlamStartOptions, start from motion.")
      .def_readwrite("moving_start_factor", &O::moving_start_factor,
                     "By which the deviations of a start from motion are multiplied: what it rests on is used again.")
      .def_readwrite("stand_still", &O::stand_still, "With an IMU: StandStillOptions, when the body rests.")
      .def_readwrite("zero_velocity", &O::zero_velocity, "The velocity is zero while IMU and picture stand still.")
      .def_readwrite("zero_velocity_sigma", &O::zero_velocity_sigma, "[m/s]")
      .def_readwrite("zero_rate_sigma_floor", &O::zero_rate_sigma_floor,
                     "What a body at rest may turn, earth rate included [rad/s].")
      .def_readwrite("still_picture_px", &O::still_picture_px,
                     "The picture is, as a whole, that near to where it was: it stands still … [px].")
      .def_readwrite("still_picture_s", &O::still_picture_s, "… when it has been for so long [s].")
      .def_readwrite("max_imu_step_s", &O::max_imu_step_s, "A longer step is a gap: bridged with more noise [s].")
      .def_readwrite("max_imu_bridge_s", &O::max_imu_bridge_s, "Beyond it a new start [s].")
      .def_readwrite("gap_acceleration_sigma", &O::gap_acceleration_sigma, "What the body may do in a gap [m/s^2].")
      .def_readwrite("gap_angular_velocity_sigma", &O::gap_angular_velocity_sigma, "The same [rad/s].")
      .def_readwrite("max_angular_velocity", &O::max_angular_velocity, "A sample with more is skipped [rad/s].")
      .def_readwrite("max_specific_force", &O::max_specific_force, "A sample with more is skipped [m/s^2].")
      .def_readwrite("recover_after", &O::recover_after,
                     "Frames in a row of which most is not believed: the motion is taken for unknown (RECOVERED).")
      .def_readwrite(
          "lost_after_s", &O::lost_after_s,
          "Without a frame that is found in the map: estimates say so (LOST; with an IMU FEW_FEATURES, too) [s].")
      .def_readwrite("relocate_s", &O::relocate_s,
                     "For so long of frames that show something, but not the map, nothing is added to it: for front "
                     "ends that look for it. 0: the next frame is one of new surroundings [s].")
      .def("check", &O::check, "ValueError names a field that is out of range.");
}

Eigen::Matrix<double, loc::kInverseDepthDim, 1> error6(const ArrayLike& array) {
  return matrix(array, "error", loc::kInverseDepthDim, 1);
}

void bind_inverse_depth(py::module_& m) {
  using P = InverseDepthPoint;
  py::class_<P> c(m, "InverseDepthPoint",
                  "A point by the ray on which it was first seen: anchor + ray / inverse_depth. Its errors are six "
                  "numbers: anchor, two of the ray along ray_basis, inverse depth.");
  c.def(py::init([](const ArrayLike& anchor, const ArrayLike& ray, double inverse_depth) {
          const Eigen::Vector3d direction = vector3(ray, "ray");
          if (!direction.allFinite() || direction.norm() == 0) throw py::value_error("ray must be finite and not zero");
          return P{.anchor = vector3(anchor, "anchor"),
                   .frame = loc::frame_of_ray(direction),
                   .inverse_depth = inverse_depth};
        }),
        py::arg("anchor"), py::arg("ray"), py::arg("inverse_depth"),
        "anchor (3,) in world [m], ray (3,) in world, of any length, inverse_depth [1/m] of the distance.");
  vector_property(c, "anchor", &P::anchor, "(3,) in world [m]");
  c.def_property(
       "frame_wxyz", [](const P& p) { return to_wxyz(p.frame); },
       [](P& p, const ArrayLike& q) { p.frame = quaternion(q, "frame_wxyz"); },
       "(4,): its third axis in world is the ray, the errors of the ray are along the first two.")
      .def_readwrite("inverse_depth", &P::inverse_depth, "[1/m], of the distance")
      .def_property_readonly(
          "ray", [](const P& p) { return to_array(p.ray()); }, "(3,) unit vector in world")
      .def_property_readonly("azimuth", &P::azimuth, "[rad], of a world with y down, as in the source")
      .def_property_readonly("elevation", &P::elevation, "[rad]")
      .def(
          "ray_basis", [](const P& p) { return to_matrix_array(p.ray_basis()); },
          "(3, 2), derivative of the ray by its two errors")
      .def(
          "xyz", [](const P& p) { return to_array(p.xyz()); }, "(3,) in world [m]; not finite when inverse_depth is 0.")
      .def(
          "xyz_jacobian", [](const P& p) { return to_matrix_array(p.xyz_jacobian()); },
          "(3, 6), derivative of xyz() by the errors")
      .def(
          "boxplus",
          [](const P& p, const ArrayLike& error) {
            P out = p;
            out.boxplus(error6(error));
            return out;
          },
          py::arg("error"), "The point with the error (6,) applied.")
      .def(
          "linearity_index",
          [](const P& p, double sigma, const ArrayLike& camera) {
            return loc::linearity_index(p, sigma, vector3(camera, "camera"));
          },
          py::arg("sigma_inverse_depth"), py::arg("camera"),
          "How far the point is from having a Gaussian error in XYZ, seen from camera (3,) [m]; infinity for an "
          "inverse depth that is not positive.");
}

}  // namespace

void bind_slam_options(py::module_& m) {
  bind_enumerations(m);
  bind_map_options(m);
  bind_association_options(m);
  bind_inertial_options(m);
  bind_start_options(m);
  bind_landmark(m);
  bind_slam_options_struct(m);
  bind_inverse_depth(m);
}

}  // namespace locpy
