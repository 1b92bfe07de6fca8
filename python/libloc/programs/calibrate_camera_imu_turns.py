"""About which of its axes a camera has turned, from the corners of a target alone.

No mounting needs to be known.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import libloc

_LEAST_TURNS = 20  # from picture to picture, for an axis to be named
_FARTHEST_S = 0.5  # from one picture to the next
_WILD = 12.0  # [rad/s] no turn by hand, but a wrong pose


def rotation_of(points: NDArray[np.float64], rays: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """(3, 3) target to camera, of corners (N, 3) with z = 0 and their rays (N, 3), from their homography.

    None for fewer than eight, corners on a line, or rays to the side.
    """
    fine = np.isfinite(rays).all(axis=1) & (rays[:, 2] > 0.1)
    if fine.sum() < 8:
        return None
    p, u = points[fine, :2], rays[fine, :2] / rays[fine, 2:]
    p = (p - p.mean(axis=0)) / max(float(np.ptp(p, axis=0).max()), 1e-9)
    one = np.column_stack([p, np.ones(len(p))])
    none = np.zeros_like(one)
    equations = np.vstack([np.hstack([one, none, -u[:, :1] * one]), np.hstack([none, one, -u[:, 1:] * one])])
    _, singular, right = np.linalg.svd(equations, full_matrices=False)
    if len(singular) < 9 or singular[-2] < 1e-4 * singular[0]:
        return None
    H = right[-1].reshape(3, 3)
    H = H * np.sign(H[2, 2])  # the target is in front
    length = np.linalg.norm(H[:, :2], axis=0).mean()
    x, y = H[:, 0] / length, H[:, 1] / length
    U, _, V = np.linalg.svd(np.column_stack([x, y, np.cross(x, y)]))
    R = U @ V
    return R if np.linalg.det(R) > 0 else None


class CameraTurns:
    """Turn rates along the camera's own axes, from picture to picture."""

    def __init__(self, target: libloc.CalibrationTarget, camera: libloc.CameraCalibration) -> None:
        self._points = np.asarray(target.corners())
        self._camera = libloc.Camera(camera)
        self._last: tuple[int, NDArray[np.float64]] | None = None
        self._square = np.zeros((3, 3))
        self.count = 0

    def add(self, view: libloc.TargetView) -> None:
        rotation = None
        if len(view) and view.time_ns is not None:
            rotation = rotation_of(self._points[view.ids], self._camera.unproject(view.pixels_px))
        if rotation is None or view.time_ns is None:
            return
        if self._last is not None and 0 < (view.time_ns - self._last[0]) * 1e-9 < _FARTHEST_S:
            T = np.eye(4)
            T[:3, :3] = rotation @ self._last[1].T
            turn = libloc.so3.log(libloc.Pose3.from_matrix(T).rotation_wxyz)
            rate = np.asarray(turn) / ((view.time_ns - self._last[0]) * 1e-9)
            if np.linalg.norm(rate) < _WILD:
                self._square += np.outer(rate, rate)
                self.count += 1
        self._last = (view.time_ns, rotation)

    def weakest(self) -> int | None:
        """The camera's axis (0, 1, 2) that lies nearest to the one it turns least about."""
        if self.count < _LEAST_TURNS:
            return None
        _, axes = np.linalg.eigh(self._square)
        return int(np.argmax(np.abs(axes[:, 0])))
