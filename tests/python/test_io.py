"""Recordings as arrays, TUM files and rigs."""

import gc

import numpy as np
import pytest
import scipy.io
from scipy.spatial.transform import Rotation
from support import data_folder, to_wxyz, turning_body, write_csv

import libloc
from libloc import DataError


def test_csv_as_arrays_and_one_by_one(tmp_path):
    r = turning_body(50)
    path = tmp_path / "own.csv"
    write_csv(path, r)
    got = libloc.read_recording(path)
    assert np.array_equal(got.imu.times_ns, r.times_ns)
    assert np.array_equal(got.imu.angular_velocity, r.gyro)
    assert np.array_equal(got.imu.specific_force, r.force)
    assert np.allclose(got.magnetometer.magnetic_field, r.field, rtol=1e-14)
    assert np.allclose(got.reference.q_world_body_wxyz, r.q_true_wxyz, atol=1e-15)
    assert got.reference.score.dtype == bool
    assert got.gps.times_ns.shape == (0,)
    assert got.gps.velocity_enu.shape == (0, 3)

    source = libloc.open_recording(path)
    kinds = [type(m).__name__ for m in source]
    assert {k: kinds.count(k) for k in set(kinds)} == {
        "ImuMeasurement": 50,
        "MagnetometerMeasurement": 50,
        "ReferenceMeasurement": 50,
    }
    assert source.counts()["imu.read"] == 50


def test_arrays_outlive_the_recording(tmp_path):
    r = turning_body(1000)
    write_csv(tmp_path / "own.csv", r)
    gyro = libloc.read_recording(tmp_path / "own.csv").imu.angular_velocity
    assert gyro.base is not None  # the vector that the reader filled, not a copy
    gc.collect()
    assert np.array_equal(gyro, r.gyro)


def test_bad_lines_are_named(tmp_path):
    path = tmp_path / "own.csv"
    write_csv(path, turning_body(5))
    path.write_text(path.read_text() + "1700000001000000000,1,2,x,4,5,6,7,8,9,1,0,0,0\n")
    with pytest.raises(DataError, match=r"own\.csv.*7.*x"):
        libloc.read_recording(path)
    with pytest.raises(DataError, match="absent: no such file"):
        libloc.read_recording(tmp_path / "absent")
    (tmp_path / "empty").write_bytes(b"")
    with pytest.raises(DataError, match="empty"):
        libloc.read_recording(tmp_path / "empty")
    (tmp_path / "binary").write_bytes(bytes(100))
    with pytest.raises(DataError, match="neither an LCM log nor"):
        libloc.read_recording(tmp_path / "binary")


def test_tum_round_trip(tmp_path):
    n = 20
    times = 1_403_715_274_302_143_123 + 5_000_000 * np.arange(n)
    q = to_wxyz(Rotation.random(n, rng=2))
    position = np.random.default_rng(1).normal(size=(n, 3))
    libloc.write_tum(tmp_path / "t.tum", libloc.Trajectory(times, q, position))
    back, counts = libloc.read_tum(tmp_path / "t.tum")
    assert counts["tum.read"] == n
    assert np.array_equal(back.times_ns, times)
    assert np.allclose(back.position, position, atol=1e-9)
    assert np.allclose(libloc.so3.angle_between(back.q_world_body_wxyz, q), 0, atol=1e-8)
    raw = np.loadtxt(tmp_path / "t.tum")
    assert np.allclose(raw[:, 4:], np.roll(q, -1, axis=1), atol=1e-9)  # x y z w in the file
    (tmp_path / "nan.tum").write_text("1 0 0 0 0 0 0 1\n2 nan 0 0 0 0 0 1\n")
    with pytest.raises(DataError, match=r"nan\.tum.*2"):
        libloc.read_tum(tmp_path / "nan.tum")
    with pytest.raises(DataError, match="read_tum"):
        libloc.open_recording(tmp_path / "t.tum")


