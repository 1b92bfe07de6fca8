// loc-view3d: shows what an estimator sees and says, in three dimensions: live over LCM or from logs; in a window, or
// as PNG without a display.

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "libloc/core/check.hpp"
#include "libloc/io/lcm_log.hpp"
#include "libloc/vision/image_file.hpp"
#include "loc/estimate_t.hpp"
#include "loc/fusion_t.hpp"
#include "loc/gps_fix_t.hpp"
#include "loc/image_t.hpp"
#include "loc/imu_t.hpp"
#include "loc/map_points_t.hpp"
#include "loc/reference_t.hpp"
#include "loc/slam_frame_t.hpp"
#include "msgs/wire.hpp"
#include "tools/support/channels.hpp"
#include "tools/support/lcm_link.hpp"
#include "tools/support/log.hpp"
#include "tools/support/pacer.hpp"
#include "tools/support/program.hpp"
#include "tools/support/rig_option.hpp"
#include "tools/support/scene3d_drawing.hpp"
#include "tools/support/scene3d_recorder.hpp"
#include "tools/support/stamp_guard.hpp"
#include "tools/support/statistics.hpp"
#ifdef LOC_HAVE_MRPT_GUI
#include "tools/support/scene3d_window.hpp"
#endif

namespace {

constexpr int kReceivePollMs = 50;

struct Arguments {
  std::vector<std::string> logs;
  std::string lcm_url;
  std::string config;
  std::vector<std::string> channels;
  loc::SceneRecorderOptions recorder;
  std::string view = "free";
  loc::SceneView eye;
  std::string size = "1280x800";
  int width_px = 0;
  int height_px = 0;
  double at_s = 0;
  bool at_given = false;
  std::string png;
  double png_every_s = 0;
  std::string png_folder;
  std::string scene;
  double speed = 1;
  double rate_hz = 10;
  double duration_s = 0;

  bool window() const { return png.empty() && png_folder.empty() && scene.empty(); }
};

// Time of measurement of a message; kNoTime where it has none that is shown.
loc::TimeNs measured_ns(const loc::LcmLogEvent& event) {
  static const std::set<std::int64_t> kStamped = {
      loc::image_t::getHash(),  loc::estimate_t::getHash(), loc::slam_frame_t::getHash(), loc::map_points_t::getHash(),
      loc::fusion_t::getHash(), loc::imu_t::getHash(),      loc::gps_fix_t::getHash(),    loc::reference_t::getHash()};
  constexpr std::size_t kUpToTime = 16;  // these types begin with it
  if (event.data.size() < kUpToTime || !kStamped.contains(loc::wire::fingerprint(event.data))) return loc::kNoTime;
  return loc::wire::fingerprint(event.data.subspan(8));
}

// Messages of several logs in the order of measurement: each log in its own order, of those that come next in the logs
// the one that was measured first. What has no such time goes with what was before it in its log, as does a message
// whose stamp is far off.
class Logs {
 public:
  explicit Logs(const std::vector<std::string>& paths) {
    for (const std::string& path : paths) {
      logs_.push_back({path, loc::LcmLogReader(path), nullptr, {}});
      // Only two stamps that agree tell where a log begins: the first one may be damaged.
      loc::LcmLogReader ahead(path);
      for (const auto* event = ahead.next(); event != nullptr && !logs_.back().guard.confirmed();
           event = ahead.next()) {
        see(logs_.back().guard, *event);
      }
      advance(logs_.back());
    }
  }
  /// nullptr at the end; valid until the next call.
  const loc::LcmLogEvent* next() {
    if (last_ != nullptr) advance(*last_);
    last_ = nullptr;
    for (Log& log : logs_) {
      if (log.head != nullptr && (last_ == nullptr || log.guard.newest_ns() < last_->guard.newest_ns())) last_ = &log;
    }
    return last_ == nullptr ? nullptr : last_->head;
  }
  /// Of the message that came last; kNoTime when none in its log has a time so far.
  loc::TimeNs time_ns() const { return last_ == nullptr ? loc::kNoTime : last_->guard.newest_ns(); }
  void report_damage() const {
    for (const Log& log : logs_) {
      const loc::LcmLogDamage& damage = log.reader.damage();
      if (damage.gaps == 0 && !damage.truncated_at) continue;
      loc::log_warning("event=damaged source=\"{}\" gaps={} skipped_bytes={} truncated_bytes={}", log.path, damage.gaps,
                       damage.skipped_bytes, damage.truncated_bytes);
    }
  }

