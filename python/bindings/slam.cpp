// estimators/mono_slam and inertial_slam: step by step, and a whole recording in one call.
#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/estimators/inertial_slam.hpp"
#include "libloc/estimators/mono_slam.hpp"
#include "recording.hpp"
#include "slam_results.hpp"

namespace locpy {
namespace {

using loc::FeaturesMeasurement;
using loc::InertialSlam;
using loc::MonoSlam;
using loc::SlamMapPoint;
using loc::SlamOptions;
using loc::SlamSnapshot;

/// Frames and IMU samples as they come in: views of NumPy arrays.
struct SlamInput {
  std::span<const loc::TimeNs> time_ns;
  std::span<const std::int64_t> first;
  std::span<const std::int64_t> id;
  const double* pixel_px = nullptr;
  std::optional<py::array_t<double>> cameras, sigmas;  // one, or one for each frame
  std::int32_t camera = 0;                             // without cameras
  std::span<const loc::TimeNs> imu_time_ns;
  const double* gyro = nullptr;
  const double* force = nullptr;

  void fill(std::size_t i, FeaturesMeasurement& out) const;
};

void SlamInput::fill(std::size_t i, FeaturesMeasurement& out) const {
  out.time_ns = time_ns[i];
  out.sequence = static_cast<std::int64_t>(i);
  const auto of_frame = [i](const py::array_t<double>& values) { return values.data()[values.size() == 1 ? 0 : i]; };
  out.camera = cameras ? static_cast<std::int32_t>(of_frame(*cameras)) : camera;
  out.sigma_px = sigmas ? of_frame(*sigmas) : loc::kUnknown;
  out.features.clear();
  for (auto k = static_cast<std::size_t>(first[i]); k < static_cast<std::size_t>(first[i + 1]); ++k) {
    out.features.push_back({id[k], Eigen::Vector2d(pixel_px[2 * k], pixel_px[2 * k + 1])});
  }
}

struct FrameArguments {
  TimeArray time_ns, first, id;
  FloatArray pixel_px;
  std::optional<ArrayLike> camera, sigma_px;
};
struct ImuArguments {
  std::optional<TimeArray> time_ns;
  std::optional<FloatArray> gyro, force;
};

SlamInput input_of(const FrameArguments& frames, const ImuArguments& imu, const SlamOptions& options) {
  SlamInput in;
  in.time_ns = times_view(frames.time_ns, "time_ns");
  in.first = times_view(frames.first, "first");
  in.id = times_view(frames.id, "id");
  const std::size_t n = in.time_ns.size();
  require_rows(static_cast<py::ssize_t>(in.first.size()) - 1, "first, less the last,", static_cast<py::ssize_t>(n),
               "time_ns");
  if (in.first.front() != 0 || in.first.back() != static_cast<std::int64_t>(in.id.size()) ||
      !std::is_sorted(in.first.begin(), in.first.end())) {
    throw py::value_error("first must ascend from 0 to the number of features, " + std::to_string(in.id.size()));
  }
  in.pixel_px = rows_view<2>(frames.pixel_px, "pixel_px", static_cast<py::ssize_t>(in.id.size()), "id").data();
  const auto one_or_many = [&](py::ssize_t size, const char* name) {
    if (size != 1 && size != static_cast<py::ssize_t>(n)) {
      throw py::value_error(std::string(name) + " must be one value, or one for each of the " + std::to_string(n) +
                            " frames; has " + std::to_string(size));
    }
  };
  in.camera = options.camera_index;
  if (frames.camera) {
    in.cameras = numbers(*frames.camera, "camera");
    one_or_many(in.cameras->size(), "camera");
    for (const double value : std::span(in.cameras->data(), static_cast<std::size_t>(in.cameras->size()))) {
      if (!(value >= 0 && value < 1e6 && value == std::floor(value))) {
        throw py::value_error("camera = " + py::repr(py::float_(value)).cast<std::string>() + ": must be an index");
      }
    }
  }
  if (frames.sigma_px) {
    in.sigmas = numbers(*frames.sigma_px, "sigma_px");
    one_or_many(in.sigmas->size(), "sigma_px");
  }
  if (imu.time_ns) {
    in.imu_time_ns = times_view(*imu.time_ns, "imu_time_ns");
    const auto samples = static_cast<py::ssize_t>(in.imu_time_ns.size());
    in.gyro = rows_view<3>(*imu.gyro, "gyro", samples, "imu_time_ns").data();
    in.force = rows_view<3>(*imu.force, "force", samples, "imu_time_ns").data();
  }
  return in;
}

/// Lets Ctrl-C through and tells how far it is, a few times in a second.
class Progress {
 public:
  Progress(std::optional<py::function> callback, std::size_t total)
      : callback_(std::move(callback)),
        total_(total),
        last_(std::chrono::steady_clock::now() - std::chrono::seconds(1)) {}

