"""One seed of the study of the visual-inertial example: simulates, runs the filter, measures its errors."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc.programs.study_statistics import normalised_squares
from libloc.programs.study_vio_rows import GPS_ANTENNA, KEY_FRAME_INTERVAL_S, SCENARIO, Row

Floats = NDArray[np.float64]

# Of the error state of configuration 19: name, first row, size.
BLOCKS = (
    ("attitude", 0, 3),
    ("position", 3, 3),
    ("velocity", 6, 3),
    ("gyroscope bias", 9, 3),
    ("accelerometer bias", 12, 3),
    ("scale", 15, 1),
    ("drift", 16, 3),
)
STATES = 19
_SCALE = 15
# Errors over time are kept at every so many IMU samples: a multiple of the four between two frames.
EVERY = 20


@dataclass(frozen=True)
class Task:
    """Rows that share a simulated recording."""

    seed: int
    duration_s: float
    rows: tuple[Row, ...]


@dataclass
class Outcome:
    """Of one row with one seed."""

    rmse_m: float  # of position, over all IMU samples (oracle: all frames)
    scale_error: float  # relative, at the end; NaN without odometry
    counts: dict[str, int]  # of the filter: what became of the measurements
    times_s: Floats
    error_m: Floats  # of position, at times_s
    nees: Floats | None = None  # (T, 1 + blocks), whole state first, at times_s
    nis: Floats | None = None  # of each fused frame


@dataclass
class Odometry:
    """Columns as ErrorStateFilter.run takes them."""

    times_ns: NDArray[np.int64]
    position: Floats
    wxyz: Floats
    position_cov: Floats
    orientation_cov: Floats
    start_times_ns: NDArray[np.int64] | None = None


def make_tasks(rows: list[Row], seeds: range, duration_s: float) -> list[Task]:
    groups: dict[tuple[tuple[str, object], ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(row.parameters, []).append(row)
    return [Task(seed, duration_s, tuple(group)) for seed in seeds for group in groups.values()]


def key_frames(odometry: Any, interval_ns: int, sensors: libloc.FusionPresetSensors) -> Odometry:
    """Poses of absolute odometry relative to each other, from one key frame to the next.

    From frame to frame there would be little but the white noise of absolute poses, and that of each frame in
    two of them with opposite signs, which the filter does not know; over a second the drift outweighs it.
    """
    times = odometry.times_ns
    rows = [0]
    for i in range(1, len(times)):
        if times[i] - times[rows[-1]] >= interval_ns:
            rows.append(i)
    poses = [libloc.Pose3(odometry.q_wxyz[i], odometry.position[i]) for i in rows]
    steps = [poses[i].inverse() * poses[i + 1] for i in range(len(rows) - 1)]
    position = np.array([step.translation for step in steps]).reshape(-1, 3)
    orientation_var = sensors.odometry_orientation_sigma**2
    phi = 1 - 1 / sensors.odometry_drift_tau
    step_var = (
        2 / sensors.odometry_drift_tau + 1 / sensors.odometry_drift_tau**2
    ) * sensors.odometry_drift_sigma**2
    frames = np.diff(times[rows]) * 1e-9 * sensors.odometry_rate_hz
    # Of the difference of two values of the drift so many frames apart.
    drift_var = 2 * step_var / (1 - phi**2) * (1 - phi**frames)
    # The attitude of the first frame turns the piece of way: |p|^2 I - p p^T.
    lever = (
        np.sum(position**2, axis=1)[:, None, None] * np.eye(3) - position[:, :, None] * position[:, None, :]
    )
    return Odometry(
        times_ns=times[rows[1:]],
        start_times_ns=times[rows[:-1]],
        position=position,
        wxyz=np.array([step.rotation_wxyz for step in steps]).reshape(-1, 4),
        position_cov=(2 * sensors.odometry_white_sigma**2 + drift_var)[:, None, None] * np.eye(3)
        + orientation_var * lever,
        orientation_cov=2 * orientation_var * np.eye(3),
    )


@dataclass
class Start:
    """State that a filter starts with."""

    q_wxyz: Floats
    position: Floats
    velocity: Floats
    gyroscope_bias: Floats = field(default_factory=lambda: np.zeros(3))
    accelerometer_bias: Floats = field(default_factory=lambda: np.zeros(3))
    scale: float = 1.0


def start_of(row: Row, truth: Any, start_cov: Floats, seed: int) -> Start:
    """At the truth, with biases 0 and scale 1; or drawn around the truth from the start's covariance."""
    start = Start(truth.q_world_body_wxyz[0], truth.position[0], truth.velocity[0])
    if row.biases_known:
        start.gyroscope_bias, start.accelerometer_bias = truth.gyroscope_bias[0], truth.accelerometer_bias[0]
    if not row.start_drawn:
        return start
    random = libloc.Random(seed).fork(1)
    error = np.sqrt(np.diag(start_cov)) * np.array([random.normal() for _ in range(len(start_cov))])
    return Start(
        libloc.so3.boxplus(start.q_wxyz, -error[:3]),
        start.position - error[3:6],
        start.velocity - error[6:9],
        truth.gyroscope_bias[0] - error[9:12],
        truth.accelerometer_bias[0] - error[12:15],
        float(truth.odometry_scale[0] - error[15]),
    )


