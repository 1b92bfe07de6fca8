"""The magnetic model against published values, and the check of a measured field."""

import datetime
import math

import pytest
from libloc.magnetic_model import check, decimal_year, earth_field

from libloc import Verdict


# MATLAB's documentation of wrldmagm: declination, dip [deg], strength, horizontal strength [nT].
@pytest.mark.parametrize(
    ("year", "declination", "dip", "strength", "horizontal"),
    [(2028, -13.6891, 65.9899, 50940, 20727), (2020, -14.2536, 66.8184, 51733, 20364)],
)
def test_against_another_implementation(year, declination, dip, strength, horizontal):
    f = earth_field(math.radians(42.283), math.radians(-71.35), 1000, datetime.date(year, 7, 4))
    assert math.degrees(f.declination) == pytest.approx(declination, abs=1e-4)
    assert math.degrees(f.dip) == pytest.approx(dip, abs=1e-4)
    assert f.strength * 1e9 == pytest.approx(strength, abs=1)
    assert f.horizontal * 1e9 == pytest.approx(horizontal, abs=1)
    assert f.model == f"WMM-{5 * (year // 5)}"


# Some of the test values that come with WMM-2025: year, height [km], latitude, longitude, declination [deg].
@pytest.mark.parametrize(
    ("year", "height", "latitude", "longitude", "declination"),
    [
        (2025.0, 0, 80, 0, 1.28),
        (2025.0, 0, -80, 240, 68.78),
        (2027.5, 100, 80, 0, 2.16),
        (2027.5, 0, 0, 120, -0.24),
        (2025.0, 28, 89, -121, -99.77),
        (2025.5, 6, -36, -137, 20.28),
    ],
)
def test_published_declinations(year, height, latitude, longitude, declination):
    f = earth_field(math.radians(latitude), math.radians(longitude), height * 1e3, year)
    assert math.degrees(f.declination) == pytest.approx(declination, abs=0.006)


def test_components_and_signs():
    berlin = earth_field(math.radians(52.51), math.radians(13.33), 40, datetime.date(2019, 6, 1))
    east, north, up = berlin.enu
    assert north > 0
    assert up < 0
    assert math.hypot(*berlin.enu) == pytest.approx(berlin.strength, rel=1e-9)
    assert math.atan2(east, north) == pytest.approx(berlin.declination, abs=1e-9)
    assert math.atan2(-up, math.hypot(east, north)) == pytest.approx(berlin.dip, abs=1e-9)
    assert 66 < math.degrees(berlin.dip) < 69
    assert berlin.model.startswith("WMM-2015")
    sydney = earth_field(math.radians(-33.9), math.radians(151.2), 0, 2026.5)
    assert sydney.dip < math.radians(-60)
    # Longitudes that are a turn apart are one place.
    other = earth_field(math.radians(-33.9), math.radians(151.2 - 360), 0, 2026.5)
    assert other.strength == pytest.approx(sydney.strength, rel=1e-12)
    assert 0 < sydney.dip_sigma < math.radians(0.5)
    assert 0 < sydney.strength_sigma < 0.5e-6


def test_years():
    assert decimal_year(datetime.date(2026, 1, 1)) == 2026
    assert decimal_year(datetime.datetime(2024, 7, 2)) == 2024.5
    east = datetime.timezone(datetime.timedelta(hours=2))
    assert decimal_year(datetime.datetime(2026, 1, 1, 2, tzinfo=east)) == 2026
    assert earth_field(0.9, 0.2, 0, 2012.0).model.startswith("WMM-2010")
    assert earth_field(0.9, 0.2, 0, 2029.99).model == "WMM-2025"
    # The models meet at their borders.
    before, after = earth_field(0.9, 0.2, 0, 2024.999), earth_field(0.9, 0.2, 0, 2025.0)
    assert before.strength == pytest.approx(after.strength, rel=2e-3)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ((52.5, 0.2, 0, 2026), "latitude"),
        ((math.nan, 0.2, 0, 2026), "latitude"),
        ((0.9, 13.3, 0, 2026), "longitude"),
        ((0.9, 0.2, 1e9, 2026), "altitude"),
        ((0.9, 0.2, 0, 2030.0), "date"),
        ((0.9, 0.2, 0, 2009.9), "date"),
        ((0.9, 0.2, 0, math.nan), "date"),
    ],
)
def test_refuses(arguments, name):
    with pytest.raises(ValueError, match=f"^{name} = "):
        earth_field(*arguments)


def test_check():
    place = (math.radians(52.51), math.radians(13.33), 40, 2026.5)
    expected = earth_field(*place)
    good = check(*place, field=expected.strength * 1.01, dip=expected.dip - 0.01)
    assert good.verdict == Verdict.OK
    assert not good.reasons
    assert good.strength_error == pytest.approx(0.01 * expected.strength)
    assert good.dip_error == pytest.approx(-0.01)
    assert check(*place, field=expected.strength * 1.1).verdict == Verdict.FAIR
    assert check(*place, field=expected.strength * 0.8).verdict == Verdict.WARN
    assert check(*place, dip=expected.dip - math.radians(5)).verdict == Verdict.FAIR
    wrong_unit = check(*place, field=48.0, dip=expected.dip)
    assert wrong_unit.verdict == Verdict.REFUSED
    assert "unit" in wrong_unit.reasons[0]
    reversed_field = check(*place, field=expected.strength, dip=-expected.dip)
    assert reversed_field.verdict == Verdict.REFUSED
    assert "mirrored" in reversed_field.reasons[0]
    assert math.isnan(check(*place, dip=expected.dip).strength_error)
    assert check(math.radians(86), math.radians(135), 0, 2026.5, dip=1.57).verdict == Verdict.WARN
    for bad in ({"field": -1.0}, {"dip": 3.0}, {"field": math.inf}, {}):
        with pytest.raises(ValueError, match=r"field|dip"):
            check(*place, **bad)
