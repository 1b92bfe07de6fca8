// calib/ of inertial sensors: stillness, accelerometer, gyroscope, Allan deviation, alignment of the magnetometer.
#include <pybind11/stl.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/calib/accelerometer.hpp"
#include "libloc/calib/allan.hpp"
#include "libloc/calib/gyroscope.hpp"
#include "libloc/calib/magnetometer_alignment.hpp"
#include "libloc/calib/stillness.hpp"

namespace locpy {
namespace {

using loc::AccelerometerFit;
using loc::AccelerometerOptions;
using loc::AllanFit;
using loc::AllanOptions;
using loc::AllanTerm;
using loc::GyroscopeFit;
using loc::GyroscopeOptions;
using loc::ImuAllan;
using loc::MagnetometerAlignment;
using loc::MagnetometerAlignmentOptions;
using loc::RestNoise;
using loc::Stillness;
using loc::StillnessOptions;
using loc::StillSegment;

/// Rows like times, or none for a sensor that is absent.
Rows<3> optional_rows(const std::optional<FloatArray>& array, const char* name, py::ssize_t expected) {
  if (!array) return Rows<3>(nullptr, 0, 3);
  return rows_view<3>(*array, name, expected, "times_ns");
}

template <class T>
void vector_getter(py::class_<T>& c, const char* name, Eigen::Vector3d T::*member, const char* doc) {
  c.def_property_readonly(
      name, [member](const T& self) { return to_array(self.*member); }, doc);
}

template <class T, int n>
void matrix_getter(py::class_<T>& c, const char* name, Eigen::Matrix<double, n, n> T::*member, const char* doc) {
  c.def_property_readonly(
      name, [member](const T& self) { return to_matrix_array(self.*member); }, doc);
}

/// (N,) of one member of a list.
template <class T, class Get>
auto column(const std::vector<T>& list, const Get& get) {
  using Value = decltype(get(list.front()));
  py::array_t<Value> out(static_cast<py::ssize_t>(list.size()));
  Value* at = out.mutable_data();
  for (const T& item : list) *at++ = get(item);
  return out;
}

void bind_stillness(py::module_& m) {
  const StillnessOptions d;
  py::class_<StillnessOptions>(m, "StillnessOptions", "What counts as still. No threshold has a unit.")
      .def(py::init([](double min_duration_s, double window_s, double enter_ratio, double leave_ratio,
                       double min_whiteness, double turning_sigmas, double max_wander, double gap_periods) {
             const StillnessOptions options{.min_duration_s = min_duration_s,
                                            .window_s = window_s,
                                            .enter_ratio = enter_ratio,
                                            .leave_ratio = leave_ratio,
                                            .min_whiteness = min_whiteness,
                                            .turning_sigmas = turning_sigmas,
                                            .max_wander = max_wander,
                                            .gap_periods = gap_periods};
             options.check();
             return options;
           }),
           py::kw_only(), py::arg("min_duration_s") = d.min_duration_s, py::arg("window_s") = d.window_s,
           py::arg("enter_ratio") = d.enter_ratio, py::arg("leave_ratio") = d.leave_ratio,
           py::arg("min_whiteness") = d.min_whiteness, py::arg("turning_sigmas") = d.turning_sigmas,
           py::arg("max_wander") = d.max_wander, py::arg("gap_periods") = d.gap_periods,
           "ValueError names a field that is out of range.")
      .def_readonly("min_duration_s", &StillnessOptions::min_duration_s, "shorter segments are left out")
      .def_readonly("window_s", &StillnessOptions::window_s, "over which the variance is taken")
      .def_readonly("enter_ratio", &StillnessOptions::enter_ratio, "variance over the noise's: stillness begins below")
      .def_readonly("leave_ratio", &StillnessOptions::leave_ratio, "and ends above")
      .def_readonly("min_whiteness", &StillnessOptions::min_whiteness, "of the quietest windows; 0: not judged")
      .def_readonly("turning_sigmas", &StillnessOptions::turning_sigmas,
                    "mean rate off the median of all segments, in deviations of a sample; 0: off")
      .def_readonly("max_wander", &StillnessOptions::max_wander,
                    "mean square step from window to window over what the noise makes; 0: off")
      .def_readonly("gap_periods", &StillnessOptions::gap_periods, "a longer pause ends a segment");

  py::class_<RestNoise> noise(m, "RestNoise", "Noise of one sensor at rest, that stillness is measured against.");
  vector_getter(noise, "variance", &RestNoise::variance, "(3,) of a sample; NaN: axis without information");
  vector_getter(noise, "quantum", &RestNoise::quantum, "(3,) smallest step of the readings");
  noise.def_readonly("whiteness", &RestNoise::whiteness, "of the quietest windows: 1 for white noise")
      .def_property_readonly("known", &RestNoise::known);

  py::class_<StillSegment>(m, "StillSegment", "One still part of a recording. An absent sensor's figures are NaN.")
      .def_readonly("begin", &StillSegment::begin, "first row")
      .def_readonly("end", &StillSegment::end, "one past the last row")
      .def_readonly("start_ns", &StillSegment::start_ns)
      .def_readonly("end_ns", &StillSegment::end_ns, "of the last row in it")
      .def_readonly("samples", &StillSegment::samples, "taken")
      .def_property_readonly("duration_s", &StillSegment::duration_s)
      .def_property_readonly(
          "gyroscope_mean", [](const StillSegment& self) { return to_array(self.gyroscope.mean); }, "(3,)")
      .def_property_readonly(
          "gyroscope_cov", [](const StillSegment& self) { return to_matrix_array(self.gyroscope.cov); },
          "(3, 3), of a sample")
      .def_property_readonly(
          "accelerometer_mean", [](const StillSegment& self) { return to_array(self.accelerometer.mean); }, "(3,)")
      .def_property_readonly(
          "accelerometer_cov", [](const StillSegment& self) { return to_matrix_array(self.accelerometer.cov); },
          "(3, 3), of a sample");

  py::class_<Stillness>(m, "Stillness", "Still segments of a recording, and the noise they were found by.")
      .def_property_readonly(
          "segments", [](const Stillness& self) { return self.segments; }, "in order of time")
      .def_readonly("gyroscope", &Stillness::gyroscope)
      .def_readonly("accelerometer", &Stillness::accelerometer)
      .def_readonly("rate_hz", &Stillness::rate_hz, "one over the median period")
      .def_readonly("window_samples", &Stillness::window_samples)
      .def_readonly("samples", &Stillness::samples, "taken")
      .def_readonly("not_finite", &Stillness::not_finite, "rows left out")
      .def_readonly("out_of_order", &Stillness::out_of_order, "rows left out: not later than the one before")
      .def_readonly("gaps", &Stillness::gaps)
      .def_readonly("wandering_segments", &Stillness::wandering_segments, "cut or left out: vibrating, but moving")
      .def_readonly("turning_segments", &Stillness::turning_segments, "left out: turning evenly")
      .def_readonly("still_share", &Stillness::still_share, "of the samples taken")
      .def_readonly("quality", &Stillness::quality);

  m.def(
      "find_stillness",
      [](const TimeArray& times, const std::optional<FloatArray>& gyro, const std::optional<FloatArray>& accel,
         const StillnessOptions& options) {
        const auto t = times_view(times, "times_ns");
        const auto n = static_cast<py::ssize_t>(t.size());
        const Rows<3> g = optional_rows(gyro, "gyroscope", n);
        const Rows<3> a = optional_rows(accel, "accelerometer", n);
        const py::gil_scoped_release release;
        return loc::find_stillness(t, g, a, options);
      },
      py::arg("times_ns"), py::arg("gyroscope"), py::arg("accelerometer"),
      py::arg_v("options", StillnessOptions{}, "StillnessOptions()"),
      "Still segments of a recording of any unit: int64 (N,) times, float64 (N, 3) readings; one sensor may be None. "
      "Bad data do not raise: see Stillness.quality.");

  py::class_<loc::StillnessDetector>(m, "StillnessDetector", "The same rule sample by sample, half a window late.")
      .def(py::init([](const RestNoise& gyro, const RestNoise& accel, double rate_hz, int window_samples,
                       const StillnessOptions& options, const std::optional<ArrayLike>& bias) {
             const Eigen::Vector3d b =
                 bias ? vector3(*bias, "gyroscope_bias") : Eigen::Vector3d::Constant(loc::kUnknown).eval();
             return loc::StillnessDetector(gyro, accel, rate_hz, window_samples, options, b);
           }),
           py::arg("gyroscope"), py::arg("accelerometer"), py::arg("rate_hz"), py::arg("window_samples"),
           py::arg_v("options", StillnessOptions{}, "StillnessOptions()"), py::arg("gyroscope_bias") = py::none())
      .def(
          "update",
          [](loc::StillnessDetector& self, loc::TimeNs time_ns, const ArrayLike& gyro, const ArrayLike& accel) {
            return self.update(time_ns, vector3(gyro, "gyroscope"), vector3(accel, "accelerometer"));
          },
          py::arg("time_ns"), py::arg("gyroscope"), py::arg("accelerometer"), "True while the device is still.")
      .def_property_readonly("still", &loc::StillnessDetector::still)
      .def_property_readonly(
          "still_since_ns", [](const loc::StillnessDetector& self) { return optional_time(self.still_since_ns()); },
          "None in motion")
      .def_property_readonly("rejected", &loc::StillnessDetector::rejected);
}

void bind_accelerometer(py::module_& m) {
  const AccelerometerOptions d;
  py::class_<AccelerometerOptions>(m, "AccelerometerOptions", "Gravity, and where the verdicts change.")
      .def(py::init([](double gravity, double distinct_angle, int least_poses, int good_poses, double outlier_sigmas,
                       double ok_error, double fair_error, double warn_error) {
             const AccelerometerOptions options{.gravity = gravity,
                                                .distinct_angle = distinct_angle,
                                                .least_poses = least_poses,
                                                .good_poses = good_poses,
                                                .outlier_sigmas = outlier_sigmas,
                                                .ok_error = ok_error,
                                                .fair_error = fair_error,
                                                .warn_error = warn_error};
             options.check();
             return options;
           }),
           py::kw_only(), py::arg("gravity") = d.gravity, py::arg("distinct_angle") = d.distinct_angle,
           py::arg("least_poses") = d.least_poses, py::arg("good_poses") = d.good_poses,
           py::arg("outlier_sigmas") = d.outlier_sigmas, py::arg("ok_error") = d.ok_error,
           py::arg("fair_error") = d.fair_error, py::arg("warn_error") = d.warn_error,
           "ValueError names a field that is out of range.")
      .def_readonly("gravity", &AccelerometerOptions::gravity, "[m/s^2]")
      .def_readonly("distinct_angle", &AccelerometerOptions::distinct_angle, "[rad]; closer poses count once")
      .def_readonly("least_poses", &AccelerometerOptions::least_poses, "distinct ones; below: refused")
      .def_readonly("good_poses", &AccelerometerOptions::good_poses, "distinct ones; below: advice")
      .def_readonly("outlier_sigmas", &AccelerometerOptions::outlier_sigmas, "a pose further off is left out")
      .def_readonly("ok_error", &AccelerometerOptions::ok_error, "predicted error over gravity that is ok")
      .def_readonly("fair_error", &AccelerometerOptions::fair_error, "… fair")
      .def_readonly("warn_error", &AccelerometerOptions::warn_error, "… a warning; beyond: refused");

  using Poses = std::vector<loc::PoseFit>;
  py::class_<AccelerometerFit> fit(
      m, "AccelerometerFit",
      "corrected = triad.matrix @ (raw - triad.bias), of the length of gravity at rest. The "
      "matrix is symmetric: a rotation is not observable.");
  fit.def_readonly("solved", &AccelerometerFit::solved)
      .def_readonly("converged", &AccelerometerFit::converged)
      .def_readonly("triad", &AccelerometerFit::triad, "raw to [m/s^2]")
      .def_property_readonly(
          "residuals",
          [](const AccelerometerFit& self) {
            return column(self.poses, [](const Poses::value_type& p) { return p.residual; });
          },
          "(P,) length less gravity [m/s^2]")
      .def_property_readonly(
          "left_out",
          [](const AccelerometerFit& self) {
            return column(self.poses, [](const Poses::value_type& p) { return p.left_out; });
          },
          "(P,) the same from a fit without the pose")
      .def_property_readonly(
          "inlier",
          [](const AccelerometerFit& self) {
            return column(self.poses, [](const Poses::value_type& p) { return p.inlier; });
          },
          "(P,) bool: poses used")
      .def_property_readonly(
          "distinct",
          [](const AccelerometerFit& self) {
            return column(self.poses, [](const Poses::value_type& p) { return p.distinct; });
          },
          "(P,) bool: first of its direction")
      .def_readonly("inliers", &AccelerometerFit::inliers)
      .def_readonly("distinct_poses", &AccelerometerFit::distinct_poses)
      .def_readonly("pose_sigma", &AccelerometerFit::pose_sigma, "from pose to pose, beyond the samples' noise [m/s^2]")
      .def_readonly("residual_rms", &AccelerometerFit::residual_rms, "[m/s^2]")
      .def_readonly("leave_one_out_rms", &AccelerometerFit::leave_one_out_rms, "each predicted by the others [m/s^2]")
      .def_readonly("predicted_error", &AccelerometerFit::predicted_error, "of a corrected reading, over gravity")
      .def_readonly("quality", &AccelerometerFit::quality);
  matrix_getter(fit, "cov", &AccelerometerFit::cov, "(9, 9) of bias x, y, z and matrix xx, yy, zz, xy, xz, yz");

  m.def(
      "fit_accelerometer",
      [](const std::vector<StillSegment>& segments, const AccelerometerOptions& options) {
        return loc::fit_accelerometer(loc::accelerometer_poses(segments), options);
      },
      py::arg("segments"), py::arg_v("options", AccelerometerOptions{}, "AccelerometerOptions()"),
      "Nine parameters from the accelerometer's means in still segments. Bad data do not raise: see quality.");
  m.def(
      "fit_accelerometer_poses",
      [](const FloatArray& means, const std::optional<FloatArray>& sigmas, const AccelerometerOptions& options) {
        const Rows<3> rows = rows_view<3>(means, "means");
        std::vector<loc::StillPose> poses;
        for (Eigen::Index i = 0; i < rows.rows(); ++i) poses.push_back({.mean = rows.row(i)});
        if (sigmas) {
          const auto s = values_view(*sigmas, "sigmas");
          require_rows(static_cast<py::ssize_t>(s.size()), "sigmas", rows.rows(), "means");
          for (std::size_t i = 0; i < s.size(); ++i) {
            poses[i].mean_cov = s[i] * s[i] * Eigen::Matrix3d::Identity();
          }
        }
        return loc::fit_accelerometer(poses, options);
      },
      py::arg("means"), py::arg("sigmas") = py::none(),
      py::arg_v("options", AccelerometerOptions{}, "AccelerometerOptions()"),
      "The same from float64 (P, 3) means of still poses; sigmas (P,): deviation of each mean, raw units.");
}

void bind_gyroscope(py::module_& m) {
  const GyroscopeOptions d;
  py::class_<GyroscopeOptions>(m, "GyroscopeOptions", "Where the verdicts change.")
      .def(py::init([](double gap_periods, double outlier_chi2, double ok, double fair, double warn) {
             const GyroscopeOptions options{.gap_periods = gap_periods,
                                            .outlier_chi2 = outlier_chi2,
                                            .ok_sigma = ok,
                                            .fair_sigma = fair,
                                            .warn_sigma = warn};
             options.check();
             return options;
           }),
           py::kw_only(), py::arg("gap_periods") = d.gap_periods, py::arg("outlier_chi2") = d.outlier_chi2,
           py::arg("ok_sigma") = d.ok_sigma, py::arg("fair_sigma") = d.fair_sigma, py::arg("warn_sigma") = d.warn_sigma,
           "ValueError names a field that is out of range.")
      .def_readonly("gap_periods", &GyroscopeOptions::gap_periods, "a longer pause makes a turn unusable")
      .def_readonly("outlier_chi2", &GyroscopeOptions::outlier_chi2, "of a turn; beyond, it is left out")
      .def_readonly("ok_sigma", &GyroscopeOptions::ok_sigma, "predicted relative deviation of the matrix that is ok")
      .def_readonly("fair_sigma", &GyroscopeOptions::fair_sigma, "… fair")
      .def_readonly("warn_sigma", &GyroscopeOptions::warn_sigma, "… a warning; beyond: bias only");

  using Turns = std::vector<loc::GyroscopeTurn>;
  py::class_<GyroscopeFit> fit(m, "GyroscopeFit",
                               "angular velocity = triad.matrix @ (raw - triad.bias), in the accelerometer's axes.");
  fit.def_readonly("bias_known", &GyroscopeFit::bias_known)
      .def_readonly("matrix_known", &GyroscopeFit::matrix_known, "False: bias only, the matrix is the identity")
      .def_readonly("triad", &GyroscopeFit::triad, "raw to [rad/s]")
      .def_readonly("segments", &GyroscopeFit::segments, "still ones, that the bias is from")
      .def_readonly("relative_sigma", &GyroscopeFit::relative_sigma,
                    "largest deviation of the matrix in any direction, over its mean scale")
      .def_readonly("residual_rms", &GyroscopeFit::residual_rms, "[rad]")
      .def_readonly("chi2_ratio", &GyroscopeFit::chi2_ratio, "over the degrees of freedom")
      .def_readonly("rotation_angle", &GyroscopeFit::rotation_angle, "[rad] to the accelerometer's axes")
      .def_readonly("left_handed", &GyroscopeFit::left_handed)
      .def_readonly("converged", &GyroscopeFit::converged)
      .def_readonly("inliers", &GyroscopeFit::inliers, "turns used")
      .def_property_readonly(
          "turn_residuals",
          [](const GyroscopeFit& self) {
            return column(self.turns, [](const Turns::value_type& t) { return t.residual; });
          },
          "(T,) [rad]; NaN where the turn was not usable")
      .def_property_readonly(
          "turn_inlier",
          [](const GyroscopeFit& self) {
            return column(self.turns, [](const Turns::value_type& t) { return t.inlier; });
          },
          "(T,) bool")
      .def_property_readonly(
          "turn_gravity_angle",
          [](const GyroscopeFit& self) {
            return column(self.turns, [](const Turns::value_type& t) { return t.gravity_angle; });
          },
          "(T,) [rad] by which gravity turned")
      .def_readonly("quality", &GyroscopeFit::quality);
  vector_getter(fit, "bias_spread", &GyroscopeFit::bias_spread, "(3,) deviation over the segments, raw units");
  vector_getter(fit, "bias_range", &GyroscopeFit::bias_range, "(3,) largest less smallest, raw units");
  vector_getter(fit, "bias_slope", &GyroscopeFit::bias_slope, "(3,) raw units per second");
  matrix_getter(fit, "bias_cov", &GyroscopeFit::bias_cov, "(3, 3), raw units");
  matrix_getter(fit, "cov", &GyroscopeFit::cov, "(9, 9) of the matrix row by row");

  m.def(
      "fit_gyroscope",
      [](const TimeArray& times, const FloatArray& gyro, const std::vector<StillSegment>& segments,
         const AccelerometerFit& accelerometer, const GyroscopeOptions& options) {
        const auto t = times_view(times, "times_ns");
        const Rows<3> g = rows_view<3>(gyro, "gyroscope", static_cast<py::ssize_t>(t.size()), "times_ns");
        const py::gil_scoped_release release;
        return loc::fit_gyroscope(t, g, segments, accelerometer, options);
      },
      py::arg("times_ns"), py::arg("gyroscope"), py::arg("segments"), py::arg("accelerometer"),
      py::arg_v("options", GyroscopeOptions{}, "GyroscopeOptions()"),
      "Bias, scale and misalignment from the turns between the still segments of the same recording.");
  m.def(
      "fit_gyroscope_bias", [](const std::vector<StillSegment>& segments) { return loc::fit_gyroscope_bias(segments); },
      py::arg("segments"), "Bias alone.");
}

void bind_allan(py::module_& m) {
  const AllanOptions d;
  py::class_<AllanOptions>(m, "AllanOptions", "At which averaging times the Allan deviation is taken.")
      .def(py::init([](int points_per_octave, double longest_share) {
             const AllanOptions options{.points_per_octave = points_per_octave, .longest_share = longest_share};
             options.check();
             return options;
           }),
           py::kw_only(), py::arg("points_per_octave") = d.points_per_octave,
           py::arg("longest_share") = d.longest_share, "ValueError names a field that is out of range.")
      .def_readonly("points_per_octave", &AllanOptions::points_per_octave)
      .def_readonly("longest_share", &AllanOptions::longest_share, "longest averaging time over the recording");
  py::class_<AllanTerm>(m, "AllanTerm", "One term of the noise; value and sigma are NaN unless it was identified.")
      .def_readonly("identified", &AllanTerm::identified)
      .def_readonly("value", &AllanTerm::value)
      .def_readonly("sigma", &AllanTerm::sigma)
      .def_readonly("upper_bound", &AllanTerm::upper_bound)
      .def_readonly("tau_s", &AllanTerm::tau_s, "where its share is largest")
      .def_readonly("share", &AllanTerm::share, "of the fitted variance, there");
  const auto points = [](double loc::AllanPoint::*member) {
    return [member](const AllanFit& self) {
      return column(self.points, [member](const loc::AllanPoint& p) { return p.*member; });
    };
  };
  py::class_<AllanFit>(m, "AllanFit", "Overlapping Allan deviation of one axis and its terms.")
      .def_property_readonly("tau_s", points(&loc::AllanPoint::tau_s), "(K,) averaging times")
      .def_property_readonly("deviation", points(&loc::AllanPoint::deviation), "(K,)")
      .def_property_readonly("sigma", points(&loc::AllanPoint::sigma), "(K,) deviation of the deviation")
      .def_property_readonly("freedom", points(&loc::AllanPoint::freedom), "(K,) equivalent degrees of freedom")
      .def_readonly("noise_density", &AllanFit::noise_density, "N [unit/sqrt(Hz)]")
      .def_readonly("bias_instability", &AllanFit::bias_instability, "B [unit]")
      .def_readonly("random_walk", &AllanFit::random_walk, "K [unit/s/sqrt(Hz)]")
      .def_readonly("minimum_tau_s", &AllanFit::minimum_tau_s)
      .def_readonly("minimum_deviation", &AllanFit::minimum_deviation)
      .def_readonly("fitted_from_tau_s", &AllanFit::fitted_from_tau_s, "shorter ones: the sensor's own filter")
      .def_readonly("misfit", &AllanFit::misfit, "rms of the residuals in their own deviations")
      .def_readonly("rate_hz", &AllanFit::rate_hz)
      .def_readonly("duration_s", &AllanFit::duration_s)
      .def_readonly("quality", &AllanFit::quality);
  m.def(
      "allan_fit",
      [](const FloatArray& values, double rate_hz, const AllanOptions& options) {
        const auto v = values_view(values, "values");
        const py::gil_scoped_release release;
        return loc::allan_fit(v, rate_hz, options);
      },
      py::arg("values"), py::arg("rate_hz"), py::arg_v("options", AllanOptions{}, "AllanOptions()"),
      "float64 (N,) at a constant rate, the sensor at rest. DataError names a value that is not finite.");

  py::class_<ImuAllan>(m, "ImuAllan", "Allan deviation of all axes, from the longest part without motion and gaps.")
      .def_property_readonly(
          "gyroscope",
          [](const ImuAllan& self) {
            return self.has_gyroscope ? std::vector<AllanFit>(self.gyroscope.begin(), self.gyroscope.end())
                                      : std::vector<AllanFit>();
          },
          "three fits, or none")
      .def_property_readonly(
          "accelerometer",
          [](const ImuAllan& self) {
            return self.has_accelerometer ? std::vector<AllanFit>(self.accelerometer.begin(), self.accelerometer.end())
                                          : std::vector<AllanFit>();
          },
          "three fits, or none")
      .def_readonly("begin", &ImuAllan::begin, "rows used")
      .def_readonly("end", &ImuAllan::end)
      .def_readonly("duration_s", &ImuAllan::duration_s)
      .def_readonly("used_share", &ImuAllan::used_share)
      .def_readonly("bridged", &ImuAllan::bridged, "samples that were lost or not finite, and interpolated")
      .def_readonly("quality", &ImuAllan::quality);
  m.def(
      "analyse_imu_noise",
      [](const TimeArray& times, const std::optional<FloatArray>& gyro, const std::optional<FloatArray>& accel,
         const AllanOptions& options, const StillnessOptions& stillness) {
        const auto t = times_view(times, "times_ns");
        const auto n = static_cast<py::ssize_t>(t.size());
        const Rows<3> g = optional_rows(gyro, "gyroscope", n);
        const Rows<3> a = optional_rows(accel, "accelerometer", n);
        const py::gil_scoped_release release;
        return loc::analyse_imu_noise(t, g, a, options, stillness);
      },
      py::arg("times_ns"), py::arg("gyroscope"), py::arg("accelerometer"),
      py::arg_v("options", AllanOptions{}, "AllanOptions()"),
      py::arg_v("stillness", StillnessOptions{}, "StillnessOptions()"),
      "int64 (N,); float64 (N, 3) [rad/s] and [m/s^2], one may be None. Bad data do not raise: see quality.");
  py::class_<loc::ImuNoiseFit>(m, "ImuNoiseFit", "Noise for the estimators, and where each field is from.")
      .def_readonly("noise", &loc::ImuNoiseFit::noise)
      .def_property_readonly(
          "measured", [](const loc::ImuNoiseFit& self) { return self.measured; },
          "names of the fields that the recording determines")
      .def_readonly("quality", &loc::ImuNoiseFit::quality);
  m.def("imu_noise_from", &loc::imu_noise_from, py::arg("allan"), py::arg_v("fallback", loc::ImuNoise{}, "ImuNoise()"),
        "What was not identified keeps the fallback's value, or the upper bound where that is lower.");
}

void bind_alignment_options(py::module_& m) {
  using Options = MagnetometerAlignmentOptions;
  const Options d;
  py::class_<Options>(m, "MagnetometerAlignmentOptions", "How the magnetometer is aligned, and where verdicts change.")
      .def(py::init([](double interval_s, double expected_dip, double norm_tolerance, double force_tolerance,
                       double gap_periods, double gyroscope_matrix_sigma, double field_sigma, double least_second_axis,
                       double ok, double fair, double warn) {
             const Options options{.interval_s = interval_s,
                                   .expected_dip = expected_dip,
                                   .norm_tolerance = norm_tolerance,
                                   .force_tolerance = force_tolerance,
                                   .gap_periods = gap_periods,
                                   .gyroscope_matrix_sigma = gyroscope_matrix_sigma,
                                   .field_sigma = field_sigma,
                                   .least_second_axis = least_second_axis,
                                   .ok_sigma = ok,
                                   .fair_sigma = fair,
                                   .warn_sigma = warn};
             options.check();
             return options;
           }),
           py::kw_only(), py::arg("interval_s") = d.interval_s, py::arg("expected_dip") = d.expected_dip,
           py::arg("norm_tolerance") = d.norm_tolerance, py::arg("force_tolerance") = d.force_tolerance,
           py::arg("gap_periods") = d.gap_periods, py::arg("gyroscope_matrix_sigma") = d.gyroscope_matrix_sigma,
           py::arg("field_sigma") = d.field_sigma, py::arg("least_second_axis") = d.least_second_axis,
           py::arg("ok_sigma") = d.ok_sigma, py::arg("fair_sigma") = d.fair_sigma, py::arg("warn_sigma") = d.warn_sigma,
           "ValueError names a field that is out of range.")
      .def_readonly("interval_s", &Options::interval_s, "over which the gyroscope carries the field")
      .def_readonly("expected_dip", &Options::expected_dip, "[rad] positive down; NaN: mirroring is not checked")
      .def_readonly("norm_tolerance", &Options::norm_tolerance, "of the field's length, relative")
      .def_readonly("force_tolerance", &Options::force_tolerance, "of the specific force taken as gravity, relative")
      .def_readonly("gap_periods", &Options::gap_periods, "a longer pause ends an interval")
      .def_readonly("gyroscope_matrix_sigma", &Options::gyroscope_matrix_sigma,
                    "of each entry of what is left of the gyroscope's scale and misalignment")
      .def_readonly("field_sigma", &Options::field_sigma,
                    "of each entry of what is left of the magnetometer's matrix and, over the field, of its centre")
      .def_readonly("least_second_axis", &Options::least_second_axis, "turning about a second axis over the first")
      .def_readonly("ok_sigma", &Options::ok_sigma, "[rad] predicted deviation that is ok")
      .def_readonly("fair_sigma", &Options::fair_sigma, "… fair")
      .def_readonly("warn_sigma", &Options::warn_sigma, "… a warning; beyond: refused");
}

void bind_magnetometer(py::module_& m) {
  bind_alignment_options(m);
  py::class_<MagnetometerAlignment> a(m, "MagnetometerAlignment", "field in body axes = matrix @ magnetometer");
  matrix_getter(a, "matrix", &MagnetometerAlignment::matrix, "(3, 3), orthonormal; determinant -1 when mirrored");
  matrix_getter(a, "cov", &MagnetometerAlignment::cov, "(3, 3) [rad^2] of a rotation on the right");
  vector_getter(a, "gyroscope_bias", &MagnetometerAlignment::gyroscope_bias, "(3,) [rad/s] still in the readings");
  a.def_readonly("solved", &MagnetometerAlignment::solved)
      .def_readonly("mirror_checked", &MagnetometerAlignment::mirror_checked)
      .def_readonly("mirrored", &MagnetometerAlignment::mirrored)
      .def_readonly("sigma", &MagnetometerAlignment::sigma, "[rad] largest deviation of the rotation")
      .def_readonly("angle", &MagnetometerAlignment::angle, "[rad] of the rotation")
      .def_readonly("permuted", &MagnetometerAlignment::permuted)
      .def_readonly("axes", &MagnetometerAlignment::axes, "magnetometer axis nearest to each body axis")
      .def_readonly("delay_s", &MagnetometerAlignment::delay_s, "readings are of so much before their time stamp")
      .def_readonly("delay_sigma_s", &MagnetometerAlignment::delay_sigma_s)
      .def_readonly("dip", &MagnetometerAlignment::dip, "[rad] positive down; NaN without gravity")
      .def_readonly("dip_sigma", &MagnetometerAlignment::dip_sigma, "[rad]")
      .def_readonly("dip_scatter", &MagnetometerAlignment::dip_scatter, "[rad] of single readings")
      .def_readonly("residual_rms", &MagnetometerAlignment::residual_rms, "[rad]")
      .def_readonly("second_axis_share", &MagnetometerAlignment::second_axis_share)
      .def_readonly("intervals", &MagnetometerAlignment::intervals)
      .def_readonly("inliers", &MagnetometerAlignment::inliers)
      .def_readonly("gravity_readings", &MagnetometerAlignment::gravity_readings)
      .def_readonly("not_finite", &MagnetometerAlignment::not_finite)
      .def_readonly("repeated", &MagnetometerAlignment::repeated)
      .def_readonly("too_fast", &MagnetometerAlignment::too_fast)
      .def_readonly("disturbed", &MagnetometerAlignment::disturbed)
      .def_readonly("quality", &MagnetometerAlignment::quality);
  m.def(
      "align_magnetometer",
      [](const TimeArray& times, const FloatArray& gyro, const std::optional<FloatArray>& accel, const FloatArray& mag,
         const MagnetometerAlignmentOptions& options) {
        const auto t = times_view(times, "times_ns");
        const auto n = static_cast<py::ssize_t>(t.size());
        const Rows<3> g = rows_view<3>(gyro, "gyroscope", n, "times_ns");
        const Rows<3> acc = optional_rows(accel, "accelerometer", n);
        const Rows<3> field = rows_view<3>(mag, "magnetometer", n, "times_ns");
        const py::gil_scoped_release release;
        return loc::align_magnetometer(t, g, acc, field, options);
      },
      py::arg("times_ns"), py::arg("gyroscope"), py::arg("accelerometer"), py::arg("magnetometer"),
      py::arg_v("options", MagnetometerAlignmentOptions{}, "MagnetometerAlignmentOptions()"),
      "Rotation from a calibrated magnetometer (any unit) to the IMU: int64 (N,), float64 (N, 3) [rad/s], [m/s^2] or "
      "None. A slower magnetometer repeats its reading or is NaN in between. Bad data do not raise: see quality.");
  m.def("aligned", &loc::aligned, py::arg("magnetometer"), py::arg("alignment"),
        "The magnetometer's TriadCalibration followed by the alignment, for the rig.");
}

}  // namespace

void bind_calib_inertial(py::module_& m) {
  bind_stillness(m);
  bind_accelerometer(m);
  bind_gyroscope(m);
  bind_allan(m);
  bind_magnetometer(m);
}

}  // namespace locpy