def test_rig_round_trip(tmp_path):
    rig = libloc.Rig()
    rig.imu = libloc.ImuCalibration()
    rig.imu.rate_hz = 200
    rig.imu.gyroscope.bias = [0.01, 0, -0.02]
    camera = libloc.CameraCalibration()
    camera.name, camera.width_px, camera.height_px = "cam0", 752, 480
    camera.intrinsics_px = [458, 457, 367, 248]
    camera.T_body_camera = libloc.Pose3.exp([0.1, 0, 0, 0, 0.2, 0])
    rig.cameras = [camera]
    libloc.write_rig(tmp_path / "rig.yaml", rig)
    back = libloc.read_rig(tmp_path / "rig.yaml")
    assert back.imu.gyroscope.bias.tolist() == [0.01, 0, -0.02]
    assert np.array_equal(back.cameras[0].T_body_camera.matrix(), camera.T_body_camera.matrix())
    assert back.magnetometer is None
    sample = back.calibrated(libloc.ImuMeasurement(5, [1, 1, 1], [0, 0, 9]))
    assert np.allclose(sample.angular_velocity, [0.99, 1, 1.02])
    (tmp_path / "bad.yaml").write_text("format: libloc-rig-1\nimu: {rate_hz: fast}\n")
    with pytest.raises(DataError, match=r"bad\.yaml"):
        libloc.read_rig(tmp_path / "bad.yaml")
    rig.imu.rate_hz = -1
    with pytest.raises(ValueError, match="rate"):
        rig.check()


def test_rig_carries_what_calibration_says(tmp_path):
    path = tmp_path / "rig.yaml"
    quality = libloc.TriadQuality()
    quality.verdict, quality.method, quality.samples = libloc.Verdict.REFUSED, "robust", 500
    quality.bias_sigma = [1e-7, 2e-7, 3e-7]
    quality.residual_rms = 0.004
    quality.reasons = ["turn it more"]
    triad = libloc.TriadCalibration()
    triad.bias, triad.quality = [1e-5, 0, 0], quality

    def set_magnetometer(rig):
        rig.magnetometer = libloc.MagnetometerCalibration()
        rig.magnetometer.triad = triad

    def set_gps(rig):
        rig.gps = libloc.GpsCalibration()
        rig.gps.time_offset_s, rig.gps.time_offset_sigma_s = -0.2, 0.01
        clock = libloc.ClockCalibration("imu", "host")
        clock.skew_ppm = 50
        rig.clocks = [clock]

    libloc.update_rig(path, set_magnetometer)
    written = libloc.update_rig(path, set_gps)
    back = libloc.read_rig(path)
    assert written.gps.time_offset_s == back.gps.time_offset_s == -0.2
    assert [(c.stream, c.reference, c.skew_ppm) for c in back.clocks] == [("imu", "host", 50.0)]
    assert np.isnan(back.clocks[0].jitter_rms_s)
    got = back.magnetometer.triad.quality
    assert (got.verdict, got.method, got.samples, got.reasons) == (3, "robust", 500, ["turn it more"])
    assert got.bias_sigma.tolist() == [1e-7, 2e-7, 3e-7]
    assert np.isnan(got.matrix_sigma).all()
    ((block, verdict, text),) = back.doubts()
    assert (block, verdict) == ("magnetometer", libloc.Verdict.REFUSED)
    assert "turn it more" in text

    before = path.read_text()

    def spoil(rig):
        rig.gps = None
        raise RuntimeError("no")

    with pytest.raises(RuntimeError, match="no"):
        libloc.update_rig(path, spoil)
    quality.reasons = ["two\nlines"]
    triad.quality = quality
    with pytest.raises(ValueError, match="one line"):
        libloc.update_rig(path, set_magnetometer)
    assert path.read_text() == before