def run_filter(
    row: Row, recording: Any, truth: Any, frame: Any, seed: int
) -> tuple[Any, libloc.ErrorStateFilter]:
    """The run of a row's filter over the recording, and the filter at its end."""
    assert row.preset is not None
    sensors = libloc.FusionPresetSensors(**dict(row.sensors))
    preset = libloc.FusionPreset.by_name(row.preset, sensors)
    options = preset.options
    options.gate = row.gate
    options.scale_random_walk = row.scale_walk
    if dict(row.parameters).get("imu.sampling") == "interval-mean":
        options.sampling = libloc.ImuSampling.INTERVAL_MEAN
    start_cov = preset.start_cov
    if row.scale_sigma is not None:
        start_cov[_SCALE, _SCALE] = row.scale_sigma**2
    imu = recording.imu
    first_ns, step_ns = int(imu.times_ns[0]), int(imu.times_ns[1] - imu.times_ns[0])
    start = start_of(row, truth, start_cov, seed)
    if row.odometry == "key frames":
        options.clones = 1
        # Rows of clones are there, but not used.
        start_cov = np.pad(start_cov, (0, 6))
    estimator = libloc.ErrorStateFilter(options)
    estimator.start(
        # The published order predicts at the first sample too.
        first_ns - step_ns if row.preset == "as_published" else first_ns,
        start_cov,
        q_world_body_wxyz=start.q_wxyz,
        position=start.position,
        velocity=start.velocity,
        gyroscope_bias=start.gyroscope_bias,
        accelerometer_bias=start.accelerometer_bias,
        scale=start.scale,
    )
    streams: dict[str, Any] = {}
    if row.odometry != "none":
        measured = recording.odometry
        odometry = Odometry(
            measured.times_ns,
            measured.position,
            measured.q_wxyz,
            preset.odometry_position_cov,
            preset.odometry_orientation_cov,
        )
        if row.odometry == "key frames":
            odometry = key_frames(measured, round(KEY_FRAME_INTERVAL_S * 1e9), sensors)
            estimator.keep_pose(int(measured.times_ns[0]))
            streams["odometry_start_times_ns"] = odometry.start_times_ns
        streams |= {
            "odometry_times_ns": odometry.times_ns,
            "odometry_position": odometry.position,
            "odometry_position_cov": odometry.position_cov,
            "odometry_wxyz": odometry.wxyz,
            "odometry_orientation_cov": odometry.orientation_cov,
            "odometry_arrivals_ns": odometry.times_ns + round(row.odometry_delay_s * 1e9),
        }
    if row.gps:
        streams |= {
            "gps_times_ns": recording.gps.times_ns,
            "gps_position": frame.to_local(recording.gps.latitude_longitude_altitude),
            "gps_position_cov": recording.gps.position_cov,
            "antenna": GPS_ANTENNA,
        }
    result = estimator.run(
        imu.times_ns,
        imu.angular_velocity,
        imu.specific_force,
        with_covariance=row.table == "consistency",
        **streams,
    )
    return result, estimator


