"""loc-calibrate camera-imu --live: guidance by itself, and the whole against the real hub."""

import os
import subprocess
import sys
import time

import loc
import numpy as np
import pytest
from libloc.programs import calibrate
from libloc.programs import calibrate_camera_imu_live as live
from libloc.programs.calibrate_camera_imu_turns import rotation_of
from test_calibrate_live import hub, wait_for
from waved_rig import Waved, a_camera

import libloc

needs_vision = pytest.mark.skipif(not libloc.HAS_VISION, reason="built without OpenCV")


class Seen:
    """A detection that was simulated."""

    def __init__(self, view: libloc.TargetView, reason: str = "") -> None:
        self.view, self.reason, self.corners_left_out = view, reason, 0


def collected_of(rig: Waved, seconds: float = 1e9) -> live.Collected:
    out = live.Collected(rig.target, rig.cameras[0])
    end = rig.imu_times_ns[0] + seconds * 1e9
    for t, rate, force in zip(rig.imu_times_ns, rig.angular_velocity, rig.specific_force, strict=True):
        if t <= end:
            out.add_imu(int(t), list(rate), list(force))
    for view in rig.views():
        if view.time_ns <= end:
            out.add_detection(view.time_ns, Seen(view, "" if len(view) else "no board"))
    return out


def fit_of(rig: Waved, collected: live.Collected, **options) -> libloc.CameraImuFit:
    return libloc.calibrate_camera_imu(
        rig.target,
        [libloc.CameraRecording(rig.cameras[0], collected.views)],
        collected.imu_times_ns,
        collected.angular_velocity,
        collected.specific_force,
        options=libloc.CameraImuOptions(adapt_noise=False, check_line_delay=False, **options),
    )


def test_advice_follows_what_is_missing():
    whole = Waved(seconds=25)
    early = collected_of(whole, 3)
    assert "wave the rig" in live.advice_of(early, None, "", 0).text
    one = collected_of(Waved(seconds=8, turning=(1, 0.01, 0.01)))
    spread, weakest = one.turning()
    assert np.linalg.norm(weakest) < 0.02 < spread.max()
    assert (
        "forward" in live.advice_of(one, None, "", 0).text or "down" in live.advice_of(one, None, "", 0).text
    )
    # Too few pictures to tell the camera's axes: those of the IMU.
    one.turns.count = 0
    named = live.advice_of(one, None, "", 0).text.split("IMU's ")[1].split(" axis")[0].split(" and ")
    assert set(named) <= {"x", "y", "z"}
    corner = collected_of(whole)
    corner.cells[:, 4:] = 0
    text = live.advice_of(corner, None, "", 0).text
    assert "bring the target into the" in text
    assert "left" not in text
    unseen = collected_of(whole)
    unseen.counts["images.with_target"] = 20
    unseen.reasons["no board"] = 5
    assert "not seen in most pictures (no board)" in live.advice_of(unseen, None, "", 0).text
    good = collected_of(whole)
    assert live.advice_of(good, None, "", 0).text == "go on"
    assert live.advice_of(good, None, "turn it about all three", 0).text == "turn it about all three"
    fit = fit_of(whole, good)
    turn, shift, offset = live.deviations(fit)
    assert turn < 0.1
    assert shift < 2
    assert offset < 0.1
    assert not live.advice_of(good, fit, "", 1).enough
    assert live.advice_of(good, fit, "", 2).enough
    # A solution that is none has small deviations too.
    bad = fit_of(whole, good, max_iterations=1)
    assert not bad.converged
    assert max(live.deviations(bad)) < 2
    assert not live.is_small(bad)
    assert not live.advice_of(good, bad, "", 2).enough
    # Enough is never said of less than 20 s.
    assert not live.advice_of(collected_of(whole, 15), fit, "", 2).enough
    assert 0.4 < good.coverage() <= 1
    figure = live.plot_progress(good, live.Advice("go on"))
    assert len(figure.axes) == 3


@pytest.mark.parametrize(
    ("turning", "words"),
    [
        ((1, 1, 0), "forward: roll"),
        ((0, 1, 1), "to the right of the image: nod"),
        ((1, 0, 1), "down the image: swing"),
    ],
)
def test_the_cameras_axis_that_is_missing_is_named(turning, words):
    """Waved turns about the camera's x, y and z."""
    advice = live.advice_of(collected_of(Waved(seconds=8, turning=turning, imu_hz=50)), None, "", 0)
    assert words in advice.text


