"""Pictures of loc-slam; drawn without a screen."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

import libloc
from libloc.programs.slam_result import SlamResult, known_rows, sigma_of_points

# Reference in grey behind, estimate in colour on top; colours that colour-blind readers tell apart, too.
_REFERENCE, _ESTIMATE, _MAP, _OTHER = "0.55", "tab:blue", "tab:orange", "tab:green"
_AXES = ("x", "y", "z")
# Of a point's deviation to its distance from the cameras: those known worse say nothing in a picture.
_SHOWN_BELOW = 0.3
# Of their distance to the usual one.
_SHOWN_WITHIN = 4
_GAP = 5  # a step of time so many times the usual one is a hole in a line


def figure_of(width: float = 11, height: float = 5) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def legend_above(axes: Axes, columns: int = 5) -> None:
    """Above the axes, where it hides nothing."""
    axes.legend(
        loc="lower right", bbox_to_anchor=(1, 1), ncols=columns, fontsize=9, frameon=False, borderaxespad=0.2
    )


class _Scene:
    """Path, truth and map in the frame in which they are shown."""

    def __init__(self, result: SlamResult) -> None:
        run, truth = result.run, result.truth
        rows = known_rows(run)
        self.unit = result.unit
        # Of what is compared with the truth.
        camera = truth is not None and truth.camera
        self.path = (run.camera_position if camera else run.position)[rows]
        self.reference = None if truth is None else truth.reference
        # Where the camera looks: the third axis of its frame.
        w, x, y, z = run.q_world_camera_wxyz[rows].T
        look = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
        cameras = run.camera_position[rows]
        good = np.isfinite(run.map.position).all(axis=1)
        sigma = sigma_of_points(run.map.position_cov)
        nearest = np.full(len(sigma), np.nan)
        for k in np.flatnonzero(good):
            nearest[k] = np.min(np.linalg.norm(cameras - run.map.position[k], axis=1))
        good &= sigma < _SHOWN_BELOW * nearest
        if good.any():
            # A few points at the horizon must not make everything else small.
            middle = self.path.mean(axis=0)
            away = np.linalg.norm(run.map.position - middle, axis=1)
            size = np.linalg.norm(self.path - middle, axis=1).max()
            good &= away < _SHOWN_WITHIN * max(size, float(np.median(away[good])))
        self.left_out = int(np.sum(~good))
        self.points = run.map.position[good]
        self.point_cov = run.map.position_cov[good]
        self.landmark = run.map.landmark[good]
        if truth is not None:
            self.path = truth.to_reference(self.path)
            self.points = truth.to_reference(self.points) if good.any() else self.points
            self.point_cov = truth.covariance_to_reference(self.point_cov)
            look = look @ truth.absolute.alignment.T_reference_estimate.matrix()[:3, :3].T
        self.look = look
        known = (
            [self.path, self.points] if self.reference is None else [self.path, self.points, self.reference]
        )
        everything = np.concatenate(known)
        self.low, self.high = everything.min(axis=0), everything.max(axis=0)

    @property
    def size(self) -> float:
        return float(max((self.high - self.low).max(), 1e-6))

    def map_label(self) -> str:
        rest = f"; {self.left_out} far or known less well are not shown" if self.left_out else ""
        return f"map at the end, {len(self.points)} points with 1 sigma{rest}"


def _ellipses(axes: Axes, centres: NDArray[np.float64], covariances: NDArray[np.float64]) -> None:
    """1-sigma ellipses of points (N, 2)."""
    values, vectors = np.linalg.eigh(covariances)
    diameter = 2 * np.sqrt(np.maximum(values, 0))
    angle = np.rad2deg(np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]))
    axes.add_collection(
        EllipseCollection(
            diameter[:, 1], diameter[:, 0], angle, units="xy", offsets=centres,
            offset_transform=axes.transData, facecolors="none", edgecolors=_MAP, linewidths=0.6, alpha=0.7,
        )
    )  # fmt: skip


def title_of(result: SlamResult) -> str:
    if result.truth is None:
        return f"{result.method}: {len(result.run)} frames"
    error = result.truth.absolute
    scale = f", scale {error.alignment.scale:.4f}" if result.truth.mode == "sim3" else ""
    return (
        f"{result.method}: {error.translation.rmse:.4f} m rmse over {result.truth.length_m:.1f} m "
        f"({result.truth.mode}{scale})"
    )


def draw_map_from_above(axes: Axes, result: SlamResult) -> None:
    """Path, truth and map from above."""
    scene = _Scene(result)
    if scene.reference is not None:
        axes.plot(*scene.reference[:, :2].T, color=_REFERENCE, lw=3, label="truth")
    _ellipses(axes, scene.points[:, :2], scene.point_cov[:, :2, :2])
    axes.scatter(*scene.points[:, :2].T, s=5, color=_MAP, lw=0, label=scene.map_label())
    axes.plot(*scene.path[:, :2].T, color=_ESTIMATE, lw=1, label="estimate")
    axes.plot(*scene.path[0, :2], "o", color="k", ms=5, label="start")
    axes.plot(*scene.path[-1, :2], "X", color="k", ms=7, label="end")
    axes.set(xlabel=f"x [{scene.unit}]", ylabel=f"y [{scene.unit}]", title="from above")
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(alpha=0.3)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.09), ncols=2, fontsize=8, frameon=False)


def plot_top(result: SlamResult, path: Path) -> None:
    """Path and map from above, and from the side."""
    scene = _Scene(result)
    spans = 1.1 * np.maximum(scene.high - scene.low, 0.05 * scene.size)
    centre = (scene.low + scene.high) / 2
    # One scale for all axes, by which both panels hold everything and are pleasant to look at.
    width = 9.0
    per_inch = max(spans[0] / width, spans[1] / 8, spans[2] / 6)
    heights = np.maximum(spans[1:] / per_inch, 1.5)
    figure = figure_of(width + 1, float(heights.sum()) + 2)
    panels = figure.subplots(2, 1, sharex=True, height_ratios=heights)
    panels[0].set_xlim(centre[0] - width / 2 * per_inch, centre[0] + width / 2 * per_inch)
    for axes, height, middle in zip(panels, heights, centre[1:], strict=True):
        axes.set_ylim(middle - height / 2 * per_inch, middle + height / 2 * per_inch)
    for axes, (h, v) in zip(panels, ((0, 1), (0, 2)), strict=True):
        if scene.reference is not None:
            axes.plot(scene.reference[:, h], scene.reference[:, v], color=_REFERENCE, lw=3, label="truth")
        _ellipses(axes, scene.points[:, [h, v]], scene.point_cov[:, [[h], [v]], [h, v]])
        axes.scatter(scene.points[:, h], scene.points[:, v], s=5, color=_MAP, lw=0, label=scene.map_label())
        if scene.landmark.any():
            known = scene.points[scene.landmark]
            axes.scatter(known[:, h], known[:, v], s=40, marker="s", facecolors="none", edgecolors="k",
                         label="known beforehand")  # fmt: skip
        axes.plot(scene.path[:, h], scene.path[:, v], color=_ESTIMATE, lw=1, label="estimate")
        some = np.arange(0, len(scene.path), max(1, len(scene.path) // 25))
        ray = 0.04 * scene.size * scene.look[some]
        axes.quiver(scene.path[some, h], scene.path[some, v], ray[:, h], ray[:, v], angles="xy",
                    scale_units="xy", scale=1, width=0.0015, color=_ESTIMATE, alpha=0.7,
                    label="optical axis")  # fmt: skip
        axes.plot(*scene.path[0, [h, v]], "o", color="k", ms=5, label="start")
        axes.plot(*scene.path[-1, [h, v]], "X", color="k", ms=7, label="end")
        axes.set_ylabel(f"{_AXES[v]} [{scene.unit}]")
        axes.set_aspect("equal", adjustable="box")
        axes.grid(alpha=0.3)
    panels[0].set_title("from above", fontsize=10)
    panels[1].set_title("from the side", fontsize=10)
    panels[1].set_xlabel(f"x [{scene.unit}]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=9)
    figure.suptitle(title_of(result))
    figure.savefig(path, dpi=110)


def plot_space(result: SlamResult, path: Path) -> None:
    """Path and map in three dimensions; a point's bar is 1 sigma along its worst direction."""
    scene = _Scene(result)
    figure = figure_of(10, 7)
    axes: Any = figure.add_subplot(projection="3d")
    if scene.reference is not None:
        axes.plot(*scene.reference.T, color=_REFERENCE, lw=3, label="truth")
    if len(scene.points):
        values, vectors = np.linalg.eigh(scene.point_cov)
        bar = np.sqrt(np.maximum(values[:, -1:], 0)) * vectors[:, :, -1]
        ends = np.stack([scene.points - bar, scene.points + bar, np.full_like(bar, np.nan)], axis=1)
        axes.plot(*ends.reshape(-1, 3).T, color=_MAP, lw=0.6, alpha=0.6)
        axes.scatter(*scene.points.T, s=6, color=_MAP, depthshade=False, label=scene.map_label())
    axes.plot(*scene.path.T, color=_ESTIMATE, lw=1.2, label="estimate")
    axes.plot(*scene.path[:1].T, "o", color="k", ms=5, label="start")
    axes.plot(*scene.path[-1:].T, "X", color="k", ms=7, label="end")
    spans = np.maximum(scene.high - scene.low, 0.15 * scene.size)
    centre = (scene.low + scene.high) / 2
    for k, name in enumerate(_AXES):
        getattr(axes, f"set_{name}lim")(centre[k] - 0.5 * spans[k], centre[k] + 0.5 * spans[k])
        getattr(axes, f"set_{name}label")(f"{name} [{scene.unit}]", labelpad=8)
        getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(max(2, round(6 * spans[k] / scene.size))))
    axes.set_box_aspect(spans, zoom=1.15)
    for artist in (*axes.lines, *axes.collections):
        artist.set_clip_on(False)  # the box is turned, and reaches beyond its axes
        artist.set_in_layout(False)
    figure.legend(loc="outside lower center", ncols=3, fontsize=9)
    figure.suptitle(title_of(result))
    figure.savefig(path, dpi=110)


