"""loc-calibrate magnetometer: hard and soft iron from readings of a device that was turned about."""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np

import libloc
from libloc.programs import calibrate_alignment as alignment
from libloc.programs import calibrate_live
from libloc.programs import calibrate_plausible as plausible
from libloc.programs import calibrate_plots as plots
from libloc.programs.calibrate_input import COUNTS, Readings, Triad
from libloc.programs.calibrate_report import Outcome, Picture
from libloc.programs.calibrate_triad import display_unit, triad_tables


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--method",
        choices=("robust", "als", "lsq", "sphere"),
        default="robust",
        help="robust: for real data; als: clean data over a part of the sphere; lsq: the plain "
        "nine-parameter fit; sphere: bias only (%(default)s)",
    )
    parser.add_argument(
        "--field-ut",
        type=float,
        metavar="UT",
        help="strength of the earth's field here [uT]: corrected readings get this norm (default: they keep "
        "their own mean, or the magnetic model's where a place is given)",
    )
    alignment.add_options(parser)
    calibrate_live.add_options(parser)


def check_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Ends with a usage error."""
    if options.live == bool(options.input):
        parser.error("magnetometer: give an INPUT, or --live")
    for name in ("duration", "patience", "field_ut"):
        value = getattr(options, name)
        if value is not None and not (np.isfinite(value) and value > 0):
            parser.error(f"--{name.replace('_', '-')} {value:g}: must be a positive number")
    low, high = plausible.FIELD_RANGE_UT
    if options.field_ut is not None and not low <= options.field_ut <= high:
        parser.error(f"--field-ut {options.field_ut:g}: on earth it is between 22 and 67 uT")
    alignment.check_options(parser, options)


def reference_norm(options: argparse.Namespace) -> float:
    """[T]; 0: the readings' own."""
    if options.field_ut is not None:
        return float(options.field_ut) * 1e-6
    expected = alignment.expected_field(options)
    return 0.0 if expected is None else expected.strength


def _pictures(fit: libloc.EllipsoidFit, raw: Triad, triad: libloc.TriadCalibration) -> list[Picture]:
    corrected = (raw.rows - triad.bias) @ triad.matrix.T
    raw_unit = display_unit(raw)
    unit = raw_unit if raw.unit != COUNTS or fit.reference_norm > 1 else (1e6, "uT")
    if raw.times_ns is None:
        x, x_name = np.arange(len(raw), dtype=float), "reading"
    else:
        x, x_name = (raw.times_ns - raw.times_ns[0]) * 1e-9, "time [s]"
    return [
        Picture(
            "spheres",
            "Readings before and after. On the right they should lie on the sphere from all sides.",
            partial(
                plots.plot_spheres,
                raw.rows,
                corrected,
                triad.bias,
                triad.matrix,
                fit.reference_norm,
                raw_unit,
                unit,
            ),
        ),
        Picture(
            "residuals",
            "Length of each reading, before and after. What remains should be noise: a trend over time is a "
            "disturbance or a change of temperature.",
            partial(plots.plot_norms, raw.rows, corrected, fit.reference_norm, x, x_name),
        ),
        Picture(
            "coverage",
            "How often the field was seen from each direction. White: never; the calibration is a guess "
            "there.",
            partial(plots.plot_coverage, fit.coverage, "the field in the sensor's axes"),
        ),
    ]


def _lower(out: Outcome, triad: libloc.TriadCalibration, verdict: libloc.Verdict, reasons: list[str]) -> None:
    """The verdict of the block, and of the rig's entry, is the worst of its parts."""
    out.verdict = max(out.verdict, verdict)
    out.reasons += [reason for reason in reasons if reason not in out.reasons]
    quality = triad.quality
    assert quality is not None
    quality.verdict, quality.reasons = out.verdict, out.reasons


