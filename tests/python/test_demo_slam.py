"""The report of tools/demo on SLAM from pictures: right figures, what it refuses, and that it draws."""

import sys

import lcm
import loc
import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation
from support import CHECKOUT

import libloc

sys.path.insert(0, str(CHECKOUT / "tools"))
import demo_slam_report as report

FRAMES = 60
SHIFT = np.array([3.0, -2.0, 1.0])
TURN = Rotation.from_euler("z", 0.7)


def way(seconds):
    return np.array([2 * np.cos(seconds), 2 * np.sin(seconds), 0.1 * seconds])


def time_of(frame: int) -> int:
    return 1_700_000_000_000_000_000 + frame * 50_000_000


def frame_message(frame: int):
    message = loc.slam_frame_t()
    message.time_ns, message.sequence, message.time_spent_s = time_of(frame), frame, 1e-3 * (frame + 1)
    message.camera_position, message.q_world_camera_wxyz = way(frame * 0.05), (1, 0, 0, 0)
    message.measured = message.visible = message.size = 2
    message.feature_id, message.feature_state, message.feature_converted = [1, 2], [1, 0], [False, False]
    for name in ("u_px", "v_px", "predicted_u_px", "predicted_v_px", "estimated_u_px", "estimated_v_px"):
        setattr(message, name, [10.0, np.nan] if name in ("u_px", "v_px") else [10.0, 20.0])
    message.innovation_cov = [[1.0, 0.0, 1.0]] * 2
    message.inverse_depth = message.sigma_inverse_depth = [0.1, 0.1]
    return message


def picture_message(frame: int):
    message = loc.image_t()
    message.time_ns, message.sequence, message.camera = time_of(frame), frame, 0
    message.width, message.height, message.row_stride = 32, 24, 40
    message.pixelformat = message.PIXEL_FORMAT_GRAY
    message.size, message.data = 960, bytes([frame] * 960)
    return message


def estimate_message(frame: int, offset: float = 0.0):
    message = loc.estimate_t()
    message.time_ns, message.sequence, message.method = time_of(frame), frame, "inertial-slam"
    message.valid = message.VALID_ORIENTATION | message.VALID_POSITION
    message.q_world_body_wxyz = (1, 0, 0, 0)
    message.position = way(frame * 0.05) + np.array([0, 0, offset])
    return message


def write_log(path, *, pictures=FRAMES, offset=0.0, truth=True, cameras=1):
    log = lcm.EventLog(str(path), "w", overwrite=True)
    for frame in range(FRAMES):
        if frame < pictures:
            for camera in range(cameras):
                image = picture_message(frame)
                image.camera = camera
                log.write_event(frame, "LOC_IMAGE", image.encode())
            log.write_event(frame, "LOC_SLAM_FRAME", frame_message(frame).encode())
        # Half of the time 0.1 m too high, half of it too low: no alignment takes that away.
        wrong = 0.1 * (-1) ** frame
        log.write_event(
            frame, "LOC_ESTIMATE", estimate_message(frame, wrong + offset * (frame == 30)).encode()
        )
        message = loc.reference_t()
        message.time_ns, message.score, message.q_world_body_wxyz = time_of(frame), True, (1, 0, 0, 0)
        message.position = TURN.apply(way(frame * 0.05)) + SHIFT
        if truth:
            log.write_event(frame, "LOC_REFERENCE", message.encode())
    status = loc.source_status_t()
    status.streams, status.stream_name, status.published = 1, ["image"], [cameras * FRAMES]
    log.write_event(99, "LOC_SOURCE_STATUS", status.encode())
    log.close()
    return report.read(path)


def test_figures_and_picture(tmp_path, monkeypatch, capsys):
    for name in ("live.log", "again.log"):
        write_log(tmp_path / name)
    picture = tmp_path / "summary.png"
    arguments = ["--live", tmp_path / "live.log", "--replay", tmp_path / "again.log", "--picture", picture]
    monkeypatch.setattr(sys, "argv", ["x", *map(str, arguments), "--title", "a test"])
    assert report.main() == 0
    said = capsys.readouterr().out
    assert "all 60 estimates are the live ones bit for bit (60 pictures, none lost)" in said
    rows = dict(line.strip().rsplit("  ", 1) for line in said.splitlines()[1:])
    figures = {name.strip(): text.strip() for name, text in rows.items()}
    assert float(figures["position error, rms"].split()[0]) == pytest.approx(0.1, abs=1e-3)
    assert figures["filter, median / 99 %"].startswith("30.50 / ")
    with Image.open(picture) as drawn:
        assert drawn.size[0] > 1000
        assert np.asarray(drawn.convert("L")).std() > 20


