"""Where a camera sits on an IMU, and how much their clocks differ, from a target waved in front of the rig.

    python 05_camera_imu_calibration.py [CORNERS.csv IMU.csv --target "aprilgrid 6x6 0.088 0.3"
                                         --rig rig.yaml] [--output DIR]

CORNERS.csv: timestamp_ns,id,u_px,v_px, rows of one picture together (id as CalibrationTarget counts
corners); IMU.csv: as 01_orientation.py reads it; rig.yaml: its first camera's intrinsics, its IMU's noise.
Without files a rig is waved in NumPy, and the result is compared with the truth. Writes camera_imu.png. The
program for daily use, with units, reports and live guidance: loc-calibrate camera-imu.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from libloc.programs.calibrate_plots_camera_imu import plot_deviations

import libloc

TRUTH = libloc.Pose3.exp([0.05, -0.03, 0.02, 0.1, -1.4, 0.3])  # T_camera_imu
OFFSET_S = 0.0123  # t_imu = t_camera + offset
GRAVITY = np.array([1.9, -9.2, 2.8]) * 9.80665 / np.linalg.norm([1.9, -9.2, 2.8])  # in target


def motion(t: np.ndarray) -> tuple[np.ndarray, ...]:
    """R_target_camera (N, 3, 3), turn rate of the camera; place and acceleration of the IMU in target."""
    rate = 2 * np.pi * np.array([[0.3, 0.7, 1.2], [0.35, 0.8, 1.1], [0.28, 0.75, 1.3]])
    phase = np.array([[0.0, 1.0, 2.0], [0.5, 2.5, 4.0], [3.0, 0.7, 5.0]])
    angle = t[:, None, None] * rate + phase
    a, da = (0.4 / rate * np.sin(angle)).sum(2), (0.4 * np.cos(angle)).sum(2)
    angle = t[:, None, None] * rate[::-1] + phase.T
    place = np.array([0.16, 0.1, 0.6]) + (0.15 / rate[::-1] * np.sin(angle)).sum(2)
    acceleration = (-0.15 * rate[::-1] * np.sin(angle)).sum(2)
    (sx, sy, sz), (cx, cy, cz) = np.sin(a).T, np.cos(a).T
    rows = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    rotation = np.diag([1.0, -1, -1]) @ np.moveaxis(np.array(rows), 2, 0)
    x, y, z = da.T
    return (
        rotation,
        np.stack([x - sy * z, cx * y + sx * cy * z, -sx * y + cx * cy * z], 1),
        place,
        acceleration,
    )


def waved_rig(seconds: float = 30) -> tuple:
    """Target, recording of the camera and readings of the IMU with the noise of a cheap one."""
    random, noise = np.random.default_rng(1), libloc.ImuNoise()
    target = libloc.CalibrationTarget("checkerboard 9x6 0.04")
    camera = libloc.CameraCalibration()
    camera.name, camera.width_px, camera.height_px, camera.rate_hz = "cam0", 752, 480, 20
    camera.intrinsics_px = [458.7, 457.3, 367.2, 248.4]
    T = np.asarray(TRUTH.matrix())
    t = np.arange(0, seconds, 0.005)
    rotation, rate, _, acceleration = motion(t)
    per_sample = np.sqrt(200)
    gyro = rate @ T[:3, :3] + np.array([0.01, -0.02, 0.005])
    gyro = gyro + noise.gyroscope_noise_density * per_sample * random.normal(size=gyro.shape)
    force = np.einsum("nji,nj->ni", rotation @ T[:3, :3], acceleration - GRAVITY)
    force = force + np.array([0.1, 0.05, -0.1])
    force = force + noise.accelerometer_noise_density * per_sample * random.normal(size=force.shape)
    views = []
    for time in np.arange(0.5, seconds - 0.5, 0.05):
        (R,), _, (place,), _ = motion(np.array([time]))
        # The IMU is at place; the camera sees the board from T_camera_imu's other end.
        points = (target.corners() - place) @ R + T[:3, 3]
        pixels = libloc.Camera(camera).project(points)
        seen = np.flatnonzero(np.isfinite(pixels).all(axis=1) & libloc.Camera(camera).in_image(pixels, 5.0))
        found = pixels[seen] + 0.3 * random.normal(size=(len(seen), 2))
        views.append(libloc.TargetView(seen, found, round((1000 + time - OFFSET_S) * 1e9)))
    stamps = np.round((1000 + t) * 1e9).astype(np.int64)
    return target, libloc.CameraRecording(camera, views), stamps, gyro, force


def read(options: argparse.Namespace) -> tuple:
    stamps = np.loadtxt(options.files[0], delimiter=",", skiprows=1, usecols=0, dtype=np.int64)
    rows = np.loadtxt(options.files[0], delimiter=",", skiprows=1, usecols=(1, 2, 3))
    views = [
        libloc.TargetView(rows[part, 0].astype(np.int64), rows[part, 1:].copy(), int(stamps[part[0]]))
        for part in np.split(np.arange(len(stamps)), np.flatnonzero(np.diff(stamps)) + 1)
    ]
    imu = libloc.read_recording(options.files[1]).imu
    rig = libloc.read_rig(options.rig)
    if not rig.cameras:
        raise ValueError(f"{options.rig}: no camera in it")
    recording = libloc.CameraRecording(rig.cameras[0], views)
    target = libloc.CalibrationTarget(options.target)
    return (
        target,
        recording,
        imu.times_ns,
        imu.angular_velocity,
        imu.specific_force,
        rig.imu and rig.imu.noise,
    )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", type=Path, nargs="*", help="CORNERS.csv IMU.csv")
    parser.add_argument("--target", default="aprilgrid 6x6 0.088 0.3")
    parser.add_argument("--rig", type=Path, help="rig.yaml with the camera's intrinsics")
    parser.add_argument("--output", type=Path, default=Path(), help="folder for camera_imu.png")
    options = parser.parse_args()
    if options.files and (len(options.files) != 2 or options.rig is None):
        parser.error("CORNERS.csv, IMU.csv and --rig are needed together")
    try:
        target, recording, *imu = read(options) if options.files else waved_rig()
        fit = libloc.calibrate_camera_imu(target, [recording], *imu)
    except (libloc.DataError, OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    camera = fit.cameras[0]
    print(f"verdict: {fit.quality.verdict.name.lower()}")
    for reason in fit.quality.reasons:
        print(f"  {reason}")
    for axis, value, sigma in zip("xyz", camera.T_camera_imu.translation, camera.sigma[3:6], strict=True):
        print(f"  T_camera_imu {axis}: {1e3 * value:.2f} +- {1e3 * sigma:.2f} mm")
    print(f"  offset: {1e6 * camera.time_offset_s:.1f} +- {1e6 * camera.sigma[6]:.1f} us")
    if not options.files:
        wrong = TRUTH.inverse() * camera.T_camera_imu
        translation = np.subtract(camera.T_camera_imu.translation, TRUTH.translation)
        turn = 2 * np.linalg.norm(wrong.rotation_wxyz[1:])
        print(f"error of the turn: {np.degrees(turn):.4f} deg")
        print(f"error of the translation: {1e3 * np.linalg.norm(translation):.3f} mm")
        print(f"error of the offset: {1e6 * abs(camera.time_offset_s - OFFSET_S):.1f} us")
    options.output.mkdir(parents=True, exist_ok=True)
    plot_deviations(fit).savefig(options.output / "camera_imu.png", dpi=110)
    print(f"wrote {options.output / 'camera_imu.png'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