def _with_imu(
    out: Outcome,
    fit: libloc.EllipsoidFit,
    triad: libloc.TriadCalibration,
    readings: Readings,
    raw: Triad,
    options: argparse.Namespace,
) -> libloc.TriadCalibration:
    """The triad turned to the IMU's axes if the recording shows how; comparison with the magnetic model."""
    found = alignment.align(readings, raw, triad, options)
    result, dip = found.result, float("nan")
    if result is not None and result.solved and result.quality.usable:
        triad = libloc.aligned(triad, result)
        out.facts += alignment.facts(result)
        dip = result.dip
        if found.note:
            out.notes.append(found.note)
        _lower(out, triad, result.quality.verdict, list(result.quality.reasons))
    else:
        if result is not None:
            found.note = "The rotation to the IMU was not found: " + " ".join(result.quality.reasons)
        out.notes += [
            found.note,
            "The matrix is symmetric: corrected readings keep the magnetometer's own axes. Use it with an "
            "IMU only "
            "if both chips have the same axes.",
        ]
    expected = alignment.expected_field(options)
    if expected is None:
        return triad
    from libloc.magnetic_model import check

    strength = float("nan") if raw.unit == COUNTS else fit.radius
    out.facts.append(
        (
            "expected here",
            f"{1e6 * expected.strength:.2f} uT, dip {np.rad2deg(expected.dip):.2f} deg, declination "
            f"{np.rad2deg(expected.declination):.2f} deg ({expected.model})",
        )
    )
    if np.isfinite([strength, dip]).any():
        said = check(
            np.deg2rad(options.latitude),
            np.deg2rad(options.longitude),
            options.altitude,
            options.date,
            strength,
            dip,
        )
        _lower(out, triad, said.verdict, said.reasons)
    if options.field_ut is not None:
        said = check(
            np.deg2rad(options.latitude),
            np.deg2rad(options.longitude),
            options.altitude,
            options.date,
            reference_norm(options),
        )
        _lower(out, triad, said.verdict, [f"--field-ut: {reason}" for reason in said.reasons])
    return triad


def calibrate(readings: Readings, options: argparse.Namespace) -> Outcome:
    """Raises DataError when there is no magnetometer in it."""
    raw = readings.need("magnetometer")
    fit = libloc.fit_ellipsoid(
        raw.rows, libloc.EllipsoidOptions(method=options.method, reference_norm=reference_norm(options))
    )
    scale, unit = display_unit(raw)
    out = Outcome(
        block="magnetometer",
        summary=f"magnetometer: {fit.readings} readings of {readings.name}",
        verdict=fit.quality.verdict,
        reasons=list(fit.quality.reasons),
        apply=None,
        counts=readings.counts,
    )
    if fit.not_finite:
        out.counts["readings.skipped.not_finite"] = fit.not_finite
    share = 100 * fit.inliers / max(fit.readings, 1)
    out.facts += [
        (
            "method",
            f"{options.method}, {fit.inliers} of {fit.readings} readings fit ({share:.1f} %)",
        ),
    ]
    if not fit.is_ellipsoid:
        return out
    out.facts += [
        (
            "norm variation",
            f"{100 * fit.norm_variation_before:.2f} % before, {100 * fit.norm_variation_after:.2f} % after",
        ),
        ("residual rms", f"{100 * fit.residual_rms:.2f} % of the field over the readings that fit"),
        ("noise of a reading", f"{scale * fit.noise_sigma:.4g} {unit}"),
        (
            "centre",
            f"{fit.centre_over_radius:.2f} radii off zero, known to {100 * fit.centre_sigma:.2f} % of the "
            "radius",
        ),
        ("radius", f"{scale * fit.radius:.6g} {unit}, axes {fit.axis_ratio:.3f} : 1"),
        ("directions seen", f"{fit.cells_hit} of 100 cells of equal area"),
    ]
    triad = fit.triad()
    if raw.unit == COUNTS and reference_norm(options) == 0:
        _lower(
            out,
            triad,
            libloc.Verdict.WARN,
            [
                "The readings are counts and the strength of the field was not given: corrected readings are "
                "counts, too, where estimators expect tesla. Give --field-ut, or --latitude, --longitude and "
                "--date."
            ],
        )
    doubts = plausible.field_doubts(raw, fit.radius)
    if doubts:
        _lower(out, triad, libloc.Verdict.REFUSED, doubts)
    triad = _with_imu(out, fit, triad, readings, raw, options)
    out.tables = triad_tables(triad, raw, "hard iron", "soft iron, scale, cross-axis")
    out.pictures = _pictures(fit, raw, triad)

    def apply(rig: libloc.Rig) -> None:
        rig.magnetometer = libloc.MagnetometerCalibration()
        rig.magnetometer.triad = triad

    out.apply = apply
    return out
