// Reader of CSV recordings on any bytes: measurements whose times increase within each sensor, or DataError. The first
// byte chooses the units of headings that have none.
#include <array>

#include "fuzz_support.hpp"
#include "libloc/core/check.hpp"
#include "libloc/io/csv.hpp"

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer calls it so
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const loc::fuzz::MemoryFile file;
  loc::CsvOptions options;
  if ((data[0] & 1) != 0) {
    options = {.time_unit = "s",
               .angular_velocity_unit = "deg/s",
               .specific_force_unit = "g",
               .magnetic_field_unit = "arb",
               .tesla_per_unit = 1e-7};
  }
  const std::filesystem::path path = file.write(data + 1, size - 1);
  try {
    const auto source = loc::open_csv(path, options);
    std::array<loc::TimeNs, loc::kStreamKinds> last;
    last.fill(loc::kNoTime);
    while (const auto measurement = source->next()) {
      const loc::Stamp& stamp = loc::stamp_of(*measurement);
      loc::TimeNs& before = last[measurement->index()];
      loc::fuzz::check(stamp.time_ns > before, "times increase");
      before = stamp.time_ns;
    }
    for (const loc::NamedCount& count : source->counts()) loc::fuzz::check(count.value >= 0, "counts");
  } catch (const loc::DataError&) {
    return 0;
  }
  return 0;
}
