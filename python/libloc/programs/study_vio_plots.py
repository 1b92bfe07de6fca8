"""Pictures of loc-study vio; drawn without a screen."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from libloc.programs.study_vio import ConsistencySummary, RowSummary, Study

_RUN, _MEAN, _ELSEWHERE = "0.6", "tab:blue", "tab:orange"


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def plot_rmse(study: Study, rows: list[RowSummary], title: str, path: Path) -> None:
    """Every run a dot, the mean, and what was measured elsewhere; the axis is logarithmic."""
    figure = _figure(9, 0.34 * len(rows) + 1.5)
    axes = figure.subplots()
    for y, one in enumerate(rows):
        values = [outcome.rmse_m for outcome in study.outcomes[one.row.name].values()]
        axes.plot(values, np.full(len(values), y), ".", color=_RUN, ms=5, label="a run" if y == 0 else None)
        axes.plot(one.rmse.mean, y, "D", color=_MEAN, ms=6, label="mean" if y == 0 else None)
    beside = [(one.row.elsewhere.rmse_m, y) for y, one in enumerate(rows) if one.row.elsewhere]
    if beside:
        axes.plot(*zip(*beside, strict=True), "|", color=_ELSEWHERE, ms=16, mew=2.5, label="mean elsewhere")
    axes.set_yticks(range(len(rows)), [one.row.label for one in rows])
    axes.set(
        xscale="log",
        xlabel="position RMSE [m]",
        title=f"{title}, {study.duration_s:g} s",
        ylim=(len(rows) - 0.5, -0.5),
    )
    axes.grid(alpha=0.3)
    figure.legend(loc="outside lower center", ncols=3)
    figure.savefig(path, dpi=110)


def plot_errors(study: Study, rows: list[RowSummary], path: Path) -> None:
    """Root mean square over the runs of the position error, over time."""
    figure = _figure(9, 4.2)
    axes = figure.subplots()
    for one in rows:
        runs = list(study.outcomes[one.row.name].values())
        error = np.sqrt(np.mean([outcome.error_m**2 for outcome in runs], axis=0))
        known = error > 0  # a filter that starts at the truth; the axis is logarithmic
        axes.plot(runs[0].times_s[known], error[known], lw=1.2, label=one.row.label)
    axes.set(
        yscale="log", ylim=(1e-2, None), xlabel="time [s]", ylabel="position error, RMS over the runs [m]"
    )
    axes.grid(alpha=0.3)
    figure.legend(loc="outside right upper")
    figure.savefig(path, dpi=110)


def plot_consistency(c: ConsistencySummary, label: str, path: Path) -> None:
    """NEES of the whole state and of its blocks, and NIS, averaged over the runs, with their bounds."""
    figure = _figure(11, 11)
    panels = figure.subplots(5, 2, sharex=True).ravel()
    for axes, (name, nees) in zip(panels, c.nees.items(), strict=False):
        axes.axhspan(nees.lower, nees.upper, color="0.88", lw=0)
        axes.axhline(nees.dof, color="0.5", lw=0.8)
        axes.plot(c.times_s, nees.average, color=_MEAN, lw=0.8)
        axes.set_title(
            f"NEES {name}: {nees.overall:.2f} of {nees.dof}, {100 * nees.share_inside:.0f} % of times inside",
            fontsize=9,
        )
        axes.set_ylim(0, max(2.5 * nees.dof, 1.05 * float(np.max(nees.average))))
    axes = panels[len(c.nees)]
    runs = c.nees["state"].runs
    frames = np.linspace(c.times_s[0], c.times_s[-1], len(c.nis_at_frames))
    bounds = c.nis.dof * np.ones(2) + 1.96 * np.sqrt(2 * c.nis.dof / runs) * np.array([-1, 1])
    axes.axhspan(*bounds, color="0.88", lw=0)
    axes.plot(frames, c.nis_at_frames, color=_MEAN, lw=0.4)
    axes.axhline(c.nis.dof, color="0.5", lw=0.8)
    axes.set_title(
        f"NIS: {c.nis.average:.3f} of {c.nis.dof}, bounds {c.nis.lower:.3f} to {c.nis.upper:.3f}", fontsize=9
    )
    panels[len(c.nees) + 1].set_visible(False)
    for axes in panels:
        axes.grid(alpha=0.3)
        axes.tick_params(labelbottom=True)
    for axes in panels[-4:]:
        axes.set_xlabel("time [s]")
    figure.suptitle(f"{label}\n19 states, averages over {runs} runs; grey: 95 % bounds at one time")
    figure.savefig(path, dpi=110)


def draw(study: Study, folder: Path) -> list[Path]:
    files = []
    for table, title in (("comparison", "Configurations"), ("extensions", "Extensions")):
        rows = [one for one in study.rows if one.row.table == table]
        if rows:
            files.append(folder / f"vio_{table}.png")
            plot_rmse(study, rows, title, files[-1])
    rows = [one for one in study.rows if one.row.table == "comparison"]
    if rows:
        files.append(folder / "vio_errors.png")
        plot_errors(study, rows, files[-1])
    labels = {one.row.name: one.row.label for one in study.rows}
    for name, consistency in study.consistency.items():
        files.append(folder / f"vio_{name}.png")
        plot_consistency(consistency, labels[name], files[-1])
    return files
