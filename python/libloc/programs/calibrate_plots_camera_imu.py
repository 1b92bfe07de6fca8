"""Pictures of loc-calibrate camera-imu; drawn without a screen."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import libloc
from libloc.programs.calibrate_plots import new_figure
from libloc.programs.calibrate_report import Picture

AXES = ("tab:blue", "tab:orange", "tab:green")
USED, DROPPED = "tab:blue", "tab:red"
_SHOWN = 6000  # points or arrows that are drawn
_LAGS = 40  # of the autocorrelation

Array = NDArray[np.float64]


def pictures(
    fit: libloc.CameraImuFit,
    recordings: Sequence[libloc.CameraRecording] | None = None,
    imu: tuple[NDArray[np.int64], Array, Array] | None = None,
) -> list[Picture]:
    """All pictures of a report. recordings: as calibrated, for the times of the pictures (without them they
    are numbered); imu: times_ns, angular_velocity, specific_force as calibrated, for the spectrum."""
    out = [
        Picture(
            "imu_residuals",
            "Predicted less read of the IMU, over their deviations: over time with 3 sigma, how often, "
            "and how each resembles those before it. The bell is what noise does; a slow fall of the "
            "third says that the knots are too far apart, the rig vibrates, or the IMU filters its "
            "readings.",
            partial(plot_imu_residuals, fit),
        )
    ]
    for i, camera in enumerate(fit.cameras):
        name = camera.camera.name or f"cam{i}"
        out.append(
            Picture(
                f"reprojection_{name}",
                f"{name}: found less projected of every corner that was used. The same way in one part of "
                "the image: the intrinsics are wrong there.",
                partial(plot_reprojection, camera),
            )
        )
        stamps = None  # on the IMU's clock
        if recordings is not None:
            stamps = np.array([view.time_ns for view in recordings[i].views]) + round(
                camera.time_offset_s * 1e9
            )
        out.append(
            Picture(
                f"pictures_{name}",
                f"{name}: pictures that were used, and those that were not with the reason. High values "
                "where the rig moved fast are blur.",
                partial(plot_views, camera, _seconds(fit, stamps)),
            )
        )
    out += [
        Picture(
            "biases",
            "What the sensors read too much; they should wander slowly.",
            partial(plot_biases, fit),
        ),
        Picture(
            "correlation",
            "How well the turn rates of camera and IMU agree at each offset of their clocks. One peak "
            "well above the others: the start cannot be mistaken.",
            partial(plot_correlation, fit),
        ),
        Picture(
            "deviations",
            "What the deviations of the result come from: noise, disagreement of the recording's pieces "
            "(blur, the lens's edge, coloured noise), and what is not known of the intrinsics. The "
            "longest says what to improve.",
            partial(plot_deviations, fit),
        ),
        Picture(
            "motion",
            "Turn rates by the solution. The rig must turn about at least two axes, at best all three.",
            partial(plot_motion, fit),
        ),
    ]
    if imu is not None:
        out.append(
            Picture(
                "spectrum",
                f"Spectrum of the IMU's readings. {fit.knot_reason}",
                partial(plot_spectrum, fit, imu),
            )
        )
    return out


def _seconds(fit: libloc.CameraImuFit, stamps_ns: NDArray[np.int64] | None) -> Array | None:
    """Since the first IMU sample."""
    if stamps_ns is None:
        return None
    return (stamps_ns - (fit.imu_time_ns[0] if len(fit.imu_time_ns) else 0)) * 1e-9


def _thin(n: int) -> slice:
    return slice(None, None, max(1, n // _SHOWN))


def _autocorrelation(x: Array) -> Array:
    """Lags 1 … of what is finite; NaN where there is too little."""
    x = x[np.isfinite(x)]
    x = x - x.mean() if len(x) else x
    power = float(x @ x)
    if len(x) < 2 * _LAGS or power <= 0:
        return np.full(_LAGS, np.nan)
    return np.array([x[k:] @ x[:-k] / power for k in range(1, _LAGS + 1)])


def plot_imu_residuals(fit: libloc.CameraImuFit) -> Figure:
    figure = new_figure(13, 6.5)
    grid = figure.add_gridspec(2, 3, width_ratios=(3, 1, 1))
    seconds = _seconds(fit, fit.imu_time_ns)
    thin = _thin(len(fit.imu_time_ns))
    rows = (("gyroscope", 0, fit.gyroscope_chi), ("accelerometer", 3, fit.accelerometer_chi))
    for row, (name, first, chi) in enumerate(rows):
        residuals = fit.imu_residuals[:, first : first + 3]
        over_time = figure.add_subplot(grid[row, 0])
        often = figure.add_subplot(grid[row, 1])
        lags = figure.add_subplot(grid[row, 2])
        finite = residuals[np.isfinite(residuals)]
        reach = max(5.0, 1.1 * float(np.quantile(np.abs(finite), 0.9995))) if len(finite) else 5.0
        edges = np.linspace(-reach, reach, 60)
        for axis, colour in enumerate(AXES):
            one = residuals[:, axis]
            label = "xyz"[axis]
            over_time.plot(seconds[thin], one[thin], ".", ms=1.5, color=colour, alpha=0.6, label=label)
            inside = one[np.isfinite(one)]
            if len(inside):
                often.hist(inside, edges, density=True, histtype="step", color=colour)
            lags.plot(np.arange(1, _LAGS + 1), _autocorrelation(one), color=colour, lw=1)
        for side in (-3, 3):
            over_time.axhline(side, color="k", lw=0.8, ls="--")
        bell = np.linspace(-reach, reach, 200)
        often.plot(bell, np.exp(-(bell**2) / 2) / np.sqrt(2 * np.pi), "k", lw=0.8)
        over_time.set(
            ylim=(-reach, reach), xlabel="[s]", ylabel="[sigma]", title=f"{name}: rms {chi:.3f} sigma"
        )
        often.set(xlabel="[sigma]", title="how often")
        lags.axhline(0, color="k", lw=0.6)
        lags.set(ylim=(-0.5, 1), xlabel="samples later", title="autocorrelation")
        for axes in (over_time, often, lags):
            axes.grid(alpha=0.3)
    figure.legend(*over_time.get_legend_handles_labels(), loc="outside upper right", ncols=3, markerscale=8)
    return figure


def plot_reprojection(camera: libloc.CameraImuCamera) -> Figure:
    figure = new_figure(15, 5.5)
    grid = figure.add_gridspec(1, 3, width_ratios=(2, 1, 1))
    image, scatter, radial = (figure.add_subplot(cell) for cell in grid)
    width, height = camera.camera.width_px, camera.camera.height_px
    pixels, residuals = camera.corner_pixel_px, camera.corner_residual_px
    sigma = np.array([view.sigma_px for view in camera.views])[camera.corner_view]
    finite = np.isfinite(residuals).all(axis=1) & np.isfinite(sigma) & (sigma > 0)
    pixels, residuals, sigma = pixels[finite], residuals[finite], sigma[finite]
    lengths = np.hypot(*residuals.T)
    usual = float(np.median(lengths)) if len(lengths) else 0.0
    factor = float(f"{width / 40 / max(usual, 1e-9):.1g}")
    _draw_cells(image, pixels, residuals, factor, (width, height))
    image.set(
        xlim=(-0.5, width - 0.5),
        ylim=(height - 0.5, -0.5),
        aspect="equal",
        xlabel="u [px]",
        ylabel="v [px]",
        title=f"medians (red) and some residuals, {factor:g} times enlarged",
    )
    thin = _thin(len(residuals))
    scatter.plot(*(residuals / sigma[:, None])[thin].T, ".", ms=1.5, color=USED, alpha=0.4)
    angle = np.linspace(0, 2 * np.pi, 100)
    scatter.plot(3 * np.cos(angle), 3 * np.sin(angle), "k", lw=0.9)
    beyond = int((lengths > 3 * sigma).sum())
    scatter.set(
        xlim=(-6, 6),
        ylim=(6, -6),
        aspect="equal",
        xlabel="u [sigma]",
        ylabel="v [sigma]",
        title=f"{len(residuals)} corners, {beyond} beyond 3 sigma",
    )
    radius = np.hypot(*(pixels - camera.camera.intrinsics_px[2:]).T)
    edges = np.linspace(0, max(float(radius.max(initial=0)), 1.0), 13)
    ring = np.clip(np.digitize(radius, edges) - 1, 0, 11)
    # Half of the distances are below 1.177 sigma, whatever the few are that are far off.
    sigmas = [np.median(lengths[ring == k]) / 1.177 if (ring == k).sum() >= 10 else np.nan for k in range(12)]
    middles = (edges[:-1] + edges[1:]) / 2
    radial.plot(middles, sigmas, "o-", color=USED)
    top = 4 * float(np.nanmedian(sigmas)) if np.isfinite(sigmas).any() else 1.0
    for middle, value in zip(middles, sigmas, strict=True):
        if value > top:
            radial.annotate(f"{value:.2g}", (middle, top), ha="right", va="top", color=DROPPED)
    radial.set(
        xlabel="from the principal point [px]",
        ylabel="sigma of a coordinate, by the median [px]",
        ylim=(0, min(top, 1.1 * np.nanmax(sigmas)) if np.isfinite(sigmas).any() else None),
    )
    for axes in (scatter, radial):
        axes.grid(alpha=0.3)
    return figure


def _draw_cells(axes: Axes, pixels: Array, residuals: Array, factor: float, size: tuple[int, int]) -> None:
    """Some arrows, and the median of each cell of the image."""
    if len(pixels) == 0:
        return
    style = {"angles": "xy", "scale_units": "xy", "scale": 1}
    few = slice(None, None, max(1, len(pixels) // (_SHOWN // 3)))
    axes.quiver(*pixels[few].T, *(factor * residuals[few]).T, width=0.001, color="0.65", **style)
    cell = (pixels / size * (16, 10)).astype(int).clip(0, (15, 9)) @ (1, 16)
    longest, cut = 1.5 * size[0] / 16, 0  # a few wild corners must not hide the others
    for k in np.unique(cell):
        inside = cell == k
        if inside.sum() < 30:
            continue
        start = pixels[inside].mean(axis=0)
        median = 3 * factor * np.median(residuals[inside], axis=0)
        beyond = np.linalg.norm(median) / longest
        cut += beyond > 1
        axes.quiver(*start, *(median / max(beyond, 1.0)), width=0.003, color=DROPPED, **style)
    text = "medians three times more" + (f", {cut} of them cut" if cut else "")
    axes.text(0.01, 0.01, text, transform=axes.transAxes, fontsize=8, color=DROPPED)


def plot_views(camera: libloc.CameraImuCamera, seconds: Array | None) -> Figure:
    reasons = sorted({view.reason for view in camera.views if not view.used})
    figure = new_figure(12, 4.5 + 0.25 * len(reasons))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(4, 1 + 0.35 * len(reasons)))
    x = np.arange(len(camera.views)) if seconds is None else seconds
    used = np.array([view.used for view in camera.views], dtype=bool)
    rms = np.array([view.rms_px for view in camera.views], dtype=float)
    sigma = np.array([view.sigma_px for view in camera.views], dtype=float)
    upper.plot(x[used], rms[used], ".", ms=3, color=USED, label="rms of the corners' distances")
    upper.plot(x[used], sigma[used], "-", lw=0.8, color="k", label="sigma of a coordinate")
    shown = rms[used & np.isfinite(rms)]
    top = 1.3 * float(np.quantile(shown, 0.995)) if len(shown) else 1.0
    upper.set(ylim=(0, top), ylabel="[px]", title=f"{used.sum()} of {len(used)} pictures used")
    upper.legend(loc="upper right")
    names = ["used", *reasons]
    for level, name in enumerate(names):
        those = used if level == 0 else np.array([not v.used and v.reason == name for v in camera.views])
        lower.plot(x[those], np.full(those.sum(), level), "|", ms=8, color=USED if level == 0 else DROPPED)
        names[level] = f"{name or 'no reason told'} ({those.sum()})"
    lower.set_yticks(range(len(names)), names)
    lower.set(ylim=(len(names) - 0.5, -0.5), xlabel="picture" if seconds is None else "[s]")
    for axes in (upper, lower):
        axes.grid(alpha=0.3)
    return figure


def plot_biases(fit: libloc.CameraImuFit) -> Figure:
    figure = new_figure(11, 6)
    seconds = _seconds(fit, fit.bias_time_ns)
    for row, (name, unit) in enumerate((("gyroscope", "mrad/s"), ("accelerometer", "mm/s$^2$"))):
        axes = figure.add_subplot(2, 1, row + 1)
        for axis, colour in enumerate(AXES):
            axes.plot(seconds, 1e3 * fit.biases[:, 3 * row + axis], color=colour, label="xyz"[axis])
        axes.set(xlabel="[s]", ylabel=f"[{unit}]", title=f"bias of the {name}")
        axes.grid(alpha=0.3)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper right", ncols=3)
    return figure


def plot_correlation(fit: libloc.CameraImuFit) -> Figure:
    figure = new_figure(11, 1 + 3.2 * len(fit.cameras))
    for row, camera in enumerate(fit.cameras):
        start = camera.start
        axes = figure.add_subplot(len(fit.cameras), 1, row + 1)
        axes.plot(start.curve_offset_s, start.curve_correlation, color=USED, lw=0.8)
        axes.axvline(
            camera.time_offset_s, color="k", lw=0.8, ls="--", label=f"result {camera.time_offset_s:.6f} s"
        )
        axes.plot(
            start.time_offset_s,
            start.correlation,
            "o",
            color=DROPPED,
            label=f"chosen: {start.correlation:.3f}",
        )
        axes.axhline(
            start.second_correlation,
            color="0.5",
            lw=0.8,
            ls=":",
            label=f"best elsewhere: {start.second_correlation:.3f}",
        )
        axes.set(xlabel="offset [s]", ylabel="correlation", title=camera.camera.name)
        axes.legend(loc="upper right", fontsize=8)
        axes.grid(alpha=0.3)
    return figure


def plot_deviations(fit: libloc.CameraImuFit) -> Figure:
    figure = new_figure(12, 0.8 + 3.2 * len(fit.cameras))
    all_axes = figure.subplots(len(fit.cameras), 3, squeeze=False)
    groups = (
        ("turn [deg]", slice(0, 3), np.degrees(1)),
        ("translation [mm]", slice(3, 6), 1e3),
        ("offset [us]", slice(6, 7), 1e6),
    )
    parts = (
        ("all", "sigma", "k"),
        ("noise", "sigma_by_noise", AXES[0]),
        ("pieces", "sigma_by_blocks", AXES[1]),
        ("intrinsics", "sigma_by_intrinsics", AXES[2]),
    )
    for row, camera in zip(all_axes, fit.cameras, strict=True):
        for axes, (title, which, unit) in zip(row, groups, strict=True):
            n = which.stop - which.start
            for k, (label, field, colour) in enumerate(parts):
                axes.bar(
                    np.arange(n) + 0.2 * (k - 1.5),
                    unit * getattr(camera, field)[which],
                    0.19,
                    color=colour,
                    label=label,
                )
            axes.set_xticks(range(n), "xyz"[:n] if n > 1 else [""])
            axes.set_title(f"{camera.camera.name}: {title}")
            axes.grid(axis="y", alpha=0.3)
    figure.legend(*all_axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def _turn_rates(fit: libloc.CameraImuFit) -> tuple[Array, Array]:
    """Times [s] and rates in the IMU's axes [rad/s], between neighbouring samples."""
    q = fit.target_imu_q_wxyz
    seconds = (fit.imu_time_ns - fit.imu_time_ns[:1]) * 1e-9
    w0, v0, w1, v1 = q[:-1, :1], q[:-1, 1:], q[1:, :1], q[1:, 1:]
    w = w0 * w1 + np.sum(v0 * v1, axis=1, keepdims=True)
    v = (w0 * v1 - w1 * v0 - np.cross(v0, v1)) * np.where(w < 0, -1, 1)
    # Between two samples the turn is small: 2 v is its angle to the third order.
    return (seconds[:-1] + seconds[1:]) / 2, 2 * v / np.diff(seconds)[:, None]


