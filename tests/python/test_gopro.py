"""IMU and GPS of a GoPro's video: files made after the public description of GPMF, with a known motion."""

import json
import sys

import numpy as np
import pytest
from gopro_support import Gopro, klv, nest, write_mp4
from libloc.programs import gopro as program
from libloc.programs import slam
from scipy.spatial.transform import Rotation
from test_slam_images import RATE_HZ, Ride

import libloc
from libloc import DataError, gopro

pytest.importorskip("telemetry_parser")

SECONDS = 4
SECOND_S = 1.001


def motion(t):
    """Angular velocity [rad/s] and specific force [m/s^2] in axes right, down, forward."""
    rate = np.stack([0.5 * np.sin(2 * t), 0.8 * np.sin(3 * t + 1), 0.3 * np.cos(t)], axis=1)
    force = np.stack([np.sin(1.5 * t), -9.8 + 0.5 * np.cos(t), 2 * np.sin(2.5 * t)], axis=1)
    return rate, force


def channels(rows, order):
    """From right, down, forward to what a camera stores: X left, Y back, Z up; small letters reversed."""
    axes = {"X": -rows[:, 0], "Y": -rows[:, 2], "Z": -rows[:, 1]}
    return np.stack([axes[c.upper()] * (1 if c.isupper() else -1) for c in order], axis=1)


def sample_times(rate_hz):
    return np.arange(SECONDS * rate_hz) / rate_hz * SECOND_S


def recording(order="YxZ", gyro_rate_hz=200, accl_rate_hz=200, **options):
    gyro, _ = motion(sample_times(gyro_rate_hz))
    _, accl = motion(sample_times(accl_rate_hz))
    options.setdefault("orientation", order)
    return Gopro(
        channels(accl, order),
        channels(gyro, order),
        accl_rate_hz=accl_rate_hz,
        gyro_rate_hz=gyro_rate_hz,
        second_s=SECOND_S,
        **options,
    )


def check_motion(times_ns, imu, count, force_tolerance=0.6 / 418):
    rate, force = motion(times_ns / 1e9)
    assert len(imu.times_ns) == count
    assert np.abs(imu.angular_velocity - rate).max() < 0.6 / 939
    assert np.abs(imu.specific_force - force).max() < force_tolerance


@pytest.mark.parametrize("stamps", [True, False])
@pytest.mark.parametrize("order", ["ZXY", "YxZ", "zxY", "XYZ", "yXZ"])
def test_units_scale_axes_and_times(tmp_path, order, stamps):
    got = gopro.read_telemetry(recording(order, stamps=stamps).write(tmp_path / "a.mp4"))
    assert got.model == "HERO7 Black"
    assert (got.axes_known, got.stamped) == (True, stamps)
    assert got.counts == {"imu.read": 800}
    expected = sample_times(200)
    assert np.abs(got.imu.times_ns / 1e9 - expected).max() < 2e-6
    check_motion(expected * 1e9, got.imu, 800)


@pytest.mark.parametrize(
    ("model", "order", "known"),
    [
        ("HERO5 Black", "ZXY", True),
        ("HERO6 Black", "YxZ", True),
        ("Fusion", "yXZ", True),
        ("Camera", "ZXY", False),
    ],
)
def test_axes_by_the_model_when_the_file_does_not_tell(tmp_path, model, order, known):
    path = recording(order, orientation="", model=model).write(tmp_path / "a.mp4")
    got = gopro.read_telemetry(path)
    assert (got.model, got.axes_known) == (model, known)
    check_motion(got.imu.times_ns, got.imu, 800)


@pytest.mark.parametrize("stamps", [True, False])
def test_gyroscope_at_twice_the_rate(tmp_path, stamps):
    """As a HERO5: the accelerometer is interpolated, not paired by number."""
    path = recording(gyro_rate_hz=400, stamps=stamps).write(tmp_path / "a.mp4")
    got = gopro.read_telemetry(path)
    assert np.abs(got.imu.times_ns / 1e9 - sample_times(400)).max() < 2e-6
    check_motion(got.imu.times_ns, got.imu, 1600, force_tolerance=0.04)  # the last one is held


def test_clock_of_the_camera_and_start_of_the_video(tmp_path):
    path = recording(stamp_offset_us=77_000_123).write(tmp_path / "a.mp4")
    got = gopro.read_telemetry(path, start_time_ns=5_000_000_000)
    assert got.imu.times_ns[0] == 5_000_000_000
    check_motion(got.imu.times_ns - 5_000_000_000, got.imu, 800)