def test_rotation_of_the_target_in_the_camera():
    rig = Waved(seconds=3)
    camera = libloc.Camera(rig.cameras[0])
    for t, view in list(zip(rig.picture_times()[0], rig.views(), strict=True))[::7]:
        R = rotation_of(rig.points[view.ids], camera.unproject(view.pixels_px))
        truth = rig.camera_pose(t).inverse().matrix()[:3, :3]
        assert np.rad2deg(np.arccos((np.trace(R.T @ truth) - 1) / 2)) < 3
    line = np.column_stack([np.arange(10), np.zeros((10, 2))]) * 0.1
    assert rotation_of(line, line + np.array([0, 0, 1])) is None
    few = rig.points[view.ids[::7]][:7], camera.unproject(view.pixels_px[::7][:7].copy())
    assert rotation_of(*few) is None


def test_advice_looks_at_the_last_seconds():
    """However good it was before."""
    good = collected_of(Waved(seconds=12))
    end = good.imu_times_ns[-1]
    assert good.latest_turning() > 0.5
    for i in range(1, 400):
        good.add_imu(int(end) + i * 10**7, [0.01, -0.02, np.nan if i == 5 else 0.005], [0, 0, 9.8])
    assert good.latest_turning() < 0.03
    assert live.advice_of(good, None, "", 0).text.startswith("turn faster")
    nothing = Seen(libloc.TargetView(np.zeros(0, np.int64), np.zeros((0, 2))), "no board")
    for i in range(8):
        good.add_detection(int(end) + i * 10**8, nothing)
    assert "not seen any more (no board)" in live.advice_of(good, None, "", 0).text


@needs_vision
def test_pictures_of_another_size_end_it():
    rig = Waved(seconds=1)
    picture = loc.image_t()
    picture.width, picture.height, picture.row_stride = 320, 200, 320
    picture.pixelformat, picture.data, picture.size = picture.PIXEL_FORMAT_GRAY, bytes(64000), 64000

    class Options:
        camera = (0,)
        image_channel, imu_channel, patience = libloc.IMAGE_CHANNEL, libloc.IMU_CHANNEL, 1e9

    collected = live.Collected(rig.target, rig.cameras[0])
    session = live._Session(Options(), collected, live._detector(rig.target, rig.cameras[0]), fit_of)
    session.take(libloc.IMAGE_CHANNEL, picture.encode())
    with pytest.raises(libloc.DataError, match="320 x 200 pixels come; cam0 of the rig has 640 x 400"):
        session.finish()
    # A damaged one is counted.
    picture.data, picture.size = bytes(100), 100
    session.take(libloc.IMAGE_CHANNEL, picture.encode())
    session.finish()
    session.close()
    assert collected.counts["images.skipped.damaged"] == 1


def test_no_imu_sample_waits_for_a_slow_detector():
    rig = Waved(seconds=3, camera_hz=10)

    class Options:
        camera = (0,)
        image_channel, imu_channel, patience = libloc.IMAGE_CHANNEL, libloc.IMU_CHANNEL, 1e9

    def slow(picture, where: str) -> Seen:
        time.sleep(0.2)
        return Seen(libloc.TargetView(np.zeros(0, np.int64), np.zeros((0, 2))), "dark")

    collected = live.Collected(rig.target, rig.cameras[0])
    session = live._Session(Options(), collected, slow, lambda c: fit_of(rig, c))
    picture = loc.image_t()
    picture.height, picture.width, picture.row_stride = 2, 2, 2
    picture.pixelformat, picture.data, picture.size = picture.PIXEL_FORMAT_GRAY, bytes(4), 4
    for i, t in enumerate(rig.imu_times_ns):
        m = loc.imu_t()
        m.time_ns, m.sequence = int(t), i if i < 100 else i + 3
        session.take(libloc.IMU_CHANNEL, m.encode())
        if i % 20 == 0:
            picture.time_ns, picture.sequence, picture.camera = int(t), i // 20, 0
            session.take(libloc.IMAGE_CHANNEL, picture.encode())
            session.work()
    picture.camera = 1
    session.take(libloc.IMAGE_CHANNEL, picture.encode())
    session.take(libloc.IMAGE_CHANNEL, b"no message")
    session.finish()
    session.close()
    assert collected.counts["imu.received"] == len(collected.imu_times_ns) == len(rig.imu_times_ns)
    assert collected.counts["imu.lost"] == 3
    assert collected.counts["images.of_other_cameras"] == 1
    assert collected.counts[f"{libloc.IMAGE_CHANNEL}.refused"] == 1
    searched, skipped = (
        collected.counts["images.searched"],
        collected.counts["images.skipped.detector_busy"],
    )
    assert searched + skipped == collected.counts["images.received"] == 30
    assert skipped > 15
    assert collected.reasons == {"dark": searched}


