"""One picture that tells how SLAM from pictures went: way, map, pictures with features, numbers, times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

from libloc import EstimateStatus, SlamFeatureState, TrackOrigin
from libloc.programs.slam_pictures import Sample, at_frames, whole_s
from libloc.programs.slam_plots import draw_map_from_above, figure_of, legend_above, title_of
from libloc.programs.slam_result import SlamResult

_SEARCH_SIGMAS = 3  # of the ellipses, FeatureTrackerOptions.search_sigmas
# What became of a feature, as the filter says it; colours that colour-blind readers tell apart.
_STATES = {
    SlamFeatureState.MEASURED: ("used", "tab:cyan"),
    SlamFeatureState.RESCUED: ("used after the others", "tab:green"),
    SlamFeatureState.NEW: ("new in the map", "yellow"),
    SlamFeatureState.REJECTED: ("not believed", "red"),
    SlamFeatureState.PREDICTED: ("expected, not used", "tab:orange"),
}
_TRACKED = "tracked"
_SHOWN_STATUS = 8


def draw_sample(axes: Axes, sample: Sample, begin_ns: int) -> None:
    """A picture with its features by state, and the ellipses in which they were expected."""
    height, width = sample.picture.shape[:2]
    picture = sample.picture if sample.picture.ndim == 2 else sample.picture[..., ::-1]
    axes.imshow(picture, cmap="gray", vmin=0, vmax=255, interpolation="nearest")
    frame = sample.frame
    new = sample.origin == TrackOrigin.NEW
    axes.scatter(*sample.pixel_px[~new].T, s=20, marker="+", color="white", lw=0.8, label=_TRACKED)
    axes.scatter(*sample.pixel_px[new].T, s=14, marker="x", color="white", lw=0.8)
    if frame is not None:
        has_ellipse = np.isfinite(frame.innovation_cov).all(axis=(1, 2)) & np.isfinite(
            frame.predicted_px
        ).all(axis=1)
        for state, (label, colour) in _STATES.items():
            rows = frame.state == state
            at = np.where(np.isfinite(frame.pixel_px[rows]), frame.pixel_px[rows], frame.predicted_px[rows])
            marker = "s" if state != SlamFeatureState.PREDICTED else "D"
            axes.scatter(*at.T, s=16, marker=marker, facecolors="none", edgecolors=colour, lw=1, label=label)
            rows &= has_ellipse
            if rows.any():
                values, vectors = np.linalg.eigh(frame.innovation_cov[rows])
                diameter = 2 * _SEARCH_SIGMAS * np.sqrt(np.maximum(values, 0))
                angle = np.rad2deg(np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]))
                axes.add_collection(
                    EllipseCollection(
                        diameter[:, 1], diameter[:, 0], angle, units="xy", offsets=frame.predicted_px[rows],
                        offset_transform=axes.transData, facecolors="none", edgecolors=colour,
                        linewidths=0.7, alpha=0.8,
                    )
                )  # fmt: skip
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xticks=[], yticks=[])
    used = 0 if frame is None else int(np.isin(frame.state, (1, 2)).sum())
    axes.set_title(
        f"{(sample.time_ns - begin_ns) * 1e-9:.2f} s: {len(sample.pixel_px)} tracks, {used} used", fontsize=10
    )


def _draw_counts(axes: Axes, result: SlamResult) -> None:
    run, pictures = result.run, result.front_end
    assert pictures is not None
    t = (run.time_ns - run.time_ns[0]) * 1e-9
    for name, label, colour in (
        ("tracks", "tracks", "0.55"),
        ("searched", "found where expected", "tab:green"),
        ("new", "new", "tab:orange"),
    ):
        axes.plot(t, at_frames(run, pictures, name), color=colour, lw=0.8, label=label)
    axes.plot(t, run.counts["map"], color="k", lw=1, label="in the map")
    axes.plot(t, run.counts["measured"], color="tab:blue", lw=1, label="used")
    axes.plot(t, run.counts["rejected"], color="tab:red", lw=0.8, label="not believed")
    axes.set(ylabel="features", ylim=(0, None))
    legend_above(axes, 6)
    axes.grid(alpha=0.3)


def _draw_times(axes: Axes, result: SlamResult) -> None:
    run, pictures = result.run, result.front_end
    assert pictures is not None
    t = (run.time_ns - run.time_ns[0]) * 1e-9
    parts = (
        ("whole", whole_s(run, pictures), "0.55"),
        ("front end", at_frames(run, pictures, "front_end_s"), "tab:orange"),
        ("filter", run.time_spent_s, "tab:blue"),
    )
    for name, seconds, colour in parts:
        ms = 1e3 * seconds
        label = f"{name}: median {np.nanmedian(ms):.2f}, 99 % {np.nanpercentile(ms, 99):.2f}"
        axes.plot(t, ms, color=colour, lw=0.7, label=label)
    axes.set(ylabel="time [ms]", ylim=(0, 1.3 * np.nanpercentile(1e3 * parts[0][1], 99.5)))
    legend_above(axes, 3)
    axes.grid(alpha=0.3)


def _draw_status(axes: Axes, result: SlamResult) -> None:
    """A row for each flag that any frame has."""
    run = result.run
    t = (run.time_ns - run.time_ns[0]) * 1e-9
    flags = [flag for flag in EstimateStatus if np.any(run.status & flag)][:_SHOWN_STATUS]
    for row, flag in enumerate(flags):
        on = run.status & flag != 0
        axes.plot(t[on], np.full(on.sum(), row), "|", color="tab:red", ms=7)
    axes.set_yticks(range(len(flags)), [flag.name.lower().replace("_", " ") for flag in flags], fontsize=8)
    axes.set(ylim=(-0.8, max(len(flags), 1) - 0.2), xlabel="time since the first frame [s]")
    if not flags:
        axes.text(0.5, 0.5, "no status flag in any frame", transform=axes.transAxes, ha="center", va="center")
    axes.grid(alpha=0.3, axis="x")


def plot_summary(result: SlamResult, path: Path) -> None:
    """Raises nothing for a run without samples: their places stay empty."""
    figure: Figure = figure_of(16, 11)
    upper, lower = figure.subfigures(2, 1, height_ratios=(1, 1.55))
    samples = [] if result.watcher is None else result.watcher.shown()
    panels = upper.subplots(1, 3)
    for axes, sample in zip(panels, samples, strict=False):
        draw_sample(axes, sample, int(result.run.time_ns[0]))
    for axes in panels[len(samples) :]:
        axes.axis("off")
    if samples:
        entries = {}
        for axes in panels[: len(samples)]:
            entries |= dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
        legend = upper.legend(
            entries.values(), [*entries], loc="outside lower center", ncols=6, fontsize=9, facecolor="0.4",
            labelcolor="white",
        )  # fmt: skip
        legend.set_in_layout(True)
        upper.text(
            0.995,
            0.005,
            f"ellipses: expected there, {_SEARCH_SIGMAS} sigma",
            ha="right",
            va="bottom",
            fontsize=8,
        )
    left, right = lower.subfigures(1, 2, width_ratios=(1, 1.15))
    draw_map_from_above(left.subplots(), result)
    counts, times, status = right.subplots(3, 1, sharex=True, height_ratios=(3, 3, 1.2))
    _draw_counts(counts, result)
    _draw_times(times, result)
    _draw_status(status, result)
    figure.suptitle(title_of(result))
    figure.savefig(path, dpi=100)
