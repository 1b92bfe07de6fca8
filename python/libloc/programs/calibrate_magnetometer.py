"""loc-calibrate magnetometer: hard and soft iron from readings of a device that was turned about."""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import DataError
from libloc.programs import calibrate_plots as plots
from libloc.programs.calibrate_input import COUNTS, Readings, Triad
from libloc.programs.calibrate_report import Outcome, Picture, Table, with_sigma

# Entries of W in the order of the covariance's last six.
_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--method",
        choices=("robust", "als", "lsq", "sphere"),
        default="robust",
        help="robust: for real data; als: clean data over a part of the sphere; lsq: the plain nine-parameter fit; "
        "sphere: bias only (%(default)s)",
    )
    parser.add_argument(
        "--field-ut",
        type=float,
        metavar="UT",
        help="strength of the earth's field here [uT]: corrected readings get this norm (default: they keep "
        "their own mean)",
    )


def reference_norm(options: argparse.Namespace) -> float:
    """[T]; 0: the readings' own."""
    return 0.0 if options.field_ut is None else options.field_ut * 1e-6


def matrix_sigma(cov: NDArray[np.float64], rotation: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """Deviations of the entries of W, or of rotation @ W: (3, 3)."""
    jacobian = np.zeros((9, 6))
    for k, (i, j) in enumerate(_ENTRIES):
        entry = np.zeros((3, 3))
        entry[i, j] = entry[j, i] = 1
        jacobian[:, k] = (entry if rotation is None else rotation @ entry).ravel()
    variance = np.einsum("ij,jk,ik->i", jacobian, cov[3:, 3:], jacobian)
    return np.sqrt(np.maximum(variance, 0)).reshape(3, 3)


def display_unit(triad: Triad) -> tuple[float, str]:
    """Factor and name for pictures and tables."""
    return (1.0, COUNTS) if triad.unit == COUNTS else (1e6, "uT")


def _tables(
    fit: libloc.EllipsoidFit, triad: libloc.TriadCalibration, quality: libloc.TriadQuality, unit: tuple[float, str]
) -> list[Table]:
    scale, name = unit
    axes = ["x", "y", "z"]
    bias = [with_sigma(triad.bias[i], quality.bias_sigma[i], scale) for i in range(3)]
    # Entries of the matrix have a unit when counts become tesla: shown relative to the mean scale.
    size = fit.reference_norm / fit.radius
    rows = [
        [axes[i], *(with_sigma(triad.matrix[i, j], quality.matrix_sigma[i, j], 1 / size) for j in range(3))]
        for i in range(3)
    ]
    title = "matrix" if abs(size - 1) < 1e-9 else f"matrix, each entry times {size:.6g}"
    return [
        Table(f"bias (hard iron) [{name}], ± one standard deviation", ["", *axes], [["centre", *bias]]),
        Table(f"{title} (soft iron, scale, cross-axis)", ["", *axes], rows),
    ]


def fit_quality(fit: libloc.EllipsoidFit) -> libloc.TriadQuality:
    """What the rig keeps of a fit."""
    quality = libloc.TriadQuality()
    quality.verdict = fit.quality.verdict
    quality.method = str(fit.method)
    quality.samples = fit.inliers
    sigma = np.sqrt(np.diag(fit.cov))
    if np.isfinite(sigma).all():
        quality.bias_sigma = sigma[:3]
        quality.matrix_sigma = matrix_sigma(fit.cov)
    quality.residual_rms = fit.residual_rms
    quality.reasons = list(fit.quality.reasons)
    return quality
