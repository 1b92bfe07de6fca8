"""Pictures of loc-study monoslam; drawn without a screen. Fig.: that of Popov (2015), section 5."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from libloc.programs.study_monoslam_cases import CONSISTENCY, SETTLED_S, SPOILT, TABLES
from libloc.programs.study_monoslam_run import BLOCKS, Floats, Outcome
from libloc.programs.study_monoslam_verdicts import NOISE_RATIO
from libloc.programs.study_monoslam_worlds import DARK_S

if TYPE_CHECKING:
    from libloc.programs.study_monoslam import CaseSummary, Study

_RUN, _TRUE, _ESTIMATED, _LIMIT = "0.75", "tab:red", "tab:blue", "tab:orange"
_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red")


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _logarithmic(axes: Axes) -> None:
    """The axis of y, with numbers that can be read where it spans less than a decade."""
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(LogFormatter(minor_thresholds=(1, 0.5)))


def _over_runs(runs: list[Outcome], curve: str) -> tuple[Floats, Floats]:
    """Times and root mean square over the runs, of the times that all of them have."""
    common = min(len(one.times_s) for one in runs)
    values = np.stack([getattr(one, curve)[-common:] for one in runs])
    known = np.isfinite(values)
    count = known.sum(axis=0)
    square = np.where(known, values, 0.0) ** 2
    out = np.full(common, np.nan)
    np.divide(square.sum(axis=0), count, out=out, where=count > 0)
    return runs[0].times_s[-common:], np.sqrt(out)


def _runs(study: Study, name: str) -> list[Outcome]:
    of_case = study.outcomes.get(name, {})
    return [of_case[seed] for seed in sorted(of_case)]


def _curves(axes: Axes, runs: list[Outcome], curve: str) -> tuple[Floats, Floats]:
    """Without the first frame, whose error is zero."""
    for i, one in enumerate(runs):
        label = "runs" if i == 0 else None
        axes.plot(one.times_s[1:], getattr(one, curve)[1:], color=_RUN, lw=0.5, label=label)
    times, values = _over_runs(runs, curve)
    axes.plot(times[1:], values[1:], color=_ESTIMATED, lw=1.5, label=f"RMS of {len(runs)} runs")
    return times, values


def plot_noise_ratio(study: Study, groups: list[str], path: Path) -> None:
    """Fig. 3: position error over time without noise and with 1 px."""
    figure = _figure(11, 2.6 * len(groups) + 0.8)
    panels = figure.subplots(len(groups), 2, sharex=True, sharey="row", squeeze=False)
    for (left, right), group in zip(panels, groups, strict=True):
        without, with_noise = _runs(study, f"{group}-0px"), _runs(study, f"{group}-1px")
        times, values = _curves(left, without, "error_m")
        right.plot(
            times[1:],
            NOISE_RATIO * values[1:],
            color=_LIMIT,
            ls="--",
            label=f"{NOISE_RATIO:g} times that without",
        )
        _curves(right, with_noise, "error_m")
        label = next(one.case.label for one in study.rows if one.case.name == f"{group}-0px")
        label = label.rpartition(";")[0]
        left.set_title(f"{label}: no noise", fontsize=9)
        right.set_title(f"{label}: noise 1 px", fontsize=9)
        left.set_ylabel("position error [m]")
        for axes in (left, right):
            _logarithmic(axes)
            axes.axvline(SETTLED_S, color="0.4", lw=0.8, ls=":")
            axes.grid(alpha=0.3)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    handles, labels = panels[0][1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    figure.suptitle("Look-at path; right of the dotted line the initial peak is over")
    figure.savefig(path, dpi=110)


def plot_reprojection(study: Study, rows: list[CaseSummary], path: Path) -> None:
    """Fig. 6: reprojection error before the update, over time."""
    figure = _figure(11, 6)
    panels = figure.subplots(2, 2, sharex=True).ravel()
    for axes, one in zip(panels, rows, strict=False):
        sigma = one.case.world.sigma_px
        _curves(axes, _runs(study, one.case.name), "reprojection_px")
        axes.axhline(np.sqrt(2) * sigma, color=_LIMIT, ls="--", label="noise alone, sqrt(2) sigma")
        axes.set_title(one.case.label, fontsize=9)
        axes.set_ylim(0, max(0.5, 3.5 * sigma))
        axes.grid(alpha=0.3)
        axes.set_ylabel("reprojection error [px]")
    for axes in panels[2:]:
        axes.set_xlabel("time [s]")
    for axes in panels[len(rows) :]:
        axes.set_visible(False)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    figure.suptitle(
        "Look-at path, known landmarks: measured less predicted, root mean square over the features"
    )
    figure.savefig(path, dpi=110)


def plot_maps(study: Study, names: list[str], path: Path) -> None:
    """Figs. 4 and 5: trajectory and map against the truth, of the first seed, from above and the side."""
    figure = _figure(11, 4.8 * len(names))
    panels = figure.subplots(len(names), 2, squeeze=False)
    for row, name in zip(panels, names, strict=True):
        one = _runs(study, name)[0]
        label = next(of.case.label for of in study.rows if of.case.name == name)
        for axes, (x, y), view in zip(row, ((0, 1), (0, 2)), ("from above", "from the side"), strict=True):
            axes.plot(
                one.true_points[:, x],
                one.true_points[:, y],
                "o",
                mfc="none",
                mec=_TRUE,
                ms=5,
                label="true points",
            )
            axes.plot(
                one.map_points[:, x],
                one.map_points[:, y],
                ".",
                color=_ESTIMATED,
                ms=4,
                label="map, well known",
            )
            axes.plot(
                one.true_trajectory[:, x], one.true_trajectory[:, y], color=_TRUE, lw=2, label="true path"
            )
            axes.plot(
                one.trajectory[:, x], one.trajectory[:, y], color=_ESTIMATED, lw=1, label="estimated path"
            )
            axes.set_aspect("equal", adjustable="datalim")
            axes.set(xlabel="x [m]", ylabel=f"{'xyz'[y]} [m]")
            axes.set_title(f"{label}, {view}", fontsize=9)
            axes.grid(alpha=0.3)
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    figure.savefig(path, dpi=110)


def plot_sweeps(study: Study, rows: list[CaseSummary], path: Path) -> None:
    """Every run a dot, the median a line; one panel a setting."""
    groups = list(dict.fromkeys(one.case.group for one in rows))
    height = -(-len(groups) // 3)
    figure = _figure(12, 2.7 * height + 0.6)
    panels = figure.subplots(height, 3, sharey=True, squeeze=False).ravel()
    for axes, group in zip(panels, groups, strict=False):
        of_group = [one for one in rows if one.case.group == group]
        for x, one in enumerate(of_group):
            values = [outcome.rms_m for outcome in _runs(study, one.case.name)]
            axes.plot(np.full(len(values), x), values, ".", color="0.6", ms=4)
        axes.plot([one.median_m for one in of_group], "D-", color=_ESTIMATED, ms=5)
        axes.set_xticks(range(len(of_group)), [one.case.label for one in of_group])
        axes.set(yscale="log", xlabel=group)
        axes.grid(alpha=0.3)
    for axes in panels[::3]:
        axes.set_ylabel("position RMS [m]")
    for axes in panels[len(groups) :]:
        axes.set_visible(False)
    figure.suptitle(
        "Look-at path, known landmarks, 1 px: one setting at a time; dots are runs, the line their median"
    )
    figure.savefig(path, dpi=110)


def plot_consistency(study: Study, worlds: list[str], path: Path) -> None:
    """NEES of position and orientation over time."""
    figure = _figure(4.2 * len(worlds), 6)
    panels = figure.subplots(2, len(worlds), sharex="col", squeeze=False)
    handles: list[object] = []
    for column, world in enumerate(worlds):
        for row, block in enumerate(("position", "orientation")):
            axes = panels[row][column]
            index = [name for name, _ in BLOCKS].index(block)
            for colour, name in zip(_COLOURS, (*CONSISTENCY, "no-gate"), strict=True):
                runs = _runs(study, f"{world}-{name}")
                if not runs:
                    continue
                common = min(len(one.times_s) for one in runs)
                values = np.stack([one.nees[-common:, index] for one in runs])
                label = "default, no gate" if name == "no-gate" else name
                axes.plot(runs[0].times_s[-common:], values.mean(axis=0), color=colour, lw=1, label=label)
                bounds = study.consistency[f"{world}-{name}"][block].over_time
                axes.axhspan(bounds.lower, bounds.upper, color="0.9", lw=0)
            _logarithmic(axes)
            axes.axhline(3, color="0.4", lw=0.8)
            axes.set_title(f"{world}: NEES {block}", fontsize=9)
            axes.grid(alpha=0.3)
            handles = handles or axes.get_legend_handles_labels()[0]
        panels[1][column].set_xlabel("time [s]")
    figure.legend(handles, [h.get_label() for h in handles], loc="outside lower center", ncols=4)  # type: ignore[attr-defined]
    figure.suptitle("Averages over the runs; 3 is right, grey: 95 % bounds at one time")
    figure.savefig(path, dpi=110)


def plot_robustness(study: Study, worlds: list[str], path: Path) -> None:
    """Root mean square over the runs of the position error."""
    figure = _figure(11, 4.2)
    panels = figure.subplots(1, len(worlds), squeeze=False)[0]
    for axes, world in zip(panels, worlds, strict=True):
        for colour, name in zip(_COLOURS, ("clean", *SPOILT), strict=True):
            runs = _runs(study, f"{world}-{name}")
            if not runs:
                continue
            times, values = _over_runs(runs, "error_m") if name != "dropped" else _of_dropped(runs)
            axes.plot(times[1:], values[1:], color=colour, lw=1, label=SPOILT.get(name, "clean"))
            if name == "dark":
                middle = float(times[-1]) / 2
                axes.axvspan(middle - DARK_S / 2, middle + DARK_S / 2, color="0.9", lw=0)
        _logarithmic(axes)
        axes.set(xlabel="time [s]", ylabel="position error, RMS of the runs [m]", title=world)
        axes.grid(alpha=0.3)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    figure.savefig(path, dpi=110)


def _of_dropped(runs: list[Outcome]) -> tuple[Floats, Floats]:
    """Runs miss different frames: those of each second together."""
    times = np.concatenate([one.times_s for one in runs])
    errors = np.concatenate([one.error_m for one in runs])
    seconds = np.floor(times).astype(int)
    present = np.unique(seconds)
    return present + 0.5, np.array([np.sqrt(np.mean(errors[seconds == s] ** 2)) for s in present])


def draw(study: Study, folder: Path) -> list[Path]:
    """Those whose rows have been computed."""
    files: list[Path] = []
    rows = {table: [one for one in study.rows if one.case.table == table] for table in TABLES}
    names = {one.case.name for one in study.rows}

    def next_file(name: str) -> Path:
        files.append(folder / f"monoslam_{name}.png")
        return files[-1]

    groups = list(dict.fromkeys(one.case.group for one in rows["document"]))
    groups = [group for group in groups if {f"{group}-0px", f"{group}-1px"} <= names]
    if groups:
        plot_noise_ratio(study, groups, next_file("errors"))
    if rows["noise"]:
        plot_reprojection(study, rows["noise"], next_file("reprojection"))
    maps = [name for name in ("metric-1px", "circle-invariant") if name in names]
    if maps:
        plot_maps(study, maps, next_file("maps"))
    if rows["sweep"]:
        plot_sweeps(study, rows["sweep"], next_file("sweeps"))
    for table, plot in (("consistency", plot_consistency), ("robustness", plot_robustness)):
        worlds = list(dict.fromkeys(one.case.group for one in rows[table]))
        if worlds:
            plot(study, worlds, next_file(table))
    return files