def plot_motion(fit: libloc.CameraImuFit) -> Figure:
    figure = new_figure(12, 5)
    grid = figure.add_gridspec(1, 2, width_ratios=(4, 1))
    axes, bars = (figure.add_subplot(cell) for cell in grid)
    seconds, rates = _turn_rates(fit)
    thin = _thin(len(seconds))
    for axis, colour in enumerate(AXES):
        axes.plot(seconds[thin], np.degrees(rates[thin, axis]), lw=0.7, color=colour, label="xyz"[axis])
    axes.set(xlabel="[s]", ylabel="[deg/s]", title="turn rate of the IMU")
    axes.legend(loc="upper right", ncols=3)
    deviation = np.degrees(fit.cameras[0].start.excitation)
    bars.bar(range(3), deviation, color="0.4")
    bars.set_xticks(range(3), ["1", "2", "3"])
    bars.set(xlabel="main axis", ylabel="rms [deg/s]", title="about main axes")
    for one in (axes, bars):
        one.grid(alpha=0.3)
    return figure


def _spectrum(x: Array, rate: float) -> tuple[Array, Array]:
    """Power density of columns: mean over half-overlapping pieces under Hann's window (Welch)."""
    n = min(1024, len(x))
    window = np.hanning(n)
    begins = range(0, len(x) - n + 1, max(1, n // 2))
    pieces = np.stack([x[b : b + n] - x[b : b + n].mean(axis=0) for b in begins]) * window[:, None]
    power = 2 * np.mean(np.abs(np.fft.rfft(pieces, axis=1)) ** 2, axis=0) / (rate * np.sum(window**2))
    return np.fft.rfftfreq(n, 1 / rate)[1:], power[1:]


def plot_spectrum(fit: libloc.CameraImuFit, imu: tuple[NDArray[np.int64], Array, Array]) -> Figure:
    figure = new_figure(12, 5)
    times, *sensors = imu
    both = zip(
        sensors, ("gyroscope [rad/s/$\\sqrt{Hz}$]", "accelerometer [m/s$^2$/$\\sqrt{Hz}$]"), strict=True
    )
    for column, (readings, name) in enumerate(both):
        axes = figure.add_subplot(1, 2, column + 1)
        finite = np.isfinite(readings).all(axis=1)
        if finite.sum() >= 16:
            frequency, power = _spectrum(readings[finite], 1e9 / float(np.median(np.diff(times))))
            for axis, colour in enumerate(AXES):
                axes.loglog(frequency, np.sqrt(power[:, axis]), color=colour, lw=0.8, label="xyz"[axis])
        if fit.bandwidth_hz > 0:
            axes.axvline(
                fit.bandwidth_hz, color="k", ls="--", lw=1, label=f"motion up to {fit.bandwidth_hz:.3g} Hz"
            )
        if fit.knot_spacing_s > 0:
            knots = 1 / fit.knot_spacing_s
            axes.axvline(knots / 2, color="0.5", ls=":", lw=1.2, label=f"half of {knots:.3g} knots a second")
        axes.set(xlabel="[Hz]", title=name)
        axes.legend(fontsize=8)
        axes.grid(alpha=0.3, which="both")
    return figure