def test_rig_tells_how_well_a_camera_is_mounted(tmp_path):
    camera = libloc.CameraCalibration()
    camera.name, camera.width_px, camera.height_px = "cam0", 752, 480
    camera.intrinsics_px = [458, 457, 367, 248]
    camera.T_body_camera = libloc.Pose3.exp([0.1, 0, 0, 0, 0, 0])
    camera.time_offset_s = 0.002
    assert camera.mounting_quality is None
    quality = libloc.MountingQuality()
    assert np.isnan(quality.rotation_sigma).all()
    assert np.isnan(quality.line_delay_s)
    quality.verdict, quality.method, quality.pictures = libloc.Verdict.WARN, "camera-imu", 1200
    quality.line_delay_s, quality.line_delay_sigma_s = 2e-5, 1e-7
    quality.reasons = ["hardly any turn about z"]
    quality.set_deviations(camera.T_body_camera, np.diag([1e-3, 2e-3, 3e-3, 4e-4, 5e-4, 6e-4, 7e-6]) ** 2)
    camera.mounting_quality = quality
    rig = libloc.Rig()
    rig.cameras = [camera, camera]
    path = tmp_path / "rig.yaml"
    libloc.write_rig(path, rig)
    back = libloc.read_rig(path)
    got = back.cameras[0].mounting_quality
    assert (got.verdict, got.method, got.pictures) == (libloc.Verdict.WARN, "camera-imu", 1200)
    np.testing.assert_allclose(got.rotation_sigma, [1e-3, 2e-3, 3e-3], rtol=1e-12)
    # The camera's place 0.1 m along x also moves by turns about y and z.
    np.testing.assert_allclose(
        got.translation_sigma, np.hypot([0, 3e-4, 2e-4], [4e-4, 5e-4, 6e-4]), rtol=1e-12
    )
    assert got.time_offset_sigma_s == 7e-6
    assert (got.line_delay_s, got.line_delay_sigma_s) == (2e-5, 1e-7)
    assert got.reasons == ["hardly any turn about z"]
    assert [(block, verdict) for block, verdict, _ in back.doubts()] == [
        ("cam0.mounting", libloc.Verdict.WARN)
    ] * 2
    with pytest.raises(ValueError, match="covariance"):
        quality.set_deviations(camera.T_body_camera, np.eye(6))

    chain = tmp_path / "camchain.yaml"
    libloc.write_kalibr_camchain(chain, rig)
    text = chain.read_text()
    assert text.count("timeshift_cam_imu: 0.002\n") == 2
    assert "T_cn_cnm1:\n  - [1.0, 0.0, 0.0, 0.0]\n" in text
    cameras = libloc.read_any_rig(chain).cameras
    assert [c.name for c in cameras] == ["cam0", "cam1"]
    assert cameras[1].T_body_camera.translation.tolist() == [0.1, 0, 0]
    with pytest.raises(ValueError, match="IMU"):
        libloc.write_kalibr_imu(tmp_path / "imu.yaml", rig)
    rig.imu = libloc.ImuCalibration()
    rig.imu.rate_hz = 200
    libloc.write_kalibr_imu(tmp_path / "imu.yaml", rig)
    assert libloc.read_any_rig(tmp_path / "imu.yaml").imu.rate_hz == 200


def test_imu_noise():
    noise = libloc.ImuNoise(gyroscope_noise_density=1e-3)
    assert libloc.discretise(noise, 0.01).sigma_angular_velocity == pytest.approx(1e-2)
    with pytest.raises(ValueError, match="gyroscope_noise_density"):
        libloc.ImuNoise(gyroscope_noise_density=-1)


def test_broad_is_what_scipy_reads():
    path = data_folder("broad") / "01_undisturbed_slow_rotation_A.mat"
    r, mat = libloc.read_recording(path), scipy.io.loadmat(path)
    assert np.array_equal(r.imu.angular_velocity, mat["imu_gyr"])
    assert np.array_equal(r.imu.specific_force, mat["imu_acc"])
    assert np.allclose(r.magnetometer.magnetic_field, mat["imu_mag"] * 1e-6, rtol=1e-15)
    assert np.array_equal(r.reference.score, mat["movement"].ravel() > 0)
    assert r.imu.times_ns[-1] == round((len(r.imu.times_ns) - 1) * 1e9 / mat["sampling_rate"].item())
