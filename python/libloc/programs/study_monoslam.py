"""loc-study monoslam: how good SLAM with one camera is, alone and with an IMU, over many seeds.

Five tables: the simulation of K. Popov, "Monocular simultaneous location and mapping based on recursive
filtering" (2015, section 5.1) with and without noise; several levels of noise; one setting at a time away
from the base; NEES and NIS of the three treatments of consistency; and what bad tracks do. With --out also as
CSV and JSON, with pictures. Position errors are in metres and not aligned: the start is given, and known
landmarks or the IMU give the unit of lengths, but for the rows that say otherwise.
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
from libloc.programs import study_monoslam_run as slam
from libloc.programs.study_monoslam_cases import CONSISTENCY, SETTLED_S, TABLES, Case, selected
from libloc.programs.study_monoslam_verdicts import Requirement, requirements
from libloc.programs.study_runner import StudyError
from libloc.programs.study_statistics import (
    ConsistencyOverTime,
    Summary,
    consistency_over_time,
    summarise,
)

NAME = "monoslam"
HELP = "SLAM with one camera, alone and with an IMU, on simulated tracks"

Outcomes = dict[str, dict[int, slam.Outcome]]  # by case and seed


@dataclass
class CaseSummary:
    case: Case
    rms: Summary  # of position, over all frames [m]
    settled_rms: Summary | None  # after the initial peak [m]
    median_m: float  # of the runs' rms
    turned_deg: float  # root mean square over runs and frames
    map_rms: Summary | None
    nis_per_dim: float
    nis_expected: float  # of what passes the gate
    diverged: int  # runs
    counts: dict[str, int]  # sums over frames and runs


@dataclass
class Nees:
    over_time: ConsistencyOverTime
    median: float  # of the runs' averages


@dataclass
class Study:
    outcomes: Outcomes
    rows: list[CaseSummary]
    consistency: dict[str, dict[str, Nees]]  # by case and block
    distances: dict[str, float]  # of the treatments of consistency from a right NEES; empty without all rows
    requirements: list[Requirement]
    seeds: list[int]  # that all rows have
    quick: bool
    interrupted: bool


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="10 s of each path, only the ends of each sweep")
    parser.add_argument(
        "--rows", nargs="+", default=[], metavar="NAME", help="rows or tables to compute (default: all)"
    )


def tasks(options: argparse.Namespace, seeds: range) -> list[slam.Task]:
    """Raises StudyError for options that are wrong."""
    return slam.make_tasks(selected(options.rows, options.quick), seeds)


run = slam.run


def expected_nis(gate: float) -> float:
    """Of one number, when only what passes the gate counts: chi-square of 2, cut at that probability."""
    bound = libloc.chi_square_quantile(gate, 2)
    return libloc.chi_square_cdf(bound, 4) / libloc.chi_square_cdf(bound, 2)


def _summary(case: Case, runs: list[slam.Outcome]) -> CaseSummary:
    rms = summarise(np.array([one.rms_m for one in runs]))
    assert rms is not None
    counts: dict[str, int] = {}
    for one in runs:
        for name, count in one.counts.items():
            counts[name] = counts.get(name, 0) + count
    dims = sum(one.nis_dim for one in runs)
    return CaseSummary(
        case,
        rms,
        summarise(np.array([one.settled_rms_m for one in runs])),
        float(np.median([one.rms_m for one in runs])),
        float(np.degrees(np.sqrt(np.mean([one.turned_rms_rad**2 for one in runs])))),
        summarise(np.array([one.map_rms_m for one in runs])),
        sum(one.nis for one in runs) / dims if dims else float("nan"),
        expected_nis(runs[0].gate),
        sum(one.diverged for one in runs),
        counts,
    )


def _nees(case: Case, runs: list[slam.Outcome]) -> dict[str, Nees]:
    # A filter that starts late has fewer estimates: the times that all runs have.
    common = min(len(one.times_s) for one in runs)
    stacked = np.stack([one.nees[-common:] for one in runs])
    if not all(np.array_equal(one.times_s[-common:], runs[0].times_s[-common:]) for one in runs):
        raise StudyError(f"row {case.name}: runs end at different times")
    known = np.isfinite(stacked).all(axis=(0, 2))
    out = {}
    for i, (name, block) in enumerate(slam.BLOCKS):
        values = stacked[:, known, i]
        over_time = consistency_over_time(values, block.stop - block.start)
        out[name] = Nees(over_time, float(np.median(values.mean(axis=1))))
    return out


def distances(consistency: dict[str, dict[str, Nees]], worlds: Iterable[str]) -> dict[str, float]:
    """How far from right the NEES of position and orientation are with each treatment; 0 is right.

    The mean over worlds and blocks of |log(average NEES / degrees of freedom)|. Empty without all rows.
    """
    parts: dict[str, list[float]] = {}
    for world in worlds:
        for name in CONSISTENCY:
            blocks = consistency.get(f"{world}-{name}")
            if blocks is None:
                return {}
            parts.setdefault(name, []).extend(
                abs(np.log(blocks[block].over_time.overall / blocks[block].over_time.dof))
                for block in ("position", "orientation")
            )
    return {name: float(np.mean(values)) for name, values in parts.items()}


def evaluate(
    finished: Iterable[tuple[slam.Task, dict[str, slam.Outcome]]],
    options: argparse.Namespace,
    interrupted: bool,
) -> Study:
    """Tables from what is finished, in whatever order it came."""
    outcomes: Outcomes = {}
    for task, result in finished:
        for name, outcome in result.items():
            outcomes.setdefault(name, {})[task.seed] = outcome
    cases = [case for case in selected(options.rows, options.quick) if case.name in outcomes]
    runs = {case.name: [outcomes[case.name][seed] for seed in sorted(outcomes[case.name])] for case in cases}
    consistency = {case.name: _nees(case, runs[case.name]) for case in cases if case.table == "consistency"}
    worlds = sorted({case.group for case in cases if case.table == "consistency"})
    common = set.intersection(*(set(of_case) for of_case in outcomes.values())) if outcomes else set()
    return Study(
        outcomes,
        [_summary(case, runs[case.name]) for case in cases],
        consistency,
        distances(consistency, worlds),
        requirements(runs),
        sorted(common),
        options.quick,
        interrupted,
    )


def _errors_text(rows: list[CaseSummary]) -> list[str]:
    width = max(len(one.case.label) for one in rows)
    lines = [
        f"{'':{width}}  runs  {'position RMS, m (median, min-max)':>36}  settled  turned, deg  map, m  "
        "NIS/dim  lost"
    ]
    for one in rows:
        figures = f"{one.rms.mean:.3f} ({one.median_m:.3f}, {one.rms.minimum:.3f}-{one.rms.maximum:.3f})"
        settled = "-" if one.settled_rms is None else f"{one.settled_rms.mean:.3f}"
        of_map = "-" if one.map_rms is None else f"{one.map_rms.mean:.3f}"
        lines.append(
            f"{one.case.label:{width}}  {one.rms.runs:4d}  {figures:>36}  {settled:>7}  "
            f"{one.turned_deg:11.2f}  {of_map:>6}  {one.nis_per_dim:7.3f}  {one.diverged:4d}"
        )
    return lines


def _consistency_text(study: Study) -> list[str]:
    rows = [one for one in study.rows if one.case.table == "consistency"]
    width = max(len(one.case.label) for one in rows)
    names = [name for name, _ in slam.BLOCKS]
    columns = "".join(f"{f'NEES {name} (median)':>30}" for name in names)
    lines = [f"{'':{width}}{columns}   NIS/dim (with gate)"]
    for one in rows:
        text = f"{one.case.label:{width}}"
        for name in names:
            nees = study.consistency[one.case.name][name]
            inside = "inside" if nees.over_time.inside else "OUTSIDE"
            text += f"{f'{nees.over_time.overall:.2f} ({nees.median:.2f}) {inside}':>30}"
        lines.append(f"{text}   {one.nis_per_dim:7.3f} ({one.nis_expected:.3f})")
    first = study.consistency[rows[0].case.name]["position"].over_time
    lines += [
        f"  3 degrees of freedom each; 95 % bounds of an average over {first.runs} runs at one time: "
        f"[{first.lower:.2f}, {first.upper:.2f}]. NIS of one number is 1,",
        "  and less when only what passes the gate counts: (with gate).",
    ]
    if study.distances:
        each = ", ".join(f"{name} {distance:.2f}" for name, distance in study.distances.items())
        lines.append(
            f"  Distance from right, mean of |ln(NEES/3)| of position and orientation: {each}. Nearest: "
            f"{_nearest(study)}; the default is {_default_consistency()}."
        )
    return lines


def _nearest(study: Study) -> str | None:
    return min(study.distances, key=study.distances.__getitem__) if study.distances else None


def _default_consistency() -> str:
    value = libloc.SlamOptions().consistency
    return next(name for name, one in CONSISTENCY.items() if one == value)


_TITLES = {
    "document": "The document's path with and without noise, the filter told 1 px",
    "noise": "Levels of noise",
    "sweep": "One setting at a time",
    "consistency": "Consistency",
    "robustness": "Bad tracks",
}


def text_of(study: Study) -> str:
    """For the terminal."""
    lines = [f"{len(study.seeds)} seeds that every row has{', quick' if study.quick else ''}"]
    if study.interrupted:
        lines.append("INTERRUPTED: the tables hold what was finished by then.")
    for table in TABLES:
        rows = [one for one in study.rows if one.case.table == table]
        if not rows:
            continue
        lines += ["", f"{_TITLES[table]}:"]
        if table == "sweep":
            for group in dict.fromkeys(one.case.group for one in rows):
                lines += [f"  {group}", *_errors_text([one for one in rows if one.case.group == group])]
            continue
        lines += _errors_text(rows)
        if table == "consistency":
            lines += ["", *_consistency_text(study)]
    lines += ["", f"settled: from {SETTLED_S:g} s on; lost: runs with an error over {slam.LOST_M:g} m"]
    if study.requirements:
        lines += ["", "Requirements:"]
        width = max(len(one.text) for one in study.requirements)
        for one in study.requirements:
            lines.append(f"  {one.text:{width}}  {one.measured}  {'held' if one.held else 'NOT HELD'}")
    return "\n".join(lines)


def _row_dict(one: CaseSummary) -> dict[str, Any]:
    case = one.case
    return {
        "name": case.name,
        "label": case.label,
        "table": case.table,
        "group": case.group,
        "world": {
            "name": case.world.name,
            "sigma_px": case.world.sigma_px,
            "focal_px": case.world.focal_px,
            "size_px": case.world.size_px,
            "spoilt": case.world.spoilt,
            "duration_s": case.world.duration_s,
        },
        "settings": {name: getattr(value, "name", value) for name, value in case.settings},
        "landmarks": case.landmarks,
        "position_rms_m": one.rms.as_dict(),
        "position_rms_median_m": one.median_m,
        "settled_rms_m": one.settled_rms and one.settled_rms.as_dict(),
        "orientation_rms_deg": one.turned_deg,
        "map_rms_m": one.map_rms and one.map_rms.as_dict(),
        "nis_per_dim": None if np.isnan(one.nis_per_dim) else one.nis_per_dim,
        "nis_per_dim_expected": one.nis_expected,
        "diverged": one.diverged,
        "counts": one.counts,
    }


def _nees_dict(one: Nees) -> dict[str, Any]:
    c = one.over_time
    return {
        "dof": c.dof,
        "average": c.overall,
        "median_of_runs": one.median,
        "standard_error": c.overall_standard_error,
        "lower": c.lower,
        "upper": c.upper,
        "inside": c.inside,
        "share_of_times_inside": c.share_inside,
    }


def as_dict(study: Study) -> dict[str, Any]:
    """All figures, for JSON."""
    return {
        "study": NAME,
        "libloc": libloc.__version__,
        "seeds": study.seeds,
        "quick": study.quick,
        "interrupted": study.interrupted,
        "rows": [_row_dict(one) for one in study.rows],
        "consistency": {
            name: {block: _nees_dict(one) for block, one in blocks.items()}
            for name, blocks in study.consistency.items()
        },
        "distance_from_right": study.distances,
        "nearest_consistency": _nearest(study),
        "requirements": [
            {"name": one.text, "measured": one.measured, "held": one.held} for one in study.requirements
        ],
    }


def _write_rows(study: Study, path: Path) -> None:
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(
            "row table group runs rms_mean_m rms_median_m rms_min_m rms_max_m settled_rms_m "
            "orientation_rms_deg map_rms_m nis_per_dim nis_per_dim_expected nees_position nees_orientation "
            "diverged".split()
        )
        for one in study.rows:
            nees = study.consistency.get(one.case.name)
            of_blocks = [nees[x].over_time.overall if nees else "" for x in ("position", "orientation")]
            table.writerow(
                [
                    one.case.name,
                    one.case.table,
                    one.case.group,
                    one.rms.runs,
                    one.rms.mean,
                    one.median_m,
                    one.rms.minimum,
                    one.rms.maximum,
                    one.settled_rms.mean if one.settled_rms else "",
                    one.turned_deg,
                    one.map_rms.mean if one.map_rms else "",
                    one.nis_per_dim,
                    one.nis_expected,
                    *of_blocks,
                    one.diverged,
                ]
            )


def _write_runs(study: Study, path: Path) -> None:
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(
            "row seed position_rms_m settled_rms_m max_m orientation_rms_deg map_rms_m flagged flagged_dark "
            "rejected".split()
        )
        for one in study.rows:
            for seed, o in sorted(study.outcomes[one.case.name].items()):
                figures = (
                    o.rms_m,
                    o.settled_rms_m,
                    o.max_m,
                    np.degrees(o.turned_rms_rad),
                    o.map_rms_m,
                    o.flagged,
                    o.flagged_dark,
                )
                cells = ["" if np.isnan(x) else float(x) for x in figures]
                table.writerow([one.case.name, seed, *cells, o.counts["rejected"]])


def write(study: Study, folder: Path) -> list[Path]:
    """Tables and pictures into a folder that is there. Returns the files."""
    from libloc.programs import study_monoslam_plots

    files = [folder / f"{NAME}{rest}" for rest in (".json", "_rows.csv", "_runs.csv")]
    files[0].write_text(json.dumps(as_dict(study), indent=1, allow_nan=False) + "\n")
    _write_rows(study, files[1])
    _write_runs(study, files[2])
    return files + study_monoslam_plots.draw(study, folder)
