"""loc-calibrate camera-imu: recordings of every form to the rig, and what goes wrong on the way."""

from pathlib import Path

import loc
import numpy as np
import pytest
from libloc.lcm_log import LogWriter
from libloc.programs import calibrate, calibrate_camera_imu
from PIL import Image
from support import data_folder
from waved_rig import Waved, a_camera, write_corners, write_imu

import libloc

BOARD = ("--target", "checkerboard", "9x6", "0.06")
needs_vision = pytest.mark.skipif(not libloc.HAS_VISION, reason="built without OpenCV")

KALIBR_HEADING = "timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z"
EUROC_HEADING = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"
)


def write_rig(path: Path, rig: Waved) -> Path:
    libloc.write_rig(path, rig.rig())
    return path


def run(capsys, *arguments, code=0) -> str:
    assert calibrate.main(["camera-imu", *(str(a) for a in arguments)]) == code, capsys.readouterr()
    out = capsys.readouterr()
    assert "Traceback" not in out.err
    return out.out + out.err


@pytest.fixture(scope="module")
def waved() -> Waved:
    return Waved()


@pytest.fixture(scope="module")
def pair() -> Waved:
    """Two cameras of small pictures, for everything that looks at pictures."""
    return Waved(
        seconds=10,
        camera_hz=8,
        distance=1.1,
        turning=(0.5, 0.5, 0.9),
        seed=3,
        cameras=[a_camera("cam0", 0.6), a_camera("cam1", 0.6)],
    )


@pytest.fixture(scope="module")
def rendered(pair) -> list[list[np.ndarray]]:
    return [pair.renderings(camera) for camera in range(2)]


@pytest.fixture
def files(waved, tmp_path) -> list[Path]:
    return [
        write_corners(tmp_path / "corners.csv", waved),
        write_imu(tmp_path / "imu.csv", waved),
        write_rig(tmp_path / "rig.yaml", waved),
    ]


def test_corners_into_the_rig(files, waved, tmp_path, capsys):
    corners, imu, rig = files
    camchain = tmp_path / "camchain.yaml"
    report = tmp_path / "report"
    text = run(
        capsys, corners, imu, *BOARD, "--rig", rig, "--out", rig, "--camchain", camchain, "--report", report
    )
    assert "verdict ok" in text
    assert "in one sentence" in text
    assert "Good: where cam0 sits is known to" in text
    assert "CPU time" in text
    assert "memory at most" in text
    (found,) = libloc.read_rig(rig).cameras
    assert np.abs(waved.off_by_sigmas(found)).max() < 4
    assert (
        np.linalg.norm(found.T_body_camera.translation - waved.T_camera_imu[0].inverse().translation) < 3e-3
    )
    assert found.time_offset_s == pytest.approx(waved.time_offset_s, abs=2e-4)
    np.testing.assert_array_equal(found.intrinsics_px, a_camera().intrinsics_px)
    quality = found.mounting_quality
    assert (quality.verdict, quality.method) == (libloc.Verdict.OK, "camera-imu")
    assert quality.pictures > 90
    assert libloc.read_rig(rig).imu is not None
    # Kalibr's file says the same.
    (again,) = libloc.read_any_rig(camchain).cameras
    np.testing.assert_allclose(again.T_body_camera.matrix(), found.T_body_camera.matrix(), atol=1e-9)
    assert again.time_offset_s == pytest.approx(found.time_offset_s)
    assert (report / "report.html").is_file()
    assert "mounting of cam0" in (report / "report.html").read_text()


def test_options_reach_the_solution(files, waved, capsys):
    corners, imu, rig = files
    text = run(
        capsys,
        *(corners, imu, *BOARD, "--rig", rig, "--order", "4", "--rotation", "three-angles"),
        *("--knot-spacing", "0.03", "--refine-intrinsics", "--line-delay", "--drift", "--imu-matrices"),
        *("--gravity", "estimate", "--time-offset", "0.1", "--corner-sigma", "0.2", "--no-adapt-noise"),
        "--force",
    )
    assert "as asked for" in text
    assert "intrinsics of cam0 (refined)" in text
    assert "line delay" in text
    assert "held; one step" not in text
    assert "IMU: reading = matrix" in text
    # An offset that is known wrongly: nothing there turns alike.
    text = run(capsys, corners, imu, *BOARD, "--rig", rig, "--time-offset", "3", code=3)
    assert "Do not use this result" in text


