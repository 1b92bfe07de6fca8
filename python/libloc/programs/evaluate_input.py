"""What loc-evaluate compares: poses over time out of any of libloc's formats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import loc
import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import DataError, EstimateValid
from libloc.lcm_log import LogReader

# Axes of world as seen from east-north-up: q_enu_body = q * q_world_body.
_Q_ENU_WORLD = {
    "ENU": np.array([1.0, 0, 0, 0]),
    "NWU": np.array([np.sqrt(0.5), 0, 0, np.sqrt(0.5)]),
    "NED": np.array([0.0, np.sqrt(0.5), np.sqrt(0.5), 0]),
}


@dataclass
class Poses:
    """One trajectory. What is not known at a time is NaN."""

    path: Path
    form: str
    times_ns: NDArray[np.int64]  # increasing
    q_wxyz: NDArray[np.float64]  # (N, 4)
    position: NDArray[np.float64]  # (N, 3) [m]
    score: NDArray[np.bool]  # where the recording says that it is to be compared
    heading_is_absolute: bool | None = None  # tied to north; None: the file does not say
    world: str | None = None  # axes of world as in the file; None: the file does not say
    counts: dict[str, int] = field(default_factory=dict)

    def has_orientation(self) -> NDArray[np.bool]:
        return np.isfinite(self.q_wxyz).all(axis=1)

    def has_position(self) -> NDArray[np.bool]:
        return np.isfinite(self.position).all(axis=1)

    def trajectory(self, rows: NDArray[np.bool]) -> libloc.Trajectory:
        """Of the rows; an orientation or position that is not known there is the identity."""
        q, position = self.q_wxyz[rows], self.position[rows]
        q = np.where(np.isfinite(q).all(axis=1, keepdims=True), q, [1.0, 0, 0, 0])
        return libloc.Trajectory(self.times_ns[rows], q, np.nan_to_num(position, nan=0.0))


def multiply(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Product of quaternions wxyz; one and many."""
    w1, x1, y1, z1 = np.moveaxis(p, -1, 0)
    w2, x2, y2, z2 = np.moveaxis(q, -1, 0)
    return np.stack(
        [
            w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
            w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
            w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        ],
        axis=-1,
    )


def normalised(q: NDArray[np.float64], path: Path) -> NDArray[np.float64]:
    """Rows of NaN stay; DataError for a row that is far from a unit quaternion."""
    norm = np.linalg.norm(q, axis=1)
    wrong = np.flatnonzero(np.isfinite(norm) & (np.abs(norm - 1) > 1e-2))
    if len(wrong):
        raise DataError(
            f"{path}: orientation {wrong[0]} is not a unit quaternion, its norm is {norm[wrong[0]]}"
        )
    # What the library takes for a unit quaternion stays as it is, bit for bit.
    return np.ascontiguousarray(q / np.where(np.abs(norm - 1) < 5e-7, 1.0, norm)[:, None])


def _tum(path: Path) -> Poses:
    trajectory, counts = libloc.read_tum(path)
    score = np.ones(len(trajectory), dtype=bool)
    position = trajectory.position
    if not position.any():
        # TUM has no way to leave positions out: this is how orientations alone are written.
        position[:] = np.nan
        counts["tum.without_position"] = len(trajectory)
    return Poses(
        path,
        "tum",
        trajectory.times_ns,
        trajectory.q_world_body_wxyz,
        position,
        score,
        counts=counts,
    )


def _in_time_order(times_ns: NDArray[np.int64], counts: dict[str, int], name: str) -> NDArray[np.bool]:
    """Rows later than all before them; the others are counted."""
    keep = np.ones(len(times_ns), dtype=bool)
    keep[1:] = times_ns[1:] > np.maximum.accumulate(times_ns)[:-1]
    if not keep.all():
        counts[f"{name}.skipped.time_not_increasing"] = int(np.sum(~keep))
    return keep


def _estimates_of_log(path: Path, channel: str) -> Poses:
    """LOC_ESTIMATE messages of a log."""
    times, q, position, valid, worlds = [], [], [], [], set()
    log = LogReader(path, channels=[channel])
    for event in log:
        m = event.message
        if not isinstance(m, loc.estimate_t):
            raise DataError(f"{path}: channel {channel} carries {type(m).__name__}, not estimate_t")
        times.append(m.time_ns)
        q.append(m.q_world_body_wxyz)
        position.append(m.position)
        valid.append(m.valid)
        worlds.add(m.world)
    if not times:
        raise DataError(f"{path}: no message on channel {channel}")
    if len(worlds) > 1 or not worlds <= _Q_ENU_WORLD.keys():
        raise DataError(f"{path}: world of the estimates is {sorted(worlds)}: must be one of ENU, NWU, NED")
    counts = {"estimate.read": len(times)} | {f"log.{name}": value for name, value in log.damage.items()}
    return _estimates(path, "lcm", times, q, position, valid, worlds.pop(), counts)


