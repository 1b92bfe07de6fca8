"""loc-evaluate: how far estimated orientations or a trajectory are from a reference, in numbers and pictures.

Estimate and reference may each be a TUM trajectory, a EuRoC folder or its ground-truth CSV, a CSV with a
heading line, a BROAD trial (.mat) or an LCM log; its content tells. From a log the estimate is the
channel LOC_ESTIMATE and the reference is its reference stream; a log that holds both needs no --reference.

Orientation errors are BROAD's: total, heading (about world's vertical), inclination. Position errors are the
absolute error after an alignment and the relative error over pieces, as evo has them.

Exit codes: 0 done, 1 the data cannot be evaluated (the message says why), 2 wrong options.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import DataError
from libloc.programs.evaluate_input import Poses, multiply, read_estimate, read_reference


@dataclass
class OrientationResult:
    """Errors of the paired orientations, and what was done to the heading."""

    times_ns: NDArray[np.int64]
    estimate_wxyz: NDArray[np.float64]  # as compared: after the heading offset was removed
    reference_wxyz: NDArray[np.float64]
    scored: NDArray[np.bool]
    error: libloc.OrientationError
    heading: str  # "absolute", "start", "mean"
    heading_offset: float  # [rad] that was removed
    pairs: libloc.Association


@dataclass
class PositionResult:
    pairs: libloc.Association
    absolute: libloc.AbsoluteError
    relative: libloc.RelativeError


def require_overlap(estimate: Poses, reference: Poses, offset_ns: int) -> None:
    """Raises DataError when the two recordings have no time in common."""
    span = [
        (poses.times_ns[0] + shift, poses.times_ns[-1] + shift)
        for poses, shift in ((estimate, offset_ns), (reference, 0))
    ]
    if span[0][0] > span[1][1] or span[0][1] < span[1][0]:
        text = [f"{libloc.format_seconds(a)} to {libloc.format_seconds(b)} s" for a, b in span]
        raise DataError(f"no overlap in time: the estimate covers {text[0]}, the reference {text[1]}")


def associate(
    estimate: Poses,
    estimate_rows: NDArray[np.bool],
    reference: Poses,
    reference_rows: NDArray[np.bool],
    options: argparse.Namespace,
) -> libloc.Association:
    return libloc.associate(
        estimate.trajectory(estimate_rows),
        reference.trajectory(reference_rows),
        max_difference_ns=round(options.max_difference * 1e9),
        estimate_time_offset_ns=round(options.time_offset * 1e9),
        interpolate_reference=options.interpolate,
    )


def scored_pairs(
    pairs: libloc.Association, estimate: NDArray[np.bool], reference: NDArray[np.bool]
) -> NDArray[np.bool]:
    return np.ascontiguousarray(estimate[pairs.estimate_index] & reference[pairs.reference_index])


def heading_mode(wanted: str, estimate: Poses) -> str:
    """auto: as it is when the estimate says that it is tied to north, otherwise relative to the start."""
    if wanted != "auto":
        return wanted
    return "absolute" if estimate.heading_is_absolute else "start"


def evaluate_orientation(estimate: Poses, reference: Poses, options: argparse.Namespace) -> OrientationResult:
    known, truth = estimate.has_orientation(), reference.has_orientation()
    if not known.any():
        raise DataError(f"{estimate.path}: no orientation in it")
    if not truth.any():
        raise DataError(f"{reference.path}: no orientation in it")
    pairs = associate(estimate, known, reference, truth, options)
    scored = scored_pairs(pairs, estimate.score[known], reference.score[truth])
    if not scored.any():
        raise DataError(f"none of the {len(scored)} pairs of orientations is to be scored")
    q, q_reference = pairs.estimate.q_world_body_wxyz, pairs.reference.q_world_body_wxyz
    mode, offset = heading_mode(options.heading, estimate), 0.0
    if mode == "start":
        first = int(np.argmax(scored))
        offset = float(libloc.so3.heading(multiply(q[first], q_reference[first] * [1, -1, -1, -1])))
    elif mode == "mean":
        offset = libloc.orientation_error(q, q_reference, scored, align_heading=True).heading_offset
    q = np.ascontiguousarray(multiply(libloc.so3.exp([0, 0, -offset]), q))
    error = libloc.orientation_error(q, q_reference, scored)
    times_ns = pairs.estimate.times_ns
    return OrientationResult(times_ns, q, q_reference, scored, error, mode, offset, pairs)


def evaluate_position(estimate: Poses, reference: Poses, options: argparse.Namespace) -> PositionResult:
    known, truth = estimate.has_position(), reference.has_position()
    rows = known & estimate.score & estimate.has_orientation()
    truth_rows = truth & reference.score & reference.has_orientation()
    for poses, has, usable in ((estimate, known, rows), (reference, truth, truth_rows)):
        if not usable.any():
            why = (
                "no position"
                if not has.any()
                else "no pose with position and orientation that is to be scored"
            )
            raise DataError(f"{poses.path}: {why} in it")
    pairs = associate(estimate, rows, reference, truth_rows, options)
    absolute = libloc.absolute_error(pairs.estimate, pairs.reference, options.align)
    relative = libloc.relative_error(
        pairs.estimate,
        pairs.reference,
        delta=options.rpe_delta,
        unit=options.rpe_unit,
        all_pairs=options.rpe_all_pairs,
    )
    return PositionResult(pairs, absolute, relative)


def statistics(values: libloc.ErrorStatistics, scale: float = 1.0) -> dict[str, float]:
    names = ("rmse", "mean", "median", "std", "min", "max")
    return {name: scale * getattr(values, name) for name in names} | {"sse": scale**2 * values.sse}


def describe(poses: Poses) -> dict[str, Any]:
    return {
        "file": str(poses.path),
        "format": poses.form,
        "samples": len(poses.times_ns),
        "first_time_s": libloc.format_seconds(poses.times_ns[0]),
        "last_time_s": libloc.format_seconds(poses.times_ns[-1]),
        "world": poses.world,
        "counts": poses.counts,
    }


def pair_counts(pairs: libloc.Association) -> dict[str, int]:
    return {
        "pairs": len(pairs.estimate),
        "without_partner": pairs.without_partner,
        "shared_partner": pairs.shared_partner,
    }


def report(
    estimate: Poses,
    reference: Poses,
    orientation: OrientationResult | None,
    position: PositionResult | None,
    options: argparse.Namespace,
) -> dict[str, Any]:
    out: dict[str, Any] = {"estimate": describe(estimate), "reference": describe(reference)}
    out["without_position"] = [
        name
        for name, poses in (("estimate", estimate), ("reference", reference))
        if not poses.has_position().any()
    ]
    out["time_offset_s"] = options.time_offset
    if orientation:
        error = orientation.error
        out["orientation"] = pair_counts(orientation.pairs) | {
            "scored": error.scored,
            "masked": error.masked,
            "heading": orientation.heading,
            "heading_offset_deg": np.rad2deg(orientation.heading_offset),
        }
        for name in ("total", "heading", "inclination"):
            values = np.ascontiguousarray(getattr(error, name)[orientation.scored])
            out["orientation"][f"{name}_deg"] = statistics(libloc.error_statistics(values), np.rad2deg(1.0))
    if position:
        alignment = position.absolute.alignment
        out["absolute_error"] = pair_counts(position.pairs) | {
            "alignment": options.align,
            "scale": alignment.scale,
            "T_reference_estimate": alignment.T_reference_estimate.matrix().tolist(),
            "translation_m": statistics(position.absolute.translation),
            "rotation_deg": statistics(position.absolute.rotation, np.rad2deg(1.0)),
        }
        out["relative_error"] = {
            "pieces": len(position.relative.translation_m),
            "delta": options.rpe_delta,
            "unit": options.rpe_unit,
            "all_pairs": options.rpe_all_pairs,
            "translation_m": statistics(position.relative.translation),
            "rotation_deg": statistics(position.relative.rotation, np.rad2deg(1.0)),
        }
    return out


def print_report(out: dict[str, Any]) -> None:
    for name in ("estimate", "reference"):
        d = out[name]
        print(
            f"{name:10s} {d['file']} ({d['format']}, {d['samples']} poses, "
            f"{d['first_time_s']} to {d['last_time_s']} s)"
        )
        for count, value in d["counts"].items():
            print(f"{'':10s} {count}: {value}")
    header = f"{'rmse':>10s}{'mean':>10s}{'median':>10s}{'max':>10s}"

    def row(label: str, values: dict[str, float]) -> None:
        numbers = "".join(f"{values[name]:10.4f}" for name in ("rmse", "mean", "median", "max"))
        print(f"  {label:24s}{numbers}")

    if "orientation" in out:
        o = out["orientation"]
        print(f"orientation: {o['scored']} of {o['pairs']} pairs scored")
        if o["heading"] == "absolute":
            print("  heading compared as it is")
        else:
            where = "of the first pair" if o["heading"] == "start" else "that all pairs have in common"
            print(
                f"  heading is relative: the offset {where}, {o['heading_offset_deg']:.3f} deg, was removed"
            )
        print(f"  {'':24s}{header}")
        for name in ("total", "heading", "inclination"):
            row(f"{name} [deg]", o[f"{name}_deg"])
    if "absolute_error" in out:
        a, r = out["absolute_error"], out["relative_error"]
        scale = f", scale {a['scale']:.6f}" if a["alignment"] == "sim3" else ""
        print(f"absolute error: {a['pairs']} pairs, alignment {a['alignment']}{scale}")
        print(f"  {'':24s}{header}")
        row("translation [m]", a["translation_m"])
        row("rotation [deg]", a["rotation_deg"])
        print(f"relative error: {r['pieces']} pieces of {r['delta']:g} {r['unit']}")
        print(f"  {'':24s}{header}")
        row("translation [m]", r["translation_m"])
        row("rotation [deg]", r["rotation_deg"])
    elif "orientation" in out and out["without_position"]:
        print(f"position: not compared, the {' and the '.join(out['without_position'])} has none")


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="loc-evaluate", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--version", action="version", version=libloc.__version__)
    parser.add_argument("estimate", type=Path, help="what is evaluated")
    parser.add_argument("--reference", type=Path, help="the truth (default: the reference in the same log)")
    parser.add_argument(
        "--estimate-channel",
        default=libloc.ESTIMATE_CHANNEL,
        metavar="NAME",
        help="channel of the estimate in an LCM log (%(default)s)",
    )
    parser.add_argument(
        "--only",
        choices=("orientation", "position"),
        help="default: both, position where both files have positions",
    )
    parser.add_argument(
        "--heading",
        choices=("auto", "absolute", "start", "mean"),
        default="auto",
        help="absolute: as it is; start, mean: remove the offset of the first pair, or the mean one; auto: "
        "absolute when the estimate says that its heading is tied to north, otherwise start",
    )
    parser.add_argument(
        "--align",
        choices=("none", "se3", "sim3", "yaw"),
        default="se3",
        help="of positions, before the absolute error (%(default)s)",
    )
    parser.add_argument(
        "--max-difference",
        type=float,
        default=0.01,
        metavar="S",
        help="largest difference of time within a pair [s] (%(default)s)",
    )
    parser.add_argument(
        "--time-offset", type=float, default=0.0, metavar="S", help="added to the estimate's times [s]"
    )
    parser.add_argument(
        "--interpolate",
        action="store_true",
        help="compare with the reference interpolated at the estimate's time, not with its nearest pose",
    )
    parser.add_argument(
        "--rpe-delta", type=float, default=1.0, metavar="N", help="length of a piece (%(default)s)"
    )
    parser.add_argument(
        "--rpe-unit", choices=("frames", "seconds", "metres"), default="frames", help="(%(default)s)"
    )
    parser.add_argument(
        "--rpe-all-pairs", action="store_true", help="a piece from every pose, not end to end"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all numbers to this file")
    parser.add_argument("--plots", type=Path, metavar="DIR", help="write pictures (PNG) into this folder")
    return parser


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Evaluates and gives all numbers. Raises DataError (ValueError) for data that cannot be evaluated."""
    estimate = read_estimate(options.estimate, options.estimate_channel)
    reference = read_reference(options.reference or options.estimate)
    require_overlap(estimate, reference, round(options.time_offset * 1e9))
    orientation = position = None
    if options.only != "position":
        orientation = evaluate_orientation(estimate, reference, options)
    both = estimate.has_position().any() and reference.has_position().any()
    if options.only == "position" or (options.only is None and both):
        position = evaluate_position(estimate, reference, options)
    out = report(estimate, reference, orientation, position, options)
    if options.json:
        options.json.write_text(json.dumps(out, indent=1, allow_nan=False) + "\n")
    if options.plots:
        from libloc.programs import evaluate_plots

        options.plots.mkdir(parents=True, exist_ok=True)
        if orientation:
            evaluate_plots.plot_orientation(orientation, options.plots / "orientation.png")
        if position:
            evaluate_plots.plot_trajectory(position, options.plots / "trajectory.png")
    return out


def main(arguments: list[str] | None = None) -> int:
    parser = make_parser()
    options = parser.parse_args(arguments)
    for name in ("max_difference", "time_offset", "rpe_delta"):
        if not np.isfinite(getattr(options, name)):
            parser.error(f"--{name.replace('_', '-')}: must be a finite number")
    if options.max_difference < 0:
        parser.error("--max-difference: must not be negative")
    if options.rpe_delta <= 0 or (options.rpe_unit == "frames" and options.rpe_delta % 1):
        parser.error("--rpe-delta: must be positive, and whole for frames")
    if (
        options.reference is None
        and options.estimate.is_file()
        and libloc.file_format(options.estimate) != "lcm"
    ):
        parser.error("--reference: needed, because the estimate is not an LCM log")
    try:
        print_report(run(options))
    except (DataError, ValueError, OSError) as error:
        print(f"loc-evaluate: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