def test_two_tables_and_units(pair, tmp_path, capsys):
    tables = [write_corners(tmp_path / f"cam{i}.csv", pair, i) for i in range(2)]
    imu = write_imu(tmp_path / "imu.csv", pair, KALIBR_HEADING)
    rig = write_rig(tmp_path / "rig.yaml", pair)
    text = run(capsys, *tables, "--imu", imu, *BOARD, "--rig", rig, "--camera", 0, 1, "--out", rig)
    assert "names not all units: ns, rad/s and m/s^2 were taken" in text
    cameras = libloc.read_rig(rig).cameras
    for i in range(2):
        assert np.abs(pair.off_by_sigmas(cameras[i], i)).max() < 4.5
    # Degrees that nobody has named: seen before anything is solved.
    degrees = write_imu(tmp_path / "degrees.csv", pair, KALIBR_HEADING, 180 / np.pi)
    text = run(capsys, *tables, degrees, *BOARD, "--rig", rig, "--camera", 0, 1, code=1)
    assert "deg/s" in text
    run(capsys, *tables, degrees, *BOARD, "--rig", rig, "--camera", 0, 1, "--gyroscope-unit", "deg/s")


@needs_vision
def test_folder_of_kalibr(pair, rendered, tmp_path, capsys):
    stamps = pair.picture_times()[1]
    for i, pictures in enumerate(rendered):
        (tmp_path / f"cam{i}").mkdir()
        for stamp, picture in zip(stamps, pictures, strict=True):
            Image.fromarray(picture).save(tmp_path / f"cam{i}" / f"{stamp}.png", compress_level=1)
    write_imu(tmp_path / "imu0.csv", pair, KALIBR_HEADING)
    libloc.CalibrationTarget("checkerboard 9x6 0.06").write_kalibr(tmp_path / "target.yaml")
    rig = tmp_path / "rig.yaml"
    text = run(
        capsys,
        *(tmp_path, "--target", tmp_path / "target.yaml", "--camera", 0, 1),
        *("--rig", write_rig(tmp_path / "in.yaml", pair), "--out", rig),
    )
    assert f"cam0.pictures.searched: {len(stamps)}" in text
    cameras = libloc.read_rig(rig).cameras
    for i in range(2):
        assert np.abs(pair.off_by_sigmas(cameras[i], i)).max() < 5
    # The same as a folder of one camera, with fewer pictures of it.
    text = run(
        capsys, tmp_path / "cam0", tmp_path / "imu0.csv", *BOARD, "--rig", rig, "--step", 2, "--out", rig
    )
    assert f"cam0.pictures.searched: {(len(stamps) + 1) // 2}" in text
    with_other_size = pair.rig()
    camera = a_camera("cam0", 0.5)
    with_other_size.cameras = [camera]
    libloc.write_rig(tmp_path / "other.yaml", with_other_size)
    text = run(
        capsys,
        *(tmp_path / "cam0", tmp_path / "imu0.csv", *BOARD, "--rig", tmp_path / "other.yaml"),
        code=1,
    )
    assert f"{tmp_path / 'cam0'}: 50 pictures of 384 x 240 pixels; cam0 of the rig has 320 x 200" in text


@needs_vision
def test_numbered_pictures_and_some_of_another_size(pair, rendered, tmp_path, capsys):
    folder = tmp_path / "pictures"
    folder.mkdir()
    for i, picture in enumerate(rendered[0]):
        Image.fromarray(picture).save(folder / f"frame_{i:03}.png", compress_level=1)
    inputs = (folder, write_imu(tmp_path / "imu.csv", pair), *BOARD)
    rig = write_rig(tmp_path / "rig.yaml", pair)
    text = run(capsys, *inputs, "--rig", rig, code=1)
    assert f"{folder}: when were its pictures taken? frame_000.png is no time" in text
    assert "give --rate-hz for numbered pictures" in text
    # Other sizes come later than the first.
    for i in (5, 17):
        Image.fromarray(rendered[0][i][:100, :200]).save(folder / f"frame_{i:03}.png")
    first_s = pair.picture_times()[1][0] / 10**9
    text = run(capsys, *inputs, "--rig", rig, "--rate-hz", 8, "--start-time", f"{first_s:.9f}", "--out", rig)
    count = len(rendered[0])
    assert f"cam0.pictures.searched: {count - 2}" in text
    assert "other_size: 2" in text
    assert "the offset of the clocks holds for this recording alone" in text
    assert np.abs(pair.off_by_sigmas(libloc.read_rig(rig).cameras[0])).max() < 5
    # Nobody knows when they began: the offset tells it, from the IMU's first sample on.
    text = run(capsys, *inputs, "--rig", rig, "--rate-hz", 8, "--out", rig)
    assert "pictures: the first picture was given the time of the first IMU sample" in text
    found = libloc.read_rig(rig).cameras[0]
    found.time_offset_s += float(pair.imu_times_ns[0] - pair.picture_times()[1][0]) * 1e-9
    assert np.abs(pair.off_by_sigmas(found)).max() < 5


