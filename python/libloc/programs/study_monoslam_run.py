"""One seed of the study of SLAM with one camera: simulates, runs the filter, measures its errors.

Errors are of body against the truth, in the filter's own world, without alignment: the start is given, and
where no IMU gives the metre, known landmarks do. With an IMU the filter begins at a place and a heading by
convention; the truth is moved there, by place and turn about z of the first estimate and nothing else. A row
may ask for the best similarity transform instead (aligned), where the unit of lengths is not known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc.programs.study_monoslam_cases import SETTLED_S, Case
from libloc.programs.study_monoslam_worlds import DARK_S, Simulated, World, simulate
from libloc.programs.study_statistics import normalised_squares

Floats = NDArray[np.float64]

_THETA, _POSITION, _VELOCITY = slice(0, 3), slice(3, 6), slice(6, 9)
BLOCKS = (("position", _POSITION), ("orientation", _THETA), ("velocity", _VELOCITY))
LOST_M = 3.0  # an error beyond it: the filter has diverged
EVERY = 5  # curves are kept at every so many frames


def _nothing() -> Floats:
    return np.empty((0, 3))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


@dataclass(frozen=True)
class Task:
    """Cases that share a simulated recording."""

    seed: int
    world: World
    cases: tuple[Case, ...]


@dataclass
class Outcome:
    """Of one case with one seed."""

    estimates: int  # frames that the filter has an estimate of
    rms_m: float  # of position, over all of them
    settled_rms_m: float  # after the initial peak
    late_rms_m: float  # from a second after the dark, which is in the middle, dark or not
    max_m: float
    turned_rms_rad: float  # angle of the orientation error
    map_rms_m: float  # over the well-known points of the map at the end; NaN without their truth
    nis: float  # sum over the frames
    nis_dim: int
    gate: float  # probability of a right measurement to pass
    flagged: float  # share of the frames after which the filter says FEW_FEATURES
    flagged_dark: float  # of those without a feature; NaN when there are none
    counts: dict[str, int]  # sums over the frames
    # At every so many frames of the recording, where the filter has an estimate.
    times_s: Floats
    error_m: Floats
    reprojection_px: Floats  # before the update; NaN where nothing was measured
    nees: Floats  # (T, blocks)
    # For pictures.
    trajectory: Floats = field(default_factory=_nothing)
    true_trajectory: Floats = field(default_factory=_nothing)
    map_points: Floats = field(default_factory=_nothing)
    true_points: Floats = field(default_factory=_nothing)

    @property
    def diverged(self) -> bool:
        return not self.max_m < LOST_M


def make_tasks(cases: Sequence[Case], seeds: range) -> list[Task]:
    groups: dict[World, list[Case]] = {}
    for case in cases:
        groups.setdefault(case.world, []).append(case)
    return [Task(seed, world, tuple(group)) for seed in seeds for world, group in groups.items()]


def _landmarks(case: Case, simulated: Simulated) -> list[libloc.KnownLandmark]:
    """Of the first frame, as many as the case says."""
    first = np.sort(simulated.tracks.id[: simulated.tracks.first[1]])[: case.landmarks]
    return [libloc.KnownLandmark(int(i), simulated.points[i], 0.001) for i in first]


def options_of(case: Case, simulated: Simulated) -> libloc.SlamOptions:
    """Raises ValueError naming a setting that is not known or out of range."""
    options = libloc.SlamOptions()
    options.camera = simulated.camera
    options.override_sigma = True
    if simulated.imu is not None:
        options.motion = libloc.SlamMotion.INERTIAL
        options.imu_noise = simulated.imu.noise
    else:
        options.position = simulated.position[0]
        options.q_world_body_wxyz = simulated.q_wxyz[0]
        if case.motion_known:
            options.velocity = simulated.velocity[0]
            options.angular_velocity = simulated.angular_velocity[0]
        options.landmarks = _landmarks(case, simulated)
    for name, value in case.settings:
        *outer, last = name.split(".")
        target: Any = options
        for part in outer:
            target = getattr(target, part)
        if not hasattr(target, last):
            raise ValueError(f"{name}: is not a setting of SlamOptions")
        setattr(target, last, value)
    options.check()
    return options


def _attitude(wxyz: Floats) -> libloc.Pose3:
    return libloc.Pose3(wxyz, np.zeros(3))


def _moved_truth(
    case: Case, simulated: Simulated, rows: NDArray[np.int64], result: Any
) -> tuple[Floats, Floats, Floats]:
    """Attitude, position and velocity that are true, in the filter's world."""
    q, p, v = simulated.q_wxyz[rows], simulated.position[rows], simulated.velocity[rows]
    if simulated.imu is not None:
        # The turn about z that leaves no error about z, which is what the filter's covariance begins with;
        # headings of axes would bring in the tilt's error.
        w, _, _, z = (_attitude(result.q_world_body_wxyz[0]) * _attitude(q[0]).inverse()).rotation_wxyz
        turn = _attitude(np.array([w, 0, 0, z]) / np.hypot(w, z))
        R = turn.matrix()[:3, :3]
        offset = result.position[0] - R @ p[0]
        turned = np.array([(turn * _attitude(one)).rotation_wxyz for one in q])
        return turned, p @ R.T + offset, v @ R.T
    return q, p, v


