"""Pictures of loc-calibrate camera; drawn without a screen."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import libloc
from libloc.programs.calibrate_plots import new_figure

USED, DROPPED = "tab:blue", "tab:red"
_ARROWS = 6000  # that are drawn
_NAMED = 40  # pictures whose names are written


def _image_axes(figure: Figure, fit: libloc.CameraFit, title: str) -> Axes:
    axes = figure.add_subplot()
    width, height = fit.camera.width_px, fit.camera.height_px
    axes.set(
        xlim=(-0.5, width - 0.5),
        ylim=(height - 0.5, -0.5),
        xlabel="u [px]",
        ylabel="v [px]",
        title=title,
        aspect="equal",
    )
    return axes


def plot_coverage(fit: libloc.CameraFit) -> Figure:
    figure = new_figure(9, 6)
    axes = _image_axes(
        figure,
        fit,
        f"{fit.corners_used} corners of {fit.views_used} pictures, {100 * fit.covered_share:.0f} % of cells",
    )
    used = fit.corner_used
    axes.plot(*fit.corner_pixel_px[used].T, ".", ms=3, color=USED, alpha=0.6, label="used")
    if not used.all():
        axes.plot(*fit.corner_pixel_px[~used].T, "x", ms=5, color=DROPPED, label="dropped")
    axes.plot(*fit.camera.intrinsics_px[2:], "+", ms=14, mew=2, color="k", label="principal point")
    for i in range(1, 12):
        axes.axvline(i * fit.camera.width_px / 12 - 0.5, color="0.85", lw=0.6, zorder=0)
    for i in range(1, 9):
        axes.axhline(i * fit.camera.height_px / 9 - 0.5, color="0.85", lw=0.6, zorder=0)
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def plot_residuals(fit: libloc.CameraFit) -> Figure:
    figure = new_figure(13, 6)
    grid = figure.add_gridspec(1, 2, width_ratios=(2, 1))
    axes = figure.add_subplot(grid[0])
    width, height = fit.camera.width_px, fit.camera.height_px
    used = np.flatnonzero(fit.corner_used)
    used = used[:: max(1, len(used) // _ARROWS)]
    pixels, residuals = fit.corner_pixel_px[used], fit.corner_residual_px[used]
    # So that a usual residual is a fortieth of the image long.
    factor = width / 40 / max(fit.rms_px, 1e-9)
    factor = float(f"{factor:.1g}")
    axes.quiver(
        *pixels.T,
        *(factor * residuals).T,
        angles="xy",
        scale_units="xy",
        scale=1,
        width=0.0012,
        color=USED,
        alpha=0.7,
    )
    axes.set(
        xlim=(-0.5, width - 0.5),
        ylim=(height - 0.5, -0.5),
        aspect="equal",
        xlabel="u [px]",
        ylabel="v [px]",
        title=f"found less projected, {factor:g} times enlarged",
    )
    right = figure.add_subplot(grid[1])
    right.plot(*fit.corner_residual_px[used].T, ".", ms=2, color=USED, alpha=0.4)
    angle = np.linspace(0, 2 * np.pi, 100)
    for n in (1, 3):
        right.plot(n * fit.noise_px * np.cos(angle), n * fit.noise_px * np.sin(angle), color="k", lw=0.8)
    reach = 5.2 * max(fit.noise_px, 1e-6)
    right.set(
        xlim=(-reach, reach),
        ylim=(reach, -reach),
        aspect="equal",
        xlabel="u [px]",
        ylabel="v [px]",
        title=f"rms {fit.rms_px:.3f} px; circles: 1 and 3 sigma",
    )
    right.grid(alpha=0.3)
    return figure


def plot_views(fit: libloc.CameraFit, names: list[str]) -> Figure:
    shown = [i for i, view in enumerate(fit.views) if np.isfinite(view.rms_px)]
    figure = new_figure(min(16.0, max(7.0, 0.22 * len(shown) + 2)), 5)
    axes = figure.add_subplot()
    rms = np.array([fit.views[i].rms_px for i in shown])
    worst = np.array([fit.views[i].worst_px for i in shown])
    used = np.array([fit.views[i].used for i in shown], dtype=bool)
    x = np.arange(len(shown))
    for mask, colour, label in ((used, USED, "rms"), (~used, DROPPED, "rms, not used")):
        if mask.any():
            axes.bar(x[mask], rms[mask], color=colour, label=label)
    axes.plot(x, worst, "k_", ms=6, label="worst corner")
    axes.axhline(fit.rms_px, color="k", lw=0.8, ls="--", label=f"all: {fit.rms_px:.3f} px")
    # A dropped picture may be off by hundreds of pixels.
    axes.set_ylim(0, min(1.1 * worst.max(), 5 * max(worst[used].max(initial=0), 3 * fit.rms_px)))
    axes.set(xlabel="picture", ylabel="[px]", xlim=(-0.7, len(shown) - 0.3))
    if len(shown) <= _NAMED:
        axes.set_xticks(
            x, [names[i] for i in shown], rotation=70, ha="right", rotation_mode="anchor", fontsize=8
        )
    axes.grid(axis="y", alpha=0.3)
    figure.legend(loc="outside upper center", ncols=4)
    return figure


def plot_uncertainty(fit: libloc.CameraFit) -> Figure:
    figure = new_figure(9, 5.5)
    axes = _image_axes(figure, fit, "deviation of the pixel of a given ray [px]")
    width, height = fit.camera.width_px, fit.camera.height_px
    mesh = axes.pcolormesh(
        np.linspace(-0.5, width - 0.5, 13),
        np.linspace(-0.5, height - 0.5, 10),
        fit.uncertainty_px,
        cmap="viridis",
    )
    for row in range(9):
        for column in range(12):
            value = fit.uncertainty_px[row, column]
            if np.isfinite(value):
                axes.text(
                    (column + 0.5) * width / 12,
                    (row + 0.5) * height / 9,
                    f"{value:.2f}",
                    ha="center",
                    va="center",
                    fontsize=7,
                    color="w" if value < np.nanmax(fit.uncertainty_px) / 2 else "k",
                )
    figure.colorbar(mesh, ax=axes, label="[px]")
    return figure
