"""What loc-calibrate reads: the triads of one or more recordings, in SI units or in the sensor's own counts.

Recordings of libloc (EuRoC folder, CSV with a heading, BROAD trial, LCM log) are read by libloc itself. This
file adds the text files that are no recordings: without time, with half an IMU, without a heading, in counts,
and the tables of imu-tk (*.mat as text: time in seconds and three readings a line).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import DataError

GRAVITY = 9.80665
COUNTS = "counts"
TRIADS = ("gyroscope", "accelerometer", "magnetometer")
SI = {"gyroscope": "rad/s", "accelerometer": "m/s²", "magnetometer": "T"}
UNITS: dict[str, dict[str, float]] = {
    "gyroscope": {
        "rad/s": 1.0,
        "rad_s": 1.0,
        "deg/s": math.pi / 180,
        "deg_s": math.pi / 180,
        "dps": math.pi / 180,
    },
    "accelerometer": {"m/s^2": 1.0, "m/s2": 1.0, "m_s2": 1.0, "g": GRAVITY, "mg": GRAVITY * 1e-3},
    "magnetometer": {"T": 1.0, "mT": 1e-3, "uT": 1e-6, "nT": 1e-9, "gauss": 1e-4, "mgauss": 1e-7},
}
TIME_UNITS = {"ns": 0, "us": 3, "ms": 6, "s": 9}  # power of ten that makes nanoseconds
_PREFIXES = {"g": 0, "w": 0, "gyr_": 0, "gyro_": 0, "a": 1, "acc_": 1, "m": 2, "mag_": 2}
_TIME_NAMES = ("t", "ts", "time", "timestamp")


@dataclass
class Triad:
    """Readings of one three-axis sensor."""

    rows: NDArray[np.float64]  # (N, 3)
    times_ns: NDArray[np.int64] | None  # None: the file has no time
    unit: str  # SI's, or "counts"

    def __len__(self) -> int:
        return len(self.rows)


def same_times(a: Triad, b: Triad) -> bool:
    """Read together: sample by sample at the same times."""
    return a.times_ns is not None and b.times_ns is not None and np.array_equal(a.times_ns, b.times_ns)


@dataclass
class Readings:
    """What one calibration takes: a sensor that is absent is None."""

    name: str  # of where it comes from, for messages
    form: str
    gyroscope: Triad | None = None
    accelerometer: Triad | None = None
    magnetometer: Triad | None = None
    counts: dict[str, int] = field(default_factory=dict)  # what was read and skipped

    def need(self, name: str) -> Triad:
        """Raises DataError when the sensor is absent, saying what there is."""
        triad: Triad | None = getattr(self, name)
        if triad is None:
            there = [f"{other} ({len(t)})" for other in TRIADS if (t := getattr(self, other)) is not None]
            raise DataError(f"{self.name}: no {name} in it; it holds {', '.join(there) or 'nothing'}")
        return triad

    def need_times(self, name: str) -> tuple[Triad, NDArray[np.int64]]:
        triad = self.need(name)
        if triad.times_ns is None:
            raise DataError(
                f"{self.name}: no time in it: say with --rate how many readings there are a second"
            )
        return triad, triad.times_ns


@dataclass(frozen=True)
class InputOptions:
    """How text without units or heading is to be understood."""

    columns: str | None = None  # "ax,ay,az,mx,my,mz"; a column "-" is passed over
    time_unit: str | None = None
    gyroscope_unit: str | None = None
    accelerometer_unit: str | None = None
    magnetometer_unit: str | None = None
    rate_hz: float | None = None  # of files without time

    def unit(self, triad: str) -> str | None:
        value: str | None = getattr(self, f"{triad}_unit")
        return value


@dataclass(frozen=True)
class _Column:
    quantity: str  # "time", one of TRIADS, "-"
    axis: int
    unit: str | None


def _column(text: str) -> _Column | None:
    """None for a heading that is not understood."""
    text = text.strip().lstrip("#").strip()
    if text == "-":
        return _Column("-", 0, None)
    bracket = re.fullmatch(r"([^\[]*?)\s*\[([^\]]*)\]", text)
    if bracket:
        splits = [(bracket[1], bracket[2].replace(" ", ""))]
    else:
        # In "acc_x_m_s2" only the names tell where the unit begins.
        splits = [(text, "")] + [(text[:i], text[i + 1 :]) for i, c in enumerate(text) if c == "_"]
    for name, unit in splits:
        name = name.lower()
        if name in _TIME_NAMES:
            return _Column("time", 0, unit or None)
        if name and name[-1] in "xyz" and name[:-1] in _PREFIXES:
            return _Column(TRIADS[_PREFIXES[name[:-1]]], "xyz".index(name[-1]), unit or None)
    return None


def _find_unit(quantity: str, written: str | None, options: InputOptions, what: str) -> str:
    """A key of UNITS[quantity], or "counts"."""
    given = options.unit(quantity)
    if written is not None and written not in (COUNTS, "arb", "raw"):
        if given is not None:
            raise DataError(
                f"{what}: its unit is written already; --{quantity}-unit {given} contradicts that"
            )
        for known in UNITS[quantity]:
            if written.lower() == known.lower():
                return known
        raise DataError(
            f"{what}: unit '{written}' is not known; known are {', '.join(UNITS[quantity])}, {COUNTS}"
        )
    if written is not None and given in (None, COUNTS):
        return COUNTS
    if given is None:
        raise DataError(
            f"{what}: no unit: give --{quantity}-unit, one of {', '.join(UNITS[quantity])}, {COUNTS} (the "
            "sensor's own)"
        )
    return given


def _check_columns(columns: Sequence[_Column | None], texts: Sequence[str], where: str) -> list[_Column]:
    out: list[_Column] = []
    for column, text in zip(columns, texts, strict=True):
        if column is None:
            raise DataError(
                f"{where}: column '{text.strip()}' is not known; known are t, gx gy gz, ax ay az, mx my mz, "
                "and - for "
                "a column to pass over"
            )
        if column.quantity != "-" and any(
            (c.quantity, c.axis) == (column.quantity, column.axis) for c in out
        ):
            raise DataError(f"{where}: column '{text.strip()}' comes twice")
        out.append(column)
    for triad in TRIADS:
        axes = sum(column.quantity == triad for column in out)
        if axes not in (0, 3):
            raise DataError(f"{where}: {axes} of the 3 columns of the {triad}")
    if not any(column.quantity in TRIADS for column in out):
        raise DataError(f"{where}: no column holds readings")
    return out


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.split(",")] if "," in line else line.split()


def _first_line(path: Path, comments: bool) -> tuple[int, str]:
    """Number and text of the first line that is not blank, nor a comment unless comments; (0, "") if none."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for number, line in enumerate(file, start=1):
            text = line.strip()
            if text and (comments or not text.startswith("#")):
                return number, text
    return 0, ""


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _parse_time(text: str, unit: str, where: str) -> int:
    """Nanoseconds, exact: a float of seconds since 1970 is not. Raises DataError."""
    try:
        ns = int((Decimal(text) * 10 ** TIME_UNITS[unit]).to_integral_value())
    except (InvalidOperation, ValueError, OverflowError):
        raise DataError(f"{where}: '{text}' is no time in {unit}") from None
    if not -(2**63) < ns < 2**63:
        raise DataError(f"{where}: '{text}' is no time in {unit}: out of range")
    return ns