def start(url: str, *arguments) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-m", "libloc.programs.calibrate", "camera-imu", "--live", "--lcm-url", url]
        + [str(a) for a in arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )


@needs_vision
def test_the_whole_over_lcm_and_again_from_what_was_kept(tmp_path, capsys):
    import lcm

    rig = Waved(
        seconds=11,
        camera_hz=8,
        distance=1.1,
        turning=(0.5, 0.5, 0.9),
        seed=3,
        cameras=[a_camera("cam0", 0.6)],
    )
    libloc.write_rig(tmp_path / "rig.yaml", rig.rig())
    events = [(int(t), "imu", i) for i, t in enumerate(rig.imu_times_ns)]
    events += [(int(t), "image", i) for i, t in enumerate(rig.picture_times()[1])]
    pictures = rig.renderings()
    board = ("--target", "checkerboard", "9x6", "0.06")
    with hub() as url:
        process = start(
            url, *board, "--rig", tmp_path / "rig.yaml", "--out", tmp_path / "out.yaml", "--report", tmp_path
        )
        wait_for(process, "target in 0 of 0")  # it listens
        sender = lcm.LCM(url)
        begin = time.monotonic()
        for t, kind, i in sorted(events):
            at = begin + (t - rig.imu_times_ns[0]) * 1e-9 / 4  # four times as fast as it was
            time.sleep(max(0.0, at - time.monotonic()))
            if kind == "imu":
                m = loc.imu_t()
                m.time_ns, m.host_time_ns, m.sequence = t, t, i
                m.angular_velocity, m.specific_force = (
                    list(rig.angular_velocity[i]),
                    list(rig.specific_force[i]),
                )
                sender.publish(libloc.IMU_CHANNEL, m.encode())
            else:
                p = loc.image_t()
                p.time_ns, p.host_time_ns, p.sequence, p.camera = t, t, i, 0
                p.height, p.width = pictures[i].shape
                p.row_stride, p.pixelformat = p.width, p.PIXEL_FORMAT_GRAY
                p.data = pictures[i].tobytes()
                p.size = len(p.data)
                sender.publish(libloc.IMAGE_CHANNEL, p.encode())
        end = loc.source_status_t()
        end.state, end.message = end.STATE_ENDED, "the recording has ended"
        sender.publish(libloc.SOURCE_STATUS_CHANNEL, end.encode())
        out, progress = process.communicate(timeout=60)
    assert process.returncode == 0, out + progress
    assert "the recording has ended" in progress
    assert "% of the image" in progress
    (found,) = libloc.read_rig(tmp_path / "out.yaml").cameras
    assert np.abs(rig.off_by_sigmas(found)).max() < 5
    for name in ("progress.png", "report.html", "corners.csv", "imu.csv"):
        assert (tmp_path / name).is_file()
    code = calibrate.main(
        [
            "camera-imu",
            *(str(tmp_path / name) for name in ("corners.csv", "imu.csv")),
            *board,
            *("--rig", str(tmp_path / "rig.yaml"), "--out", str(tmp_path / "again.yaml")),
        ]
    )
    assert code == 0, capsys.readouterr()
    (again,) = libloc.read_rig(tmp_path / "again.yaml").cameras
    np.testing.assert_array_equal(again.T_body_camera.matrix(), found.T_body_camera.matrix())
    capsys.readouterr()


def test_silence_is_named(tmp_path):
    rig = Waved(seconds=1)
    libloc.write_rig(tmp_path / "rig.yaml", rig.rig())
    board = ("--target", "checkerboard", "9x6", "0.06", "--rig", tmp_path / "rig.yaml")
    with hub() as url:
        process = start(url, *board, "--patience", 1)
        out, progress = process.communicate(timeout=30)
    assert process.returncode == 1, out
    assert f"nothing came on {libloc.IMAGE_CHANNEL}" in progress
    assert "loc-driver" in progress
    with pytest.raises(SystemExit) as usage:
        calibrate.main(["camera-imu", "--live", *map(str, board[:4])])
    assert usage.value.code == 2
