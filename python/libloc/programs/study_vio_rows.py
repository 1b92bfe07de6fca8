"""Rows of the study of the visual-inertial example: what is simulated, which estimator runs on it.

Each row is a change of the scenario vio-example and a configuration of the error-state filter. Rows of one
seed see the same noise, but for what their scenarios change.
"""

from __future__ import annotations

from dataclasses import dataclass

from libloc.programs.study_runner import StudyError

SCENARIO = "vio-example"
GPS_ANTENNA = (0.5, 0.0, 1.2)  # of that scenario [m], in body
TABLES = ("comparison", "consistency", "extensions")
SCALE_WALK = 0.01  # [1/sqrt(s)] of the rows with a wandering scale: 8 % after a minute
KEY_FRAME_INTERVAL_S = 1.0


@dataclass(frozen=True)
class Elsewhere:
    """What another implementation of the same equations had, 30 runs of 60 s of its own simulator."""

    rmse_m: float
    minimum_m: float | None = None
    maximum_m: float | None = None
    scale_error: float | None = None


@dataclass(frozen=True)
class Row:
    name: str  # for --rows and files
    label: str
    table: str
    parameters: tuple[tuple[str, object], ...] = ()  # of the scenario
    preset: str | None = "19"  # of the filter; None: no filter, odometry divided by its true scale
    odometry: str = "absolute"  # "absolute", "key frames" (relative, with a clone), "none"
    odometry_delay_s: float = 0.0  # of the arrivals, which the filter replays
    gps: bool = False
    gate: bool = True
    sensors: tuple[tuple[str, float], ...] = ()  # told to the filter, FusionPresetSensors
    scale_walk: float = 0.0  # told to the filter
    scale_sigma: float | None = None  # of the start; None: the preset's
    biases_known: bool = False  # the filter starts with the true ones
    start_drawn: bool = False  # from the filter's start covariance; otherwise it starts at the truth
    elsewhere: Elsewhere | None = None


_MEAN = ("imu.sampling", "interval-mean")
# Consistency needs truth that is drawn from the filter's own model: what it takes for noise is noise.
_AS_MODELLED = (
    _MEAN,
    ("odometry.sigma_orientation", 0.01),
    ("imu.gyroscope.random_walk", 1e-5),
    ("imu.accelerometer.random_walk", 1e-4),
)


def _gps(rate_hz: float, sigma_m: float) -> tuple[tuple[str, object], ...]:
    return (
        ("streams.gps", True),
        ("gps.rate_hz", rate_hz),
        ("gps.sigma_horizontal", sigma_m),
        ("gps.sigma_vertical", sigma_m),
    )


def _comparison() -> list[Row]:
    return [
        Row(
            "oracle",
            "VO / true scale (oracle)",
            "comparison",
            preset=None,
            elsewhere=Elsewhere(0.94, 0.68, 1.28),
        ),
        Row(
            "imu-unknown",
            "IMU only, bias unknown",
            "comparison",
            odometry="none",
            preset="16",
            elsewhere=Elsewhere(3954),
        ),
        Row(
            "imu-known",
            "IMU only, bias known",
            "comparison",
            odometry="none",
            preset="16",
            biases_known=True,
            elsewhere=Elsewhere(23.6),
        ),
        Row(
            "as_published",
            "as published",
            "comparison",
            preset="as_published",
            gate=False,
            elsewhere=Elsewhere(3.54, 0.96, 9.86, 0.0109),
        ),
        Row(
            "16",
            "16 states, R inflated",
            "comparison",
            preset="16",
            elsewhere=Elsewhere(1.60, 0.83, 3.04, 0.0034),
        ),
        Row(
            "19",
            "19 states (drift)",
            "comparison",
            preset="19",
            elsewhere=Elsewhere(1.54, 0.93, 3.61, 0.0028),
        ),
    ]


def _consistency() -> list[Row]:
    return [
        Row(
            "nees-example",
            "start as in the example: at the truth, biases 0, scale 1",
            "consistency",
            _AS_MODELLED,
            gate=False,
        ),
        Row(
            "nees-drawn",
            "start drawn from the filter's covariance",
            "consistency",
            _AS_MODELLED,
            gate=False,
            start_drawn=True,
        ),
        # The scale is hardly observable in the first 20 s, a straight line at constant speed. There an
        # extended Kalman filter linearises around one estimate after the other, and takes the difference for
        # information.
        Row(
            "nees-scale",
            "start drawn from the filter's covariance, scale known to 0.5 %",
            "consistency",
            _AS_MODELLED,
            gate=False,
            start_drawn=True,
            scale_sigma=0.01,
        ),
    ]


