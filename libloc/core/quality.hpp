// What a calibration says about itself: may its result be used, and why (not).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace loc {

/// From best to worst: a combination of several is the largest of them.
enum class Verdict : std::uint8_t {
  kOk,      ///< use it
  kFair,    ///< use it; a better recording would help
  kWarn,    ///< look at the reasons before using it
  kRefused  ///< not to be used unless the user insists
};
/// "ok", "fair", "warn", "refused"
const char* verdict_name(Verdict verdict);
/// @throws std::invalid_argument naming the text.
Verdict parse_verdict(const std::string& name);

struct Quality {
  Verdict verdict = Verdict::kOk;
  std::vector<std::string> reasons;  ///< complete sentences with the figure that decided and what to do about it

  /// Makes the verdict at least this bad and keeps the reason.
  void lower_to(Verdict at_most, std::string reason);
  bool usable() const { return verdict != Verdict::kRefused; }
};

}  // namespace loc