def test_what_differs_or_is_lost_is_refused(tmp_path):
    live = write_log(tmp_path / "live.log")
    with pytest.raises(report.ReportError, match="estimate 30 of the replay differs"):
        report.check_replay(live, write_log(tmp_path / "other.log", offset=1e-12))
    with pytest.raises(report.ReportError, match="60 pictures, 59 were logged"):
        report.check_replay(write_log(tmp_path / "lost.log", pictures=59), live)
    with pytest.raises(report.ReportError, match="the replay: 50 of 60 pictures"):
        report.check_replay(live, write_log(tmp_path / "late.log", pictures=50))


def test_of_two_cameras_one_is_used(tmp_path):
    live, replay = (write_log(tmp_path / name, cameras=2) for name in ("live.log", "again.log"))
    assert "60 pictures, none lost" in report.check_replay(live, replay)


def test_without_a_truth_the_way_is_shown_as_it_is(tmp_path):
    run = write_log(tmp_path / "live.log", truth=False)
    comparison = report.compare(run, run.truth, np.zeros(3), True)
    assert comparison.truth is None
    np.testing.assert_allclose(comparison.estimate[:, :2], np.array(run.body.position)[:, :2])
    assert report.sums(run, comparison, True)[0][1].startswith("none")


@pytest.mark.parametrize("metric", [True, False])
def test_alignment_is_that_of_the_library(metric):
    rng = np.random.default_rng(2)
    source = rng.normal(0, 3, (40, 3))
    target = TURN.apply(source) * (1 if metric else 1.7) + SHIFT + rng.normal(0, 0.1, (40, 3))
    wanted = libloc.align_points(source, target, "yaw" if metric else "sim3")
    found = report.align(source, target, metric)
    assert found.scale == pytest.approx(wanted.scale)
    np.testing.assert_allclose(found.shift, wanted.T_reference_estimate.translation, atol=1e-9)
    pose = wanted.T_reference_estimate
    np.testing.assert_allclose(
        found(source), wanted.scale * (source @ pose.matrix()[:3, :3].T) + pose.translation
    )


def test_fixes_are_where_the_library_puts_them(tmp_path):
    run = write_log(tmp_path / "live.log")
    origin = (0.8, 0.2, 300.0)
    places = np.array([[0.8 + 3e-5, 0.2 - 4e-5, 310.0], [0.8, 0.2, 300.0]])
    run.fixes, run.origin = [(0, *place) for place in places], origin
    wanted = np.array([libloc.LocalFrame(*origin).to_local(place) for place in places])
    np.testing.assert_allclose(report.fixes_in_world(run), wanted, atol=0.05)


def test_truth_of_the_camera(tmp_path):
    path = tmp_path / "sensor.yaml"
    path.write_text("T_BS:\n  cols: 4\n  data: [0, 0, 1, 0.1,\n 1, 0, 0, 0.2,\n 0, 1, 0, 0.3, 0, 0, 0, 1]\n")
    np.testing.assert_allclose(report.camera_in_body(path), [0.1, 0.2, 0.3])
    path.write_text("T_BS: none\n")
    with pytest.raises(report.ReportError, match="no T_BS"):
        report.camera_in_body(path)
    tum = tmp_path / "truth.tum"
    tum.write_text("# t x y z qx qy qz qw\n1.5 1 2 3 0 0 0.7071067811865476 0.7071067811865476\n")
    track = report.read_tum(tum)
    assert track.time_ns == [1_500_000_000]
    np.testing.assert_allclose(
        report.rotate(np.array(track.q_wxyz), np.array([1.0, 0, 0])), [[0, 1, 0]], atol=1e-9
    )
    tum.write_text("1.5 1 2 3\n")
    with pytest.raises(report.ReportError, match=r"truth\.tum:1: 4 columns"):
        report.read_tum(tum)
