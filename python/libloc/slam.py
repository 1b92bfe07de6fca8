"""A whole recording through MonoSlam or InertialSlam in one call."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from libloc._core import (
    AnchoredRun,
    FeaturesArrays,
    GpsArrays,
    ImuArrays,
    InertialSlam,
    MapAnchorOptions,
    MeasurementSource,
    MonoSlam,
    Recording,
    Rig,
    SlamMotion,
    SlamOptions,
    SlamRun,
    SlamSnapshot,
    TriadCalibration,
    anchor_run,
)
from libloc.recordings import read_recording


@dataclass
class FrameFeatures:
    """Features of N frames, like Recording.features: those of frame i are rows first[i]:first[i + 1]."""

    times_ns: NDArray[np.int64]  # (N,)
    camera: NDArray[np.int32]  # (N,)
    sigma_px: NDArray[np.float64]  # (N,), NaN when unknown
    first: NDArray[np.int64]  # (N + 1,)
    id: NDArray[np.int64]  # (M,)
    pixel_px: NDArray[np.float64]  # (M, 2)


def features_of_frames(
    frame: NDArray[np.int64],
    feature: NDArray[np.int64],
    pixel_px: NDArray[np.float64],
    times_ns: NDArray[np.int64],
    *,
    sigma_px: float = float("nan"),
    camera: int = 0,
) -> FrameFeatures:
    """From lists as simulate_camera() gives them: frame (M,) is a row of times_ns (N,), in ascending order.

    Raises ValueError for frames that do not ascend or have no time.
    """
    frame = np.asarray(frame, dtype=np.int64)
    times_ns = np.ascontiguousarray(times_ns, dtype=np.int64)
    if len(frame) and (np.any(np.diff(frame) < 0) or frame[0] < 0 or frame[-1] >= len(times_ns)):
        raise ValueError(f"frame: must ascend from 0 to {len(times_ns) - 1}, the last of times_ns")
    return FrameFeatures(
        times_ns=times_ns,
        camera=np.full(len(times_ns), camera, dtype=np.int32),
        sigma_px=np.full(len(times_ns), sigma_px),
        first=np.searchsorted(frame, np.arange(len(times_ns) + 1)).astype(np.int64),
        id=np.ascontiguousarray(feature, dtype=np.int64),
        pixel_px=np.ascontiguousarray(pixel_px, dtype=np.float64),
    )


def features_of_tracks(
    frame: NDArray[np.int64],
    feature: NDArray[np.int64],
    pixel_px: NDArray[np.float64],
    *,
    rate_hz: float,
    start_time_ns: int = 0,
    sigma_px: float = float("nan"),
    camera: int = 0,
) -> FrameFeatures:
    """From what read_tracks() gives: frame k was taken at start + k / rate_hz."""
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise ValueError(f"rate_hz = {rate_hz}: must be positive and finite")
    frames, row = np.unique(frame, return_inverse=True)
    times_ns = start_time_ns + np.rint(frames / rate_hz * 1e9).astype(np.int64)
    return features_of_frames(row, feature, pixel_px, times_ns, sigma_px=sigma_px, camera=camera)


def _applied(calibration: TriadCalibration, raw: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.ascontiguousarray((raw - calibration.bias) @ calibration.matrix.T)


def run_slam(
    recording: Recording | FeaturesArrays | FrameFeatures | MeasurementSource | str | PathLike[str],
    options: SlamOptions,
    *,
    imu: ImuArrays | None = None,
    rig: Rig | None = None,
    start_from: SlamSnapshot | None = None,
    progress: Callable[[int, int], bool | None] | None = None,
    with_covariance: bool = True,
    with_features: bool = False,
) -> SlamRun:
    """Runs the estimator that options.motion names over a recording; other cameras' frames are passed over.

    imu: in place of the recording's. rig: its calibration is applied to the IMU. start_from: goes on from
    there, see restore(). progress(frames done, frames in all) is called a few times in a second; when it
    returns False the run ends, with what there is. Raises ValueError when the recording lacks what the
    estimator needs; DataError when it cannot be read.
    """
    if isinstance(recording, MeasurementSource):
        recording = recording.read_all()
    elif isinstance(recording, (str, PathLike)):
        recording = read_recording(recording)
    features = recording.features if isinstance(recording, Recording) else recording
    if not np.any(np.asarray(features.camera) == options.camera_index):
        raise ValueError(f"the recording has no features of camera {options.camera_index}")
    frames = (features.times_ns, features.first, features.id, features.pixel_px)
    settings = {
        "camera": features.camera,
        "sigma_px": features.sigma_px,
        "progress": progress,
        "with_covariance": with_covariance,
        "with_features": with_features,
    }
    if options.motion == SlamMotion.CONSTANT_VELOCITY:
        mono = MonoSlam(options)
        if start_from is not None:
            mono.restore(start_from)
        return mono.run(*frames, **settings)
    if imu is None and isinstance(recording, Recording):
        imu = recording.imu
    if imu is None or len(imu.times_ns) == 0:
        raise ValueError("the recording has no IMU samples, which InertialSlam needs")
    gyro, force = imu.angular_velocity, imu.specific_force
    if rig is not None and rig.imu is not None:
        gyro, force = _applied(rig.imu.gyroscope, gyro), _applied(rig.imu.accelerometer, force)
    inertial = InertialSlam(options)
    if start_from is not None:
        inertial.restore(start_from)
    return inertial.run(*frames, imu.times_ns, gyro, force, finish=True, **settings)


def anchor_slam(
    run: SlamRun,
    gps: GpsArrays,
    options: MapAnchorOptions | None = None,
    *,
    inertial: bool = True,
    rig: Rig | None = None,
) -> AnchoredRun:
    """Puts a run of SLAM on the Earth, as loc-estimator does it: position, heading and, for a camera alone
    (inertial=False), scale and tilt of its map by the fixes of a recording (Recording.gps).

    rig: lever arm of the antenna and offset of its clock (t_imu = t_gps + offset).
    """
    options = MapAnchorOptions(inertial) if options is None else copy.copy(options)
    times_ns = gps.times_ns
    if rig is not None and rig.gps is not None:
        options.gps_antenna = rig.gps.antenna_in_body
        times_ns = times_ns + round(rig.gps.time_offset_s * 1e9)
        if np.isfinite(rig.gps.time_offset_sigma_s):
            options.gps_time_sigma = rig.gps.time_offset_sigma_s
    return anchor_run(
        run,
        times_ns,
        gps.latitude_longitude_altitude,
        options,
        position_cov=gps.position_cov,
        velocity_enu=gps.velocity_enu,
        velocity_cov=gps.velocity_cov,
        fix=gps.fix,
    )
