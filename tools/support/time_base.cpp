#include "tools/support/time_base.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <utility>

#include "libloc/core/check.hpp"
#include "tools/support/open_source.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr double kLongestDelayS = 100;

}  // namespace

void TimeBaseWiring::add_options(CLI::App& app) {
  app.add_option(
         "--time-base", base_,
         "Clock of the stamps: device (as they are), host (delays of the arrivals taken out), gps (likewise, then "
         "GPS time by a receiver of this driver's or of another one's, see LOC_CLOCK)")
      ->capture_default_str();
  app.add_option("--time-base-wait", wait_s_,
                 "Seconds that samples wait for their clock to become known, then are dropped")
      ->capture_default_str();
  app.add_option("--gps-pulse-label", pulse_label_,
                 "Pulse that a GPS label names: previous (NMEA) or next (u-blox TIM-TP)")
      ->capture_default_str();
  app.add_option("--gps-label-delay", label_delay_s_, "Without pulses: seconds that labels are late, if measured")
      ->capture_default_str();
  app.add_option("--gps-label-delay-sigma", sigma_label_delay_s_, "How well that is known [s]")->capture_default_str();
}

RestampOptions TimeBaseWiring::restamp_options() const {
  RestampOptions options;
  options.base = parse_time_base(base_);
  if (pulse_label_ != "previous" && pulse_label_ != "next") {
    throw UsageError("--gps-pulse-label '" + pulse_label_ + "': must be previous or next");
  }
  options.gps.label = pulse_label_ == "next" ? PulseLabel::kNext : PulseLabel::kPrevious;
  options.wait_s = wait_s_;
  try {
    const auto require_delay = [](const char* name, double value) {
      require(std::abs(value) <= kLongestDelayS, name, value, "must be at most 100 s");
    };
    require_delay("--gps-label-delay", label_delay_s_);
    require_delay("--gps-label-delay-sigma", sigma_label_delay_s_);
    options.gps.label_delay_ns = from_seconds(label_delay_s_);
    options.gps.sigma_label_delay_ns = from_seconds(sigma_label_delay_s_);
    options.check();
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--time-base options: ") + error.what());
  }
  return options;
}

void TimeBaseWiring::check(const std::string& source_kind) const {
  if (restamp_options().base == TimeBase::kHost && source_kind == "nmea") {
    throw UsageError(
        "--time-base host: an NMEA log does not hold when its sentences arrived; its fixes are on GPS time "
        "(--time-base "
        "gps or device)");
  }
}

std::unique_ptr<MeasurementSource> TimeBaseWiring::wrap(std::unique_ptr<MeasurementSource> source,
                                                        const std::string& lcm_url, const std::string& source_kind) {
  check(source_kind);
  RestampOptions options = restamp_options();
  const bool receiver = is_receiver(source_kind);
  if (source_kind == "nmea" || (options.base == TimeBase::kDevice && !receiver)) return source;
  if (receiver || options.base == TimeBase::kGps) {
    link_.emplace(lcm_url);
    options.poll = [this] { link_->poll(*source_); };
    if (receiver) options.send = [this](const clock_t& message) { link_->publish(message); };
  }
  auto wrapped = std::make_unique<RestampedSource>(std::move(source), std::move(options));
  source_ = wrapped.get();
  return wrapped;
}

}  // namespace loc