@needs_vision
def test_euroc_folder_with_its_own_calibration(pair, rendered, tmp_path, capsys):
    mav = tmp_path / "mav0"
    (mav / "cam0" / "data").mkdir(parents=True)
    (mav / "imu0").mkdir()
    lines = ["#timestamp [ns],filename"]
    for stamp, picture in zip(pair.picture_times()[1], rendered[0], strict=True):
        Image.fromarray(picture).save(mav / "cam0" / "data" / f"{stamp}.png", compress_level=1)
        lines.append(f"{stamp},{stamp}.png")
    (mav / "cam0" / "data.csv").write_text("\n".join(lines) + "\n")
    write_imu(mav / "imu0" / "data.csv", pair, EUROC_HEADING)
    identity = "T_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
    c = pair.cameras[0]
    (mav / "cam0" / "sensor.yaml").write_text(
        f"%YAML:1.0\nsensor_type: camera\n{identity}rate_hz: 8\nresolution: [{c.width_px}, {c.height_px}]\n"
        f"camera_model: pinhole\nintrinsics: {c.intrinsics_px.tolist()}\n"
        f"distortion_model: radial-tangential\ndistortion_coefficients: {c.distortion.tolist()}\n"
    )
    (mav / "imu0" / "sensor.yaml").write_text(
        f"%YAML:1.0\nsensor_type: imu\n{identity}rate_hz: 200\n"
        "gyroscope_noise_density: 1.7e-4\ngyroscope_random_walk: 2.0e-5\n"
        "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n"
    )
    rig = tmp_path / "rig.yaml"
    text = run(capsys, tmp_path, *BOARD, "--out", rig)
    (found,) = libloc.read_rig(rig).cameras
    assert np.abs(pair.off_by_sigmas(found)).max() < 4
    assert "by intrinsics" in text  # nobody said how well they are known
    text = run(capsys, tmp_path, *BOARD, "--camera", 1, code=1)
    assert "cam" in text


