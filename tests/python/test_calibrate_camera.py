"""loc-calibrate camera: from rendered and real pictures to the rig, and what goes wrong on the way."""

import os
from pathlib import Path

import loc
import numpy as np
import pytest
from libloc.lcm_log import LogWriter
from libloc.programs import calibrate, calibrate_images
from PIL import Image
from support import data_folder

import libloc

BOARD = ("checkerboard", "9x6", "0.06")
MIDDLE = np.array([0.24, 0.15, 0.0])

needs_vision = pytest.mark.skipif(not libloc.HAS_VISION, reason="built without OpenCV")


def camera() -> libloc.CameraCalibration:
    c = libloc.CameraCalibration()
    c.name, c.width_px, c.height_px = "cam0", 640, 400
    c.intrinsics_px = [400, 401, 322, 197]
    c.distortion_model = libloc.DistortionModel.RADTAN
    c.distortion = [-0.25, 0.06, 2e-4, -1e-4]
    return c


def poses(count: int) -> list[libloc.Pose3]:
    """Of a camera that looks at the board from all sides."""
    rng = np.random.default_rng(4)
    out = []
    for _ in range(count):
        aside = [*rng.uniform(-0.25, 0.25, 2) * [1, 0.6], rng.uniform(0.55, 0.9)]
        about_middle = libloc.Pose3(libloc.so3.exp(rng.uniform(-0.6, 0.6, 3)), MIDDLE)
        out.append(about_middle * libloc.Pose3([0, 1, 0, 0], aside))
    return out


@pytest.fixture(scope="module")
def rendered() -> list[np.ndarray]:
    scene = libloc.checkerboard(columns=9, rows=6, square_m=0.06)
    renderer = libloc.SceneRenderer(scene, camera(), noise_sigma=2.0)
    random = libloc.Random(1)
    return [renderer.render(pose, random) for pose in poses(14)]


@pytest.fixture(scope="module")
def folder(rendered, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("pictures")
    for i, picture in enumerate(rendered):
        Image.fromarray(picture).save(path / f"{i:03}.png")
    return path


def run(capsys, *arguments, code=0) -> str:
    assert calibrate.main(["camera", *(str(a) for a in arguments)]) == code, capsys.readouterr()
    out = capsys.readouterr()
    assert "Traceback" not in out.err
    return out.out + out.err


def looks_like_the_camera(found: libloc.CameraCalibration) -> None:
    assert np.abs(found.intrinsics_px - camera().intrinsics_px).max() < 1.0
    assert np.abs(found.distortion - camera().distortion).max() < 0.01


@needs_vision
def test_pictures_into_the_rig(folder, tmp_path, capsys):
    rig = tmp_path / "rig.yaml"
    text = run(capsys, folder, "--target", *BOARD, "--out", rig, "--report", tmp_path / "report")
    assert "14 of 14 pictures with the target" in text
    assert "verdict" in text
    (found,) = libloc.read_rig(rig).cameras
    assert (found.name, found.width_px, found.height_px) == ("cam0", 640, 400)
    looks_like_the_camera(found)
    quality = found.intrinsics_quality
    assert (quality.method, quality.pictures) == ("target", 14)
    assert quality.verdict == libloc.Verdict.FAIR
    assert quality.reasons
    assert all(reason in text for reason in quality.reasons)
    assert 0.01 < quality.reprojection_rms_px < 0.1
    for error, sigma in (
        (found.intrinsics_px - camera().intrinsics_px, quality.intrinsics_sigma_px),
        (found.distortion - camera().distortion, quality.distortion_sigma),
    ):
        assert (sigma > 0).all()
        assert (np.abs(error) < 4 * sigma).all()
    names = {path.name for path in (tmp_path / "report").iterdir()}
    assert names == {"report.html", "coverage.png", "residuals.png", "pictures.png", "uncertainty.png"}

    def mount(rig: libloc.Rig) -> None:
        cameras = rig.cameras
        cameras[0].T_body_camera = libloc.Pose3([1, 0, 0, 0], [0.1, 0, 0])
        cameras[0].intrinsics_px = [1, 1, 1, 1]
        rig.cameras = cameras

    libloc.update_rig(rig, mount)
    run(capsys, folder, "--target", *BOARD, "--out", rig)
    (found,) = libloc.read_rig(rig).cameras
    looks_like_the_camera(found)
    assert found.T_body_camera.translation[0] == 0.1  # its place stays
    run(capsys, folder, "--target", *BOARD, "--out", rig, "--name", "right", "--model", "equidistant")
    names = [(c.name, c.distortion_model) for c in libloc.read_rig(rig).cameras]
    assert names == [
        ("cam0", libloc.DistortionModel.RADTAN),
        ("right", libloc.DistortionModel.EQUIDISTANT),
    ]


@needs_vision
def test_what_is_no_good_is_left_out_and_named(folder, rendered, tmp_path, capsys):
    for path in sorted(folder.iterdir()):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "900.png").write_bytes((folder / "000.png").read_bytes()[:3000])
    (tmp_path / "901.png").write_text("no picture")
    Image.fromarray(rendered[0][:300]).save(tmp_path / "902.png")
    Image.fromarray(np.full((400, 640), 128, np.uint8)).save(tmp_path / "903.png")
    Image.fromarray((rendered[3].astype(np.uint16) << 8) | 77).save(tmp_path / "904.png")  # 16 bits
    text = run(capsys, tmp_path, "--target", *BOARD)
    assert "pictures.skipped.unreadable: 2" in text
    assert "pictures.skipped.other_size: 1" in text
    assert "902.png has 640 x 300 pixels" in text
    assert "1 pictures without the target: 903.png" in text
    assert "15 of 15 pictures with the target" in text