  /// Without the GIL. @returns false: stop. @throws py::error_already_set
  bool go_on(std::size_t done) {
    const auto now = std::chrono::steady_clock::now();
    if (done < total_ && now - last_ < std::chrono::milliseconds(100)) return true;
    last_ = now;
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!callback_) return true;
    const py::object answer = (*callback_)(done, total_);
    return !answer.is(py::bool_(false));
  }

 private:
  std::optional<py::function> callback_;
  std::size_t total_;
  std::chrono::steady_clock::time_point last_;
};

/// A frame waits for the IMU: one measurement may complete none or several.
template <class Slam>
constexpr bool kHasFrames = requires(const Slam& slam) {
  slam.frames();
};

/// An estimator, and a flag that is set while a call works without the GIL.
template <class Slam>
class PySlam {
 public:
  explicit PySlam(const SlamOptions& options) : slam_(options) {}

  Slam& idle() {
    if (busy_) throw std::runtime_error("this estimator is running in another thread");
    return slam_;
  }

  /// @param finish it is the end of the recording: frames that wait for the IMU are taken
  SlamRun run(const SlamInput& in, std::optional<py::function> callback, bool with_covariance, bool with_features,
              bool finish);

 private:
  void step(const loc::Measurement& measurement, SlamColumns& columns) {
    const bool has_estimate = slam_.process(measurement);
    if constexpr (kHasFrames<Slam>) {
      take_frames(columns);
    } else if (has_estimate) {
      columns.add(slam_.frame(), slam_.estimate());
    }
  }

  void take_frames(SlamColumns& columns) requires kHasFrames<Slam> {
    for (const loc::SlamFrame& frame : slam_.frames()) columns.add(frame, frame.estimate);
  }