def places(count):
    k = np.arange(count)
    return np.stack([47.1 + 1e-5 * k, -8.2 - 2e-5 * k, 400 + 0.1 * k, 1.5 + 0 * k, 1.6 + 0 * k], axis=1)


def test_gps5(tmp_path):
    want = places(SECONDS * 18)
    path = recording(gps5=want, gps_fix=2, altitude_system="MSLV").write(tmp_path / "a.mp4")
    got = gopro.read_telemetry(path)
    assert got.counts == {"imu.read": 800, "gps.read": 72}
    lla = got.gps.latitude_longitude_altitude
    assert np.abs(np.rad2deg(lla[:, :2]) - want[:, :2]).max() < 1e-7
    assert np.abs(lla[:, 2] - want[:, 2]).max() < 1e-3
    assert np.allclose(got.gps.speed, 1.5)
    assert np.allclose(got.gps.dop, 1.5)
    assert set(got.gps.fix) == {2}
    assert got.gps.above_sea_level
    assert np.abs(got.gps.times_ns / 1e9 - sample_times(18)).max() < 2e-6


def test_gps9_and_fixes_without_lock(tmp_path):
    want = np.column_stack([places(SECONDS * 10), np.tile([9500, 1000.5, 2.25, 3], (SECONDS * 10, 1))])
    want[:5, 8] = 0
    want[5, 0] = 91
    got = gopro.read_telemetry(recording(gps9=want).write(tmp_path / "a.mp4"))
    assert got.counts == {
        "imu.read": 800,
        "gps.read": 34,
        "gps.skipped.no_fix": 5,
        "gps.skipped.not_a_place": 1,
    }
    assert np.abs(np.rad2deg(got.gps.latitude_longitude_altitude[:, :2]) - want[6:, :2]).max() < 1e-7
    assert np.allclose(got.gps.dop, 2.25)
    assert not got.gps.above_sea_level
    assert np.abs(got.gps.times_ns / 1e9 - sample_times(10)[6:]).max() < 2e-6


def test_the_program_writes_a_recording(tmp_path, capsys):
    path = recording(gps5=places(SECONDS * 18)).write(tmp_path / "a.mp4")
    out = tmp_path / "recording.csv"
    assert program.main([str(path), "--out", str(out), "--start-time", "0.000001"]) == 0
    assert "HERO7 Black: IMU over 4.00 s, 199.80 Hz" in capsys.readouterr().out
    got = gopro.read_telemetry(path, start_time_ns=1000)
    r = libloc.read_recording(out)
    assert np.array_equal(r.imu.times_ns, got.imu.times_ns)
    assert np.array_equal(r.imu.angular_velocity, got.imu.angular_velocity)
    assert np.array_equal(r.imu.specific_force, got.imu.specific_force)
    assert np.array_equal(r.gps.times_ns, got.gps.times_ns)
    assert np.allclose(r.gps.latitude_longitude_altitude, got.gps.latitude_longitude_altitude, rtol=1e-15)
    assert np.array_equal(np.asarray(r.gps.fix).astype(int), got.gps.fix)
    assert not [name for name in r.counts if "skipped" in name]
    assert program.main([str(path), "--out", str(out)]) == 1
    assert f"{out}: exists already" in capsys.readouterr().err
    assert libloc.read_recording(out).imu.times_ns[0] == 1000