_ESTIMATE_COLUMNS = ("time_ns", "qw", "qx", "qy", "qz", "px_m", "py_m", "pz_m", "valid")


def _is_estimate_csv(path: Path) -> bool:
    """CSV as loc-estimator writes it: no recording has a column of valid bits."""
    with path.open(encoding="utf-8", errors="replace") as file:
        return set(_ESTIMATE_COLUMNS) <= set(file.readline().strip().split(","))


def _estimates_of_csv(path: Path) -> Poses:
    """Estimates as loc-estimator writes them; what an estimate does not hold is an empty cell."""
    times, q, position, valid = [], [], [], []
    counts: dict[str, int] = {}
    with path.open(encoding="utf-8", newline="") as file:
        heading = file.readline().strip().split(",")
        at = [heading.index(name) for name in _ESTIMATE_COLUMNS]
        for number, line in enumerate(file, start=2):
            if not line.endswith("\n"):
                counts["estimate.skipped.no_line_end"] = 1  # cut while it was written
                break
            cells = line.strip().split(",")
            if len(cells) != len(heading):
                raise DataError(f"{path}:{number}: {len(cells)} cells, the heading has {len(heading)}")
            try:
                times.append(int(cells[at[0]]))
                q.append([float(cells[i] or "nan") for i in at[1:5]])
                position.append([float(cells[i] or "nan") for i in at[5:8]])
                valid.append(int(cells[at[8]]))
            except ValueError as error:
                raise DataError(f"{path}:{number}: {error}") from None
    if not times:
        raise DataError(f"{path}: no estimate in it")
    return _estimates(
        path, "estimates", times, q, position, valid, None, {"estimate.read": len(times)} | counts
    )


def _estimates(
    path: Path,
    form: str,
    times: list[int],
    q: list[Sequence[float]],
    position: list[Sequence[float]],
    valid: list[int],
    world: str | None,
    counts: dict[str, int],
) -> Poses:
    """Poses with what the estimator's valid bits say about them; world None: taken as it is."""
    times_ns, flags = np.array(times, dtype=np.int64), np.array(valid, dtype=np.int64)
    q_rows = np.array(q, dtype=float)
    q_rows[(flags & EstimateValid.ORIENTATION) == 0] = np.nan
    position_rows = np.array(position, dtype=float)
    position_rows[(flags & EstimateValid.POSITION) == 0] = np.nan
    oriented = np.isfinite(q_rows).all(axis=1)
    if not oriented.any():
        raise DataError(f"{path}: none of the {len(times)} estimates has an orientation")
    absolute = (flags & EstimateValid.HEADING) != 0
    score = np.ones(len(times), dtype=bool)
    if absolute[oriented].any():
        # A heading that is not tied to north yet (no magnetometer so far) has nothing to be compared with.
        score = absolute | ~oriented
        if not score.all():
            counts["estimate.heading_relative"] = int(np.sum(~score))
    q_enu_world = _Q_ENU_WORLD[world or "ENU"]
    keep = _in_time_order(times_ns, counts, "estimate")
    return Poses(
        path=path,
        form=form,
        times_ns=times_ns[keep],
        q_wxyz=multiply(q_enu_world, normalised(q_rows, path))[keep],
        position=libloc.Pose3(q_enu_world).transform(position_rows)[keep],
        score=score[keep],
        heading_is_absolute=bool(absolute[oriented].any()),
        world=world,
        counts=counts,
    )


def _reference(path: Path, form: str) -> Poses:
    """The reference stream of a recording."""
    recording = libloc.read_recording(path)
    r = recording.reference
    if not len(r.times_ns):
        streams = {"imu": recording.imu, "magnetometer": recording.magnetometer, "gps": recording.gps}
        found = [f"{name} ({len(s.times_ns)})" for name, s in streams.items() if len(s.times_ns)]
        raise DataError(f"{path}: no reference poses in it; it holds {', '.join(found) or 'nothing'}")
    counts = {name: value for name, value in recording.counts.items() if value}
    keep = _in_time_order(r.times_ns, counts, "reference")
    return Poses(
        path=path,
        form=form,
        times_ns=r.times_ns[keep],
        q_wxyz=normalised(r.q_world_body_wxyz, path)[keep],
        position=r.position[keep],
        score=r.score[keep],
        counts=counts,
    )


def read_estimate(path: Path, channel: str) -> Poses:
    """Estimates in an LCM log, loc-estimator's CSV, a TUM trajectory; or the reference of a recording."""
    form = libloc.file_format(path)
    if form == "tum":
        return _tum(path)
    if form == "lcm":
        return _estimates_of_log(path, channel)
    if form == "csv" and _is_estimate_csv(path):
        return _estimates_of_csv(path)
    return _reference(path, form)


def read_reference(path: Path) -> Poses:
    """TUM trajectory, EuRoC folder or CSV, BROAD trial, or the reference in an LCM log."""
    form = libloc.file_format(path)
    return _tum(path) if form == "tum" else _reference(path, form)
