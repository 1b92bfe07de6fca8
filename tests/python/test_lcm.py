"""The LCM types in Python and logs of them."""

import struct

import lcm
import loc
import numpy as np
import pytest
from libloc.lcm_log import LogReader, LogWriter

import libloc
from libloc import DataError

# Frozen: a type that changes gets another name, or old logs and programs are not understood any more.
FINGERPRINTS = {
    "clock_t": 0xAFBC08EC99F516DB,
    "estimate_t": 0xA4E5476EEF3B739B,
    "fusion_t": 0x50F7EE53CE7E222D,
    "gps_fix_t": 0x64D7E0398F38FE74,
    "image_t": 0xCA5A4D4CB4B858C2,
    "imu_t": 0x6E15AF9AA7F2F0BD,
    "magnetometer_t": 0x939B1E83F8A696D2,
    "map_points_t": 0xCFF528AC74639D5F,
    "odometry_t": 0x1157247BDAE507A3,
    "reference_t": 0x120581A61696AE36,
    "slam_frame_t": 0x494BFFF77A74F59A,
    "slam_state_t": 0x179AA043B2BA5005,
    "source_status_t": 0xD63AB9362BC56F14,
    "estimator_status_t": 0xFE8191C6F75D653B,
    "statistics_t": 0x2F2B80D43DC8BFD9,
    "tracks_t": 0x950A197598A1B7D6,
}
TYPES = sorted(libloc.message_fingerprints())


def imu(i: int) -> loc.imu_t:
    m = loc.imu_t()
    m.time_ns, m.host_time_ns, m.sequence = 1000 * i, 1000 * i + 5, i
    m.angular_velocity, m.specific_force = [0.1 * i, 2, 3], [4, 5, 9.81]
    return m


def test_fingerprints_are_pinned_and_the_same_in_python_and_cpp():
    python = {name: struct.unpack(">Q", getattr(loc, name)._get_packed_fingerprint())[0] for name in TYPES}
    assert python == libloc.message_fingerprints()
    assert python == FINGERPRINTS


@pytest.mark.parametrize("name", TYPES)
def test_every_type_is_recognised_and_packed_alike(name):
    message = getattr(loc, name)()
    assert libloc.message_type(message.encode()) == name
    with pytest.raises(DataError, match=name):
        libloc.message_type(message.encode() + b"\0")
    with pytest.raises(DataError, match=name):
        libloc.message_type(message.encode()[:-1])


def test_other_types_are_not_ours():
    assert libloc.message_type(b"") is None
    assert libloc.message_type(b"\1\2\3\4\5\6\7\x08rest") is None


def test_log_round_trip(tmp_path):
    path = tmp_path / "a.lcm"
    statistics = loc.statistics_t()
    statistics.program, statistics.size, statistics.name, statistics.value = "test", 2, ["a", "b"], [1.5, -2]
    with LogWriter(path) as log:
        for i in range(10):
            log.write("LOC_IMU", imu(i), log_time_us=i)
        log.write("LOC_STATISTICS", statistics, log_time_us=11)
    log = LogReader(path)
    messages = list(log)
    assert [m.channel for m in messages] == ["LOC_IMU"] * 10 + ["LOC_STATISTICS"]
    assert messages[3].message.angular_velocity == (0.1 * 3, 2, 3)
    assert messages[3].log_time_us == 3
    assert messages[10].message.name == ["a", "b"]
    assert (log.skipped, log.damage) == ({}, {})
    assert len(list(LogReader(path, channels=["LOC_STATISTICS"]))) == 1

    # The same through PyPI's lcm alone.
    events = list(lcm.EventLog(str(path), "r"))
    assert [e.timestamp for e in events] == [*range(10), 11]
    assert loc.imu_t.decode(events[3].data).sequence == 3

    # The same through the C++ reader.
    r = libloc.read_recording(path)
    assert np.array_equal(r.imu.times_ns, 1000 * np.arange(10))
    assert np.array_equal(r.imu.angular_velocity[:, 0], 0.1 * np.arange(10))
    assert r.counts["imu.read"] == 10
    first = next(iter(libloc.open_recording(path)))
    assert isinstance(first, libloc.ImuMeasurement)
    assert (first.time_ns, first.host_time_ns, first.sequence) == (0, 5, 0)

    with pytest.raises(FileExistsError, match="exists already"):
        LogWriter(path)
    with LogWriter(path, overwrite=True) as log, pytest.raises(ValueError, match="channel = ''"):
        log.write("", imu(0), log_time_us=0)


def test_foreign_messages_are_counted(tmp_path):
    path = tmp_path / "a.lcm"
    log = lcm.EventLog(str(path), "w")
    log.write_event(1, "OTHER", b"whatever it is")
    log.write_event(2, "LOC_IMU", imu(1).encode())
    log.close()
    reader = LogReader(path)
    assert [m.channel for m in reader] == ["LOC_IMU"]
    assert reader.skipped == {"OTHER": 1}


