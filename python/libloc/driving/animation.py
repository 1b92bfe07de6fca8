"""The drive as a moving picture: road, buildings, the true vehicle (solid), the estimated one (transparent).

A camera follows the true vehicle; a map shows the whole drive; text says time, errors and scale.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from libloc._core import Pose3, so3
from libloc.driving.painter import Camera, Canvas, Rgb, mixed
from libloc.driving.run import DrivingRun, Floats, interpolated_rotation
from libloc.driving.scene import Building, DrivingScene
from libloc.driving.video import check_video_path, write_video

TRUTH: Rgb = (0, 114, 189)
ESTIMATE: Rgb = (0, 114, 189)
ODOMETRY: Rgb = (230, 120, 20)
_SKY, _HAZE = (128, 178, 226), (225, 233, 240)
_GROUND, _ROAD, _PAVEMENT, _PAINT = (166, 182, 140), (92, 94, 98), (176, 174, 168), (236, 236, 230)
_INK, _PANEL = (28, 34, 42), (255, 255, 255, 225)
_GLASS = (92, 112, 134)
_SUN = np.array([0.35, -0.5, 0.79])
_VISIBLE_M = 420.0
_HAZE_FROM_M = 120.0
_WINDOWS_TO_M = 170.0
# The vehicle; its origin is on the ground below the rear axle.
VEHICLE_LOW, VEHICLE_HIGH = np.array([-1.0, -0.9, 0.0]), np.array([3.7, 0.9, 1.5])
_FACES = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))


@dataclass(frozen=True)
class AnimationOptions:
    width: int = 1280  #: pixels
    height: int = 720
    rate_hz: float = 25.0  #: pictures a second
    speed: float = 4.0  #: seconds of the drive in a second of the video
    behind_m: float = 24.0  #: where the camera is, seen from the true vehicle
    above_m: float = 17.0

    def check(self) -> None:
        """Raises ValueError naming the field and its value."""
        for name in ("width", "height"):
            if not 160 <= getattr(self, name) <= 4096:
                raise ValueError(f"animation.{name} = {getattr(self, name)}: must be in [160, 4096]")
        for name in ("rate_hz", "speed", "behind_m", "above_m"):
            value = getattr(self, name)
            if not np.isfinite(value) or value <= 0:
                raise ValueError(f"animation.{name} = {value}: must be positive")
        if self.rate_hz > 240:
            raise ValueError(f"animation.rate_hz = {self.rate_hz}: must be at most 240")


def box_corners(position: Floats, q_wxyz: Floats) -> Floats:
    """(8, 3) of the vehicle in world: floor counter-clockwise from the rear right, then roof."""
    low, high = VEHICLE_LOW, VEHICLE_HIGH
    floor = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
    corners = np.array([(x, y, z) for z in (low[2], high[2]) for x, y in floor])
    return Pose3(q_wxyz, position).transform(corners)


def _at(t_s: float, times_s: Floats, rows: Floats) -> Floats:
    """Row (k,) of (N, k), between the neighbours."""
    return np.array([np.interp(t_s, times_s, column) for column in rows.T])


class _House:
    """A building as faces and windows."""

    def __init__(self, building: Building) -> None:
        c, z0, z1 = building.corners, building.ground, building.ground + building.height
        self.building = building
        self.centre = np.append(c.mean(axis=0), (z0 + z1) / 2)
        floor = np.column_stack([c, np.full(4, z0)])
        roof = np.column_stack([c, np.full(4, z1)])
        self.faces = [np.stack([floor[i], floor[(i + 1) % 4], roof[(i + 1) % 4], roof[i]]) for i in range(4)]
        self.faces.append(roof)
        edges = np.roll(c, -1, axis=0) - c
        normals = np.column_stack([edges[:, 1], -edges[:, 0], np.zeros(4)])
        self.normals = np.vstack([normals / np.linalg.norm(normals, axis=1, keepdims=True), [0, 0, 1]])
        self.brightness = 0.78 + 0.28 * np.clip(self.normals @ _SUN, -0.5, 1)
        self.windows = [_windows(face) for face in self.faces[:4]]


def _windows(face: Floats) -> Floats:
    """(W, 4, 3) rows of windows on a wall."""
    right, up = face[1] - face[0], face[3] - face[0]
    wide, high = np.linalg.norm(right), np.linalg.norm(up)
    columns, rows = int((wide - 1) // 2.8), int((high - 0.6) // 3.0)
    if columns < 1 or rows < 1:
        return np.empty((0, 4, 3))
    u = (np.arange(columns) + 0.5) / columns
    v = (np.arange(rows) + 0.55) / rows
    du, dv = 0.7 / wide, 0.75 / high
    u, v = (grid.ravel() for grid in np.meshgrid(u, v))
    s = np.stack([u - du, u + du, u + du, u - du], axis=1)
    t = np.stack([v - dv, v - dv, v + dv, v + dv], axis=1)
    return face[0] + s[..., None] * right + t[..., None] * up


def _hidden_first(houses: list[_House], eye: Floats) -> list[_House]:
    """From far to near: of two boxes, one lies beyond a wall of the other as seen from the eye."""
    n = len(houses)
    corners = np.array([house.building.corners for house in houses])
    normals = np.array([house.normals[:4, :2] for house in houses])
    offsets = np.einsum("nij,nij->ni", normals, corners)
    # Wall w of house a has all of house b outside of it, and the eye inside: b is behind a.
    outside = np.einsum("awk,bck->abwc", normals, corners) - offsets[:, None, :, None]
    beyond = outside.min(axis=3) >= -1e-6
    eye_side = np.einsum("awk,k->aw", normals, eye[:2]) - offsets
    behind = np.any(beyond & (eye_side <= 0)[:, None, :], axis=2)
    before = np.any(beyond & (eye_side > 0)[:, None, :], axis=2)
    first = behind.T & ~before.T | before & ~behind  # first[a, b]: a is drawn before b
    np.fill_diagonal(first, False)
    distance = np.linalg.norm(corners.mean(axis=1) - eye[:2], axis=1)
    waiting = first.sum(axis=0)
    left = np.ones(n, dtype=bool)
    order = []
    for _ in range(n):
        # A ring in which everyone waits for the next is cut at the farthest.
        ready = left & (waiting == 0) if np.any(left & (waiting == 0)) else left
        i = int(np.flatnonzero(ready)[np.argmax(distance[ready])])
        order.append(houses[i])
        left[i] = False
        waiting = waiting - first[i]
    return order


class DrivingAnimation:
    """Pictures of a drive at any time of it.

    Raises ValueError naming an option that is out of range.
    """

    def __init__(self, run: DrivingRun, scene: DrivingScene, options: AnimationOptions | None = None) -> None:
        self.run, self.scene, self.options = run, scene, options or AnimationOptions()
        self.options.check()
        o = self.options
        self.duration_s = float(run.times_s[-1])
        self._houses = [_House(building) for building in scene.buildings]
        self._background = Canvas.background(o.width, round(0.5 * o.height), _SKY, _HAZE)
        full = Canvas.background(o.width, o.height, _HAZE, _HAZE)
        full.paste(self._background)
        self._background = full
        self._road = [scene.edges(side * scene.road_width_m / 2) for side in (1, -1)]
        self._pavement = [scene.edges(side * (scene.road_width_m / 2 + 2.2)) for side in (1, -1)]
        self._dashes = [scene.edges(side * 0.09) for side in (1, -1)]
        self._heading = self._smooth_heading()
        vo = run.odometry_in_metres
        self._odometry = None if vo is None else ((vo[0] - run.times_ns[0]) * 1e-9, vo[1])
        self._map = self._map_frame()

    # ---- where things are at a time
    def _smooth_heading(self) -> Floats:
        """The camera swings round: the heading as a mean over 3 s, at ten places a second."""
        t = np.arange(0, self.duration_s + 0.1, 0.1)
        heading = np.unwrap(np.atleast_1d(so3.heading(self.run.true_q_world_body_wxyz)))
        at = np.interp(t, self.run.times_s, heading)
        reach = 15
        padded = np.concatenate([np.full(reach, at[0]), at, np.full(reach, at[-1])])
        return np.convolve(padded, np.full(2 * reach + 1, 1 / (2 * reach + 1)), "valid")

    def _pose(self, t_s: float, position: Floats, q_wxyz: Floats) -> tuple[Floats, Floats]:
        at = np.array([self.run.times_ns[0] + round(t_s * 1e9)], dtype=np.int64)
        return _at(t_s, self.run.times_s, position), interpolated_rotation(at, self.run.times_ns, q_wxyz)[0]

    def true_pose(self, t_s: float) -> tuple[Floats, Floats]:
        """Position (3,) and q_world_body_wxyz (4,)"""
        return self._pose(t_s, self.run.true_position, self.run.true_q_world_body_wxyz)

    def estimated_pose(self, t_s: float) -> tuple[Floats, Floats]:
        return self._pose(t_s, self.run.position, self.run.q_world_body_wxyz)

    def camera(self, t_s: float) -> Camera:
        """Behind and above the true vehicle, looking at a place in front of it."""
        o = self.options
        heading = float(np.interp(t_s, 0.1 * np.arange(len(self._heading)), self._heading))
        along = np.array([np.cos(heading), np.sin(heading), 0])
        position = self.true_pose(t_s)[0]
        eye = position - o.behind_m * along + [0, 0, o.above_m]
        return Camera(eye, position + 7 * along, o.width, o.height, 1.05 * o.height)

    # ---- drawing
    def frame(self, t_s: float) -> NDArray[np.uint8]:
        """The picture (height, width, 3) at a time since the first estimate [s]."""
        if not 0 <= t_s <= self.duration_s + 1e-9:
            raise ValueError(f"t_s = {t_s}: must be in [0, {self.duration_s}]")
        t_s = min(t_s, self.duration_s)
        camera = self.camera(t_s)
        canvas = Canvas(camera, self._background)
        true_p, true_q = self.true_pose(t_s)
        estimate_p, estimate_q = self.estimated_pose(t_s)
        self._draw_ground(canvas, float(true_p[2]))
        self._draw_trails(canvas, t_s)
        self._draw_buildings(canvas, true_p)
        self._draw_box(canvas, true_p, true_q, TRUTH, 255)
        self._draw_deviation(canvas, t_s, estimate_p)
        self._draw_box(canvas, estimate_p, estimate_q, ESTIMATE, 105)
        self._draw_map(canvas, t_s)
        self._draw_text(canvas, t_s)
        return canvas.picture()

    def times(self) -> Floats:
        """Of the pictures of the video [s]."""
        step = self.options.speed / self.options.rate_hz
        return np.arange(0, self.duration_s + 1e-9, step)

    def frames(self, progress: Callable[[int, int], None] | None = None) -> Iterator[NDArray[np.uint8]]:
        """All pictures; progress(done, all) is called after each."""
        times = self.times()
        for i, t in enumerate(times):
            yield self.frame(float(t))
            if progress:
                progress(i + 1, len(times))

    def _draw_ground(self, canvas: Canvas, height: float) -> None:
        eye = canvas.camera.eye
        # The camera is level: all that is so far ahead lies in one row. Farther off it fades into the haze.
        forward = canvas.camera.axes[2] * [1, 1, 0]
        width, bottom = self.options.width, self.options.height + 2.0
        for distance, part in ((20_000.0, 0.55), (360.0, 0.25), (180.0, 0.0)):
            ahead = eye + distance * forward / np.linalg.norm(forward)
            row = float(canvas.camera.project(np.array([ahead[0], ahead[1], height]))[1])
            corners = np.array([[-2.0, row], [width + 2, row], [width + 2, bottom], [-2, bottom]])
            if row < bottom:
                canvas.flat_polygon(corners, mixed(_GROUND, _HAZE, part))
        # Pieces of 2 m, of 4 m where they are small.
        to = self.scene.road - eye
        distance = np.linalg.norm(to[:, :2], axis=1)
        shown = (distance < _VISIBLE_M) & (to @ canvas.camera.axes[2] > -12)
        pieces = [(i, 1) for i in np.flatnonzero(shown & (distance < 90)) if i >= 1]
        pieces += [(i, 2) for i in np.flatnonzero(shown & (distance >= 86)) if i >= 2 and i % 2 == 0]
        for (left, right), colour in ((self._pavement, _PAVEMENT), (self._road, _ROAD)):
            for i, step in pieces:
                canvas.polygon(np.array([right[i - step], right[i], left[i], left[i - step]]), colour)
        left, right = self._dashes
        for i, step in pieces:
            if i % 4 == 2 or (i % 4 == 1 and step == 1):
                canvas.polygon(np.array([right[i - step], right[i], left[i], left[i - step]]), _PAINT)

    def _draw_trails(self, canvas: Canvas, t_s: float) -> None:
        run = self.run
        shown = (run.times_s <= t_s) & (run.times_s >= t_s - 12)
        step = max(1, int(np.sum(shown)) // 200)
        raised = np.array([0, 0, 0.05])  # above the road
        if self._odometry is not None:
            times, position = self._odometry
            recent = position[(times <= t_s) & (times >= t_s - 12)]
            canvas.line(recent + raised, (*ODOMETRY, 190), 1.5)
        canvas.line(run.position[shown][::step] + raised, (*ESTIMATE, 210), 2.5)

    def _draw_buildings(self, canvas: Canvas, vehicle: Floats) -> None:
        eye, forward = canvas.camera.eye, canvas.camera.axes[2]
        houses = []
        for house in self._houses:
            to = house.centre - eye
            if np.linalg.norm(to[:2]) < _VISIBLE_M and to @ forward > -25:
                houses.append(house)
        for house in _hidden_first(houses, eye) if houses else []:
            self._draw_house(canvas, house, eye, self._hides(house.building, eye, vehicle))

    @staticmethod
    def _hides(building: Building, eye: Floats, vehicle: Floats) -> bool:
        """Whether the building stands between the eye and the vehicle."""
        if np.linalg.norm(building.corners.mean(axis=0) - vehicle[:2]) > 80:
            return False
        t = np.linspace(0, 1, 40)[:, None]
        sight = eye + t * (vehicle + np.array([0, 0, 0.7]) - eye)
        low = sight[sight[:, 2] < building.ground + building.height + 1.0]
        if not len(low):
            return False
        c = building.corners
        edges = np.roll(c, -1, axis=0) - c
        outwards = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
        outwards /= np.linalg.norm(edges, axis=1, keepdims=True)
        distance = np.einsum("tck,ck->tc", low[:, None, :2] - c, outwards)
        return bool(np.any(np.all(distance < 1.5, axis=1)))

    @staticmethod
    def _draw_house(canvas: Canvas, house: _House, eye: Floats, see_through: bool) -> None:
        distance = float(np.linalg.norm(house.centre - eye))
        haze = float(np.clip((distance - _HAZE_FROM_M) / (_VISIBLE_M - _HAZE_FROM_M), 0, 1)) * 0.85
        for i, face in enumerate(house.faces):
            if (eye - face[0]) @ house.normals[i] <= 0:
                continue
            wall = tuple(min(255, round(house.brightness[i] * c)) for c in house.building.colour)
            colour = mixed((wall[0], wall[1], wall[2]), _HAZE, haze)
            if see_through:
                canvas.polygon(face, (*colour, 60), (*mixed(colour, _INK, 0.4), 130))
                continue
            seen = canvas.polygon(face, colour, mixed(colour, _INK, 0.25 * (1 - haze)), 0.6)
            if seen and i < 4 and distance < _WINDOWS_TO_M:
                glass = mixed(_GLASS, colour, 0.25 + 0.5 * distance / _WINDOWS_TO_M)
                for window in house.windows[i]:
                    canvas.polygon(window, glass)

    @staticmethod
    def _draw_box(canvas: Canvas, position: Floats, q_wxyz: Floats, colour: Rgb, alpha: int) -> None:
        corners = box_corners(position, q_wxyz)
        centre = corners.mean(axis=0)
        eye = canvas.camera.eye
        for face in _FACES:
            p = corners[list(face)]
            normal = np.cross(p[1] - p[0], p[2] - p[0])
            normal = normal if normal @ (p.mean(axis=0) - centre) > 0 else -normal
            if normal @ (eye - p[0]) <= 0:
                continue
            light = float(np.clip(0.75 + 0.35 * (normal @ _SUN) / np.linalg.norm(normal), 0.55, 1.1))
            shaded = tuple(min(255, round(light * c)) for c in colour)
            edge = (235, 245, 255, 230) if alpha < 255 else (*mixed(colour, _INK, 0.6), 255)
            canvas.polygon(p, (shaded[0], shaded[1], shaded[2], alpha), edge, 1.2)

    def _draw_deviation(self, canvas: Canvas, t_s: float, position: Floats) -> None:
        """Three deviations of the position as an ellipse on the ground."""
        sigma = self.run.estimated("position_sigma")
        if sigma is None:
            return
        now = _at(t_s, self.run.times_s, sigma)
        if not np.isfinite(now).all() or now.max() > 200:
            return
        angle = np.linspace(0, 2 * np.pi, 49)
        ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(49)], axis=1) * [3 * now[0], 3 * now[1], 0]
        canvas.polygon(position + ring + [0, 0, 0.06], (*ESTIMATE, 38))
        canvas.line(position + ring + [0, 0, 0.06], (*ESTIMATE, 200), 1.5)

    # ---- what lies over the picture
    def _map_frame(self) -> tuple[Floats, float, Floats]:
        """Corner of the map in pixels, pixels a metre, world place at its lower left."""
        o = self.options
        points = self.run.true_position[:, :2]
        low, high = points.min(axis=0), points.max(axis=0)
        margin = 0.06 * float((high - low).max()) + 1
        low, high = low - margin, high + margin
        box = 0.30 * np.array([o.width, 1.3 * o.height])
        scale = float((box / (high - low)).min())
        size = scale * (high - low)
        corner = np.array([o.width - size[0] - 0.02 * o.height, 0.02 * o.height])
        return corner, scale, np.array([low[0], high[1]])

    def _map_pixels(self, points: Floats) -> Floats:
        corner, scale, upper_left = self._map
        d = (points[:, :2] - upper_left) * [scale, -scale]
        return corner + d

    def _draw_map(self, canvas: Canvas, t_s: float) -> None:
        o, run = self.options, self.run
        unit = o.height / 720
        corner = self._map[0]
        canvas.flat_box(
            (corner[0], corner[1]),
            (o.width - 0.02 * o.height, 2 * corner[1] + self._map_size()[1] - 0.02 * o.height),
            _PANEL,
            6 * unit,
        )
        step = max(1, len(run.times_s) // 600)
        canvas.flat_line(self._map_pixels(run.true_position[::step]), (190, 194, 200), 4 * unit)
        low = self._map_pixels(np.array([self._map[2]]))[0]
        high = low + self._map_size()
        if self._odometry is not None:
            times, position = self._odometry
            pixels = self._map_pixels(position[times <= t_s])[:: max(1, len(times) // 900)]
            inside = np.all((pixels > low) & (pixels < high), axis=1)
            canvas.flat_line(pixels[inside], ODOMETRY, 1.2 * unit)
        done = run.times_s <= t_s
        pixels = self._map_pixels(run.position[done][::step])
        inside = np.all((pixels > low) & (pixels < high), axis=1)
        canvas.flat_line(pixels[inside], ESTIMATE, 1.8 * unit)
        now = self._map_pixels(self.true_pose(t_s)[0][None])[0]
        canvas.flat_dot(now, 4.5 * unit, TRUTH, (255, 255, 255))

    def _map_size(self) -> Floats:
        points = self.run.true_position[:, :2]
        low, high = points.min(axis=0), points.max(axis=0)
        margin = 0.06 * float((high - low).max()) + 1
        return self._map[1] * (high - low + 2 * margin)

    def _draw_text(self, canvas: Canvas, t_s: float) -> None:
        run, unit = self.run, self.options.height / 720
        error = float(np.linalg.norm(_at(t_s, run.times_s, run.position_error)))
        lines = [(f"{t_s:.1f} s", True), (f"position error {error:.2f} m", False)]
        scale = run.estimated("scale")
        if scale is not None and np.isfinite(now := float(np.interp(t_s, run.times_s, scale))):
            lines.append((f"odometry scale {now:.3f}", False))
        legend = [("true vehicle", TRUTH, 255), ("estimate, 3σ of its position", ESTIMATE, 105)]
        if self._odometry is not None:
            assert run.odometry_in_metres is not None
            legend.append((f"visual odometry ÷ {run.odometry_in_metres[2]}", ODOMETRY, 255))
        x, y, size = 14 * unit, 14 * unit, 19 * unit
        row = 1.45 * size
        height = row * (len(lines) + len(legend)) + 1.2 * size
        canvas.flat_box((x, y), (x + 17.5 * size, y + height), _PANEL, 6 * unit)
        y += 0.5 * size
        for text, bold in lines:
            canvas.text((x + 0.7 * size, y), text, size, _INK, bold)
            y += row
        for text, colour, alpha in legend:
            corner = np.array([x + 0.7 * size, y + 0.2 * size])
            swatch = corner + size * np.array([[0, 0], [1.5, 0], [1.5, 0.8], [0, 0.8]])
            canvas.flat_polygon(swatch, (*colour, alpha))
            canvas.flat_line(np.vstack([swatch, swatch[:2]]), (*colour, 255), 1.2 * unit)
            canvas.text((x + 2.7 * size, y), text, 0.85 * size, _INK)
            y += row


def animate(
    run: DrivingRun,
    scene: DrivingScene,
    path: str | os.PathLike[str],
    options: AnimationOptions | None = None,
    overwrite: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> int:
    """Writes the drive as a video and returns the number of pictures.

    path: .mp4 or .mkv (H.264; needs the Python package av), .gif, or a folder of .png. progress(done, all) is
    called after each picture. Raises as write_video() and
    AnimationOptions.check() do, before a picture is drawn.
    """
    check_video_path(Path(path), overwrite)
    animation = DrivingAnimation(run, scene, options)
    return write_video(path, animation.frames(progress), animation.options.rate_hz, overwrite)
