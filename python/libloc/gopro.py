"""The IMU and the GPS that a GoPro writes into its videos (GPMF), through the package telemetry-parser.

What GoPro says of GPMF (github.com/gopro/gpmf-parser) and what is made of it here:

Axes. GoPro names the body's axes X to the left, Y out of the back and Z up (as the camera sees it, held
upright); the tag ORIN says which of them each channel is, small letters reversed. Without the tag the
model tells (HERO5, HERO6, Fusion), otherwise the HERO5's order is taken and Telemetry.axes_known is
False. Samples are given in axes parallel to the picture's: x right, y down, z forward, so that at rest
and upright the specific force is near (0, -9.8, 0) and the rotation from IMU to camera near unity. That
is the maker's convention, not a calibration; a published one of a HERO10 (ORB-SLAM3 settings of the
Universal Manipulation Interface) agrees to half a degree.

Times. Zero is the beginning of the first payload, and the video's first picture is taken to be there,
too. GPMF has no finer tie between the two: a constant of some milliseconds may remain, which the
calibration of camera and IMU finds. Where payloads have microseconds (STMP), samples lie evenly between
those; otherwise evenly over the whole track. GPS fixes come late by what the receiver takes.
"""

from __future__ import annotations

import struct
from collections import Counter
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from libloc._core import DataError, GpsFixType

_MISSING = (
    "reading a GoPro's telemetry needs the Python package telemetry-parser: pip install telemetry-parser"
)

# Rows: right, down and forward in GoPro's X (left), Y (back), Z (up).
R_CAMERA_GOPRO = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]])

# Channel order of cameras that do not write ORIN, by a word in the model's name.
_ORDER_OF_MODEL = {"HERO5": "ZXY", "HERO6": "YxZ", "Fusion": "yXZ"}
_UNITS = {
    "Gyroscope": {"rad/s": 1.0, "deg/s": np.pi / 180, "°/s": np.pi / 180},
    "Accelerometer": {"m/s²": 1.0, "m/s^2": 1.0, "m/s2": 1.0},
}
_LATEST_US = 10**15  # thirty years after the camera was switched on
# As struct names GPMF's type letters.
_STRUCT = {"b": "b", "B": "B", "s": "h", "S": "H", "l": "i", "L": "I", "f": "f", "d": "d", "j": "q", "J": "Q"}


class MissingTelemetryParser(RuntimeError):
    """The optional package is not installed; the text has the line that installs it."""


@dataclass
class GoproImu:
    """Axes x right, y down, z forward. N rows."""

    times_ns: NDArray[np.int64]  # (N,), increasing
    angular_velocity: NDArray[np.float64]  # (N, 3) [rad/s]
    specific_force: NDArray[np.float64]  # (N, 3) [m/s^2], interpolated where its rate is another


@dataclass
class GoproGps:
    """N fixes; those without lock are not here."""

    times_ns: NDArray[np.int64]  # (N,), increasing, on the clock of the IMU
    latitude_longitude_altitude: NDArray[np.float64]  # (N, 3) [rad, rad, m]
    speed: NDArray[np.float64]  # (N,) over ground [m/s]
    dop: NDArray[np.float64]  # (N,) dilution of precision, NaN where it is not told
    fix: NDArray[np.int64]  # (N,) GpsFixType
    above_sea_level: bool  # the altitude is that above mean sea level, not above the ellipsoid


@dataclass
class Telemetry:
    path: Path
    model: str
    imu: GoproImu
    gps: GoproGps
    axes_known: bool  # the file or the model tells the order of the axes
    stamped: bool  # the IMU's payloads have times of their own
    counts: dict[str, int]  # what was read and skipped, and why


@dataclass
class _Stream:
    """One sensor over all payloads."""

    rows: NDArray[np.float64]  # (N, M)
    index: NDArray[np.int64]  # (N,) since the first sample, with those that are missing
    starts: NDArray[np.int64]  # (K,) index of the payloads' first samples
    stamps_us: NDArray[np.int64] | None  # (K,) of those
    missing: int


