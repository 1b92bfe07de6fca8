"""Earth's magnetic field by the World Magnetic Model, and a check of a measured field against it.

The model and its coefficients are those of the package pygeomag; its stated uncertainty is that of the model
(crustal fields included), not of a place with steel in the walls.
"""

from __future__ import annotations

import datetime
import math
from dataclasses import dataclass

import pygeomag

from libloc._core import Verdict

# Years [first, last) that pygeomag's coefficients are for.
FIRST_YEAR = 2010.0
LAST_YEAR = 2030.0


@dataclass(frozen=True)
class Field:
    """The Earth's field at a place and time."""

    declination: float  #: [rad], magnetic north from true north, positive east
    dip: float  #: [rad], positive where the field points down
    strength: float  #: [T]
    horizontal: float  #: [T]
    enu: tuple[float, float, float]  #: [T], east, north, up
    declination_sigma: float  #: [rad]
    dip_sigma: float  #: [rad]
    strength_sigma: float  #: [T]
    model: str  #: "WMM-2025"


@dataclass(frozen=True)
class Check:
    """A measured field against the model's."""

    expected: Field
    strength_error: float  #: measured less expected [T]; NaN when not given
    dip_error: float  #: [rad]; NaN when not given
    verdict: Verdict
    reasons: list[str]


def decimal_year(date: datetime.date | datetime.datetime | float) -> float:
    """Year with its fraction, of a date, a datetime (UTC unless it says otherwise) or a number."""
    if isinstance(date, datetime.datetime):
        if date.tzinfo is not None:
            date = date.astimezone(datetime.UTC).replace(tzinfo=None)
        start, end = datetime.datetime(date.year, 1, 1), datetime.datetime(date.year + 1, 1, 1)
        return date.year + (date - start) / (end - start)
    if isinstance(date, datetime.date):
        start, end = datetime.date(date.year, 1, 1), datetime.date(date.year + 1, 1, 1)
        return date.year + (date - start) / (end - start)
    return float(date)


def _base_year(year: float) -> int:
    """First year of the model that is for this year."""
    return 5 * math.floor(year / 5)


def earth_field(
    latitude: float, longitude: float, altitude: float, date: datetime.date | datetime.datetime | float
) -> Field:
    """The field at latitude and longitude [rad], altitude above the ellipsoid [m] and a date.

    The model of the date is taken: WMM-2025 for 2025 to 2029, older ones back to 2010.
    ValueError names an argument that is out of range; a date outside the models is not extrapolated.
    """
    limits = {
        "latitude": (latitude, math.pi / 2),
        "longitude": (longitude, 2 * math.pi),
    }
    for name, (value, limit) in limits.items():
        if not (math.isfinite(value) and abs(value) <= limit * (1 + 1e-12)):
            raise ValueError(f"{name} = {value}: must be in [-{limit:.4f}, {limit:.4f}] rad")
    if not -1e3 <= altitude <= 850e3:
        raise ValueError(f"altitude = {altitude}: must be in [-1000, 850000] m")
    year = decimal_year(date)
    if not FIRST_YEAR <= year < LAST_YEAR:
        years = f"{FIRST_YEAR:.0f} to {LAST_YEAR:.0f}"
        raise ValueError(f"date = {date}: the magnetic models at hand are for {years}")
    model = pygeomag.GeoMag(base_year=_base_year(year))
    degrees = math.degrees
    longitude_deg = math.remainder(degrees(longitude), 360.0)
    result = model.calculate(
        glat=max(-90.0, min(90.0, degrees(latitude))), glon=longitude_deg, alt=altitude / 1e3, time=year
    )
    # The models before 2015 state no uncertainty of this kind: that of the next one is taken.
    dip_sigma_deg, strength_sigma_nt, declination_deg = 0.22, 152.0, math.hypot(0.23, 5430 / result.h)
    if year >= 2015:
        uncertainty = result.calculate_uncertainty()
        dip_sigma_deg, strength_sigma_nt, declination_deg = uncertainty.i, uncertainty.f, uncertainty.d
    return Field(
        declination=math.radians(result.d),
        dip=math.radians(result.i),
        strength=result.f * 1e-9,
        horizontal=result.h * 1e-9,
        enu=(result.y * 1e-9, result.x * 1e-9, -result.z * 1e-9),
        declination_sigma=math.radians(min(180.0, declination_deg)),
        dip_sigma=math.radians(dip_sigma_deg),
        strength_sigma=strength_sigma_nt * 1e-9,
        model=model.model,
    )


def check(
    latitude: float,
    longitude: float,
    altitude: float,
    date: datetime.date | datetime.datetime | float,
    field: float = math.nan,
    dip: float = math.nan,
) -> Check:
    """Does a measured field agree with the model's?

    Arguments as earth_field() takes them, the measured strength [T] and dip [rad], either NaN when it was
    not measured.
    A building's steel changes the field by some percent and degrees: within 5 % and 3 deg the verdict is OK,
    within 15 % and 10 deg FAIR, beyond WARN. A wrong unit or a reversed field is REFUSED.
    """
    for name, value in (("field", field), ("dip", dip)):
        if math.isinf(value):
            raise ValueError(f"{name} = {value}: must be finite, or NaN")
    if not math.isnan(field) and field <= 0:
        raise ValueError(f"field = {field}: must be positive")
    if abs(dip) > math.pi / 2 + 1e-9:
        raise ValueError(f"dip = {dip}: must be in [-pi/2, pi/2] rad")
    if math.isnan(field) and math.isnan(dip):
        raise ValueError("field and dip are both NaN: there is nothing to check")
    expected = earth_field(latitude, longitude, altitude, date)
    verdict = Verdict.OK
    reasons: list[str] = []

    def lower(to: Verdict, reason: str) -> None:
        nonlocal verdict
        verdict = max(verdict, to)
        reasons.append(reason)

    strength_error = field - expected.strength
    share = abs(strength_error) / expected.strength
    if share > 0.05:
        text = (
            f"The field is {field * 1e6:.4g} uT, the model says {expected.strength * 1e6:.1f} uT "
            f"({strength_error / expected.strength:+.0%})"
        )
        if not 0.2 < field / expected.strength < 5:
            lower(Verdict.REFUSED, text + ": look at the unit.")
        else:
            lower(Verdict.WARN if share > 0.15 else Verdict.FAIR, text + ": steel nearby, or a wrong scale.")
    dip_error = dip - expected.dip
    if abs(dip_error) > math.radians(3):
        text = f"The dip is {math.degrees(dip):.1f} deg, the model says {math.degrees(expected.dip):.1f} deg"
        sure = abs(expected.dip) > math.radians(10) and abs(dip) > math.radians(10)
        if sure and dip * expected.dip < 0:
            lower(Verdict.REFUSED, text + ": reversed, the magnetometer is mirrored or misaligned.")
        else:
            lower(
                Verdict.WARN if abs(dip_error) > math.radians(10) else Verdict.FAIR,
                text + ": steel nearby, or the magnetometer is not aligned with the accelerometer.",
            )
    if expected.horizontal < 6e-6:
        text = f"The horizontal field is only {expected.horizontal * 1e6:.1f} uT here: no good compass."
        lower(Verdict.WARN, text)
    return Check(expected, strength_error, dip_error, verdict, reasons)
