"""A drive as arrays: truth, estimate with its deviations, odometry; and the errors between them.

Times are int64 ns on one clock, increasing. Quaternions wxyz, body to world. Errors are estimate minus truth;
those of attitude are rotation vectors in body axes.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from libloc._core import NO_TIME, so3

Floats = NDArray[np.float64]

_LONGEST_GAP_NS = 500_000_000  # between poses of the truth that are interpolated
_COLUMNS = {"q_world_body_wxyz": 4, "scale": 0, "scale_sigma": 0, "odometry_scale": 0}
_NEEDED = ("times_ns", "q_world_body_wxyz", "position")


@dataclass(frozen=True, eq=False, repr=False)
class Truth:
    """N poses of the body. Biases and scale may be None (not known) and NaN at times where they are not."""

    times_ns: NDArray[np.int64]
    q_world_body_wxyz: Floats  #: (N, 4)
    position: Floats  #: (N, 3) [m]
    gyroscope_bias: Floats | None = None  #: (N, 3) [rad/s]
    accelerometer_bias: Floats | None = None  #: (N, 3) [m/s^2]
    odometry_scale: Floats | None = None  #: (N,) odometry's unit per metre

    def __post_init__(self) -> None:
        _check(self, "truth")


@dataclass(frozen=True, eq=False, repr=False)
class Estimate:
    """N poses as estimated. What is not estimated is None; sigmas are deviations of one component."""

    times_ns: NDArray[np.int64]
    q_world_body_wxyz: Floats  #: (N, 4)
    position: Floats  #: (N, 3) [m]
    attitude_sigma: Floats | None = None  #: (N, 3) [rad], body axes
    position_sigma: Floats | None = None  #: (N, 3) [m]
    gyroscope_bias: Floats | None = None  #: (N, 3) [rad/s]
    gyroscope_bias_sigma: Floats | None = None
    accelerometer_bias: Floats | None = None  #: (N, 3) [m/s^2]
    accelerometer_bias_sigma: Floats | None = None
    scale: Floats | None = None  #: (N,) odometry's unit per metre
    scale_sigma: Floats | None = None

    def __post_init__(self) -> None:
        _check(self, "estimate")


@dataclass(frozen=True, eq=False, repr=False)
class Odometry:
    """Absolute odometry: M positions in its own unit."""

    times_ns: NDArray[np.int64]
    position: Floats  #: (M, 3)

    def __post_init__(self) -> None:
        _check(self, "odometry")


def _check(poses: Any, name: str) -> None:
    """Raises ValueError naming array, row and value."""
    for field in fields(poses):
        value = getattr(poses, field.name)
        where = f"{name}.{field.name}"
        if value is None:
            if field.name in _NEEDED:
                raise ValueError(f"{where}: is missing")
            continue
        array = np.asarray(value)
        if field.name == "times_ns":
            if array.ndim != 1 or not np.issubdtype(array.dtype, np.integer):
                raise ValueError(
                    f"{where}: must be integers (N,) [ns], has {array.dtype} and shape {array.shape}"
                )
            if len(array) < 2:
                raise ValueError(f"{where}: {len(array)} times, at least 2 are needed")
            wrong = np.flatnonzero(np.diff(array.astype(np.int64)) <= 0)
            if len(wrong):
                raise ValueError(
                    f"{where}[{wrong[0] + 1}] = {array[wrong[0] + 1]}: times must increase, "
                    f"the one before is {array[wrong[0]]}"
                )
            object.__setattr__(poses, field.name, array.astype(np.int64))
            continue
        columns = _COLUMNS.get(field.name, 3)
        wanted = (len(poses.times_ns), columns) if columns else (len(poses.times_ns),)
        if array.shape != wanted:
            raise ValueError(f"{where}: has shape {array.shape}, must be {wanted} as there are so many times")
        array = array.astype(float)
        bad = np.argwhere(~np.isfinite(array) if field.name in _NEEDED else np.isinf(array))
        if len(bad):
            raise ValueError(f"{where}{bad[0].tolist()} = {array[tuple(bad[0])]}: must be finite")
        if field.name.endswith("_sigma") and np.any(array < 0):
            first = tuple(np.argwhere(array < 0)[0])
            raise ValueError(f"{where}{[int(i) for i in first]} = {array[first]}: must not be negative")
        if field.name == "q_world_body_wxyz":
            norm = np.linalg.norm(array, axis=1)
            far = np.flatnonzero(np.abs(norm - 1) > 1e-3)
            if len(far):
                raise ValueError(f"{where}[{far[0]}]: has norm {norm[far[0]]}, must be a unit quaternion")
            array /= norm[:, None]
        object.__setattr__(poses, field.name, array)


def _interpolated(at_ns: NDArray[np.int64], times_ns: NDArray[np.int64], values: Floats) -> Floats:
    start = int(times_ns[0])
    x, xp = (at_ns - start).astype(float), (times_ns - start).astype(float)
    if values.ndim == 1:
        return np.interp(x, xp, values)
    return np.stack([np.interp(x, xp, column) for column in values.T], axis=1)


def interpolated_rotation(at_ns: NDArray[np.int64], times_ns: NDArray[np.int64], q_wxyz: Floats) -> Floats:
    """(K, 4): along the shortest way between the neighbours; the outermost ones beyond the ends."""
    after = np.clip(np.searchsorted(times_ns, at_ns), 1, len(times_ns) - 1)
    t0, t1 = times_ns[after - 1], times_ns[after]
    part = np.clip((at_ns - t0) / (t1 - t0), 0, 1)[:, None]
    q0 = q_wxyz[after - 1]
    return so3.boxplus(q0, part * so3.boxminus(q_wxyz[after], q0))


@dataclass(frozen=True, eq=False, repr=False)
class DrivingRun:
    """Truth, estimate and odometry of a drive. All below is at the estimate's times that the truth covers."""

    truth: Truth
    estimate: Estimate
    odometry: Odometry | None = None

    def __post_init__(self) -> None:
        if not self.covered.any():
            raise ValueError(
                f"the truth ({self.truth.times_ns[0]} to {self.truth.times_ns[-1]} ns) and the estimate "
                f"({self.estimate.times_ns[0]} to {self.estimate.times_ns[-1]} ns) share no time"
            )

    @cached_property
    def covered(self) -> NDArray[np.bool]:
        """(N,) estimates between two poses of the truth that are at most 0.5 s apart."""
        times, at = self.truth.times_ns, self.estimate.times_ns
        after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
        inside = (at >= times[0]) & (at <= times[-1])
        exact = (at == times[after]) | (at == times[after - 1])
        return inside & (exact | (times[after] - times[after - 1] <= _LONGEST_GAP_NS))

    @property
    def without_truth(self) -> int:
        """Estimates that the truth does not cover: they are not drawn."""
        return int(np.sum(~self.covered))

    @cached_property
    def times_ns(self) -> NDArray[np.int64]:
        return self.estimate.times_ns[self.covered]

    @cached_property
    def times_s(self) -> Floats:
        """Since the first of them."""
        return (self.times_ns - self.times_ns[0]) * 1e-9

    def estimated(self, name: str) -> Floats | None:
        """A column of the estimate, or None."""
        value = getattr(self.estimate, name)
        return None if value is None else value[self.covered]

    @cached_property
    def position(self) -> Floats:
        return self.estimate.position[self.covered]

    @cached_property
    def q_world_body_wxyz(self) -> Floats:
        return self.estimate.q_world_body_wxyz[self.covered]

    @cached_property
    def true_position(self) -> Floats:
        return _interpolated(self.times_ns, self.truth.times_ns, self.truth.position)

    @cached_property
    def true_q_world_body_wxyz(self) -> Floats:
        return interpolated_rotation(self.times_ns, self.truth.times_ns, self.truth.q_world_body_wxyz)

    def true_value(self, name: str) -> Floats | None:
        """gyroscope_bias, accelerometer_bias, odometry_scale of the truth; None when it is nowhere known."""
        value = getattr(self.truth, name)
        if value is None or not np.isfinite(value).any():
            return None
        return _interpolated(self.times_ns, self.truth.times_ns, value)

    @cached_property
    def position_error(self) -> Floats:
        """(N, 3) [m] in world"""
        return self.position - self.true_position

    @cached_property
    def attitude_error(self) -> Floats:
        """(N, 3) [rad] in body axes"""
        return so3.boxminus(self.q_world_body_wxyz, self.true_q_world_body_wxyz)

    @property
    def position_rmse(self) -> float:
        """[m], of all three components together"""
        return _rms_of_norm(self.position_error)

    @property
    def attitude_rmse(self) -> float:
        """[rad]"""
        return _rms_of_norm(self.attitude_error)

    @cached_property
    def scale_error(self) -> float | None:
        """Of the last estimate, relative to the truth; None when one of the two is not known."""
        scale, truth = self.estimated("scale"), self.true_value("odometry_scale")
        if scale is None or truth is None:
            return None
        error = float(scale[-1] / truth[-1] - 1)
        return error if np.isfinite(error) else None

    @cached_property
    def odometry_in_metres(self) -> tuple[NDArray[np.int64], Floats, str] | None:
        """Times, positions divided by the scale, and which scale: the true one, else the last estimate."""
        if self.odometry is None:
            return None
        truth, scale = self.true_value("odometry_scale"), self.estimated("scale")
        if truth is not None:
            keep = np.isfinite(truth)
            s = _interpolated(self.odometry.times_ns, self.times_ns[keep], truth[keep])
            return self.odometry.times_ns, self.odometry.position / s[:, None], "true scale"
        if scale is not None and np.isfinite(scale[-1]):
            return self.odometry.times_ns, self.odometry.position / scale[-1], "estimated scale"
        return self.odometry.times_ns, self.odometry.position, "scale 1"

    @cached_property
    def odometry_rmse(self) -> float | None:
        """[m], of odometry_in_metres where the truth covers it"""
        if self.odometry_in_metres is None:
            return None
        times, position, _ = self.odometry_in_metres
        inside = (times >= self.times_ns[0]) & (times <= self.times_ns[-1])
        if not inside.any():
            return None
        truth = _interpolated(times[inside], self.times_ns, self.true_position)
        return _rms_of_norm(position[inside] - truth)


