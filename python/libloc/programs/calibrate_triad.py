"""What the sub-commands of loc-calibrate have in common: tables of a triad, deviations of a matrix."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc.programs.calibrate_input import COUNTS, Triad
from libloc.programs.calibrate_report import Table, with_sigma

# Entries of a symmetric matrix in the order of the covariances' last six.
_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
_DISPLAY = {"T": (1e6, "uT"), "rad/s": (180 / math.pi, "deg/s"), "m/s²": (1.0, "m/s²"), COUNTS: (1.0, COUNTS)}


def display_unit(triad: Triad) -> tuple[float, str]:
    """Factor and name for pictures and tables."""
    return _DISPLAY[triad.unit]


def symmetric_sigma(cov: NDArray[np.float64]) -> NDArray[np.float64]:
    """Deviations of the entries of a symmetric matrix, (3, 3). cov: (9, 9), the matrix's are the last six."""
    out = np.zeros((3, 3))
    for k, (i, j) in enumerate(_ENTRIES):
        out[i, j] = out[j, i] = np.sqrt(max(cov[3 + k, 3 + k], 0.0))
    return out


def quality_of(
    quality: libloc.Quality,
    method: str,
    samples: int,
    bias_cov: NDArray[np.float64],
    matrix_sigma: NDArray[np.float64] | None,
    residual_rms: float,
) -> libloc.TriadQuality:
    """What the rig keeps. residual_rms is relative to the field; NaN where there is none."""
    out = libloc.TriadQuality()
    out.verdict, out.reasons = quality.verdict, list(quality.reasons)
    out.method, out.samples, out.residual_rms = method, samples, residual_rms
    if np.isfinite(bias_cov).all():
        out.bias_sigma = np.sqrt(np.maximum(np.diag(bias_cov), 0))
    if matrix_sigma is not None and np.isfinite(matrix_sigma).all():
        out.matrix_sigma = matrix_sigma
    return out


def triad_tables(triad: libloc.TriadCalibration, raw: Triad, bias: str, matrix: str) -> list[Table]:
    """Bias and matrix with their deviations. bias, matrix: what they are, for the titles."""
    scale, unit = display_unit(raw)
    quality = triad.quality
    bias_sigma = np.full(3, np.nan) if quality is None else quality.bias_sigma
    matrix_sigma = np.full((3, 3), np.nan) if quality is None else quality.matrix_sigma
    # Entries have a unit where counts become a physical quantity: shown relative to the mean scale.
    size = 1.0
    if raw.unit == COUNTS:
        size = float(np.cbrt(np.abs(np.linalg.det(triad.matrix))))
    title = f"matrix ({matrix})" if size == 1 else f"matrix ({matrix}), each entry times {size:.6g}"
    axes = ["x", "y", "z"]
    rows = [
        [axes[i], *(with_sigma(triad.matrix[i, j], matrix_sigma[i, j], 1 / size) for j in range(3))]
        for i in range(3)
    ]
    values = [with_sigma(triad.bias[i], bias_sigma[i], scale) for i in range(3)]
    return [
        Table(f"bias ({bias}) [{unit}], ± one standard deviation", ["", *axes], [["bias", *values]]),
        Table(title, ["", *axes], rows),
    ]
