// sensors/: measurements, noise of an IMU, the rig.
#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/core/quality.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"
#include "properties.hpp"

namespace locpy {
namespace {

using loc::CameraCalibration;
using loc::ClockCalibration;
using loc::FeaturesMeasurement;
using loc::GpsCalibration;
using loc::GpsMeasurement;
using loc::ImageMeasurement;
using loc::ImuCalibration;
using loc::ImuMeasurement;
using loc::ImuNoise;
using loc::MagnetometerCalibration;
using loc::MagnetometerMeasurement;
using loc::OdometryMeasurement;
using loc::ReferenceMeasurement;
using loc::Rig;
using loc::Stamp;
using loc::TriadCalibration;
using loc::TriadQuality;

template <class Class, class T>
void vector4_property(Class& c, const char* name, Eigen::Vector4d T::*member, const char* doc) {
  c.def_property(
      name, [member](const T& self) { return to_array(self.*member); },
      [member, name](T& self, const ArrayLike& value) { self.*member = matrix(value, name, 4, 1); }, doc);
}

/// What every measurement has in common.
template <class T, class... Extra>
void stamp_properties(py::class_<T, Extra...>& c) {
  c.def_readwrite("time_ns", &T::time_ns, "Time of measurement [ns].")
      .def_property(
          "host_time_ns", [](const T& self) { return optional_time(self.host_time_ns); },
          [](T& self, std::optional<loc::TimeNs> time) { self.host_time_ns = time.value_or(loc::kNoTime); },
          "Arrival at the host [ns]; None when unknown.")
      .def_readwrite("sequence", &T::sequence, "Counts the samples of one stream from 0; -1 when unknown.")
      .def("__repr__", [](const py::object& self) {
        return py::str("{}(time_ns={})").format(py::type::of(self).attr("__name__"), self.attr("time_ns"));
      });
}

template <class T>
T stamped(loc::TimeNs time_ns) {
  T m{};
  m.time_ns = time_ns;
  return m;
}

void bind_measurements(py::module_& m) {
  py::class_<ImuMeasurement> imu(m, "ImuMeasurement", "One IMU sample, in the body frame.");
  imu.def(py::init([](loc::TimeNs time_ns, const ArrayLike& omega, const ArrayLike& force) {
            auto out = stamped<ImuMeasurement>(time_ns);
            out.angular_velocity = vector3(omega, "angular_velocity");
            out.specific_force = vector3(force, "specific_force");
            return out;
          }),
          py::arg("time_ns"), py::arg("angular_velocity"), py::arg("specific_force"));
  stamp_properties(imu);
  vector_property(imu, "angular_velocity", &ImuMeasurement::angular_velocity, "(3,) [rad/s]");
  vector_property(imu, "specific_force", &ImuMeasurement::specific_force, "(3,) [m/s^2], at rest +9.81 upwards");

  py::class_<MagnetometerMeasurement> magnetometer(m, "MagnetometerMeasurement",
                                                   "One magnetometer sample, in the body frame.");
  magnetometer.def(py::init([](loc::TimeNs time_ns, const ArrayLike& field) {
                     auto out = stamped<MagnetometerMeasurement>(time_ns);
                     out.magnetic_field = vector3(field, "magnetic_field");
                     return out;
                   }),
                   py::arg("time_ns"), py::arg("magnetic_field"));
  stamp_properties(magnetometer);
  vector_property(magnetometer, "magnetic_field", &MagnetometerMeasurement::magnetic_field, "(3,) [T]");

  py::class_<ReferenceMeasurement> reference(
      m, "ReferenceMeasurement", "Pose by a reference system, for evaluation. What it does not know is NaN.");
  reference.def(py::init([](loc::TimeNs time_ns, const ArrayLike& q, const ArrayLike& position,
                            const ArrayLike& velocity, bool score) {
                  auto out = stamped<ReferenceMeasurement>(time_ns);
                  const Eigen::Vector4d wxyz = matrix(q, "q_world_body_wxyz", 4, 1);
                  out.q_world_body = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
                  out.position = vector3(position, "position");
                  out.velocity = vector3(velocity, "velocity");
                  out.score = score;
                  return out;
                }),
                py::arg("time_ns"), py::arg("q_world_body_wxyz"), py::arg("position"), py::arg("velocity"),
                py::arg("score") = true);
  stamp_properties(reference);
  reference.def_property_readonly("q_world_body_wxyz",
                                  [](const ReferenceMeasurement& self) { return to_wxyz(self.q_world_body); });
  vector_property(reference, "position", &ReferenceMeasurement::position, "of body in world (3,) [m]");
  vector_property(reference, "velocity", &ReferenceMeasurement::velocity, "in world (3,) [m/s]");
  reference.def_readwrite("score", &ReferenceMeasurement::score, "False where the recording says: do not score here.");

  py::native_enum<loc::GpsFixType>(m, "GpsFixType", "enum.IntEnum", "Kind of a GPS fix.")
      .value("NONE", loc::GpsFixType::kNone)
      .value("TIME", loc::GpsFixType::kTime)
      .value("FIX_2D", loc::GpsFixType::k2d)
      .value("FIX_3D", loc::GpsFixType::k3d)
      .value("DIFFERENTIAL", loc::GpsFixType::kDifferential)
      .value("FLOAT", loc::GpsFixType::kFloat)
      .value("FIXED", loc::GpsFixType::kFixed)
      .finalize();
  py::class_<GpsMeasurement> gps(m, "GpsMeasurement", "One GPS fix. What the receiver did not say is NaN.");
  stamp_properties(gps);
  gps.def_readonly("fix", &GpsMeasurement::fix)
      .def_readonly("satellites", &GpsMeasurement::satellites, "used; -1 when unknown")
      .def_property_readonly(
          "gps_time_ns", [](const GpsMeasurement& self) { return optional_time(self.gps_time_ns); },
          "since 1980-01-06 without leap seconds; None when unknown")
      .def_readonly("latitude", &GpsMeasurement::latitude, "[rad], WGS 84")
      .def_readonly("longitude", &GpsMeasurement::longitude, "[rad]")
      .def_readonly("altitude", &GpsMeasurement::altitude, "[m] above the ellipsoid")
      .def_property_readonly(
          "position_cov", [](const GpsMeasurement& self) { return to_matrix_array(self.position_cov); },
          "(3, 3) [m^2], east, north, up")
      .def_property_readonly(
          "velocity_enu", [](const GpsMeasurement& self) { return to_array(self.velocity_enu); }, "(3,) [m/s]")
      .def_property_readonly(
          "velocity_cov", [](const GpsMeasurement& self) { return to_matrix_array(self.velocity_cov); },
          "(3, 3) [m^2/s^2]");

  py::class_<OdometryMeasurement> odometry(
      m, "OdometryMeasurement",
      "Pose by an odometry that knows no metre, in its own unit: length = scale * metres. What is not known is NaN.");
  odometry.def(py::init([](loc::TimeNs time_ns, const ArrayLike& position, const ArrayLike& q,
                           std::optional<loc::TimeNs> start_time_ns, const std::optional<ArrayLike>& position_cov,
                           const std::optional<ArrayLike>& orientation_cov) {
                 auto out = stamped<OdometryMeasurement>(time_ns);
                 out.position = vector3(position, "position");
                 const Eigen::Vector4d wxyz = matrix(q, "q_wxyz", 4, 1);
                 out.rotation = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
                 out.start_time_ns = start_time_ns.value_or(loc::kNoTime);
                 if (position_cov) out.position_cov = matrix(*position_cov, "position_cov", 3, 3);
                 if (orientation_cov) out.orientation_cov = matrix(*orientation_cov, "orientation_cov", 3, 3);
                 return out;
               }),
               py::arg("time_ns"), py::arg("position"), py::arg("q_wxyz"), py::kw_only(),
               py::arg("start_time_ns") = py::none(), py::arg("position_cov") = py::none(),
               py::arg("orientation_cov") = py::none());
  stamp_properties(odometry);
  odometry
      .def_property_readonly(
          "start_time_ns", [](const OdometryMeasurement& self) { return optional_time(self.start_time_ns); },
          "None: absolute, pose of body in world. Otherwise pose of body in the axes of body at this time.")
      .def_property_readonly("q_wxyz", [](const OdometryMeasurement& self) { return to_wxyz(self.rotation); });
  vector_property(odometry, "position", &OdometryMeasurement::position, "(3,) [odometry's unit]");
  matrix_property(odometry, "position_cov", &OdometryMeasurement::position_cov, "(3, 3) [unit^2], axes of position");
  matrix_property(odometry, "orientation_cov", &OdometryMeasurement::orientation_cov,
                  "(3, 3) [rad^2], axes of body at time_ns");

  py::class_<FeaturesMeasurement> features(m, "FeaturesMeasurement",
                                           "The features of one frame with their identities.");
  features.def(py::init([](loc::TimeNs time_ns, const TimeArray& id, const FloatArray& pixel, std::int32_t camera,
                           double sigma, std::int64_t sequence) {
                 auto out = stamped<FeaturesMeasurement>(time_ns);
                 const auto ids = times_view(id, "id");
                 const auto n = static_cast<py::ssize_t>(ids.size());
                 const Rows<2> pixels = rows_view<2>(pixel, "pixel_px", n, "id");
                 for (py::ssize_t i = 0; i < n; ++i) {
                   out.features.push_back({ids[static_cast<std::size_t>(i)], pixels.row(i).transpose()});
                 }
                 out.camera = camera;
                 out.sigma_px = sigma;
                 out.sequence = sequence;
                 return out;
               }),
               py::arg("time_ns"), py::arg("id"), py::arg("pixel_px"), py::kw_only(), py::arg("camera") = 0,
               py::arg("sigma_px") = loc::kUnknown, py::arg("sequence") = -1,
               "id int64 (M,), pixel_px (M, 2); sigma_px: deviation of one coordinate, NaN when unknown.");
  stamp_properties(features);
  features.def_readonly("camera", &FeaturesMeasurement::camera, "index of the camera in the rig")
      .def_readonly("sigma_px", &FeaturesMeasurement::sigma_px, "deviation of one coordinate; NaN when unknown")
      .def_property_readonly(
          "id",
          [](const FeaturesMeasurement& self) {
            py::array_t<std::int64_t> out(static_cast<py::ssize_t>(self.features.size()));
            for (std::size_t i = 0; i < self.features.size(); ++i) out.mutable_data()[i] = self.features[i].id;
            return out;
          },
          "(M,) int64, the same for the same point of the scene")
      .def_property_readonly(
          "pixel_px",
          [](const FeaturesMeasurement& self) {
            py::array_t<double> out({static_cast<py::ssize_t>(self.features.size()), py::ssize_t{2}});
            for (std::size_t i = 0; i < self.features.size(); ++i) {
              out.mutable_data()[2 * i] = self.features[i].pixel_px.x();
              out.mutable_data()[2 * i + 1] = self.features[i].pixel_px.y();
            }
            return out;
          },
          "(M, 2), u and v in the distorted image");

  py::class_<ImageMeasurement> image(m, "ImageMeasurement", "One picture, raw or JPEG.");
  stamp_properties(image);
  image.def_readonly("camera", &ImageMeasurement::camera, "index of the camera in the rig")
      .def_readonly("width_px", &ImageMeasurement::width_px)
      .def_readonly("height_px", &ImageMeasurement::height_px)
      .def_readonly("row_stride_bytes", &ImageMeasurement::row_stride_bytes, "0 for JPEG")
      .def_property_readonly(
          "fourcc",
          [](const ImageMeasurement& self) {
            const auto code = static_cast<std::uint32_t>(self.format);
            std::string text;
            for (unsigned shift = 0; shift < 32; shift += 8) text += static_cast<char>((code >> shift) & 0xffU);
            return text;
          },
          "\"GREY\", \"BGR3\", \"RGB3\" or \"MJPG\"")
      .def_readonly("exposure_ns", &ImageMeasurement::exposure_ns, "length of the exposure [ns]; 0 when unknown")
      .def_property_readonly(
          "data",
          [](const ImageMeasurement& self) {
            if (!self.data) return py::bytes();
            return py::bytes(reinterpret_cast<const char*>(self.data->data()), self.data->size());
          },
          "bytes of the picture");
}

void bind_noise(py::module_& m) {
  const ImuNoise d;
  py::class_<ImuNoise>(m, "ImuNoise", "Noise of an IMU as continuous densities.")
      .def(py::init([](double gn, double gw, double an, double aw, double gb, double ab) {
             const ImuNoise noise{gn, gw, an, aw, gb, ab};
             noise.check();
             return noise;
           }),
           py::kw_only(), py::arg("gyroscope_noise_density") = d.gyroscope_noise_density,
           py::arg("gyroscope_random_walk") = d.gyroscope_random_walk,
           py::arg("accelerometer_noise_density") = d.accelerometer_noise_density,
           py::arg("accelerometer_random_walk") = d.accelerometer_random_walk,
           py::arg("gyroscope_bias_sigma") = d.gyroscope_bias_sigma,
           py::arg("accelerometer_bias_sigma") = d.accelerometer_bias_sigma,
           "ValueError names a field that is negative or not finite.")
      .def_readwrite("gyroscope_noise_density", &ImuNoise::gyroscope_noise_density, "[rad/s/sqrt(Hz)], white")
      .def_readwrite("gyroscope_random_walk", &ImuNoise::gyroscope_random_walk, "[rad/s^2/sqrt(Hz)], of the bias")
      .def_readwrite("accelerometer_noise_density", &ImuNoise::accelerometer_noise_density, "[m/s^2/sqrt(Hz)], white")
      .def_readwrite("accelerometer_random_walk", &ImuNoise::accelerometer_random_walk, "[m/s^3/sqrt(Hz)], of the bias")
      .def_readwrite("gyroscope_bias_sigma", &ImuNoise::gyroscope_bias_sigma, "[rad/s], turn-on")
      .def_readwrite("accelerometer_bias_sigma", &ImuNoise::accelerometer_bias_sigma, "[m/s^2], turn-on")
      .def("check", &ImuNoise::check, "ValueError names a field that is out of range.");
  py::class_<loc::DiscreteImuNoise>(m, "DiscreteImuNoise", "Deviations of discrete samples.")
      .def_readonly("sigma_angular_velocity", &loc::DiscreteImuNoise::sigma_angular_velocity, "[rad/s]")
      .def_readonly("sigma_specific_force", &loc::DiscreteImuNoise::sigma_specific_force, "[m/s^2]")
      .def_readonly("sigma_gyroscope_bias_step", &loc::DiscreteImuNoise::sigma_gyroscope_bias_step, "[rad/s]")
      .def_readonly("sigma_accelerometer_bias_step", &loc::DiscreteImuNoise::sigma_accelerometer_bias_step, "[m/s^2]");
  m.def("discretise", &loc::discretise, py::arg("noise"), py::arg("dt_s"), "Deviations of samples dt_s [s] apart.");
}

void bind_quality(py::module_& m) {
  py::native_enum<loc::Verdict>(m, "Verdict", "enum.IntEnum",
                                "What a calibration says about itself, from best to worst. REFUSED: not to be used "
                                "unless the user insists.")
      .value("OK", loc::Verdict::kOk)
      .value("FAIR", loc::Verdict::kFair)
      .value("WARN", loc::Verdict::kWarn)
      .value("REFUSED", loc::Verdict::kRefused)
      .finalize();
  py::class_<loc::Quality>(m, "Quality", "Verdict of a calibration on itself, and why.")
      .def_readonly("verdict", &loc::Quality::verdict)
      .def_property_readonly(
          "reasons", [](const loc::Quality& self) { return self.reasons; },
          "complete sentences; empty when all is well")
      .def_property_readonly("usable", &loc::Quality::usable, "False when refused")
      .def("__repr__", [](const loc::Quality& self) {
        std::string text = std::string("Quality(") + loc::verdict_name(self.verdict);
        for (const std::string& reason : self.reasons) text += "; " + reason;
        return text + ")";
      });
  py::class_<TriadQuality> quality(m, "TriadQuality",
                                   "How a triad's calibration was found, and how far it may be trusted. A deviation "
                                   "that was not estimated is NaN.");
  quality.def(py::init<>())
      .def_readwrite("verdict", &TriadQuality::verdict)
      .def_readwrite("method", &TriadQuality::method, "\"robust\", \"still-poses\", ...")
      .def_readwrite("samples", &TriadQuality::samples, "readings (of still poses: poses) that were used")
      .def_readwrite("residual_rms", &TriadQuality::residual_rms, "of the norm, relative to the field's norm")
      .def_property(
          "reasons", [](const TriadQuality& self) { return self.reasons; },
          [](TriadQuality& self, std::vector<std::string> reasons) { self.reasons = std::move(reasons); },
          "Copies of the sentences, one line each: assign a list to change them.");
  vector_property(quality, "bias_sigma", &TriadQuality::bias_sigma, "deviation of the bias (3,), in its unit");
  matrix_property(quality, "matrix_sigma", &TriadQuality::matrix_sigma, "deviation of each entry (3, 3)");
}

void bind_intrinsics_quality(py::module_& m) {
  using loc::IntrinsicsQuality;
  py::class_<IntrinsicsQuality> quality(m, "IntrinsicsQuality",
                                        "How a camera's intrinsics were found, and how far they may be trusted. A "
                                        "deviation that is not known is NaN.");
  quality.def(py::init<>())
      .def_readwrite("verdict", &IntrinsicsQuality::verdict)
      .def_readwrite("method", &IntrinsicsQuality::method, "\"target\"")
      .def_readwrite("pictures", &IntrinsicsQuality::pictures, "that were used")
      .def_readwrite("reprojection_rms_px", &IntrinsicsQuality::reprojection_rms_px,
                     "of the distances between corners found and projected")
      .def_property(
          "reasons", [](const IntrinsicsQuality& self) { return self.reasons; },
          [](IntrinsicsQuality& self, std::vector<std::string> reasons) { self.reasons = std::move(reasons); },
          "Copies of the sentences, one line each: assign a list to change them.");
  vector4_property(quality, "intrinsics_sigma_px", &IntrinsicsQuality::intrinsics_sigma_px,
                   "(4,): deviations of fx, fy, cx, cy");
  vector4_property(quality, "distortion_sigma", &IntrinsicsQuality::distortion_sigma,
                   "(4,): of the distortion; 0 where the model has no such term");
}

void bind_mounting_quality(py::module_& m) {
  using loc::MountingQuality;
  py::class_<MountingQuality> quality(m, "MountingQuality",
                                      "How it was found where a camera sits on the IMU and by how much their clocks "
                                      "differ, and how far that may be trusted. What is not known is NaN.");
  quality.def(py::init<>())
      .def_readwrite("verdict", &MountingQuality::verdict)
      .def_readwrite("method", &MountingQuality::method, "\"camera-imu\"")
      .def_readwrite("pictures", &MountingQuality::pictures, "that were used")
      .def_readwrite("time_offset_sigma_s", &MountingQuality::time_offset_sigma_s, "deviation of time_offset_s [s]")
      .def_readwrite("line_delay_s", &MountingQuality::line_delay_s,
                     "a rolling shutter's time from one row to the next [s]; negative when it begins below")
      .def_readwrite("line_delay_sigma_s", &MountingQuality::line_delay_sigma_s, "its deviation [s]")
      .def_property(
          "reasons", [](const MountingQuality& self) { return self.reasons; },
          [](MountingQuality& self, std::vector<std::string> reasons) { self.reasons = std::move(reasons); },
          "Copies of the sentences, one line each: assign a list to change them.")
      .def(
          "set_deviations",
          [](MountingQuality& self, const loc::Pose3& T_body_camera, const ArrayLike& covariance) {
            self.set_deviations(T_body_camera, matrix(covariance, "covariance", 7, 7));
          },
          py::arg("T_body_camera"), py::arg("covariance"),
          "Sets the deviations from what a camera-IMU calibration finds. covariance (7, 7): of a small turn about the "
          "body's axes [rad] (R_camera_body Exp(turn)), of the translation of T_camera_body [m], of the time offset "
          "[s].");
  vector_property(quality, "rotation_sigma", &MountingQuality::rotation_sigma,
                  "(3,) [rad]: small turns of the camera about the body's axes");
  vector_property(quality, "translation_sigma", &MountingQuality::translation_sigma,
                  "(3,) [m]: of T_body_camera's translation, along the body's axes");
}

void bind_clock_calibration(py::module_& m) {
  py::class_<ClockCalibration>(m, "ClockCalibration",
                               "What is known of the clock that stamps a stream. A figure that is not known is NaN.")
      .def(py::init([](std::string stream, std::string reference) {
             ClockCalibration clock;
             clock.stream = std::move(stream);
             clock.reference = std::move(reference);
             return clock;
           }),
           py::arg("stream"), py::arg("reference") = "host")
      .def_readwrite("stream", &ClockCalibration::stream, "\"imu\", \"gps\", a camera's name, ...")
      .def_readwrite("reference", &ClockCalibration::reference, "the clock it was compared with: \"host\", \"gps\"")
      .def_readwrite("skew_ppm", &ClockCalibration::skew_ppm,
                     "seconds of the reference per second of the stream's clock, less 1 [1e-6]")
      .def_readwrite("skew_sigma_ppm", &ClockCalibration::skew_sigma_ppm)
      .def_readwrite("offset_sigma_s", &ClockCalibration::offset_sigma_s,
                     "deviation of a time that was put on the reference clock [s]")
      .def_readwrite("jitter_rms_s", &ClockCalibration::jitter_rms_s,
                     "of arrivals after the earliest possible (the lower envelope) [s]")
      .def_readwrite("jitter_p99_s", &ClockCalibration::jitter_p99_s, "99 % of arrivals are at most that late [s]")
      .def("check", &ClockCalibration::check, "ValueError names the stream and the field.");
}

void bind_calibrations(py::module_& m) {
  py::class_<TriadCalibration> triad(m, "TriadCalibration", "corrected = matrix @ (raw - bias)");
  triad.def(py::init<>());
  vector_property(triad, "bias", &TriadCalibration::bias, "(3,), in the sensor's unit");
  matrix_property(triad, "matrix", &TriadCalibration::matrix, "(3, 3): scale, misalignment, soft iron, rotation");
  triad.def_readwrite("quality", &TriadCalibration::quality, "How it was found; None when nobody has said.");

  py::class_<ImuCalibration>(m, "ImuCalibration", "Rate, noise, and how raw samples are corrected.")
      .def(py::init<>())
      .def_readwrite("rate_hz", &ImuCalibration::rate_hz, "nominal; 0 when unknown")
      .def_readwrite("noise", &ImuCalibration::noise)
      .def_property(
          "noise_measured", [](const ImuCalibration& self) { return self.noise_measured; },
          [](ImuCalibration& self, std::vector<std::string> names) { self.noise_measured = std::move(names); },
          "Copies of the names of the fields of noise that were measured; the others are guesses.")
      .def_readwrite("gyroscope", &ImuCalibration::gyroscope, "[rad/s]")
      .def_readwrite("accelerometer", &ImuCalibration::accelerometer, "[m/s^2]");
  py::class_<MagnetometerCalibration>(m, "MagnetometerCalibration",
                                      "How raw samples are corrected: hard and soft iron.")
      .def(py::init<>())
      .def_readwrite("triad", &MagnetometerCalibration::triad, "[T], result in body axes");
  py::class_<GpsCalibration> gps(m, "GpsCalibration", "Where the antenna is, and how late its fixes are stamped.");
  gps.def(py::init<>())
      .def_readwrite("time_offset_s", &GpsCalibration::time_offset_s, "t_imu = t_gps + time_offset_s")
      .def_readwrite("time_offset_sigma_s", &GpsCalibration::time_offset_sigma_s, "its deviation; NaN: not measured");
  vector_property(gps, "antenna_in_body", &GpsCalibration::antenna_in_body, "lever arm (3,) [m]");

  py::native_enum<loc::DistortionModel>(m, "DistortionModel", "enum.Enum", "What a lens does.")
      .value("NONE", loc::DistortionModel::kNone)
      .value("RADTAN", loc::DistortionModel::kRadtan)
      .value("EQUIDISTANT", loc::DistortionModel::kEquidistant)
      .finalize();
  py::class_<CameraCalibration> camera(m, "CameraCalibration", "Projection, pose and time offset of one camera.");
  camera.def(py::init<>())
      .def_readwrite("name", &CameraCalibration::name)
      .def_readwrite("width_px", &CameraCalibration::width_px)
      .def_readwrite("height_px", &CameraCalibration::height_px)
      .def_readwrite("distortion_model", &CameraCalibration::distortion_model)
      .def_readwrite("T_body_camera", &CameraCalibration::T_body_camera)
      .def_readwrite("time_offset_s", &CameraCalibration::time_offset_s, "t_imu = t_camera + time_offset_s")
      .def_readwrite("rate_hz", &CameraCalibration::rate_hz, "nominal; 0 when unknown");
  vector4_property(camera, "intrinsics_px", &CameraCalibration::intrinsics_px, "(4,): fx, fy, cx, cy");
  vector4_property(camera, "distortion", &CameraCalibration::distortion,
                   "(4,): k1 k2 p1 p2 (radtan) or k1..k4 (equidistant)");
  camera.def_readwrite("intrinsics_quality", &CameraCalibration::intrinsics_quality,
                       "How the intrinsics were found; None when nobody has said.");
  camera.def_readwrite("mounting_quality", &CameraCalibration::mounting_quality,
                       "How T_body_camera and time_offset_s were found; None when nobody has said.");
}

void bind_rig(py::module_& m) {
  py::class_<Rig>(m, "Rig", "The sensors of one device; the body frame is the IMU's. A sensor that is absent is None.")
      .def(py::init<>())
      .def_readwrite("imu", &Rig::imu)
      .def_readwrite("magnetometer", &Rig::magnetometer)
      .def_readwrite("gps", &Rig::gps)
      .def_property(
          "cameras", [](const Rig& self) { return self.cameras; },
          [](Rig& self, std::vector<CameraCalibration> cameras) { self.cameras = std::move(cameras); },
          "Copies of the cameras: assign a list to change them.")
      .def_property(
          "clocks", [](const Rig& self) { return self.clocks; },
          [](Rig& self, std::vector<ClockCalibration> clocks) { self.clocks = std::move(clocks); },
          "Copies of the clocks: assign a list to change them.")
      .def(
          "doubts",
          [](const Rig& self) {
            std::vector<std::tuple<std::string, loc::Verdict, std::string>> out;
            for (loc::RigDoubt& d : loc::doubts(self)) out.emplace_back(d.block, d.verdict, d.text);
            return out;
          },
          "(block, verdict, sentence) for each calibration that was refused and written all the same, or came with a "
          "warning.")
      .def("check", &Rig::check, "ValueError names a field that is out of range.")
      .def(
          "calibrated", [](const Rig& self, const loc::Measurement& raw) { return loc::calibrated(self, raw); },
          py::arg("measurement"), "The measurement as the calibration corrects it.");
}

}  // namespace

void bind_sensors(py::module_& m) {
  bind_noise(m);
  bind_measurements(m);
  bind_quality(m);
  bind_intrinsics_quality(m);
  bind_mounting_quality(m);
  bind_calibrations(m);
  bind_clock_calibration(m);
  bind_rig(m);
}

}  // namespace locpy
