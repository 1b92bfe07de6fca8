"""Opens a recording by what the file is: EuRoC folder, BROAD trial, CSV, EqVIO file, LCM log, NMEA log."""

from __future__ import annotations

import re
from os import PathLike
from pathlib import Path

from libloc._core import (
    DataError,
    MeasurementSource,
    Recording,
    is_eqvio,
    open_broad,
    open_csv,
    open_eqvio,
    open_euroc,
    open_lcm_log,
    open_nmea,
)

_LCM_EVENT = bytes.fromhex("eda1da01")
_NMEA_SENTENCE = re.compile(rb"\$[A-Z]{5},[ -#%-)+-~]*\*[0-9A-Fa-f]{2}")


def file_format(path: str | PathLike[str]) -> str:
    """One of euroc (a folder), broad (MATLAB v5), lcm (LCM log), nmea, eqvio, csv, tum: by content, not name.

    Raises DataError when the path does not exist, is empty, or is nothing of this.
    """
    path = Path(path)
    if path.is_dir():
        return "euroc"
    if not path.is_file():
        raise DataError(f"{path}: no such file or folder")
    with path.open("rb") as file:
        head = file.read(65536)
    if not head:
        raise DataError(f"{path}: the file is empty")
    if head.startswith(_LCM_EVENT):
        return "lcm"
    if head.startswith(b"MATLAB 5.0"):
        return "broad"
    if _NMEA_SENTENCE.search(head):
        return "nmea"
    if b"\0" in head:
        raise DataError(f"{path}: neither an LCM log nor a MATLAB v5 file, NMEA log, CSV or TUM trajectory")
    lines = [line.strip() for line in head.splitlines()]
    data = [line for line in lines if line and not line.startswith(b"#")]
    # A CSV heading may be a comment line, a TUM file's comments may hold commas: the data tell.
    if b"," not in (data or lines)[0]:
        return "tum"
    return "eqvio" if is_eqvio(path) else "csv"


def open_recording(path: str | PathLike[str]) -> MeasurementSource:
    """Iterates over the measurements of a recording. For CSV files without units in the heading: open_csv.

    Raises DataError naming file, line or byte, field and value when it cannot be read.
    """
    form = file_format(path)
    if form == "tum":
        raise DataError(f"{path}: a TUM trajectory holds no measurements; read it with libloc.read_tum")
    openers = {
        "euroc": open_euroc,
        "broad": open_broad,
        "csv": open_csv,
        "eqvio": open_eqvio,
        "lcm": open_lcm_log,
        "nmea": open_nmea,
    }
    return openers[form](Path(path))


def read_recording(path: str | PathLike[str]) -> Recording:
    """The whole recording as arrays: .imu, .magnetometer, .reference, .gps, .odometry, .features; and .counts
    of what was skipped.

    r = libloc.read_recording("01_trial.mat")
    result = libloc.MadgwickFilter().run(r.imu.times_ns, r.imu.angular_velocity, r.imu.specific_force,
                                         r.magnetometer.magnetic_field, r.magnetometer.times_ns)
    """
    return open_recording(path).read_all()
