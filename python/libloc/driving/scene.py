"""What a drive goes through, for pictures: a road along the path, and buildings on both sides of it.

From: the path of the vehicle. The same path and seed give the same scene. Where a building would stand on the
road (bends, crossings) or in another one, there is none. Frame: world, z up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from libloc._core import Random

Floats = NDArray[np.float64]

_STEP_M = 2.0
_SHORTEST_PATH_M, _LONGEST_PATH_M = 5.0, 20_000.0
# Walls: muted, so that vehicles and trails stand out.
_WALLS = (
    (205, 186, 160),
    (190, 170, 150),
    (176, 160, 152),
    (214, 203, 186),
    (186, 178, 172),
    (198, 164, 140),
)


@dataclass(frozen=True)
class SceneOptions:
    road_width_m: float = 8.0
    pavement_m: float = 3.0  #: between road and buildings
    min_width_m: float = 10.0  #: of a building, along the road
    max_width_m: float = 22.0
    min_depth_m: float = 8.0
    max_depth_m: float = 14.0
    min_height_m: float = 5.0
    max_height_m: float = 15.0
    largest_gap_m: float = 5.0  #: between buildings
    extend_m: float = 60.0  #: the road goes on straight so far before and beyond the path

    def check(self) -> None:
        """Raises ValueError naming the field and its value."""
        for name, value in vars(self).items():
            if not np.isfinite(value) or value < 0 or (value == 0 and name.endswith(("width_m", "height_m"))):
                raise ValueError(f"scene.{name} = {value}: must be positive")
        for what in ("width", "depth", "height"):
            low, high = getattr(self, f"min_{what}_m"), getattr(self, f"max_{what}_m")
            if low > high:
                raise ValueError(f"scene.min_{what}_m = {low}: is more than the maximum, {high}")


@dataclass(frozen=True, eq=False)
class Building:
    """A box that stands upright."""

    corners: Floats  #: (4, 2) [m] seen from above, counter-clockwise
    ground: float  #: height of its floor [m]
    height: float  #: [m]
    colour: tuple[int, int, int]


@dataclass(frozen=True, eq=False, repr=False)
class DrivingScene:
    road: Floats  #: (N, 3) its middle [m], places about 2 m apart
    road_width_m: float
    buildings: tuple[Building, ...]

    def edges(self, offset: float) -> Floats:
        """(N, 3) the line so far to the left of the middle."""
        d = np.gradient(self.road[:, :2], axis=0)
        d /= np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-9)
        left = np.stack([-d[:, 1], d[:, 0], np.zeros(len(d))], axis=1)
        return self.road + offset * left


def _resampled(path: Floats, extend_m: float) -> Floats:
    """Places 2 m apart along the path seen from above."""
    keep = [0]
    for i in range(1, len(path)):
        # The direction of shorter pieces is noise.
        if np.linalg.norm(path[i, :2] - path[keep[-1], :2]) > 0.5:
            keep.append(i)
    points = path[keep]
    length = float(np.sum(np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)))
    if length < _SHORTEST_PATH_M:
        raise ValueError(f"path: is {length:.3g} m long, a road needs at least {_SHORTEST_PATH_M:g} m")
    if length > _LONGEST_PATH_M:
        raise ValueError(f"path: is {length:.6g} m long, must be at most {_LONGEST_PATH_M:g} m")

    def beyond(end: Floats, inner: Floats) -> Floats:
        d = end - inner
        d[2] = 0
        return end + extend_m * d / np.linalg.norm(d)

    points = np.vstack([beyond(points[0], points[1]), points, beyond(points[-1], points[-2])])
    s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1))])
    at = np.arange(0, s[-1], _STEP_M)
    return np.stack([np.interp(at, s, column) for column in points.T], axis=1)


def _distance_to_box(points: Floats, corner: Floats, along: Floats, size: Floats) -> Floats:
    """(N,) of points to a rectangle with its corner, axis and size; 0 inside."""
    d = points - corner
    across = np.array([-along[1], along[0]])
    local = np.stack([d @ along, d @ across], axis=1)
    return np.linalg.norm(np.maximum(np.maximum(-local, local - size), 0), axis=1)


def _overlap(a: Floats, b: Floats) -> bool:
    """Of two convex quadrilaterals (4, 2): no edge of either separates them."""
    for quad in (a, b):
        edges = np.roll(quad, -1, axis=0) - quad
        normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
        pa, pb = normals @ a.T, normals @ b.T
        if np.any((pa.max(axis=1) <= pb.min(axis=1)) | (pb.max(axis=1) <= pa.min(axis=1))):
            return False
    return True


def _buildings(
    road: Floats, side: float, options: SceneOptions, random: Random, all_: list[Building]
) -> None:
    """Adds those on one side (1: left, -1: right)."""
    line = DrivingScene(road, options.road_width_m, ()).edges(
        side * (options.road_width_m / 2 + options.pavement_m)
    )
    keep_off = options.road_width_m / 2 + 0.8 * options.pavement_m
    i = 0
    while i < len(line) - 1:
        width = random.uniform(options.min_width_m, options.max_width_m)
        depth = random.uniform(options.min_depth_m, options.max_depth_m)
        height = random.uniform(options.min_height_m, options.max_height_m)
        gap = random.uniform(0, options.largest_gap_m)
        colour = _WALLS[int(random.uniform(0, len(_WALLS)))]
        start = line[i, :2]
        reach = np.linalg.norm(line[i:, :2] - start, axis=1)
        end = np.flatnonzero(reach >= width)
        if not len(end):
            return
        along = (line[i + end[0], :2] - start) / reach[end[0]]
        away = side * np.array([-along[1], along[0]])
        corners = np.array(
            [start, start + width * along, start + width * along + depth * away, start + depth * away]
        )
        if side < 0:
            corners = corners[::-1]
        origin = start if side > 0 else start + depth * away
        clear = _distance_to_box(road[:, :2], origin, along, np.array([width, depth])).min() >= keep_off
        if clear and not any(_overlap(corners, other.corners) for other in all_):
            ground = float(line[i : i + end[0] + 1, 2].min())
            all_.append(Building(corners, ground, height, colour))
            i += int(end[0]) + int(gap / _STEP_M)
        else:
            i += 2


def scene_along(path: Floats, seed: int = 2, options: SceneOptions | None = None) -> DrivingScene:
    """Road and buildings along a path (N, 3) [m], such as the true positions of a drive.

    Raises ValueError for a path that is not finite, shorter than 5 m or longer than 20 km, and naming an
    option that is out of range.
    """
    options = options or SceneOptions()
    options.check()
    path = np.asarray(path, dtype=float)
    if path.ndim != 2 or path.shape[1] != 3 or len(path) < 2:
        raise ValueError(f"path: has shape {path.shape}, must be (N, 3) with N of at least 2")
    bad = np.argwhere(~np.isfinite(path))
    if len(bad):
        raise ValueError(f"path{bad[0].tolist()} = {path[tuple(bad[0])]}: must be finite")
    road = _resampled(path, options.extend_m)
    random = Random(seed)
    buildings: list[Building] = []
    for side in (1.0, -1.0):
        _buildings(road, side, options, random, buildings)
    return DrivingScene(road, options.road_width_m, tuple(buildings))
