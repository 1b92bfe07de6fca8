#include "libloc/io/nmea_source.hpp"

#include <algorithm>
#include <array>
#include <deque>
#include <fstream>
#include <utility>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

constexpr std::size_t kChunk = 65536;
constexpr TimeNs kTrustedAfterFix = 3600LL * 1'000'000'000;
// A wrong date is off by a day or more; what goes on within half a day needs no second look.
constexpr TimeNs kLongestGap = 12 * 3600LL * 1'000'000'000;
constexpr std::size_t kHeld = 64;   // epochs that are looked at together: up to half of them may be wrong
constexpr std::int64_t kMany = 10;  // epochs in a row that are no accident

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
      : path_(std::move(path)), on_remark_(options.on_remark), assembler_(options), buffer_(kChunk) {
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
      if (!ready_.empty()) {
        GpsMeasurement out = std::move(ready_.front());
        ready_.pop_front();
        out.sequence = sequence_++;
        return out;
      }
      const NmeaSentence* sentence = reader_.next(waiting_);
      std::optional<GpsMeasurement> fix;
      if (sentence != nullptr) {
        fix = assembler_.process(*sentence);
      } else if (!read()) {
        if (std::exchange(finished_, true)) {
          if (held_.empty()) return std::nullopt;
          decide();
          continue;
        }
        reader_.interrupt();
        fix = assembler_.finish();
        if (reader_.counts().valid_in_all() + reader_.counts().unknown == 0) {
          throw DataError(path_.string() + ": not one correct NMEA sentence in " +
                          std::to_string(reader_.counts().bytes) + " bytes" + looks_);
        }
      }
      if (fix && stamp(*fix)) arrange(std::move(*fix));
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

  /// Gives the fix its time; false without one.
  bool stamp(GpsMeasurement& fix) {
    fix.time_ns = fix.gps_time_ns;
    if (fix.fix == GpsFixType::kNone && last_fix_ns_ != kNoTime) {
      const TimeNs told = assembler_.told_gps_time_ns();
      if (told != kNoTime && told > last_fix_ns_ && told - last_fix_ns_ <= kTrustedAfterFix) fix.time_ns = told;
    }
    if (fix.time_ns == kNoTime) {
      ++no_time_;
      return false;
    }
    if (fix.fix != GpsFixType::kNone) last_fix_ns_ = fix.time_ns;
    return true;
  }

  void arrange(GpsMeasurement fix) {
    if (!held_.empty()) {
      held_.push_back(std::move(fix));
      if (held_.size() >= kHeld) decide();
    } else if (last_ns_ != kNoTime && fix.time_ns <= last_ns_) {
      drop_backwards(fix.time_ns);
    } else if (last_ns_ != kNoTime && fix.time_ns - last_ns_ <= kLongestGap) {
      give(std::move(fix));
    } else {
      held_.push_back(std::move(fix));  // the beginning, and a leap forward: what follows tells whether it is true
    }
  }

  void give(GpsMeasurement fix) {
    last_ns_ = fix.time_ns;
    backwards_in_a_row_ = 0;
    ready_.push_back(std::move(fix));
  }

  void drop_backwards(TimeNs time_ns) {
    ++backwards_;
    if (++backwards_in_a_row_ != kMany || std::exchange(told_, true) || !on_remark_) return;
    on_remark_(path_.string() + " steps back from GPS time " + format_seconds(last_ns_) + " s to " +
               format_seconds(time_ns) +
               " s: those epochs are skipped until time is past where it was; cut the log "
               "there to read them");
  }

  /// The most of the held epochs whose times increase are right. Gives them up to the next leap, which stays held.
  void decide() {
    const std::vector<std::size_t> chain = longest_increasing();
    std::size_t used = held_.size();
    if (chain.empty()) {
      for (const GpsMeasurement& fix : held_) drop_backwards(fix.time_ns);
    } else {
      std::size_t run = 1;
      while (run < chain.size() && held_[chain[run]].time_ns - held_[chain[run - 1]].time_ns <= kLongestGap) ++run;
      if (run < chain.size()) used = chain[run - 1] + 1;
      std::size_t k = 0;
      for (std::size_t i = 0; i < used; ++i) {
        if (k < run && chain[k] == i) {
          give(std::move(held_[i]));
          ++k;
        } else {
          ++backwards_;
        }
      }
    }
    held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(used));
  }

  /// Indices into held_, of times after last_ns_.
  std::vector<std::size_t> longest_increasing() const {
    constexpr std::size_t kNone = kHeld;
    std::array<std::size_t, kHeld> length{};  // of the chain that ends here
    std::array<std::size_t, kHeld> before{};
    std::size_t best = kNone;
    for (std::size_t i = 0; i < held_.size(); ++i) {
      before[i] = kNone;
      if (last_ns_ != kNoTime && held_[i].time_ns <= last_ns_) continue;
      length[i] = 1;
      for (std::size_t k = 0; k < i; ++k) {
        // Of two that are equally long the one with the smaller leap at its end.
        if (length[k] == 0 || held_[k].time_ns >= held_[i].time_ns || length[k] + 1 < length[i]) continue;
        if (length[k] + 1 == length[i] && held_[k].time_ns <= held_[before[i]].time_ns) continue;
        length[i] = length[k] + 1;
        before[i] = k;
      }
      if (best == kNone || length[i] > length[best] ||
          (length[i] == length[best] && held_[i].time_ns < held_[best].time_ns)) {
        best = i;
      }
    }
    std::vector<std::size_t> chain;
    for (std::size_t i = best; i != kNone; i = before[i]) chain.push_back(i);
    std::ranges::reverse(chain);
    return chain;
  }

  std::filesystem::path path_;
  std::ifstream file_;
  DateRemarkHandler on_remark_;
  NmeaReader reader_;
  NmeaFixAssembler assembler_;
  std::vector<std::uint8_t> buffer_;
  std::span<const std::uint8_t> waiting_;  // of the buffer
  std::string looks_;
  TimeNs last_ns_ = kNoTime;
  TimeNs last_fix_ns_ = kNoTime;
  std::deque<GpsMeasurement> ready_;
  std::vector<GpsMeasurement> held_;  // whose order is not clear yet
  std::int64_t backwards_in_a_row_ = 0;
  bool told_ = false;
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