def read_telemetry(path: str | PathLike[str], *, start_time_ns: int = 0) -> Telemetry:
    """
    start_time_ns: added to all times; the same as that of the video (open_video).
    counts: imu.read; imu.missing, samples that the camera counted but that are not in the file;
    imu.payloads_uneven, where less than half or more than twice the usual time lies between samples;
    imu.skipped.time_not_increasing, .not_finite, .no_accelerometer (outside of its times); gps.read;
    gps.skipped.no_fix, .not_a_place, .time_not_increasing.
    Raises DataError naming file and reason when there is no such telemetry, MissingTelemetryParser,
    ValueError for a start time beyond 2^62 ns.
    """
    path = Path(path)
    if abs(start_time_ns) > 2**62:
        raise ValueError(f"start_time_ns is {start_time_ns}, beyond 2^62")
    payloads, name, duration_s = _parse(path)
    counts: Counter[str] = Counter()
    streams = {}
    known = True
    for group in ("Gyroscope", "Accelerometer"):
        parts = [p[group] for p in payloads if _samples(p.get(group))]
        if not parts:
            raise DataError(f"{path}: no samples of the {group.lower()} in its GoPro telemetry")
        stream = _stream(path, group.lower(), parts, _vectors(path, group, parts))
        rotation, told = _rotation(path, group, parts, name)
        known = known and told
        stream.rows = stream.rows @ rotation.T
        counts["imu.missing"] += stream.missing
        streams[group] = stream
    gyro, accel = streams["Gyroscope"], streams["Accelerometer"]
    gps_stream, above_sea = _gps_stream(path, payloads)

    stamps = [s.stamps_us for s in (gyro, accel)]
    stamped = all(s is not None and len(s) > 1 for s in stamps)
    zero_us = min(int(s[0]) for s in stamps if s is not None) if stamped else None
    imu = _imu(path, gyro, accel, zero_us, duration_s, counts)
    gps = _gps(path, gps_stream, zero_us, duration_s, counts, above_sea)
    imu.times_ns += start_time_ns
    gps.times_ns += start_time_ns
    return Telemetry(path, name, imu, gps, known, stamped, {k: v for k, v in counts.items() if v})


def _parse(path: Path) -> tuple[list[dict[str, Any]], str, float | None]:
    """The payloads, the camera's name, and how long they last together [s], if the parser tells."""
    try:
        import telemetry_parser
    except ImportError:
        raise MissingTelemetryParser(_MISSING) from None
    if not path.is_file():
        raise DataError(f"{path}: no such file")
    try:
        parser = telemetry_parser.Parser(str(path))
        camera = parser.camera
        payloads = parser.telemetry() if camera == "GoPro" else []
        times_ms = [sample["timestamp_ms"] for sample in parser.normalized_imu()] if payloads else []
    except (KeyboardInterrupt, SystemExit, GeneratorExit):
        raise
    except BaseException as error:  # a panic of its Rust code is no Exception
        raise DataError(
            f"{path}: no GoPro telemetry can be read (no such track, not a GoPro's video, or damaged): "
            f"{error}"
        ) from None
    if camera != "GoPro":
        raise DataError(f"{path}: holds telemetry of {camera}, not of a GoPro")
    names = [p.get("Default", {}).get("Name") for p in payloads]
    name = parser.model or next((n for n in names if isinstance(n, str) and n), "GoPro")
    if len(times_ms) < 2:
        return payloads, name, None
    step_ms = (times_ms[-1] - times_ms[0]) / (len(times_ms) - 1)
    return payloads, name, step_ms * len(times_ms) / 1000


def _samples(group: dict[str, Any] | None) -> int:
    data = None if group is None else group.get("Data")
    return len(data) if isinstance(data, list) else 0


def _vectors(path: Path, group: str, parts: list[dict[str, Any]]) -> list[NDArray[np.float64]]:
    """In SI units, in the order of the channels."""
    out = []
    for part in parts:
        unit = part.get("Unit")
        if not isinstance(unit, str) or unit not in _UNITS[group]:
            raise DataError(
                f"{path}: unit of the {group.lower()} is {unit!r}, not {next(iter(_UNITS[group]))}"
            )
        try:
            rows = np.array([[v["x"], v["y"], v["z"]] for v in part["Data"]], dtype=float)
        except (TypeError, KeyError, ValueError):
            raise DataError(f"{path}: samples of the {group.lower()} do not have three axes") from None
        out.append(rows / _scale(path, group.lower(), part) * _UNITS[group][unit])
    return out


