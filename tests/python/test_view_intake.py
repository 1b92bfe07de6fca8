"""loc-view: which messages are taken, from logs and live, and what is counted of the others."""

import lcm
import loc
import pytest

import libloc

pytest.importorskip("rerun", reason="needs rerun-sdk")

from libloc.view import live, pictures, receiver
from view_support import NAN, OFFSET_NS, START, drawn, estimate, frame, image, messages, ride_log, where


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


# ---- live, without a network
def test_pictures_and_frames_meet_in_any_order():
    met = []
    matcher = live.LivePictures(lambda m, f: met.append((m and m.sequence, f and f.sequence)), OFFSET_NS)

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
    matcher = live.LivePictures(lambda m, f: met.append((m and m.sequence, f and f.sequence)), 0)
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
