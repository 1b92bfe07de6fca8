// loc-driver: a recording onto LCM, as if it happened now, or a GPS receiver or a camera as it happens. Built without
// OpenCV and MRPT as loc-driver, with OpenCV as loc-driver-images (0.27 s and 73 MB to start, not 0.03 s and 15 MB),
// with MRPT as loc-driver-rawlog; the first becomes one of the others when the source needs it.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cmath>
#include <system_error>

#include "libloc/io/image_list.hpp"
#include "tools/support/channels.hpp"
#include "tools/support/child_process.hpp"
#include "tools/support/driver.hpp"
#include "tools/support/gps_options.hpp"
#include "tools/support/image_options.hpp"
#include "tools/support/log.hpp"
#include "tools/support/open_source.hpp"
#include "tools/support/program.hpp"
#include "tools/support/rig_option.hpp"
#include "tools/support/time_base.hpp"
#ifdef LOC_HAVE_VISION
#include "tools/support/open_image_source.hpp"
#endif
#ifdef LOC_HAVE_RAWLOG
#include "libloc/io/rawlog.hpp"
#endif

namespace {

// An estimator's queue holds four pictures: no more may be on their way, at 200 IMU samples a second and 50 pictures.

#if defined(LOC_HAVE_VISION)
std::unique_ptr<loc::MeasurementSource> open(const loc::SourceSpec& source, char** /*argv*/) {
  return loc::open_source_with_images(source);
}
#elif defined(LOC_HAVE_RAWLOG)
std::unique_ptr<loc::MeasurementSource> open(const loc::SourceSpec& source, char** /*argv*/) {
  return source.kind == loc::kRawlog ? loc::open_rawlog(source.path) : loc::open_source(source);
}
#else
// Opens, or becomes the program that can.
std::unique_ptr<loc::MeasurementSource> open(const loc::SourceSpec& source, char** argv) {
  const bool rawlog = source.kind == loc::kRawlog;
  if (!rawlog && !loc::needs_vision(source)) return loc::open_source(source);
  const std::string program = loc::own_folder() + (rawlog ? "/loc-driver-rawlog" : "/loc-driver-images");
  ::execv(program.c_str(), argv);
  const int number = errno;
  if (number != ENOENT) throw std::runtime_error(program + ": " + std::generic_category().message(number));
  throw loc::UsageError(std::string(rawlog ? "rawlogs need MRPT" : "pictures need OpenCV") +
                        ", and libloc was built without it (Debian: libopencv-videoio-dev libturbojpeg0-dev" +
                        (rawlog ? " libmrpt-obs-dev)" : ")"));
}
#endif

// "max" or a positive number; 0 stands for max.
double parse_speed(const std::string& text) {
  if (text == "max") return 0;
  double speed = 0;
  if (!CLI::detail::lexical_cast(text, speed) || !std::isfinite(speed) || speed <= 0) {
    throw loc::UsageError("--speed '" + text + "': must be a positive number or max");
  }
  return speed;
}

void add_sources(CLI::App& app, loc::SourceSpec& spec) {
  const auto add = [&](const char* kind, const char* argument, const char* text) {
    CLI::App* source = app.add_subcommand(kind, text);
    source->add_option(argument, spec.path)->required();
    source->fallthrough();
    source->callback([&spec, kind] { spec.kind = kind; });
    return source;
  };
  loc::add_image_options(*add("euroc", "DIR", "EuRoC / ASL recording: IMU, magnetometer, reference; pictures"), spec);
  add("lcm-log", "FILE", "LCM log: types of package loc and of ASPN-23");
  CLI::App* eqvio = add("eqvio", "FILE", "Tracks and IMU in one file, as GTSAM's EqVIO example reads them");
  eqvio->add_option("--sigma-px", spec.eqvio.sigma_px,
                    "Deviation of a feature's coordinate, which the file does not say");
  add("broad", "FILE", "Trial of the BROAD benchmark (*.mat)");
  CLI::App* csv = add("csv", "FILE", "Comma-separated samples, names and units in the first line");
  csv->add_option("--time-unit", spec.csv.time_unit, "ns, us, ms, s; where the heading has none");
  csv->add_option("--angular-velocity-unit", spec.csv.angular_velocity_unit, "rad/s or deg/s; likewise");
  csv->add_option("--specific-force-unit", spec.csv.specific_force_unit, "m/s^2, g, mg; likewise");
  csv->add_option("--magnetic-field-unit", spec.csv.magnetic_field_unit, "T, mT, uT, nT, gauss, mgauss, arb; likewise");
  csv->add_option("--tesla-per-unit", spec.csv.tesla_per_unit, "What one arb is");
  add(loc::kRawlog, "FILE", "Rawlog of MRPT: IMU, magnetometer, pictures, GPS");
  loc::add_gps_sources(app, spec);
  loc::add_image_sources(app, spec);
  app.require_subcommand(1);
}

}  // namespace