def state_errors(result: Any, truth: Any, rows: NDArray[np.int64]) -> Floats:
    """True less estimated, (T, 19), attitude on the right."""
    return np.hstack(
        [
            libloc.so3.boxminus(truth.q_world_body_wxyz[rows], result.q_world_body_wxyz[rows]),
            truth.position[rows] - result.position[rows],
            truth.velocity[rows] - result.velocity[rows],
            truth.gyroscope_bias[rows] - result.gyroscope_bias[rows],
            truth.accelerometer_bias[rows] - result.accelerometer_bias[rows],
            (truth.odometry_scale[rows] - result.scale[rows])[:, None],
            truth.odometry_drift[rows] - result.drift[rows],
        ]
    )


def _nees(result: Any, truth: Any, rows: NDArray[np.int64]) -> Floats:
    errors, covariance = state_errors(result, truth, rows), result.covariance[rows]
    parts = [slice(0, STATES), *(slice(begin, begin + size) for _, begin, size in BLOCKS)]
    return np.stack([normalised_squares(errors[:, s], covariance[:, s, s]) for s in parts], axis=1)


def _rmse(errors: Floats) -> float:
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))


def _oracle(recording: Any, truth: Any) -> Outcome:
    odometry = recording.odometry
    rows = np.searchsorted(truth.times_ns, odometry.times_ns)
    if not np.array_equal(truth.times_ns[rows], odometry.times_ns):
        raise ValueError("the truth is not known at the times of the odometry")
    errors = odometry.position / truth.odometry_scale[rows, None] - truth.position[rows]
    kept = slice(None, None, EVERY // 4)
    times_s = (odometry.times_ns - truth.times_ns[0]) * 1e-9
    return Outcome(_rmse(errors), float("nan"), {}, times_s[kept], np.linalg.norm(errors, axis=1)[kept])


def run(task: Task) -> dict[str, Outcome]:
    """Outcome of each row by its name."""
    scenario = libloc.Scenario(SCENARIO, duration_s=task.duration_s, parameters=dict(task.rows[0].parameters))
    simulated = libloc.simulate(scenario, task.seed)
    recording, truth = simulated.recording, simulated.truth
    frame = libloc.LocalFrame(*scenario.gps.origin)
    if not np.array_equal(truth.times_ns, recording.imu.times_ns):
        raise ValueError("the truth is not known at the times of the IMU samples")
    out: dict[str, Outcome] = {}
    kept = np.arange(0, len(truth.times_ns), EVERY)
    for row in task.rows:
        if row.preset is None:
            out[row.name] = _oracle(recording, truth)
            continue
        result, estimator = run_filter(row, recording, truth, frame, task.seed)
        errors = truth.position - result.position
        scale_error = float("nan")
        if row.odometry != "none":
            scale_error = abs(float(result.scale[-1] / truth.odometry_scale[-1]) - 1)
        out[row.name] = Outcome(
            _rmse(errors),
            scale_error,
            estimator.counts(),
            (truth.times_ns[kept] - truth.times_ns[0]) * 1e-9,
            np.linalg.norm(errors[kept], axis=1),
        )
        if row.table == "consistency":
            out[row.name].nees = _nees(result, truth, kept)
            out[row.name].nis = result.odometry_nis[np.isfinite(result.odometry_nis)]
    return out