def _scale(path: Path, group: str, part: dict[str, Any], count: int = 1) -> NDArray[np.float64]:
    try:
        scale = np.atleast_1d(np.array(part.get("Scale", 1), dtype=float))
    except (TypeError, ValueError):
        scale = np.zeros(1)
    if scale.ndim != 1 or len(scale) not in (1, count) or not (np.isfinite(scale) & (scale != 0)).all():
        raise DataError(f"{path}: scale of the {group} is {part.get('Scale')}")
    return scale


def _stream(path: Path, what: str, parts: list[dict[str, Any]], rows: list[NDArray[np.float64]]) -> _Stream:
    """With the camera's own count of samples (TSMP), so that a lost payload does not stretch the others."""
    lengths = np.array([len(r) for r in rows])
    starts = np.concatenate(([0], np.cumsum(lengths)[:-1]))
    totals = [part.get("Count") for part in parts]
    if all(isinstance(total, int) for total in totals):
        starts = np.array(totals, dtype=np.int64) - lengths
        starts -= starts[0]
        if (starts[1:] < starts[:-1] + lengths[:-1]).any():
            raise DataError(f"{path}: the count of samples of the {what} (TSMP) steps back")
    index = np.concatenate([start + np.arange(n) for start, n in zip(starts, lengths, strict=True)])
    stamps = [part.get("TimestampUs") for part in parts]
    stamps_us = None
    if all(isinstance(s, int) for s in stamps):
        if max(map(abs, stamps)) > _LATEST_US:
            raise DataError(f"{path}: a time of the {what} (STMP) is {max(stamps, key=abs)} us")
        stamps_us = np.array(stamps, dtype=np.int64)
    missing = int(index[-1] + 1 - lengths.sum())
    return _Stream(np.concatenate(rows), index, starts, stamps_us, missing)


def _rotation(
    path: Path, group: str, parts: list[dict[str, Any]], model: str
) -> tuple[NDArray[np.float64], bool]:
    """From channels to right, down, forward; and whether the order is known."""
    order = parts[0].get("OrientationIn")
    other = next((p.get("OrientationIn") for p in parts if p.get("OrientationIn") != order), order)
    if other != order:
        raise DataError(f"{path}: the axes of the {group.lower()} (ORIN) change from {order!r} to {other!r}")
    known = order is not None
    if order is None:
        order = next((o for word, o in _ORDER_OF_MODEL.items() if word.lower() in model.lower()), None)
        known = order is not None
        order = order or "ZXY"
    if not isinstance(order, str) or sorted(order.upper()) != ["X", "Y", "Z"]:
        raise DataError(f"{path}: the axes of the {group.lower()} (ORIN) are {order!r}, not X, Y and Z")
    gopro_of_channels = np.zeros((3, 3))
    for channel, letter in enumerate(order):
        gopro_of_channels["XYZ".index(letter.upper()), channel] = 1 if letter.isupper() else -1
    return R_CAMERA_GOPRO @ gopro_of_channels, known


