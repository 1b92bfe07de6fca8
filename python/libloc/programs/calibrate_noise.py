"""loc-calibrate imu-noise: noise densities and random walks from a device that lies still.

The longer it lies, the more can be told: a minute gives the noise densities, an hour and more the random
walks of the biases. What the recording does not show keeps the rig's value, or a bound; the rig file says
which were measured.
"""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np

import libloc
from libloc import DataError
from libloc.programs import calibrate_plausible as plausible
from libloc.programs import calibrate_plots_inertial as inertial_plots
from libloc.programs.calibrate_input import COUNTS, Readings
from libloc.programs.calibrate_report import Outcome, Picture, Table

_TERMS = ("noise_density", "bias_instability", "random_walk")


def _cell(term: libloc.AllanTerm) -> str:
    if term.identified:
        return f"{term.value:.4g} ± {term.sigma:.1g}"
    return "not seen" if np.isnan(term.upper_bound) else f"below {term.upper_bound:.2g}"


def _table(name: str, fits: list[libloc.AllanFit], units: tuple[str, str, str]) -> Table:
    rows = [
        [f"{term.replace('_', ' ')} [{unit}]", *(_cell(getattr(fit, term)) for fit in fits)]
        for term, unit in zip(_TERMS, units, strict=True)
    ]
    return Table(name, ["", "x", "y", "z"], rows)


def calibrate(readings: Readings, options: argparse.Namespace) -> Outcome:
    """Raises DataError when there is no IMU or no time in it, or its unit is not known."""
    there = [name for name in ("gyroscope", "accelerometer") if getattr(readings, name) is not None]
    if not there:
        readings.need("gyroscope")
    raw, times_ns = readings.need_times(there[0])
    for name in there:
        triad, times = readings.need_times(name)
        if triad.unit == COUNTS:
            raise DataError(f"{readings.name}: the {name} is in counts: its noise needs a physical unit")
        if not np.array_equal(times, times_ns):
            raise DataError(
                f"{readings.name}: gyroscope and accelerometer have different times: give one at a time"
            )
    gyroscope = None if readings.gyroscope is None else readings.gyroscope.rows
    accelerometer = None if readings.accelerometer is None else readings.accelerometer.rows
    allan = libloc.analyse_imu_noise(times_ns, gyroscope, accelerometer)
    fallback = libloc.ImuNoise()
    if options.out is not None and options.out.exists():
        imu = libloc.read_rig(options.out).imu
        fallback = fallback if imu is None else imu.noise
    fit = libloc.imu_noise_from(allan, fallback)
    out = Outcome(
        block="imu.noise",
        summary=f"IMU noise: {len(raw)} readings of {readings.name}",
        verdict=libloc.Verdict(max(allan.quality.verdict, fit.quality.verdict)),
        reasons=list(dict.fromkeys([*allan.quality.reasons, *fit.quality.reasons])),
        apply=None,
        facts=[("still part", f"{allan.duration_s:.1f} s, {100 * allan.used_share:.1f} % of the recording")],
        counts=readings.counts,
    )
    measured = fit.measured
    if not measured:
        return out
    density = float("nan")
    if "gyroscope_noise_density" in measured:
        density = fit.noise.gyroscope_noise_density
    doubts = plausible.rest_doubts(readings.accelerometer, density)
    if doubts:
        out.verdict = max(out.verdict, libloc.Verdict.WARN)
        out.reasons = doubts + out.reasons
    if allan.gyroscope:
        out.tables.append(_table("gyroscope", allan.gyroscope, ("rad/s/√Hz", "rad/s", "rad/s²/√Hz")))
    if allan.accelerometer:
        out.tables.append(_table("accelerometer", allan.accelerometer, ("m/s²/√Hz", "m/s²", "m/s³/√Hz")))
    names = (
        "gyroscope_noise_density",
        "gyroscope_random_walk",
        "accelerometer_noise_density",
        "accelerometer_random_walk",
    )
    out.tables.append(
        Table(
            "for the rig",
            ["", "value", "from"],
            [
                [name, f"{getattr(fit.noise, name):.4g}", "measured" if name in measured else "not measured"]
                for name in names
            ],
        )
    )
    out.pictures.append(
        Picture(
            "allan",
            "Allan deviation with one standard deviation; dashed: white noise (falling), bias instability "
            "(level) and "
            "random walk (rising), where they were identified.",
            partial(inertial_plots.plot_allan, allan),
        )
    )

    def apply(rig: libloc.Rig) -> None:
        if rig.imu is None:
            rig.imu = libloc.ImuCalibration()
        rig.imu.noise = fit.noise
        # What an earlier recording showed and this one does not stays measured: its value was kept.
        kept = [
            name
            for name in rig.imu.noise_measured
            if name not in measured and getattr(fit.noise, name) == getattr(fallback, name)
        ]
        rig.imu.noise_measured = [*kept, *measured]
        rate = _rate_hz(allan)
        if rig.imu.rate_hz == 0 and np.isfinite(rate):
            rig.imu.rate_hz = round(rate, 3)

    out.apply = apply
    return out


def _rate_hz(allan: libloc.ImuAllan) -> float:
    fits = allan.gyroscope or allan.accelerometer
    return float(fits[0].rate_hz)