def test_damage_is_reported(tmp_path):
    good = tmp_path / "good.lcm"
    with LogWriter(good) as log:
        for i in range(5):
            log.write("LOC_IMU", imu(i), log_time_us=i)
    data = good.read_bytes()
    event = len(data) // 5

    cut = tmp_path / "cut.lcm"
    cut.write_bytes(data[:-10])
    reader = LogReader(cut)
    assert len(list(reader)) == 4
    assert reader.damage == {"truncated_at_byte": 4 * event, "truncated_bytes": event - 10}

    holed = tmp_path / "holed.lcm"
    holed.write_bytes(data[:event] + b"garbage" + data[event:])
    reader = LogReader(holed)
    assert [m.message.sequence for m in reader] == [0, 1, 2, 3, 4]
    assert reader.damage == {"gaps": 1, "skipped_bytes": 7, "first_gap_at_byte": event}

    nonsense = tmp_path / "nonsense.lcm"
    nonsense.write_bytes(bytes(range(256)) * 4)
    with pytest.raises(DataError, match=r"nonsense\.lcm"):
        list(LogReader(nonsense))

    broken = tmp_path / "broken.lcm"
    log = lcm.EventLog(str(broken), "w")
    log.write_event(1, "LOC_IMU", imu(1).encode()[:-4])
    log.close()
    with pytest.raises(DataError, match=r"broken\.lcm: event 0, channel LOC_IMU: imu_t"):
        list(LogReader(broken))
    with pytest.raises(DataError, match="absent"):
        LogReader(tmp_path / "absent")


def test_odometry_and_features_as_arrays(tmp_path):
    path = tmp_path / "a.lcm"
    odometry = loc.odometry_t()
    odometry.time_ns, odometry.start_time_ns = 2000, 1000
    odometry.position, odometry.q_wxyz = [1, 2, 3], [0.5, 0.5, -0.5, 0.5]
    odometry.position_cov = [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    absolute = loc.odometry_t()
    absolute.time_ns, absolute.start_time_ns, absolute.q_wxyz = 3000, -(2**63), [1, 0, 0, 0]
    with LogWriter(path) as log:
        log.write("LOC_ODOMETRY", odometry, log_time_us=1)
        log.write("LOC_ODOMETRY", absolute, log_time_us=2)
        for i, ids in enumerate([[7, 5], [], [5, 6, 9]]):
            tracks = loc.tracks_t()
            tracks.time_ns, tracks.camera, tracks.sigma_px, tracks.size = 1000 + i, 1, 0.5, len(ids)
            tracks.feature_id, tracks.u_px, tracks.v_px = ids, [10.0 * k for k in ids], [0.25] * len(ids)
            log.write("LOC_TRACKS", tracks, log_time_us=3 + i)
    r = libloc.read_recording(path)
    assert r.odometry.times_ns.tolist() == [2000, 3000]
    assert r.odometry.start_times_ns.tolist() == [1000, libloc.NO_TIME]
    assert r.odometry.position.tolist() == [[1, 2, 3], [0, 0, 0]]
    assert r.odometry.q_wxyz[0].tolist() == [0.5, 0.5, -0.5, 0.5]
    assert r.odometry.position_cov[0].tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    assert r.odometry.orientation_cov.shape == (2, 3, 3)
    f = r.features
    assert (f.first.tolist(), f.id.tolist()) == ([0, 2, 2, 5], [7, 5, 5, 6, 9])
    assert f.pixel_px[f.first[2] : f.first[3]].tolist() == [[50, 0.25], [60, 0.25], [90, 0.25]]
    assert (f.camera.tolist(), f.sigma_px.tolist()) == ([1] * 3, [0.5] * 3)

    one = list(libloc.open_recording(path))
    assert (one[0].start_time_ns, one[1].start_time_ns) == (1000, None)
    assert one[0].position_cov[1, 2] == 6
    assert one[4].id.tolist() == [5, 6, 9]
    assert one[4].pixel_px[2].tolist() == [90, 0.25]
    made = libloc.OdometryMeasurement(5, [1, 2, 3], [1, 0, 0, 0], start_time_ns=4, position_cov=np.eye(3))
    assert (made.time_ns, made.start_time_ns, made.position_cov[0, 0]) == (5, 4, 1)
    assert np.isnan(made.orientation_cov).all()


def test_features_that_no_tracker_sends_are_counted(tmp_path):
    path = tmp_path / "a.lcm"
    tracks = loc.tracks_t()
    tracks.time_ns, tracks.size = 1, 2
    tracks.feature_id, tracks.u_px, tracks.v_px = [4, 4], [1, 2], [3, 4]
    with LogWriter(path) as log:
        log.write("LOC_TRACKS", tracks, log_time_us=1)
    r = libloc.read_recording(path)
    assert r.counts == {"undecodable:LOC_TRACKS": 1}
    assert (r.features.first.tolist(), r.features.pixel_px.shape) == ([0], (0, 2))
