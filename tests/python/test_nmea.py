"""NMEA as arrays: what libloc finds in real logs against two independent counts; times against datetime."""

import datetime as dt
import re
from functools import reduce

import numpy as np
import pytest
from support import data_folder

import libloc
from libloc import DataError

try:
    import pynmea2
except ImportError:
    pynmea2 = None

LOGS = [
    "blumax-gps009",
    "bu303-moving",
    "bu303-nofix",
    "bu353-glonass",
    "ublox-neo-m8n",
    "ublox-zed-f9p-nmea",
]
DECODED = ("RMC", "GGA", "ZDA", "GSA", "GST", "VTG")
FIELDS = ("fields", "time", "date", "latitude", "longitude", "number", "letter")
GPS_EPOCH = dt.datetime(1980, 1, 6, tzinfo=dt.UTC)


def checksum(body: bytes) -> int:
    return reduce(lambda sum_, byte: sum_ ^ byte, body, 0)


def sentence(body: str) -> bytes:
    return f"${body}*{checksum(body.encode()):02X}\r\n".encode()


def candidates(data: bytes):
    """Everything that has the form of a sentence: body, and whether its checksum is correct."""
    for match in re.finditer(rb"\$([ -#%-)+-~]*)\*([0-9A-Fa-f]{2})", data):
        yield match[1], checksum(match[1]) == int(match[2], 16)


def independent_count(data: bytes) -> dict[str, int]:
    """By a regular expression, split and string comparison only; times of day name the epochs."""
    found = list(candidates(data))
    counts = {f"nmea.{name.lower()}": 0 for name in DECODED}
    counts |= {"nmea.bad_checksum": sum(not good for _, good in found), "nmea.unknown": 0}
    says_fix: dict[bytes, list[bool]] = {}
    for body, good in found:
        if not good:
            continue
        fields = body.split(b",")
        name = fields[0][2:].decode() if len(fields[0]) == 5 and fields[0][:1] != b"P" else ""
        if name not in DECODED:
            counts["nmea.unknown"] += 1
            continue
        counts[f"nmea.{name.lower()}"] += 1
        if name == "RMC":
            says_fix.setdefault(fields[1], []).append(fields[2] == b"A")
        if name == "GGA":
            says_fix.setdefault(fields[1], []).append(fields[6] not in (b"", b"0"))
    counts["gps.epochs"] = len(says_fix)
    counts["gps.no_fix"] = sum(not all(says) for says in says_fix.values())
    return counts


@pytest.mark.parametrize("name", LOGS)
def test_counts_of_real_logs_agree_with_an_independent_count(name):
    data = (data_folder("nmea") / f"{name}.log").read_bytes()
    got = libloc.parse_nmea(data)
    expected = independent_count(data)
    assert {key: got.counts[key] for key in expected} == expected
    assert not [key for key in got.counts if key.startswith("nmea.malformed")]
    assert got.counts["nmea.bytes"] == len(data)
    assert len(got.fix) == expected["gps.epochs"]
    assert np.count_nonzero(got.fix == 0) == expected["gps.no_fix"]
    # No fix, no position; a fix, a position.
    assert np.array_equal(np.isnan(got.latitude_longitude_altitude[:, 0]), got.fix == 0)
    assert np.array_equal(np.isnan(got.latitude_longitude_altitude[:, 1]), got.fix == 0)
    assert np.all(got.gps_times_ns[got.fix == 0] == libloc.NO_TIME)


