// vision/feature_tracker and vision/image_slam: features and SLAM from pictures. Only where libloc is built with
// OpenCV.
#include <pybind11/native_enum.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "bindings.hpp"
#ifdef LOC_VISION
#include <array>
#include <atomic>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "columns.hpp"
#include "fields.hpp"
#include "images.hpp"
#include "libloc/vision/image_slam.hpp"
#include "recording.hpp"
#include "slam_results.hpp"
#endif

namespace locpy {

namespace py = pybind11;

#ifdef LOC_VISION
namespace {

using loc::CameraCalibration;
using loc::FeaturesMeasurement;
using loc::FeatureTracker;
using loc::FeatureTrackerOptions;
using loc::FeatureTrackerTimes;
using loc::ImageSlam;
using loc::InertialSlam;
using loc::Measurement;
using loc::MonoSlam;
using loc::SlamFrame;
using loc::SlamOptions;
using loc::TrackedFeature;
using loc::TrackOrigin;

/// What is known of the features of one picture, beside FeaturesMeasurement.
struct TrackArrays {
  py::array_t<std::int64_t> id;
  py::array_t<std::uint8_t> origin;
  py::array_t<double> correlation;
  py::array_t<std::int32_t> age;
};

TrackArrays arrays_of(const std::vector<TrackedFeature>& tracks) {
  return {.id = column<std::int64_t>(tracks, [](const auto& t) { return t.id; }),
          .origin = column<std::uint8_t>(tracks, [](const auto& t) { return static_cast<std::uint8_t>(t.origin); }),
          .correlation = column<double>(tracks, [](const auto& t) { return t.correlation; }),
          .age = column<std::int32_t>(tracks, [](const auto& t) { return t.age; })};
}

struct PredictionArrays {
  std::optional<loc::TimeNs> time_ns;
  bool valid = false;
  loc::Pose3 T_world_camera;
  py::array_t<std::int64_t> id;
  py::array_t<bool> visible;
  py::array_t<double> pixel_px, search_cov;
};

PredictionArrays arrays_of(const loc::SlamPrediction& p) {
  const auto& f = p.features;
  return {.time_ns = optional_time(p.time_ns),
          .valid = p.valid,
          .T_world_camera = p.T_world_camera,
          .id = column<std::int64_t>(f, [](const auto& x) { return x.id; }),
          .visible = column<bool>(f, [](const auto& x) { return x.visible; }),
          .pixel_px = rows<2>(f, [](const auto& x) { return x.pixel_px; }),
          .search_cov = matrices<2>(f, [](const auto& x) { return x.search_cov; })};
}

/// What the front end did in each picture.
class FrontEndColumns {
 public:
  void add(loc::TimeNs time_ns, const FeatureTracker& tracker, double picture_s);
  py::dict take();

 private:
  static constexpr std::array<const char*, 7> kCounts{"tracks",  "searched", "klt", "cut_anew",
                                                      "refound", "new",      "lost"};
  static constexpr std::array<const char*, 6> kTimes{"pyramid_s", "search_s",    "klt_s",
                                                     "detect_s",  "front_end_s", "picture_s"};
  std::vector<loc::TimeNs> time_ns_;
  std::array<std::vector<std::int64_t>, kCounts.size()> counts_;
  std::array<std::vector<double>, kTimes.size()> times_;
  std::int64_t lost_ = 0;  // up to the picture before
};

void FrontEndColumns::add(loc::TimeNs time_ns, const FeatureTracker& tracker, double picture_s) {
  std::array<std::int64_t, 5> by_origin{};
  for (const TrackedFeature& track : tracker.last()) ++by_origin.at(static_cast<std::size_t>(track.origin));
  const auto of = [&by_origin](TrackOrigin origin) { return by_origin.at(static_cast<std::size_t>(origin)); };
  std::int64_t lost = 0;
  for (const loc::NamedCount& count : tracker.counts()) {
    if (count.name == "tracks.lost") lost = count.value;
  }
  time_ns_.push_back(time_ns);
  const std::array<std::int64_t, kCounts.size()> counts{static_cast<std::int64_t>(tracker.last().size()),
                                                        of(TrackOrigin::kSearched),
                                                        of(TrackOrigin::kTracked),
                                                        of(TrackOrigin::kCutAnew),
                                                        of(TrackOrigin::kRefound),
                                                        of(TrackOrigin::kNew),
                                                        lost - lost_};
  lost_ = lost;
  const FeatureTrackerTimes& t = tracker.times();
  const std::array<double, kTimes.size()> times{t.pyramid_s, t.search_s, t.klt_s, t.detect_s, t.total_s, picture_s};
  for (std::size_t i = 0; i < counts.size(); ++i) counts_.at(i).push_back(counts.at(i));
  for (std::size_t i = 0; i < times.size(); ++i) times_.at(i).push_back(times.at(i));
}

py::dict FrontEndColumns::take() {
  py::dict out;
  out["time_ns"] = hand_over(std::move(time_ns_));
  for (std::size_t i = 0; i < kCounts.size(); ++i) out[kCounts.at(i)] = hand_over(std::move(counts_.at(i)));
  for (std::size_t i = 0; i < kTimes.size(); ++i) out[kTimes.at(i)] = hand_over(std::move(times_.at(i)));
  return out;
}

/// ImageSlam of the motion model that the options name, and what it said so far when that is to be kept.
class PyImageSlam {
 public:
  PyImageSlam(const SlamOptions& options, const FeatureTrackerOptions& front_end)
      : slam_(make(options, front_end)), camera_(options.camera_index) {}