def write_video(path, pictures, rate_hz):
    av = pytest.importorskip("av")
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=rate_hz)
        stream.height, stream.width = pictures[0].shape
        stream.bit_rate = 8_000_000
        for picture in pictures:
            frame = av.VideoFrame.from_ndarray(np.repeat(picture[..., None], 3, axis=2), format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


@pytest.mark.skipif(not libloc.HAS_VISION, reason="libloc was built without OpenCV")
def test_slam_with_a_video_and_its_own_imu(tmp_path):
    """A ride through a room as a GoPro would record it: loc-gopro, then loc-slam with both."""
    ride = Ride()
    start = ride.times_ns[0]
    assert ride.imu.times_ns[0] == start
    # The IMU lies parallel to the camera: loc-gopro's axes.
    mounting = ride.camera.T_body_camera
    turn = Rotation.from_quat(np.roll(mounting.rotation_wxyz, -1))
    gyro = turn.inv().apply(ride.imu.angular_velocity)
    accl = turn.inv().apply(ride.imu.specific_force)
    ride.camera.T_body_camera = libloc.Pose3([1, 0, 0, 0], turn.inv().apply(mounting.translation))
    ride.rig.cameras = [ride.camera]
    libloc.write_rig(tmp_path / "rig.yaml", ride.rig)
    cameras = libloc.Trajectory(ride.times_ns - start, ride.cameras.q_world_body_wxyz, ride.cameras.position)
    libloc.write_tum(tmp_path / "truth.tum", cameras)
    write_video(tmp_path / "pictures.mp4", ride.pictures, RATE_HZ)
    made = Gopro(channels(accl, "YxZ"), channels(gyro, "YxZ"), second_s=1.0)
    video = tmp_path / "RIDE.MP4"
    write_mp4(video, made.payloads(), 1.0, made.model, video=tmp_path / "pictures.mp4")

    imu, out = tmp_path / "imu.csv", tmp_path / "out"
    assert program.main([str(video), "--out", str(imu)]) == 0
    arguments = [video, "--imu", imu, "--config", tmp_path / "rig.yaml", "--method", "inertial-slam"]
    arguments += ["--reference", tmp_path / "truth.tum", "--pose", "camera", "--no-plots", "--output", out]
    assert slam.main([str(a) for a in arguments]) == 0
    truth = json.loads((out / "summary.json").read_text())["truth"]
    assert truth["pairs"] == len(ride.times_ns)
    assert truth["rmse_m"] < 0.05


@pytest.mark.skipif(not libloc.HAS_VISION, reason="libloc was built without OpenCV")
def test_beside_pictures(tmp_path):
    """One file, one clock: the first picture and the first sample are at the start time."""
    pictures = tmp_path / "pictures.mp4"
    write_video(pictures, [np.full((48, 64), 2 * k, np.uint8) for k in range(SECONDS * 30)], 30)
    made = recording()
    path = write_mp4(tmp_path / "a.mp4", made.payloads(), SECOND_S, made.model, video=pictures)
    start = 1_000_000_000
    got = gopro.read_telemetry(path, start_time_ns=start)
    check_motion(got.imu.times_ns - start, got.imu, 800)
    source = libloc.open_video(path, start_time_ns=start)
    times = [m.time_ns for m in source]
    assert len(times) == SECONDS * 30
    assert times[0] == got.imu.times_ns[0] == start
    assert times[-1] < got.imu.times_ns[-1]


def test_the_program_warns(tmp_path, capsys):
    made = recording("ZXY", orientation="", model="Camera", stamps=False)
    path = made.write(tmp_path / "a.mp4")
    assert program.main([str(path), "--out", str(tmp_path / "a.csv")]) == 0
    err = capsys.readouterr().err
    assert "Camera does not tell the order of the IMU's axes" in err
    assert "have no times" in err


def test_a_payload_stamped_earlier_is_left_out(tmp_path):
    path = recording(changed_stamps={2: 500_000}).write(tmp_path / "a.mp4")
    got = gopro.read_telemetry(path)
    assert got.counts == {
        "imu.read": 600,
        "imu.skipped.time_not_increasing": 200,
        "imu.payloads_uneven": 1,
    }
    assert (np.diff(got.imu.times_ns) > 0).all()
    check_motion(got.imu.times_ns, got.imu, 600)


def test_a_payload_stamped_much_too_late_is_counted(tmp_path):
    got = gopro.read_telemetry(recording(changed_stamps={3: 60_000_000}).write(tmp_path / "a.mp4"))
    assert got.counts["imu.payloads_uneven"] == 1


def test_a_lost_payload_does_not_shift_the_others(tmp_path):
    made = recording()
    payloads = made.payloads()
    del payloads[1]
    got = gopro.read_telemetry(write_mp4(tmp_path / "a.mp4", payloads, SECOND_S, made.model))
    assert got.counts["imu.missing"] == 400  # of both sensors
    rate, _ = motion(got.imu.times_ns / 1e9)
    assert np.abs(got.imu.angular_velocity - rate).max() < 0.6 / 939
    made.stamps = False
    payloads = made.payloads()
    del payloads[1]
    path = write_mp4(tmp_path / "b.mp4", payloads, SECOND_S, made.model)
    with pytest.raises(DataError, match=r"b\.mp4: 200 samples of the gyroscope are missing"):
        gopro.read_telemetry(path)


def refused(path, match):
    with pytest.raises(DataError, match=match) as error:
        gopro.read_telemetry(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"unit_gyro": "rpm"}, "unit of the gyroscope is 'rpm'"),
        ({"unit_accl": "furlong"}, "unit of the accelerometer is 'furlong'"),
        ({"orientation": "ZXQ", "orientation_out": ""}, "axes of the gyroscope .ORIN. are 'ZXQ'"),
        ({"orientation": "ZXX", "orientation_out": ""}, "axes of the gyroscope .ORIN. are 'ZXX'"),
    ],
)
def test_tags_that_make_no_sense(tmp_path, options, match):
    refused(recording(**{"order": "ZXY", **options}).write(tmp_path / "a.mp4"), match)