@pytest.mark.parametrize("name", LOGS)
def test_broken_bytes_are_counted_as_the_independent_count_does(name):
    """The logs hold no wrong checksum of their own: one byte in every 300 is changed."""
    data = bytearray((data_folder("nmea") / f"{name}.log").read_bytes())
    rng = np.random.default_rng(3)
    for at in rng.choice(len(data), len(data) // 300, replace=False):
        data[at] ^= 1 << int(rng.integers(7))
    got = libloc.parse_nmea(bytes(data))
    expected = independent_count(bytes(data))
    if name in ("blumax-gps009", "bu353-glonass", "ublox-zed-f9p-nmea"):
        assert expected["nmea.bad_checksum"] > 0
    assert got.counts["nmea.bad_checksum"] == expected["nmea.bad_checksum"]
    # Two changes may leave the checksum correct: then the fields decide, which the other count does not read.
    unreadable = sum(got.counts.get(f"nmea.malformed.{field}", 0) for field in FIELDS)
    sentences = [f"nmea.{kind.lower()}" for kind in (*DECODED, "unknown")]
    assert all(got.counts[key] <= expected[key] for key in sentences)
    assert sum(got.counts[key] for key in sentences) + unreadable == sum(expected[key] for key in sentences)
    assert unreadable <= 1
    assert np.array_equal(np.isnan(got.latitude_longitude_altitude[:, 0]), got.fix == 0)


def test_the_log_without_fix_never_gives_a_position():
    path = data_folder("nmea") / "bu303-nofix.log"
    got = libloc.parse_nmea(path.read_bytes())
    assert np.all(np.isnan(got.latitude_longitude_altitude))
    assert not np.any(got.fix)
    with pytest.raises(DataError, match="SiRF"):
        libloc.open_nmea(path).read_all()


@pytest.mark.skipif(pynmea2 is None, reason="pynmea2 is not installed")
@pytest.mark.parametrize("name", LOGS)
def test_values_agree_with_pynmea2(name):
    data = (data_folder("nmea") / f"{name}.log").read_bytes()
    got = libloc.parse_nmea(data)
    expected = {}
    for body, good in candidates(data):
        if not good or body[2:5] not in (b"RMC", b"GGA") or body[:1] == b"P":
            continue
        message = pynmea2.parse(f"${body.decode()}*{checksum(body):02X}", check=True)
        row = expected.setdefault(message.timestamp, {})
        row[message.sentence_type] = message
    assert len(expected) == len(got.fix)
    compared = 0
    for i, row in enumerate(expected.values()):
        if got.fix[i] == 0:
            continue
        position = np.degrees(got.latitude_longitude_altitude[i, :2])
        for message in row.values():
            assert np.allclose(position, [message.latitude, message.longitude], rtol=0, atol=1e-11)
            compared += 1
        if "RMC" in row:
            utc = dt.datetime.combine(row["RMC"].datestamp, row["RMC"].timestamp)
            assert libloc.unix_from_gps(int(got.gps_times_ns[i])) == round(utc.timestamp() * 1e6) * 1000
        if "GGA" in row and row["GGA"].geo_sep is not None:
            height = float(row["GGA"].altitude) + float(row["GGA"].geo_sep)
            altitude = got.latitude_longitude_altitude[i, 2]
            assert np.isnan(altitude) or altitude == pytest.approx(height)
    assert (compared > 0) == (name in ("blumax-gps009", "bu353-glonass", "ublox-zed-f9p-nmea"))


RMC = "GNRMC,120000.00,A,4500.0000,N,00730.0000,E,10.0,90.0,{date},,,A"
GGA = "GNGGA,120000.00,4500.0000,N,00730.0000,E,1,09,2.0,300.0,M,{separation},M,,"


def test_options():
    data = sentence(RMC.format(date="100407")) + sentence(GGA.format(separation=""))
    plain = libloc.parse_nmea(data)
    assert np.isnan(plain.latitude_longitude_altitude[0, 2])
    assert np.all(np.isnan(plain.position_cov[0]))
    assert plain.satellites[0] == 9
    assert plain.velocity_enu[0, 0] == pytest.approx(18520 / 3600)
    told = libloc.parse_nmea(
        data,
        reference_date=dt.date(2026, 11, 22),
        geoid_separation=48.0,
        sigma_per_dop=5.0,
        leap_seconds=18,
    )
    assert told.latitude_longitude_altitude[0, 2] == 348
    assert told.position_cov.shape == (1, 3, 3)
    assert told.position_cov[0, 0, 0] == pytest.approx(50)
    seconds = (dt.datetime(2026, 11, 24, 12, tzinfo=dt.UTC) - GPS_EPOCH).total_seconds()
    assert told.gps_times_ns[0] == (seconds + 18) * 10**9
    assert told.counts["gps.rollover_mended"] == 1
    with pytest.raises(ValueError, match="geoid_separation"):
        libloc.parse_nmea(data, geoid_separation=1e3)
    with pytest.raises(AttributeError):
        libloc.parse_nmea(data, reference_date="2026-11-22")
    with pytest.raises(TypeError):
        libloc.parse_nmea("text")


def test_nothing_gives_empty_arrays():
    got = libloc.parse_nmea(b"")
    assert got.position_cov.shape == (0, 3, 3)
    assert got.latitude_longitude_altitude.shape == (0, 3)
    assert got.counts["nmea.bytes"] == 0


def test_a_log_is_a_recording(tmp_path):
    path = tmp_path / "receiver.txt"
    epoch = sentence(RMC.format(date="120419")) + sentence(GGA.format(separation="48.0"))
    path.write_bytes(b"\xb5b\x00\x01" + epoch)
    assert libloc.file_format(path) == "nmea"
    recording = libloc.read_recording(path)
    assert recording.gps.times_ns.shape == (1,)
    assert recording.gps.latitude_longitude_altitude[0, 2] == 348
    assert libloc.unix_from_gps(int(recording.gps.times_ns[0])) == 1555070400 * 10**9


def test_times_against_datetime():
    assert libloc.gps_from_unix(315_964_800 * 10**9) == 0
    for text, leap in [("1999-08-22T00:00:00", 13), ("2019-04-07T00:00:00", 18), ("2016-12-31T23:59:59", 17)]:
        utc = dt.datetime.fromisoformat(text).replace(tzinfo=dt.UTC)
        expected = round((utc - GPS_EPOCH).total_seconds() + leap) * 10**9
        unix_ns = round(utc.timestamp()) * 10**9
        assert libloc.gps_from_unix(unix_ns) == expected
        assert libloc.unix_from_gps(expected) == unix_ns
    assert libloc.gps_from_unix(0) is None
    assert libloc.leap_seconds_known_until() >= "2026-06-28"
    with pytest.raises(ValueError, match="1980 to 2260"):
        libloc.unix_from_gps(-1)