def _read_table(path: Path, columns: list[_Column], heading: int, options: InputOptions) -> Readings:
    """Rows of numbers, one column for each of columns. heading: number of its line, 0 for none."""
    out = Readings(str(path), "table")
    width = len(columns)
    time_at = next((i for i, c in enumerate(columns) if c.quantity == "time"), None)
    time_unit = "s"
    if time_at is not None:
        written = columns[time_at].unit
        time_unit = written or options.time_unit or ""
        if time_unit not in TIME_UNITS:
            raise DataError(
                f"{path}: the time has the unit '{time_unit}': give --time-unit, one of "
                f"{', '.join(TIME_UNITS)}"
            )
    places: dict[str, list[int]] = {}
    for triad in TRIADS:
        at = [
            next((i for i, c in enumerate(columns) if (c.quantity, c.axis) == (triad, axis)), -1)
            for axis in range(3)
        ]
        if at[0] >= 0:
            places[triad] = at
    values: dict[str, list[list[float]]] = {triad: [] for triad in places}
    times: dict[str, list[int]] = {triad: [] for triad in places}
    with path.open(encoding="utf-8-sig", errors="replace", newline=None) as file:
        for number, line in enumerate(file, start=1):
            text = line.strip()
            if number == heading or not text or text.startswith("#"):
                continue
            if not line.endswith("\n"):
                # Cut while it was written: the last number may have lost digits.
                out.counts["rows.skipped.no_line_end"] = 1
                break
            cells = _cells(text)
            if len(cells) != width:
                raise DataError(f"{path}:{number}: {len(cells)} cells, not {width}")
            time = 0
            if time_at is not None:
                time = _parse_time(cells[time_at], time_unit, f"{path}:{number}")
            for triad, at in places.items():
                texts = [cells[i] for i in at]
                if not any(texts):
                    continue  # a sensor at its own rate
                try:
                    values[triad].append([float(cell) for cell in texts])
                except ValueError:
                    raise DataError(
                        f"{path}:{number}: {triad}: '{', '.join(texts)}' are not three numbers"
                    ) from None
                times[triad].append(time)
    for triad, at in places.items():
        if not values[triad]:
            continue
        units = [
            _find_unit(triad, columns[i].unit, options, f"{path}: {triad}, column of {axis}")
            for i, axis in zip(at, "xyz", strict=True)
        ]
        rows = np.array(values[triad])
        stamps = None
        if time_at is not None:
            stamps = np.array(times[triad], dtype=np.int64)
        elif options.rate_hz is not None:
            stamps = np.rint(np.arange(len(rows)) * (1e9 / options.rate_hz)).astype(np.int64)
        if COUNTS in units:
            if any(unit != COUNTS for unit in units):
                named = ", ".join(f"{axis} in {unit}" for axis, unit in zip("xyz", units, strict=True))
                raise DataError(f"{path}: {triad}: {named}: all three in counts, or none")
            setattr(out, triad, Triad(rows, stamps, COUNTS))
        else:
            rows = rows * [UNITS[triad][unit] for unit in units]  # each column has its own
            setattr(out, triad, Triad(rows, stamps, SI[triad]))
        out.counts[f"{triad}.read"] = len(rows)
    if not any(getattr(out, triad) is not None for triad in TRIADS):
        raise DataError(f"{path}: no readings in it")
    return out


