"""What loc-calibrate camera-imu makes of files that are not as they should be."""

import argparse
from pathlib import Path
from types import SimpleNamespace

import loc
import numpy as np
import pytest
from libloc.lcm_log import LogWriter
from libloc.programs import calibrate, calibrate_camera_imu
from libloc.programs import calibrate_camera_imu_input as reading
from libloc.programs.calibrate_images import read_corner_table
from libloc.programs.calibrate_input import InputOptions
from PIL import Image
from waved_rig import IMU_HEADING, START_NS, Waved, a_camera, imu_rows, write_corners, write_imu

import libloc

BOARD = ("--target", "checkerboard", "9x6", "0.06")
TAGS = libloc.CalibrationTarget("aprilgrid 6x6 0.088 0.3 100")
HEADING = "timestamp_ns,tag_id,corner_index,u_px,v_px"
needs_vision = pytest.mark.skipif(not libloc.HAS_VISION, reason="built without OpenCV")


@pytest.fixture(scope="module")
def waved() -> Waved:
    return Waved()


@pytest.fixture
def files(waved, tmp_path) -> tuple[Path, Path, Path]:
    imu = write_imu(tmp_path / "imu.csv", waved)
    rig = tmp_path / "rig.yaml"
    libloc.write_rig(rig, waved.rig())
    return write_corners(tmp_path / "corners.csv", waved), imu, rig


def run(capsys, *arguments, code=0) -> str:
    assert calibrate.main(["camera-imu", *(str(a) for a in arguments)]) == code, capsys.readouterr()
    out = capsys.readouterr()
    assert "Traceback" not in out.err
    return out.out + out.err


def table(path: Path, *rows: str, end: str = "\n") -> Path:
    path.write_text("\n".join([HEADING, *rows]) + end)
    return path


def test_corner_table_carries_times_in_the_order_of_the_file(tmp_path):
    path = table(tmp_path / "c.csv", "20,100,1,3,4", "20,100,0,1,2", "10,101,3,5,6", " 20,135,2,7,8")
    corners = read_corner_table(path, TAGS, 752, 480)
    assert [view.time_ns for view in corners.views] == [20, 10]
    assert [view.ids.tolist() for view in corners.views] == [[0, 1, 142], [7]]
    assert corners.views[0].pixels_px.tolist() == [[1, 2], [3, 4], [7, 8]]
    # Cut while it was written: 33.25 may have been on its way.
    path = table(tmp_path / "c.csv", "20,100,1,3,4", "20,100,0,1,33.2", end="")
    corners = read_corner_table(path, TAGS, 752, 480)
    assert corners.views[0].ids.tolist() == [1]
    assert corners.counts["rows.skipped.no_line_end"] == 1


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("5,99,0,1,2", "c.csv:3: corner 0 of tag 99"),
        ("5,100,4,1,2", "c.csv:3: corner 4 of tag 100"),  # not corner 0 of tag 101
        ("5,101,-1,1,2", "c.csv:3: corner -1 of tag 101"),
        ("5,100,0,inf,2", "c.csv:3: corner 0 of tag 100"),
        ("5,100,0,1", "c.csv:3: 4 cells, not 5"),
        ("5,100,0,1,2,3", "c.csv:3: 6 cells, not 5"),
        ("5,100,0,x,2", "c.csv:3: .*'x'"),
        ("5.5,100,0,1,2", "c.csv:3: timestamp_ns '5.5'"),
        ("99999999999999999999,100,0,1,2", "c.csv:3: timestamp_ns .* out of range"),
        ("1,100,0,1,2", "c.csv:3: corner 0 comes twice in the picture of 1"),
    ],
)
def test_corner_table_names_the_line(tmp_path, row, message):
    path = table(tmp_path / "c.csv", "1,100,0,1,2", row, "9,100,0,1,2")
    with pytest.raises(libloc.DataError, match=message):
        read_corner_table(path, TAGS, 752, 480)


def test_cameras_are_found_by_their_names():
    def named(*names: str) -> libloc.Rig:
        rig = libloc.Rig()
        rig.cameras = [a_camera(name) for name in names]
        return rig

    def found(rig: libloc.Rig, *numbers: int) -> list[str]:
        return [camera.name for camera in reading.cameras_of(rig, list(numbers))]

    assert found(named("cam1", "cam0"), 0, 1) == ["cam0", "cam1"]
    assert found(named("left", "right"), 1) == ["right"]
    assert found(named("cam1"), 1) == ["cam1"]
    # Intrinsics of another camera are never taken.
    with pytest.raises(libloc.DataError, match=r"1 cameras \(cam1\), none with number 0"):
        found(named("cam1"), 0)
    with pytest.raises(libloc.DataError, match="0 cameras, none with number 0"):
        found(named(), 0)