def test_scale_of_nought(tmp_path):
    made = recording()
    path = made.write(tmp_path / "a.mp4")
    data = path.read_bytes()
    path.write_bytes(data.replace(klv("SCAL", "s", [made.gyro_scale]), klv("SCAL", "s", [0])))
    refused(path, "scale of the gyroscope is 0")


def test_values_that_are_not_numbers(tmp_path):
    """Floats instead of scaled integers, too."""

    def payload(k):
        gyro, accl = motion((np.arange(200) / 200 + k) * SECOND_S)
        gyro, accl = channels(gyro, "ZXY"), channels(accl, "ZXY")
        if k == 1:
            gyro[10, 1] = np.nan
        streams = [
            nest(
                "STRM",
                klv("STMP", "J", [round(k * SECOND_S * 1e6)]),
                klv("SIUN", "c", unit),
                klv("ORIN", "c", "ZXY"),
                klv(key, "f", rows),
            )
            for key, unit, rows in (("ACCL", "m/s\xb2", accl), ("GYRO", "rad/s", gyro))
        ]
        return nest("DEVC", klv("DVNM", "c", "HERO9"), *streams)

    got = gopro.read_telemetry(
        write_mp4(tmp_path / "a.mp4", [payload(k) for k in range(3)], SECOND_S, "HERO9")
    )
    assert got.counts == {"imu.read": 599, "imu.skipped.not_finite": 1}
    check_motion(got.imu.times_ns, got.imu, 599)


def test_files_that_are_none(tmp_path):
    refused(tmp_path / "absent.mp4", "no such file")
    path = tmp_path / "text.mp4"
    path.write_text("no video\n" * 100)
    refused(path, "no GoPro telemetry can be read")
    path = tmp_path / "empty.mp4"
    path.write_bytes(b"")
    refused(path, "no GoPro telemetry can be read")
    payloads = recording().payloads()
    other = write_mp4(tmp_path / "other.mp4", payloads, SECOND_S, "other", format="mett")
    refused(other, "no GoPro telemetry can be read")
    no_imu = [nest("DEVC", klv("DVNM", "c", "HERO9"))] * 3
    refused(write_mp4(tmp_path / "no_imu.mp4", no_imu, SECOND_S, "HERO9"), "no samples of the gyroscope")
    made = recording()
    made.accl = made.accl[:0]
    refused(made.write(tmp_path / "no_accl.mp4"), "no samples of the accelerometer")


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9, 0.995])
def test_cut_off(tmp_path, part):
    """The index is at the end of the file: without it nothing can be read."""
    path = recording().write(tmp_path / "a.mp4")
    data = path.read_bytes()
    path.write_bytes(data[: int(part * len(data))])
    refused(path, "no GoPro telemetry can be read|IMU samples")


def test_damaged_bytes_never_crash(tmp_path):
    rng = np.random.default_rng(1)
    path = recording(gps5=places(SECONDS * 18)).write(tmp_path / "a.mp4")
    data = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    bad = tmp_path / "bad.mp4"
    for _ in range(40):
        changed = data.copy()
        where = rng.integers(0, len(data), size=20)
        changed[where] = rng.integers(0, 256, size=20)
        bad.write_bytes(changed.tobytes())
        try:
            got = gopro.read_telemetry(bad)
        except DataError as error:
            assert str(bad) in str(error)
        else:
            assert (np.diff(got.imu.times_ns) > 0).all()
            assert np.isfinite(got.imu.specific_force).all()


def test_without_the_package(tmp_path, monkeypatch, capsys):
    path = recording().write(tmp_path / "a.mp4")
    monkeypatch.setitem(sys.modules, "telemetry_parser", None)
    assert program.main([str(path), "--out", str(tmp_path / "a.csv")]) == 1
    assert "pip install telemetry-parser" in capsys.readouterr().err
    assert not (tmp_path / "a.csv").exists()
