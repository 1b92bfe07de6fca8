// loc-estimator: measurements in, estimates out; on LCM, or off line from a recording to a file, through the same code.
// Built without OpenCV as loc-estimator, with it as loc-estimator-images, which the first becomes when pictures are
// wanted.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <system_error>

#include "tools/support/any_estimator.hpp"
#include "tools/support/channels.hpp"
#include "tools/support/child_process.hpp"
#include "tools/support/estimate_output.hpp"
#include "tools/support/fusion_options.hpp"
#include "tools/support/held_back_output.hpp"
#include "tools/support/live_estimator.hpp"
#include "tools/support/log.hpp"
#include "tools/support/open_source.hpp"
#include "tools/support/pipeline.hpp"
#include "tools/support/program.hpp"
#include "tools/support/rig_option.hpp"
#include "tools/support/slam_options.hpp"
#ifdef LOC_HAVE_VISION
#include "tools/support/open_image_source.hpp"
#endif

namespace {

#ifdef LOC_HAVE_VISION
std::unique_ptr<loc::MeasurementSource> open(const loc::SourceSpec& source) {
  return loc::open_source_with_images(source);
}

void become_program_with_images(char** /*argv*/) {}

void set_front_end(loc::AnyEstimator& estimator, const loc::CameraCalibration& camera) {
  estimator.set_front_end(loc::make_picture_front_end(camera));
}
#else
std::unique_ptr<loc::MeasurementSource> open(const loc::SourceSpec& source) {
  return loc::open_source(source);
}

void become_program_with_images(char** argv) {
  const std::string program = loc::own_folder() + "/loc-estimator-images";
  ::execv(program.c_str(), argv);
  const int number = errno;
  if (number != ENOENT) throw std::runtime_error(program + ": " + std::generic_category().message(number));
  throw loc::UsageError(
      "--images needs OpenCV, and libloc was built without it (Debian: libopencv-videoio-dev libopencv-video-dev "
      "libopencv-calib3d-dev libturbojpeg0-dev)");
}

void set_front_end(loc::AnyEstimator& /*estimator*/, const loc::CameraCalibration& /*camera*/) {}
#endif

struct Arguments {
  loc::LiveEstimatorOptions live;
  std::vector<std::string> channels;
  std::string config;
  std::string method = "madgwick";
  std::string preset = "robust";
  std::string world = "ENU";
  double beta = 0;
  bool no_magnetometer = false;
  double reorder_delay_ms = 50;
  loc::FusionArguments fusion;
  loc::SlamArguments slam;
  std::string start = "auto";
  loc::SourceSpec input;
  std::string output;
  loc::GeoOutputOptions geo;
};

loc::SourceSpec input_of(const Arguments& arguments, const loc::Rig& rig) {
  loc::SourceSpec input = arguments.input;
  if (input.kind.empty()) input.kind = loc::guess_source_kind(input.path);
  input.decode.channels = arguments.live.channels;
  input.images.wanted = arguments.slam.images;
  // Pixels of a recording that has none are those of a camera: of the user's, where there is one.
  if (!rig.cameras.empty()) input.eqvio.camera = rig.cameras.front();
  return input;
}

loc::EstimatorSettings settings_of(const Arguments& arguments, const loc::Rig& rig, bool beta_given) {
  loc::EstimatorSettings settings;
  settings.method = arguments.method;
  settings.use_magnetometer = !arguments.no_magnetometer;
  if (arguments.method == "madgwick") {
    settings.madgwick = loc::MadgwickOptions::preset(arguments.preset);
    if (beta_given) settings.madgwick.beta = arguments.beta;
    settings.madgwick.world = loc::parse_world_frame(arguments.world);
    return settings;
  }
  if (loc::parse_world_frame(arguments.world) != loc::WorldFrame::kEnu) {
    throw loc::UsageError("--world " + arguments.world + ": " + arguments.method + " estimates in ENU only");
  }
  if (loc::is_slam(arguments.method)) {
    settings.slam = loc::slam_options(arguments.slam, arguments.method, rig);
    settings.slam_start = loc::slam_start(arguments.slam, settings.slam);
    const bool inertial = settings.slam.motion == loc::SlamMotion::kInertial;
    if (!arguments.fusion.no_gps) {
      settings.anchor = loc::anchor_options(arguments.fusion, inertial, rig);
      // Fixes do not wait for the other streams, which may be late by so much.
      settings.anchor->gps_max_ahead_s += arguments.reorder_delay_ms * 1e-3;
    }
    return settings;
  }
  settings.fusion = loc::fusion_options(arguments.fusion, arguments.preset, rig);
  if (arguments.start == "reference") {
    const auto source = open(input_of(arguments, rig));
    settings.fusion.given_start = loc::start_from_reference(*source, settings.fusion, arguments.preset);
  }
  return settings;
}

constexpr std::size_t kMostHeldBack = 30'000;  // estimates until GPS says where they are: two minutes and some

int run_offline(const Arguments& arguments, const loc::Rig& rig, loc::AnyEstimator estimator) {
  const loc::SourceSpec input = input_of(arguments, rig);
  loc::refuse_to_overwrite(input.path, arguments.output);
  const auto source = open(input);
  auto output = loc::open_estimate_output(arguments.output, estimator.method(), estimator.world(), arguments.geo);
  std::int64_t estimates = 0;
  loc::EstimatorPipeline pipeline(std::move(estimator), rig, arguments.live.merger, [&](const loc::Estimate& estimate) {
    ++estimates;
    output->write(estimate);
  });
  loc::Stamp last_frame;
  if (pipeline.estimator().anchor() != nullptr) {
    output = std::make_unique<loc::HeldBackOutput>(
        std::move(output), [&] { return pipeline.estimator().anchor(); }, kMostHeldBack);
  }
  pipeline.set_frame_sink([&](const loc::SlamFrame& frame) {
    output->write_frame(frame);
    last_frame = frame;
  });
  while (auto measurement = source->next()) {
    if (loc::stop_requested()) break;
    pipeline.push(std::move(*measurement));
  }
  pipeline.end();
  if (pipeline.estimator().slam() != nullptr) output->write_map(last_frame, pipeline.estimator().slam_map());
  output->finish();
  const bool map_written = loc::write_map(arguments.slam, pipeline.estimator().slam(), pipeline.estimator().anchor());
  loc::log_info("event=ended interrupted={} estimates={} output=\"{}\" source=\"{}\" {} {}", loc::stop_requested(),
                estimates, arguments.output, input.path, loc::format_counts(source->counts()),
                loc::format_counts(pipeline.counts()));
  for (const loc::NamedCount& count : source->counts()) {
    if (count.value > 0 && count.name.find("skipped") != std::string::npos) {
      loc::log_warning("event=skipped source=\"{}\" {}={}", input.path, count.name, count.value);
    }
  }
  for (const std::string& doubt : pipeline.unit_doubts()) {
    loc::log_warning("event=implausible_unit source=\"{}\" reason=\"{}\"", input.path, doubt);
  }
  if (estimates == 0) {
    loc::log_error("event=no_estimate source=\"{}\" reason=\"no sample could be used\"", input.path);
    return loc::kExitFailed;
  }
  return loc::stop_requested() || !map_written ? loc::kExitFailed : loc::kExitOk;
}

int run_live(const Arguments& arguments, const loc::Rig& rig, loc::AnyEstimator estimator) {
  loc::LiveEstimator live(arguments.live, std::move(estimator), rig);
  loc::log_info("event=started method={} preset={} world={} url={}", arguments.method, arguments.preset,
                arguments.world, arguments.live.lcm_url);
  live.run();
  for (const std::string& doubt : live.unit_doubts()) {
    loc::log_warning("event=implausible_unit reason=\"{}\"", doubt);
  }
  loc::log_info("event=ended {} {}", loc::format_counts(live.counts()), loc::format_latency("latency", live.latency()));
  return loc::write_map(arguments.slam, live.estimator().slam(), live.estimator().anchor()) ? loc::kExitOk
                                                                                            : loc::kExitFailed;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  loc::Program program("loc-estimator",
                       "Estimates orientation (madgwick), a whole trajectory (error-state: IMU with GPS, odometry, "
                       "magnetometer), or trajectory and map (mono-slam, inertial-slam: tracks of features) from the "
                       "measurements on LCM, or in a recording.");
  CLI::App& app = program.app();
  arguments.live.lcm_url.clear();
  program.add_lcm_url(arguments.live.lcm_url);
  program.add_config(arguments.config)->description("Calibration (rig.yaml) that is applied to the measurements");
  app.add_option("--method", arguments.method, "Estimator")
      ->check(CLI::IsMember(loc::estimator_methods()))
      ->capture_default_str();
  app.add_option("--preset", arguments.preset,
                 "robust (for real sensors); madgwick: report (the plain form); error-state: as_published, 16, 19 (the "
                 "visual-inertial example)")
      ->check(CLI::IsMember({"report", "robust", "as_published", "16", "19"}))
      ->capture_default_str();
  CLI::Option* beta = app.add_option("--beta", arguments.beta, "madgwick: gain [rad/s] in place of the preset's");
  app.add_option("--world", arguments.world, "Axes of world: ENU, NWU, NED")
      ->check(CLI::IsMember({"ENU", "NWU", "NED"}, CLI::ignore_case))
      ->capture_default_str();
  app.add_flag("--no-magnetometer", arguments.no_magnetometer, "Heading from the gyroscope alone");
  loc::add_fusion_options(app, arguments.fusion);
  loc::add_slam_options(app, arguments.slam);
  loc::add_channel_option(app, arguments.channels);
  app.add_option("--estimate-channel", arguments.live.estimate_channel, "Channel of the estimates")
      ->capture_default_str();
  app.add_option("--reorder-delay-ms", arguments.reorder_delay_ms,
                 "Longest wait of one stream for another, in measurement time")
      ->check(CLI::Range(0.0, 10'000.0))
      ->capture_default_str();
  app.add_option("--queue-capacity", arguments.live.queue_capacity, "Messages of one stream that may wait")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_flag("--exit-at-end", arguments.live.exit_at_end, "End when the source says that it has ended");
  app.add_flag("--statistics", arguments.live.statistics, "Log and publish counters once per second");
  CLI::Option* input = app.add_option("--input", arguments.input.path, "Off line: the recording to read");
  app.add_option("--input-kind", arguments.input.kind, "euroc, lcm-log, csv, eqvio, broad; otherwise by its looks")
      ->check(CLI::IsMember({"euroc", "lcm-log", "csv", "eqvio", "broad"}))
      ->needs(input);
  CLI::Option* output =
      app.add_option("--output", arguments.output,
                     "Off line: *.csv, *.tum, *.lcm (an LCM log), or on the Earth *.gpx, *.kml, *.geojson")
          ->needs(input);
  input->needs(output);
  loc::add_geo_options(app, arguments.geo);
  app.add_option("--start", arguments.start,
                 "error-state, off line: auto (from the first second), reference (as the recording's reference says)")
      ->check(CLI::IsMember({"auto", "reference"}))
      ->capture_default_str();

  return program.run(argc, argv, [&] {
    if (arguments.slam.images && !arguments.slam.map_in.empty()) {
      throw loc::UsageError("--map-in with --images: features of a saved map are not recognised in pictures");
    }
    if (arguments.slam.images) become_program_with_images(argv);
    arguments.live.channels = loc::parse_channels(arguments.channels);
    arguments.live.merger.max_delay_ns = loc::from_seconds(arguments.reorder_delay_ms * 1e-3);
    if (arguments.start == "reference" && (input->count() == 0 || arguments.method != "error-state")) {
      throw loc::UsageError("--start reference: for --method error-state with --input only");
    }
    loc::Rig rig = loc::load_rig(arguments.config);
    if (!loc::is_slam(arguments.method)) {
      for (const CLI::Option* option :
           {arguments.slam.config_option, arguments.slam.map_in_option, arguments.slam.map_out_option,
            arguments.slam.camera_option, arguments.slam.images_option}) {
        if (option->count() > 0) {
          throw loc::UsageError(option->get_name() + ": for --method mono-slam and inertial-slam only");
        }
      }
    } else if (input->count() > 0 && rig.cameras.empty()) {
      // An explicit --config wins over what the recording says.
      const loc::Rig of_recording = loc::rig_of_source(input_of(arguments, rig));
      rig.cameras = of_recording.cameras;
      if (!rig.imu) rig.imu = of_recording.imu;
    }
    if (input->count() > 0 && !arguments.slam.map_out.empty()) {
      loc::refuse_to_overwrite(arguments.input.path, arguments.slam.map_out);
    }
    const loc::EstimatorSettings settings = settings_of(arguments, rig, beta->count() > 0);
    loc::AnyEstimator estimator = loc::make_estimator(settings);
    if (arguments.slam.images) set_front_end(estimator, settings.slam.camera);
    return input->count() > 0 ? run_offline(arguments, rig, std::move(estimator))
                              : run_live(arguments, rig, std::move(estimator));
  });
}
