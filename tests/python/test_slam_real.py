"""SLAM on real tracks, EuRoC V1_01, by evo; the figures are those that compare_slam.py demands."""

import subprocess
import sys

import pytest
from support import CHECKOUT, data_folder

import libloc

sys.path.insert(0, str(CHECKOUT / "tests/bench"))
import compare_slam
import peer_eqvio


@pytest.fixture(scope="module")
def data():
    pytest.importorskip("evo")
    return compare_slam.read_data(data_folder("euroc-v101-tracks"))


def accuracy(data, motion):
    tracks, truth = data
    run, _ = compare_slam.run_library(tracks, compare_slam.options_of(tracks, motion), 1)
    result = compare_slam.accuracy_of(compare_slam.trajectory_of(run), truth)
    assert result.poses >= len(tracks.features.times_ns) - 1
    assert result.libloc_ate_m == pytest.approx(result.ate_m, abs=1e-9)
    return result


def test_sigma_is_the_files(data):
    assert data[0].sigma_px == pytest.approx(1.93, abs=0.005)


def test_with_imu(data):
    result = accuracy(data, libloc.SlamMotion.INERTIAL)
    assert result.ate_m <= 0.025
    assert result.scale == pytest.approx(1, abs=0.003)


def test_camera_alone(data):
    result = accuracy(data, libloc.SlamMotion.CONSTANT_VELOCITY)
    assert result.sim3_ate_m <= 0.06


def test_a_part_begins_where_it_should(data):
    part, whole = data[0].after(6), data[0]
    f = part.features
    assert f.times_ns[0] - whole.features.times_ns[0] == 6_000_000_000
    assert part.imu.times_ns[0] == f.times_ns[0]
    assert len(f.first) == len(f.times_ns) + 1
    assert (f.first[0], f.first[-1]) == (0, len(f.id))
    assert (
        f.id[: f.first[1]] == whole.features.id[whole.features.first[120] : whole.features.first[121]]
    ).all()


def test_no_data(tmp_path):
    pytest.importorskip("evo")
    script = CHECKOUT / "tests/bench/compare_slam.py"
    run = subprocess.run(
        [sys.executable, script, "--data", tmp_path], capture_output=True, text=True, check=False
    )
    assert run.returncode == 1
    assert str(tmp_path / "tracks_and_imu.csv") in run.stderr


def test_the_peer_gets_the_same(data):
    for begin_s in (0, 6):
        peer, ours = peer_eqvio.read(data[0].path, begin_s), data[0].after(begin_s)
        assert [len(frame.features) for frame in peer.frames] == list(
            ours.features.first[1:] - ours.features.first[:-1]
        )
        assert [gyro for _, gyro, _ in peer.imu] == ours.imu.angular_velocity.tolist()
        assert [force for _, _, force in peer.imu] == ours.imu.specific_force.tolist()
