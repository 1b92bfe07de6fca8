"""loc-calibrate gps-latency: by how much a receiver's stamps are off, against a reference trajectory.

INPUT is an LCM log with GPS fixes and a reference (a better receiver, an INS) whose world has a known
origin on the earth (ASPN-23). The speed must change: at constant velocity a latency looks like an error
along the track.
"""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import DataError
from libloc.programs import calibrate_plots_clock as clock_plots
from libloc.programs.calibrate_report import Outcome, Picture, with_sigma


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--max-offset",
        type=float,
        default=1.0,
        metavar="S",
        help="largest offset that is looked for [s] (%(default)s)",
    )


def check_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Ends with a usage error."""
    if not (np.isfinite(options.max_offset) and options.max_offset > 0):
        parser.error(f"--max-offset {options.max_offset:g}: must be a positive number")


def horizontal_error(
    times_ns: NDArray[np.int64],
    positions: NDArray[np.float64],
    reference_ns: NDArray[np.int64],
    reference: NDArray[np.float64],
    offset_s: float,
) -> NDArray[np.float64]:
    """[m] of each fix, with the offset added to its time; NaN outside the reference. For the picture."""
    start = reference_ns[0]
    at = (times_ns - start) * 1e-9 + offset_s
    t = (reference_ns - start) * 1e-9
    there = np.stack([np.interp(at, t, reference[:, i], left=np.nan, right=np.nan) for i in range(2)], axis=1)
    error: NDArray[np.float64] = np.linalg.norm(positions[:, :2] - there, axis=1)
    return error


def calibrate(options: argparse.Namespace) -> Outcome:
    """Raises DataError when the log has no GPS fixes, or no reference with a known origin."""
    if len(options.input) > 1:
        raise DataError(f"{options.input[1]}: one INPUT at a time for the GPS's latency")
    path = options.input[0]
    source = libloc.open_recording(path)
    recording = source.read_all()
    gps, reference, origin = recording.gps, recording.reference, source.origin
    fixed = gps.fix >= libloc.GpsFixType.FIX_2D
    if not fixed.any():
        raise DataError(f"{path}: no GPS fix in it ({len(gps.times_ns)} messages without)")
    if not len(reference.times_ns):
        raise DataError(f"{path}: no reference trajectory in it")
    if origin is None:
        raise DataError(f"{path}: it does not say where on the earth the reference's world has its origin")
    known = np.isfinite(reference.position).all(axis=1)
    times_ns = np.ascontiguousarray(gps.times_ns[fixed])
    positions = libloc.local_positions(np.ascontiguousarray(gps.latitude_longitude_altitude[fixed]), origin)
    reference_ns, there = (
        np.ascontiguousarray(reference.times_ns[known]),
        np.ascontiguousarray(reference.position[known]),
    )
    result = libloc.estimate_time_offset(
        times_ns,
        positions,
        reference_ns,
        there,
        reference_velocities=np.ascontiguousarray(reference.velocity[known]),
        max_offset_s=options.max_offset,
    )
    out = Outcome(
        block="gps",
        summary=f"GPS latency: {result.used} fixes of {path}",
        verdict=result.quality.verdict,
        reasons=list(result.quality.reasons),
        apply=None,
        counts={name: n for name, n in recording.counts.items() if n},
    )
    left_out = {
        "gps.skipped.no_fix": int(np.sum(~fixed)),
        "gps.skipped.outside_reference": result.outside,
        "gps.skipped.not_finite": result.not_finite,
        "gps.down_weighted": result.down_weighted,
    }
    out.counts |= {name: n for name, n in left_out.items() if n}
    out.facts = [
        ("time offset", f"{with_sigma(result.offset_s, result.sigma_s)} s: t_imu = t_gps + offset"),
        (
            "horizontal rms",
            f"{result.rms_before_m:.3f} m as stamped, {result.rms_after_m:.3f} m with the offset",
        ),
        ("speed", f"{result.speed_rms:.1f} m/s rms, it varies by {result.speed_deviation:.1f} m/s"),
    ]
    if not (result.converged and np.isfinite([result.offset_s, result.sigma_s]).all()):
        return out
    errors = [
        horizontal_error(times_ns, positions, reference_ns, there, offset)
        for offset in (0.0, result.offset_s)
    ]
    out.pictures = [
        Picture(
            "latency",
            "Horizontal distance of each fix to the reference, as stamped and with the offset.",
            partial(clock_plots.plot_latency, times_ns, errors[0], errors[1]),
        )
    ]

    def apply(rig: libloc.Rig) -> None:
        if rig.gps is None:
            rig.gps = libloc.GpsCalibration()
        rig.gps.time_offset_s, rig.gps.time_offset_sigma_s = result.offset_s, result.sigma_s

    out.apply = apply
    return out
