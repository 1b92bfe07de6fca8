"""loc-view: which messages are taken, from logs and live, and what is counted of the others."""

import threading
import tracemalloc
from collections import Counter

import lcm
import loc
import numpy as np
import pytest

import libloc
from libloc import lcm_receiver

pytest.importorskip("rerun", reason="needs rerun-sdk")

from libloc.view import intake, logs, matching, pictures, receiver
from view_support import (
    NAN,
    OFFSET_NS,
    START,
    drawn,
    estimate,
    frame,
    image,
    messages,
    ride_log,
    where,
    write,
)


@pytest.fixture
def ride(tmp_path):
    return ride_log(tmp_path)


# ---- what cannot be used
def test_what_cannot_be_used_is_counted(tmp_path):
    events = messages()
    bad_picture = next(m for channel, m in events if channel == "LOC_IMAGE" and m.sequence == 3)
    bad_picture.data = bad_picture.data[:-400]
    bad_picture.size = len(bad_picture.data)
    bad_state = next(m for channel, m in events if channel == "LOC_SLAM_FRAME" and m.sequence == 4)
    bad_state.feature_state = [99, 0, 0]
    without_time = estimate(libloc.NO_TIME, 0, where(0))
    without_time.host_time_ns = START
    absurd = estimate(START + 2 * 10**17, 0, where(0))
    other = image(START, 0, camera=1)
    nowhere = estimate(START + 10**9, 0, [NAN] * 3)
    nowhere.valid = 0
    events += [("LOC_ESTIMATE", m) for m in (loc.imu_t(), without_time, absurd, nowhere)]
    events = [(channel, m.encode()) for channel, m in [*events, ("LOC_IMAGE", other)]]
    events += [
        ("LOC_SLAM_FRAME", frame(START, 99).encode()[:-5]),
        ("LOC_MAP", b"garbage"),
        ("OTHER", b"garbage"),
    ]
    path = tmp_path / "bad.log"
    log = lcm.EventLog(str(path), "w")
    for channel, data in events:
        log.write_event(START // 1000, channel, data)
    log.close()
    _, counts = drawn(path)
    assert counts["estimates.without_pose"] == 1
    assert (
        counts["LOC_ESTIMATE.refused"] == counts["LOC_SLAM_FRAME.refused"] == counts["LOC_MAP.refused"] == 1
    )
    assert counts["LOC_ESTIMATE.without_time"] == counts["LOC_ESTIMATE.absurd_time"] == 1
    assert counts["pictures.damaged"] == counts["frames.refused"] == counts["pictures.other_camera"] == 1
    assert counts["pictures.drawn"] == 9
    assert counts["pictures.without_frame"] == 1


def test_a_log_that_is_cut(ride):
    ride.write_bytes(ride.read_bytes()[:-20])
    _, counts = drawn(ride)
    assert counts["log.truncated_bytes"] > 0
    assert counts["pictures.drawn"] == 10


def test_part_of_a_log(ride):
    stream, counts = drawn(ride, start_s=0.25, duration_s=0.5)
    assert counts["pictures.drawn"] == 5  # at 0.3 to 0.7 s
    assert min(t for _, t, _ in stream.logged if t is not None) >= START + 200_000_000


def test_an_absurd_stamp_comes_first(tmp_path):
    """Neither the first one nor any other is trusted alone."""
    events = messages()
    absurd = [("LOC_ESTIMATE", estimate(START + k * 10**17, 0, where(0))) for k in (3, -3)]
    _, counts = drawn(write(tmp_path / "first.log", [absurd[0], *events[:50], absurd[1], *events[50:]]))
    assert counts["LOC_ESTIMATE.absurd_time"] == 2
    assert counts["pictures.drawn"] == 10
    assert counts["time.jumped"] == 0
    _, counts = drawn(write(tmp_path / "one.log", [("LOC_ESTIMATE", estimate(START, 0, where(0)))]))
    assert counts["estimates.drawn"] == 1  # nothing contradicts it

    # Two that agree: the clock was set. Live, what came first waits for the second.
    taken = intake.Intake(intake.channels_of([]))
    stamps = [START, START + 1, START + 10**17, START + 2, START + 10**17, START + 10**17 + 1]
    out = [taken.take("LOC_ESTIMATE", estimate(t, 0, where(0)).encode()) for t in stamps]
    assert [len(items) for items in out] == [0, 2, 0, 1, 0, 1]
    assert taken.counts["time.jumped"] == 1
    assert taken.counts["LOC_ESTIMATE.absurd_time"] == 2
    assert taken.rest() == []


def test_the_time_of_a_status_is_checked(tmp_path):
    status = loc.estimator_status_t()
    status.measurement_time_ns, status.method = START + 3 * 10**17, "inertial-slam"
    status.size, status.condition, status.since_s = 1, ["lost"], [0.0]
    events = [("LOC_ESTIMATE", estimate(START + i * 10**7, i, where(0))) for i in range(10)]
    stream, counts = drawn(write(tmp_path / "x.log", [*events, ("LOC_ESTIMATOR_STATUS", status)]))
    assert [t for t, _ in stream.of("messages")] == [START + 9 * 10**7]  # where the measurements are
    assert counts["LOC_ESTIMATOR_STATUS.absurd_time"] == 1


def test_several_logs_are_read_in_the_order_of_measurement(tmp_path):
    """Whichever comes first, whenever they were logged: frames find their pictures, and few are kept."""
    seen = [("LOC_IMAGE", image(START + i * 10**8 - OFFSET_NS, i)) for i in range(700)]
    made = [("LOC_SLAM_FRAME", frame(START + i * 10**8, i)) for i in range(700)]
    seen[0][1].time_ns += 10**18  # damaged
    first, second = write(tmp_path / "seen.log", seen), write(tmp_path / "made.log", made)
    for paths in ([first, second], [second, first]):
        _, counts = drawn(*paths)
        assert counts["frames.drawn"] == 700
        assert counts["pictures.drawn"] == 699
        assert counts["frames.without_picture"] == counts["LOC_IMAGE.absurd_time"] == 1
        assert counts["pictures.without_frame"] == 0


def test_the_memory_does_not_grow_with_the_log(tmp_path):
    def peak(seconds):
        m = frame(START, 0)
        m.size = 100
        for name in m.__slots__:
            value = getattr(m, name)
            if isinstance(value, list) and len(value) == 3 and name != "camera_position":
                setattr(m, name, [value[0]] * 100)

        def events():
            for i in range(10 * seconds):
                m.time_ns, m.sequence = START + i * 10**8, i
                yield "LOC_SLAM_FRAME", m

        path = write(tmp_path / f"{seconds}.log", events())
        tracemalloc.start()
        try:
            found = logs.survey([path], intake.Intake(intake.channels_of([])), 0, logs.Window(), Counter())
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
            assert found.frames == 10 * seconds

    assert peak(40) < peak(10) + 500_000

    way = logs.Way(most=100)
    for i in range(1001):
        way.add(START + i, (i, 2 * i, 3 * i))
    assert 50 <= len(way) <= 101
    assert way.thinned == 1001 - len(way)
    steps = np.diff(way.times_ns)
    assert (steps == steps[0]).all()
    np.testing.assert_array_equal(way.positions[:, 1], 2 * (way.times_ns - START))


# ---- live, without a network
def test_pictures_and_frames_meet_in_any_order():
    met = []
    matcher = matching.Matcher(lambda m, f: met.append((m and m.sequence, f and f.sequence)), OFFSET_NS)

    def picture(i, now_s=0.0):
        matcher.picture(image(START + i * 10**8 - OFFSET_NS, i), now_s)

    def features(i, now_s=0.0):
        matcher.frame(pictures.Features.of(frame(START + i * 10**8, i)), now_s)

    picture(1)
    matcher.give_up(0.1)
    assert met == []
    features(1)
    features(2)
    picture(2)
    picture(3)
    features(4)
    picture(4)
    assert met == [(1, 1), (2, 2), (4, 4)]
    matcher.give_up(0.4)
    assert len(met) == 3
    matcher.give_up(0.6)  # no frame has come for it
    assert met[3:] == [(3, None)]
    features(5)
    matcher.finish()
    assert met[4:] == [(None, 5)]

    # Pictures that were dropped do not take away the frames of later ones.
    met.clear()
    for i in range(10, 71):
        features(i)
    assert met == [(None, i) for i in range(10, 41)]
    picture(70)
    assert met[-1] == (70, 70)
    picture(80)
    picture(80)  # begun anew
    assert met[-1] == (80, None)

    # Where nothing finds features, only the first picture waits.
    met.clear()
    matcher = matching.Matcher(lambda m, f: met.append((m and m.sequence, f and f.sequence)), 0)
    picture(1)
    matcher.give_up(0.1)
    assert met == []
    matcher.give_up(0.6)
    picture(2, 0.7)
    matcher.give_up(0.7)
    assert met == [(1, None), (2, None)]


def test_newest_pictures_win():
    r = receiver.Receiver("memq://", ["LOC_IMAGE", "LOC_ESTIMATE"], "LOC_IMAGE")
    for i in range(10):
        r._handle("LOC_IMAGE", b"%d" % i)
        r._handle("LOC_ESTIMATE", b"%d" % i)
    taken = r.take(0)
    assert [data for channel, data in taken if channel == "LOC_IMAGE"] == [b"6", b"7", b"8", b"9"]
    assert len([data for channel, data in taken if channel == "LOC_ESTIMATE"]) == 10
    assert r.counts == {"pictures.dropped": 6}
    assert r.take(0) == []


def test_a_lost_connection_is_counted_once(monkeypatch):
    """However often it is tried anew."""
    attempts = []

    class Connection:
        def __init__(self, url):
            attempts.append(url)
            if 1 < len(attempts) < 4:
                raise RuntimeError("no hub")
            self.fails = len(attempts) in (1, 4)  # that one is no good either

        def subscribe(self, channel, handler):
            self.handler = handler

        def handle_timeout(self, ms):
            if self.fails:
                raise OSError("connection lost")
            self.handler("LOC_ESTIMATE", b"data")
            came.set()

    came = threading.Event()
    monkeypatch.setattr(lcm_receiver.lcm, "LCM", Connection)
    monkeypatch.setattr(lcm_receiver, "_RETRY_S", 0.01)
    with receiver.Receiver("tcpq://somewhere", ["LOC_ESTIMATE"], "LOC_IMAGE") as r:
        assert came.wait(10)
    assert len(attempts) == 5
    assert r.take(0)[0] == ("LOC_ESTIMATE", b"data")
    assert r.counts["connections.lost"] == 1
