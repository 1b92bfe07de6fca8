"""calib/camera_imu and camera_imu_lint from Python: arrays in, result and findings out."""

import numpy as np
import pytest
from support import data_folder

import libloc
from libloc import CalibrationTarget, CameraCalibration, TargetView, Verdict

TARGET = CalibrationTarget("aprilgrid 6x6 0.088 0.3")


def euroc() -> tuple[CameraCalibration, list[TargetView], np.ndarray]:
    folder = data_folder("euroc-cam-imu-calibration")
    camera = CameraCalibration()
    camera.name, camera.width_px, camera.height_px, camera.rate_hz = "cam0", 752, 480, 20
    camera.intrinsics_px = [458.654, 457.296, 367.215, 248.375]
    camera.distortion_model = libloc.DistortionModel.RADTAN
    camera.distortion = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
    stamps = np.loadtxt(folder / "cam0_corners.csv", delimiter=",", skiprows=1, usecols=0, dtype=np.int64)
    numbers = np.loadtxt(folder / "cam0_corners.csv", delimiter=",", skiprows=1, usecols=(1, 2, 3, 4))
    views = []
    for chunk in np.split(np.arange(len(stamps)), np.flatnonzero(np.diff(stamps)) + 1):
        tag, corner, *_ = numbers[chunk].T.astype(np.int64)
        views.append(TargetView(4 * tag + corner, numbers[chunk, 2:].copy(), int(stamps[chunk[0]])))
    return camera, views, np.loadtxt(folder / "imu0.csv", delimiter=",", usecols=range(1, 7))


@pytest.fixture(scope="module")
def recording() -> dict:
    camera, views, readings = euroc()
    stamps = np.loadtxt(
        data_folder("euroc-cam-imu-calibration") / "imu0.csv", delimiter=",", usecols=0, dtype=np.int64
    )
    return {
        "target": TARGET,
        "recordings": [libloc.CameraRecording(camera, views)],
        "imu_times_ns": stamps,
        "angular_velocity": readings[:, :3].copy(),
        "specific_force": readings[:, 3:].copy(),
        "noise": libloc.ImuNoise(gyroscope_noise_density=1.6968e-4, accelerometer_noise_density=2e-3),
    }


def test_a_real_recording_is_fine_until_its_units_are_not(recording):
    (finding,) = libloc.lint_camera_imu(**recording, imu_rate_hz=200)
    assert (finding.severity, finding.code) == (Verdict.OK, "camera.gaps")
    assert finding.text.startswith("cam0: ")
    assert finding.code in repr(finding)
    degrees = {**recording, "angular_velocity": np.degrees(recording["angular_velocity"])}
    worst = libloc.lint_camera_imu(**degrees, imu_rate_hz=200)[0]
    assert (worst.severity, worst.code) == (Verdict.REFUSED, "imu.gyroscope_unit")
    apart = {**recording, "imu_times_ns": recording["imu_times_ns"] - 10**15}
    assert {f.code: f.severity for f in libloc.lint_camera_imu(**apart, imu_rate_hz=200)} == {
        "camera.gaps": Verdict.OK,
        "clocks.apart": Verdict.OK,
    }


def test_mistakes_are_named():
    empty = np.zeros((0, 3))
    nothing = {"imu_times_ns": np.zeros(0, np.int64), "angular_velocity": empty, "specific_force": empty}
    findings = libloc.lint_camera_imu(
        TARGET, [], **nothing, noise=libloc.ImuNoise(gyroscope_random_walk=1e-5)
    )
    assert [f.code for f in findings] == ["imu.no_samples", "noise.default"]
    nothing["specific_force"] = np.zeros((1, 3))
    with pytest.raises(ValueError, match="specific_force must have as many rows as imu_times_ns"):
        libloc.lint_camera_imu(TARGET, [], **nothing, noise=libloc.ImuNoise())
    nothing["specific_force"] = empty
    view = TargetView(np.array([999]), np.zeros((1, 2)), 5)
    camera = CameraCalibration()
    camera.name, camera.width_px, camera.height_px = "cam0", 640, 480
    camera.intrinsics_px = [500, 500, 320, 240]
    with pytest.raises(ValueError, match="999"):
        libloc.lint_camera_imu(
            TARGET, [libloc.CameraRecording(camera, [view])], **nothing, noise=libloc.ImuNoise()
        )


T_BS = [  # EuRoC's T_body_camera of cam0
    [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975],
    [0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768],
    [-0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949],
    [0, 0, 0, 1],
]
BASALT = (-0.01677, -0.06894, 0.00514)  # its translation of T_imu_camera for this rig


@pytest.fixture(scope="module")
def calibration(recording) -> libloc.CameraImuFit:
    return libloc.calibrate_camera_imu(**recording)


