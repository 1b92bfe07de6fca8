// What an estimator goes on without, in words: which bits of its status hold, since when, and for how long in all. Each
// change is a line of the log.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "libloc/core/named_count.hpp"
#include "libloc/core/time.hpp"

namespace loc {

struct Condition {
  std::uint32_t bit;  ///< EstimateStatus
  const char* name;
};

class Conditions {
 public:
  struct Held {
    Condition condition;
    TimeNs since_ns;
    std::string detail;  ///< by how much, as it was when it began; may be empty
  };
  /// By how much a condition holds, in words; asked once when it begins.
  using Detail = std::function<std::string(std::uint32_t bit)>;

  /// What holds at this time, on the clock of the measurements. What is not said again for a while is over, so that a
  /// bit that comes and goes with every other sample is one condition.
  void update(TimeNs time_ns, std::uint32_t status, const Detail& detail = {});
  /// No measurement comes at all, which their clock cannot tell.
  void set_silent(bool silent);

  const std::vector<Held>& held() const { return held_; }
  bool silent() const { return silent_; }
  TimeNs now_ns() const { return now_ns_; }
  std::uint32_t status() const;
  /// Changed since this was last asked.
  bool take_change();
  /// "condition.no_gps" and so on: how often each began. Only those that did.
  NamedCounts counts() const;

 private:
  struct Track {
    TimeNs since_ns = kNoTime;  // holds, since then
    TimeNs seen_ns = kNoTime;   // last said
    std::string detail;
    std::int64_t times = 0;
  };
  static constexpr std::size_t kConditions = 14;
  static const std::array<Condition, kConditions>& known();

  std::array<Track, kConditions> tracks_{};
  std::vector<Held> held_;
  TimeNs now_ns_ = kNoTime;
  bool silent_ = false;
  bool changed_ = false;
};

}  // namespace loc