@needs_vision
def test_logs_and_the_choice_of_pictures(rendered, tmp_path, capsys):
    log = tmp_path / "run.lcm"
    with LogWriter(log) as writer:
        for i, picture in enumerate(rendered):
            m = loc.image_t()
            m.time_ns, m.camera = i * 100_000_000, i % 2
            m.height, m.width = picture.shape
            m.row_stride, m.pixelformat = m.width, m.PIXEL_FORMAT_GRAY
            m.data = picture.tobytes()
            m.size = len(m.data)
            writer.write("LOC_IMAGE", m, i * 100_000)
    text = run(capsys, log, "--target", *BOARD, "--camera", "1", "--max-views", "5")
    assert "pictures.searched: 7" in text
    assert "5 pictures were chosen" in text
    text = run(capsys, log, "--target", *BOARD, "--camera", "3", code=1)
    assert "no pictures of camera 3" in text


@needs_vision
def test_video(rendered, tmp_path, capsys):
    av = pytest.importorskip("av")
    path = tmp_path / "board.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=10)
        stream.height, stream.width = rendered[0].shape
        stream.pix_fmt = "gray"
        for picture in rendered:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="gray")))
        container.mux(stream.encode())
    text = run(capsys, path, "--target", *BOARD, "--out", tmp_path / "rig.yaml")
    assert "14 of 14 pictures with the target" in text
    looks_like_the_camera(libloc.read_rig(tmp_path / "rig.yaml").cameras[0])


@needs_vision
def test_interrupted_search_goes_on_with_what_it_has(folder, tmp_path, capsys, monkeypatch):
    target = libloc.CalibrationTarget(" ".join(BOARD))

    class Interrupting:
        def __init__(self, *arguments) -> None:
            self._detector = detector(*arguments)
            self._left = 6

        def detect(self, picture):
            self._left -= 1
            if self._left < 0:
                raise KeyboardInterrupt
            return self._detector.detect(picture)

    detector = libloc.TargetDetector
    monkeypatch.setattr(calibrate_images.libloc, "TargetDetector", Interrupting)
    items, total = calibrate_images.pictures([folder], 0, None)
    corners = calibrate_images.find_corners(target, items, total)
    assert corners.interrupted
    assert len(corners.views) == 6
    text = run(capsys, folder, "--target", *BOARD)
    assert "interrupted: 6 pictures were searched" in text


@needs_vision
def test_errors_say_what_to_do(folder, tmp_path, capsys):
    some = sorted(folder.iterdir())[:2]
    text = run(capsys, *some, "--target", "checkerboard", "10x7", "0.06", code=1)
    assert "none of 2 pictures" in text
    assert "A board of 9x6 is: inner corners are counted, not squares." in text
    text = run(capsys, tmp_path / "nothing", "--target", *BOARD, code=1)
    assert "no such file" in text
    text = run(capsys, tmp_path, "--target", *BOARD, code=1)
    assert "there are no pictures in it" in text
    (tmp_path / "film.mp4").write_bytes(b"no film")
    text = run(capsys, tmp_path / "film.mp4", "--target", *BOARD, code=1)
    assert "film.mp4" in text
    text = run(capsys, *some, "--target", *BOARD, code=1)
    assert "at least 3 are needed" in text
    for words in (("checkerboard", "9x6"), ("target.yaml",), ("circles", "4x4", "1")):
        with pytest.raises(SystemExit) as stop:
            run(capsys, folder, "--target", *words)
        assert stop.value.code == 2
        assert "--target" in capsys.readouterr().err


