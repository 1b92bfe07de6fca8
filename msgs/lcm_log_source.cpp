#include "msgs/lcm_log_source.hpp"

#include <array>
#include <limits>
#include <map>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/io/lcm_log.hpp"

namespace loc {
namespace {

// Damaged channel names must not fill the memory with counters.
constexpr std::size_t kMostChannels = 1000;

class LogSource final : public LcmLogSource {
 public:
  LogSource(const std::filesystem::path& path, const LcmLogOptions& options)
      : reader_(path), decoder_(options.decode), ahead_(reader_.next()) {}

  std::optional<Measurement> next() override {
    for (;;) {
      const LcmLogEvent* event = ahead_ != nullptr ? ahead_ : reader_.next();
      ahead_ = nullptr;
      if (event == nullptr) return std::nullopt;
      std::optional<Measurement> measurement;
      const std::int64_t known = decoder_.skipped();
      try {
        measurement = decoder_.decode(event->channel, event->data, arrival(*event));
      } catch (const DataError&) {
        count(undecodable_, event->channel);
        continue;
      }
      if (measurement) {
        ++read_[measurement->index()];
        return measurement;
      }
      if (decoder_.skipped() == known) count(ignored_, event->channel);
    }
  }

  NamedCounts counts() const override {
    NamedCounts counts;
    for (std::size_t i = 0; i < kStreamKinds; ++i) {
      if (read_[i] > 0) counts.push_back({std::string(stream_name(static_cast<StreamKind>(i))) + ".read", read_[i]});
    }
    for (NamedCount& entry : decoder_.counts()) counts.push_back(std::move(entry));
    for (const auto& [channel, n] : undecodable_) counts.push_back({"undecodable:" + channel, n});
    for (const auto& [channel, n] : ignored_) counts.push_back({"ignored:" + channel, n});
    const LcmLogDamage& damage = reader_.damage();
    if (damage.gaps > 0) {
      counts.push_back({"log.gaps", damage.gaps});
      counts.push_back({"log.skipped_bytes", damage.skipped_bytes});
      counts.push_back({"log.first_gap_at_byte", static_cast<std::int64_t>(*damage.first_gap_offset)});
    }
    if (damage.truncated_at) {
      counts.push_back({"log.truncated_at_byte", static_cast<std::int64_t>(*damage.truncated_at)});
      counts.push_back({"log.truncated_bytes", damage.truncated_bytes});
    }
    return counts;
  }

  std::optional<GeodeticPoint> origin() const override { return decoder_.origin(); }

 private:
  static TimeNs arrival(const LcmLogEvent& event) {
    constexpr std::int64_t kLatest = std::numeric_limits<std::int64_t>::max() / 1000;
    if (event.log_time_us < -kLatest || event.log_time_us > kLatest) return kNoTime;
    return event.log_time_us * 1000;
  }

  static void count(std::map<std::string, std::int64_t, std::less<>>& counters, std::string_view channel) {
    auto found = counters.find(channel);
    if (found == counters.end()) {
      found = counters.emplace(counters.size() < kMostChannels ? std::string(channel) : "(others)", 0).first;
    }
    ++found->second;
  }

  LcmLogReader reader_;
  MeasurementDecoder decoder_;
  const LcmLogEvent* ahead_;  // read at once, so that a file that is no log is refused when it is opened
  std::array<std::int64_t, kStreamKinds> read_{};
  std::map<std::string, std::int64_t, std::less<>> undecodable_;
  std::map<std::string, std::int64_t, std::less<>> ignored_;
};

}  // namespace

std::unique_ptr<LcmLogSource> open_lcm_log(const std::filesystem::path& path, const LcmLogOptions& options) {
  return std::make_unique<LogSource>(path, options);
}

}  // namespace loc