def _seconds(result: SlamResult) -> NDArray[np.float64]:
    return (result.run.time_ns - result.run.time_ns[0]) * 1e-9


def _with_holes(t: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """No line over pauses."""
    out = values.astype(float)
    if len(t) > 2:
        out[1:][np.diff(t) > _GAP * np.median(np.diff(t))] = np.nan
    return out


def _smoothed(values: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Mean of what is finite in a window around each."""
    finite = np.isfinite(values)
    kernel = np.ones(width)
    count = np.convolve(finite, kernel, "same")
    total = np.convolve(np.where(finite, values, 0), kernel, "same")
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def plot_reprojection(result: SlamResult, path: Path) -> None:
    """Errors of what was used, before and after the update, over time."""
    run, t = result.run, _seconds(result)
    figure = figure_of(11, 4.2)
    axes = figure.subplots()
    for name, colour in (("before", _MAP), ("after", _ESTIMATE)):
        values = getattr(run, f"reprojection_{name}_px")
        mean = np.sqrt(np.nanmean(values**2)) if np.isfinite(values).any() else np.nan
        axes.plot(
            t, _with_holes(t, values), color=colour, lw=0.8, label=f"{name} the update, rms {mean:.3f} px"
        )
    shown = run.reprojection_before_px[np.isfinite(run.reprojection_before_px)]
    if len(shown) and shown.max() > 4 * np.percentile(shown, 99):
        axes.set_yscale("log")
    else:
        axes.set_ylim(0, None)
    axes.set(xlabel="time since the first frame [s]", ylabel="rms of |measured - predicted| in a frame [px]")
    legend_above(axes)
    axes.grid(alpha=0.3)
    figure.suptitle("reprojection error")
    figure.savefig(path, dpi=110)


def plot_features(result: SlamResult, path: Path) -> None:
    """Numbers of features, what came and went, and the time that it took."""
    run, t = result.run, _seconds(result)
    figure = figure_of(11, 8)
    upper, middle, lower = figure.subplots(3, 1, sharex=True, height_ratios=(3, 2, 1.5))
    for name, label, colour in (
        ("in_frame", "in the frame", _REFERENCE),
        ("map", "in the map", "k"),
        ("visible", "of the map, expected in view", _OTHER),
        ("measured", "used", _ESTIMATE),
    ):
        upper.plot(t, run.counts[name], color=colour, lw=1, label=label)
    rejected = run.counts["rejected"]
    upper.plot(t, rejected, color="tab:red", lw=0.8, label=f"not believed ({rejected.sum()} in all)")
    upper.set(ylabel="features", ylim=(0, None))
    legend_above(upper)
    for name, label, colour in (
        ("added", "added", _ESTIMATE),
        ("converted", "became XYZ", _OTHER),
        ("deleted", "deleted", _MAP),
    ):
        values = np.cumsum(run.counts[name])
        middle.plot(t, values, color=colour, lw=1, label=f"{label}, {values[-1]}")
    middle.set(ylabel="since the start", ylim=(0, None))
    legend_above(middle)
    ms = 1e3 * run.time_spent_s
    lower.plot(t, ms, color=_ESTIMATE, lw=0.6, label=f"mean {ms.mean():.2f} ms")
    lower.set(
        xlabel="time since the first frame [s]", ylabel="filter [ms]", ylim=(0, 1.3 * np.percentile(ms, 99.5))
    )
    legend_above(lower)
    for axes in (upper, middle, lower):
        axes.grid(alpha=0.3)
    figure.suptitle("features")
    figure.savefig(path, dpi=110)


@cache
def _nis_bounds(dof: int) -> tuple[float, float]:
    bounds = libloc.average_consistency(np.array([float(dof)]), dof)
    return bounds.lower / dof, bounds.upper / dof


def plot_nis(result: SlamResult, path: Path) -> None:
    """NIS of each frame per dimension, with the bounds in which 95 % should lie."""
    run, t = result.run, _seconds(result)
    used = run.nis_dim > 0
    ratio = np.where(used, run.nis / np.maximum(run.nis_dim, 1), np.nan)
    bounds = np.array([_nis_bounds(int(d)) if d > 0 else (np.nan, np.nan) for d in run.nis_dim])
    figure = figure_of(11, 4.2)
    axes = figure.subplots()
    axes.fill_between(
        t, bounds[:, 0], bounds[:, 1], color="0.88", lw=0, label="95 % of a consistent filter's"
    )
    axes.plot(t, _with_holes(t, ratio), color=_ESTIMATE, lw=0.5, alpha=0.7, label="one frame")
    axes.plot(t, _smoothed(ratio, max(1, len(t) // 40)), color="k", lw=1.2, label="smoothed")
    axes.axhline(1, color=_REFERENCE, lw=0.8)
    finite = ratio[np.isfinite(ratio)]
    top = max(2.0, 1.2 * float(np.percentile(finite, 99))) if len(finite) else 2.0
    axes.set(xlabel="time since the first frame [s]", ylabel="NIS per dimension", ylim=(0, top))
    legend_above(axes)
    axes.grid(alpha=0.3)
    inside = np.mean((finite > bounds[used, 0]) & (finite < bounds[used, 1])) if len(finite) else np.nan
    figure.suptitle(
        f"normalised innovations squared of what was used: {100 * inside:.0f} % of frames in the bounds"
    )
    figure.savefig(path, dpi=110)


def plot_error(result: SlamResult, path: Path) -> None:
    """Error of each coordinate over time with the 3 sigma that the filter states, and of the place."""
    truth = result.truth
    assert truth is not None
    t = (truth.times_ns - result.run.time_ns[0]) * 1e-9
    error = truth.estimate - truth.reference
    figure = figure_of(11, 9)
    panels = figure.subplots(4, 1, sharex=True)
    for k, axes in enumerate(panels[:3]):
        band = 3 * truth.sigma[:, k]
        axes.fill_between(t, -band, band, color="0.88", lw=0, label="3 sigma of the filter")
        axes.plot(t, _with_holes(t, error[:, k]), color=_ESTIMATE, lw=0.9, label="error")
        reach = 1.3 * max(float(np.abs(error[:, k]).max()), 1e-6)
        reach = max(reach, min(1.1 * float(band.max()), 4 * reach))  # a wide band must not flatten the error
        axes.set(ylabel=f"{_AXES[k]} [m]", ylim=(-reach, reach))
    legend_above(panels[0])
    distance = truth.absolute.translation_m
    panels[3].plot(t, _with_holes(t, distance), color=_ESTIMATE, lw=0.9, label="distance from the true place")
    running = np.sqrt(np.cumsum(distance**2) / np.arange(1, len(distance) + 1))
    panels[3].plot(t, running, color="k", lw=1.2, label="rms so far")
    panels[3].set(xlabel="time since the first frame [s]", ylabel="error [m]", ylim=(0, None))
    legend_above(panels[3])
    for axes in panels:
        axes.grid(alpha=0.3)
    figure.suptitle("error of the place, " + title_of(result))
    figure.savefig(path, dpi=110)


def plot_inertial(result: SlamResult, path: Path) -> None:
    """Velocity and biases over time with their 3 sigma."""
    run, t = result.run, _seconds(result)
    figure = figure_of(11, 8)
    panels = figure.subplots(3, 1, sharex=True)
    sigma = np.sqrt(np.maximum(np.diagonal(run.covariance, axis1=1, axis2=2), 0))
    for axes, name, first, unit in (
        (panels[0], "velocity", 6, "m/s"),
        (panels[1], "gyroscope_bias", 9, "rad/s"),
        (panels[2], "accelerometer_bias", 12, "m/s$^2$"),
    ):
        values = getattr(run, name)
        for k, colour in enumerate((_ESTIMATE, _MAP, _OTHER)):
            band = 3 * sigma[:, first + k]
            axes.fill_between(t, values[:, k] - band, values[:, k] + band, color=colour, alpha=0.15, lw=0)
            axes.plot(t, _with_holes(t, values[:, k]), color=colour, lw=1, label=_AXES[k])
        # What is wide at the start must not flatten all that follows.
        late = slice(len(t) // 10, None)
        reach = np.nanmax(np.abs(values[late]) + 3 * sigma[late, first : first + 3])
        axes.set(ylabel=f"{name.replace('_', ' ')} [{unit}]", ylim=(-1.1 * reach, 1.1 * reach))
        axes.grid(alpha=0.3)
    legend_above(panels[0])
    panels[2].set_xlabel("time since the first frame [s]")
    figure.suptitle("velocity in world and biases of the IMU, with 3 sigma")
    figure.savefig(path, dpi=110)


def write_pictures(result: SlamResult, folder: Path) -> list[Path]:
    """The paths of what was drawn."""
    pictures = {
        "trajectory.png": plot_top,
        "trajectory_3d.png": plot_space,
        "reprojection.png": plot_reprojection,
        "features.png": plot_features,
        "nis.png": plot_nis,
    }
    if np.isfinite(result.run.gyroscope_bias).any():
        pictures["inertial.png"] = plot_inertial
    if result.truth is not None:
        pictures["error.png"] = plot_error
    if result.front_end is not None:
        from libloc.programs.slam_picture_plots import plot_summary

        pictures["summary.png"] = plot_summary
    for name, draw in pictures.items():
        draw(result, folder / name)
    return [folder / name for name in pictures]
