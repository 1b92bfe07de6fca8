"""loc-calibrate camera-imu --live: guidance by itself, and the whole against the real hub."""

import io
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import contextmanager

import lcm
import loc
import numpy as np
import pytest
from libloc.programs import calibrate
from libloc.programs import calibrate_camera_imu_live as live
from libloc.programs.calibrate_camera_imu_turns import rotation_of
from test_calibrate_live import hub, wait_for
from waved_rig import START_NS, Waved, a_camera

import libloc

BOARD = ("--target", "checkerboard", "9x6", "0.06")
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
    # A stray one among others, or a damaged one, is counted.
    collected.views.append(libloc.TargetView(np.zeros(0, np.int64), np.zeros((0, 2)), 1))
    session.take(libloc.IMAGE_CHANNEL, picture.encode())
    session.finish()
    picture.data, picture.size = bytes(100), 100
    session.take(libloc.IMAGE_CHANNEL, picture.encode())
    session.finish()
    session.close()
    assert collected.counts["images.skipped.other_size"] == 1
    assert collected.counts["images.skipped.damaged"] == 1
    assert collected.skipped() == 2


def test_rates_are_those_of_the_last_seconds():
    rates = live.Rates()
    counts: Counter[str] = Counter()
    assert rates.add(10, counts) == (0, 0)
    for second in range(1, 9):
        counts["images.received"] += 20 if second <= 4 else 0
        counts["imu.received"] += 200
        found = rates.add(10 + second, counts)
        assert found[0] == pytest.approx({5: 40 / 3, 6: 20 / 3}.get(second, 20 if second < 5 else 0))
        assert found[1] == pytest.approx(200)


class Terminal(io.StringIO):
    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


def test_nothing_is_cut_off_on_a_narrow_terminal():
    collected = collected_of(Waved(seconds=3))
    collected.counts.update(
        {"images.received": 123456, "images.searched": 99999, "images.with_target": 99998}
    )
    stream = Terminal()
    display = live._Display(stream)
    for advice in ("turn it briskly", "go on"):
        display.show(collected, None, live.Advice(advice))
    lines = [re.sub("\x1b\\[[?0-9]*[A-Za-z]", "", line) for line in stream.getvalue().splitlines()]
    assert max(map(len, lines)) <= 80, lines
    height = len(lines) // 2
    assert [lines[height - 1], lines[-1]] == ["turn it briskly", "go on"]
    assert f"\x1b[{height}A" in stream.getvalue()


def test_turning_is_that_of_all_samples():
    """Summed up as they come, without what is no number."""
    collected = live.Collected(Waved(seconds=0.1).target, a_camera())
    assert not np.any(collected.turning())
    rates = np.random.default_rng(4).normal([0.5, 0, -2], [1, 0.2, 0.5], (500, 3))
    for i, rate in enumerate(rates):
        collected.add_imu(i, list(rate), [0, 0, 9.8])
    collected.add_imu(500, [0.1, np.nan, 0], [0, 0, 9.8])
    spread, weakest = collected.turning()
    np.testing.assert_allclose(spread, rates.std(axis=0), rtol=1e-9)
    values, axes = np.linalg.eigh(np.cov(rates.T, ddof=0))
    assert np.linalg.norm(weakest) == pytest.approx(np.sqrt(values[0]))
    assert abs(weakest @ axes[:, 0]) == pytest.approx(np.linalg.norm(weakest))
    times, some = collected.some_rates(100)
    assert times.tolist() == list(range(0, 501, 5))
    np.testing.assert_array_equal(some[:100], rates[::5])


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