@needs_vision
def test_lcm_log(pair, rendered, tmp_path, capsys):
    log = tmp_path / "run.lcm"
    stamps = pair.picture_times()[1]
    events = [(int(t), "imu", i) for i, t in enumerate(pair.imu_times_ns)]
    events += [(int(t), "image", i) for i, t in enumerate(stamps)]
    with LogWriter(log) as writer:
        for t, kind, i in sorted(events):
            if kind == "imu":
                m = loc.imu_t()
                m.time_ns, m.host_time_ns, m.sequence = t, t, i
                m.angular_velocity, m.specific_force = (
                    list(pair.angular_velocity[i]),
                    list(pair.specific_force[i]),
                )
                writer.write("LOC_IMU", m, t // 1000)
            else:
                p = loc.image_t()
                p.time_ns, p.host_time_ns, p.sequence, p.camera = t, t, i, 0
                p.height, p.width = rendered[0][i].shape
                p.row_stride, p.pixelformat = p.width, p.PIXEL_FORMAT_GRAY
                p.data = rendered[0][i].tobytes()
                p.size = len(p.data)
                writer.write("LOC_IMAGE", p, t // 1000)
    rig = write_rig(tmp_path / "rig.yaml", pair)
    run(capsys, log, *BOARD, "--rig", rig, "--out", rig)
    assert np.abs(pair.off_by_sigmas(libloc.read_rig(rig).cameras[0])).max() < 4.5
    assert "there are no pictures of camera 1" in run(
        capsys, log, *BOARD, "--rig", rig, "--camera", 1, code=1
    )


def test_what_cannot_be_is_said(files, waved, tmp_path, capsys):
    corners, imu, rig = files

    def said(*arguments, code=1) -> str:
        return run(capsys, *arguments, code=code)

    assert "no IMU in INPUT" in said(corners, *BOARD, "--rig", rig)
    assert "neither pictures nor a table" in said(imu, *BOARD, "--rig", rig)
    assert "gives the IMU already" in said(corners, imu, imu, *BOARD, "--rig", rig)
    assert "no such file" in said(tmp_path / "absent", imu, *BOARD, "--rig", rig)
    assert "none with number 1" in said(corners, imu, *BOARD, "--rig", rig, "--camera", 1)
    assert "2 tables" not in said(corners, imu, *BOARD, "--rig", rig, "--camera", 0, 1)
    assert "name a file with its intrinsics" in said(corners, imu, *BOARD)
    broken = tmp_path / "broken.csv"
    broken.write_text(corners.read_text().replace("corner_id", "corner"))
    assert "broken.csv:1: the heading must name" in said(broken, imu, *BOARD, "--rig", rig)
    rows = corners.read_text().splitlines()
    broken.write_text("\n".join([*rows[:5], "17,3,nan,4", *rows[5:]]) + "\n")
    assert "broken.csv:6: corner 3 at (nan, 4.0)" in said(broken, imu, *BOARD, "--rig", rig)
    broken.write_text("\n".join([*rows[:5], "soon,3,3,4", *rows[5:]]) + "\n")
    assert "timestamp_ns 'soon'" in said(broken, imu, *BOARD, "--rig", rig)
    for wrong in (["--camera", "0", "0"], ["--order", "2"], ["--gravity", "-1"], ["--time-limit", "0"]):
        with pytest.raises(SystemExit) as usage:
            calibrate.main(["camera-imu", str(corners), str(imu), *BOARD, *wrong])
        assert usage.value.code == 2
    capsys.readouterr()


def test_one_axis_is_refused_with_the_reason(tmp_path, capsys):
    rig = Waved(turning=(1, 0, 0))
    arguments = (
        write_corners(tmp_path / "corners.csv", rig),
        write_imu(tmp_path / "imu.csv", rig),
        *BOARD,
        "--rig",
        write_rig(tmp_path / "rig.yaml", rig),
        "--out",
        tmp_path / "out.yaml",
    )
    assert "one axis only" in run(capsys, *arguments, code=1)
    assert not (tmp_path / "out.yaml").exists()


def test_interrupted_keeps_the_best_so_far(files, monkeypatch, tmp_path, capsys):
    corners, imu, rig = files
    calls = []

    def stop(_self, at) -> bool:
        calls.append(at)
        return len(calls) < 2

    monkeypatch.setattr(calibrate_camera_imu._SolverProgress, "__call__", stop)
    out = tmp_path / "out.yaml"
    text = run(capsys, corners, imu, *BOARD, "--rig", rig, "--out", out, code=3)
    assert "stopped (interrupted): this is the best so far" in text
    assert "Do not use this result" in text
    assert not out.exists()
    calls.clear()
    run(capsys, corners, imu, *BOARD, "--rig", rig, "--out", out, "--force")
    assert libloc.read_rig(out).cameras[0].mounting_quality.verdict == libloc.Verdict.REFUSED


def test_real_recording(tmp_path, capsys):
    """EuRoC's: bars of other tools, which disagree by 8 mm and 0.34 deg among themselves."""
    folder = data_folder("euroc-cam-imu-calibration")
    camera = libloc.CameraCalibration()
    camera.name, camera.width_px, camera.height_px, camera.rate_hz = "cam0", 752, 480, 20
    camera.intrinsics_px = [458.654, 457.296, 367.215, 248.375]
    camera.distortion_model = libloc.DistortionModel.RADTAN
    camera.distortion = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
    rig = libloc.Rig()
    rig.cameras = [camera]
    path = tmp_path / "rig.yaml"
    libloc.write_rig(path, rig)
    text = run(
        capsys,
        *(folder / "cam0_corners.csv", folder / "imu0.csv", "--target", "aprilgrid", "6x6", "0.088", "0.3"),
        *("--rig", path, "--out", path),
    )
    assert "Doubtful: where cam0 sits" in text
    assert "This recording would change the intrinsics by up to" in text
    assert "the rig says nothing of the IMU's noise" in text
    assert "nobody has measured" not in text  # the same again
    (found,) = libloc.read_rig(path).cameras
    euroc = [-0.0216401454975, -0.064676986768, 0.00981073058949]
    basalt = [-0.01677, -0.06894, 0.00514]
    assert np.linalg.norm(found.T_body_camera.translation - euroc) < 0.010
    assert np.linalg.norm(found.T_body_camera.translation - basalt) < 0.003