  bool process(const Measurement& measurement);
  bool finish();
  void record(bool with_covariance, bool with_features);
  std::pair<SlamRun, py::dict> recorded(bool stopped);
  void reset() {
    const Working working(busy_);
    std::visit([](auto& slam) { slam.reset(); }, slam_);
    frames_.clear();
  }

  /// @throws std::runtime_error when a call works in another thread.
  template <class Function>
  auto ask(Function function) const {
    const Working working(busy_);
    return std::visit(function, slam_);
  }
  std::vector<SlamFrame> frames() const {
    const Working working(busy_);
    return frames_;
  }
  std::int32_t camera() const { return camera_; }

 private:
  using Either = std::variant<ImageSlam<MonoSlam>, ImageSlam<InertialSlam>>;

  class Working {
   public:
    explicit Working(std::atomic<bool>& flag) : flag_(flag) {
      if (flag_.exchange(true)) throw std::runtime_error("this estimator is running in another thread");
    }
    Working(const Working&) = delete;
    Working& operator=(const Working&) = delete;
    ~Working() { flag_ = false; }

   private:
    std::atomic<bool>& flag_;
  };

  static Either make(const SlamOptions& options, const FeatureTrackerOptions& front_end) {
    if (options.motion == loc::SlamMotion::kInertial) return ImageSlam<InertialSlam>(options, front_end);
    return ImageSlam<MonoSlam>(options, front_end);
  }

  template <class Function>
  auto visit(Function function) {
    return std::visit(function, slam_);
  }

  void take_frames(bool is_new);

