"""calib/camera_imu_lint from Python: arrays in, findings out. What is found is tested in C++."""

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
        "cameras": [(camera, views)],
        "times_ns": stamps,
        "angular_velocity": readings[:, :3].copy(),
        "specific_force": readings[:, 3:].copy(),
        "noise": libloc.ImuNoise(gyroscope_noise_density=1.6968e-4, accelerometer_noise_density=2e-3),
        "imu_rate_hz": 200,
    }


def test_a_real_recording_is_fine_until_its_units_are_not(recording):
    (finding,) = libloc.lint_camera_imu(**recording)
    assert (finding.severity, finding.code) == (Verdict.OK, "camera.gaps")
    assert finding.text.startswith("cam0: ")
    assert finding.code in repr(finding)
    degrees = {**recording, "angular_velocity": np.degrees(recording["angular_velocity"])}
    worst = libloc.lint_camera_imu(**degrees)[0]
    assert (worst.severity, worst.code) == (Verdict.REFUSED, "imu.gyroscope_unit")
    apart = {**recording, "times_ns": recording["times_ns"] - 10**15}
    assert {f.code: f.severity for f in libloc.lint_camera_imu(**apart)} == {
        "camera.gaps": Verdict.OK,
        "clocks.apart": Verdict.OK,
    }


def test_mistakes_are_named():
    empty = np.zeros((0, 3))
    nothing = {"times_ns": np.zeros(0, np.int64), "angular_velocity": empty, "specific_force": empty}
    findings = libloc.lint_camera_imu(
        TARGET, [], **nothing, noise=libloc.ImuNoise(gyroscope_random_walk=1e-5)
    )
    assert [f.code for f in findings] == ["imu.no_samples", "noise.default"]
    nothing["specific_force"] = np.zeros((1, 3))
    with pytest.raises(ValueError, match="specific_force must have as many rows as times_ns"):
        libloc.lint_camera_imu(TARGET, [], **nothing, noise=libloc.ImuNoise())
    nothing["specific_force"] = empty
    view = TargetView(np.array([999]), np.zeros((1, 2)), 5)
    camera = CameraCalibration()
    camera.name, camera.width_px, camera.height_px = "cam0", 640, 480
    camera.intrinsics_px = [500, 500, 320, 240]
    with pytest.raises(ValueError, match="999"):
        libloc.lint_camera_imu(TARGET, [(camera, [view])], **nothing, noise=libloc.ImuNoise())
