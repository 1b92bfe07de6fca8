// NMEA 0183 sentences of satellite receivers, from a stream of bytes in pieces of any size: files, serial ports, TCP.
// Only a sentence that is whole, has a correct checksum and whose every field is in range is given; all else is counted
// by reason. Between sentences there may be anything: binary protocols (UBX, SiRF, RTCM), comments, zeros. A '$' begins
// a sentence anew wherever it stands. The line end is not waited for: the checksum ends a sentence.
// Decoded: RMC, GGA, ZDA, GSA, GST, VTG of any talker (GP, GL, GA, GB, BD, GQ, GN, …). An empty field is "not known":
// NaN, kNoTime, -1, 0 for a letter. SI and radians. Times are UTC. No memory is allocated.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <variant>

#include "libloc/core/gps_time.hpp"
#include "libloc/core/named_count.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

/// Recommended minimum: time, date, position, horizontal velocity, and whether they are valid.
struct NmeaRmc {
  TimeNs time_of_day_ns = kNoTime;  ///< since midnight UTC, less than 24 h, or 24 h and less than 1 s: 23:59:60
  bool valid = false;               ///< status A; V (warning) and an empty status are not valid
  double latitude = kUnknown;       ///< [rad]
  double longitude = kUnknown;      ///< [rad]
  double speed = kUnknown;          ///< over ground [m/s]
  double course = kUnknown;         ///< over ground, clockwise from true north [rad]
  CivilDate date;  ///< year: the last two digits only, see full_year(); all fields 0 when unknown: month tells
  double magnetic_variation = kUnknown;  ///< [rad], positive to the east
  char mode = 0;  ///< A autonomous, D differential, E estimated, F float, M manual, N invalid, P, R fixed, S simulator
  char navigation_status = 0;  ///< S safe, C caution, U unsafe, V not provided
};

/// Fix: position, height, quality.
struct NmeaGga {
  TimeNs time_of_day_ns = kNoTime;
  double latitude = kUnknown;
  double longitude = kUnknown;
  std::int32_t quality =
      -1;  ///< 0 invalid, 1 autonomous, 2 differential, 3 PPS, 4 fixed, 5 float, 6 estimated, 7 manual, 8 simulator
  std::int32_t satellites = -1;
  double hdop = kUnknown;
  double altitude_msl = kUnknown;      ///< [m] above the geoid
  double geoid_separation = kUnknown;  ///< [m] of the geoid above the ellipsoid
  double differential_age_s = kUnknown;
  std::int32_t station = -1;
};

/// Time and full date. It has no flag of validity: receivers send what their own clock says, too.
struct NmeaZda {
  TimeNs time_of_day_ns = kNoTime;
  CivilDate date;  ///< month 0 when unknown
  std::int32_t zone_hours = 0;
  std::int32_t zone_minutes = 0;
};

/// Satellites used and dilution of precision. One for each constellation in an epoch.
struct NmeaGsa {
  char selection = 0;     ///< A automatic, M manual 2-D or 3-D
  std::int32_t fix = -1;  ///< 1 none, 2 2-D, 3 3-D
  std::int32_t satellites = 0;
  std::array<std::int16_t, 12> satellite_ids{};
  double pdop = kUnknown;
  double hdop = kUnknown;
  double vdop = kUnknown;
  std::int32_t system = -1;  ///< NMEA 4.11: 1 GPS, 2 GLONASS, 3 Galileo, 4 BeiDou, 5 QZSS, 6 NavIC
};

/// Deviations of the position.
struct NmeaGst {
  TimeNs time_of_day_ns = kNoTime;
  double range_rms = kUnknown;        ///< of the pseudo-range residuals [m]
  double sigma_major = kUnknown;      ///< of the error ellipse [m]
  double sigma_minor = kUnknown;      ///< [m]
  double major_axis = kUnknown;       ///< clockwise from true north [rad]
  double sigma_latitude = kUnknown;   ///< [m]
  double sigma_longitude = kUnknown;  ///< [m]
  double sigma_altitude = kUnknown;   ///< [m]
};