  Either slam_;
  std::int32_t camera_;
  std::vector<SlamFrame> frames_;  // that the last call has completed
  bool recording_ = false;
  SlamColumns columns_;
  FrontEndColumns front_end_;
  mutable std::atomic<bool> busy_ = false;
};

bool PyImageSlam::process(const Measurement& measurement) {
  const Working working(busy_);
  const py::gil_scoped_release no_gil;
  frames_.clear();
  // Pictures of other cameras and tracks are not for it: what it says is of before.
  if (std::holds_alternative<FeaturesMeasurement>(measurement) ||
      (std::holds_alternative<loc::ImageMeasurement>(measurement) && loc::camera_of(measurement) != camera_)) {
    return false;
  }
  const auto begin = std::chrono::steady_clock::now();
  const bool is_new = visit([&](auto& slam) { return slam.process(measurement); });
  const double spent_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  take_frames(is_new);
  const auto* image = std::get_if<loc::ImageMeasurement>(&measurement);
  if (recording_ && image != nullptr && image->camera == camera_) {
    visit([&](auto& slam) { front_end_.add(image->time_ns, slam.tracker(), spent_s); });
  }
  return is_new;
}

bool PyImageSlam::finish() {
  const Working working(busy_);
  const py::gil_scoped_release no_gil;
  const bool is_new = visit([](auto& slam) { return slam.finish(); });
  take_frames(is_new && std::holds_alternative<ImageSlam<InertialSlam>>(slam_));
  return is_new;
}

void PyImageSlam::take_frames(bool is_new) {
  frames_.clear();
  if (const auto* mono = std::get_if<ImageSlam<MonoSlam>>(&slam_)) {
    if (is_new) frames_.push_back(mono->slam().frame());
  } else {
    const auto frames = std::get<ImageSlam<InertialSlam>>(slam_).slam().frames();
    frames_.assign(frames.begin(), frames.end());
  }
  if (!recording_) return;
  for (const SlamFrame& frame : frames_) columns_.add(frame, frame.estimate);
}

void PyImageSlam::record(bool with_covariance, bool with_features) {
  const Working working(busy_);
  recording_ = true;
  columns_ = {};
  columns_.with_covariance = with_covariance;
  columns_.with_features = with_features;
  front_end_ = {};
}

std::pair<SlamRun, py::dict> PyImageSlam::recorded(bool stopped) {
  const Working working(busy_);
  if (!recording_) throw std::runtime_error("nothing was recorded: call record() before the first picture");
  recording_ = false;
  SlamRun run = std::exchange(columns_, {}).take();
  run.stopped = stopped;
  visit([&](auto& slam) {
    run.map = locpy::arrays_of(slam.slam().map());
    run.totals = as_map(slam.counts());
    if (slam.slam().running()) run.snapshot = slam.slam().snapshot();
  });
  return {std::move(run), std::exchange(front_end_, {}).take()};
}

void bind_front_end(py::module_& m) {
  using O = FeatureTrackerOptions;
  py::class_<O>(m, "FeatureTrackerOptions",
                "Options of the front end (FeatureTracker); every field is a keyword of the constructor.")
      .def(py::init([](const py::kwargs& fields) { return with_fields<O>("FeatureTrackerOptions", fields); }),
           "TypeError for an unknown field, ValueError for a value out of range.")
      .def_readwrite("max_tracks", &O::max_tracks, "In one picture.")
      .def_readwrite("min_separation_px", &O::min_separation_px, "Of a new feature from the others [px].")
      .def_readwrite("fast_threshold", &O::fast_threshold, "Of the brightness, for a corner to be looked at.")
      .def_readwrite("min_corner", &O::min_corner, "Smaller eigenvalue of a corner [brightness^2/px^2].")
      .def_readwrite("klt_window_px", &O::klt_window_px, "Odd [px].")
      .def_readwrite("klt_levels", &O::klt_levels, "Of the pyramid, the picture itself included.")
      .def_readwrite("min_correlation", &O::min_correlation, "Of a patch with the picture, for a track to go on.")
      .def_readwrite("min_refind_correlation", &O::min_refind_correlation, "For one that was lost.")
      .def_readwrite("search_sigmas", &O::search_sigmas, "Size of the ellipse in which is searched.")
      .def_readwrite("direct_below_px", &O::direct_below_px,
                     "Larger deviation of the prediction: Lucas-Kanade first [px].")
      .def_readwrite("max_search_px", &O::max_search_px, "Larger deviation of the prediction: not searched for [px].")
      .def_readwrite("max_warp", &O::max_warp, "By which a patch may be stretched before it is cut anew.")
      .def_readwrite("drop_after_rejected", &O::drop_after_rejected, "Times in a row by the filter.")
      .def_readwrite("avoid_frames", &O::avoid_frames, "For so long no new track begins where something moved.")
      .def_readwrite("avoid_radius_px", &O::avoid_radius_px, "And so far around [px].")
      .def_readwrite("exposure_step", &O::exposure_step, "Relative change of the mean brightness that is taken out.")
      .def_readwrite("sigma_px", &O::sigma_px, "What the tracks say of themselves; NaN: nothing [px].")
      .def("check", &O::check, "ValueError names a field that is out of range.");
  py::native_enum<TrackOrigin>(m, "TrackOrigin", "enum.IntEnum", "How a feature was found in a picture.")
      .value("NEW", TrackOrigin::kNew, "a corner of this picture")
      .value("SEARCHED", TrackOrigin::kSearched, "where the filter expected it")
      .value("TRACKED", TrackOrigin::kTracked, "by Lucas-Kanade from the last picture")
      .value("CUT_ANEW", TrackOrigin::kCutAnew, "so, and it looks different by now")
      .value("REFOUND", TrackOrigin::kRefound, "was lost, and is back")
      .finalize();
  using A = TrackArrays;
  py::class_<A>(m, "TrackArrays", "How the features of one picture were found, a row each.")
      .def_readonly("id", &A::id, "(M,) int64")
      .def_readonly("origin", &A::origin, "(M,) uint8, TrackOrigin")
      .def_readonly("correlation", &A::correlation, "(M,); NaN for a new one")
      .def_readonly("age", &A::age, "(M,) int32, pictures in which it was seen before")
      .def("__len__", [](const A& self) { return self.id.size(); });
  using T = FeatureTrackerTimes;
  py::class_<T>(m, "FeatureTrackerTimes", "How long the front end took for one picture [s].")
      .def_readonly("pyramid_s", &T::pyramid_s)
      .def_readonly("search_s", &T::search_s)
      .def_readonly("klt_s", &T::klt_s)
      .def_readonly("detect_s", &T::detect_s)
      .def_readonly("total_s", &T::total_s);
  py::class_<FeatureTracker>(m, "FeatureTracker",
                             "From pictures to tracks: which feature is where in which picture. Alone, without a "
                             "filter that tells where to look; ImageSlam has one.")
      .def(py::init<const CameraCalibration&, const FeatureTrackerOptions&>(), py::arg("camera"),
           py::arg_v("options", FeatureTrackerOptions{}, "FeatureTrackerOptions()"),
           "ValueError names a field that is out of range.")
      .def(
          "track",
          [](FeatureTracker& self, const py::array& image, loc::TimeNs time_ns) {
            loc::ImageMeasurement picture = image_from(image);
            picture.time_ns = time_ns;
            return FeaturesMeasurement(self.track(picture));
          },
          py::arg("image"), py::arg("time_ns"),
          "image: uint8, (height, width) or (height, width, 3) with blue first. Gives its FeaturesMeasurement. "
          "ValueError for another size than the camera's.")
      .def(
          "learn", [](FeatureTracker& self, const SlamFrame& frame) { self.learn(frame); }, py::arg("frame"),
          "What became of the features: those that a filter rejects time and again are dropped.")
      .def_property_readonly(
          "last", [](const FeatureTracker& self) { return arrays_of(self.last()); },
          "TrackArrays of the last picture, in the order of its features.")
      .def_property_readonly("times", [](const FeatureTracker& self) { return self.times(); })
      .def(
          "counts", [](const FeatureTracker& self) { return as_map(self.counts()); }, "{name: number}")
      .def("reset", &FeatureTracker::reset, "Forgets all tracks; identities go on.")
      .def_property_readonly("options", [](const FeatureTracker& self) { return self.options(); });
}

void bind_prediction(py::module_& m) {
  using P = PredictionArrays;
  py::class_<P>(m, "SlamPredictionArrays", "Where the features of the map were expected in a picture, a row each.")
      .def_readonly("time_ns", &P::time_ns, "of the picture; None before the first")
      .def_readonly("valid", &P::valid, "False: nothing was expected; no rows")
      .def_readonly("T_world_camera", &P::T_world_camera)
      .def_readonly("id", &P::id, "(K,) int64")
      .def_readonly("visible", &P::visible, "(K,) bool: expected in the picture; otherwise the rest means nothing")
      .def_readonly("pixel_px", &P::pixel_px, "(K, 2)")
      .def_readonly("search_cov", &P::search_cov, "(K, 2, 2) of measured less expected [px^2]")
      .def("__len__", [](const P& self) { return self.id.size(); });
}

void bind_slam_of_images(py::module_& m) {
  using S = PyImageSlam;
  py::class_<S>(m, "ImageSlam",
                "SLAM from pictures: a front end (FeatureTracker) and the estimator that options.motion names "
                "(MonoSlam, InertialSlam), which tells it where to look. Start with slam_options_for_images().")
      .def(py::init<const SlamOptions&, const FeatureTrackerOptions&>(), py::arg("options"),
           py::arg_v("front_end", FeatureTrackerOptions{}, "FeatureTrackerOptions()"),
           "ValueError names a field that is out of range.")
      .def("process", &S::process, py::arg("measurement"),
           "The next measurement in time order: a picture that is decoded, or an IMU sample. Says whether estimate() "
           "is new.")
      .def(
          "process_image",
          [](S& self, loc::TimeNs time_ns, const py::array& image) {
            loc::ImageMeasurement picture = image_from(image);
            picture.time_ns = time_ns;
            picture.camera = self.camera();
            return self.process(picture);
          },
          py::arg("time_ns"), py::arg("image"),
          "A picture of the camera: uint8, (height, width) or (height, width, 3) with blue first. ValueError for "
          "another size than the camera's.")
      .def(
          "process_imu",
          [](S& self, loc::TimeNs time_ns, const ArrayLike& gyro, const ArrayLike& force) {
            loc::ImuMeasurement sample;
            sample.time_ns = time_ns;
            sample.angular_velocity = vector3(gyro, "gyro");
            sample.specific_force = vector3(force, "force");
            return self.process(sample);
          },
          py::arg("time_ns"), py::arg("gyro"), py::arg("force"),
          "A sample of the IMU: gyro (3,) [rad/s], force (3,) [m/s^2], at rest +9.81 upwards.")
      .def("finish", &S::finish, "The end of a recording: frames that wait for the IMU are taken.")
      .def("frames", &S::frames,
           "[SlamFrame]: those that the last call has completed; with an IMU a frame waits for the sample after it.")
      .def("estimate", [](const S& self) { return self.ask([](const auto& s) { return s.estimate(); }); })
      .def(
          "map", [](const S& self) { return self.ask([](const auto& s) { return locpy::arrays_of(s.slam().map()); }); },
          "SlamMapArrays")
      .def(
          "counts", [](const S& self) { return self.ask([](const auto& s) { return as_map(s.counts()); }); },
          "Of the estimator and the front end: what was used and what was skipped, and why.")
      .def("reset", &S::reset, "Forgets the past, not the options or the counts.")
      .def_property_readonly(
          "features", [](const S& self) { return self.ask([](const auto& s) { return s.features(); }); },
          "FeaturesMeasurement of the last picture.")
      .def_property_readonly(
          "tracks", [](const S& self) { return self.ask([](const auto& s) { return arrays_of(s.tracker().last()); }); },
          "TrackArrays beside features.")
      .def_property_readonly(
          "prediction", [](const S& self) { return self.ask([](const auto& s) { return arrays_of(s.prediction()); }); },
          "SlamPredictionArrays: by what the last picture was searched.")
      .def_property_readonly(
          "times", [](const S& self) { return self.ask([](const auto& s) { return s.tracker().times(); }); },
          "FeatureTrackerTimes of the last picture.")
      .def_property_readonly("running",
                             [](const S& self) { return self.ask([](const auto& s) { return s.slam().running(); }); })
      .def_property_readonly(
          "options",
          [](const S& self) { return self.ask([](const auto& s) { return SlamOptions(s.slam().options()); }); },
          "A copy.")
      .def("record", &S::record, py::arg("with_covariance") = true, py::arg("with_features") = false,
           "From now on every frame is kept for recorded().")
      .def("recorded", &S::recorded, py::arg("stopped") = false,
           "What was kept since record(), which ends: a SlamRun with a row for each frame, and {name: (P,)} with a row "
           "for each picture: time_ns; tracks, of these searched, klt, cut_anew, refound, new; lost since the picture "
           "before; pyramid_s, search_s, klt_s, detect_s, their sum front_end_s, and picture_s, which has besides what "
           "the filter did during the picture's call.");
  m.def("slam_options_for_images", &loc::slam_options_for_images, py::arg("options"),
        "A copy that suits tracks of FeatureTracker: sigma_px, map.max_linearity_index, second_order_noise.");
}

}  // namespace
#endif

void bind_image_slam([[maybe_unused]] py::module_& m) {
#ifdef LOC_VISION
  bind_front_end(m);
  bind_prediction(m);
  bind_slam_of_images(m);
#endif
}

}  // namespace locpy