@contextmanager
def listening(*arguments):
    """The program and the URL of a hub that it listens to; neither outlives the test."""
    with hub() as url:
        process = subprocess.Popen(
            [
                *(sys.executable, "-m", "libloc.programs.calibrate", "camera-imu"),
                *("--live", "--lcm-url", url, *BOARD, *map(str, arguments)),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
            # A test run in the background ignores Ctrl-C, and children inherit that.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        with process:
            try:
                yield process, url
            finally:
                process.kill()  # where it still runs


def messages_of(rig: Waved, pictures: list[np.ndarray]) -> list[tuple[int, str, bytes]]:
    """Time, channel and data of all, in the order of time."""
    out: list[tuple[int, str, bytes]] = []
    for i, t in enumerate(rig.imu_times_ns.tolist()):
        m = loc.imu_t()
        m.time_ns, m.host_time_ns, m.sequence = t, t, i
        m.angular_velocity, m.specific_force = list(rig.angular_velocity[i]), list(rig.specific_force[i])
        out.append((t, libloc.IMU_CHANNEL, m.encode()))
    for i, t in enumerate(rig.picture_times()[1].tolist()):
        p = loc.image_t()
        p.time_ns, p.host_time_ns, p.sequence, p.camera = t, t, i, 0
        p.height, p.width = pictures[i].shape
        p.row_stride, p.pixelformat = p.width, p.PIXEL_FORMAT_GRAY
        p.data = pictures[i].tobytes()
        p.size = len(p.data)
        out.append((t, libloc.IMAGE_CHANNEL, p.encode()))
    return sorted(out)


class Played:
    """A rig whose messages are sent four times as fast as they came."""

    def __init__(self, rig: Waved) -> None:
        self.rig = rig
        self._messages = messages_of(rig, rig.renderings())

    def send(self, url: str, end: str = "") -> None:
        sender = lcm.LCM(url)
        begin = time.monotonic()
        for t, channel, data in self._messages:
            at = begin + (t - self._messages[0][0]) * 1e-9 / 4
            time.sleep(max(0.0, at - time.monotonic()))
            sender.publish(channel, data)
        if end:
            status = loc.source_status_t()
            status.state, status.message = status.STATE_ENDED, end
            sender.publish(libloc.SOURCE_STATUS_CHANNEL, status.encode())


@pytest.fixture(scope="module")
def played() -> Played:
    return Played(
        Waved(
            seconds=11,
            camera_hz=8,
            distance=1.1,
            turning=(0.5, 0.5, 0.9),
            seed=3,
            cameras=[a_camera("cam0", 0.6)],
        )
    )


@needs_vision
def test_the_whole_over_lcm_and_again_from_what_was_kept(played, tmp_path, capsys):
    rig = played.rig
    libloc.write_rig(tmp_path / "rig.yaml", rig.rig())
    out_and_report = ("--out", tmp_path / "out.yaml", "--report", tmp_path)
    with listening("--rig", tmp_path / "rig.yaml", *out_and_report) as (process, url):
        wait_for(process, "target in 0 of 0")  # it listens
        played.send(url, end="the recording has ended")
        out, progress = process.communicate(timeout=60)
    assert process.returncode == 0, out + progress
    assert "the recording has ended" in progress
    assert "% of the image" in progress
    assert re.search(r"camera [1-9]\d* Hz, IMU [1-9]\d+ Hz", progress)
    assert re.search(r"pictures, \d+ skipped", progress)
    (found,) = libloc.read_rig(tmp_path / "out.yaml").cameras
    assert np.abs(rig.off_by_sigmas(found)).max() < 5
    for name in ("progress.png", "report.html", "corners.csv", "imu.csv"):
        assert (tmp_path / name).is_file()
    code = calibrate.main(
        [
            "camera-imu",
            *(str(tmp_path / name) for name in ("corners.csv", "imu.csv")),
            *BOARD,
            *("--rig", str(tmp_path / "rig.yaml"), "--out", str(tmp_path / "again.yaml")),
        ]
    )
    assert code == 0, capsys.readouterr()
    (again,) = libloc.read_rig(tmp_path / "again.yaml").cameras
    np.testing.assert_array_equal(again.T_body_camera.matrix(), found.T_body_camera.matrix())
    capsys.readouterr()


@needs_vision
@pytest.mark.parametrize("ctrl_c", [True, False])
def test_what_came_is_used_when_it_is_interrupted_or_the_time_is_over(played, tmp_path, ctrl_c):
    rig = played.rig
    libloc.write_rig(tmp_path / "rig.yaml", rig.rig())
    with listening(
        *("--rig", tmp_path / "rig.yaml", "--out", tmp_path / "out.yaml"),
        *("--patience", 100, "--duration", 100 if ctrl_c else 5),
    ) as (process, url):
        wait_for(process, "target in 0 of 0")
        played.send(url)
        if ctrl_c:
            # With a camera of 0 Hz: all that was sent has come.
            wait_for(process, "camera 0 Hz, IMU 0 Hz")
            process.send_signal(signal.SIGINT)
        out, progress = process.communicate(timeout=60)
    assert process.returncode == 0, out + progress
    assert "Traceback" not in progress
    why = "interrupted" if ctrl_c else "the time given with --duration is over"
    assert f"collecting ended: {why}" in progress
    (found,) = libloc.read_rig(tmp_path / "out.yaml").cameras
    assert np.abs(rig.off_by_sigmas(found)).max() < 5


def test_it_ends_when_it_knows_enough(monkeypatch):
    """It solves after 8 s of data and every 8 s from there on: each part comes when that is done."""
    rig = Waved(seconds=27)
    views = rig.views()
    taken = threading.Semaphore(0)

    def detect(picture, where) -> Seen:
        taken.release()
        return Seen(views[picture.sequence])

    monkeypatch.setattr(live, "_detector", lambda *_: detect)
    solved = threading.Semaphore(0)
    over = threading.Event()
    stream = io.StringIO()

    def solve(collected: live.Collected) -> libloc.CameraImuFit:
        try:
            return fit_of(rig, collected)
        finally:
            solved.release()

    def send(messages: list[tuple[int, str, bytes]], url: str) -> None:
        while "target in 0 of 0" not in stream.getvalue():
            time.sleep(0.01)  # it listens then
        sender = lcm.LCM(url)
        for first_s in (0, 9.5, 18):
            for t, channel, data in messages:
                if first_s <= (t - START_NS) * 1e-9 < {0: 9.5, 9.5: 18}.get(first_s, 27):
                    sender.publish(channel, data)
                    # A busy detector keeps the newest picture only.
                    while channel == libloc.IMAGE_CHANNEL and not taken.acquire(timeout=0.05):
                        if over.is_set():
                            return
            solved.acquire(timeout=60)

    with hub() as url:
        options = calibrate.make_parser().parse_args(
            ["camera-imu", "--live", "--lcm-url", url, *BOARD, "--duration", "60", "--patience", "60"]
        )
        pictures = [np.zeros((2, 2), np.uint8)] * len(views)
        sending = threading.Thread(target=send, args=(messages_of(rig, pictures), url))
        sending.start()
        collected = live.collect(options, rig.target, rig.cameras[0], solve, stream)
        over.set()
        sending.join()
    assert "collecting ended: enough now" in stream.getvalue()
    assert "not solved yet" in stream.getvalue()
    assert "known to" in stream.getvalue()
    assert collected.seconds() > 19.9  # however small the deviations are before


def test_silence_is_named(tmp_path, capsys):
    rig = Waved(seconds=1)
    libloc.write_rig(tmp_path / "rig.yaml", rig.rig())
    with listening("--rig", tmp_path / "rig.yaml", "--patience", 1) as (process, _):
        out, progress = process.communicate(timeout=30)
    assert process.returncode == 1, out
    assert f"nothing came on {libloc.IMAGE_CHANNEL}" in progress
    assert "loc-driver" in progress
    with pytest.raises(SystemExit) as usage:
        calibrate.main(["camera-imu", "--live", *BOARD])
    assert usage.value.code == 2
    with pytest.raises(SystemExit) as usage:
        calibrate.main(
            ["camera-imu", "--live", *BOARD, "--rig", str(tmp_path / "rig.yaml"), "--rate-hz", "5"]
        )
    assert usage.value.code == 2
    assert "--rate-hz is for INPUT" in capsys.readouterr().err
