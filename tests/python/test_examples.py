"""The examples run, on real recordings where there are any and on generated ones."""

import subprocess
import sys

import numpy as np
import pytest
from support import CHECKOUT, data_folder, turning_body, write_csv, write_log

import libloc

EXAMPLES = CHECKOUT / "python/examples"


def run(name, *arguments, code=0) -> str:
    out = subprocess.run(
        [sys.executable, EXAMPLES / name, *map(str, arguments)], capture_output=True, text=True, check=False
    )
    assert out.returncode == code, out.stderr
    assert "Traceback" not in out.stderr
    return out.stdout if code == 0 else out.stderr


def figure(text: str, name: str) -> float:
    return float(text.split(f"  {name}: ")[1].split()[0])


def test_orientation_of_a_broad_trial(tmp_path):
    text = run(
        "01_orientation.py", data_folder("broad") / "01_undisturbed_slow_rotation_A.mat", "--output", tmp_path
    )
    assert figure(text, "total") < 4
    assert (tmp_path / "orientation.png").stat().st_size > 20_000


def test_orientation_of_an_own_csv(tmp_path):
    write_csv(tmp_path / "own.csv", turning_body(2000))
    text = run("01_orientation.py", tmp_path / "own.csv", "--preset", "report", "--output", tmp_path / "out")
    assert "2000 IMU and 2000 magnetometer samples" in text
    assert figure(text, "total") < 1.5
    assert (tmp_path / "out/orientation.png").stat().st_size > 20_000
    assert "no such file" in run("01_orientation.py", tmp_path / "absent.csv", code=1)


def test_reading_a_log(tmp_path):
    r = turning_body(400)
    write_log(tmp_path / "run.lcm", r, r.q_true_wxyz)
    text = run("02_read_lcm_log.py", tmp_path / "run.lcm", "--plot", tmp_path / "imu.png")
    assert "LOC_IMU                 imu_t                      400       1.995      200.00" in text
    assert (tmp_path / "imu.png").stat().st_size > 20_000
    assert "absent" in run("02_read_lcm_log.py", tmp_path / "absent", code=1)


def test_calibrating_a_magnetometer(tmp_path):
    text = run("03_calibrate_magnetometer.py", "--output", tmp_path)
    assert "verdict: ok" in text
    assert float(text.split("error of the centre: ")[1].split()[0]) < 0.3
    assert (tmp_path / "spheres.png").stat().st_size > 20_000
    # The plain formula believes the outliers.
    lsq = run("03_calibrate_magnetometer.py", "--method", "lsq", "--output", tmp_path / "lsq")
    assert float(lsq.split("error of the centre: ")[1].split()[0]) > 1
    quality = libloc.read_rig(tmp_path / "rig.yaml").magnetometer.triad.quality
    assert (quality.method, quality.verdict) == ("robust", libloc.Verdict.OK)


def test_calibrating_the_magnetometer_of_a_recording(tmp_path):
    write_csv(tmp_path / "own.csv", turning_body(4000))
    text = run(
        "03_calibrate_magnetometer.py", tmp_path / "own.csv", "--field-ut", 48.332, "--output", tmp_path
    )
    assert "4000 readings" in text
    triad = libloc.read_rig(tmp_path / "rig.yaml").magnetometer.triad
    assert np.abs(triad.bias).max() < 0.3e-6
    still = turning_body(200)
    still.field[:] = still.field[0]
    write_csv(tmp_path / "still.csv", still)
    assert "refused" in run("03_calibrate_magnetometer.py", tmp_path / "still.csv", code=1)
    assert "no such file" in run("03_calibrate_magnetometer.py", tmp_path / "absent.csv", code=1)


def test_visual_inertial(tmp_path):
    arguments = ["--duration", 10, "--video", "none", "--output", tmp_path / "out"]
    text = run("04_visual_inertial.py", *arguments)
    # The drift of the odometry is 1.2 units; the filter does not know the scale at the start.
    assert float(text.split("fused ")[1].split()[0]) < 4
    assert abs(float(text.split("error ")[1].split()[0])) < 10
    assert (tmp_path / "out/summary.png").stat().st_size > 50_000
    assert "is longer than the motion" in run("04_visual_inertial.py", "--duration", 91, code=1)
    source = (EXAMPLES / "04_visual_inertial.py").read_text()
    assert source.count("\n") < 60


@pytest.mark.skipif(not libloc.HAS_VISION, reason="libloc was built without OpenCV")
def test_slam_from_images(tmp_path):
    text = run("04_slam_from_images.py", "--output", tmp_path / "slam.png")
    assert text.startswith("80 pictures, ")
    assert int(text.split(", ")[1].split()[0]) > 30
    assert (tmp_path / "slam.png").stat().st_size > 50_000
    source = (EXAMPLES / "04_slam_from_images.py").read_text()
    assert source.count("\n") <= 40


def test_calibrating_camera_and_imu(tmp_path):
    text = run("05_camera_imu_calibration.py", "--output", tmp_path)
    assert "verdict: ok" in text
    assert float(text.split("error of the turn: ")[1].split()[0]) < 0.05
    assert float(text.split("error of the translation: ")[1].split()[0]) < 1.5
    assert float(text.split("error of the offset: ")[1].split()[0]) < 100
    assert (tmp_path / "camera_imu.png").stat().st_size > 10_000


def test_calibrating_camera_and_imu_from_files(tmp_path):
    from runpy import run_path

    example = run_path(str(EXAMPLES / "05_camera_imu_calibration.py"))
    _, recording, stamps, gyro, force = example["waved_rig"]()
    lines = [
        f"{view.time_ns},{i},{u},{v}"
        for view in recording.views
        for i, (u, v) in zip(view.ids, view.pixels_px, strict=True)
    ]
    (tmp_path / "corners.csv").write_text("\n".join(["timestamp_ns,id,u_px,v_px", *lines]) + "\n")
    heading = "time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2"
    rows = [",".join(map(str, (t, *w, *f))) for t, w, f in zip(stamps, gyro, force, strict=True)]
    (tmp_path / "imu.csv").write_text("\n".join([heading, *rows]) + "\n")
    rig = libloc.Rig()
    rig.cameras = [recording.camera]
    libloc.write_rig(tmp_path / "rig.yaml", rig)
    files = (tmp_path / "corners.csv", tmp_path / "imu.csv", "--target", "checkerboard 9x6 0.04")
    more = ("--rig", tmp_path / "rig.yaml", "--output", tmp_path)
    text = run("05_camera_imu_calibration.py", *files, *more)
    assert float(text.split("offset: ")[1].split()[0]) == pytest.approx(12300, abs=100)
    absent = (tmp_path / "absent.csv", *files[1:])
    assert "absent.csv" in run("05_camera_imu_calibration.py", *absent, *more, code=1)