def test_a_real_recording_in_one_call(calibration, recording):
    (camera,) = calibration.cameras
    assert calibration.converged
    T_imu_camera = camera.T_camera_imu.inverse()
    reference = libloc.Pose3.from_matrix(T_BS)
    assert np.linalg.norm(T_imu_camera.translation - reference.translation) < 0.010
    assert np.rad2deg(np.linalg.norm(T_imu_camera.boxminus(reference)[3:])) < 0.5
    assert np.linalg.norm(T_imu_camera.translation - BASALT) < 0.003
    assert abs(camera.time_offset_s) < 1e-4
    assert np.linalg.norm(calibration.gravity_target) == pytest.approx(9.80665)
    # The recording would have another principal point, which no tool that holds EuRoC's intrinsics sees.
    assert calibration.quality.verdict == Verdict.WARN
    assert any("blurred" in reason for reason in calibration.quality.reasons)
    assert "change the intrinsics" in calibration.quality.reasons[0]
    assert sum("would move by" in reason for reason in calibration.quality.reasons) == 1
    assert calibration.target_scale.value == pytest.approx(1, abs=0.01)
    assert not calibration.target_scale.estimated
    for matrix in (calibration.gyroscope_matrix, calibration.accelerometer_matrix):
        np.testing.assert_allclose(matrix.value, np.eye(3), atol=0.02)
        assert matrix.sigma.shape == (3, 3)
        assert not matrix.estimated
    mounting = camera.camera.mounting_quality
    assert (mounting.method, mounting.verdict) == ("camera-imu", Verdict.WARN)
    assert mounting.reasons == calibration.quality.reasons
    # The parts of the result fit together.
    np.testing.assert_allclose(np.sqrt(np.diag(camera.covariance)), camera.sigma)
    assert (camera.sigma >= camera.sigma_by_noise).all()
    used = np.array([view.used for view in camera.views])
    assert used.sum() > 1400
    assert set(camera.corner_view) == set(np.flatnonzero(used))
    assert camera.corner_residual_px.shape == camera.corner_pixel_px.shape == (len(camera.corner_id), 2)
    assert calibration.imu_residuals.shape == (calibration.counts["imu.used"], 6)
    assert len(calibration.bias_time_ns) == len(calibration.biases)
    np.testing.assert_allclose(
        camera.camera.T_body_camera.matrix(), camera.T_camera_imu.inverse().matrix(), atol=1e-12
    )
    start = camera.start
    assert start.curve_correlation.max() == pytest.approx(start.correlation)


def test_pieces_are_as_far_apart_as_their_deviations_say(recording):
    (whole,) = recording["recordings"]
    n = len(whole.views)
    fits = [
        libloc.calibrate_camera_imu(
            **{**recording, "recordings": [libloc.CameraRecording(whole.camera, whole.views[a:b])]}
        ).cameras[0]
        for a, b in ((0, n // 3), (n // 3, 2 * n // 3), (2 * n // 3, n))
    ]
    turns = [libloc.Pose3(f.T_camera_imu.rotation_wxyz) for f in fits]
    x = np.array(
        [
            [*turn.boxminus(turns[0])[3:], *f.T_camera_imu.translation, f.time_offset_s]
            for turn, f in zip(turns, fits, strict=True)
        ]
    )
    for part in (slice(0, 3), slice(3, 6), slice(6, 7)):
        # Distances to the first piece, with what they share.
        D = np.array([[-1.0, 1, 0], [-1, 0, 1]])
        size = x[:, part].shape[1]
        joint = np.zeros((3 * size, 3 * size))
        for i, f in enumerate(fits):
            joint[i * size : (i + 1) * size, i * size : (i + 1) * size] = f.covariance[part, part]
        M = np.kron(D, np.eye(size))
        apart = M @ x[:, part].ravel()
        reduced = apart @ np.linalg.solve(M @ joint @ M.T, apart) / len(apart)
        assert 0.3 < reduced < 2.5, (part, reduced)


def test_progress_stops_and_the_best_so_far_is_the_result(calibration, recording):
    seen = []

    def progress(at: libloc.CameraImuProgress) -> bool:
        seen.append(at.cost)
        return len(seen) < 2

    fit = libloc.calibrate_camera_imu(**recording, progress=progress)
    assert (fit.converged, fit.stopped, len(seen)) == (False, "interrupted", 2)
    assert fit.quality.verdict == Verdict.REFUSED
    near = fit.cameras[0].T_camera_imu.translation - calibration.cameras[0].T_camera_imu.translation
    assert np.linalg.norm(near) < 0.02

    def interrupt(at: libloc.CameraImuProgress) -> bool:
        raise KeyboardInterrupt

    assert libloc.calibrate_camera_imu(**recording, progress=interrupt).stopped == "interrupted"

    def fail(at: libloc.CameraImuProgress) -> bool:
        raise RuntimeError("from within")

    with pytest.raises(RuntimeError, match="from within"):
        libloc.calibrate_camera_imu(**recording, progress=fail)
    with pytest.raises(ValueError, match="order"):
        libloc.CameraImuOptions(order=2)
    with pytest.raises(TypeError, match="no field speed"):
        libloc.CameraImuOptions(speed=1)
    with pytest.raises(libloc.DataError, match="IMU samples"):
        libloc.calibrate_camera_imu(
            TARGET, recording["recordings"], np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3))
        )
