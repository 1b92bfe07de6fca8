// A recorded LCM log as a stream of measurements, decoded by the decoder of live messages (decode.hpp tells which types
// and channels). Time is the message's own; the log's time stamp is used as arrival where a message has none.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "libloc/io/source.hpp"
#include "msgs/decode.hpp"

namespace loc {

struct LcmLogOptions {
  DecodeOptions decode;
};

/// Measurements come in the order of the log, which is the order of arrival, and with the times they have: a
/// StreamMerger puts streams in order and sees when a clock was set back, exactly as it does live. counts(): "imu.read"
/// …, what the decoder skipped, "undecodable:CHANNEL", "ignored:CHANNEL" (messages of others), "log.gaps",
/// "log.skipped_bytes", "log.first_gap_at_byte", "log.truncated_at_byte", "log.truncated_bytes" when the file is
/// damaged.
class LcmLogSource : public MeasurementSource {
 public:
  /// Where the world of an ASPN-23 reference has its origin; nullopt before its first position.
  virtual std::optional<GeodeticPoint> origin() const = 0;
};

/// @throws DataError for a file that is missing, empty or no LCM log; what is wrong later is counted.
std::unique_ptr<LcmLogSource> open_lcm_log(const std::filesystem::path& path, const LcmLogOptions& options = {});

}  // namespace loc