def _times(
    path: Path, what: str, stream: _Stream, zero_us: int | None, duration_s: float | None
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """[ns], and which samples to keep: a payload stamped no later than one before is left out whole."""
    keep = np.ones(len(stream.index), dtype=bool)
    if zero_us is None or stream.stamps_us is None or len(stream.stamps_us) < 2:
        if stream.missing:
            raise DataError(
                f"{path}: {stream.missing} samples of the {what} are missing, and its payloads have no times "
                "(STMP) to tell when those that are there were taken"
            )
        if duration_s is None:
            raise DataError(f"{path}: nothing tells the times of the {what}")
        return np.rint(stream.index * (duration_s * 1e9 / len(stream.index))).astype(np.int64), keep
    starts, stamps = stream.starts, stream.stamps_us - zero_us
    later = np.ones(len(stamps), dtype=bool)
    later[1:] = stamps[1:] > np.maximum.accumulate(stamps)[:-1]
    for k in np.flatnonzero(~later):
        end = starts[k + 1] if k + 1 < len(starts) else stream.index[-1] + 1
        keep &= (stream.index < starts[k]) | (stream.index >= end)
    starts, stamps = starts[later], stamps[later]
    if len(stamps) < 2:
        raise DataError(f"{path}: the times of the {what} (STMP) do not increase")
    # Beyond the last stamp at the mean rate up to it.
    step_us = (stamps[-1] - stamps[0]) / (starts[-1] - starts[0])
    end = stream.index[-1] + 1
    times_us = np.interp(stream.index, [*starts, end], [*stamps, stamps[-1] + step_us * (end - starts[-1])])
    return np.rint(times_us * 1000).astype(np.int64), keep


def _uneven(stream: _Stream) -> int:
    """Payloads between whose samples lies less than half or more than twice as long as usual."""
    if stream.stamps_us is None or len(stream.stamps_us) < 3:
        return 0
    steps = np.diff(stream.stamps_us) / np.diff(stream.starts)
    usual = np.median(steps)
    return int(((steps > 2 * usual) | ((steps > 0) & (steps < usual / 2))).sum())


def _imu(
    path: Path,
    gyro: _Stream,
    accel: _Stream,
    zero_us: int | None,
    duration_s: float | None,
    counts: Counter[str],
) -> GoproImu:
    sides = []
    for name, stream in (("gyroscope", gyro), ("accelerometer", accel)):
        times, keep = _times(path, name, stream, zero_us, duration_s)
        counts["imu.skipped.time_not_increasing"] += int((~keep).sum())
        counts["imu.payloads_uneven"] += _uneven(stream)
        finite = np.isfinite(stream.rows).all(axis=1)
        counts["imu.skipped.not_finite"] += int((keep & ~finite).sum())
        keep &= finite
        sides.append((times[keep], stream.rows[keep]))
    (times, rate), (force_times, force) = sides
    if len(times) == 0 or len(force_times) == 0:
        raise DataError(f"{path}: not one usable sample of gyroscope and accelerometer")
    # Up to one step beyond its last sample the accelerometer's last value stands.
    step = int(np.median(np.diff(force_times))) if len(force_times) > 1 else 0
    inside = (times >= force_times[0] - step) & (times <= force_times[-1] + step)
    counts["imu.skipped.no_accelerometer"] += int((~inside).sum())
    times, rate = times[inside], rate[inside]
    force = np.stack([np.interp(times, force_times, force[:, i]) for i in range(3)], axis=1)
    counts["imu.read"] = len(times)
    return GoproImu(times, rate, force)


def _gps_stream(path: Path, payloads: list[dict[str, Any]]) -> tuple[_Stream | None, bool]:
    """Rows of latitude, longitude [deg], altitude, speed, DOP, fix; of GPS9 where there is one, else GPS5."""
    nine = [p["GPS9"] for p in payloads if "GPS9" in p and _raw(p["GPS9"], "GPS9") is not None]
    five = [p["GPS"] for p in payloads if _samples(p.get("GPS"))]
    parts = nine or five
    if not parts:
        return None, False
    rows = [_gps9(path, p) for p in nine] if nine else [_gps5(path, p) for p in five]
    parts = [part for part, r in zip(parts, rows, strict=True) if len(r)]
    rows = [r for r in rows if len(r)]
    if not parts:
        return None, False
    above_sea = any(_raw(part, "GPSA") == "MSLV" for part in parts)
    return _stream(path, "GPS", parts, rows), above_sea


def _raw(group: dict[str, Any], key: str) -> Any:
    """A tag that the parser names by its number."""
    return group.get(f"0x{int.from_bytes(key.encode(), 'big'):08X}")


def _gps5(path: Path, part: dict[str, Any]) -> NDArray[np.float64]:
    try:
        rows = np.array(part["Data"], dtype=float)
    except (TypeError, ValueError):
        rows = np.zeros(0)
    if rows.ndim != 2 or rows.shape[1] != 5:
        raise DataError(f"{path}: fixes (GPS5) do not have five numbers each")
    rows = rows / _scale(path, "GPS5", part, 5)
    dop, fix = _raw(part, "GPSP"), _raw(part, "GPSF")
    ones = np.ones(len(rows))
    dop_column = ones * (dop / 100 if isinstance(dop, int) else np.nan)
    # A camera that does not say has no way to say that there is no lock, either.
    return np.column_stack([rows[:, :4], dop_column, ones * (fix if isinstance(fix, int) else 0)])


def _gps9(path: Path, part: dict[str, Any]) -> NDArray[np.float64]:
    """The parser leaves structures as bytes: 8 of key, type, size and number, then values as TYPE says."""
    raw, letters = _raw(part, "GPS9"), _raw(part, "TYPE")
    try:
        data = bytes(raw)
    except (TypeError, ValueError):
        raise DataError(f"{path}: fixes (GPS9) are {str(raw)[:40]}, not a structure") from None
    if not isinstance(letters, str) or len(letters) != 9 or any(c not in _STRUCT for c in letters):
        raise DataError(f"{path}: the type of fixes (GPS9) is {letters!r}, not nine numbers")
    form = ">" + "".join(_STRUCT[c] for c in letters)
    size, repeat = int.from_bytes(data[5:6]), int.from_bytes(data[6:8])
    if len(data) < 8 or size != struct.calcsize(form) or len(data) < 8 + size * repeat:
        raise DataError(f"{path}: fixes (GPS9) of {size} bytes do not fit their type {letters}")
    values = list(struct.iter_unpack(form, data[8 : 8 + size * repeat]))
    rows = np.array(values, dtype=float).reshape(-1, 9) / _scale(path, "GPS9", part, 9)
    return rows[:, [0, 1, 2, 3, 7, 8]]


def _gps(
    path: Path,
    stream: _Stream | None,
    zero_us: int | None,
    duration_s: float | None,
    counts: Counter[str],
    above_sea: bool,
) -> GoproGps:
    if stream is None:
        none = np.zeros(0)
        return GoproGps(np.zeros(0, np.int64), np.zeros((0, 3)), none, none, np.zeros(0, np.int64), False)
    times, keep = _times(path, "GPS", stream, zero_us, duration_s)
    counts["gps.skipped.time_not_increasing"] += int((~keep).sum())
    rows = stream.rows
    lock = np.isin(rows[:, 5], (2, 3))
    counts["gps.skipped.no_fix"] += int((keep & ~lock).sum())
    keep &= lock
    usable = np.isfinite(rows[:, :4]).all(axis=1) & (abs(rows[:, 0]) <= 90) & (abs(rows[:, 1]) <= 180)
    counts["gps.skipped.not_a_place"] += int((keep & ~usable).sum())
    keep &= usable
    rows = rows[keep]
    place = rows[:, :3] * [np.pi / 180, np.pi / 180, 1]
    fix = np.where(rows[:, 5] == 3, int(GpsFixType.FIX_3D), int(GpsFixType.FIX_2D))
    counts["gps.read"] = len(rows)
    return GoproGps(times[keep], place, rows[:, 3], rows[:, 4], fix, above_sea)


def write_csv(telemetry: Telemetry, path: str | PathLike[str]) -> None:
    """A recording that libloc.read_recording reads: IMU, and GPS fixes (without deviations: DOP is none)."""
    imu, gps = telemetry.imu, telemetry.gps
    heading = "time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2"
    numbers = np.column_stack([imu.angular_velocity, imu.specific_force]).tolist()
    times = imu.times_ns.tolist()
    empty = ""
    lines = []
    if len(gps.times_ns):
        heading += ",latitude_rad,longitude_rad,altitude_m,fix"
        empty = ",,,,"
        fixes = zip(
            gps.times_ns.tolist(), gps.latitude_longitude_altitude.tolist(), gps.fix.tolist(), strict=True
        )
        lines = [(t, 0, f"{t},,,,,,,{','.join(map(repr, place))},{fix}") for t, place, fix in fixes]
    lines += [(t, 1, f"{t},{','.join(map(repr, row))}{empty}") for t, row in zip(times, numbers, strict=True)]
    lines.sort(key=lambda line: line[:2])
    with Path(path).open("w", encoding="ascii", newline="\n") as file:
        file.write(heading + "\n")
        file.writelines(line[2] + "\n" for line in lines)
