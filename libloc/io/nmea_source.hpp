// NMEA logs as recordings: what a receiver wrote, with or without binary protocols and comments in between.
#pragma once

#include <filesystem>
#include <memory>

#include "libloc/io/nmea_fix.hpp"
#include "libloc/io/source.hpp"

namespace loc {

/// The fixes of a log. time_ns is GPS time: a log has no other clock. An epoch without fix is given, as kNone, where
/// the receiver's clock can be believed: when it goes on from the last fix for at most an hour; otherwise it is counted
/// ("gps.skipped.no_time"), like fixes without date. Epochs that go back in time are skipped and counted
/// ("gps.skipped.time_not_increasing"); after ten of them in a row it is remarked. At the beginning and where time
/// leaps by more than half a day 64 epochs are looked at together: the most that agree on an order are given, the
/// others (with a wrong date, in the future too) are skipped and counted likewise. A last sentence that was cut off is
/// counted ("nmea.malformed.cut").
/// @throws DataError when the file is missing, a folder, or empty; from next() at its end, when it holds not one
/// correct sentence, saying what else it seems to be.
std::unique_ptr<MeasurementSource> open_nmea(const std::filesystem::path& path, const NmeaFixOptions& options = {});

}  // namespace loc