def test_rig_of_several_files(tmp_path):
    paths = []
    for i in range(2):
        rig = libloc.Rig()
        rig.cameras = [a_camera(f"cam{i}")]
        if i:
            rig.imu = libloc.ImuCalibration()
        paths.append(tmp_path / f"{i}.yaml")
        libloc.write_rig(paths[-1], rig)
    rig = reading.read_rig(paths, None, [0, 1])
    assert [camera.name for camera in rig.cameras] == ["cam0", "cam1"]
    assert rig.imu is not None
    with pytest.raises(libloc.DataError, match=r"0.yaml: cam0 is in another file already"):
        reading.read_rig([*paths, paths[0]], None, [0, 1])
    rig.cameras = []
    libloc.write_rig(tmp_path / "imu.yaml", rig)
    with pytest.raises(libloc.DataError, match=r"imu.yaml: the IMU is in another file already"):
        reading.read_rig([*paths, tmp_path / "imu.yaml"], None, [0, 1])


def test_readings_are_corrected_by_the_rig(files, waved, tmp_path, capsys):
    corners, imu, path = files
    twice = np.hstack([waved.angular_velocity * 2 + 0.3, waved.specific_force * 0.5 - 1]).tolist()
    rows = [f"{t}," + ",".join(map(repr, row)) for t, row in zip(waved.imu_times_ns, twice, strict=True)]
    imu.write_text("\n".join([IMU_HEADING, *rows]) + "\n")
    rig = waved.rig()
    calibration = libloc.ImuCalibration()
    for name, scale, bias in (("gyroscope", 0.5, 0.3), ("accelerometer", 2.0, -1.0)):
        triad = libloc.TriadCalibration()
        triad.matrix, triad.bias = scale * np.eye(3), np.full(3, bias)
        setattr(calibration, name, triad)
    rig.imu = calibration
    libloc.write_rig(path, rig)
    data = reading.read_input(
        [corners, imu], [0], [path], None, libloc.CalibrationTarget("checkerboard 9x6 0.06"), InputOptions()
    )
    np.testing.assert_allclose(data.angular_velocity, waved.angular_velocity, atol=1e-12)
    np.testing.assert_allclose(data.specific_force, waved.specific_force, atol=1e-12)
    np.testing.assert_allclose(data.as_read, (np.array(twice)[:, :3], np.array(twice)[:, 3:]))
    text = run(capsys, corners, imu, *BOARD, "--rig", path, "--out", path)
    assert "usual MEMS" not in text
    (found,) = libloc.read_rig(path).cameras
    assert np.abs(waved.off_by_sigmas(found)).max() < 4
    np.testing.assert_array_equal(libloc.read_rig(path).imu.gyroscope.bias, np.full(3, 0.3))  # stays


def test_saturation_is_seen_in_the_readings_as_read(files, waved):
    corners, imu, path = files
    target = libloc.CalibrationTarget("checkerboard 9x6 0.06")
    data = reading.read_input([corners, imu], [0], [path], None, target, InputOptions())
    data.rate_hz = 100  # not what it is: 200
    options = argparse.Namespace(target=target, force=False, step=1)
    before = [finding.code for finding in calibrate_camera_imu._lint(data, options)]
    assert {"camera.rate_not_nominal", "imu.rate_not_nominal"} <= set(before)
    options.step = 2  # asked for
    before.remove("camera.rate_not_nominal")
    # The sensor's axes are not those of the body, where its limit is no single number.
    data.as_read = (np.clip(4 * waved.angular_velocity, -2, 2), waved.specific_force)
    findings = calibrate_camera_imu._lint(data, options)
    assert [finding.code for finding in findings] == [*before, "imu.saturated"]
    verdict, reasons = calibrate_camera_imu._judged(
        SimpleNamespace(quality=SimpleNamespace(verdict=libloc.Verdict.OK, reasons=["fine"])), findings
    )
    assert verdict == libloc.Verdict.WARN
    assert reasons == ["fine", *(f.text for f in findings if f.severity == libloc.Verdict.WARN)]


