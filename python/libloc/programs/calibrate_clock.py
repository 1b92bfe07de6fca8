"""loc-calibrate clock: how the clock that stamps a stream runs against the host's clock.

INPUT is an LCM log whose messages say when they arrived (host_time_ns), or a table of two columns,
--columns device_ns,host_ns. Arrivals are late, never early: the line is laid under them. What comes out is
the skew, how late arrivals are, and how well a stamp can be put on the host's clock.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import DataError
from libloc.programs import calibrate_plots_clock as clock_plots
from libloc.programs.calibrate_input import InputOptions, read_stamps_table
from libloc.programs.calibrate_report import Outcome, Picture, Table, with_sigma

_Stamped = (
    libloc.ImuMeasurement | libloc.MagnetometerMeasurement | libloc.GpsMeasurement | libloc.ImageMeasurement
)
STREAMS: dict[str, type[_Stamped]] = {
    "imu": libloc.ImuMeasurement,
    "magnetometer": libloc.MagnetometerMeasurement,
    "gps": libloc.GpsMeasurement,
    "image": libloc.ImageMeasurement,
}


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--stream",
        choices=tuple(STREAMS),
        default="imu",
        help="whose clock; also the name in the rig (%(default)s)",
    )


def read_stamps(
    path: Path, options: InputOptions, stream: str
) -> tuple[NDArray[np.int64], NDArray[np.int64], dict[str, int]]:
    """Device and host times [ns] in the order of arrival, and what was read and skipped."""
    form = libloc.file_format(path)
    if form in ("csv", "tum"):
        return read_stamps_table(path, options)
    if form != "lcm":
        raise DataError(f"{path}: a recording of the form {form} does not say when its samples arrived")
    device, host = [], []
    counts = {f"{stream}.read": 0, f"{stream}.skipped.no_arrival": 0}
    source = libloc.open_recording(path)
    for measurement in source:
        if not isinstance(measurement, STREAMS[stream]):
            continue
        arrival = measurement.host_time_ns
        if arrival is None:
            counts[f"{stream}.skipped.no_arrival"] += 1
            continue
        counts[f"{stream}.read"] += 1
        device.append(measurement.time_ns)
        host.append(arrival)
    if not device:
        missing = counts[f"{stream}.skipped.no_arrival"]
        raise DataError(
            f"{path}: none of its {missing} {stream} messages says when it arrived"
            if missing
            else f"{path}: no message of the stream {stream}"
        )
    return (
        np.array(device, dtype=np.int64),
        np.array(host, dtype=np.int64),
        {k: n for k, n in counts.items() if n},
    )


def _microseconds(value_ns: float) -> str:
    return f"{1e-3 * value_ns:.4g} us"


def calibrate(options: argparse.Namespace, text: InputOptions) -> Outcome:
    """Raises DataError when the input has no arrivals."""
    if len(options.input) > 1:
        raise DataError(f"{options.input[1]}: one INPUT at a time for a clock")
    path = options.input[0]
    device, host, counts = read_stamps(path, text, options.stream)
    result = libloc.calibrate_clock(device, host)
    out = Outcome(
        block=f"clocks ({options.stream} against host)",
        summary=f"clock of the stream {options.stream}: {len(device)} samples of {path}",
        verdict=result.quality.verdict,
        reasons=list(result.quality.reasons),
        apply=None,
        counts=counts | {f"clock.{name}": n for name, n in result.counts.items() if n},
    )
    out.facts = [
        ("recording", f"{result.duration_s:.1f} s, {result.rate_hz:.6g} Hz by the device's clock"),
        (
            "skew",
            f"{with_sigma(result.skew_ppm, result.skew_sigma_ppm)} ppm (host seconds per device second, less "
            "1)",
        ),
        ("skew in it", f"from {result.skew_min_ppm:.4g} to {result.skew_max_ppm:.4g} ppm"),
        ("sigma", f"{_microseconds(result.sigma_ns)}, of a stamp put on the host's clock"),
        (
            "offset",
            f"{libloc.format_seconds(result.offset_ns)} s (host less device at the end, with the least "
            "delay)",
        ),
    ]
    rows = [
        [name, _microseconds(getattr(result, f"jitter_{field}_ns"))]
        for name, field in (
            ("rms", "rms"),
            ("median", "median"),
            ("90 %", "p90"),
            ("99 %", "p99"),
            ("largest", "max"),
        )
    ]
    out.tables = [Table("lateness of arrivals above the line", ["", "late by"], rows)]
    if not np.isfinite([result.skew_ppm, result.sigma_ns]).all() or result.sigma_ns <= 0:
        return out
    converted, sigma = libloc.ClockModel().process(device, host)
    seen = np.isfinite(sigma)  # there is no answer while a reset or a step is being confirmed
    if np.count_nonzero(seen) > 1:
        out.pictures = [
            Picture(
                "arrivals",
                "Above: how late each sample arrived after the line (the lower envelope). Below: skew over "
                "time.",
                partial(clock_plots.plot_clock, device[seen], host[seen], converted[seen], sigma[seen]),
            ),
        ]

    def apply(rig: libloc.Rig) -> None:
        clock = libloc.ClockCalibration(options.stream, "host")
        clock.skew_ppm, clock.skew_sigma_ppm = result.skew_ppm, result.skew_sigma_ppm
        clock.offset_sigma_s = result.sigma_ns * 1e-9
        clock.jitter_rms_s, clock.jitter_p99_s = result.jitter_rms_ns * 1e-9, result.jitter_p99_ns * 1e-9
        others = [c for c in rig.clocks if (c.stream, c.reference) != (clock.stream, clock.reference)]
        rig.clocks = [*others, clock]

    out.apply = apply
    return out
