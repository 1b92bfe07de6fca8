"""loc-calibrate magnetometer, second part: rotation to the IMU, comparison with the magnetic model."""

from __future__ import annotations

import argparse
import datetime
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc.programs.calibrate_input import COUNTS, Readings, Triad, same_times

if TYPE_CHECKING:
    from libloc.magnetic_model import Field


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--no-alignment",
        action="store_true",
        help="do not look for the rotation to the IMU, even if the recording has a gyroscope",
    )
    group = parser.add_argument_group("place, for the World Magnetic Model: strength and dip of the field")
    group.add_argument("--latitude", type=float, metavar="DEG")
    group.add_argument("--longitude", type=float, metavar="DEG")
    group.add_argument(
        "--altitude", type=float, metavar="M", default=0.0, help="above the ellipsoid (%(default)s)"
    )
    group.add_argument(
        "--date", type=datetime.date.fromisoformat, metavar="YYYY-MM-DD", help="of the recording"
    )


def check_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Ends with a usage error."""
    given = [value is not None for value in (options.latitude, options.longitude, options.date)]
    if any(given) and not all(given):
        parser.error("--latitude, --longitude and --date: give all of them, or none")
    if all(given):
        try:
            expected_field(options)
        except ValueError as error:
            parser.error(str(error))


def expected_field(options: argparse.Namespace) -> Field | None:
    """By the model; None when no place was given."""
    if options.latitude is None:
        return None
    from libloc.magnetic_model import earth_field

    return earth_field(
        math.radians(options.latitude), math.radians(options.longitude), options.altitude, options.date
    )


@dataclass
class Aligned:
    """What the IMU says about the magnetometer. result None: it could not be asked, the note says why."""

    result: libloc.MagnetometerAlignment | None = None
    note: str = ""  # of a result: what should be done first


def _at_times_of_imu(
    times_ns: NDArray[np.int64], magnetometer_ns: NDArray[np.int64], rows: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Readings beside the IMU's samples that are nearest to them; NaN between."""
    out = np.full((len(times_ns), 3), np.nan)
    if np.array_equal(times_ns, magnetometer_ns):
        out[:] = rows
        return out
    after = np.clip(np.searchsorted(times_ns, magnetometer_ns), 1, len(times_ns) - 1)
    nearest = np.where(
        magnetometer_ns - times_ns[after - 1] < times_ns[after] - magnetometer_ns, after - 1, after
    )
    period = float(np.median(np.diff(times_ns)))
    close = np.abs(times_ns[nearest] - magnetometer_ns) <= 0.51 * period
    out[nearest[close]] = rows[close]
    return out


def _corrected(rows: NDArray[np.float64], triad: libloc.TriadCalibration) -> NDArray[np.float64]:
    return np.ascontiguousarray((rows - triad.bias) @ triad.matrix.T)


def align(
    readings: Readings, raw: Triad, triad: libloc.TriadCalibration, options: argparse.Namespace
) -> Aligned:
    """Rotation of the magnetometer, corrected by triad, to the IMU's axes."""
    gyroscope, accelerometer = readings.gyroscope, readings.accelerometer
    if options.no_alignment:
        return Aligned(note="The rotation to the IMU was not looked for (--no-alignment).")
    if gyroscope is None:
        return Aligned(note="There is no gyroscope in it: the rotation to the IMU is not known.")
    if gyroscope.times_ns is None or raw.times_ns is None or len(gyroscope) < 2:
        return Aligned(note="There is no time in it: the rotation to the IMU is not known.")
    if gyroscope.unit == COUNTS:
        return Aligned(note="The gyroscope is in counts: the rotation to the IMU is not known.")
    rates = gyroscope.rows
    force, missing = None, ["gyroscope"]
    if accelerometer is not None and same_times(accelerometer, gyroscope):
        force = accelerometer.rows
        missing.append("accelerometer")
    if options.out is not None and options.out.exists():
        # The rig's IMU may be calibrated already: its axes are what the magnetometer is turned to.
        imu = libloc.read_rig(options.out).imu
        if imu is not None:
            rates = _corrected(rates, imu.gyroscope)
            force = None if force is None else _corrected(force, imu.accelerometer)
            missing = [name for name in missing if np.array_equal(getattr(imu, name).matrix, np.eye(3))]
    field = expected_field(options)
    dip = float("nan") if field is None else field.dip
    result = libloc.align_magnetometer(
        gyroscope.times_ns,
        rates,
        force,
        _at_times_of_imu(gyroscope.times_ns, raw.times_ns, _corrected(raw.rows, triad)),
        libloc.MagnetometerAlignmentOptions(expected_dip=dip),
    )
    note = ""
    if missing:
        note = (
            f"No rig with a calibrated {' and '.join(missing)} was named with --out: the magnetometer was "
            "turned to the IMU's axes as they were read. If you calibrate the IMU, do that first and then "
            "this again."
        )
    return Aligned(result, note)


def facts(result: libloc.MagnetometerAlignment) -> list[tuple[str, str]]:
    out = [
        (
            "turned against",
            f"the IMU by {math.degrees(result.angle):.2f} ± {math.degrees(result.sigma):.2f} deg; "
            f"magnetometer axes along body x, y, z: {result.axes}"
            + (", mirrored" if result.mirrored else ""),
        ),
        (
            "delay",
            f"{1e3 * result.delay_s:.2f} ± {1e3 * result.delay_sigma_s:.2f} ms: so old is a reading when "
            "stamped",
        ),
    ]
    if np.isfinite(result.dip):
        out.append(
            (
                "dip",
                f"{math.degrees(result.dip):.2f} ± {math.degrees(result.dip_sigma):.2f} deg below the "
                "horizon, "
                f"single readings vary by {math.degrees(result.dip_scatter):.2f} deg",
            )
        )
    return out
