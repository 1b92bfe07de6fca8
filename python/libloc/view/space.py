"""What is in space: body, trajectory, uncertainty, camera, map, GPS fixes, reference.

Frames: world as the estimates say (z up, or down for NED). All ellipsoids hold 3 deviations.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import loc
import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import EstimateValid
from libloc.view.geometry import Floats, ellipsoids, is_rotation, rotation_of
from libloc.view.recorder import Recorder

SIGMAS = 3.0
# The way, tied to north and with GPS to the Earth; and as long as the world is the map's own.
TRAJECTORY, LOCAL_TRAJECTORY = "world/trajectory/tied", "world/trajectory/local"
REFERENCE, GPS = "world/reference", "world/gps"
CAMERA = "world/camera"
_BLUE, _GREY, _ORANGE = (31, 119, 180), (150, 150, 150), (255, 127, 14)
_TRAIL_NS = 100_000_000  # length of a piece of a trail: many short ones are slow to draw
_GAP_NS = 2_000_000_000  # a trail does not bridge more than this
_WAITING_FIXES = 100_000
#: A point is drawn without ellipsoid when this share of its distance is within 3 deviations: how far it is,
#: is hardly known, and its ellipsoid would hide all others.
_FAR = 0.5

_MESSAGES: Any = loc  # lcm-gen writes no types
_fix_t = _MESSAGES.gps_fix_t
Align = Callable[[Floats], Floats]  # (N, 3) of the reference's world to (N, 3) of the estimates'


@dataclass
class Trail:
    """A line that grows with time, in pieces: whoever looks at a moment sees those up to then."""

    entity: str
    colour: tuple[int, int, int]
    radius: float  # [px]
    points: list[Floats] = field(default_factory=list)
    begin_ns: int = 0
    last_ns: int = 0

    def add(self, out: Recorder, time_ns: int, position: Floats) -> None:
        if self.points and not 0 <= time_ns - self.last_ns <= _GAP_NS:
            self.flush(out)
            self.points = []
        if not self.points:
            self.begin_ns = time_ns
        self.points.append(position)
        self.last_ns = time_ns
        if time_ns - self.begin_ns >= _TRAIL_NS:
            self.flush(out)

    def flush(self, out: Recorder) -> None:
        if len(self.points) > 1:
            rr = out.rr
            strip = np.array(self.points, dtype=np.float32)
            out.style(
                self.entity, "LineStrips3D", colors=[self.colour], radii=rr.Radius.ui_points(self.radius)
            )
            out.log(self.last_ns, self.entity, rr.LineStrips3D([strip]))
            self.points = [self.points[-1]]
            self.begin_ns = self.last_ns


class SpaceDrawing:
    def __init__(self, out: Recorder, camera: Any | None, axis_m: float) -> None:
        """camera: calibration of the one that is drawn, or None; axis_m: length of axes and frustum."""
        self.out = out
        self.camera = camera
        self.counts: Counter[str] = Counter()
        self.align: Align | None = None  #: of the reference; None: it is not drawn
        self.camera_from_frames = False
        self._axis_m = 0.0
        self._trail = Trail(LOCAL_TRAJECTORY, _BLUE, 0.9)
        self._shared_cov = np.zeros((3, 3))  # of all points of a map that GPS has tied to the Earth
        self.tied_ns: int | None = None  #: when the world became another one, tied to north
        self._reference = Trail(REFERENCE, _GREY, 0.7)
        self._origin: Any = None  # libloc.LocalFrame
        self._origin_of: tuple[float, float, float] | None = None
        self._fixes: list[Any] = []
        self._world = ""
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        self.where: Floats | None = None  #: newest position of the camera, or else of the body
        self.set_scale(axis_m)

    def set_scale(self, axis_m: float) -> None:
        """Axes and frustum so long."""
        if axis_m == self._axis_m:
            return
        self._axis_m = axis_m
        rr, out = self.out.rr, self.out
        out.static("world/body/axes", rr.TransformAxes3D(axis_length=axis_m))
        if self.camera is None:
            out.static(f"{CAMERA}/axes", rr.TransformAxes3D(axis_length=axis_m))
            return
        fx, fy, cx, cy = self.camera.intrinsics_px
        out.static(
            f"{CAMERA}/image",
            rr.Pinhole(
                # rerun's pixel (0, 0) is the corner of the first pixel, libloc's its centre.
                image_from_camera=np.array([[fx, 0, cx + 0.5], [0, fy, cy + 0.5], [0, 0, 1]]),
                resolution=[self.camera.width_px, self.camera.height_px],
                camera_xyz=rr.ViewCoordinates.RDF,
                image_plane_distance=2 * axis_m,
                color=(255, 190, 60),
                line_width=rr.Radius.ui_points(1.0),
            ),
        )

    def estimate(self, m: Any) -> tuple[Floats | None, float]:
        """Draws an estimate_t; deviations of position (3,) or None, and of heading [rad] or NaN."""
        rr, out, t = self.out.rr, self.out, m.time_ns
        self._set_world(m.world)
        q = np.array(m.q_world_body_wxyz)
        oriented = bool(m.valid & EstimateValid.ORIENTATION) and is_rotation(q)
        p = np.array(m.position)
        placed = bool(m.valid & EstimateValid.POSITION) and bool(np.isfinite(p).all())
        if not (oriented or placed):
            self.counts["estimates.without_pose"] += 1
            return None, float("nan")
        place = p if placed else np.zeros(3)
        turn = {"quaternion": np.roll(q, -1)} if oriented else {}
        out.log(t, "world/body", rr.Transform3D(translation=place, **turn))
        self.counts["estimates.drawn"] += 1
        if placed:
            self._tie(t, is_tied(m))
            self._trail.add(out, t, p)
            self._low, self._high = np.minimum(self._low, p), np.maximum(self._high, p)
        if not self.camera_from_frames:
            self.where = place
            if self.camera is not None and oriented and placed:
                T = libloc.Pose3(q, p) * self.camera.T_body_camera
                turned = np.roll(T.rotation_wxyz, -1)
                out.log(t, CAMERA, rr.Transform3D(translation=T.translation, quaternion=turned))
        return self._sigmas(m, q if oriented else None, p if placed else None)

    def _tie(self, time_ns: int, tied: bool) -> None:
        """When GPS ties the map to the Earth, the way goes on in another world: no line leads there."""
        entity = TRAJECTORY if tied else LOCAL_TRAJECTORY
        if entity == self._trail.entity:
            return
        if tied and self._trail.points:
            self.tied_ns = time_ns
        self._trail.flush(self.out)
        self._trail = Trail(entity, _BLUE, 0.9)
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)

    def _sigmas(self, m: Any, q: Floats | None, p: Floats | None) -> tuple[Floats | None, float]:
        dim = m.covariance_dim
        if not m.valid & EstimateValid.COVARIANCE or dim < 3:
            return None, float("nan")
        cov = np.array(m.covariance, dtype=float)
        heading = float("nan")
        if q is not None and np.isfinite(cov[:3, :3]).all():
            up = rotation_of(q)[2]
            heading = float(np.sqrt(max(up @ cov[:3, :3] @ up, 0)))
        block = cov[3:6, 3:6]
        if p is None or dim < 6 or not np.isfinite(block).all():
            return None, heading
        if m.valid & EstimateValid.HEADING:
            self._shared_cov = block
        half, turn = ellipsoids(block[None], SIGMAS)
        self._ellipsoids(m.time_ns, "world/uncertainty", p[None], half, turn, [(*_BLUE, 60)])
        return np.sqrt(np.maximum(np.diagonal(block), 0)), heading

    def frame(self, m: Any) -> None:
        """Camera of a slam_frame_t."""
        p, q = np.array(m.camera_position), np.array(m.q_world_camera_wxyz)
        if not (np.isfinite(p).all() and is_rotation(q)):
            self.counts["frames.without_pose"] += 1
            return
        self.camera_from_frames = True
        self.where = p
        rr = self.out.rr
        self.out.log(m.time_ns, CAMERA, rr.Transform3D(translation=p, quaternion=np.roll(q, -1)))

    def map(self, m: Any, time_ns: int | None = None) -> None:
        """Points of a map_points_t, green where they are well known, red where not; shown from time_ns on.

        Where the map as a whole is on the Earth is as uncertain as the pose, whose ellipsoid tells: that is
        taken out of the points' covariances, which would all look alike otherwise.
        """
        rr = self.out.rr
        t = m.time_ns if time_ns is None else time_ns
        p = np.array(m.position, dtype=float).reshape(-1, 3)
        cov = np.array(m.position_cov, dtype=float).reshape(-1, 3, 3)
        good = np.isfinite(p).all(axis=1) & np.isfinite(cov).all(axis=(1, 2))
        self.counts["map.not_finite"] += int(np.sum(~good))
        p, cov = p[good], cov[good] - self._shared_cov
        self.counts["maps.drawn"] += 1
        half, turn = ellipsoids(cov, SIGMAS)
        eye = np.zeros(3) if self.where is None else self.where
        share = half[:, -1] / np.maximum(np.linalg.norm(p - eye, axis=1), 1e-9) if len(p) else np.zeros(0)
        colours = _colours(share)
        near = share < _FAR
        for name, rows in (("points", near), ("far", ~near)):
            points = rr.Points3D(p[rows], colors=colours[rows], radii=rr.Radius.ui_points(2.5))
            self.out.log(t, f"world/map/{name}", points)
        shade = np.column_stack([colours[near], np.full(near.sum(), 70, dtype=np.uint8)])
        self._ellipsoids(t, "world/map/uncertainty", p[near], half[near], turn[near], shade)

    def _ellipsoids(
        self, t: int, entity: str, centres: Floats, half: Floats, turn: Floats, colours: Any
    ) -> None:
        rr = self.out.rr
        self.out.style(entity, "Ellipsoids3D", fill_mode="majorwireframe")
        shown = rr.Ellipsoids3D(centers=centres, half_sizes=half, quaternions=turn, colors=colours)
        self.out.log(t, entity, shown)

    def fusion(self, m: Any) -> None:
        origin = (m.origin_latitude, m.origin_longitude, m.origin_altitude)
        if not np.isfinite(origin).all() or origin == self._origin_of:
            return
        try:
            self._origin = libloc.LocalFrame(*origin)
        except ValueError:
            self.counts["fusion.origin_not_on_earth"] += 1
            return
        if self._origin_of is not None:
            self.counts["fusion.origin_moved"] += 1
        self._origin_of = origin
        waiting, self._fixes = self._fixes, []
        for fix in waiting:
            self.gps(fix)

    def gps(self, m: Any) -> None:
        """A gps_fix_t: kept until the origin of world is known."""
        place = np.array([m.latitude, m.longitude, m.altitude])
        if m.fix_type in (_fix_t.FIX_NONE, _fix_t.FIX_TIME) or not np.isfinite(place[:2]).all():
            self.counts["gps.without_position"] += 1
            return
        if self._origin is None:
            if len(self._fixes) < _WAITING_FIXES:
                self._fixes.append(m)
            else:
                self.counts["gps.without_origin"] += 1
            return
        if not np.isfinite(place[2]):
            place[2] = self._origin_of[2] if self._origin_of is not None else 0.0
            self.counts["gps.without_altitude"] += 1
        try:
            p = self._origin.to_local(place)
        except ValueError:
            self.counts["gps.not_on_earth"] += 1
            return
        rr = self.out.rr
        self.out.style(GPS, "Points3D", colors=[_ORANGE], radii=rr.Radius.ui_points(3.0))
        self.out.log(m.time_ns, GPS, rr.Points3D([p]))
        self.counts["gps.drawn"] += 1
        cov = np.array(m.position_cov, dtype=float)
        if np.isfinite(cov).all():
            half, turn = ellipsoids(cov[None], SIGMAS)
            self._ellipsoids(m.time_ns, f"{GPS}/uncertainty", p[None], half, turn, [(*_ORANGE, 40)])

    def reference(self, m: Any) -> None:
        p = np.array(m.position, dtype=float)
        if not np.isfinite(p).all():
            self.counts["reference.without_position"] += 1
            return
        if self.align is None:
            self.counts["reference.not_aligned"] += 1
            return
        self._reference.add(self.out, m.time_ns, self.align(p[None])[0])
        self.counts["reference.drawn"] += 1

    def extent(self) -> tuple[Floats, float] | None:
        """Centre and radius of the way, with some room for what was seen from it; None when there is none."""
        if not np.isfinite(self._low).all():
            return None
        radius = float(np.linalg.norm(self._high - self._low)) / 2
        return (self._low + self._high) / 2, max(radius, 5 * self._axis_m)

    def finish(self) -> None:
        """Draws what is left; what was never drawn is counted."""
        self._trail.flush(self.out)
        self._reference.flush(self.out)
        self.counts["gps.without_origin"] += len(self._fixes)
        self._fixes = []

    def _set_world(self, world: str) -> None:
        if world == self._world:
            return
        self._world = world
        down = world == "NED"
        coordinates = self.out.rr.ViewCoordinates
        self.out.static("world", coordinates.RIGHT_HAND_Z_DOWN if down else coordinates.RIGHT_HAND_Z_UP)


def is_tied(estimate: Any) -> bool:
    """The world of an estimate_t is the one that its log ends in: only SLAM begins in a map of its own."""
    return bool(estimate.valid & EstimateValid.HEADING) or not estimate.method.endswith("slam")


def _colours(share: Floats) -> NDArray[np.uint8]:
    """(N, 3) From green, 3 deviations are at most 1 % of the distance, over yellow to red, 50 % and more."""
    at = np.clip(np.log(np.maximum(share, 1e-9) / 0.01) / np.log(50.0), 0, 1)[:, None]
    stops = np.array([[40, 190, 90], [240, 210, 60], [230, 60, 60]], dtype=float)
    low = np.where(at < 0.5, stops[0] + (stops[1] - stops[0]) * 2 * at, 0)
    high = np.where(at >= 0.5, stops[1] + (stops[2] - stops[1]) * (2 * at - 1), 0)
    return (low + high).astype(np.uint8)
