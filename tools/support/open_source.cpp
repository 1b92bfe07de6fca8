#include "tools/support/open_source.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <span>

#include "libloc/io/broad.hpp"
#include "libloc/io/euroc.hpp"
#include "libloc/io/image_list.hpp"
#include "libloc/io/nmea_source.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "msgs/lcm_log_source.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

bool holds_nmea(const std::string& path) {
  std::array<char, 4096> begin{};
  std::ifstream file(path, std::ios::binary);
  file.read(begin.data(), begin.size());
  NmeaReader reader;
  std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(begin.data()),
                                      static_cast<std::size_t>(file.gcount()));
  return reader.next(bytes) != nullptr;
}

// Pictures, and no EuRoC recording.
bool holds_pictures(const std::filesystem::path& folder) {
  std::error_code error;
  for (const char* name : {"mav0", "imu0", "cam0"}) {
    if (std::filesystem::exists(folder / name, error)) return false;
  }
  for (const char* name : {"rgb.txt", "times.txt"}) {
    if (std::filesystem::exists(folder / name, error)) return true;
  }
  return is_image_folder(folder);
}

}  // namespace

bool is_receiver(const std::string& source_kind) {
  return source_kind == "gps-serial" || source_kind == "gps-tcp" || source_kind == "gpsd";
}

bool is_live(const std::string& source_kind) {
  return is_receiver(source_kind) || source_kind == "camera";
}

bool needs_vision(const SourceSpec& spec) {
  return spec.kind == "camera" || spec.kind == "video" || spec.kind == "images" ||
         (spec.kind == "euroc" && spec.images.wanted);
}

std::string guess_source_kind(const std::string& path) {
  if (std::filesystem::is_directory(path)) return holds_pictures(path) ? "images" : "euroc";
  const std::string extension = std::filesystem::path(path).extension();
  if (extension == ".csv") return is_eqvio(path) ? "eqvio" : "csv";
  if (extension == ".mat") return "broad";
  if (extension == ".rawlog") return kRawlog;
  for (const char* video : {".mp4", ".avi", ".mkv", ".mov", ".webm", ".MP4", ".AVI", ".MKV", ".MOV"}) {
    if (extension == video) return "video";
  }
  if (extension == ".nmea" || holds_nmea(path)) return "nmea";
  return "lcm-log";
}

std::unique_ptr<MeasurementSource> open_source(const SourceSpec& spec) {
  if (spec.kind == "gps-serial") return open_nmea_stream(serial_connection(spec.path, spec.baud), spec.gps);
  if (spec.kind == "gps-tcp") return open_nmea_stream(tcp_connection(spec.path), spec.gps);
  if (spec.kind == "gpsd") return open_gpsd(spec.path, spec.gps);
  std::error_code error;
  if (!std::filesystem::exists(spec.path, error)) throw UsageError("'" + spec.path + "' does not exist");
  if (spec.kind == "euroc" && !spec.images.wanted) return open_euroc(spec.path);
  if (spec.kind == "csv") return open_csv(spec.path, spec.csv);
  if (spec.kind == "eqvio") return open_eqvio(spec.path, spec.eqvio);
  if (spec.kind == "broad") return open_broad(spec.path);
  if (spec.kind == "lcm-log") return open_lcm_log(spec.path, {.decode = spec.decode});
  if (spec.kind == "nmea") return open_nmea(spec.path, spec.gps.fix);
  if (needs_vision(spec) || spec.kind == kRawlog) throw UsageError("source '" + spec.kind + "' is of loc-driver only");
  throw UsageError("source '" + spec.kind +
                   "' is not euroc, lcm-log, csv, eqvio, broad, nmea, gps-serial, gps-tcp or gpsd");
}

Rig rig_of_source(const SourceSpec& spec) {
  if (spec.kind == "eqvio") return open_eqvio(spec.path, spec.eqvio)->rig();
  Rig rig;
  if (spec.kind != "euroc") return rig;
  const std::filesystem::path folder = spec.path;
  const auto sensor = [&](const std::string& name) {
    const std::filesystem::path below = folder / "mav0" / name / "sensor.yaml";
    return std::filesystem::exists(below) ? below : folder / name / "sensor.yaml";
  };
  for (int i = 0; std::filesystem::exists(sensor("cam" + std::to_string(i))); ++i) {
    rig.cameras.push_back(read_euroc_camera(sensor("cam" + std::to_string(i))));
  }
  if (std::filesystem::exists(sensor("imu0"))) rig.imu = read_euroc_imu(sensor("imu0"));
  return rig;
}

void refuse_to_overwrite(const std::string& recording, const std::string& output) {
  std::error_code error;
  if (std::filesystem::equivalent(recording, output, error) && !error) {
    throw UsageError(output + " is the recording itself (" + recording + "): the output needs another name");
  }
}

}  // namespace loc
