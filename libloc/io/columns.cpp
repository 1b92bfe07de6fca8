#include "libloc/io/columns.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc::io {
namespace {

constexpr double kStandardGravity = 9.80665;
constexpr double kDegree = std::numbers::pi / 180;

struct Name {
  std::string_view text;  // ends with the axis
  Quantity quantity;
  std::size_t axis;
};

struct Unit {
  std::string_view text;  // small letters, no blanks
  Quantity quantity;
  double to_si;  // for a time the decimal exponent
};

// Prefixes; the axes follow: x y z, of a quaternion w x y z, of GPS e n u.
constexpr std::array kTriads{
    std::pair{std::string_view("w"), Quantity::kAngularVelocity},
    std::pair{std::string_view("g"), Quantity::kAngularVelocity},
    std::pair{std::string_view("gyr_"), Quantity::kAngularVelocity},
    std::pair{std::string_view("gyro_"), Quantity::kAngularVelocity},
    std::pair{std::string_view("w_rs_s_"), Quantity::kAngularVelocity},
    std::pair{std::string_view("omega_"), Quantity::kAngularVelocity},
    std::pair{std::string_view("a"), Quantity::kSpecificForce},
    std::pair{std::string_view("acc_"), Quantity::kSpecificForce},
    std::pair{std::string_view("a_rs_s_"), Quantity::kSpecificForce},
    std::pair{std::string_view("alpha_"), Quantity::kSpecificForce},  // Kalibr
    std::pair{std::string_view("m"), Quantity::kMagneticField},
    std::pair{std::string_view("mag_"), Quantity::kMagneticField},
    std::pair{std::string_view("p"), Quantity::kPosition},
    std::pair{std::string_view("p_rs_r_"), Quantity::kPosition},
    std::pair{std::string_view("v"), Quantity::kVelocity},
    std::pair{std::string_view("v_rs_r_"), Quantity::kVelocity},
    std::pair{std::string_view("q"), Quantity::kOrientation},
    std::pair{std::string_view("q_rs_"), Quantity::kOrientation},
    std::pair{std::string_view("b_w_rs_s_"), Quantity::kUnused},
    std::pair{std::string_view("b_a_rs_s_"), Quantity::kUnused},
    std::pair{std::string_view("v"), Quantity::kGpsVelocity},
    std::pair{std::string_view("sigma_"), Quantity::kGpsSigma},
    std::pair{std::string_view("sigma_v"), Quantity::kGpsVelocitySigma},
    std::pair{std::string_view("odo_p"), Quantity::kOdometryPosition},
    std::pair{std::string_view("odo_q"), Quantity::kOdometryOrientation},
    std::pair{std::string_view("odo_sigma_p"), Quantity::kOdometryPositionSigma},
    std::pair{std::string_view("odo_sigma_theta_"), Quantity::kOdometryOrientationSigma},
};
constexpr std::array kSingles{
    Name{"time", Quantity::kTime, 0},
    Name{"timestamp", Quantity::kTime, 0},
    Name{"t", Quantity::kTime, 0},
    Name{"ts", Quantity::kTime, 0},
    Name{"score", Quantity::kScore, 0},
    Name{"latitude", Quantity::kLatitudeLongitude, 0},
    Name{"lat", Quantity::kLatitudeLongitude, 0},
    Name{"longitude", Quantity::kLatitudeLongitude, 1},
    Name{"lon", Quantity::kLatitudeLongitude, 1},
    Name{"altitude", Quantity::kAltitude, 0},
    Name{"alt", Quantity::kAltitude, 0},
    Name{"fix", Quantity::kGpsFix, 0},
    Name{"satellites", Quantity::kSatellites, 0},
    Name{"odo_start", Quantity::kOdometryStart, 0},
};

constexpr std::array kUnits{
    Unit{"ns", Quantity::kTime, -9},
    Unit{"us", Quantity::kTime, -6},
    Unit{"ms", Quantity::kTime, -3},
    Unit{"s", Quantity::kTime, 0},
    Unit{"rad/s", Quantity::kAngularVelocity, 1},
    Unit{"rad_s", Quantity::kAngularVelocity, 1},
    Unit{"rads^-1", Quantity::kAngularVelocity, 1},
    Unit{"deg/s", Quantity::kAngularVelocity, kDegree},
    Unit{"deg_s", Quantity::kAngularVelocity, kDegree},
    Unit{"degs^-1", Quantity::kAngularVelocity, kDegree},
    Unit{"dps", Quantity::kAngularVelocity, kDegree},
    Unit{"m/s^2", Quantity::kSpecificForce, 1},
    Unit{"m/s2", Quantity::kSpecificForce, 1},
    Unit{"m_s2", Quantity::kSpecificForce, 1},
    Unit{"ms^-2", Quantity::kSpecificForce, 1},
    Unit{"m/s\xC2\xB2", Quantity::kSpecificForce, 1},
    Unit{"g", Quantity::kSpecificForce, kStandardGravity},
    Unit{"mg", Quantity::kSpecificForce, kStandardGravity * 1e-3},
    Unit{"t", Quantity::kMagneticField, 1},
    Unit{"mt", Quantity::kMagneticField, 1e-3},
    Unit{"ut", Quantity::kMagneticField, 1e-6},
    Unit{"\xC2\xB5t", Quantity::kMagneticField, 1e-6},
    Unit{"\xCE\xBCt", Quantity::kMagneticField, 1e-6},
    Unit{"nt", Quantity::kMagneticField, 1e-9},
    Unit{"gauss", Quantity::kMagneticField, 1e-4},
    Unit{"mgauss", Quantity::kMagneticField, 1e-7},
    Unit{"arb", Quantity::kMagneticField, 0},
    Unit{"m", Quantity::kPosition, 1},
    Unit{"m/s", Quantity::kVelocity, 1},
    Unit{"m_s", Quantity::kVelocity, 1},
    Unit{"ms^-1", Quantity::kVelocity, 1},
    Unit{"rad", Quantity::kLatitudeLongitude, 1},
    Unit{"deg", Quantity::kLatitudeLongitude, kDegree},
    Unit{"m", Quantity::kAltitude, 1},
    Unit{"m/s", Quantity::kGpsVelocity, 1},
    Unit{"m_s", Quantity::kGpsVelocity, 1},
    Unit{"ms^-1", Quantity::kGpsVelocity, 1},
    Unit{"m", Quantity::kGpsSigma, 1},
    Unit{"m/s", Quantity::kGpsVelocitySigma, 1},
    Unit{"m_s", Quantity::kGpsVelocitySigma, 1},
    Unit{"ms^-1", Quantity::kGpsVelocitySigma, 1},
    Unit{"ns", Quantity::kOdometryStart, -9},
    Unit{"us", Quantity::kOdometryStart, -6},
    Unit{"ms", Quantity::kOdometryStart, -3},
    Unit{"s", Quantity::kOdometryStart, 0},
    Unit{"unit", Quantity::kOdometryPosition, 1},
    Unit{"m", Quantity::kOdometryPosition, 1},
    Unit{"unit", Quantity::kOdometryPositionSigma, 1},
    Unit{"m", Quantity::kOdometryPositionSigma, 1},
    Unit{"rad", Quantity::kOdometryOrientationSigma, 1},
    Unit{"deg", Quantity::kOdometryOrientationSigma, kDegree},
};

std::string_view axis_letters(Quantity quantity) {
  switch (quantity) {
    case Quantity::kOrientation:
    case Quantity::kOdometryOrientation:
      return "wxyz";
    case Quantity::kGpsVelocity:
    case Quantity::kGpsSigma:
    case Quantity::kGpsVelocitySigma:
      return "enu";
    default:
      return "xyz";
  }
}

const std::vector<Name>& names() {
  static std::vector<std::string> texts;
  static const std::vector<Name> result = [] {
    std::vector<std::pair<Quantity, std::size_t>> where;
    for (const auto& [prefix, quantity] : kTriads) {
      const std::string_view axes = axis_letters(quantity);
      for (std::size_t i = 0; i < axes.size(); ++i) {
        texts.push_back(std::string(prefix) + axes[i]);
        where.emplace_back(quantity, i);
      }
    }
    std::vector<Name> list;
    for (std::size_t i = 0; i < texts.size(); ++i) list.push_back({texts[i], where[i].first, where[i].second});
    list.insert(list.end(), kSingles.begin(), kSingles.end());
    return list;
  }();
  return result;
}

bool has_unit(Quantity quantity) {
  switch (quantity) {
    case Quantity::kOrientation:
    case Quantity::kOdometryOrientation:
    case Quantity::kScore:
    case Quantity::kGpsFix:
    case Quantity::kSatellites:
    case Quantity::kUnused:
      return false;
    default:
      return true;
  }
}

std::string small_letters(std::string_view text, bool drop_blanks) {
  std::string out;
  for (const char c : text) {
    if (drop_blanks && (c == ' ' || c == '\t')) continue;
    out += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return out;
}

std::string known_names() {
  std::string list;
  for (const Name& name : names()) list += (list.empty() ? "" : ", ") + std::string(name.text);
  return list;
}

std::string known_units(Quantity quantity) {
  std::string list;
  for (const Unit& unit : kUnits) {
    if (unit.quantity == quantity) list += (list.empty() ? "" : ", ") + std::string(unit.text);
  }
  return list;
}

const std::string& default_unit(Quantity quantity, const CsvOptions& options) {
  static const std::string kNone;
  static const std::string kMetre = "m";
  static const std::string kMetrePerSecond = "m/s";
  switch (quantity) {
    case Quantity::kTime:
    case Quantity::kOdometryStart:
      return options.time_unit;
    case Quantity::kAngularVelocity:
      return options.angular_velocity_unit;
    case Quantity::kSpecificForce:
      return options.specific_force_unit;
    case Quantity::kMagneticField:
      return options.magnetic_field_unit;
    case Quantity::kPosition:
    case Quantity::kAltitude:
    case Quantity::kGpsSigma:
    case Quantity::kOdometryPosition:
    case Quantity::kOdometryPositionSigma:
      return kMetre;
    case Quantity::kVelocity:
    case Quantity::kGpsVelocity:
    case Quantity::kGpsVelocitySigma:
      return kMetrePerSecond;
    default:
      return kNone;
  }
}

Column parse_column(std::string_view heading, const std::string& where, const CsvOptions& options) {
  const std::string quoted = "column '" + std::string(heading) + "'";
  std::string name = small_letters(heading, false);
  std::optional<std::string> unit;
  if (const auto bracket = name.find('['); bracket != std::string::npos) {
    if (!name.ends_with(']')) throw DataError(where + ": " + quoted + ": the bracket is not closed");
    unit = small_letters(name.substr(bracket + 1, name.size() - bracket - 2), true);
    name = std::string(trim(std::string_view(name).substr(0, bracket)));
  }

  const Name* found = nullptr;
  for (const Name& known : names()) {
    if (name == known.text) {
      found = &known;
    } else if (!unit && name.size() > known.text.size() && name.starts_with(known.text) &&
               name[known.text.size()] == '_' && has_unit(known.quantity)) {
      found = &known;
      unit = name.substr(known.text.size() + 1);
    }
    if (found != nullptr) break;
  }
  if (found == nullptr) throw DataError(where + ": " + quoted + " is not known; known are " + known_names());

  Column column;
  column.quantity = found->quantity;
  column.axis = found->axis;
  column.heading = heading;
  if (!has_unit(found->quantity)) {
    if (unit && !unit->empty() && found->quantity != Quantity::kUnused) {
      throw DataError(where + ": " + quoted + " has no unit, but '" + *unit + "' is given");
    }
    return column;
  }
  if (!unit || unit->empty()) unit = small_letters(default_unit(found->quantity, options), true);
  if (unit->empty()) {
    throw DataError(where + ": " + quoted +
                    " has no unit; write it in brackets or state it in the options: " + known_units(found->quantity));
  }
  const auto* const known =
      std::ranges::find_if(kUnits, [&](const Unit& u) { return u.quantity == found->quantity && u.text == *unit; });
  if (known == kUnits.end()) {
    throw DataError(where + ": " + quoted + ": unit '" + *unit + "' is not known; known are " +
                    known_units(found->quantity));
  }
  if (found->quantity == Quantity::kTime || found->quantity == Quantity::kOdometryStart) {
    column.time_exponent = static_cast<int>(known->to_si);
  } else {
    column.to_si = known->to_si;
  }
  if (known->text == "arb") {
    if (!(std::isfinite(options.tesla_per_unit) && options.tesla_per_unit > 0)) {
      throw DataError(where + ": " + quoted + " has the unit arb: the options must state how many tesla that is");
    }
    column.to_si = options.tesla_per_unit;
  }
  return column;
}

}  // namespace

std::size_t axes_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::kTime:
    case Quantity::kScore:
    case Quantity::kAltitude:
    case Quantity::kGpsFix:
    case Quantity::kSatellites:
    case Quantity::kOdometryStart:
      return 1;
    case Quantity::kLatitudeLongitude:
      return 2;
    case Quantity::kOrientation:
    case Quantity::kOdometryOrientation:
      return 4;
    default:
      return 3;
  }
}

