"""A rig of cameras and IMU that is waved before a checkerboard: its recording, with the truth."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import libloc

START_NS = 1_700_000_000_000_000_000
IMU_HEADING = "time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2"


def a_camera(name: str = "cam0", scale: float = 1.0) -> libloc.CameraCalibration:
    c = libloc.CameraCalibration()
    c.name, c.width_px, c.height_px, c.rate_hz = name, int(640 * scale), int(400 * scale), 20
    c.intrinsics_px = np.array([400, 401, 322, 197]) * scale
    c.distortion_model = libloc.DistortionModel.RADTAN
    c.distortion = [-0.25, 0.06, 2e-4, -1e-4]
    quality = libloc.IntrinsicsQuality()
    quality.method, quality.pictures = "target", 100
    quality.intrinsics_sigma_px, quality.distortion_sigma = np.zeros(4), np.zeros(4)
    c.intrinsics_quality = quality
    return c


def _euler(phi: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """R = Rz Ry Rx and S with ω = S φ' in body."""
    (sx, sy, sz), (cx, cy, cz) = np.sin(phi), np.cos(phi)
    R = np.array(
        [
            [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
            [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
            [-sy, cy * sx, cy * cx],
        ]
    )
    return R, np.array([[1, 0, -sy], [0, cx, sx * cy], [0, -sx, cx * cy]])


@dataclass
class Waved:
    """The rig's motion is a sum of sines; the board leans against the vertical."""

    seconds: float = 12.0
    imu_hz: float = 200.0
    camera_hz: float = 10.0
    time_offset_s: float = 0.0123  # t_imu = t_camera + d
    turning: tuple[float, float, float] = (1.0, 1.0, 1.0)
    cameras: list[libloc.CameraCalibration] = field(default_factory=lambda: [a_camera()])
    corner_sigma_px: float = 0.2
    distance: float = 0.75  # of the board [m]
    board: str = "checkerboard 9x6 0.06"
    seed: int = 1

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        self._rng = rng
        self._rate = 2 * np.pi * (0.25 + 0.45 * np.arange(3) + 0.15 * rng.random((6, 3)))
        size = np.array([*(0.72 * np.array(self.turning)), 0.25, 0.25, 0.25])
        self._size = size[:, None] / self._rate / np.sqrt(3)
        self._phase = 2 * np.pi * rng.random((6, 3))
        self.target = libloc.CalibrationTarget(self.board)
        self.points = np.asarray(self.target.corners())
        leaning = libloc.Pose3(libloc.so3.exp([0.3, 0.2, 0])).matrix()[:3, :3]
        self.gravity_target = leaning @ [0, -9.80665, 0]
        R = libloc.so3.exp([0.1, -1.4, 0.3])
        first = libloc.Pose3(R, [0.05, -0.03, 0.02])
        self.T_camera_imu = [libloc.Pose3([1, 0, 0, 0], [-0.08 * i, 0, 0]) * first for i in range(2)]
        self._imu()

    def motion(self, t: float) -> tuple[libloc.Pose3, NDArray[np.float64], NDArray[np.float64]]:
        """T_target_imu, angular velocity in the IMU, acceleration in target."""
        angle = self._rate * t + self._phase
        x = (self._size * np.sin(angle)).sum(1)
        v = (self._size * self._rate * np.cos(angle)).sum(1)
        a = -(self._size * self._rate**2 * np.sin(angle)).sum(1)
        R, S = _euler(x[:3])
        looking = np.diag([1.0, -1.0, -1.0])
        R_ci = self.T_camera_imu[0].matrix()[:3, :3]
        T = np.eye(4)
        T[:3, :3] = looking @ R @ R_ci
        T[:3, 3] = self.points.mean(0) + x[3:]
        T[2, 3] += self.distance
        return libloc.Pose3.from_matrix(T), R_ci.T @ (S @ v[:3]), a[3:]

    def _imu(self) -> None:
        noise = libloc.ImuNoise()
        n = int(self.seconds * self.imu_hz)
        t = np.arange(n) / self.imu_hz
        self.imu_times_ns = START_NS + np.round(t * 1e9).astype(np.int64)
        self.angular_velocity = np.empty((n, 3))
        self.specific_force = np.empty((n, 3))
        root = np.sqrt(self.imu_hz)
        for i in range(n):
            T, rate, acceleration = self.motion(t[i])
            self.angular_velocity[i] = rate
            self.specific_force[i] = T.matrix()[:3, :3].T @ (acceleration - self.gravity_target)
        self.angular_velocity += [0.01, -0.02, 0.005]
        self.specific_force += [0.05, -0.1, 0.02]
        self.angular_velocity += noise.gyroscope_noise_density * root * self._rng.standard_normal((n, 3))
        self.specific_force += noise.accelerometer_noise_density * root * self._rng.standard_normal((n, 3))

    def picture_times(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """On the IMU's clock [s since START_NS], and the stamps of the camera's clock."""
        t = 0.5 + np.arange(int((self.seconds - 1) * self.camera_hz)) / self.camera_hz
        return t, START_NS + np.round((t - self.time_offset_s) * 1e9).astype(np.int64)

    def camera_pose(self, t: float, camera: int = 0) -> libloc.Pose3:
        """T_target_camera"""
        return self.motion(t)[0] * self.T_camera_imu[camera].inverse()

    def views(self, camera: int = 0) -> list[libloc.TargetView]:
        calibration = self.cameras[camera]
        model = libloc.Camera(calibration)
        out = []
        for t, stamp in zip(*self.picture_times(), strict=True):
            T = self.camera_pose(t, camera).inverse().matrix()
            pixels = np.asarray(model.project(np.ascontiguousarray(self.points @ T[:3, :3].T + T[:3, 3])))
            size = np.array([calibration.width_px, calibration.height_px])
            seen = np.isfinite(pixels).all(1) & (pixels > 5).all(1) & (pixels < size - 5).all(1)
            pixels = pixels + self.corner_sigma_px * self._rng.standard_normal(pixels.shape)
            out.append(libloc.TargetView(np.flatnonzero(seen), pixels[seen].copy(), int(stamp)))
        return out

    def renderings(self, camera: int = 0) -> list[NDArray[np.uint8]]:
        target = self.target
        scene = libloc.checkerboard(columns=target.columns, rows=target.rows, square_m=target.size_m)
        renderer = libloc.SceneRenderer(scene, self.cameras[camera], noise_sigma=2.0)
        random = libloc.Random(self.seed)
        return [renderer.render(self.camera_pose(t, camera), random) for t in self.picture_times()[0]]

    def rig(self) -> libloc.Rig:
        """Before the calibration: nothing is known of where the cameras sit."""
        rig = libloc.Rig()
        rig.cameras = self.cameras
        imu = libloc.ImuCalibration()
        imu.rate_hz = self.imu_hz
        rig.imu = imu
        return rig

    def off_by_sigmas(self, found: libloc.CameraCalibration, camera: int = 0) -> NDArray[np.float64]:
        """Rotation, translation, offset of a rig's camera, each over its deviation there."""
        truth = self.T_camera_imu[camera].inverse()
        quality = found.mounting_quality
        assert quality is not None
        turn = libloc.Pose3(found.T_body_camera.rotation_wxyz).boxminus(libloc.Pose3(truth.rotation_wxyz))[3:]
        turn_body = found.T_body_camera.matrix()[:3, :3] @ turn  # about the body's axes
        return np.array(
            [
                *(turn_body / quality.rotation_sigma),
                *((found.T_body_camera.translation - truth.translation) / quality.translation_sigma),
                (found.time_offset_s - self.time_offset_s) / quality.time_offset_sigma_s,
            ]
        )


def imu_rows(rig: Waved, unit: float = 1.0) -> list[str]:
    """Lines of a CSV; unit: of the turn rates, so many in a rad/s."""
    readings = np.hstack([rig.angular_velocity * unit, rig.specific_force]).tolist()
    return [f"{t}," + ",".join(map(repr, row)) for t, row in zip(rig.imu_times_ns, readings, strict=True)]


def write_imu(path: Path, rig: Waved, heading: str = IMU_HEADING, unit: float = 1.0) -> Path:
    path.write_text("\n".join([heading, *imu_rows(rig, unit)]) + "\n")
    return path


def write_corners(path: Path, rig: Waved, camera: int = 0) -> Path:
    lines = ["timestamp_ns,corner_id,u_px,v_px"]
    for view in rig.views(camera):
        lines += [
            f"{view.time_ns},{i},{u!r},{v!r}"
            for i, (u, v) in zip(view.ids, view.pixels_px.tolist(), strict=True)
        ]
    path.write_text("\n".join(lines) + "\n")
    return path
