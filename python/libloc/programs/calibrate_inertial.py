"""loc-calibrate accelerometer and gyroscope: from a device that is put down in many poses.

Move the device by hand into about 20 poses, in all directions, and let it lie for about two seconds in each,
longer below 20 readings a second, as stillness is judged over 20 of them (four seconds at 10 Hz). A table is
best, no turntable is needed. Still poses are found by themselves. The accelerometer's poses give bias, scale
and cross-axis (9 poses at least); a gyroscope in the same recording gets its bias from rest, and its scale
and its alignment to the accelerometer from the turns between the poses.

A magnetometer is turned to the axes of the calibrated IMU: calibrate it after these two.
"""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import DataError
from libloc.programs import calibrate_plausible as plausible
from libloc.programs import calibrate_plots as plots
from libloc.programs import calibrate_plots_inertial as inertial_plots
from libloc.programs.calibrate_input import COUNTS, GRAVITY, Readings, Triad, same_times
from libloc.programs.calibrate_report import Outcome, Picture
from libloc.programs.calibrate_triad import display_unit, quality_of, symmetric_sigma, triad_tables


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--gravity",
        type=float,
        default=GRAVITY,
        metavar="M/S2",
        help="local gravity [m/s^2]; 9.780 at the equator, 9.832 at the poles (%(default)s)",
    )
    parser.add_argument(
        "--min-still",
        type=float,
        default=1.0,
        metavar="S",
        help="shortest rest that counts as a pose [s] (%(default)s)",
    )


