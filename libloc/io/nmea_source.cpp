#include "libloc/io/nmea_source.hpp"

#include <fstream>
#include <utility>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

constexpr std::size_t kChunk = 65536;
constexpr TimeNs kTrustedAfterFix = 3600LL * 1'000'000'000;

/// What a file without sentences may be, by the marks of binary protocols in its first bytes.
std::string looks_of(std::span<const std::uint8_t> bytes) {
  int ubx = 0;
  int sirf = 0;
  int sentences = 0;
  for (std::size_t i = 0; i + 1 < bytes.size(); ++i) {
    if (bytes[i] == 0xb5 && bytes[i + 1] == 0x62) ++ubx;
    if (bytes[i] == 0xa0 && bytes[i + 1] == 0xa2) ++sirf;
    if (bytes[i] == '$' && bytes[i + 1] == 'G') ++sentences;
  }
  if (ubx > 1) return ": this is u-blox's binary protocol UBX; let the receiver send NMEA (ubxtool -e NMEA)";
  if (sirf > 1) return ": this is SiRF's binary protocol; let the receiver send NMEA (gpsctl -n)";
  if (sentences > 1) return ", although there are lines that begin like one";
  return {};
}

class NmeaSource final : public MeasurementSource {
 public:
  NmeaSource(std::filesystem::path path, const NmeaFixOptions& options)
      : path_(std::move(path)), assembler_(options), buffer_(kChunk) {
    const auto status = io::status_of(path_);
    if (!std::filesystem::exists(status)) throw DataError(path_.string() + ": no such file");
    if (std::filesystem::is_directory(status)) throw DataError(path_.string() + ": is a folder, not a file");
    file_.open(path_, std::ios::binary);
    if (!file_) throw DataError(path_.string() + ": cannot be opened");
    read();
    if (waiting_.empty()) throw DataError(path_.string() + ": the file is empty");
    looks_ = looks_of(waiting_);
  }

  std::optional<Measurement> next() override {
    for (;;) {
      const NmeaSentence* sentence = reader_.next(waiting_);
      std::optional<GpsMeasurement> fix;
      if (sentence != nullptr) {
        fix = assembler_.process(*sentence);
      } else if (!read()) {
        if (std::exchange(finished_, true)) return std::nullopt;
        reader_.interrupt();
        fix = assembler_.finish();
        if (reader_.counts().valid_in_all() + reader_.counts().unknown == 0) {
          throw DataError(path_.string() + ": not one correct NMEA sentence in " +
                          std::to_string(reader_.counts().bytes) + " bytes" + looks_);
        }
      }
      if (fix && stamp(*fix)) return *fix;
    }
  }

  NamedCounts counts() const override {
    NamedCounts counts = {{"gps.read", sequence_}};
    if (no_time_ > 0) counts.push_back({"gps.skipped.no_time", no_time_});
    if (backwards_ > 0) counts.push_back({"gps.skipped.time_not_increasing", backwards_});
    assembler_.add_to(counts);
    reader_.counts().add_to(counts);
    return counts;
  }

 private:
  bool read() {
    if (!file_.good()) return false;
    file_.read(reinterpret_cast<char*>(buffer_.data()), static_cast<std::streamsize>(buffer_.size()));
    if (file_.bad()) throw DataError(path_.string() + ": reading failed");
    waiting_ = {buffer_.data(), static_cast<std::size_t>(file_.gcount())};
    return !waiting_.empty();
  }

  bool stamp(GpsMeasurement& fix) {
    fix.time_ns = fix.gps_time_ns;
    if (fix.time_ns == kNoTime && fix.fix == GpsFixType::kNone && last_fix_ns_ != kNoTime) {
      const TimeNs told = assembler_.told_gps_time_ns();
      if (told != kNoTime && told > last_fix_ns_ && told - last_fix_ns_ <= kTrustedAfterFix) fix.time_ns = told;
    }
    if (fix.time_ns == kNoTime) {
      ++no_time_;
      return false;
    }
    if (last_ns_ != kNoTime && fix.time_ns <= last_ns_) {
      ++backwards_;
      return false;
    }
    last_ns_ = fix.time_ns;
    if (fix.fix != GpsFixType::kNone) last_fix_ns_ = fix.time_ns;
    fix.sequence = sequence_++;
    return true;
  }

  std::filesystem::path path_;
  std::ifstream file_;
  NmeaReader reader_;
  NmeaFixAssembler assembler_;
  std::vector<std::uint8_t> buffer_;
  std::span<const std::uint8_t> waiting_;  // of the buffer
  std::string looks_;
  TimeNs last_ns_ = kNoTime;
  TimeNs last_fix_ns_ = kNoTime;
  std::int64_t sequence_ = 0;
  std::int64_t no_time_ = 0;
  std::int64_t backwards_ = 0;
  bool finished_ = false;
};

}  // namespace

std::unique_ptr<MeasurementSource> open_nmea(const std::filesystem::path& path, const NmeaFixOptions& options) {
  return std::make_unique<NmeaSource>(path, options);
}

}  // namespace loc