/// Horizontal velocity.
struct NmeaVtg {
  double course = kUnknown;           ///< clockwise from true north [rad]
  double course_magnetic = kUnknown;  ///< [rad]
  double speed = kUnknown;            ///< [m/s], from knots, or from km/h where there are no knots
  char mode = 0;                      ///< as in RMC
};

struct NmeaSentence {
  std::array<char, 2> talker{};
  std::int64_t offset = 0;        ///< of its '$' in the stream, bytes
  TimeNs host_time_ns = kNoTime;  ///< when its '$' arrived
  std::variant<NmeaRmc, NmeaGga, NmeaZda, NmeaGsa, NmeaGst, NmeaVtg> content;
};

/// Why a sentence was refused although it began like one.
enum class NmeaProblem : std::uint8_t {
  kNone,
  kCut,         ///< the next '$' came before the checksum
  kNotText,     ///< a byte that is no printable ASCII
  kTooLong,     ///< more than kNmeaMaxLength bytes
  kNoChecksum,  ///< the line ended without one, or it is not hexadecimal
  kFields,      ///< too few or too many fields
  kTime,
  kDate,
  kLatitude,
  kLongitude,
  kNumber,  ///< any other number: not one, or out of range
  kLetter   ///< a unit, status or mode that does not exist
};
inline constexpr std::size_t kNmeaProblems = 12;
inline constexpr std::size_t kNmeaTypes = std::variant_size_v<decltype(NmeaSentence::content)>;
/// From '$' to the checksum, exclusive. The standard allows 79, receivers send more.
inline constexpr std::size_t kNmeaMaxLength = 256;

/// "rmc", "gga", …, in the order of the variant.
const char* nmea_type_name(std::size_t type);
/// "cut", "not_text", …
const char* nmea_problem_name(NmeaProblem problem);

struct NmeaCounts {
  std::array<std::int64_t, kNmeaTypes> valid{};
  std::int64_t unknown = 0;  ///< correct checksum, but not one of the six types
  std::int64_t bad_checksum = 0;
  std::array<std::int64_t, kNmeaProblems> malformed{};  ///< by NmeaProblem
  std::int64_t bytes = 0;                               ///< taken in all
  std::int64_t bytes_skipped = 0;  ///< outside of sentences (line ends after one are not counted), or of broken ones

  std::int64_t valid_in_all() const;
  /// "nmea.rmc", "nmea.unknown", "nmea.bad_checksum", "nmea.malformed.latitude", "nmea.bytes", "nmea.bytes_skipped";
  /// malformed ones that did not occur are left out.
  void add_to(NamedCounts& counts) const;
};

class NmeaReader {
 public:
  /// Takes bytes from the front until they complete a valid sentence.
  /// @param host_time_ns when these bytes arrived, for NmeaSentence::host_time_ns
  /// @return the sentence, valid until the next call; nullptr: all bytes are taken and none is complete.
  const NmeaSentence* next(std::span<const std::uint8_t>& bytes, TimeNs host_time_ns = kNoTime);
  /// Bytes were lost (reconnection): a sentence that has begun will not be completed. It is counted as cut.
  void interrupt();
  const NmeaCounts& counts() const { return counts_; }

 private:
  enum class State : std::uint8_t { kOutside, kBody, kFirstDigit, kSecondDigit };

  void begin(TimeNs host_time_ns);
  void abandon(NmeaProblem problem);
  void skip_to_dollar(std::span<const std::uint8_t>& bytes, TimeNs host_time_ns);
  bool complete();
  void refuse_digit(std::uint8_t byte, TimeNs host_time_ns);

  State state_ = State::kOutside;
  bool after_sentence_ = false;  // only line ends since
  std::uint8_t sum_ = 0;
  std::uint8_t told_sum_ = 0;
  std::size_t length_ = 0;
  std::array<char, kNmeaMaxLength> text_{};  // between '$' and '*'
  NmeaSentence sentence_;
  NmeaCounts counts_;
};

}  // namespace loc