def _of_recording(path: Path, source: libloc.MeasurementSource, form: str) -> Readings:
    recording = source.read_all()
    out = Readings(str(path), form, counts={name: n for name, n in recording.counts.items() if n})
    imu, magnetometer = recording.imu, recording.magnetometer
    for name, times, rows in (
        ("gyroscope", imu.times_ns, imu.angular_velocity),
        ("accelerometer", imu.times_ns, imu.specific_force),
        ("magnetometer", magnetometer.times_ns, magnetometer.magnetic_field),
    ):
        # Half an IMU comes with the other half unknown.
        if len(rows) and not np.isnan(rows).all():
            setattr(out, name, Triad(rows, times, SI[name]))
    return out


def _open_csv(path: Path, options: InputOptions) -> libloc.MeasurementSource:
    return libloc.open_csv(
        path,
        time_unit=options.time_unit or "",
        angular_velocity_unit=options.gyroscope_unit or "",
        specific_force_unit=options.accelerometer_unit or "",
        magnetic_field_unit=options.magnetometer_unit or "",
    )


def _read_text(path: Path, sensor: str, options: InputOptions) -> Readings:
    # A heading may be a comment line; where --columns names them, comments say nothing.
    at, first = _first_line(path, comments=options.columns is None)
    cells = _cells(first.lstrip("#").strip())
    numeric = bool(cells) and all(_is_number(cell) or not cell for cell in cells)
    if options.columns is not None:
        texts = options.columns.split(",")
        columns = _check_columns([_column(text) for text in texts], texts, "--columns")
        return _read_table(path, columns, 0 if numeric else at, options)
    if numeric:
        if path.suffix == ".mat" and len(cells) == 4:
            columns = [_Column("time", 0, "s"), *(_Column(sensor, axis, None) for axis in range(3))]
            return _read_table(path, columns, 0, options)
        raise DataError(
            f"{path}:{at}: the first line is numbers, not a heading: name its {len(cells)} columns, for "
            "instance --columns " + ",".join(f"{sensor[0]}{axis}" for axis in "xyz")
        )
    known = [_column(cell) for cell in cells]
    # Of words without commas one may happen to be a name: "# my recording".
    if first.startswith("#") and None in known and ("," not in first or not any(known)):
        raise DataError(
            f"{path}:{at}: a comment, not a heading: take it away, so that the first line names the columns, "
            "or name them with --columns"
        )
    quantities = {column.quantity for column in known if column is not None}
    counts = any(options.unit(triad) == COUNTS for triad in TRIADS)
    half = ("gyroscope" in quantities) != ("accelerometer" in quantities)
    if None not in known and (counts or half or "time" not in quantities):
        return _read_table(path, _check_columns(known, cells, f"{path}:{at}"), at, options)
    return _of_recording(path, _open_csv(path, options), "csv")