def check_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Ends with a usage error."""
    if not 9.7 < options.gravity < 9.9:
        parser.error(f"--gravity {options.gravity:g}: on earth it is between 9.76 and 9.84 m/s^2")
    if not (np.isfinite(options.min_still) and options.min_still > 0):
        parser.error(f"--min-still {options.min_still:g}: must be a positive number")


def _rows(triad: Triad | None) -> NDArray[np.float64] | None:
    return None if triad is None else triad.rows


def _together(readings: Readings, main: str, other: str, notes: list[str]) -> Triad | None:
    """The other sensor, if it was read at the very times of the main one."""
    triad: Triad | None = getattr(readings, other)
    if triad is None:
        return None
    if not same_times(triad, getattr(readings, main)):
        notes.append(f"The {other} has other times than the {main}: it was left aside.")
        return None
    return triad


def _find_stillness(
    times_ns: NDArray[np.int64],
    gyroscope: Triad | None,
    accelerometer: Triad | None,
    options: argparse.Namespace,
) -> libloc.Stillness:
    return libloc.find_stillness(
        times_ns,
        _rows(gyroscope),
        _rows(accelerometer),
        libloc.StillnessOptions(min_duration_s=options.min_still),
    )


def _stillness_facts(still: libloc.Stillness) -> list[tuple[str, str]]:
    return [
        ("rate", f"{still.rate_hz:.6g} Hz"),
        ("still poses", f"{len(still.segments)}, {100 * still.still_share:.0f} % of the time"),
    ]


def _counts(readings: Readings, still: libloc.Stillness) -> dict[str, int]:
    more = {
        "rows.skipped.not_finite": still.not_finite,
        "rows.skipped.time_not_increasing": still.out_of_order,
        "gaps": still.gaps,
        "still.left_out_turning": still.turning_segments,
    }
    return readings.counts | {name: n for name, n in more.items() if n}


def _set_rate(imu: libloc.ImuCalibration, still: libloc.Stillness) -> None:
    if imu.rate_hz == 0 and np.isfinite(still.rate_hz):
        imu.rate_hz = round(still.rate_hz, 3)


def _merge(outcome: Outcome, *qualities: libloc.Quality) -> None:
    outcome.verdict = max(outcome.verdict, *(quality.verdict for quality in qualities))
    for quality in qualities:
        outcome.reasons += [reason for reason in quality.reasons if reason not in outcome.reasons]


def _note_magnetometer(outcome: Outcome, options: argparse.Namespace) -> None:
    """A magnetometer that is in the rig already was turned to the axes that change now."""
    if options.out is None or not options.out.exists():
        return
    magnetometer = libloc.read_rig(options.out).magnetometer
    if magnetometer is None:
        return
    matrix = magnetometer.triad.matrix
    # Symmetric: it keeps its own axes, or they are the IMU's by construction.
    if np.abs(matrix - matrix.T).max() > 1e-9 * np.abs(matrix).max() or (np.diag(matrix) <= 0).any():
        outcome.notes.append(
            "The rig holds a magnetometer that was turned to the IMU's axes, which change with this: run "
            "loc-calibrate magnetometer again."
        )


def _doubt(outcome: Outcome, reasons: list[str]) -> None:
    """What cannot be is refused."""
    if reasons:
        outcome.verdict = libloc.Verdict.REFUSED
        outcome.reasons += reasons


def _empty(block: str, summary: str, counts: dict[str, int], notes: list[str]) -> Outcome:
    return Outcome(
        block=block,
        summary=summary,
        verdict=libloc.Verdict.OK,
        reasons=[],
        apply=None,
        notes=notes,
        counts=counts,
    )


def calibrate_accelerometer(readings: Readings, options: argparse.Namespace) -> Outcome:
    """Raises DataError when there is no accelerometer, or no time, in it."""
    raw, times_ns = readings.need_times("accelerometer")
    notes: list[str] = []
    gyroscope = _together(readings, "accelerometer", "gyroscope", notes)
    still = _find_stillness(times_ns, gyroscope, raw, options)
    poses = len(still.segments)
    fit = libloc.fit_accelerometer(still.segments, libloc.AccelerometerOptions(gravity=options.gravity))
    out = _empty(
        "imu.accelerometer",
        f"accelerometer: {poses} still poses in {len(raw)} readings of {readings.name}",
        _counts(readings, still),
        notes,
    )
    out.facts = _stillness_facts(still)
    _merge(out, still.quality, fit.quality)
    out.pictures.append(
        Picture(
            "stillness",
            "Length of the reading over time; coloured where the device lay still.",
            partial(inertial_plots.plot_stillness, times_ns, raw.rows, still.segments, display_unit(raw)),
        )
    )
    if not fit.solved:
        return out
    milli_g = 1e3 / options.gravity
    out.facts += [
        ("poses used", f"{fit.inliers} of {poses}, {fit.distinct_poses} of them distinct"),
        ("fit", f"{milli_g * fit.residual_rms:.3f} mg rms over the poses used"),
        ("leave one out", f"{milli_g * fit.leave_one_out_rms:.3f} mg rms, each pose predicted by the others"),
        ("predicted error", f"{1e3 * fit.predicted_error:.3f} mg of a corrected reading in any direction"),
    ]
    triad = libloc.TriadCalibration()
    triad.bias, triad.matrix = fit.triad.bias, fit.triad.matrix
    _doubt(out, plausible.scale_doubts("accelerometer", raw, triad.matrix))
    worst = libloc.Verdict(out.verdict)
    triad.quality = quality_of(
        fit.quality,
        "still-poses",
        fit.inliers,
        fit.cov[:3, :3],
        symmetric_sigma(fit.cov),
        fit.residual_rms / options.gravity,
    )
    triad.quality.verdict, triad.quality.reasons = worst, out.reasons
    out.tables = triad_tables(triad, raw, "zero-g offset", "scale and cross-axis")
    means = np.array([segment.accelerometer_mean for segment in still.segments])
    corrected = (means - triad.bias) @ triad.matrix.T
    out.pictures += [
        Picture(
            "residuals",
            "What remains of each pose, and by how much the other poses miss it.",
            partial(inertial_plots.plot_pose_residuals, fit, options.gravity),
        ),
        Picture(
            "spheres",
            "Means of the poses before and after. They should lie on the sphere, from all sides.",
            partial(
                plots.plot_spheres,
                means,
                corrected,
                triad.bias,
                triad.matrix,
                options.gravity,
                display_unit(raw),
                (1.0, "m/s²"),
            ),
        ),
        Picture(
            "coverage",
            "Directions in which gravity was seen. The calibration is a guess where there are none.",
            partial(inertial_plots.plot_pose_directions, corrected, fit.inlier),
        ),
    ]

    def apply(rig: libloc.Rig) -> None:
        if rig.imu is None:
            rig.imu = libloc.ImuCalibration()
        rig.imu.accelerometer = triad
        _set_rate(rig.imu, still)

    out.apply = apply
    _note_magnetometer(out, options)
    return out


def calibrate_gyroscope(readings: Readings, options: argparse.Namespace) -> Outcome:
    """Bias alone without an accelerometer. Raises DataError when there is no gyroscope, or no time, in it."""
    raw, times_ns = readings.need_times("gyroscope")
    notes: list[str] = []
    accelerometer = _together(readings, "gyroscope", "accelerometer", notes)
    still = _find_stillness(times_ns, raw, accelerometer, options)
    out = _empty(
        "imu.gyroscope",
        f"gyroscope: {len(still.segments)} rests in {len(raw)} readings of {readings.name}",
        _counts(readings, still),
        notes,
    )
    if accelerometer is None:
        fit = libloc.fit_gyroscope_bias(still.segments)
        _merge(out, still.quality, fit.quality)
    else:
        gravity = libloc.fit_accelerometer(
            still.segments, libloc.AccelerometerOptions(gravity=options.gravity)
        )
        fit = libloc.fit_gyroscope(times_ns, raw.rows, still.segments, gravity)
        _merge(out, still.quality, fit.quality)
        if fit.matrix_known:
            notes.append(
                "Its axes are those of the accelerometer as calibrated from this recording: run "
                "loc-calibrate accelerometer on it, too."
            )
    if raw.unit == COUNTS and fit.bias_known and not fit.matrix_known:
        raise DataError(
            f"{readings.name}: the gyroscope is in counts and its scale could not be found: "
            + "; ".join(fit.quality.reasons)
        )
    out.facts = _stillness_facts(still)
    out.pictures.append(
        Picture(
            "stillness",
            "Length of the reading over time; coloured where the device lay still.",
            partial(inertial_plots.plot_stillness, times_ns, raw.rows, still.segments, display_unit(raw)),
        )
    )
    if not fit.bias_known:
        return out
    scale, unit = display_unit(raw)
    spread = ", ".join(f"{scale * value:.4g}" for value in fit.bias_spread)
    out.facts.append(
        ("bias changes by", f"{spread} {unit} from rest to rest (x, y, z, one standard deviation)")
    )
    if fit.matrix_known:
        out.facts += [
            ("turns used", f"{fit.inliers} of {len(fit.turn_inlier)}"),
            ("residual rms", f"{np.rad2deg(fit.residual_rms):.3f} deg between gravity as turned and as seen"),
            ("scale known to", f"{100 * fit.relative_sigma:.3f} % in the worst direction"),
            ("turned against", f"the accelerometer by {np.rad2deg(fit.rotation_angle):.3f} deg"),
        ]
    triad = libloc.TriadCalibration()
    triad.bias, triad.matrix = fit.triad.bias, fit.triad.matrix
    if fit.matrix_known:
        _doubt(out, plausible.scale_doubts("gyroscope", raw, triad.matrix))
    sigma = np.sqrt(np.maximum(np.diag(fit.cov), 0)).reshape(3, 3) if fit.matrix_known else None
    triad.quality = quality_of(
        fit.quality,
        "turns" if fit.matrix_known else "rest",
        fit.inliers if fit.matrix_known else len(still.segments),
        fit.bias_cov,
        sigma,
        float("nan"),
    )
    triad.quality.verdict, triad.quality.reasons = libloc.Verdict(out.verdict), out.reasons
    out.tables = triad_tables(triad, raw, "at rest", "scale, misalignment, rotation to the accelerometer")
    if not fit.matrix_known:
        out.tables.pop()
    out.pictures.append(
        Picture(
            "bias",
            "What the gyroscope showed in each rest, less the mean. A trend is temperature.",
            partial(inertial_plots.plot_rest_bias, still.segments, triad.bias, display_unit(raw)),
        )
    )
    if fit.matrix_known:
        out.pictures.append(
            Picture(
                "turns",
                "For each turn, how far gravity as the gyroscope turned it is from gravity as it was seen.",
                partial(inertial_plots.plot_turns, fit),
            )
        )

    def apply(rig: libloc.Rig) -> None:
        if rig.imu is None:
            rig.imu = libloc.ImuCalibration()
        if not fit.matrix_known:
            triad.matrix = rig.imu.gyroscope.matrix  # bias only: the scale stays as it was
        rig.imu.gyroscope = triad
        _set_rate(rig.imu, still)

    out.apply = apply
    if fit.matrix_known:
        _note_magnetometer(out, options)
    return out