 private:
  struct Log {
    std::string path;
    loc::LcmLogReader reader;
    const loc::LcmLogEvent* head;
    loc::StampGuard guard;
  };
  static void see(loc::StampGuard& guard, const loc::LcmLogEvent& event) {
    if (const loc::TimeNs time_ns = measured_ns(event); time_ns != loc::kNoTime) guard.judge(time_ns);
  }
  static void advance(Log& log) {
    log.head = log.reader.next();
    if (log.head != nullptr) see(log.guard, *log.head);
  }
  std::vector<Log> logs_;
  Log* last_ = nullptr;
};

// Draws what the recorder holds, to where the user wants it.
class Output {
 public:
  explicit Output(const Arguments& arguments) : arguments_(arguments) {
    if (arguments_.window()) {
#ifdef LOC_HAVE_MRPT_GUI
      window_ = std::make_unique<loc::SceneWindow>("loc-view3d", arguments_.width_px, arguments_.height_px);
#else
      throw loc::UsageError(
          "a window needs MRPT's, and loc-view3d was built without it (Debian: libmrpt-gui-dev); "
          "without a window: --png, --png-every, --scene");
#endif
    }
    if (!arguments_.png_folder.empty()) std::filesystem::create_directories(arguments_.png_folder);
  }
  bool open() const {
#ifdef LOC_HAVE_MRPT_GUI
    return window_ == nullptr || window_->open();
#else
    return true;
#endif
  }
  /// A new state of the window.
  void show(const loc::Scene3d& scene) {
#ifdef LOC_HAVE_MRPT_GUI
    const loc::TimeNs start = loc::steady_now();
    if (window_ != nullptr) window_->show(scene, arguments_.eye);
    spent_.add(loc::steady_now() - start);
#else
    (void)scene;
#endif
  }
  /// One picture of --png-every, named by its time.
  void write_numbered(const loc::Scene3d& scene, double time_s) {
    draw(scene);
    const auto name = fmt::format("scene-{:010.3f}", time_s);
    // Time may come to the same place again, when a source begins anew.
    const int before = numbered_[name]++;
    const auto ending = before == 0 ? std::string(".png") : fmt::format("-{}.png", before + 1);
    write(scene, std::filesystem::path(arguments_.png_folder) / (name + ending));
  }
  void write_last(const loc::Scene3d& scene) {
    if (!arguments_.png.empty()) write(scene, arguments_.png);
    if (arguments_.scene.empty()) return;
    draw(scene);
    drawing_.save(arguments_.scene);
    loc::log_info("event=written file=\"{}\"", arguments_.scene);
  }
  const loc::LatencyHistogram& spent() const {
    return spent_;
  }
  std::int64_t pictures() const {
    return pictures_;
  }

 private:
  void draw(const loc::Scene3d& scene) {
    const double aspect = static_cast<double>(arguments_.width_px) / arguments_.height_px;
    drawing_.show(scene, loc::place_eye(scene, arguments_.eye, aspect), arguments_.width_px, arguments_.height_px);
  }
  void write(const loc::Scene3d& scene, const std::filesystem::path& path) {
    const loc::TimeNs start = loc::steady_now();
    draw(scene);
    if (!camera_) camera_ = std::make_unique<loc::SceneCamera3d>(arguments_.width_px, arguments_.height_px);
    const loc::ImageMeasurement picture = camera_->take(drawing_);
    spent_.add(loc::steady_now() - start);
    loc::write_image(path, picture);
    ++pictures_;
    loc::log_info("event=written file=\"{}\"", path.string());
  }

