// Readers of rig.yaml, Kalibr's and EuRoC's files on any bytes: a rig that passes its checks, or DataError.
#include "fuzz_support.hpp"
#include "libloc/core/check.hpp"
#include "libloc/io/rig_yaml.hpp"

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer calls it so
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const loc::fuzz::MemoryFile file;
  const std::filesystem::path path = file.write(data, size);
  const auto attempt = [](const auto& read) {
    try {
      read();
    } catch (const loc::DataError&) {
      return;
    }
  };
  attempt([&] { loc::read_any_rig(path).check(); });
  attempt([&] { loc::read_rig(path).check(); });
  return 0;
}
