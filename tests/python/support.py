"""A small recording with known truth, and where real ones are."""

import os
from dataclasses import dataclass
from pathlib import Path

import loc
import numpy as np
import pytest
from libloc.lcm_log import LogWriter
from scipy.spatial.transform import Rotation

CHECKOUT = Path(__file__).resolve().parents[2]
GRAVITY = 9.80665
FIELD_ENU = np.array([0.0, 20e-6, -44e-6])  # [T], dip 65.6 deg


def data_folder(name: str) -> Path:
    """A folder of real recordings; skips the test when it is absent."""
    folder = Path(os.environ.get("LIBLOC_DATA", CHECKOUT.parent / "shared" / "data")) / name
    if not folder.is_dir():
        pytest.skip(f"no recordings in {folder} (set LIBLOC_DATA)")
    return folder


def built_program(name: str) -> Path:
    """One of the C++ programs, from the build folder LIBLOC_BUILD; skips the test without it."""
    if "LIBLOC_BUILD" not in os.environ:
        pytest.skip("LIBLOC_BUILD, the build folder of the C++ programs, is not set")
    program = Path(os.environ["LIBLOC_BUILD"]) / "tools" / name
    assert program.is_file(), program
    return program


def to_scipy(q_wxyz: np.ndarray) -> Rotation:
    return Rotation.from_quat(np.roll(np.asarray(q_wxyz), -1, axis=-1))


def to_wxyz(rotation: Rotation) -> np.ndarray:
    return np.ascontiguousarray(np.roll(rotation.as_quat(), 1, axis=-1))


@dataclass
class Recording:
    times_ns: np.ndarray
    gyro: np.ndarray  # [rad/s]
    force: np.ndarray  # [m/s^2]
    field: np.ndarray  # [T]
    q_true_wxyz: np.ndarray


def turning_body(count: int, rate_hz: float = 200.0, seed: int = 1, noise: float = 1.0) -> Recording:
    """A body that turns about changing axes without accelerating; world is ENU.

    gyro[i] is the mean rate from sample i-1 to sample i, so that its integral is exact.
    """
    rng = np.random.default_rng(seed)
    dt = 1 / rate_hz
    t = np.arange(count) * dt
    angles = np.stack([1.2 * np.sin(0.7 * t), 0.8 * np.sin(0.5 * t + 1), 2.0 * np.sin(0.3 * t + 2)], axis=1)
    rotation = Rotation.from_euler("xyz", angles)
    gyro = np.zeros((count, 3))
    gyro[1:] = (rotation[:-1].inv() * rotation[1:]).as_rotvec() / dt
    force = rotation.inv().apply([0, 0, GRAVITY])
    field = rotation.inv().apply(FIELD_ENU)
    gyro += noise * 2e-3 * rng.normal(size=gyro.shape)
    force += noise * 2e-2 * rng.normal(size=force.shape)
    field += noise * 2e-7 * rng.normal(size=field.shape)
    times_ns = np.rint(t * 1e9).astype(np.int64) + 1_700_000_000_000_000_000
    return Recording(times_ns, gyro, force, field, to_wxyz(rotation))


def write_csv(path: Path, r: Recording) -> None:
    """The recording in libloc's CSV form, with the truth as reference."""
    lines = ["time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2,mx_ut,my_ut,mz_ut,qw,qx,qy,qz"]
    for i, time_ns in enumerate(r.times_ns):
        values = [*r.gyro[i], *r.force[i], *(r.field[i] * 1e6), *r.q_true_wxyz[i]]
        lines.append(f"{time_ns}," + ",".join(repr(float(v)) for v in values))
    path.write_text("\n".join(lines) + "\n")


def write_log(
    path: Path,
    r: Recording,
    q_estimate: np.ndarray,
    valid: int | np.ndarray = loc.estimate_t.VALID_ORIENTATION | loc.estimate_t.VALID_HEADING,
    world: str = "ENU",
    reference: bool = True,
) -> None:
    """An LCM log as loc-live makes it: IMU, estimates (orientation only) and the truth."""
    nan3 = [float("nan")] * 3
    valid_bits = np.broadcast_to(valid, len(r.times_ns))
    with LogWriter(path) as log:
        for i, time_ns in enumerate(int(t) for t in r.times_ns):
            imu, estimate, truth = loc.imu_t(), loc.estimate_t(), loc.reference_t()
            for m in (imu, estimate, truth):
                m.time_ns, m.host_time_ns, m.sequence = time_ns, time_ns, i
            imu.angular_velocity, imu.specific_force = list(r.gyro[i]), list(r.force[i])
            estimate.method, estimate.world = "madgwick", world
            estimate.valid = int(valid_bits[i])
            estimate.q_world_body_wxyz = list(q_estimate[i])
            estimate.position = estimate.velocity = nan3
            truth.q_world_body_wxyz, truth.position, truth.velocity = list(r.q_true_wxyz[i]), nan3, nan3
            truth.score = True
            log.write("LOC_IMU", imu, time_ns // 1000)
            log.write("LOC_ESTIMATE", estimate, time_ns // 1000)
            if reference:
                log.write("LOC_REFERENCE", truth, time_ns // 1000)
