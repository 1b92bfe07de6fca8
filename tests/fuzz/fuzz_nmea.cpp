// NMEA reader and assembler on any bytes, in pieces of any size. The first byte chooses the pieces and the options.
#include <cmath>
#include <numbers>

#include "fuzz_support.hpp"
#include "libloc/io/nmea_fix.hpp"

namespace {

using loc::fuzz::check;

void check_fix(const loc::GpsMeasurement& m) {
  const bool none = m.fix == loc::GpsFixType::kNone;
  check(none == std::isnan(m.latitude) && none == std::isnan(m.longitude), "a position has a fix and a fix a position");
  if (none) {
    check(std::isnan(m.altitude) && m.velocity_enu.array().isNaN().all() && m.gps_time_ns == loc::kNoTime,
          "no fix, nothing else");
    return;
  }
  check(std::abs(m.latitude) <= std::numbers::pi / 2 + 1e-12, "latitude");
  check(std::abs(m.longitude) <= std::numbers::pi + 1e-12, "longitude");
  check(m.gps_time_ns == loc::kNoTime || m.gps_time_ns >= 0, "GPS time");
  check(m.satellites >= -1 && m.satellites < 100, "satellites");
  for (int i = 0; i < 3; ++i) check(std::isnan(m.position_cov(i, i)) || m.position_cov(i, i) > 0, "variance");
}

struct Outcome {
  loc::NmeaCounts counts;
  std::int64_t fixes = 0;
  std::int64_t with_position = 0;
};

Outcome run(std::span<const std::uint8_t> bytes, std::size_t piece, const loc::NmeaFixOptions& options) {
  loc::NmeaReader reader;
  loc::NmeaFixAssembler assembler(
      options, [](const loc::GpsTimeEvent& e) { check(e.gps_time_ns >= 0 && e.host_time_ns == 1, "label"); });
  Outcome out;
  const auto take = [&](const std::optional<loc::GpsMeasurement>& fix) {
    if (!fix) return;
    check_fix(*fix);
    ++out.fixes;
    if (fix->fix != loc::GpsFixType::kNone) ++out.with_position;
  };
  while (!bytes.empty()) {
    std::span<const std::uint8_t> part = bytes.first(std::min(piece, bytes.size()));
    bytes = bytes.subspan(part.size());
    while (const loc::NmeaSentence* sentence = reader.next(part, 1)) take(assembler.process(*sentence));
    check(part.empty(), "all bytes are taken");
  }
  reader.interrupt();
  take(assembler.finish());
  out.counts = reader.counts();
  loc::NamedCounts named;
  out.counts.add_to(named);
  assembler.add_to(named);
  for (const loc::NamedCount& c : named) check(c.value >= 0, "counts");
  check(out.counts.bytes_skipped <= out.counts.bytes, "bytes");
  check(out.fixes <= out.counts.valid[0] + out.counts.valid[1], "a fix needs RMC or GGA");
  return out;
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer calls it so
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::uint8_t choice = data[0];
  const std::span<const std::uint8_t> bytes(data + 1, size - 1);
  loc::NmeaFixOptions options;
  if ((choice & 0x80) != 0) options.reference_date = loc::CivilDate{2026, 11, 22};
  if ((choice & 0x40) != 0) options = {.geoid_separation = 45.0, .sigma_per_dop = 5, .accept_not_measured = true};
  const Outcome whole = run(bytes, bytes.size() + 1, options);
  const Outcome parts = run(bytes, 1 + (choice & 0x3f), options);
  check(whole.counts.bytes == static_cast<std::int64_t>(bytes.size()), "every byte is counted");
  check(whole.counts.valid == parts.counts.valid && whole.counts.malformed == parts.counts.malformed &&
            whole.counts.bytes_skipped == parts.counts.bytes_skipped && whole.fixes == parts.fixes &&
            whole.with_position == parts.with_position,
        "the cut of the stream changes nothing");
  return 0;
}