def _aligned(estimate: Floats, truth: Floats) -> Floats:
    """The estimate moved, turned and scaled onto the truth."""
    fit = libloc.align_points(estimate, truth, "sim3")
    if not fit.ok:
        raise ValueError(f"no similarity transform: {fit.failure}")
    T = fit.T_reference_estimate
    return fit.scale * estimate @ T.matrix()[:3, :3].T + T.translation


def run_case(case: Case, simulated: Simulated) -> Outcome:
    """Raises ValueError when the filter never starts."""
    options = options_of(case, simulated)
    tracks, imu = simulated.tracks, simulated.imu
    frames = (tracks.times_ns, tracks.first, tracks.id, tracks.pixel_px)
    if imu is None:
        result = libloc.MonoSlam(options).run(*frames)
    else:
        result = libloc.InertialSlam(options).run(*frames, imu.times_ns, imu.gyro, imu.force)
    if len(result.time_ns) == 0:
        raise ValueError(f"{case.name}: the filter has not started")
    rows = np.searchsorted(simulated.times_ns, result.time_ns)
    if not np.array_equal(simulated.times_ns[rows], result.time_ns):
        raise ValueError(f"{case.name}: an estimate is of a time without frame")
    q, p, v = _moved_truth(case, simulated, rows, result)
    estimated = _aligned(result.position, p) if case.aligned else result.position
    errors = np.hstack(
        [libloc.so3.boxminus(q, result.q_world_body_wxyz), p - result.position, v - result.velocity]
    )
    nees = np.full((len(rows), len(BLOCKS)), np.nan)
    # Place and heading of the first one are known to be right.
    known = rows > rows[0]
    for i, (_, block) in enumerate(BLOCKS):
        nees[known, i] = normalised_squares(errors[known, block], result.covariance[known, block, block])
    map_points, ids = np.asarray(result.map.position), np.asarray(result.map.id)
    usable = np.asarray(result.map.converted) & (ids < len(simulated.points))
    map_points, points = map_points[usable], simulated.points[ids[usable]]
    times_s = (result.time_ns - simulated.times_ns[0]) * 1e-9
    error_m = np.linalg.norm(estimated - p, axis=1)
    few = (np.asarray(result.status) & int(libloc.EstimateStatus.FEW_FEATURES)) != 0
    middle_s = (simulated.times_ns[-1] - simulated.times_ns[0]) * 0.5e-9
    dark = np.asarray(result.counts["in_frame"]) == 0
    kept = rows % EVERY == 0
    out = Outcome(
        estimates=len(rows),
        rms_m=_rms(error_m),
        settled_rms_m=_rms(error_m[times_s >= SETTLED_S]),
        late_rms_m=_rms(error_m[times_s >= middle_s + DARK_S / 2 + 1]),
        max_m=float(np.max(error_m)),
        turned_rms_rad=_rms(np.linalg.norm(errors[:, _THETA], axis=1)),
        map_rms_m=_rms(np.linalg.norm(map_points - points, axis=1)),
        nis=float(np.sum(result.nis)),
        nis_dim=int(np.sum(result.nis_dim)),
        gate=options.association.gate(options.motion),
        flagged=float(np.mean(few)),
        flagged_dark=float(np.mean(few[dark])) if dark.any() else float("nan"),
        counts={name: int(np.sum(values)) for name, values in result.counts.items()},
        times_s=times_s[kept],
        error_m=error_m[kept],
        reprojection_px=np.asarray(result.reprojection_before_px)[kept],
        nees=nees[kept],
    )
    if case.picture:
        out.trajectory, out.true_trajectory = estimated, p
        out.map_points, out.true_points = map_points, points
    return out


def run(task: Task) -> dict[str, Outcome]:
    """Outcome of each case by its name."""
    simulated = simulate(task.world, task.seed)
    return {case.name: run_case(case, simulated) for case in task.cases}
