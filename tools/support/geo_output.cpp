#include "tools/support/geo_output.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/core/gps_time.hpp"
#include "libloc/io/geo_export.hpp"
#include "tools/support/estimate_output.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr TimeNs kGap = 10'000'000'000;
constexpr TimeNs kYear1980 = 315'532'800'000'000'000;  // a clock that says less counts from its own start

bool same(const GeodeticPoint& a, const GeodeticPoint& b) {
  return a.latitude == b.latitude && a.longitude == b.longitude && a.altitude == b.altitude;
}

class GeoOutput final : public EstimateOutput {
 public:
  GeoOutput(std::string path, const std::string& name, const GeoOutputOptions& options)
      : options_((options.check(), options)),
        path_(std::move(path)),
        period_ns_(options.rate_hz > 0 ? from_seconds(1 / options.rate_hz) : 0) {
    track_.name = name;
    track_.geoid_height = options.geoid_height;
  }

  void write(const Estimate& estimate) override {
    const bool tied = (estimate.valid & kValidPosition) != 0 && estimate.position.allFinite() &&
                      std::isfinite(estimate.origin.latitude);
    if (!tied) {
      ++left_out_;
      broken_ = true;
      return;
    }
    const TimeNs since = saturated_since_last(estimate.time_ns);
    broken_ = broken_ || since < 0 || since > kGap || (estimate.status & kReinitialised) != 0;
    last_ns_ = estimate.time_ns;
    // Half a sample early is on time.
    if (!broken_ && period_ns_ > 0 && estimate.time_ns < due_ns_ - since / 2) return;
    if (broken_ || estimate.time_ns - due_ns_ > period_ns_) due_ns_ = estimate.time_ns;
    due_ns_ += period_ns_;
    track_.points.push_back(point_of(estimate));
    track_.points.back().begins_segment = std::exchange(broken_, false);
  }

  void finish() override {
    if (track_.points.empty()) {
      throw DataError(path_ + ": not written: none of " + std::to_string(left_out_) +
                      " estimates is tied to the Earth (no GPS, no --origin?)");
    }
    if (left_out_ > 0) log_warning("event=left_out file=\"{}\" estimates_not_tied_to_the_earth={}", path_, left_out_);
    if (without_time_ > 0) {
      log_warning(R"(event=no_time_of_day file="{}" points={} effect="written without times")", path_, without_time_);
    }
    const std::string ending = std::filesystem::path(path_).extension();
    if (ending == ".gpx") write_gpx(path_, track_);
    if (ending == ".kml") write_kml(path_, track_);
    if (ending == ".geojson") write_geojson(path_, track_);
  }

 private:
  TimeNs saturated_since_last(TimeNs time_ns) const { return last_ns_ == kNoTime ? 0 : time_ns - last_ns_; }

  GeoPathPoint point_of(const Estimate& estimate) {
    if (!frame_ || !same(frame_->origin(), estimate.origin)) frame_.emplace(estimate.origin);
    GeoPathPoint point;
    point.place = frame_->to_geodetic(estimate.position);
    point.utc_ns = utc_of(estimate.time_ns);
    if (point.utc_ns == kNoTime) ++without_time_;
    if ((estimate.valid & kValidCovariance) != 0 && estimate.covariance_dim >= 6) {
      const auto cov = estimate.covariance.block<3, 3>(3, 3);
      const double middle = (cov(0, 0) + cov(1, 1)) / 2;
      const double spread = std::hypot((cov(0, 0) - cov(1, 1)) / 2, cov(0, 1));
      if (middle >= 0) point.sigma_horizontal = std::sqrt(middle + spread);
      if (cov(2, 2) >= 0) point.sigma_vertical = std::sqrt(cov(2, 2));
    }
    return point;
  }

  TimeNs utc_of(TimeNs time_ns) const {
    if (options_.times == "gps") return unix_from_gps(time_ns);
    return options_.times == "unix" && time_ns >= kYear1980 ? time_ns : kNoTime;
  }

  GeoOutputOptions options_;
  std::string path_;
  TimeNs period_ns_;
  GeoPath track_;
  std::optional<LocalFrame> frame_;
  TimeNs last_ns_ = kNoTime;
  TimeNs due_ns_ = 0;
  bool broken_ = true;
  std::int64_t left_out_ = 0;
  std::int64_t without_time_ = 0;
};

}  // namespace

void GeoOutputOptions::check() const {
  require_not_negative("geo-rate-hz", rate_hz);
  require(rate_hz == 0 || rate_hz >= 1e-6, "geo-rate-hz", rate_hz, "must be 0 or at least 1e-6");
  require_finite("geoid-height", geoid_height);
  if (times != "unix" && times != "gps" && times != "none") {
    throw UsageError("--geo-times '" + times + "': must be unix, gps or none");
  }
}

void add_geo_options(CLI::App& app, GeoOutputOptions& options) {
  app.add_option("--geo-rate-hz", options.rate_hz, "*.gpx, *.kml, *.geojson: points per second; 0: every estimate")
      ->capture_default_str();
  app.add_option("--geo-times", options.times, "… what the recording's times are: unix, gps (as --time-base gps), none")
      ->check(CLI::IsMember({"unix", "gps", "none"}))
      ->capture_default_str();
  app.add_option("--geoid-height", options.geoid_height,
                 "… geoid above the ellipsoid there [m]: *.gpx and *.kml then hold altitudes above the sea")
      ->capture_default_str();
}

bool is_geo_output(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension();
  return ending == ".gpx" || ending == ".kml" || ending == ".geojson";
}

std::unique_ptr<EstimateOutput> open_geo_output(const std::string& path, const std::string& name,
                                                const GeoOutputOptions& options) {
  return std::make_unique<GeoOutput>(path, name, options);
}

}  // namespace loc
