"""The scripts behind tools/demo, and the options of the commands: what they refuse, right figures."""

import hashlib
import struct
import subprocess
import sys
import zipfile

import lcm
import loc
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support import CHECKOUT, to_wxyz

import libloc

sys.path.insert(0, str(CHECKOUT / "tools"))
import demo_data
import demo_report


def event(time_us: int, data: bytes = b"x") -> bytes:
    return struct.pack(">IqqII", 0xEDA1DA01, 0, time_us, 3, len(data)) + b"ABC" + data


def wheel_with(path, log: bytes, monkeypatch):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(demo_data.WHEEL_LOG, log)
    monkeypatch.setattr(demo_data, "WHEEL_SHA256", hashlib.sha256(path.read_bytes()).hexdigest())
    return path


def test_drive_is_cut_at_the_time(tmp_path, monkeypatch):
    kept = event(5_000_000) + event(5_000_000 + demo_data.DRIVE_SECONDS * 1_000_000)
    wheel = wheel_with(
        tmp_path / "w.whl", kept + event(5_000_001 + demo_data.DRIVE_SECONDS * 1_000_000), monkeypatch
    )
    demo_data.cut_drive(wheel, tmp_path / "out" / "drive.log")
    assert (tmp_path / "out" / "drive.log").read_bytes() == kept


@pytest.mark.parametrize("broken", [event(0) + event(1)[:-1], event(0) + b"\0" * 40, b""])
def test_broken_drive_is_refused(tmp_path, monkeypatch, broken):
    wheel = wheel_with(tmp_path / "w.whl", broken, monkeypatch)
    with pytest.raises(ValueError, match=r"in the middle of an event|no sync word"):
        demo_data.cut_drive(wheel, tmp_path / "drive.log")
    assert not (tmp_path / "drive.log").exists()


def test_wheel_with_another_checksum_is_removed(tmp_path):
    wheel = tmp_path / "w.whl"
    wheel.write_bytes(b"not the wheel")
    with pytest.raises(ValueError, match="SHA-256"):
        demo_data.cut_drive(wheel, tmp_path / "drive.log")
    assert not wheel.exists()


def test_generated_recording_agrees_with_its_truth(tmp_path):
    demo_data.generate(tmp_path / "made_up")
    folder = tmp_path / "made_up" / "mav0"
    imu = np.loadtxt(folder / "imu0" / "data.csv", delimiter=",", skiprows=1)
    truth = np.loadtxt(folder / "state_groundtruth_estimate0" / "data.csv", delimiter=",", skiprows=1)
    dt = 1 / demo_data.GENERATED_RATE_HZ
    rotation = Rotation.from_quat(truth[:, [5, 6, 7, 4]])
    rate = (rotation[:-1].inv() * rotation[1:]).as_rotvec() / dt
    sigma = demo_data.GYROSCOPE_NOISE / dt**0.5
    np.testing.assert_allclose((imu[1:, 1:4] - rate).mean(axis=0), demo_data.GYROSCOPE_BIAS, atol=sigma / 30)
    np.testing.assert_allclose((imu[1:, 1:4] - rate).std(axis=0), sigma, rtol=0.03)
    acceleration = np.gradient(truth[:, 8:11], dt, axis=0)
    force = rotation.inv().apply(acceleration + demo_data.GRAVITY)
    sigma = demo_data.ACCELEROMETER_NOISE / dt**0.5
    np.testing.assert_allclose(
        (imu[:, 4:7] - force).mean(axis=0), demo_data.ACCELEROMETER_BIAS, atol=sigma / 20
    )


def test_errors_are_those_of_the_library():
    rng = np.random.default_rng(3)
    reference = Rotation.random(500, random_state=4)
    estimate = reference * Rotation.from_rotvec(rng.normal(0, 0.1, (500, 3)))
    heading, inclination = demo_report.errors(to_wxyz(estimate), to_wxyz(reference))
    error = libloc.orientation_error(to_wxyz(estimate), to_wxyz(reference))
    np.testing.assert_allclose(inclination, error.inclination, atol=1e-7)
    wrapped = (heading + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(np.abs(wrapped), np.abs(error.heading), atol=1e-12)


def write_log(path, orientations, *, publish_time_ns=0, imu_count=None):
    log = lcm.EventLog(str(path), "w", overwrite=True)
    for k, q in enumerate(orientations):
        message = loc.estimate_t()
        message.time_ns, message.publish_time_ns, message.method = (
            k * 10_000_000,
            publish_time_ns + k,
            "madgwick",
        )
        message.valid, message.q_world_body_wxyz = loc.estimate_t.VALID_ORIENTATION, q
        log.write_event(k, "LOC_ESTIMATE", message.encode())
        log.write_event(k, "LOC_IMU", loc.imu_t().encode())
    status = loc.source_status_t()
    status.streams, status.stream_name = 1, ["imu"]
    status.published = [len(orientations) if imu_count is None else imu_count]
    log.write_event(99, "LOC_SOURCE_STATUS", status.encode())
    log.close()
    return demo_report.read(path)


def test_replay_is_compared_bit_for_bit(tmp_path):
    orientations = to_wxyz(Rotation.random(5, random_state=1))
    live = write_log(tmp_path / "live.log", orientations)
    again = write_log(tmp_path / "again.log", orientations, publish_time_ns=12345)
    assert "all 5 estimates" in demo_report.check_replay(live, again)
    orientations[3, 2] = np.nextafter(orientations[3, 2], 1)
    other = write_log(tmp_path / "other.log", orientations)
    with pytest.raises(demo_report.ReportError, match="estimate 3"):
        demo_report.check_replay(live, other)
    with pytest.raises(demo_report.ReportError, match="4 replayed"):
        demo_report.check_replay(live, write_log(tmp_path / "short.log", orientations[:4]))
    with pytest.raises(demo_report.ReportError, match="6 IMU samples, 5 were logged"):
        demo_report.check_replay(write_log(tmp_path / "lost.log", orientations, imu_count=6), live)


@pytest.mark.parametrize(
    ("command", "code", "says"),
    [
        (["setup"], 2, "tools/setup demo"),
        (["setup", "everything"], 2, "tools/setup demo"),
        (["demo", "--nonsense"], 1, "--nonsense: no such option"),
        (["demo", "nowhere"], 1, "nowhere: no folder in the EuRoC layout"),
        (["test", "--nonsense"], 1, "--nonsense: no such option"),
        (["test", "--help"], 0, "--no-sanitize"),
        (["demo", "--help"], 0, "--street"),
    ],
)
def test_options_of_the_commands(command, code, says, tmp_path):
    ran = subprocess.run(
        [CHECKOUT / "tools" / command[0], *command[1:]],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert ran.returncode == code, ran.stdout + ran.stderr
    assert says in ran.stdout + ran.stderr


def test_set_up_names_what_is_missing(tmp_path):
    """With an empty place for the Python environment, which --check must not fill."""
    ran = subprocess.run(
        [CHECKOUT / "tools" / "setup", "--check", "demo"],
        env={"PATH": "/usr/bin:/bin", "LIBLOC_VENV": str(tmp_path / "none")},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert ran.returncode == 1
    assert f"Python environment missing or out of date: {tmp_path / 'none'}" in ran.stdout
    assert not (tmp_path / "none").exists()