  Slam slam_;
  std::atomic<bool> busy_ = false;
};

template <class Slam>
SlamRun PySlam<Slam>::run(const SlamInput& in, std::optional<py::function> callback, bool with_covariance,
                          bool with_features, bool finish) {
  Slam& slam = idle();
  SlamColumns columns;
  columns.with_covariance = with_covariance;
  columns.with_features = with_features;
  Progress progress(std::move(callback), in.time_ns.size());
  bool go_on = true;
  struct Busy {
    explicit Busy(std::atomic<bool>& f) : flag(f) { flag = true; }
    Busy(const Busy&) = delete;
    Busy& operator=(const Busy&) = delete;
    ~Busy() { flag = false; }
    std::atomic<bool>& flag;
  } const busy(busy_);
  std::vector<SlamMapPoint> map;
  {
    const py::gil_scoped_release no_gil;
    loc::Measurement imu = loc::ImuMeasurement{};
    loc::Measurement frame = FeaturesMeasurement{};
    std::size_t sample = 0;
    // What the IMU measured at the time of a frame comes before it.
    const auto feed_imu_until = [&](loc::TimeNs time) {
      auto& m = std::get<loc::ImuMeasurement>(imu);
      for (; sample < in.imu_time_ns.size() && in.imu_time_ns[sample] <= time; ++sample) {
        m.time_ns = in.imu_time_ns[sample];
        m.sequence = static_cast<std::int64_t>(sample);
        m.angular_velocity = Eigen::Map<const Eigen::Vector3d>(in.gyro + 3 * sample);
        m.specific_force = Eigen::Map<const Eigen::Vector3d>(in.force + 3 * sample);
        step(imu, columns);
      }
    };
    for (std::size_t i = 0; i < in.time_ns.size() && go_on; ++i) {
      feed_imu_until(in.time_ns[i]);
      in.fill(i, std::get<FeaturesMeasurement>(frame));
      step(frame, columns);
      go_on = progress.go_on(i + 1);
    }
    if (go_on) feed_imu_until(std::numeric_limits<loc::TimeNs>::max());
    if constexpr (kHasFrames<Slam>) {
      if (go_on && finish) {
        slam.finish();
        take_frames(columns);
      }
    }
    map = slam.map();
  }
  SlamRun out = columns.take();
  out.map = arrays_of(map);
  out.totals = as_map(slam.counts());
  if (slam.running()) out.snapshot = slam.snapshot();
  out.stopped = !go_on;
  return out;
}

constexpr const char* kRunDoc =
    "A whole recording in one call, without the GIL and without copies of the input; the same numbers as step by step, "
    "and the next call goes on from here.\n\n"
    "Frame i at time_ns[i] has the features first[i]:first[i + 1] of id (M,) and pixel_px (M, 2): the fields of "
    "Recording.features. sigma_px and camera: one, or one for each frame; by default those of the options. With an "
    "IMU: "
    "imu_time_ns int64 (S,), gyro (S, 3) [rad/s], force (S, 3) [m/s^2], at rest +9.81 upwards. "
    "progress(frames done, frames in all) is called a few times in a second; when it returns False the run ends, with "
    "what there is. KeyboardInterrupt leaves the estimator where it was then.";

template <class Slam>
py::class_<PySlam<Slam>> bind_estimator(py::module_& m, const char* name, const char* doc) {
  using P = PySlam<Slam>;
  py::class_<P> c(m, name, doc);
  c.def(py::init<const SlamOptions&>(), py::arg("options"), "ValueError names a field that is out of range.")
      .def(
          "process", [](P& self, const loc::Measurement& measurement) { return self.idle().process(measurement); },
          py::arg("measurement"), "The next measurement in time order; says whether estimate() is new.")
      .def(
          "process",
          [](P& self, loc::TimeNs time_ns, const TimeArray& id, const FloatArray& pixel, double sigma) {
            FeaturesMeasurement frame;
            frame.time_ns = time_ns;
            frame.camera = self.idle().options().camera_index;
            frame.sigma_px = sigma;
            const auto ids = times_view(id, "id");
            const auto n = static_cast<py::ssize_t>(ids.size());
            const Rows<2> pixels = rows_view<2>(pixel, "pixel_px", n, "id");
            for (py::ssize_t i = 0; i < n; ++i) {
              frame.features.push_back({ids[static_cast<std::size_t>(i)], pixels.row(i).transpose()});
            }
            return self.idle().process(frame);
          },
          py::arg("time_ns"), py::arg("id"), py::arg("pixel_px"), py::arg("sigma_px") = loc::kUnknown,
          "One frame: id int64 (M,), pixel_px (M, 2), deviation of one coordinate (NaN: that of the options).")
      .def("estimate", [](P& self) { return self.idle().estimate(); })
      .def(
          "map", [](P& self) { return arrays_of(self.idle().map()); }, "SlamMapArrays")
      .def(
          "counts", [](P& self) { return as_map(self.idle().counts()); },
          "What was used and what was skipped, and why: {name: number}.")
      .def(
          "reset", [](P& self) { self.idle().reset(); }, "Forgets the past, not the options or the counts.")
      .def("snapshot", [](P& self) { return self.idle().snapshot(); })
      .def(
          "restore", [](P& self, const SlamSnapshot& snapshot) { self.idle().restore(snapshot); }, py::arg("snapshot"),
          "Goes on from there: the next frame may come at any later time, or on another clock. ValueError when it does "
          "not fit the options.")
      .def_property_readonly("running", [](P& self) { return self.idle().running(); })
      .def_property_readonly(
          "options", [](P& self) { return self.idle().options(); }, "A copy.");
  if constexpr (kHasFrames<Slam>) {
    c.def(
        "frames",
        [](P& self) {
          const auto frames = self.idle().frames();
          return std::vector<loc::SlamFrame>(frames.begin(), frames.end());
        },
        "[SlamFrame]: those that the last process() or finish() has completed, usually none or one; at the start all "
        "that waited.");
    c.def(
        "finish", [](P& self) { return self.idle().finish(); },
        "The end of a recording: samples that are held back are used, and frames that wait for a sample after them, "
        "when they are nearer to the last sample than the next one would be. Says whether estimate() is new; frames() "
        "has the frames.");
  } else {
    c.def(
        "frame", [](P& self) { return self.idle().frame(); }, "SlamFrame: the last one that was used, a copy.");
  }
  return c;
}

}  // namespace