def read_readings(path: Path, sensor: str, options: InputOptions) -> Readings:
    """The sensors of a recording or a table. sensor: what a table without names is taken for, one of TRIADS.

    Raises DataError naming file, line and value, and saying which option would help.
    """
    form = libloc.file_format(path)
    if form in ("csv", "tum"):  # text
        return _read_text(path, sensor, options)
    if options.columns is not None:
        raise DataError(f"{path}: --columns is for text files; this is {form}")
    return _of_recording(path, libloc.open_recording(path), form)


def read_stamps_table(
    path: Path, options: InputOptions
) -> tuple[NDArray[np.int64], NDArray[np.int64], dict[str, int]]:
    """Two columns of times, of the device and of the arrival at the host; units in the names: device_us.

    Raises DataError naming file, line and value.
    """
    at_line, text = _first_line(path, comments=options.columns is None)
    first = _cells(text.lstrip("#").strip())
    heading = 0 if all(_is_number(cell) for cell in first) else at_line
    names = options.columns.split(",") if options.columns else first
    if not heading and not options.columns:
        raise DataError(f"{path}: the first line is numbers: --columns device_ns,host_ns names them")
    at: dict[str, tuple[int, str]] = {}
    for i, name in enumerate(names):
        kind, _, unit = name.strip().partition("_")
        unit = unit or options.time_unit or ""
        if kind in ("device", "host") and kind not in at:
            if unit not in TIME_UNITS:
                raise DataError(
                    f"{path}: column '{name}': give its unit, one of {', '.join(TIME_UNITS)}: {kind}_ns"
                )
            at[kind] = (i, unit)
        elif name.strip() != "-":
            raise DataError(
                f"{path}: column '{name.strip()}' is not known; known are device_ns, host_ns, and -"
            )
    if len(at) != 2:
        raise DataError(f"{path}: a column of the device's times and one of the host's are needed")
    times: dict[str, list[int]] = {kind: [] for kind in at}
    counts: dict[str, int] = {}
    with path.open(encoding="utf-8-sig", errors="replace", newline=None) as file:
        for number, line in enumerate(file, start=1):
            text = line.strip()
            if number == heading or not text or text.startswith("#"):
                continue
            if not line.endswith("\n"):
                counts["rows.skipped.no_line_end"] = 1
                break
            cells = _cells(text)
            if len(cells) != len(names):
                raise DataError(f"{path}:{number}: {len(cells)} cells, not {len(names)}")
            for kind, (i, unit) in at.items():
                times[kind].append(_parse_time(cells[i], unit, f"{path}:{number}"))
    counts["rows.read"] = len(times["host"])
    return np.array(times["device"], dtype=np.int64), np.array(times["host"], dtype=np.int64), counts


def merged(readings: Readings, more: Readings) -> Readings:
    """Adds the sensors of another file. Raises DataError for a sensor that both have."""
    for triad in TRIADS:
        if getattr(more, triad) is None:
            continue
        if getattr(readings, triad) is not None:
            raise DataError(f"{more.name}: the {triad} is in {readings.name} already")
        setattr(readings, triad, getattr(more, triad))
    readings.counts |= {f"{Path(more.name).name}: {name}": n for name, n in more.counts.items()}
    return readings