std::vector<Column> parse_heading(std::string_view line, const std::string& where, const CsvOptions& options) {
  line = trim(line);
  if (line.starts_with('#')) line.remove_prefix(1);
  std::vector<std::string_view> cells;
  split_cells(line, cells);
  std::vector<Column> columns;
  std::set<std::pair<Quantity, std::size_t>> seen;
  std::array<std::size_t, kQuantities> axes{};
  for (const std::string_view cell : cells) {
    Column column = parse_column(cell, where, options);
    if (column.quantity != Quantity::kUnused) {
      if (!seen.emplace(column.quantity, column.axis).second) {
        throw DataError(where + ": column '" + column.heading + "': the same quantity comes twice");
      }
      ++axes[static_cast<std::size_t>(column.quantity)];
    }
    columns.push_back(std::move(column));
  }
  for (const Column& column : columns) {
    const std::size_t has = axes[static_cast<std::size_t>(column.quantity)];
    if (column.quantity != Quantity::kUnused && has != axes_of(column.quantity)) {
      throw DataError(where + ": column '" + column.heading + "': " + std::to_string(has) + " of " +
                      std::to_string(axes_of(column.quantity)) + " columns of this quantity");
    }
  }
  const auto present = [&](Quantity quantity) { return axes[static_cast<std::size_t>(quantity)] > 0; };
  if (!present(Quantity::kTime)) throw DataError(where + ": no column of time (time_ns, time_s, …)");
  if (present(Quantity::kAngularVelocity) != present(Quantity::kSpecificForce)) {
    throw DataError(where + ": an IMU has both, angular velocity (wx wy wz) and specific force (ax ay az)");
  }
  const auto needs = [&](Quantity what, const char* name, Quantity needed, const char* needed_names) {
    if (present(what) && !present(needed)) {
      throw DataError(where + ": " + name + " without " + needed_names + ": belongs to no measurement");
    }
  };
  for (const auto& [what, name] :
       {std::pair{Quantity::kAltitude, "altitude"}, std::pair{Quantity::kGpsVelocity, "ve vn vu"},
        std::pair{Quantity::kGpsSigma, "sigma_e sigma_n sigma_u"}, std::pair{Quantity::kGpsFix, "fix"},
        std::pair{Quantity::kSatellites, "satellites"}}) {
    needs(what, name, Quantity::kLatitudeLongitude, "latitude, longitude");
  }
  needs(Quantity::kGpsVelocitySigma, "sigma_ve sigma_vn sigma_vu", Quantity::kGpsVelocity, "ve vn vu");
  for (const auto& [what, name] :
       {std::pair{Quantity::kOdometryStart, "odo_start"}, std::pair{Quantity::kOdometryOrientation, "odo_qw .. odo_qz"},
        std::pair{Quantity::kOdometryPositionSigma, "odo_sigma_px .."}}) {
    needs(what, name, Quantity::kOdometryPosition, "odo_px odo_py odo_pz");
  }
  needs(Quantity::kOdometryOrientationSigma, "odo_sigma_theta_x ..", Quantity::kOdometryOrientation,
        "odo_qw odo_qx odo_qy odo_qz");
  if (!present(Quantity::kAngularVelocity) && !present(Quantity::kMagneticField) && !present(Quantity::kOrientation) &&
      !present(Quantity::kPosition) && !present(Quantity::kLatitudeLongitude) &&
      !present(Quantity::kOdometryPosition)) {
    throw DataError(where +
                    ": no column holds a measurement (wx wy wz ax ay az, mx my mz, qw qx qy qz, px py pz, latitude "
                    "longitude, odo_px odo_py odo_pz)");
  }
  return columns;
}

}  // namespace loc::io