void bind_slam(py::module_& m) {
  bind_slam_results(m);
  bind_estimator<MonoSlam>(m, "MonoSlam",
                           "SLAM with one camera alone: tracks of features in, pose of the camera and map out, from "
                           "the first frame on. Not observable: the unit of lengths, unless landmarks are known; "
                           "place and heading of the world.")
      .def(
          "run",
          [](PySlam<MonoSlam>& self, const TimeArray& time_ns, const TimeArray& first, const TimeArray& id,
             const FloatArray& pixel_px, const std::optional<ArrayLike>& camera,
             const std::optional<ArrayLike>& sigma_px, std::optional<py::function> progress, bool with_covariance,
             bool with_features) {
            const SlamInput in = input_of({time_ns, first, id, pixel_px, camera, sigma_px}, {}, self.idle().options());
            return self.run(in, std::move(progress), with_covariance, with_features, false);
          },
          py::arg("time_ns"), py::arg("first"), py::arg("id"), py::arg("pixel_px"), py::kw_only(),
          py::arg("camera") = py::none(), py::arg("sigma_px") = py::none(), py::arg("progress") = py::none(),
          py::arg("with_covariance") = true, py::arg("with_features") = false, kRunDoc);
  bind_estimator<InertialSlam>(m, "InertialSlam",
                               "SLAM with one camera and an IMU: metres, and a world with z up. It starts from rest or "
                               "in motion; the first estimate comes late, for all frames. Not observable: place and "
                               "heading of the world.")
      .def(
          "run",
          [](PySlam<InertialSlam>& self, const TimeArray& time_ns, const TimeArray& first, const TimeArray& id,
             const FloatArray& pixel_px, const TimeArray& imu_time_ns, const FloatArray& gyro, const FloatArray& force,
             const std::optional<ArrayLike>& camera, const std::optional<ArrayLike>& sigma_px,
             std::optional<py::function> progress, bool with_covariance, bool with_features, bool finish) {
            const SlamInput in = input_of({time_ns, first, id, pixel_px, camera, sigma_px}, {imu_time_ns, gyro, force},
                                          self.idle().options());
            return self.run(in, std::move(progress), with_covariance, with_features, finish);
          },
          py::arg("time_ns"), py::arg("first"), py::arg("id"), py::arg("pixel_px"), py::arg("imu_time_ns"),
          py::arg("gyro"), py::arg("force"), py::kw_only(), py::arg("camera") = py::none(),
          py::arg("sigma_px") = py::none(), py::arg("progress") = py::none(), py::arg("with_covariance") = true,
          py::arg("with_features") = false, py::arg("finish") = false,
          (std::string(kRunDoc) + " finish: it is the end of the recording, see finish().").c_str());
}

}  // namespace locpy