def _extensions(duration_s: float) -> list[Row]:
    rows = [Row("19-mean", "19 states, interval-mean IMU", "extensions", (_MEAN,))]
    outliers = (_MEAN, ("odometry.outlier_fraction", 0.02))
    rows += [
        Row(
            "outliers", "2 % outliers, no gate", "extensions", outliers, gate=False, elsewhere=Elsewhere(1331)
        ),
        Row("outliers-gated", "2 % outliers, gate", "extensions", outliers, elsewhere=Elsewhere(1.49)),
    ]
    for milliseconds, elsewhere in ((50, 1.95), (100, 3.21), (200, 6.65)):
        delay = milliseconds * 1e-3
        rows += [
            # Without the gate: it would refuse so much of what has a wrong time that the filter gets lost.
            Row(
                f"late-{milliseconds}",
                f"VO {milliseconds} ms late, ignored, no gate",
                "extensions",
                (_MEAN, ("odometry.stamp_delay_s", delay)),
                gate=False,
                elsewhere=Elsewhere(elsewhere),
            ),
            Row(
                f"late-{milliseconds}-replayed",
                f"VO {milliseconds} ms late, replayed",
                "extensions",
                (_MEAN, ("odometry.latency_s", delay)),
                odometry_delay_s=delay,
            ),
        ]
    rows += [
        Row("gps", "GPS 1 Hz 2 m", "extensions", (_MEAN, *_gps(1, 2)), gps=True, elsewhere=Elsewhere(1.01)),
        Row(
            "rtk",
            "GPS 1 Hz 2 cm (RTK)",
            "extensions",
            (_MEAN, *_gps(1, 0.02)),
            gps=True,
            elsewhere=Elsewhere(0.05),
        ),
        # Without the gate: 2 deg/s of unknown bias turn the filter so far between the first fixes that its
        # linearisation does not hold, and the gate would then refuse the rest.
        Row(
            "imu-gps",
            "IMU + GPS 1 Hz 2 m, no VO, no gate",
            "extensions",
            (_MEAN, *_gps(1, 2)),
            preset="16",
            odometry="none",
            gps=True,
            gate=False,
            elsewhere=Elsewhere(8.1),
        ),
    ]
    for seconds, elsewhere in ((2, 1.55), (5, 1.58), (10, 1.68)):
        begin = duration_s / 2
        rows.append(
            Row(
                f"outage-{seconds}",
                f"VO outage {seconds} s",
                "extensions",
                (_MEAN, ("odometry.outages", f"{begin!r}:{begin + seconds!r}")),
                elsewhere=Elsewhere(elsewhere),
            )
        )
    # Odometry that chains its frames: the scale that wanders is its drift, there is no other.
    wander = (
        _MEAN,
        ("odometry.scale_walk", SCALE_WALK),
        ("odometry.drift_sigma", 0.0),
        ("odometry.sigma_orientation", 1e-3),
    )
    told = (("odometry_orientation_sigma", 1e-3),)
    rows += [
        Row(
            "wander",
            "scale wanders, absolute VO",
            "extensions",
            wander,
            sensors=told,
            elsewhere=Elsewhere(5.8),
        ),
        Row(
            "wander-cloned",
            "scale wanders, cloned relative VO",
            "extensions",
            wander,
            preset="16",
            odometry="key frames",
            sensors=(*told, ("odometry_drift_sigma", 1e-6)),
            scale_walk=SCALE_WALK,
            elsewhere=Elsewhere(2.0),
        ),
    ]
    return rows


def all_rows(duration_s: float) -> list[Row]:
    """duration_s: outages begin in the middle."""
    return [*_comparison(), *_consistency(), *_extensions(duration_s)]


def selected(names: list[str], duration_s: float) -> list[Row]:
    """Rows by their names or those of their tables, in the order of all_rows; all of them for no name."""
    rows = all_rows(duration_s)
    known = [*TABLES, *(row.name for row in rows)]
    for name in names:
        if name not in known:
            raise StudyError(f"--rows {name}: must be one of {', '.join(known)}")
    return [row for row in rows if not names or row.name in names or row.table in names]
