"""A drive out of LCM logs, as loc-simulate, loc-estimator and lcm-logger write them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import loc
import numpy as np
from numpy.typing import NDArray

import libloc
from libloc._core import NO_TIME, DataError, EstimateValid
from libloc.driving.run import DrivingRun, Estimate, Floats, Odometry, Truth
from libloc.lcm_log import LogReader

_COVARIANCE_DIM = 15  # theta, p, v, bg, ba


def run_of_log(
    path: str | os.PathLike[str],
    recording: str | os.PathLike[str] | None = None,
    channel: str = libloc.ESTIMATE_CHANNEL,
    truth_csv: str | os.PathLike[str] | None = None,
) -> tuple[DrivingRun, dict[str, int]]:
    """The drive in a log that holds estimates, and counts of what was left out of it and why.

    truth_csv: what loc-simulate writes beside a recording (LOG.truth.csv); it knows biases and scale, too.

    recording: where truth (reference poses) and odometry are, in any form that read_recording() reads; by
    default the same log. Raises DataError naming file and what is missing or wrong.
    """
    path, source = Path(path), Path(recording or path)
    counts: dict[str, int] = {}
    estimate = _estimate(path, channel, counts)
    data = libloc.read_recording(source)
    counts.update({name: n for name, n in data.counts.items() if n and "skipped" in name})
    truth = _truth(source, data.reference, counts) if truth_csv is None else truth_of_csv(truth_csv)
    odometry = _odometry(data.odometry, counts)
    try:
        run = DrivingRun(truth, estimate, odometry)
    except ValueError as error:
        raise DataError(f"{path}: {error}") from None
    if run.without_truth:
        counts["estimate.without_truth"] = run.without_truth
    return run, counts


_TRUTH_COLUMNS = {
    "q_world_body_wxyz": [f"q_world_body_{axis}" for axis in "wxyz"],
    "position": [f"position_{axis}_m" for axis in "xyz"],
    "gyroscope_bias": [f"gyroscope_bias_{axis}_rad_s" for axis in "xyz"],
    "accelerometer_bias": [f"accelerometer_bias_{axis}_m_s2" for axis in "xyz"],
    "odometry_scale": ["odometry_scale"],
}


def truth_of_csv(path: str | os.PathLike[str]) -> Truth:
    """truth.csv as loc-simulate writes it; an empty cell is not known.

    Raises DataError naming file, line and column.
    """
    path = Path(path)
    if not path.is_file():
        raise DataError(f"{path}: no such file")
    times: list[int] = []
    values: list[list[float]] = []
    with path.open(encoding="utf-8", errors="replace", newline="") as file:
        heading = file.readline().strip().split(",")
        wanted = ["time_ns", *(name for names in _TRUTH_COLUMNS.values() for name in names)]
        missing = [name for name in wanted if name not in heading]
        if missing:
            raise DataError(f"{path}:1: no column {missing[0]}; this is not a truth.csv of loc-simulate")
        at = [heading.index(name) for name in wanted]
        for number, line in enumerate(file, start=2):
            cells = line.strip().split(",")
            if len(cells) != len(heading) or not line.endswith("\n"):
                raise DataError(
                    f"{path}:{number}: {len(cells)} cells, the heading has {len(heading)}, or it is cut"
                )
            try:
                times.append(int(cells[at[0]]))
                values.append([float(cells[i] or "nan") for i in at[1:]])
            except ValueError as error:
                raise DataError(f"{path}:{number}: {error}") from None
    table = np.array(values, dtype=float).reshape(len(times), len(at) - 1)
    columns: dict[str, Floats] = {}
    first = 0
    for name, parts in _TRUTH_COLUMNS.items():
        part = table[:, first : first + len(parts)]
        columns[name] = part[:, 0] if len(parts) == 1 else part
        first += len(parts)
    try:
        return Truth(np.array(times, dtype=np.int64), **columns)
    except ValueError as error:
        raise DataError(f"{path}: {error}") from None


def _in_order(times_ns: NDArray[np.int64]) -> NDArray[np.bool]:
    """Rows later than all before them."""
    keep = np.ones(len(times_ns), dtype=bool)
    keep[1:] = times_ns[1:] > np.maximum.accumulate(times_ns)[:-1]
    return keep


def _kept(keep: NDArray[np.bool], name: str, counts: dict[str, int]) -> NDArray[np.bool]:
    if not keep.all():
        counts[name] = int(np.sum(~keep))
    return keep


def _estimate(path: Path, channel: str, counts: dict[str, int]) -> Estimate:
    if libloc.file_format(path) != "lcm":
        raise DataError(f"{path}: is not an LCM log; estimates with their covariance are read from one")
    log = LogReader(path, channels=[channel, libloc.FUSION_CHANNEL])
    rows: list[Any] = []
    scales: dict[tuple[int, int], tuple[float, float]] = {}
    incomplete = 0
    for event in log:
        m = event.message
        if isinstance(m, loc.fusion_t):
            scales[m.time_ns, m.sequence] = (m.scale, m.scale_sigma)
            continue
        if not isinstance(m, loc.estimate_t):
            raise DataError(f"{path}: channel {channel} carries {type(m).__name__}, not estimate_t")
        if m.world != "ENU":
            raise DataError(f"{path}: world of the estimates is {m.world!r}: must be ENU to be drawn")
        needed = EstimateValid.ORIENTATION | EstimateValid.POSITION
        if m.valid & needed != needed:
            incomplete += 1
            continue
        rows.append(m)
    counts.update({f"log.{name}": value for name, value in log.damage.items()})
    if incomplete:
        counts["estimate.without_pose"] = incomplete
    if not rows:
        raise DataError(
            f"{path}: no estimate with position and orientation on channel {channel} "
            f"({incomplete} without them)"
        )
    times = np.array([m.time_ns for m in rows], dtype=np.int64)
    keep = _kept(_in_order(times), "estimate.skipped.time_not_increasing", counts)
    rows = [m for m, kept in zip(rows, keep, strict=True) if kept]
    if len(rows) < 2:
        raise DataError(f"{path}: {len(rows)} estimate in it, at least 2 are needed")
    sigma = np.full((len(rows), _COVARIANCE_DIM), np.nan)
    for i, m in enumerate(rows):
        if m.valid & EstimateValid.COVARIANCE and m.covariance_dim:
            diagonal = np.diagonal(np.array(m.covariance))[:_COVARIANCE_DIM]
            sigma[i, : len(diagonal)] = np.sqrt(np.where(diagonal >= 0, diagonal, np.nan))
    scale = np.array([scales.get((m.time_ns, m.sequence), (np.nan, np.nan)) for m in rows])

    def column(name: str, bit: int) -> Floats | None:
        values = np.array([getattr(m, name) if m.valid & bit else (np.nan,) * 3 for m in rows])
        return values if np.isfinite(values).any() else None

    def known(values: Floats) -> Floats | None:
        return values if np.isfinite(values).any() else None

    try:
        return Estimate(
            times_ns=times[keep],
            q_world_body_wxyz=np.array([m.q_world_body_wxyz for m in rows]),
            position=np.array([m.position for m in rows]),
            attitude_sigma=known(sigma[:, 0:3]),
            position_sigma=known(sigma[:, 3:6]),
            gyroscope_bias=column("gyroscope_bias", EstimateValid.GYROSCOPE_BIAS),
            gyroscope_bias_sigma=known(sigma[:, 9:12]),
            accelerometer_bias=column("accelerometer_bias", EstimateValid.ACCELEROMETER_BIAS),
            accelerometer_bias_sigma=known(sigma[:, 12:15]),
            scale=known(scale[:, 0]),
            scale_sigma=known(scale[:, 1]),
        )
    except ValueError as error:
        raise DataError(f"{path}: {error}") from None


def _truth(path: Path, reference: Any, counts: dict[str, int]) -> Truth:
    poses = np.hstack([reference.position, reference.q_world_body_wxyz])
    complete = np.isfinite(poses).all(axis=1)
    rows = np.flatnonzero(_kept(complete, "reference.without_pose", counts))
    times = reference.times_ns[rows]
    if len(rows):
        rows = rows[_kept(_in_order(times), "reference.skipped.time_not_increasing", counts)]
    if len(rows) < 2:
        raise DataError(
            f"{path}: {len(rows)} reference poses with position and orientation in it, at least 2 are needed "
            f"(--reference names a recording that holds them)"
        )
    try:
        return Truth(reference.times_ns[rows], reference.q_world_body_wxyz[rows], reference.position[rows])
    except ValueError as error:
        raise DataError(f"{path}: {error}") from None


def _odometry(odometry: Any, counts: dict[str, int]) -> Odometry | None:
    """Absolute positions; relative ones cannot be drawn and are counted."""
    absolute = odometry.start_times_ns == NO_TIME
    if len(absolute):
        _kept(absolute, "odometry.relative", counts)
    good = absolute & np.isfinite(odometry.position).all(axis=1)
    rows = np.flatnonzero(good)
    if len(rows):
        rows = rows[_kept(_in_order(odometry.times_ns[rows]), "odometry.skipped.time_not_increasing", counts)]
    return Odometry(odometry.times_ns[rows], odometry.position[rows]) if len(rows) >= 2 else None
