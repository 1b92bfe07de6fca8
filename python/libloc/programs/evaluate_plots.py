"""Pictures of loc-evaluate; drawn without a screen."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

if TYPE_CHECKING:
    from libloc.programs.evaluate import OrientationResult, PositionResult

# Reference in grey behind, estimate in colour on top; colours that colour-blind readers tell apart, too.
_REFERENCE, _ESTIMATE = "0.55", "tab:blue"
_COLOURS = {"total": "tab:gray", "heading": "tab:orange", "inclination": "tab:blue"}


def _figure(rows: int, width: float = 11, height: float = 2.2) -> Figure:
    figure = Figure(figsize=(width, height * rows + 0.6), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _seconds(times_ns: NDArray[np.int64]) -> NDArray[np.float64]:
    return (times_ns - times_ns[0]) * 1e-9


def _euler_deg(q_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Roll, pitch, yaw (z-y-x order) for the eye; the numbers come from elsewhere."""
    w, x, y, z = q_wxyz.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.rad2deg(np.stack([roll, pitch, yaw], axis=1))


def _broken_at_wraps(angle_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """No vertical line where an angle goes from 180 to -180 degrees."""
    out = angle_deg.copy()
    out[1:][np.abs(np.diff(angle_deg)) > 180] = np.nan
    return out


def _shade_unscored(axes: Axes, t: NDArray[np.float64], scored: NDArray[np.bool]) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[1], scored.astype(np.int8), [1]])))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        axes.axvspan(t[begin], t[min(end, len(t) - 1)], color="0.93", lw=0)


def plot_orientation(result: OrientationResult, path: Path) -> None:
    """Angles over time, estimate on reference, and the errors below; grey where nothing is scored."""
    t = _seconds(result.times_ns)
    figure = _figure(4)
    axes = figure.subplots(4, 1, sharex=True)
    estimate, reference = _euler_deg(result.estimate_wxyz), _euler_deg(result.reference_wxyz)
    for i, name in enumerate(("roll", "pitch", "yaw")):
        axes[i].plot(t, _broken_at_wraps(reference[:, i]), color=_REFERENCE, lw=2, label="reference")
        axes[i].plot(t, _broken_at_wraps(estimate[:, i]), color=_ESTIMATE, lw=0.8, label="estimate")
        axes[i].set_ylabel(f"{name} [deg]")
    axes[0].legend(loc="upper right", ncols=2)
    error = result.error
    for name in ("heading", "inclination"):
        rmse = np.rad2deg(getattr(error, f"{name}_rmse"))
        values = np.rad2deg(getattr(error, name))
        axes[3].plot(t, values, color=_COLOURS[name], lw=0.8, label=f"{name}, rmse {rmse:.2f}")
    shown = np.rad2deg(np.concatenate([error.heading[result.scored], error.inclination[result.scored]]))
    axes[3].set(xlabel="time [s]", ylabel="error [deg]", ylim=(0, 1.15 * max(float(np.max(shown)), 1e-3)))
    axes[3].legend(loc="upper right", ncols=2)
    for one in axes:
        _shade_unscored(one, t, result.scored)
        one.grid(alpha=0.3)
    heading = (
        ""
        if result.heading == "absolute"
        else f", heading offset {np.rad2deg(result.heading_offset):.1f} removed"
    )
    figure.suptitle(f"orientation error {np.rad2deg(error.total_rmse):.2f} deg rmse{heading}")
    figure.savefig(path, dpi=110)


def plot_trajectory(result: PositionResult, path: Path) -> None:
    """From above, and the error over time; the estimate as aligned."""
    alignment = result.absolute.alignment
    estimate = alignment.T_reference_estimate.transform(alignment.scale * result.pairs.estimate.position)
    reference = result.pairs.reference.position
    t = _seconds(result.pairs.estimate.times_ns)
    figure = _figure(2, height=4)
    top, bottom = figure.subplots(2, 1, height_ratios=(3, 1))
    top.plot(reference[:, 0], reference[:, 1], color=_REFERENCE, lw=2, label="reference")
    top.plot(estimate[:, 0], estimate[:, 1], color=_ESTIMATE, lw=0.8, label="estimate")
    top.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="from above")
    top.set_aspect("equal", adjustable="datalim")
    top.legend(loc="upper right")
    bottom.plot(t, result.absolute.translation_m, color=_ESTIMATE, lw=0.8)
    bottom.set(xlabel="time [s]", ylabel="error [m]", ylim=(0, None))
    for one in (top, bottom):
        one.grid(alpha=0.3)
    figure.suptitle(f"absolute error {result.absolute.translation.rmse:.4f} m rmse")
    figure.savefig(path, dpi=110)
