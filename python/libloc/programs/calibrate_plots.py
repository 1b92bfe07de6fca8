"""Pictures of loc-calibrate magnetometer; drawn without a screen."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

# Colours that colour-blind readers tell apart, too.
RAW, CORRECTED, SURFACE = "tab:orange", "tab:blue", "0.6"
_SHOWN = 4000  # points of a cloud that are drawn


def new_figure(width: float = 11, height: float = 5) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _thinned(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    finite = rows[np.isfinite(rows).all(axis=1)]
    return finite[:: max(1, len(finite) // _SHOWN)]


def _sphere() -> NDArray[np.float64]:
    """(n, m, 3): points of the unit sphere as a grid."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 37), np.linspace(0, np.pi, 19))
    return np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1)


def _cloud(
    axes: Any, rows: NDArray[np.float64], surface: NDArray[np.float64], colour: str, title: str, unit: str
) -> None:
    axes.plot_wireframe(*np.moveaxis(surface, -1, 0), color=SURFACE, lw=0.4, rstride=2, cstride=2)
    few = len(rows) < 200
    axes.scatter(*rows.T, s=20 if few else 2, color=colour, alpha=1.0 if few else 0.6, depthshade=False)
    low, high = surface.reshape(-1, 3).min(axis=0), surface.reshape(-1, 3).max(axis=0)
    reach = 0.55 * float((high - low).max())
    for name, centre in zip("xyz", (low + high) / 2, strict=True):
        getattr(axes, f"set_{name}lim")(centre - reach, centre + reach)
        getattr(axes, f"set_{name}label")(f"{name} [{unit}]", labelpad=8)
        getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(5))
    axes.set_box_aspect((1, 1, 1))
    axes.set_title(title)


def plot_spheres(
    raw: NDArray[np.float64],
    corrected: NDArray[np.float64],
    centre: NDArray[np.float64],
    matrix: NDArray[np.float64],
    norm: float,
    raw_unit: tuple[float, str],
    unit: tuple[float, str],
) -> Figure:
    """Readings on the ellipsoid that was fitted, and corrected on the sphere.

    *_unit: (factor, name) for the axes.
    """
    figure = new_figure(12, 6)
    sphere = norm * _sphere()
    ellipsoid = centre + np.linalg.solve(matrix, sphere.reshape(-1, 3).T).T.reshape(sphere.shape)
    for i, (rows, surface, colour, title, (scale, name)) in enumerate(
        (
            (raw, ellipsoid, RAW, "readings, and the ellipsoid through them", raw_unit),
            (corrected, sphere, CORRECTED, "corrected, and the sphere", unit),
        )
    ):
        axes = figure.add_subplot(1, 2, i + 1, projection="3d")
        _cloud(axes, scale * _thinned(rows), scale * surface, colour, title, name)
    return figure


def plot_norms(
    raw: NDArray[np.float64], corrected: NDArray[np.float64], norm: float, x: NDArray[np.float64], x_name: str
) -> Figure:
    """Norms of the readings before and after, relative to their mean and to the reference."""
    figure = new_figure(11, 6)
    grid = figure.add_gridspec(2, 2, width_ratios=(4, 1))
    before = np.linalg.norm(raw, axis=1)
    after = np.linalg.norm(corrected, axis=1)
    before = 100 * (before / np.nanmean(before) - 1)
    after = 100 * (after / norm - 1)
    for row, (values, colour, title) in enumerate(
        (
            (before, RAW, "before: |reading|, off its mean [%]"),
            (after, CORRECTED, "after: |corrected|, off the reference [%]"),
        )
    ):
        left = figure.add_subplot(grid[row, 0])
        left.plot(x, values, ".", ms=1.5, color=colour)
        left.set_ylabel(title)
        left.set_ylim(*_limits(values))
        left.grid(alpha=0.3)
        if row == 1:
            left.set_xlabel(x_name)
        right = figure.add_subplot(grid[row, 1], sharey=left)
        finite = values[np.isfinite(values)]
        right.hist(finite, bins=60, range=_limits(values), orientation="horizontal", color=colour)
        right.tick_params(labelleft=False)
        right.set_title(f"sd {np.std(finite):.2f} %", fontsize=10)
    return figure


def _limits(values: NDArray[np.float64]) -> tuple[float, float]:
    """So that a few outliers do not press the rest flat."""
    low, high = np.nanpercentile(values, [0.5, 99.5])
    margin = 0.3 * max(high - low, 1e-3)
    return float(low - margin), float(high + margin)


def draw_coverage(axes: Axes, hits: NDArray[np.int32]) -> Any:
    """Cells of equal area: azimuth to the right, height upwards. Cells without a reading stay white."""
    counts = np.asarray(hits, dtype=float).reshape(10, 10)
    shown = np.where(counts > 0, np.log10(np.maximum(counts, 1)), np.nan)
    mesh = axes.pcolormesh(
        np.linspace(0, 360, 11),
        np.linspace(-1, 1, 11),
        shown,
        cmap="viridis",
        vmin=0,
        vmax=max(1.0, float(np.nanmax(np.append(shown, 1)))),
    )
    axes.set(
        xlabel="azimuth in the sensor's axes, from x towards y [deg]",
        ylabel="height (z / radius)",
        xlim=(0, 360),
        ylim=(-1, 1),
    )
    axes.set_xticks(range(0, 361, 60))
    for x in range(36, 360, 36):
        axes.axvline(x, color="0.9", lw=0.5)
    for y in np.linspace(-0.8, 0.8, 9):
        axes.axhline(y, color="0.9", lw=0.5)
    return mesh


def plot_coverage(hits: NDArray[np.int32], what: str) -> Figure:
    figure = new_figure(9, 4.5)
    axes = figure.add_subplot()
    mesh = draw_coverage(axes, hits)
    bar = figure.colorbar(mesh, ax=axes, label="readings in the cell")
    ticks = np.arange(0, np.floor(mesh.get_clim()[1]) + 1)
    bar.set_ticks(ticks.tolist(), labels=[f"{10 ** int(t)}" for t in ticks])
    axes.set_title(f"directions of {what}: {int(np.count_nonzero(hits))} of 100 cells of equal area")
    return figure


def plot_progress(kept: NDArray[np.float64], fit: Any, missing: NDArray[np.float64], text: str) -> Figure:
    """While readings are collected: the corrected directions in space and on the map, and what to do next."""
    figure = new_figure(12, 5)
    axes = figure.add_subplot(1, 2, 1, projection="3d")
    rows = (kept - fit.centre) @ fit.matrix.T / fit.reference_norm if fit.is_ellipsoid else kept
    if fit.is_ellipsoid:
        axes.plot_wireframe(*np.moveaxis(_sphere(), -1, 0), color=SURFACE, lw=0.4, rstride=2, cstride=2)
    axes.scatter(*_thinned(rows).T, s=3, color=CORRECTED, depthshade=False)
    axes.set_box_aspect((1, 1, 1))
    axes.set(xlabel="x", ylabel="y", zlabel="z")
    axes.set_title("readings" if not fit.is_ellipsoid else "corrected readings")
    chart = figure.add_subplot(1, 2, 2)
    draw_coverage(chart, fit.coverage)
    if np.isfinite(missing).all():
        azimuth = np.rad2deg(np.arctan2(missing[1], missing[0])) % 360
        chart.plot(
            azimuth,
            missing[2],
            "*",
            color="tab:red",
            ms=18,
            label="point this direction of the sensor along the field",
        )
        chart.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18))
    figure.suptitle(text)
    return figure
