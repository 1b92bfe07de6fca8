"""What the study of SLAM with one camera simulates: worlds with their cameras, and how tracks are spoilt.

Worlds:
  look-at    a camera passes way-points and looks at given points (Popov 2015, 3.1), 20 s at 30 Hz, before a
             cloud of points that the seed draws
  circle     Civera's simulation: a circle of r = 3 m looking outward, 1000 frames at 30 Hz are two rounds,
             320 x 240 pixels, f = 195; points from 4.5 to 8 m from its middle, about 15 of them in view
  others     the scenarios of libloc, with their IMU and camera: what an estimator takes for noise is noise
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import libloc

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

CIRCLE_RADIUS_M = 3.0
CIRCLE_FRAMES = 1000
CIRCLE_POINTS = 140
LOOK_AT_S = 20.0
LOOK_AT_POINTS = 80
RATE_HZ = 30.0
DARK_S = 2.0  # without a feature
# Times [s], places and points looked at [m] of the look-at path: forward, a bend, and back.
_TIMES = (0.0, 4.0, 8.0, 12.0, 16.0, 20.0)
_PLACES = (
    (0, 0, 1.5),
    (1.2, 1.0, 1.6),
    (1.8, -0.6, 1.3),
    (0.6, -1.5, 1.5),
    (-0.4, 0.2, 1.7),
    (0.8, 1.0, 1.4),
)
_TARGETS = ((6, 0, 1.5), (6, 1.5, 1.6), (6, -0.5, 1.3), (6, -1.5, 1.6), (6, 0.5, 1.5), (6, 0.8, 1.4))
# As modelled by the estimator: white noise, biases that walk.
_AS_MODELLED = {
    "imu.accelerometer.instability_sigma": 0,
    "imu.gyroscope.instability_sigma": 0,
    "imu.accelerometer.resolution": 0,
    "imu.gyroscope.resolution": 0,
    "streams.gps": False,
    "streams.magnetometer": False,
    "streams.odometry": False,
}


@dataclass(frozen=True)
class World:
    """What is simulated. Cases of the same world and seed share one simulation."""

    name: str = "look-at"
    sigma_px: float = 1.0
    focal_px: float | None = None  # None: the world's
    size_px: tuple[int, int] | None = None
    duration_s: float | None = None
    spoilt: str = ""  # "", "outliers", "dropped", "dark"


@dataclass
class Tracks:
    """Frames as MonoSlam.run takes them."""

    times_ns: Ints
    first: Ints
    id: Ints
    pixel_px: Floats

    def of_frames(self, keep: NDArray[np.bool_]) -> Tracks:
        """Those frames only."""
        rows = np.repeat(keep, np.diff(self.first))
        counts = np.diff(self.first)[keep]
        return Tracks(
            self.times_ns[keep],
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            self.id[rows],
            np.ascontiguousarray(self.pixel_px[rows]),
        )

    def emptied(self, dark: NDArray[np.bool_]) -> Tracks:
        """Those frames see nothing."""
        counts = np.where(dark, 0, np.diff(self.first))
        rows = np.repeat(~dark, np.diff(self.first))
        return Tracks(
            self.times_ns,
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            self.id[rows],
            np.ascontiguousarray(self.pixel_px[rows]),
        )


@dataclass
class Imu:
    times_ns: Ints
    gyro: Floats
    force: Floats
    noise: libloc.ImuNoise


@dataclass
class Simulated:
    tracks: Tracks
    camera: libloc.CameraCalibration
    # Truth of body at the frames of the camera, before any of them was dropped.
    times_ns: Ints
    q_wxyz: Floats
    position: Floats
    velocity: Floats  # in world [m/s]
    angular_velocity: Floats  # in body [rad/s]
    points: Floats  # of the scene; the row is the identity
    imu: Imu | None = None


def _camera(width: int, height: int, focal_px: float) -> libloc.CameraCalibration:
    camera = libloc.CameraCalibration()
    camera.name = "cam0"
    camera.width_px, camera.height_px = width, height
    camera.intrinsics_px = (focal_px, focal_px, (width - 1) / 2, (height - 1) / 2)
    return camera


def _outward() -> libloc.Pose3:
    """A camera that looks to the right of a body with x forward, y left, z up."""
    axes = np.column_stack([[-1.0, 0, 0], [0, 0, -1], [0, -1, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] = axes
    return libloc.Pose3.from_matrix(matrix)


def _circle(random: libloc.Random) -> tuple[libloc.Motion, Floats]:
    angular = 2 * np.pi * 2 / (CIRCLE_FRAMES / RATE_HZ)
    points = []
    for _ in range(CIRCLE_POINTS):
        angle, distance = random.uniform(0, 2 * np.pi), random.uniform(4.5, 8)
        points.append([distance * np.cos(angle), distance * np.sin(angle), random.uniform(-1.5, 1.5)])
    motion = libloc.CircleMotion(
        center=(0, 0, 0), radius_m=CIRCLE_RADIUS_M, speed_mps=CIRCLE_RADIUS_M * angular
    )
    return motion, np.array(points)


def _look_at(random: libloc.Random) -> tuple[libloc.Motion, Floats]:
    low, high = np.array([3.5, -4.0, -0.5]), np.array([9.0, 4.0, 3.5])
    points = [[random.uniform(a, b) for a, b in zip(low, high, strict=True)] for _ in range(LOOK_AT_POINTS)]
    return libloc.LookAtMotion(_TIMES, _PLACES, _TARGETS), np.array(points)


def _camera_alone(world: World, seed: int) -> Simulated:
    random = libloc.Random(seed)
    if world.name == "circle":
        motion, points = _circle(random.fork(1))
        width, height = world.size_px or (320, 240)
        camera = _camera(width, height, world.focal_px or 195.0)
        camera.T_body_camera = _outward()
        duration_s = (CIRCLE_FRAMES - 0.5) / RATE_HZ
    else:
        motion, points = _look_at(random.fork(1))
        width, height = world.size_px or (640, 480)
        camera = _camera(width, height, world.focal_px or 450.0)
        duration_s = LOOK_AT_S
    model = libloc.CameraModel(
        rate_hz=RATE_HZ, sigma_px=world.sigma_px, border_px=0, max_features=0, min_separation_px=0
    )
    duration_s = min(duration_s, world.duration_s or duration_s)
    run = libloc.simulate_camera(motion, camera, libloc.Scene(points), random.fork(2), model, duration_s)
    truth = motion.sample(run.true_time_s)
    frames = np.arange(len(run.time_ns) + 1)
    return Simulated(
        Tracks(run.time_ns, np.searchsorted(run.frame, frames).astype(np.int64), run.feature, run.pixel_px),
        camera,
        run.time_ns,
        truth.q_world_body_wxyz,
        truth.position,
        truth.velocity,
        truth.angular_velocity,
        points,
    )


def _with_imu(world: World, seed: int) -> Simulated:
    scenario = libloc.Scenario(world.name, duration_s=world.duration_s or 30.0)
    for name, value in _AS_MODELLED.items():
        scenario.set(name, value)
    scenario.set("camera.sigma_px", world.sigma_px)
    simulated = libloc.simulate(scenario, seed)
    recording, truth = simulated.recording, simulated.truth
    features, imu = recording.features, recording.imu
    rows = np.searchsorted(truth.times_ns, features.times_ns)
    if not np.array_equal(truth.times_ns[rows], features.times_ns):
        raise ValueError("the truth is not known at the times of the frames")
    rig = scenario.rig()
    return Simulated(
        Tracks(features.times_ns, features.first, features.id, features.pixel_px),
        rig.cameras[0],
        features.times_ns,
        truth.q_world_body_wxyz[rows],
        truth.position[rows],
        truth.velocity[rows],
        truth.angular_velocity[rows],
        np.empty((0, 3)),
        Imu(imu.times_ns, imu.angular_velocity, imu.specific_force, rig.imu.noise),
    )


def spoil(tracks: Tracks, camera: libloc.CameraCalibration, how: str, seed: int) -> Tracks:
    """Tracks as a bad tracker or a bad line gives them. The first 2 s stay as they are.

    outliers: 10 % of the observations are anywhere in the picture. dropped: 20 % of the frames are missing.
    dark: no feature for 2 s, in the middle. "": as they are. Raises ValueError for another word.
    """
    if not how:
        return tracks
    rng = np.random.default_rng([seed, 7])
    times_s = (tracks.times_ns - tracks.times_ns[0]) * 1e-9
    late = times_s > 2.0
    if how == "outliers":
        wrong = (rng.random(len(tracks.id)) < 0.1) & np.repeat(late, np.diff(tracks.first))
        size = np.array([camera.width_px - 1.0, camera.height_px - 1.0])
        pixels = np.where(wrong[:, None], rng.random(tracks.pixel_px.shape) * size, tracks.pixel_px)
        return Tracks(tracks.times_ns, tracks.first, tracks.id, pixels)
    if how == "dropped":
        return tracks.of_frames(~late | (rng.random(len(late)) >= 0.2))
    if how == "dark":
        middle = times_s[-1] / 2
        return tracks.emptied((times_s >= middle - DARK_S / 2) & (times_s < middle + DARK_S / 2))
    raise ValueError(f"spoilt {how!r}: must be outliers, dropped or dark")


def simulate(world: World, seed: int) -> Simulated:
    """The same world and seed give the same numbers."""
    make = _camera_alone if world.name in ("look-at", "circle") else _with_imu
    simulated = make(world, seed)
    simulated.tracks = spoil(simulated.tracks, simulated.camera, world.spoilt, seed)
    return simulated