  const Arguments& arguments_;
  loc::SceneDrawing drawing_;
  std::unique_ptr<loc::SceneCamera3d> camera_;
#ifdef LOC_HAVE_MRPT_GUI
  std::unique_ptr<loc::SceneWindow> window_;
#endif
  loc::LatencyHistogram spent_;
  std::int64_t pictures_ = 0;
  std::map<std::string, int> numbered_;
};

// --png-every: due times, counted in measurement time from the first estimate. Where time steps back they begin anew
// from there: one stamp that is ahead must not be waited for.
class Numbered {
 public:
  explicit Numbered(double every_s) : every_ns_(loc::from_seconds(every_s)) {}
  bool due(const loc::SceneRecorder& recorder) {
    if (every_ns_ == 0 || recorder.time_ns() == loc::kNoTime) return false;
    const loc::TimeNs since = loc::time_between(recorder.first_time_ns(), recorder.time_ns());
    const bool due = since >= next_ns_;
    const bool back = since < newest_ns_ || recorder.first_time_ns() != first_ns_;
    first_ns_ = recorder.first_time_ns();
    newest_ns_ = since;
    if (due || back) next_ns_ = (std::max<loc::TimeNs>(since, 0) / every_ns_ + 1) * every_ns_;
    return due;
  }

 private:
  loc::TimeNs every_ns_;
  loc::TimeNs next_ns_ = 0;
  loc::TimeNs newest_ns_ = 0;
  loc::TimeNs first_ns_ = loc::kNoTime;
};

double seconds_of(const loc::SceneRecorder& recorder) {
  return loc::to_seconds(loc::time_between(recorder.first_time_ns(), recorder.time_ns()));
}

int finish(const loc::SceneRecorder& recorder, Output& output, const std::string& source) {
  for (const loc::NamedCount& count : recorder.counts()) {
    if (count.value > 0 &&
        (count.name.starts_with("undecodable:") || count.name.find("skipped") != std::string::npos)) {
      loc::log_warning("event=skipped source=\"{}\" {}={}", source, count.name, count.value);
    } else if (count.value > 0 && count.name.starts_with("time.")) {
      loc::log_warning("event=time_unsteady source=\"{}\" {}={}", source, count.name, count.value);
    }
  }
  if (recorder.time_ns() == loc::kNoTime) {
    loc::log_error("event=nothing_to_show source=\"{}\" reason=\"no estimate and no frame of SLAM came\" {}", source,
                   loc::format_counts(recorder.counts()));
    return loc::kExitFailed;
  }
  output.write_last(recorder.scene());
  loc::log_info("event=ended source=\"{}\" time_s={:.3f} pictures={} {} {}", source, seconds_of(recorder),
                output.pictures(), loc::format_counts(recorder.counts()),
                loc::format_latency("drawing", output.spent()));
  return loc::kExitOk;
}

int show_logs(const Arguments& arguments) {
  Logs logs(arguments.logs);
  Output output(arguments);
  loc::SceneRecorder recorder(arguments.recorder);
  Numbered numbered(arguments.png_every_s);
  loc::Pacer pacer(arguments.window() ? arguments.speed : 0);
  const loc::TimeNs redraw_ns = loc::from_seconds(1 / arguments.rate_hz);
  loc::TimeNs next_redraw_ns = 0;
  bool interrupted = false;
  while (const loc::LcmLogEvent* event = logs.next()) {
    if (loc::stop_requested() || !output.open()) {
      interrupted = true;
      break;
    }
    if (logs.time_ns() != loc::kNoTime) loc::sleep_for(pacer.wait_ns(logs.time_ns(), loc::steady_now()));
    recorder.take(event->channel, event->data, event->log_time_us * 1000);
    if (arguments.at_given && recorder.time_ns() != loc::kNoTime && seconds_of(recorder) >= arguments.at_s) break;
    if (numbered.due(recorder)) output.write_numbered(recorder.scene(), seconds_of(recorder));
    if (!arguments.window() || arguments.speed == 0 || loc::steady_now() < next_redraw_ns) continue;
    output.show(recorder.scene());
    next_redraw_ns = loc::steady_now() + redraw_ns;
  }
  logs.report_damage();
  const std::string source = fmt::format("{}", fmt::join(arguments.logs, " "));
  if (interrupted && !arguments.window()) {
    loc::log_error("event=interrupted source=\"{}\" effect=\"not all was drawn\"", source);
    return loc::kExitFailed;
  }
  if (arguments.at_given && recorder.time_ns() != loc::kNoTime && seconds_of(recorder) < arguments.at_s) {
    loc::log_error("event=failed source=\"{}\" reason=\"--at {}: it ends at {:.3f} s\"", source, arguments.at_s,
                   seconds_of(recorder));
    return loc::kExitFailed;
  }
  if (arguments.window() && !interrupted && recorder.time_ns() != loc::kNoTime) {
    output.show(recorder.scene());
    while (output.open() && loc::sleep_for(redraw_ns)) {  // until the user has seen enough
    }
  }
  return finish(recorder, output, source);
}

int show_live(const Arguments& arguments) {
  loc::SceneRecorder recorder(arguments.recorder);
  std::mutex mutex;
  std::atomic<bool> stop = false;
  loc::LcmReceiver receiver(arguments.lcm_url);
  for (const std::string& channel : recorder.channels()) {
    receiver.subscribe(channel, [&](std::string_view name, std::span<const std::uint8_t> data) {
      const std::scoped_lock lock(mutex);
      recorder.take(name, data, loc::host_now());
    });
  }
  Output output(arguments);
  loc::log_info("event=started url={}", arguments.lcm_url);
  std::thread receive([&] {
    while (!stop) receiver.handle(kReceivePollMs);
  });
  const auto scene_now = [&] {
    const std::scoped_lock lock(mutex);
    return recorder.scene();
  };
  const loc::TimeNs end_ns =
      arguments.duration_s > 0 ? loc::steady_now() + loc::from_seconds(arguments.duration_s) : loc::kNoTime;
  Numbered numbered(arguments.png_every_s);
  int code = loc::kExitOk;
  try {
    while (output.open() && loc::sleep_for(loc::from_seconds(1 / arguments.rate_hz))) {
      if (end_ns != loc::kNoTime && loc::steady_now() >= end_ns) break;
      bool due = false;
      double time_s = 0;
      {
        const std::scoped_lock lock(mutex);
        due = numbered.due(recorder);
        if (due) time_s = seconds_of(recorder);
      }
      if (due) output.write_numbered(scene_now(), time_s);
      if (arguments.window()) output.show(scene_now());
    }
  } catch (...) {
    stop = true;
    receive.join();
    throw;
  }
  stop = true;
  receive.join();
  code = finish(recorder, output, arguments.lcm_url);
  return code;
}

void parse_size(Arguments& arguments) {
  const auto cross = arguments.size.find('x');
  const bool ok = cross != std::string::npos &&
                  CLI::detail::lexical_cast(arguments.size.substr(0, cross), arguments.width_px) &&
                  CLI::detail::lexical_cast(arguments.size.substr(cross + 1), arguments.height_px);
  if (!ok || arguments.width_px < 64 || arguments.width_px > 8192 || arguments.height_px < 64 ||
      arguments.height_px > 8192) {
    throw loc::UsageError("--size '" + arguments.size + "': must be WIDTHxHEIGHT, 64 to 8192 each");
  }
}

// Wrong endings and folders that are not there, before hours of a log are read.
void check_files(const Arguments& arguments) {
  for (const std::string& path : {arguments.png, arguments.scene}) {
    if (path.empty()) continue;
    const auto folder = std::filesystem::path(path).parent_path();
    if (!folder.empty() && !std::filesystem::is_directory(folder)) {
      throw loc::UsageError(path + ": there is no folder " + folder.string());
    }
  }
  if (!arguments.png.empty() && std::filesystem::path(arguments.png).extension() != ".png") {
    throw loc::UsageError("--png " + arguments.png + ": must end in .png");
  }
  if (!arguments.scene.empty() && std::filesystem::path(arguments.scene).extension() != ".3Dscene") {
    throw loc::UsageError("--scene " + arguments.scene + ": must end in .3Dscene");
  }
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  loc::Program program("loc-view3d",
                       "Shows trajectory, pose, map and picture of an estimator in three dimensions: live over LCM, or "
                       "from logs; in a window, or as PNG without a display.");
  CLI::App& app = program.app();
  program.add_lcm_url(arguments.lcm_url);
  app.add_option(
      "LOG", arguments.logs,
      "LCM logs, shown together in the order of measurement (estimates in one, pictures in the other), whenever "
      "they were logged; none: live");
  program.add_config(arguments.config)->description("Calibration (rig.yaml): the shape of the camera's frustum");
  loc::add_channel_option(app, arguments.channels);
  app.add_option("--estimate-channel", arguments.recorder.estimate_channel, "Channel of the estimates")
      ->capture_default_str();
  app.add_option("--camera", arguments.recorder.camera, "Index of the camera that is shown")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_option("--png", arguments.png, "Draws the end of the log (live: of the session) into this file, no window");
  CLI::Option* every =
      app.add_option("--png-every", arguments.png_every_s, "A picture every so many seconds, no window")
          ->check(CLI::Range(0.001, 1e6));
  CLI::Option* folder = app.add_option("--png-folder", arguments.png_folder, "Folder of those pictures");
  every->needs(folder);
  folder->needs(every);
  app.add_option("--scene", arguments.scene, "Saves the end for MRPT's SceneViewer3D (*.3Dscene), no window");
  CLI::Option* at = app.add_option("--at", arguments.at_s, "Logs: ends so many seconds after the first estimate")
                        ->check(CLI::NonNegativeNumber);
  app.add_option("--view", arguments.view, "free (all of the trajectory), top (from above), follow (the camera)")
      ->check(CLI::IsMember({"free", "top", "follow"}))
      ->capture_default_str();
  app.add_option("--azimuth", arguments.eye.azimuth_deg, "free: where the eye is, 0 is along x, 90 along y [deg]")
      ->capture_default_str();
  app.add_option("--elevation", arguments.eye.elevation_deg, "free: of the eye above the horizon [deg]")
      ->capture_default_str();
  app.add_option("--zoom", arguments.eye.zoom, "2: from half as far")->capture_default_str();
  app.add_option("--size", arguments.size, "Of window and pictures [px]")->capture_default_str();
  app.add_option("--speed", arguments.speed, "Window: pace of a log, 1 as recorded, 0 the end at once")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  app.add_option("--rate", arguments.rate_hz, "Window: drawn so often in a second")
      ->check(CLI::Range(0.1, 100.0))
      ->capture_default_str();
  app.add_option("--duration", arguments.duration_s, "Live: ends after so many seconds")->check(CLI::Range(0.1, 1e7));

  return program.run(argc, argv, [&] {
    parse_size(arguments);
    check_files(arguments);
    arguments.at_given = at->count() > 0;
    if (arguments.at_given && arguments.logs.empty()) throw loc::UsageError("--at: for logs only");
    if (arguments.duration_s > 0 && !arguments.logs.empty()) throw loc::UsageError("--duration: for live only");
    arguments.eye.mode = arguments.view == "top"      ? loc::ViewMode::kTop
                         : arguments.view == "follow" ? loc::ViewMode::kFollow
                                                      : loc::ViewMode::kFree;
    arguments.eye.check();
    arguments.recorder.decode.channels = loc::parse_channels(arguments.channels);
    const loc::Rig rig = loc::load_rig(arguments.config);
    const auto camera = static_cast<std::size_t>(arguments.recorder.camera);
    if (camera < rig.cameras.size()) {
      arguments.recorder.calibration = rig.cameras[camera];
    } else if (!arguments.config.empty()) {
      throw loc::UsageError("--camera " + std::to_string(camera) + ": the rig has " +
                            std::to_string(rig.cameras.size()) + " cameras");
    } else {
      loc::log_info("event=no_calibration effect=\"the frustum has a usual shape, not the camera's\" option=--config");
    }
    return arguments.logs.empty() ? show_live(arguments) : show_logs(arguments);
  });
}
