// NMEA sentences to GPS fixes: those of one epoch (the same time of day) make one GpsMeasurement.
// What is believed: a position needs a status A in RMC or a quality other than 0 in GGA, and none of RMC, GGA, GSA of
// the epoch that says otherwise; without it the fix is kNone and holds no position, whatever stood in the fields.
// Positions that no satellite measured (dead reckoning, manual input, simulator) count as none. Altitude is above the
// ellipsoid: altitude above the geoid plus the geoid's separation; unknown when the receiver does not tell the
// separation (its own geoid model is needed, no other), and in a 2-D fix, whose altitude is an assumption. Covariance
// comes from GST, or, when asked for, from the dilution of precision; otherwise it is not known. Time is UTC; the date
// comes from RMC (two-digit year) or ZDA of the epoch, otherwise it is carried on from the last epoch that had one,
// over midnight too; a date that changes up to ten seconds after midnight is taken as changed. Sentences without time
// (GSA, VTG) belong to the epoch of the timed one before them. A receiver that sends VTG first in its burst and no RMC
// can mislead this in a log; live, the pause between bursts parts the epochs.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "libloc/core/gps_time.hpp"
#include "libloc/io/nmea.hpp"
#include "libloc/sensors/gps_time_event.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

/// Called for every GPS time event, from the thread that reads the source.
using GpsTimeEventHandler = std::function<void(const GpsTimeEvent&)>;
/// Called once per kind with what someone should know about the dates: that they were mended, that they are past the
/// table of leap seconds, that a log steps back. A sentence without a full stop.
using DateRemarkHandler = std::function<void(const std::string&)>;

/// The remark about a date that the table does not know.
std::string past_leap_table_remark(const CivilDate& date, const LeapSeconds& table);

struct NmeaFixOptions {
  LeapSeconds leap_seconds = LeapSeconds();
  /// A day at or after that of the data, by less than 19 years (live: the host's, or library_date() if that is later).
  /// Resolves two-digit years and mends the dates of receivers that have outlived 1024 weeks, see resolve_rollover().
  /// Without it years are 1980 to 2079 and dates are taken as told.
  std::optional<CivilDate> reference_date = std::nullopt;
  /// Used where the receiver does not tell it [m]; 0 takes its altitude as that above the ellipsoid.
  std::optional<double> geoid_separation = std::nullopt;
  /// Deviation of the horizontal position per unit of HDOP, and of the altitude per unit of VDOP [m]; for fixes without
  /// GST. 0: their covariance stays unknown.
  double sigma_per_dop = 0;
  /// Accept dead-reckoned, manual and simulator positions as 2-D or 3-D fixes.
  bool accept_not_measured = false;
  DateRemarkHandler on_remark = {};

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

class NmeaFixAssembler {
 public:
  /// @param on_event gets a label for the first sentence of an epoch that tells a valid date and time, if its arrival
  /// is known. RMC says itself whether it is valid; ZDA is believed in epochs that have a fix so far, and after them.
  /// @throws as NmeaFixOptions::check
  explicit NmeaFixAssembler(const NmeaFixOptions& options = {}, GpsTimeEventHandler on_event = {});

  /// @return the fix of the epoch before, when this sentence begins another. time_ns and sequence are left to the
  /// caller; host_time_ns is the arrival of the epoch's first sentence; gps_time_ns that of validity, known when the
  /// fix is valid and its date known.
  std::optional<GpsMeasurement> process(const NmeaSentence& sentence);
  /// The fix of the epoch that is open: at the end, and live in the pause between two bursts.
  std::optional<GpsMeasurement> finish();

  /// GPS time of the last fix that finish() or process() gave, believed or not: the receiver's own clock where it had
  /// no fix. kNoTime without a date.
  TimeNs told_gps_time_ns() const { return told_gps_time_ns_; }
  /// "gps.epochs", "gps.no_fix", "gps.no_date", "gps.date_past_leap_table", and what was contradictory or given up:
  /// "gps.contradictory", "gps.not_measured", "gps.repeated_sentence", "gps.late_sentence", "gps.impossible_time",
  /// "gps.rollover_mended", "gps.date_late", "gps.time_labels"; those that did not occur are left out, but epochs and
  /// no_fix.
  void add_to(NamedCounts& counts) const;

 private:
  struct Epoch {
    TimeNs host_time_ns = kNoTime;
    TimeNs time_of_day_ns = kNoTime;
    std::optional<NmeaRmc> rmc;
    std::optional<NmeaGga> gga;
    std::optional<NmeaZda> zda;
    std::optional<NmeaGst> gst;
    std::optional<NmeaVtg> vtg;
    std::int32_t gsa_fix = -1;  // the best of all constellations
    double hdop = kUnknown;
    double vdop = kUnknown;
    std::array<char, 2> vtg_talker{};
    bool labelled = false;
  };
  struct Counts {
    std::int64_t epochs = 0;
    std::int64_t no_fix = 0;
    std::int64_t no_date = 0;
    std::int64_t past_leap_table = 0;
    std::int64_t contradictory = 0;
    std::int64_t not_measured = 0;
    std::int64_t repeated = 0;
    std::int64_t late = 0;
    std::int64_t impossible_time = 0;
    std::int64_t rollover_mended = 0;
    std::int64_t date_late = 0;
    std::int64_t labels = 0;
  };

  bool begins_epoch(const NmeaSentence& sentence) const;
  void keep(const NmeaSentence& sentence);
  void label(const NmeaSentence& sentence);
  std::optional<GpsMeasurement> assemble();
  bool has_fix(const Epoch& epoch);
  bool told_valid(const NmeaRmc& rmc) const;
  bool told_valid(const NmeaGga& gga) const;
  GpsFixType fix_type(const Epoch& epoch) const;
  CivilDate mended(const CivilDate& date) const;
  std::optional<CivilDate> date_of(const NmeaRmc& rmc) const;
  std::optional<CivilDate> date_of(const NmeaZda& zda) const;
  bool is_late(const CivilDate& date, TimeNs time_of_day_ns) const;
  std::optional<CivilDate> carried_date(const Epoch& epoch) const;
  void find_time(const Epoch& epoch, bool valid, GpsMeasurement& fix);
  void remark(const Epoch& epoch, const CivilDate& date, bool mended);
  std::optional<TimeNs> gps_time(const CivilDate& date, TimeNs time_of_day_ns) const;
  void fill_position(const Epoch& epoch, GpsMeasurement& fix) const;
  void fill_covariance(const Epoch& epoch, GpsMeasurement& fix) const;
  void fill_velocity(const Epoch& epoch, GpsMeasurement& fix) const;

  NmeaFixOptions options_;
  GpsTimeEventHandler on_event_;
  Epoch epoch_;
  std::optional<NmeaVtg> next_vtg_;           // a second one from the same talker belongs to the epoch to come
  TimeNs finished_time_of_day_ns_ = kNoTime;  // of the epoch that finish() has given already
  std::optional<CivilDate> last_date_;        // of the last epoch that could be dated …
  TimeNs last_time_of_day_ns_ = kNoTime;
  TimeNs last_host_time_ns_ = kNoTime;
  bool last_valid_ = false;  // the last epoch had a fix
  TimeNs told_gps_time_ns_ = kNoTime;
  Counts counts_;
};

}  // namespace loc
