"""Ellipses and ellipsoids of covariances, for drawing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_CIRCLE_POINTS = 24


def ellipses(centres: Floats, covariances: Floats, sigmas: float) -> NDArray[np.float32]:
    """(N, M, 2) Closed outlines of N ellipses of so many deviations.

    centres (N, 2), covariances (N, 2, 2), symmetric and finite. A direction of negative variance has no
    extent.
    """
    values, vectors = np.linalg.eigh(covariances)
    axes = vectors * (sigmas * np.sqrt(np.maximum(values, 0)))[:, None, :]
    angle = np.linspace(0, 2 * np.pi, _CIRCLE_POINTS + 1)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    return np.asarray(centres[:, None, :] + np.swapaxes(axes @ circle, 1, 2), dtype=np.float32)


def ellipsoids(covariances: Floats, sigmas: float) -> tuple[Floats, Floats]:
    """Half axes (N, 3), smallest first, and orientations (N, 4) as x y z w of N ellipsoids.

    covariances (N, 3, 3), symmetric and finite. A direction of negative variance has no extent.
    """
    values, vectors = np.linalg.eigh(covariances)
    # Axes have no sign: choose it so that they make a rotation, not a reflection.
    vectors[:, :, 0] *= np.sign(np.linalg.det(vectors))[:, None]
    return sigmas * np.sqrt(np.maximum(values, 0)), quaternions_xyzw(vectors)


def quaternions_xyzw(rotations: Floats) -> Floats:
    """(N, 4) Of rotation matrices (N, 3, 3).

    From the largest of the four components, so that nothing is divided by a small number (Shepperd 1978).
    """
    m = rotations
    trace = np.trace(m, axis1=1, axis2=2)
    # Rows of 4 q q^T, in the order x y z w.
    outer = np.empty((len(m), 4, 4))
    for i in range(3):
        for k in range(3):
            outer[:, i, k] = m[:, i, k] + m[:, k, i]
        outer[:, i, i] = 1 + 2 * m[:, i, i] - trace
        k, j = (i + 1) % 3, (i + 2) % 3
        outer[:, i, 3] = outer[:, 3, i] = m[:, j, k] - m[:, k, j]
    outer[:, 3, 3] = 1 + trace
    largest = np.argmax(np.diagonal(outer, axis1=1, axis2=2), axis=1)
    q = outer[np.arange(len(m)), largest]
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


def rotation_of(q_wxyz: Floats) -> Floats:
    """(3, 3) Of a unit quaternion (4,)."""
    w, x, y, z = q_wxyz
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def is_rotation(q_wxyz: Floats) -> bool:
    """Whether it is finite and of unit length, as a message that tells an orientation has it."""
    return bool(np.isfinite(q_wxyz).all() and abs(np.linalg.norm(q_wxyz) - 1) < 1e-3)