int main(int argc, char** argv) {
  loc::DriverOptions options;
  loc::SourceSpec source;
  std::string speed = "1";
  std::string config;
  std::vector<std::string> channels;
  double wait_for_estimator = 0;
  loc::TimeBaseWiring time_base;
  loc::Program program("loc-driver",
                       "Publishes a recording on LCM, paced by its time stamps, or a GPS receiver or a camera live.");
  CLI::App& app = program.app();
  options.lcm_url.clear();
  program.add_lcm_url(options.lcm_url);
  program.add_config(config)->description("Calibration (rig.yaml): checked here, applied by the estimator");
  add_sources(app, source);
  app.add_option("--speed", speed, "1 as recorded, N times as fast, or max: as fast as the estimator takes it")
      ->capture_default_str();
  app.add_option("--start", options.start_s, "Leave out the first seconds of the recording")->capture_default_str();
  app.add_option("--duration", options.duration_s,
                 "Seconds of the recording to play, or of a receiver to listen to; 0: all")
      ->capture_default_str();
  CLI::Option* wait = app.add_option("--wait-for-estimator", wait_for_estimator,
                                     "Seconds to wait for an estimator before the first sample");
  app.add_option("--window", options.window, "With --speed max: IMU samples on their way at a time")
      ->capture_default_str();
  app.add_option("--answer-timeout", options.answer_timeout_s,
                 "With --speed max: seconds of silence after which the estimator counts as gone")
      ->capture_default_str();
  app.add_option("--reconnect-timeout", options.reconnect_timeout_s, "Seconds without hub after which it gives up")
      ->capture_default_str();
  loc::add_channel_option(app, channels);
  time_base.add_options(app);
  app.add_flag("--statistics", options.statistics, "Log and publish counters once per second");

  return program.run(argc, argv, [&] {
    options.speed = parse_speed(speed);
    options.channels = loc::parse_channels(channels);
    source.decode.channels = {};
    options.source_name = source.kind + " " + source.path;
    if (wait->count() > 0) options.wait_for_estimator_s = wait_for_estimator;
    if (!config.empty()) {
      const loc::Rig rig = loc::load_rig(config);
      // Its pixels are those of a camera: of the user's, where there is one.
      if (!rig.cameras.empty()) source.eqvio.camera = rig.cameras.front();
    }
    options.live = loc::is_live(source.kind);
    // Before a device is touched.
    options.check();
    time_base.check(source.kind);
    if (loc::is_receiver(source.kind)) source.gps.check();
    // The source is made first and waits in the driver's run() only.
    loc::Driver* running = nullptr;
    source.gps.on_idle = [&running] {
      if (running != nullptr) running->idle();
    };
    std::string early_trouble;
    source.gps.on_trouble = [&](const std::string& text) {
      early_trouble = text;
      if (running != nullptr) running->set_trouble(text);
    };
    source.gps.on_time_event = [&time_base](const loc::GpsTimeEvent& event) { time_base.take(event); };
    if (source.kind == "euroc" && !source.images.wanted && !loc::euroc_cameras(source.path).empty()) {
      loc::log_info("event=pictures_left_out cameras={} hint=\"--images publishes them\"",
                    loc::euroc_cameras(source.path).size());
    }
    loc::Driver driver(options, time_base.wrap(open(source, argv), options.lcm_url, source.kind));
    running = &driver;
    if (!early_trouble.empty()) driver.set_trouble(early_trouble);
    loc::log_info("event=started source=\"{}\" speed={} url={}", options.source_name, speed, options.lcm_url);
    try {
      driver.run();
    } catch (...) {
      loc::log_error("event=not_completed {}", loc::format_counts(driver.counts()));
      throw;
    }
    loc::log_info("event=ended interrupted={} {}", loc::stop_requested(), loc::format_counts(driver.counts()));
    return loc::kExitOk;
  });
}