def test_imu_that_is_no_imu(files, waved, tmp_path, capsys):
    corners, imu, rig = files
    rows = imu_rows(waved)

    def said(*lines: str, end: str = "\n", code: int = 1) -> str:
        imu.write_text("\n".join(lines) + end)
        return run(capsys, corners, imu, *BOARD, "--rig", rig, code=code)

    halves = ["time_ns,wx_rad_s,wy_rad_s,wz_rad_s", *(",".join(row.split(",")[:4]) for row in rows)]
    assert "no accelerometer in it" in said(*halves)
    assert "imu.csv:3" in said(IMU_HEADING, rows[0], "soon,1,2,3,4,5,6", *rows[2:])
    assert "no such file" in run(capsys, corners, tmp_path / "none.csv", *BOARD, "--rig", rig, code=1)
    # What is skipped is counted, and the rest is used.
    text = said(IMU_HEADING, *rows[:900], rows[850], "1,nan,0,0,0,0,9.8", *rows[900:], end="", code=0)
    assert "no_line_end: 1" in text
    assert "skipped" in text


def test_findings_come_with_the_result(files, waved, tmp_path, capsys):
    corners, imu, rig = files
    # Half of all readings repeat the one before: to be used with care, whatever the solution says.
    rows = imu_rows(waved)
    held = [
        row if i % 2 == 0 else f"{row.split(',')[0]}," + rows[i - 1].split(",", 1)[1]
        for i, row in enumerate(rows)
    ]
    imu.write_text("\n".join([IMU_HEADING, *held]) + "\n")
    out = tmp_path / "out.yaml"
    text = run(capsys, corners, imu, *BOARD, "--rig", rig, "--out", out, "--force")
    quality = libloc.read_rig(out).cameras[0].mounting_quality
    assert quality.verdict in (libloc.Verdict.WARN, libloc.Verdict.REFUSED)
    assert any(reason in text and "to the last bit" in reason for reason in quality.reasons), quality.reasons
    assert "Good:" not in text
    # Gravity taken away: refused, but tried when that is wanted.
    flat = [f"{t},0.1,0.2,{i % 7},0,0,0" for i, t in enumerate(waved.imu_times_ns)]
    imu.write_text("\n".join([IMU_HEADING, *flat]) + "\n")
    text = run(capsys, corners, imu, *BOARD, "--rig", rig, code=1)
    assert "error: " in text
    assert "--force tries all the same" in text


def test_the_written_rig_fits_the_intrinsics(files, waved, tmp_path, capsys):
    corners, imu, rig = files
    out = tmp_path / "out.yaml"
    other = waved.rig()
    camera = a_camera("cam0")
    camera.intrinsics_px = [410, 411, 322, 197]
    other.cameras = [camera]
    libloc.write_rig(out, other)
    before = out.read_bytes()
    text = run(capsys, corners, imu, *BOARD, "--rig", rig, "--out", out, code=1)
    assert "out.yaml: cam0 has other intrinsics there" in text
    assert out.read_bytes() == before
    # Those that are refined are written with the mounting.
    run(capsys, corners, imu, *BOARD, "--rig", rig, "--out", out, "--refine-intrinsics", "--force")
    (found,) = libloc.read_rig(out).cameras
    assert np.abs(found.intrinsics_px - a_camera().intrinsics_px).max() < 3
    assert found.intrinsics_quality.method == "camera-imu"
    # Other cameras of the file stay.
    camera.name = "cam7"
    other.cameras = [camera]
    libloc.write_rig(out, other)
    camchain = tmp_path / "chain.yaml"
    text = run(capsys, corners, imu, *BOARD, "--rig", rig, "--out", out, "--camchain", camchain)
    assert f"camchain was written to {camchain}" in text
    cameras = libloc.read_rig(out).cameras
    assert [c.name for c in cameras] == ["cam7", "cam0"]
    assert cameras[0].mounting_quality is None
    with pytest.raises(SystemExit) as usage:
        run(capsys, corners, imu, *BOARD, "--rig", rig, "--camchain", tmp_path)
    assert usage.value.code == 2
    assert "is a folder" in capsys.readouterr().err


def test_ctrl_c_within_the_progress_line_stops_the_solver(monkeypatch):
    class Terminal:
        def isatty(self) -> bool:
            return True

        def write(self, text: str) -> None:
            if "solving" in text:
                raise KeyboardInterrupt

        def flush(self) -> None:
            pass

    monkeypatch.setattr(calibrate_camera_imu.sys, "stderr", Terminal())
    waved = Waved(seconds=6)
    fit = libloc.calibrate_camera_imu(
        waved.target,
        [libloc.CameraRecording(waved.cameras[0], waved.views())],
        waved.imu_times_ns,
        waved.angular_velocity,
        waved.specific_force,
        progress=calibrate_camera_imu._SolverProgress(),
    )
    assert fit.stopped == "interrupted"


