"""Is a result physically possible? What is not is nearly always a wrong unit, which no residual shows.

Readings in counts have no unit that could be wrong: nothing here applies to them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from libloc.programs.calibrate_input import COUNTS, GRAVITY, UNITS, Triad

# No sensor that is sold is off by more; every mistaken unit is.
SCALE_RANGE = (0.7, 1.4)
# The earth's field is 22 to 67 uT; indoors and in vehicles a little beyond.
FIELD_RANGE_UT = (15.0, 100.0)
# At rest, with an offset of up to 0.17 g.
REST_RANGE = (8.0, 11.5)
# [rad/s/sqrt(Hz)], ten times the noisiest MEMS.
NOISIEST_GYROSCOPE = 0.01

_NAMES = {
    "gyroscope": ("rad/s", "deg/s"),
    "accelerometer": ("m/s^2", "g", "mg"),
    "magnetometer": ("T", "mT", "uT", "nT", "gauss", "mgauss"),
}


def _mistakes(sensor: str, low: float, high: float) -> str:
    """Which wrong names of units explain that readings must be multiplied by something in [low, high]."""
    factors = UNITS[sensor]
    said = [
        f"{true} read as {named}"
        for true in _NAMES[sensor]
        for named in _NAMES[sensor]
        if true != named and low <= factors[true] / factors[named] <= high
    ]
    return f" A wrong unit? It looks like {', or '.join(said)}." if said else " Is its unit right?"


def scale_doubts(sensor: str, raw: Triad, matrix: NDArray[np.float64]) -> list[str]:
    """Of an accelerometer or gyroscope that was calibrated against a reference. Empty: none."""
    # The size alone: the axes of two chips may differ.
    scale = float(np.cbrt(abs(np.linalg.det(matrix))))
    if raw.unit == COUNTS or SCALE_RANGE[0] <= scale <= SCALE_RANGE[1]:
        return []
    return [
        f"The scale of the {sensor} is {scale:.3g}, not about 1: no {sensor} is so far off."
        + _mistakes(sensor, scale / SCALE_RANGE[1], scale / SCALE_RANGE[0])
    ]


def field_doubts(raw: Triad, radius: float) -> list[str]:
    """radius: what the magnetometer takes the earth's field for, in its unit. Empty: none."""
    low, high = FIELD_RANGE_UT
    if raw.unit == COUNTS or low <= 1e6 * radius <= high:
        return []
    return [
        f"The field has a strength of {1e6 * radius:.3g} uT; on earth it is between 22 and 67 uT."
        + _mistakes("magnetometer", 1e-6 * low / radius, 1e-6 * high / radius)
    ]


def rest_doubts(accelerometer: Triad | None, gyroscope_density: float) -> list[str]:
    """Of a device at rest. gyroscope_density: [rad/s/sqrt(Hz)], NaN when it is not known. Empty: none."""
    doubts = []
    if accelerometer is not None:
        finite = accelerometer.rows[np.isfinite(accelerometer.rows).all(axis=1)]
        norm = float(np.linalg.norm(np.median(finite, axis=0))) if len(finite) else float("nan")
        if np.isfinite(norm) and not REST_RANGE[0] <= norm <= REST_RANGE[1]:
            text = f"At rest the accelerometer shows {norm:.4g} m/s^2, gravity is {GRAVITY:.2f} m/s^2."
            low, high = (GRAVITY / limit * GRAVITY / norm for limit in reversed(REST_RANGE))
            doubts.append(text + _mistakes("accelerometer", low, high))
    if gyroscope_density > NOISIEST_GYROSCOPE:
        doubts.append(
            f"The gyroscope's noise density is {gyroscope_density:.3g} rad/s/sqrt(Hz), which is more than "
            f"{NOISIEST_GYROSCOPE:g}: no gyroscope is so noisy. A wrong unit? It looks like deg/s read as "
            "rad/s."
        )
    return doubts
