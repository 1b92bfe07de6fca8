"""Pictures of loc-calibrate accelerometer, gyroscope and imu-noise; drawn without a screen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import libloc
from libloc.programs.calibrate_plots import CORRECTED, RAW, draw_coverage, new_figure

_AXES = ("tab:red", "tab:green", "tab:blue")
_SHOWN = 20_000


def plot_stillness(
    times_ns: NDArray[np.int64],
    rows: NDArray[np.float64],
    segments: Sequence[libloc.StillSegment],
    unit: tuple[float, str],
) -> Figure:
    """Length of the readings over time; still segments are coloured."""
    figure = new_figure(11, 3.6)
    axes = figure.add_subplot()
    t = (times_ns - times_ns[0]) * 1e-9
    length = unit[0] * np.linalg.norm(rows, axis=1)
    step = max(1, len(t) // _SHOWN)
    axes.plot(t[::step], length[::step], color="0.4", lw=0.6)
    for segment in segments:
        begin, end = ((time - int(times_ns[0])) * 1e-9 for time in (segment.start_ns, segment.end_ns))
        axes.axvspan(begin, end, color="tab:green", alpha=0.3, lw=0)
    axes.set(xlabel="time [s]", ylabel=f"|reading| [{unit[1]}]", xlim=(t[0], t[-1]))
    axes.set_title(f"{len(segments)} still segments")
    axes.grid(alpha=0.3)
    return figure


def plot_pose_residuals(fit: libloc.AccelerometerFit, gravity: float) -> Figure:
    figure = new_figure(11, 4)
    axes = figure.add_subplot()
    milli_g = 1e3 / gravity
    residual, left_out, used = milli_g * fit.residuals, milli_g * fit.left_out, fit.inlier
    number = np.arange(len(used))
    axes.bar(number[used], residual[used], color=CORRECTED, label="fit")
    axes.plot(number[used], left_out[used], "o", color=RAW, ms=4, label="predicted by the others")
    shown = np.concatenate([residual[used], left_out[used]])
    reach = 1.25 * float(np.nanmax(np.abs(shown))) if used.any() else 1.0
    for i in number[~used]:
        # Off the scale on purpose: it would press the others flat.
        value = residual[i] if np.isfinite(residual[i]) else 0.0
        at = float(np.clip(value, -0.9 * reach, 0.9 * reach))
        axes.plot(i, at, "x", color="tab:red")
        axes.annotate(f"left out\n{value:.3g} mg", (i, at), fontsize=8, ha="center", va="bottom")
    axes.axhline(0, color="0.5", lw=0.8)
    axes.set(xlabel="pose", ylabel="|corrected| - gravity [mg]", ylim=(-reach, reach))
    axes.legend(loc="upper right", ncols=2)
    axes.grid(alpha=0.3)
    return figure


def plot_pose_directions(corrected: NDArray[np.float64], used: NDArray[np.bool]) -> Figure:
    figure = new_figure(9, 4.5)
    axes = figure.add_subplot()
    draw_coverage(axes, np.zeros((10, 10), dtype=np.int32))
    unit = corrected / np.linalg.norm(corrected, axis=1, keepdims=True)
    azimuth = np.rad2deg(np.arctan2(unit[:, 1], unit[:, 0])) % 360
    axes.plot(azimuth[used], unit[used, 2], "o", color=CORRECTED, label="used", clip_on=False)
    if not used.all():
        axes.plot(azimuth[~used], unit[~used, 2], "x", color="tab:red", label="left out", clip_on=False)
        axes.legend(loc="upper right")
    axes.set_title(f"direction of gravity in {len(used)} poses, on a map of equal areas")
    return figure


def plot_rest_bias(
    segments: Sequence[libloc.StillSegment], bias: NDArray[np.float64], unit: tuple[float, str]
) -> Figure:
    figure = new_figure(11, 4)
    axes = figure.add_subplot()
    start = segments[0].start_ns
    t = np.array([(segment.start_ns - start) * 1e-9 for segment in segments])
    means = unit[0] * (np.array([segment.gyroscope_mean for segment in segments]) - bias)
    for axis, colour in enumerate(_AXES):
        axes.plot(t, means[:, axis], "o-", ms=3, lw=0.8, color=colour, label="xyz"[axis])
    axes.axhline(0, color="0.5", lw=0.8)
    axes.set(xlabel="time [s]", ylabel=f"mean at rest, less the bias [{unit[1]}]")
    axes.legend(loc="upper right", ncols=3)
    axes.grid(alpha=0.3)
    return figure


def plot_turns(fit: libloc.GyroscopeFit) -> Figure:
    figure = new_figure(11, 4)
    axes = figure.add_subplot()
    residual, angle = np.rad2deg(fit.turn_residuals), np.rad2deg(fit.turn_gravity_angle)
    used = fit.turn_inlier
    axes.plot(angle[used], residual[used], "o", color=CORRECTED, label="used")
    if not used.all():
        axes.plot(angle[~used], residual[~used], "x", color="tab:red", label="left out")
    axes.set(xlabel="angle by which gravity turned [deg]", ylabel="error of the turn [deg]")
    axes.set_yscale("log")
    axes.legend(loc="lower right")
    axes.grid(alpha=0.3)
    return figure


def _draw_term(axes: Any, term: libloc.AllanTerm, kind: str, colour: str, tau: NDArray[np.float64]) -> None:
    if not term.identified:
        return
    curve = {
        "noise": term.value / np.sqrt(tau),
        "bias": np.full_like(tau, term.value * np.sqrt(2 * np.log(2) / np.pi)),
        "walk": term.value * np.sqrt(tau / 3),
    }[kind]
    axes.plot(tau, curve, "--", lw=0.8, color=colour)


def plot_allan(allan: libloc.ImuAllan) -> Figure:
    """Curves of all axes with their deviations; dashed the terms that were identified."""
    panels = [
        (fits, name, unit)
        for fits, name, unit in (
            (allan.gyroscope, "gyroscope", "rad/s"),
            (allan.accelerometer, "accelerometer", "m/s²"),
        )
        if fits
    ]
    figure = new_figure(6.2 * len(panels), 5)
    for i, (fits, name, unit) in enumerate(panels):
        axes = figure.add_subplot(1, len(panels), i + 1)
        lowest, highest = np.inf, 0.0
        for axis, (fit, colour) in enumerate(zip(fits, _AXES, strict=True)):
            tau, deviation = fit.tau_s, fit.deviation
            if not len(tau):
                continue
            sigma = np.minimum(fit.sigma, 0.9 * deviation)
            axes.errorbar(tau, deviation, sigma, color=colour, lw=1, capsize=2, label="xyz"[axis])
            for term, kind in (
                (fit.noise_density, "noise"),
                (fit.bias_instability, "bias"),
                (fit.random_walk, "walk"),
            ):
                _draw_term(axes, term, kind, colour, tau)
            positive = deviation[deviation > 0]
            if len(positive):
                lowest, highest = min(lowest, float(positive.min())), max(highest, float(positive.max()))
        axes.set_xscale("log")
        axes.set_yscale("log")
        if highest > 0:
            axes.set_ylim(0.4 * lowest, 2.5 * highest)
        axes.set(xlabel="averaging time [s]", ylabel=f"Allan deviation [{unit}]", title=name)
        axes.legend(loc="best")
        axes.grid(alpha=0.3, which="both")
    return figure
