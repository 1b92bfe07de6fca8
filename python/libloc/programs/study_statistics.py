"""What studies make of many runs: summaries, and whether errors are as large as the covariance says.

NEES and NIS are e^T P^-1 e of the state's error and of an innovation; of a consistent estimator they are
chi-square with as many degrees of freedom as e has. Bounds: libloc.average_consistency.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

import libloc

Floats = NDArray[np.float64]


@dataclass
class Summary:
    """Of one figure over the runs."""

    runs: int
    mean: float
    minimum: float
    maximum: float
    standard_error: float | None  # of the mean; None: of one run

    def as_dict(self) -> dict[str, float | int | None]:
        return asdict(self)


def summarise(values: Floats) -> Summary | None:
    """None when no run has the figure (all are NaN)."""
    known = np.asarray(values, dtype=float)
    known = known[~np.isnan(known)]
    if not len(known):
        return None
    error = float(np.std(known, ddof=1) / np.sqrt(len(known))) if len(known) > 1 else None
    return Summary(len(known), float(np.mean(known)), float(np.min(known)), float(np.max(known)), error)


def normalised_squares(errors: Floats, covariances: Floats) -> Floats:
    """e^T P^-1 e of each row: errors (T, n), covariances (T, n, n). ValueError: not positive definite."""
    try:
        lower = np.linalg.cholesky(covariances)
    except np.linalg.LinAlgError as error:
        raise ValueError("a covariance is not positive definite") from error
    white = np.linalg.solve(lower, errors[..., None])[..., 0]
    return np.sum(white**2, axis=-1)


@dataclass
class ConsistencyOverTime:
    """NEES of many runs at the same times; runs are independent, times of one run are not."""

    dof: int
    runs: int
    average: Floats  # (T,) over the runs
    lower: float  # bounds of an average at one time
    upper: float
    overall: float  # average over runs and times
    share_inside: float  # of the times; about 0.95 of a consistent estimator
    # Of the overall average, from the scatter of the runs' own averages: whatever the correlation in time.
    overall_standard_error: float | None

    @property
    def inside(self) -> bool:
        """The overall average, against the bounds of one time: those of averages over time are narrower."""
        return self.lower <= self.overall <= self.upper


def consistency_over_time(values: Floats, dof: int, probability: float = 0.95) -> ConsistencyOverTime:
    """values: (runs, T). ValueError as libloc.average_consistency."""
    at_times = [
        libloc.average_consistency(np.ascontiguousarray(column), dof, probability) for column in values.T
    ]
    average = np.array([one.average for one in at_times])
    of_runs = summarise(np.mean(values, axis=1))
    assert of_runs is not None
    return ConsistencyOverTime(
        dof=dof,
        runs=len(values),
        average=average,
        lower=at_times[0].lower,
        upper=at_times[0].upper,
        overall=of_runs.mean,
        share_inside=float(np.mean([one.consistent for one in at_times])),
        overall_standard_error=of_runs.standard_error,
    )


def lag_one_correlation(series: list[Floats]) -> tuple[float, float]:
    """Of successive values, over all series, and the bound that 95 % of white ones stay within."""
    mean = np.mean(np.concatenate(series))
    product = sum(float(np.sum((s[1:] - mean) * (s[:-1] - mean))) for s in series)
    square = sum(float(np.sum((s - mean) ** 2)) for s in series)
    count = sum(len(s) - 1 for s in series)
    if count < 1 or square == 0:
        raise ValueError("too few values for a correlation")
    return product / square, 1.96 / np.sqrt(count)
