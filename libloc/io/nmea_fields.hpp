// The fields of a sentence whose checksum is correct. Internal to io.
#pragma once

#include <string_view>

#include "libloc/io/nmea.hpp"

namespace loc::io {

enum class NmeaDecoded : std::uint8_t { kValid, kUnknownType, kMalformed };

/// @param text between '$' and '*'. Fills talker and content. @param problem why it is malformed
NmeaDecoded decode_nmea(std::string_view text, NmeaSentence& sentence, NmeaProblem& problem);

}  // namespace loc::io