def _rms_of_norm(rows: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(rows**2, axis=1))))


def run_of_filter(
    times_ns: NDArray[np.int64], result: Any, truth: Any, odometry: Any | None = None
) -> DrivingRun:
    """What libloc.ErrorStateFilter.run gave, together with the truth.

    times_ns: of the IMU samples that the filter was run with. truth: anything with the fields of Truth:
    libloc.simulate(...).truth, or a Recording's reference, which has poses only. odometry: a Recording's, or
    anything else with times_ns and position; absolute.
    Raises ValueError naming array, row and value.
    """
    if result.variances.shape[0] != len(times_ns):
        raise ValueError(f"result: has {result.variances.shape[0]} rows for {len(times_ns)} times_ns")
    if np.any(result.variances < 0):
        row, column = np.argwhere(result.variances < 0)[0]
        raise ValueError(f"result.variances[{row}, {column}]: must not be negative")
    sigma = np.sqrt(result.variances)
    with_scale = sigma.shape[1] > 15
    estimate = Estimate(
        times_ns=times_ns,
        q_world_body_wxyz=result.q_world_body_wxyz,
        position=result.position,
        attitude_sigma=sigma[:, 0:3],
        position_sigma=sigma[:, 3:6],
        gyroscope_bias=result.gyroscope_bias,
        gyroscope_bias_sigma=sigma[:, 9:12],
        accelerometer_bias=result.accelerometer_bias,
        accelerometer_bias_sigma=sigma[:, 12:15],
        scale=result.scale if with_scale else None,
        scale_sigma=sigma[:, 15] if with_scale else None,
    )
    if odometry is not None and not len(odometry.times_ns):
        odometry = None
    starts = getattr(odometry, "start_times_ns", None)
    if starts is not None and np.any(starts != NO_TIME):
        raise ValueError("odometry: is relative, it gives no positions that could be drawn")
    return DrivingRun(
        Truth(**{field.name: getattr(truth, field.name, None) for field in fields(Truth)}),
        estimate,
        None if odometry is None else Odometry(odometry.times_ns, odometry.position),
    )
