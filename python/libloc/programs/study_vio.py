"""loc-study vio: how good the error-state filter is on the visual-inertial example, over many seeds.

Three tables, each row with its own run of the filter on the simulated drive "vio-example":
  comparison   position RMSE and scale error of the configurations, and of what needs no fusion
  consistency  NEES and NIS of 19 states against their 95 % chi-square bounds
  extensions   outliers, late odometry, GPS, outages, a scale that wanders
Beside them stand the figures that another implementation of the same equations reached on a simulator of
its own.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import libloc
from libloc.programs import study_vio_run as vio
from libloc.programs.study_runner import StudyError
from libloc.programs.study_statistics import (
    ConsistencyOverTime,
    Summary,
    consistency_over_time,
    lag_one_correlation,
    summarise,
)
from libloc.programs.study_vio_rows import KEY_FRAME_INTERVAL_S, SCALE_WALK, SCENARIO, Row, selected

NAME = "vio"
HELP = "the error-state filter on the visual-inertial example"
LONGEST_S = 90.0  # of the drive
# What the figures beside the table are.
ELSEWHERE = (
    "an independent implementation of the same equations, 30 seeds of 60 s of its own simulator; "
    "mean NEES 18.98 of 19, NIS 5.99 of 6"
)


@dataclass
class RowSummary:
    row: Row
    rmse: Summary  # [m]
    scale_error: Summary | None
    counts: dict[str, int]  # sum over the runs


@dataclass
class ConsistencySummary:
    nees: dict[str, ConsistencyOverTime]  # "state", and of each block
    nis: libloc.Consistency
    nis_correlation: float  # of successive ones
    nis_correlation_bound: float  # 95 %, of white ones
    times_s: vio.Floats
    nis_at_frames: vio.Floats  # average over the runs


Outcomes = dict[str, dict[int, vio.Outcome]]  # by row and seed


@dataclass
class Study:
    outcomes: Outcomes
    rows: list[RowSummary]
    consistency: dict[str, ConsistencySummary]  # by the names of rows
    seeds: list[int]  # that all rows have
    duration_s: float
    interrupted: bool


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--duration", type=float, default=60.0, metavar="S", help="of each run [s], at most 90 (%(default)s)"
    )
    parser.add_argument(
        "--rows", nargs="+", default=[], metavar="NAME", help="rows or tables to compute (default: all)"
    )


def tasks(options: argparse.Namespace, seeds: range) -> list[vio.Task]:
    """Raises StudyError for options that are wrong."""
    if not (np.isfinite(options.duration) and 1 <= options.duration <= LONGEST_S):
        raise StudyError(f"--duration {options.duration:g}: must be from 1 to {LONGEST_S:g} s")
    return vio.make_tasks(selected(options.rows, options.duration), seeds, options.duration)


run = vio.run


def _consistency(outcomes: dict[int, vio.Outcome]) -> ConsistencySummary:
    runs = [outcomes[seed] for seed in sorted(outcomes)]
    nees = np.stack([one.nees for one in runs if one.nees is not None])
    names = ("state", *(name for name, _, _ in vio.BLOCKS))
    sizes = (vio.STATES, *(size for _, _, size in vio.BLOCKS))
    nis = [one.nis for one in runs if one.nis is not None]
    correlation, bound = lag_one_correlation(nis)
    frames = min(len(one) for one in nis)
    return ConsistencySummary(
        nees={
            name: consistency_over_time(nees[:, :, i], size)
            for i, (name, size) in enumerate(zip(names, sizes, strict=True))
        },
        nis=libloc.average_consistency(np.concatenate(nis), 6),
        nis_correlation=correlation,
        nis_correlation_bound=bound,
        times_s=runs[0].times_s,
        nis_at_frames=np.mean([one[:frames] for one in nis], axis=0),
    )


def evaluate(
    finished: Iterable[tuple[vio.Task, dict[str, vio.Outcome]]],
    options: argparse.Namespace,
    interrupted: bool,
) -> Study:
    """Tables from what is finished, in whatever order it came."""
    outcomes: Outcomes = {}
    for task, result in finished:
        for name, outcome in result.items():
            outcomes.setdefault(name, {})[task.seed] = outcome
    rows = []
    for row in selected(options.rows, options.duration):
        of_row = outcomes.get(row.name)
        if of_row is None:
            continue
        runs = [of_row[seed] for seed in sorted(of_row)]
        rmse = summarise(np.array([one.rmse_m for one in runs]))
        if rmse is None:
            raise StudyError(f"row {row.name}: no run gave a position")
        counts: dict[str, int] = {}
        for one in runs:
            for name, count in one.counts.items():
                counts[name] = counts.get(name, 0) + count
        rows.append(RowSummary(row, rmse, summarise(np.array([one.scale_error for one in runs])), counts))
    common = set.intersection(*(set(of_row) for of_row in outcomes.values())) if outcomes else set()
    return Study(
        outcomes,
        rows,
        {
            one.row.name: _consistency(outcomes[one.row.name])
            for one in rows
            if one.row.table == "consistency"
        },
        sorted(common),
        options.duration,
        interrupted,
    )


def _metres(value: float) -> str:
    return f"{value:.2f}" if value < 1000 else f"{value:.0f}"


def _refused(counts: dict[str, int]) -> int:
    """Measurements that were not applied."""
    reasons = ("gated", "too_late", "not_finite", "bad_covariance", "no_clone", "not_started")
    return sum(n for name, n in counts.items() if name.rpartition(".")[2] in reasons)


def _table(rows: list[RowSummary]) -> list[str]:
    width = max(len(one.row.label) for one in rows)
    lines = [f"{'':{width}}  runs  {'position RMSE, m (min-max)':>30}  scale error  refused   elsewhere"]
    for one in rows:
        scale = "-" if one.scale_error is None else f"{100 * one.scale_error.mean:.2f} %"
        refused = str(_refused(one.counts)) if one.counts else "-"
        elsewhere = one.row.elsewhere
        beside = "-"
        if elsewhere is not None:
            beside = _metres(elsewhere.rmse_m)
            if elsewhere.minimum_m is not None and elsewhere.maximum_m is not None:
                beside += f" ({elsewhere.minimum_m:.2f}-{elsewhere.maximum_m:.2f})"
            if elsewhere.scale_error is not None:
                beside += f", {100 * elsewhere.scale_error:.2f} %"
        error = "" if one.rmse.standard_error is None else f" ± {_metres(one.rmse.standard_error)}"
        range_ = f"({_metres(one.rmse.minimum)}-{_metres(one.rmse.maximum)})"
        figures = f"{_metres(one.rmse.mean)}{error} {range_:>13}"
        lines.append(
            f"{one.row.label:{width}}  {one.rmse.runs:4d}  {figures:>30}  {scale:>11}  {refused:>7}   "
            f"{beside}"
        )
    return lines


def _verdict(inside: bool) -> str:
    return "inside" if inside else "OUTSIDE"


_CONSISTENCY_NOTES = [
    "  19 states without gate; simulated as the filter's model has it: interval-mean IMU, walking biases,",
    "  0.01 rad of noise in the odometry's attitude. Runs are independent, the times of one run are not: the",
    "  bounds are those of an average over the runs at one time, which one over times as well must keep all",
    "  the more. ±: standard error, of the runs' own averages.",
]


def _consistency_text(one: ConsistencySummary) -> list[str]:
    lines = [f"{'NEES':20s}   dof   average  95 % bounds at one time             times inside"]
    for name, nees in one.nees.items():
        error = nees.overall_standard_error
        scatter = "" if error is None else f" ± {error:.2f}"
        lines.append(
            f"  {name:18s}   {nees.dof:3d}  {nees.overall:8.2f}  [{nees.lower:5.2f}, {nees.upper:5.2f}] "
            f"{_verdict(nees.inside):7s}{scatter:>9s}   {100 * nees.share_inside:6.0f} %"
        )
    nis = one.nis
    lines += [
        f"{'NIS':20s}   {nis.dof:3d}  {nis.average:8.3f}  [{nis.lower:5.3f}, {nis.upper:5.3f}] "
        f"{_verdict(nis.consistent)}, {nis.samples} innovations",
        f"  correlation of successive ones {one.nis_correlation:+.4f}, white: within "
        f"{one.nis_correlation_bound:.4f}: {_verdict(abs(one.nis_correlation) <= one.nis_correlation_bound)}",
    ]
    return lines


def text_of(study: Study) -> str:
    """For the terminal."""
    lines = [f"{SCENARIO}, {study.duration_s:g} s, {len(study.seeds)} seeds that every row has"]
    if study.interrupted:
        lines.append("INTERRUPTED: the tables hold what was finished by then.")
    for title, table in (("Comparison", "comparison"), ("Extensions", "extensions")):
        rows = [one for one in study.rows if one.row.table == table]
        if rows:
            lines += ["", f"{title}:", *_table(rows)]
    labels = {one.row.name: one.row.label for one in study.rows}
    for name, one in study.consistency.items():
        lines += ["", f"Consistency, {labels[name]}:", *_consistency_text(one)]
    if study.consistency:
        lines += _CONSISTENCY_NOTES
    if any(one.row.elsewhere for one in study.rows):
        lines += ["", f"elsewhere: {ELSEWHERE}"]
    if any(one.row.scale_walk for one in study.rows):
        lines.append(
            f"scale that wanders: random walk of its logarithm, {SCALE_WALK:g}/sqrt(s); relative VO: between "
            f"key frames {KEY_FRAME_INTERVAL_S:g} s apart"
        )
    return "\n".join(lines)


def _consistency_dict(c: ConsistencySummary) -> dict[str, Any]:
    nees = {
        name: {
            "dof": one.dof,
            "average": one.overall,
            "standard_error": one.overall_standard_error,
            "lower": one.lower,
            "upper": one.upper,
            "inside": one.inside,
            "share_of_times_inside": one.share_inside,
        }
        for name, one in c.nees.items()
    }
    nis = {
        "dof": c.nis.dof,
        "average": c.nis.average,
        "lower": c.nis.lower,
        "upper": c.nis.upper,
        "inside": c.nis.consistent,
        "innovations": c.nis.samples,
        "lag_one_correlation": c.nis_correlation,
        "lag_one_bound": c.nis_correlation_bound,
    }
    return {"nees": nees, "nis": nis}


def as_dict(study: Study) -> dict[str, Any]:
    """All figures, for JSON."""
    out: dict[str, Any] = {
        "study": NAME,
        "scenario": SCENARIO,
        "libloc": libloc.__version__,
        "duration_s": study.duration_s,
        "seeds": study.seeds,
        "interrupted": study.interrupted,
        "elsewhere": ELSEWHERE,
        "rows": [
            {
                "name": one.row.name,
                "label": one.row.label,
                "table": one.row.table,
                "parameters": dict(one.row.parameters),
                "position_rmse_m": one.rmse.as_dict(),
                "final_scale_error": one.scale_error and one.scale_error.as_dict(),
                "counts": one.counts,
                "elsewhere_rmse_m": one.row.elsewhere and one.row.elsewhere.rmse_m,
            }
            for one in study.rows
        ],
    }
    out["consistency"] = {name: _consistency_dict(one) for name, one in study.consistency.items()}
    return out


def write(study: Study, folder: Path) -> list[Path]:
    """Tables and pictures into a folder that is there. Returns the files."""
    from libloc.programs import study_vio_plots

    files = [folder / "vio.json", folder / "vio_rows.csv", folder / "vio_runs.csv"]
    files[0].write_text(json.dumps(as_dict(study), indent=1, allow_nan=False) + "\n")
    with files[1].open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(
            [
                "row",
                "table",
                "runs",
                "rmse_mean_m",
                "rmse_min_m",
                "rmse_max_m",
                "scale_error",
                "elsewhere_rmse_m",
            ]
        )
        for one in study.rows:
            scale = one.scale_error.mean if one.scale_error else ""
            elsewhere = one.row.elsewhere.rmse_m if one.row.elsewhere else ""
            r = one.rmse
            table.writerow(
                [one.row.name, one.row.table, r.runs, r.mean, r.minimum, r.maximum, scale, elsewhere]
            )
    with files[2].open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["row", "seed", "position_rmse_m", "final_scale_error"])
        for one in study.rows:
            for seed, outcome in sorted(study.outcomes[one.row.name].items()):
                scale = "" if np.isnan(outcome.scale_error) else outcome.scale_error
                table.writerow([one.row.name, seed, outcome.rmse_m, scale])
    return files + study_vio_plots.draw(study, folder)
