#include "tools/support/gps_options.hpp"

#include <CLI/CLI.hpp>
#include <fstream>
#include <sstream>
#include <tuple>

#include "libloc/core/check.hpp"
#include "tools/support/log.hpp"

namespace loc {
namespace {

// CLI11 knows its own errors only.
void set_date(const std::string& text, NmeaFixOptions& options) {
  CivilDate date;
  char first = 0;
  char second = 0;
  std::istringstream in(text);
  in >> date.year >> first >> date.month >> second >> date.day;
  // "2026-11-22" reads as 2026, -11, -22 too, hence the comparison.
  date.month = std::abs(date.month);
  date.day = std::abs(date.day);
  if (!is_date(date) || to_text(date) != text) {
    throw CLI::ValidationError("--reference-date", "'" + text + "' is not a day like 2026-11-22");
  }
  options.reference_date = date;
}

// Kept up to date by the system (package tzdata), long after this program was built.
constexpr const char* kSystemList = "/usr/share/zoneinfo/leap-seconds.list";

LeapSeconds read_list(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) throw DataError("cannot be read");
  return LeapSeconds::from_list(text.str());
}

void set_list(const std::string& path, NmeaFixOptions& options) {
  try {
    options.leap_seconds = read_list(path);
  } catch (const DataError& error) {
    throw CLI::ValidationError("--leap-seconds-list", path + ": " + error.what());
  }
}

LeapSeconds newest_table() {
  try {
    const LeapSeconds of_system = read_list(kSystemList);
    const auto day = [](const CivilDate& d) { return std::tuple(d.year, d.month, d.day); };
    if (day(of_system.known_until()) > day(default_leap_seconds().known_until())) return of_system;
  } catch (const DataError&) {
    // None there, or none that can be read: the program's own is as good as before.
  }
  return default_leap_seconds();
}

void add_fix_options(CLI::App& source, NmeaFixOptions& fix) {
  fix.leap_seconds = newest_table();
  fix.on_remark = [](const std::string& text) { log_warning("event=gps_date reason=\"{}\"", text); };
  CLI::Option* constant = source.add_option_function<int>(
      "--leap-seconds", [&fix](int seconds) { fix.leap_seconds = LeapSeconds::constant(seconds); },
      "GPS time minus UTC [s], instead of the table (the program's or the system's, whichever is newer)");
  constant->check(CLI::Range(0, 255));
  source
      .add_option_function<std::string>(
          "--leap-seconds-list", [&fix](const std::string& path) { set_list(path, fix); },
          "Another table: leap-seconds.list, as in /usr/share/zoneinfo")
      ->excludes(constant);
  source.add_flag("--accept-not-measured", fix.accept_not_measured,
                  "Take dead-reckoned, manual and simulator positions for fixes");
}

void add_nmea_options(CLI::App& source, NmeaFixOptions& fix) {
  source.add_option_function<std::string>(
      "--reference-date", [&fix](const std::string& text) { set_date(text, fix); },
      "A day at or after that of the data, by less than 19 years, YYYY-MM-DD: resolves two-digit years and mends the "
      "dates of receivers that are past their 1024 weeks (live: the host's date)");
  source.add_option("--geoid-separation", fix.geoid_separation,
                    "Geoid above the ellipsoid where the receiver does not say it [m]");
  source
      .add_option("--sigma-per-dop", fix.sigma_per_dop,
                  "Deviation of the position per unit of HDOP and VDOP [m], for fixes without GST; 0: not known")
      ->capture_default_str();
}

}  // namespace

void add_gps_sources(CLI::App& app, SourceSpec& spec) {
  const auto add = [&](const char* kind, const char* text) {
    CLI::App* source = app.add_subcommand(kind, text);
    source->fallthrough();
    source->callback([&spec, kind] { spec.kind = kind; });
    add_fix_options(*source, spec.gps.fix);
    return source;
  };
  const auto add_live = [&](CLI::App* source) {
    source->add_option("--silence", spec.gps.silence_s, "Seconds without data after which it is reported")
        ->capture_default_str();
    source->add_option("--reconnect", spec.gps.reconnect_s, "Seconds between two attempts to connect again")
        ->capture_default_str();
  };
  CLI::App* file = add("nmea", "NMEA log of a receiver, binary protocols in between allowed");
  file->add_option("FILE", spec.path)->required();
  add_nmea_options(*file, spec.gps.fix);
  CLI::App* serial = add("gps-serial", "Receiver on a serial port or pty, now");
  serial->add_option("DEVICE", spec.path)->required();
  serial->add_option("--baud", spec.baud, "Its rate")->capture_default_str();
  add_nmea_options(*serial, spec.gps.fix);
  add_live(serial);
  CLI::App* tcp = add("gps-tcp", "NMEA over TCP, now");
  tcp->add_option("HOST:PORT", spec.path)->required();
  add_nmea_options(*tcp, spec.gps.fix);
  add_live(tcp);
  CLI::App* gpsd = add("gpsd", "What gpsd tells now; by default the local one");
  gpsd->add_option("HOST[:PORT]", spec.path);
  add_live(gpsd);
}

}  // namespace loc