@needs_vision
def test_three_pictures_from_one_direction_are_refused(tmp_path, capsys):
    renderer = libloc.SceneRenderer(libloc.checkerboard(columns=9, rows=6, square_m=0.06), camera())
    for i in range(4):
        pose = libloc.Pose3([0, 1, 0, 0], MIDDLE + np.array([0.03 * i, 0.02 * i, 0.7]))
        Image.fromarray(renderer.render(pose)).save(tmp_path / f"{i}.png")
    rig = tmp_path / "rig.yaml"
    text = run(capsys, tmp_path, "--target", *BOARD, "--out", rig, code=3)
    assert "one direction" in text
    assert not rig.exists()
    run(capsys, tmp_path, "--target", *BOARD, "--out", rig, "--force")
    assert len(libloc.read_rig(rig).cameras) == 1


def test_table_of_corners(tmp_path, capsys):
    heading, *lines = (data_folder("euroc-cam-imu-calibration") / "cam0_corners.csv").read_text().splitlines()
    times = dict.fromkeys(line.split(",")[0] for line in lines)
    kept = set(list(times)[::12])
    table = tmp_path / "corners.csv"
    table.write_text("\n".join([heading, *(line for line in lines if line.split(",")[0] in kept)]) + "\n")
    target = tmp_path / "target.yaml"
    libloc.CalibrationTarget("aprilgrid 6x6 0.088 0.3").write_kalibr(target)
    rig = tmp_path / "rig.yaml"
    arguments = (table, "--size", "752x480", "--target", target, "--max-views", "60", "--out", rig)
    text = run(capsys, *arguments)
    assert "60 of 118 pictures" in text
    (found,) = libloc.read_rig(rig).cameras
    assert np.abs(found.intrinsics_px[:2] / [458.654, 457.296] - 1).max() < 0.015
    for line in ("5,40,0,1,2,0,0,0", "5,1,0,nan,2,0,0,0", "5,1,0"):
        bad = tmp_path / "bad.csv"
        bad.write_text("timestamp_ns,tag_id,corner_index,u_px,v_px,x,y,z\n" + line + "\n")
        text = run(capsys, bad, "--size", "752x480", "--target", target, code=1)
        assert "bad.csv:2" in text


def test_calibration_on_arrays():
    target = libloc.CalibrationTarget(" ".join(BOARD))
    lens = libloc.Camera(camera())
    rng = np.random.default_rng(2)
    views = []
    for pose in poses(20):
        points = (pose.inverse().matrix() @ np.c_[target.corners(), np.ones(54)].T).T[:, :3]
        pixels = lens.project(np.ascontiguousarray(points))
        seen = lens.in_image(pixels)
        ids = np.flatnonzero(seen).astype(np.int64)
        views.append(libloc.TargetView(ids, pixels[seen] + 0.1 * rng.normal(size=(len(ids), 2))))
    fit = libloc.calibrate_camera(target, views, 640, 400)
    assert fit.converged
    assert fit.views_used == 20
    error = np.r_[
        fit.camera.intrinsics_px - camera().intrinsics_px, fit.camera.distortion - camera().distortion
    ]
    assert np.all(np.abs(error) < 5 * fit.sigma)
    assert fit.uncertainty_px.shape == (9, 12)
    assert fit.corner_pixel_px.shape == fit.corner_residual_px.shape == (len(fit.corner_used), 2)
    assert abs(fit.corner_residual_px.std() - 0.1) < 0.01
    with pytest.raises(libloc.DataError, match="at least 3"):
        libloc.calibrate_camera(target, views[:2], 640, 400)
    with pytest.raises(ValueError, match="corner_limit"):
        libloc.calibrate_camera(target, views, 640, 400, libloc.CameraFitOptions(corner_limit=0))


@needs_vision
def test_real_checkerboards():
    pictures = Path(os.environ.get("LIBLOC_OPENCV_DOC", "/usr/share/doc/opencv-doc/examples/data"))
    if not (pictures / "left01.jpg").exists():
        pytest.skip(f"no pictures in {pictures} (Debian: opencv-doc; LIBLOC_OPENCV_DOC names the folder)")
    target = libloc.CalibrationTarget("checkerboard 9x6 0.025")
    items, total = calibrate_images.pictures(sorted(pictures.glob("left[01]*.jpg")), 0, None)
    corners = calibrate_images.find_corners(target, items, total)
    fit = libloc.calibrate_camera(target, corners.views, corners.width_px, corners.height_px)
    assert fit.views_used == total == 13
    assert fit.rms_px < 0.2
    assert abs(fit.camera.intrinsics_px[0] - 533) < 2
