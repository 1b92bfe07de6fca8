"""Pictures of loc-calibrate clock; drawn without a screen."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from libloc.programs.calibrate_plots import CORRECTED, RAW, new_figure

_SHOWN = 20_000
_PIECES = 500  # in which the envelope and the skew are shown


def plot_clock(
    device_ns: NDArray[np.int64],
    host_ns: NDArray[np.int64],
    converted_ns: NDArray[np.int64],
    sigma_ns: NDArray[np.float64],
) -> Figure:
    """Lateness of the arrivals above the line as known at the time, and the skew of the line over time."""
    figure = new_figure(11, 8)
    top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=(2, 1.2, 1.2))
    t = (host_ns - host_ns[0]) * 1e-9
    late_us = (host_ns - converted_ns) * 1e-3
    step = max(1, len(t) // _SHOWN)
    top.plot(t[::step], late_us[::step], ".", ms=1.5, color=RAW, label="arrivals")
    top.axhline(0, color=CORRECTED, lw=1, label="line")
    spread = max(float(np.percentile(late_us, 99.5)), 1.0)
    top.set(ylabel="late by [us]", ylim=(-0.08 * spread, 1.15 * spread))
    top.legend(loc="upper right", ncols=2, markerscale=5)

    # Envelope: the least late of each piece, from the same line.
    length_s = max(float(t[-1]) / _PIECES, 1.0)
    # Arrivals may be out of order; a piece must not come twice.
    piece = np.floor(np.maximum.accumulate(t) / length_s).astype(np.int64)
    first = np.flatnonzero(np.diff(piece, prepend=piece[0] - 1))
    lowest = np.minimum.reduceat(late_us, first)
    sigma_us = 1e-3 * sigma_ns[first]
    middle.fill_between(t[first], -sigma_us, sigma_us, color=CORRECTED, alpha=0.3, label="sigma of the line")
    middle.plot(t[first], lowest, ".", ms=3, color=RAW, label=f"least late in {length_s:.3g} s")
    middle.axhline(0, color=CORRECTED, lw=1)
    low, high = np.percentile(lowest, [2, 97])
    margin = 0.5 * max(float(high - low), 0.1)
    middle.set(ylabel="late by [us]", ylim=(low - margin, high + margin))
    middle.legend(loc="upper right", ncols=2)

    span_device = (device_ns[first[1:]] - device_ns[first[:-1]]).astype(float)
    gain = (converted_ns[first[1:]] - converted_ns[first[:-1]]).astype(float) - span_device
    regular = span_device > 0
    if regular.any():
        skew = 1e6 * gain[regular] / span_device[regular]
        bottom.plot(t[first[1:]][regular], skew, lw=0.8, color=CORRECTED)
        low, high = np.percentile(skew, [2, 98])
        margin = 0.3 * max(float(high - low), 0.05)
        bottom.set_ylim(low - margin, high + margin)
    bottom.set(ylabel="skew [ppm]", xlabel="host time [s]")
    for axes in (top, middle, bottom):
        axes.grid(alpha=0.3)
    return figure


def plot_latency(
    times_ns: NDArray[np.int64], before: NDArray[np.float64], after: NDArray[np.float64]
) -> Figure:
    """Horizontal error of each fix over time, and how the errors are distributed."""
    figure = new_figure(11, 4.5)
    grid = figure.add_gridspec(1, 2, width_ratios=(3, 1))
    axes = figure.add_subplot(grid[0, 0])
    t = (times_ns - times_ns[0]) * 1e-9
    reach = 1.1 * float(np.nanpercentile(np.concatenate([before, after]), 99.5))
    axes.plot(t, before, ".", ms=2, color=RAW, label="as stamped")
    axes.plot(t, after, ".", ms=2, color=CORRECTED, label="with the offset")
    axes.set(xlabel="time [s]", ylabel="horizontal error [m]", ylim=(0, reach))
    axes.legend(loc="upper right", markerscale=5)
    axes.grid(alpha=0.3)
    share = figure.add_subplot(grid[0, 1])
    for values, colour in ((before, RAW), (after, CORRECTED)):
        finite = np.sort(values[np.isfinite(values)])
        share.plot(finite, 100 * np.arange(1, len(finite) + 1) / len(finite), color=colour)
    share.set(xlabel="horizontal error [m]", ylabel="fixes with less [%]", xlim=(0, reach), ylim=(0, 100))
    share.grid(alpha=0.3)
    return figure