@needs_vision
def test_pictures_that_cannot_be_used_and_ctrl_c_in_the_search(tmp_path, monkeypatch, capsys):
    target = libloc.CalibrationTarget("checkerboard 9x6 0.06")
    waved = Waved(seconds=3, camera_hz=4, cameras=[a_camera("cam0", 0.6)])
    renderings = waved.renderings()
    log = tmp_path / "run.lcm"
    with LogWriter(log) as writer:
        for i, (stamp, picture) in enumerate(zip(waved.picture_times()[1], renderings, strict=True)):
            m = loc.image_t()
            m.time_ns, m.camera, m.sequence = int(stamp), 0, i
            if i in (0, 4):
                picture = picture[:100, : 200 + i]
            m.height, m.width = picture.shape
            m.row_stride, m.pixelformat, m.data = m.width, m.PIXEL_FORMAT_GRAY, picture.tobytes()
            if i == 2:
                m.row_stride, m.pixelformat, m.data = 0, m.PIXEL_FORMAT_MJPEG, b"\xff\xd8 no picture"
            m.size = len(m.data)
            writer.write("LOC_IMAGE", m, (int(stamp) - START_NS) // 1000)
    counts: dict[str, int] = {}
    source = (log, {"camera": 0})
    found, interrupted = reading.find_views(target, source, waved.cameras[0], 1, counts)
    assert not interrupted
    assert counts["cam0.pictures.skipped.damaged"] == 1
    assert counts["cam0.pictures.skipped.other_size"] == 2
    assert reading._of_other_size(found).startswith(
        "2 pictures of 200 x 100, 204 x 100 pixels; cam0 of the rig has 384 x 240: intrinsics hold"
    )
    assert len(found.views) == counts["cam0.pictures.searched"] == len(renderings) - 3
    assert int(waved.picture_times()[1][2]) not in [view.time_ns for view in found.views]
    assert "picture of" in found.damaged[0]

    class Interrupting:
        def __init__(self, *arguments) -> None:
            self._detector = detector(*arguments)
            self._left = 3

        def detect(self, picture):
            self._left -= 1
            if self._left < 0:
                raise KeyboardInterrupt
            return self._detector.detect(picture)

    detector = libloc.TargetDetector
    monkeypatch.setattr(reading.libloc, "TargetDetector", Interrupting)
    found, interrupted = reading.find_views(target, source, waved.cameras[0], 1, counts)
    assert interrupted
    assert len(found.views) == 3
    capsys.readouterr()


def test_what_is_what_in_input(tmp_path):
    """By content, in any order."""

    def file(name: str, text: str = "x") -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def sorted_out(
        *inputs: Path, cameras: tuple[int, ...] = (0,), imu: Path | None = None, unit: str | None = None
    ):
        out = reading.sources_of(list(inputs), list(cameras), imu, reading.PictureTimes(name_unit=unit))
        return out.pictures, out.tables, out.imu

    imu = file("imu.csv", IMU_HEADING + "\n")
    named = file("named/123.png").parent
    assert sorted_out(imu, named, unit="us") == ([(named, {"name_unit": "us"})], [], imu)
    right = file("right/123.png").parent
    both = [(right, {"name_unit": "ns"}), (named, {"name_unit": "ns"})]
    assert sorted_out(right, imu, named, cameras=(0, 1)) == (both, [], imu)
    index = file("listed/data.csv")
    file("listed/1.png")
    assert sorted_out(index.parent, imu) == ([(index.parent, {"times_file": index})], [], imu)
    index = file("cam0/data.csv")
    data = file("cam0/data/1.png").parent
    expected = ([(data, {"times_file": index})], [], imu)
    assert sorted_out(index.parent, imu) == sorted_out(data, imu) == expected
    # A recording with an IMU of its own: a file that is named is taken before it.
    euroc = file("run/mav0/cam0/data.csv").parents[2]
    assert sorted_out(euroc) == ([(euroc, {"camera": 0})], [], euroc)
    assert sorted_out(euroc, imu)[2] == sorted_out(imu, euroc)[2] == imu
    assert sorted_out(euroc, imu=imu)[2] == imu
    kalibr = file("kalibr/cam0/123.png").parents[1]
    own = file("kalibr/imu0.csv")
    assert sorted_out(kalibr) == ([(kalibr / "cam0", {"name_unit": "ns"})], [], own)
    corners = file("corners.csv", HEADING + "\n")
    assert sorted_out(corners, imu=euroc) == ([], [corners], euroc)
    for inputs, message in (
        ((named, right, imu), "2 folders or videos for 1 cameras"),
        ((euroc, named), "run gives the pictures already"),
        ((named, euroc), "run gives the pictures already"),
        ((kalibr, euroc), "gives the pictures already"),
        ((corners, named, imu), "corners, and .*named gives pictures"),
        ((corners, corners, imu), "2 tables of corners for 1 cameras"),
        ((named / "123.png", imu), "single pictures have no times"),
        ((named,), "no IMU in INPUT"),
        ((imu,), "neither pictures nor a table"),
        ((named, imu, imu), "gives the IMU already"),
    ):
        with pytest.raises(libloc.DataError, match=message):
            sorted_out(*inputs)
    with pytest.raises(libloc.DataError, match="there is no cam1 in it"):
        sorted_out(kalibr, cameras=(0, 1))


def test_when_pictures_were_taken_is_asked_for(tmp_path):
    """By the name of the option that tells it, before anything is searched."""
    imu = tmp_path / "imu.csv"
    imu.write_text(IMU_HEADING + "\n")

    def how(path: Path, **given) -> dict:
        out = reading.sources_of([path, imu], [0], None, reading.PictureTimes(**given))
        return out.pictures[0][1]

    def folder(name: str, *pictures: str) -> Path:
        for picture in pictures:
            (tmp_path / name).mkdir(exist_ok=True)
            (tmp_path / name / picture).write_text("x")
        return tmp_path / name

    numbered = folder("numbered", *(f"{i:04}.png" for i in range(30)))
    worded = folder("worded", "left_01.png", "left_02.png")
    micro = folder("micro", *(f"{START_NS // 1000 + 50_000 * i}.png" for i in range(3)))
    nano = folder("nano", *(f"{START_NS + 50_000_000 * i}.png" for i in range(3)))
    assert how(nano) == {"name_unit": "ns"}
    assert how(micro, name_unit="us") == {"name_unit": "us"}
    assert how(numbered, rate_hz=20) == how(worded, rate_hz=20) == {"rate_hz": 20}
    assert how(worded, rate_hz=20, start_time_ns=5) == {"rate_hz": 20, "start_time_ns": 5}
    for path, what in (
        (numbered, "0000.png to 0029.png are no times in nanoseconds"),
        (worded, "left_01.png is no time in nanoseconds"),
        (micro, "are no times in nanoseconds"),
    ):
        with pytest.raises(libloc.DataError, match=f"{path}: .*{what}: give --rate-hz for .*--name-unit for"):
            how(path)
    with pytest.raises(libloc.DataError, match="--start-time is of pictures with --rate-hz"):
        how(numbered, start_time_ns=5)
    listed = folder("listed", "1.png")
    (listed / "data.csv").write_text("x")
    euroc = tmp_path / "run"
    (euroc / "mav0").mkdir(parents=True)
    for path in (listed, euroc):
        with pytest.raises(libloc.DataError, match=f"{path}: has times of its own, --rate-hz is for other"):
            how(path, rate_hz=20)
    corners = table(tmp_path / "corners.csv")
    with pytest.raises(libloc.DataError, match=r"corners.csv: has times of its own, --name-unit is for pict"):
        reading.sources_of([corners, imu], [0], None, reading.PictureTimes(name_unit="us"))
    with pytest.raises(SystemExit) as usage:
        calibrate.main(["camera-imu", str(nano), *BOARD, "--name-unit", "us", "--rate-hz", "5"])
    assert usage.value.code == 2


@needs_vision
def test_a_folder_that_begins_with_another_size(tmp_path):
    """A source of files goes by its first picture: the hint says so."""
    for i, size in enumerate(((60, 40), (384, 240), (384, 240))):
        Image.new("L", size).save(tmp_path / f"{START_NS + i * 10**8}.png")
    source = (tmp_path, {"name_unit": "ns"})
    with pytest.raises(
        libloc.DataError,
        match=r"1 picture of 60 x 40 pixels; cam0 of the rig has 384 x 240: .*2 more have another size",
    ):
        reading.find_views(
            libloc.CalibrationTarget("checkerboard 9x6 0.06"), source, a_camera("cam0", 0.6), 1, {}
        )
