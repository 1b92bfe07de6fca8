"""A drive in one picture: from above, and errors over time with three deviations; drawn without a screen."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from libloc.driving.run import DrivingRun, Floats

# Colours that colour-blind readers tell apart, too.
_TRUTH, _ODOMETRY, _FUSED = "0.15", "tab:orange", "tab:blue"
_AXES = ("tab:blue", "tab:orange", "tab:green")
_POINTS = 3000  # of a line that are drawn


def _thin(rows: Floats) -> Floats:
    return rows[:: max(1, len(rows) // _POINTS)]


def _draw_above(axes: Axes, run: DrivingRun) -> None:
    odometry = run.odometry_in_metres
    if odometry is not None:
        rmse = "" if run.odometry_rmse is None else f", rmse {run.odometry_rmse:.2f} m"
        axes.plot(
            *_thin(odometry[1][:, :2]).T,
            color=_ODOMETRY,
            lw=0.9,
            label=f"visual odometry ÷ {odometry[2]}{rmse}",
        )
    axes.plot(
        *_thin(run.position[:, :2]).T, color=_FUSED, lw=1.8, label=f"fused, rmse {run.position_rmse:.2f} m"
    )
    axes.plot(*_thin(run.true_position[:, :2]).T, color=_TRUTH, lw=1.1, ls=(0, (5, 3)), label="truth")
    axes.plot(*run.true_position[0, :2], "o", color=_TRUTH, ms=6)
    axes.annotate("start", run.true_position[0, :2], (6, 8), textcoords="offset points")
    axes.set(xlabel="x, east [m]", ylabel="y, north [m]", title="from above")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.07), ncols=3, fontsize=9, columnspacing=1.2)
    axes.grid(alpha=0.3)
    _draw_inset(axes, run)


def _draw_inset(axes: Axes, run: DrivingRun) -> None:
    """The place of the largest error, enlarged, in the corner that the drive leaves free."""
    path = run.true_position[:, :2]
    low, size = path.min(axis=0), np.maximum(np.ptp(path, axis=0), 1e-9)
    at = (path - low) / size
    corners = [(0.0, 0.0), (0.58, 0.0), (0.0, 0.62), (0.58, 0.62)]
    part = np.array([0.42, 0.38])  # of the drive's extent
    taken = [np.sum(np.all((at >= corner) & (at <= corner + part), axis=1)) for corner in np.array(corners)]
    if min(taken):
        return
    corner = corners[int(np.argmin(taken))]
    worst = int(np.argmax(np.linalg.norm(run.position_error[:, :2], axis=1)))
    centre, reach = path[worst], 4 * float(np.linalg.norm(run.position_error[worst, :2]))
    if not 0 < reach < 0.2 * float(size.max()):
        return
    inset = axes.inset_axes((corner[0] + (0.02 if corner[0] else 0.07), corner[1] + 0.05, 0.34, 0.27))
    if run.odometry_in_metres is not None:
        inset.plot(*run.odometry_in_metres[1][:, :2].T, color=_ODOMETRY, lw=0.9)
    inset.plot(*run.position[:, :2].T, color=_FUSED, lw=1.8)
    inset.plot(*path.T, color=_TRUTH, lw=1.1, ls=(0, (5, 3)))
    inset.set(xlim=(centre[0] - reach, centre[0] + reach), ylim=(centre[1] - reach, centre[1] + reach))
    inset.set_aspect("equal")
    inset.set_title(f"largest error, {run.times_s[worst]:.0f} s", fontsize=9)
    inset.tick_params(labelsize=8)
    inset.grid(alpha=0.3)
    axes.indicate_inset_zoom(inset, edgecolor="0.4")


def _draw_errors(
    axes: Axes, t: Floats, values: Floats, sigma: Floats | None, name: str, labels: tuple[str, ...]
) -> None:
    """Lines, and their bands of three deviations; the axis is that of what came after the start."""
    values = values.reshape(len(t), -1)
    sigma = None if sigma is None else sigma.reshape(len(t), -1)
    reach = []
    later = t >= 0.1 * t[-1]
    for i, label in enumerate(labels):
        colour = _AXES[i]
        axes.plot(_thin(t), _thin(values[:, i]), color=colour, lw=0.9, label=label)
        reach.append(np.abs(values[later, i]))
        if sigma is not None:
            for side in (-3, 3):
                axes.plot(_thin(t), _thin(side * sigma[:, i]), color=colour, lw=0.8, ls=":")
            band = _thin(3 * sigma[:, i])
            axes.fill_between(_thin(t), -band, band, color=colour, alpha=0.08, lw=0)
            reach.append(3 * sigma[later, i])
    finite = np.concatenate(reach)
    finite = finite[np.isfinite(finite)]
    if len(finite):
        limit = 1.25 * max(float(finite.max()), 1e-9)
        axes.set_ylim(-limit, limit)
    axes.set_ylabel(name)
    axes.axhline(0, color="0.6", lw=0.6)
    axes.grid(alpha=0.3)
    if len(labels) > 1:
        axes.legend(loc="upper right", ncols=3, fontsize=8, handlelength=1.2, borderpad=0.3)


def plot_summary(run: DrivingRun, title: str = "") -> Figure:
    """Top view of truth, odometry divided by its scale, and fusion; errors of pose, biases and scale.

    Dotted: three deviations as the filter says. Biases and scale whose truth is not known are shown as
    estimated, less their last value. What the estimate does not hold has no row.
    """
    rows: list[tuple[Floats, Floats | None, str, tuple[str, ...]]] = [
        (run.position_error, run.estimated("position_sigma"), "position [m]", ("x", "y", "z")),
        (
            np.rad2deg(run.attitude_error),
            _degrees(run.estimated("attitude_sigma")),
            "attitude [°]",
            ("x", "y", "z"),
        ),
    ]
    notes = []
    for name, true_name, factor, unit in (
        ("scale", "odometry_scale", 1.0, "[unit/m]"),
        ("gyroscope_bias", "gyroscope_bias", float(np.rad2deg(1)), "[°/s]"),
        ("accelerometer_bias", "accelerometer_bias", 1.0, "[m/s²]"),
    ):
        value = run.estimated(name)
        if value is None or not np.isfinite(value).any():
            continue
        truth = run.true_value(true_name)
        sigma = run.estimated(f"{name}_sigma")
        short = {"scale": "scale", "gyroscope_bias": "gyro bias", "accelerometer_bias": "acc. bias"}[name]
        if truth is None:
            known = np.isfinite(value).reshape(len(value), -1).all(axis=1)
            truth = value[np.flatnonzero(known)[-1]]
            notes.append(short)
        labels = ("scale",) if value.ndim == 1 else ("x", "y", "z")
        rows.append(
            (factor * (value - truth), None if sigma is None else factor * sigma, f"{short}\n{unit}", labels)
        )
    figure = Figure(figsize=(13, 7.6), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(len(rows), 2, width_ratios=(1, 1.05))
    _draw_above(figure.add_subplot(grid[:, 0]), run)
    first: Axes | None = None
    for i, (values, sigma, name, labels) in enumerate(rows):
        axes = figure.add_subplot(grid[i, 1], sharex=first)
        _draw_errors(axes, run.times_s, values, sigma, name, labels)
        if i == 0:
            axes.set_title("errors over time, dotted: ±3σ of the filter")
        if i < len(rows) - 1:
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("time [s]")
        first = first or axes
    figure.align_ylabels()
    parts = [title] if title else []
    parts.append(f"fused {run.position_rmse:.2f} m, {np.rad2deg(run.attitude_rmse):.2f}° rmse")
    if run.scale_error is not None:
        parts.append(f"scale error {100 * run.scale_error:+.2f} %")
    if notes:
        parts.append(f"truth of {', '.join(notes)} not known: off the last estimate")
    figure.suptitle(" · ".join(parts), fontsize=13)
    return figure


def _degrees(values: Floats | None) -> Floats | None:
    return None if values is None else np.rad2deg(values)


def save_summary(run: DrivingRun, path: str | os.PathLike[str], title: str = "") -> None:
    """plot_summary() as a picture of 1300 x 760 pixels; the ending says its format: .png, .svg, .pdf."""
    path = Path(path)
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path.parent}: no such folder")
    plot_summary(run, title).savefig(path, dpi=100)
