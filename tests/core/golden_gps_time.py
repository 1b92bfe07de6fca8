"""Writes the GPS times that test_gps_time.cpp compares with, by astropy: python golden_gps_time.py"""

import datetime as dt
import random
from pathlib import Path

import erfa
from astropy.time import Time

GPS_EPOCH = Time("1980-01-06T00:00:00", scale="utc")


def gps_ns(year: int, month: int, day: int, second_of_day: int, nanosecond: int) -> int:
    """Whole days by astropy, the rest in integers: exact."""
    midnight = Time(f"{year:04d}-{month:02d}-{day:02d}T00:00:00", scale="utc")
    seconds = (midnight - GPS_EPOCH).sec
    assert abs(seconds - round(seconds)) < 1e-4, seconds
    return (round(seconds) + second_of_day) * 10**9 + nanosecond


def row(day: dt.date, second_of_day: int, nanosecond: int) -> str:
    minute = min(second_of_day // 60, 1439)
    clock = f"{minute // 60}, {minute % 60}, {second_of_day - 60 * minute}, {nanosecond}"
    value = gps_ns(day.year, day.month, day.day, second_of_day, nanosecond)
    return f"{{{{{{{day.year}, {day.month}, {day.day}}}, {clock}}}, {value}LL}},\n"


rows = []
for step in erfa.leap_seconds.get():
    first = dt.date(int(step["year"]), int(step["month"]), 1)
    if first <= dt.date(1980, 1, 6):
        continue
    last = first - dt.timedelta(days=1)
    rows += [row(last, 86399, 999_999_999), row(last, 86400, 0)]
    rows += [row(last, 86400, 999_999_999), row(first, 0, 0)]
for year in range(1980, 2041):
    rows += [row(dt.date(year, 12, 31), 86399, 5), row(dt.date(year + 1, 1, 1), 0, 0)]
    rows.append(row(dt.date(year, 2, 28) + dt.timedelta(days=1), 43200, 123_456_789))
for rollover in (dt.date(1999, 8, 22), dt.date(2019, 4, 7), dt.date(2038, 11, 21)):
    rows += [row(rollover - dt.timedelta(days=1), 86340 + k, 0) for k in range(40, 60)]
rng = random.Random(1)
for _ in range(60):
    day = dt.date(1980, 1, 6) + dt.timedelta(days=rng.randrange(20_000))
    rows.append(row(day, rng.randrange(86_400), rng.randrange(10**9)))
(Path(__file__).parent / "golden_gps_time.inc").write_text("".join(rows))
