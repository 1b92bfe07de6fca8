"""loc-view: what is drawn of messages, what is written, served and refused."""

import io
import itertools
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from collections import Counter
from contextlib import contextmanager
from pathlib import Path

import lcm
import loc
import numpy as np
import pytest
from libloc.lcm_log import LogWriter
from libloc.programs import view
from PIL import Image
from scipy.spatial.transform import Rotation
from support import built_program

import libloc

rr = pytest.importorskip("rerun", reason="needs rerun-sdk")

from libloc.view import geometry, intake, live, logs, output, pictures, receiver, target  # noqa: E402
from libloc.view.plots import PlotDrawing  # noqa: E402
from libloc.view.recorder import Recorder, Thinner  # noqa: E402
from libloc.view.scene import Scene  # noqa: E402
from libloc.view.space import SpaceDrawing  # noqa: E402

START = 1_700_000_000_000_000_000
OFFSET_NS = 5_000_000  # of the camera's clock
WIDTH, HEIGHT = 160, 120
NAN = float("nan")
ORIGIN = (np.deg2rad(48.0), np.deg2rad(11.0), 500.0)


# ---- messages
def stamped(kind, time_ns, sequence=0):
    m = kind()
    m.time_ns, m.host_time_ns, m.sequence = int(time_ns), int(time_ns), sequence
    return m


def jpeg(shade=128):
    file = io.BytesIO()
    pixels = np.full((HEIGHT, WIDTH), shade, dtype=np.uint8)
    pixels[::7] = 20
    Image.fromarray(pixels).save(file, "JPEG")
    return file.getvalue()


def image(time_ns, sequence, data=None, camera=0):
    m = stamped(loc.image_t, time_ns, sequence)
    m.camera, m.width, m.height = camera, WIDTH, HEIGHT
    m.pixelformat = loc.image_t.PIXEL_FORMAT_MJPEG
    m.data = jpeg() if data is None else data
    m.size = len(m.data)
    return m


def frame(time_ns, sequence, place=(0.0, 0.0, 0.0)):
    """Three features: used, expected and not used, new (without expectation)."""
    m = stamped(loc.slam_frame_t, time_ns, sequence)
    m.camera_position, m.q_world_camera_wxyz = list(place), [0.5, -0.5, 0.5, -0.5]
    m.size = 3
    m.feature_id, m.feature_converted = [1, 2, 3], [True, False, False]
    m.feature_state = [m.STATE_MEASURED, m.STATE_PREDICTED, m.STATE_NEW]
    m.u_px, m.v_px = [10.0, NAN, 50.0], [20.0, NAN, 60.0]
    m.predicted_u_px, m.predicted_v_px = [11.0, 30.0, NAN], [20.0, 40.0, NAN]
    m.estimated_u_px = m.estimated_v_px = [NAN] * 3
    m.innovation_cov = [[4.0, 0.0, 1.0], [9.0, 3.0, 4.0], [NAN] * 3]
    m.inverse_depth = m.sigma_inverse_depth = [0.1, 0.1, 0.1]
    m.map_size, m.visible, m.measured, m.rejected, m.added = 3, 2, 1, 0, 1
    m.reprojection_before_px, m.reprojection_after_px, m.nis, m.nis_dim = 1.5, 0.5, 3.0, 2
    m.time_spent_s = 0.002
    return m


def estimate(time_ns, sequence, position, status=0, method="inertial-slam"):
    m = stamped(loc.estimate_t, time_ns, sequence)
    m.publish_time_ns = m.host_time_ns + 4_000_000
    m.method, m.world = method, "ENU"
    m.valid = m.VALID_ORIENTATION | m.VALID_HEADING | m.VALID_POSITION | m.VALID_COVARIANCE
    m.status = status
    m.q_world_body_wxyz = [1.0, 0.0, 0.0, 0.0]
    m.position = list(position)
    m.covariance_dim = 9
    m.covariance = np.diag([1e-4, 1e-4, 4e-4, 0.01, 0.04, 0.09, 1, 1, 1]).tolist()
    return m


def where(s):
    return np.array([2.0 * s, np.sin(s), 1.0])


def elsewhere(position):
    """In the reference's own world."""
    return Rotation.from_euler("z", 1.0).apply(position) + np.array([5.0, 6.0, 7.0])


def messages(seconds=1.0):
    """(channel, message) in the order of time: a second has 10 pictures with frames, 200 estimates."""
    out = []
    for i in range(round(10 * seconds)):
        t = START + i * 100_000_000
        out.append((t, "LOC_IMAGE", image(t - OFFSET_NS, i)))
        out.append((t + 2, "LOC_SLAM_FRAME", frame(t, i, where(0.1 * i))))
    for i in range(round(200 * seconds)):
        t = START + i * 5_000_000
        status = loc.estimate_t.STATUS_FEW_FEATURES if 40 <= i < 80 and i % 2 == 0 else 0
        out.append((t + 1, "LOC_ESTIMATE", estimate(t, i, where(0.005 * i), status)))
        truth = stamped(loc.reference_t, t, i)
        truth.position = elsewhere(where(0.005 * i)).tolist()
        truth.velocity, truth.q_world_body_wxyz = [NAN] * 3, [1.0, 0.0, 0.0, 0.0]
        out.append((t, "LOC_REFERENCE", truth))
    points = stamped(loc.map_points_t, START + 500_000_000)
    points.size, points.point_id = 2, [1, 2]
    points.position = [[5.0, 0.0, 1.0], [0.0, 50.0, 1.0]]
    points.position_cov = [
        np.diag([0.06, 0.03, 0.14]).ravel().tolist(),
        np.diag([900.0] * 3).ravel().tolist(),
    ]
    out.append((points.time_ns, "LOC_MAP", points))
    status = loc.estimator_status_t()
    status.measurement_time_ns, status.method = START + 300_000_000, "inertial-slam"
    status.size, status.condition, status.since_s = 1, ["no GPS"], [0.3]
    out.append((status.measurement_time_ns, "LOC_ESTIMATOR_STATUS", status))
    frame_ = libloc.LocalFrame(*ORIGIN)
    for i in range(round(5 * seconds)):
        t = START + i * 200_000_000
        fix = stamped(loc.gps_fix_t, t, i)
        fix.fix_type = fix.FIX_3D
        fix.latitude, fix.longitude, fix.altitude = frame_.to_geodetic(where(0.2 * i)).tolist()
        fix.position_cov = np.diag([1.0, 1.0, 4.0]).tolist()
        out.append((t, "LOC_GPS", fix))
    return [(channel, m) for _, channel, m in sorted(out, key=lambda one: one[0])]


def fusion(time_ns):
    m = stamped(loc.fusion_t, time_ns)
    m.origin_latitude, m.origin_longitude, m.origin_altitude = ORIGIN
    return m


def write(path, events):
    with LogWriter(path) as log:
        for channel, m in events:
            log.write(channel, m, log_time_us=START // 1000)
    return path


@pytest.fixture
def ride(tmp_path):
    return write(tmp_path / "ride.log", messages())


@pytest.fixture
def rig(tmp_path):
    camera = libloc.CameraCalibration()
    camera.name = "cam0"
    camera.width_px, camera.height_px, camera.intrinsics_px = WIDTH, HEIGHT, [100, 100, 79.5, 59.5]
    camera.time_offset_s = 1e-9 * OFFSET_NS
    rig = libloc.Rig()
    rig.cameras = [camera]
    libloc.write_rig(tmp_path / "rig.yaml", rig)
    return tmp_path / "rig.yaml"


# ---- a stream that keeps what it gets
class Stream:
    def __init__(self):
        self.logged = []  # entity, time of measurement or None, archetypes
        self.rows = {}
        self._stamp = None

    def set_log_time_enabled(self, on):
        assert not on

    set_log_tick_enabled = set_log_time_enabled

    def set_time(self, name, duration=None, sequence=None):
        if sequence is not None:
            self._stamp = sequence
        else:
            assert name == "time"
            self.since_start_ns = int(duration / np.timedelta64(1, "ns"))

    def log(self, entity, *what, static=False):
        self.logged.append((entity, None if static else self._stamp, what))

    def send_columns(self, entity, indexes, columns):
        times = indexes[1].times.to_pylist()
        values = next(iter(columns)).as_arrow_array().to_pylist()
        self.rows.setdefault(entity, []).extend(zip(times, values, strict=True))

    def of(self, entity):
        """Without what holds at all times."""
        return [
            (time_ns, what[0])
            for name, time_ns, what in self.logged
            if name == entity and time_ns is not None
        ]


def values(batch):
    return np.array(batch.as_arrow_array().to_pylist(), dtype=float)


def drawn(path, align="auto", **options):
    """Stream, counts of a log that was drawn into it."""
    stream, channels, window = Stream(), intake.channels_of([]), logs.Window(**options)
    found = logs.survey([path], intake.Intake(channels), 0, window, counts := Counter())
    out = Recorder(rr, stream, found.start_ns)
    scene = Scene(
        out,
        SpaceDrawing(out, None, 0.1),
        PlotDrawing(out),
        pictures.PictureDrawing(out, 0, OFFSET_NS, None, 85),
        30.0,
    )
    scene.space.align, _ = logs.alignment(found, align)
    taken = intake.Intake(channels)
    logs.draw([path], taken, found, window, scene)
    return stream, scene.counts + taken.counts + counts


# ---- geometry
def test_ellipses_and_ellipsoids_hold_so_many_deviations():
    rng = np.random.default_rng(1)
    a = rng.normal(size=(20, 3, 3))
    cov = a @ np.swapaxes(a, 1, 2)
    half, quaternion = geometry.ellipsoids(cov, 3.0)
    R = Rotation.from_quat(quaternion).as_matrix()
    np.testing.assert_allclose(R @ (half[:, :, None] ** 2 / 9 * np.swapaxes(R, 1, 2)), cov, atol=1e-9)
    assert (np.diff(half, axis=1) >= 0).all()

    centres, flat = rng.normal(size=(20, 2)), cov[:, :2, :2]
    outlines = geometry.ellipses(centres, flat, 3.0)
    off = outlines - centres[:, None]
    distance = np.einsum("nki,nij,nkj->nk", off, np.linalg.inv(flat), off)
    np.testing.assert_allclose(distance, 9.0, rtol=1e-3)
    assert (outlines[:, 0] == outlines[:, -1]).all()
    assert geometry.ellipsoids(-np.eye(3)[None], 3.0)[0].max() == 0
    assert geometry.ellipses(np.zeros((0, 2)), np.zeros((0, 2, 2)), 3.0).shape[0] == 0


def test_quaternions_of_all_rotations():
    rotations = Rotation.concatenate(
        [
            Rotation.random(50, rng=np.random.default_rng(2)),
            Rotation.from_rotvec(np.pi * np.eye(3)),
            Rotation.identity(),
        ]
    )
    q = geometry.quaternions_xyzw(rotations.as_matrix())
    np.testing.assert_allclose((Rotation.from_quat(q) * rotations.inv()).magnitude(), 0, atol=1e-9)
    for one in rotations:
        np.testing.assert_allclose(
            geometry.rotation_of(np.roll(one.as_quat(), 1)), one.as_matrix(), atol=1e-12
        )


def test_thinning_is_even_at_any_rate():
    for rate, wanted in ((200.0, 30.0), (30.0, 30.0), (20.0, 30.0), (31.0, 30.0)):
        thinner = Thinner(wanted)
        count = sum(thinner.due(round(1e9 * i / rate)) for i in range(round(10 * rate)))
        assert count == pytest.approx(10 * min(rate, wanted), abs=2), rate
    assert all(Thinner(None).due(0) for _ in range(3))
    thinner = Thinner(10.0)
    assert [thinner.due(t * 10**9) for t in (100, 100, 1, 1)] == [True, False, True, False]  # stepped back


# ---- what is drawn
def test_each_picture_is_drawn_with_its_frame(ride):
    stream, counts = drawn(ride)
    assert counts["pictures.drawn"] == counts["frames.drawn"] == 10
    assert counts["pictures.without_frame"] == counts["frames.without_picture"] == 0
    times = [START + i * 100_000_000 for i in range(10)]  # of the frames, not of the camera's clock
    shown = [time_ns for time_ns, what in stream.of(pictures.IMAGE) if time_ns is not None]
    assert shown == times
    time_ns, points = stream.of(f"{pictures.IMAGE}/features")[3]
    assert time_ns == times[3]
    # Where it was measured, or else expected; rerun's pixels begin at the corner.
    np.testing.assert_allclose(values(points.positions), [[10.5, 20.5], [30.5, 40.5], [50.5, 60.5]])
    assert values(points.class_ids).tolist() == [1, 0, 4]
    ellipses = values(stream.of(f"{pictures.IMAGE}/search")[3][1].strips)
    assert ellipses.shape[0] == 2  # the new one was not searched for
    np.testing.assert_allclose(ellipses[0].min(axis=0), [11.5 - 3 * 2, 20.5 - 3 * 1], atol=0.1)
    np.testing.assert_allclose(ellipses[0].max(axis=0), [11.5 + 3 * 2, 20.5 + 3 * 1], atol=0.1)
    residuals = values(stream.of(f"{pictures.IMAGE}/residuals")[3][1].strips)
    np.testing.assert_allclose(residuals, [[[11.5, 20.5], [10.5, 20.5]]])


def test_space(ride, tmp_path):
    path = write(tmp_path / "tied.log", [*messages(), ("LOC_FUSION", fusion(START))])
    stream, counts = drawn(path)
    assert counts["estimates.drawn"] == pytest.approx(30, abs=1)
    trail = stream.of("world/trajectory/tied")
    points = np.concatenate([values(line.strips)[0] for _, line in trail])
    np.testing.assert_allclose(points[0], where(0), atol=1e-6)
    np.testing.assert_allclose(points[-1], where(0.995), atol=0.08)
    for (_, before), (_, after) in itertools.pairwise(trail):
        np.testing.assert_array_equal(values(before.strips)[0][-1], values(after.strips)[0][0])  # no gaps
    _, ellipsoid = stream.of("world/uncertainty")[0]
    np.testing.assert_allclose(values(ellipsoid.half_sizes), [[0.3, 0.6, 0.9]], rtol=1e-6)
    np.testing.assert_allclose(values(ellipsoid.centers)[0], where(0), atol=1e-6)
    fixes = stream.of("world/gps")
    assert len(fixes) == 5
    for i, (time_ns, fix) in enumerate(fixes):
        assert time_ns == START + i * 200_000_000
        np.testing.assert_allclose(values(fix.positions)[0], where(0.2 * i), atol=1e-4)
    # The map is the only one: from the start. The far point, hardly known, has no ellipsoid.
    assert stream.of("world/map/points")[0][0] == START - OFFSET_NS
    np.testing.assert_allclose(values(stream.of("world/map/points")[0][1].positions), [[5, 0, 1]])
    np.testing.assert_allclose(values(stream.of("world/map/far")[0][1].positions), [[0, 50, 1]])
    _, around = stream.of("world/map/uncertainty")[0]
    # Less what is shared with the pose, (0.01, 0.04, 0.09): what would be negative has no extent.
    np.testing.assert_allclose(values(around.half_sizes), [3 * np.sqrt([0, 0.05, 0.05])], atol=1e-6)
    _, camera = stream.of("world/camera")[2]
    np.testing.assert_allclose(values(camera.translation)[0], where(0.2), atol=1e-6)
    np.testing.assert_allclose(values(camera.quaternion)[0], [-0.5, 0.5, -0.5, 0.5])


def test_a_reference_in_another_world_is_aligned(ride):
    stream, counts = drawn(ride)
    assert counts["reference.drawn"] == 200
    points = np.concatenate([values(line.strips)[0] for _, line in stream.of("world/reference")])
    np.testing.assert_allclose(points[0], where(0), atol=1e-4)
    stream, counts = drawn(ride, align="none")
    first = values(stream.of("world/reference")[0][1].strips)[0][0]
    np.testing.assert_allclose(first, elsewhere(where(0)), atol=1e-4)


def test_numbers_and_status(ride):
    stream, _ = drawn(ride)
    assert len(stream.rows["plots/reprojection"]) == 10
    assert stream.rows["plots/reprojection"][4] == (START + 400_000_000, [1.5, 0.5])
    assert stream.rows["plots/nis"][0][1] == [1.5, 1.0]
    assert stream.rows["plots/features"][0][1] == [3, 2, 1, 0, 1]
    assert stream.rows["plots/time"][0][1] == [2.0]
    np.testing.assert_allclose(stream.rows["plots/position_sigma"][5][1], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(stream.rows["plots/heading_sigma"][5][1], [np.rad2deg(0.02)])
    assert stream.rows["plots/latency"][0][1] == [4.0]
    # Set in every second estimate from 0.2 s to 0.395 s: one span, that ends 0.2 s after the last one.
    lane = [
        (t, w.state.as_arrow_array().to_pylist())
        for t, w in stream.of("status/few_features")
        if t is not None
    ]
    assert lane == [(START + 200_000_000, ["on"]), (START + 590_000_000, [""])]
    assert [w.state.as_arrow_array().to_pylist() for t, w in stream.of("status/estimate") if t] == [["pose"]]
    assert [(t, w.text.as_arrow_array().to_pylist()) for t, w in stream.of("messages")] == [
        (START + 300_000_000, ["inertial-slam: no GPS"])
    ]


def test_what_the_estimator_says():
    stream = Stream()
    plots = PlotDrawing(Recorder(rr, stream))
    m = loc.estimator_status_t()
    m.measurement_time_ns, m.method = START, "inertial-slam"
    for conditions in ([], ["no GPS"], ["no GPS"], ["lost", "no GPS"], ["lost"]):
        m.size, m.condition, m.since_s = len(conditions), conditions, [0.0] * len(conditions)
        plots.status(m)
        m.measurement_time_ns += 10**9
    said = [(t - START, what.text.as_arrow_array().to_pylist()[0]) for t, what in stream.of("messages")]
    assert said == [
        (0, "inertial-slam: all is well"),
        (1 * 10**9, "inertial-slam: no GPS"),
        (3 * 10**9, "inertial-slam: lost"),
        (4 * 10**9, "inertial-slam: no longer: no GPS"),
    ]
    lanes = [w.state.as_arrow_array().to_pylist()[0] for t, w in stream.of("status/says") if t is not None]
    assert lanes == ["all is well", "no GPS", "lost, no GPS", "lost"]


def test_part_of_a_log(ride):
    stream, counts = drawn(ride, start_s=0.25, duration_s=0.5)
    assert counts["pictures.drawn"] == 5  # at 0.3 to 0.7 s
    assert min(t for _, t, _ in stream.logged if t is not None) >= START + 200_000_000


def test_no_line_between_two_worlds(tmp_path):
    """Until GPS has tied the map to the Earth, positions are in the map's own world."""
    stream = Stream()
    space = SpaceDrawing(Recorder(rr, stream), None, 0.1)
    events = []
    for i in range(40):
        m = estimate(START + i * 50_000_000, i, where(0.05 * i) + (0 if i < 20 else 1000))
        if i < 20:
            m.valid &= ~m.VALID_HEADING
        events.append(("LOC_ESTIMATE", m))
        space.estimate(m)
    space.finish()
    for entity, low, high in (("local", 0, 10), ("tied", 1000, 1010)):
        points = np.concatenate([values(one.strips)[0] for _, one in stream.of(f"world/trajectory/{entity}")])
        assert low <= points[:, 0].min() <= points[:, 0].max() <= high
    assert space.tied_ns == START + 20 * 50_000_000
    # The view is made for the world that the log ends in.
    path = write(tmp_path / "tied.log", events)
    found = logs.survey([path], intake.Intake(intake.channels_of([])), 0, logs.Window(), Counter())
    assert found.became_tied
    centre, radius = logs.extent(found)
    assert centre[0] > 1000
    assert radius < 10


def test_gps_waits_for_the_origin():
    stream = Stream()
    space = SpaceDrawing(Recorder(rr, stream), None, 0.1)
    fixes = [m for channel, m in messages() if channel == "LOC_GPS"]
    for fix in fixes:
        space.gps(fix)
    assert not stream.of("world/gps")
    space.fusion(fusion(START))
    assert len(stream.of("world/gps")) == 5
    fixes[0].fix_type = fixes[0].FIX_NONE
    fixes[1].latitude = NAN
    for fix in fixes[:2]:
        space.gps(fix)
    assert space.counts["gps.without_position"] == 2
    assert len(stream.of("world/gps")) == 5


# ---- what cannot be used
def test_raw_pictures_and_damaged_ones():
    grey = np.arange(WIDTH * HEIGHT, dtype=np.uint32).reshape(HEIGHT, WIDTH) % 251
    m = image(START, 0)
    m.pixelformat, m.row_stride = m.PIXEL_FORMAT_GRAY, WIDTH + 8
    m.data = np.pad(grey.astype(np.uint8), ((0, 0), (0, 8))).tobytes()
    back = np.array(Image.open(io.BytesIO(pictures.jpeg_of(m, 95)))).astype(int)
    assert np.abs(back - grey).mean() < 12
    m.data = m.data[: -WIDTH // 2 - 9]
    with pytest.raises(pictures.PictureError, match="too few"):
        pictures.jpeg_of(m, 95)
    red = np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8)
    red[..., 2] = 255
    m.pixelformat, m.row_stride, m.data = m.PIXEL_FORMAT_BGR, 3 * WIDTH, red.tobytes()
    assert np.array(Image.open(io.BytesIO(pictures.jpeg_of(m, 95))))[5, 5].argmax() == 0
    m.pixelformat = 77
    with pytest.raises(pictures.PictureError, match="not known"):
        pictures.jpeg_of(m, 95)
    for data in (b"", b"no JPEG", jpeg()[:-300]):
        with pytest.raises(pictures.PictureError):
            pictures.jpeg_of(image(START, 0, data), 95)
    small = image(START, 0)
    small.width = 80
    with pytest.raises(pictures.PictureError, match="message says"):
        pictures.jpeg_of(small, 95)


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


def test_wrong_input(tmp_path, capsys, ride, monkeypatch):
    def fails(*arguments):
        assert view.main([*map(str, arguments), "--save", str(tmp_path / "x.rrd")]) == 1
        assert not (tmp_path / "x.rrd").exists()
        assert not list(tmp_path.glob("*.rrd"))
        return capsys.readouterr().err

    assert "none.log" in fails(tmp_path / "none.log")
    (tmp_path / "text.log").write_text("time,x\n1,2\n" * 100)
    assert "is not an LCM log" in fails(tmp_path / "text.log")
    other = write(
        tmp_path / "other.log", [("LOC_IMU", stamped(loc.imu_t, START)), ("MY_IMAGES", image(START, 0))]
    )
    error = fails(other)
    assert "nothing to be drawn" in error
    assert "LOC_IMU, MY_IMAGES" in error
    assert view.main([str(ride), "--save", str(tmp_path / "none" / "x.rrd")]) == 1
    assert "none: no such folder" in capsys.readouterr().err
    assert "rig" in fails(ride, "--config", tmp_path / "rig.yaml")
    assert view.main([str(other), "--channel", "image=MY_IMAGES", "--save", str(tmp_path / "x.rrd")]) == 0
    assert "pictures.drawn = 1" in capsys.readouterr().out
    assert view.main([str(other), "--channel", "image=MY_IMAGES", "--save", str(tmp_path / "x.rrd")]) == 1
    assert "exists already" in capsys.readouterr().err

    monkeypatch.setattr(output, "_DRIVERS", ())
    monkeypatch.delenv("VK_DRIVER_FILES", raising=False)
    monkeypatch.delenv("VK_ICD_FILENAMES", raising=False)
    assert view.main([str(ride), "--screenshot", str(tmp_path / "x.png")]) == 1
    assert "apt-get install mesa-vulkan-drivers" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert view.main([str(ride), "--save", str(tmp_path / "y.rrd")]) == 1
    assert "pip install rerun-sdk" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--channel", "image"], "STREAM=NAME"),
        (["--channel", "no=X"], "no stream 'no'"),
        (["--channel", "gps=LOC_IMAGE"], "carries both"),
        (["--save", "x.txt"], "end with .rrd"),
        (["--screenshot", "x.jpg"], "end with .png"),
        (["--web", "--spawn"], "one viewer"),
        (["--spawn"], "no display"),
        (["--rate-hz", "0"], "positive"),
        (["--size", "10x10"], "200 to 8192"),
        (["--memory", "much"], "500MB"),
        (["--start", "-1"], "negative"),
        (["--camera", "-1"], "negative"),
    ],
)
def test_wrong_options(arguments, says, capsys, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(SystemExit) as error:
        view.main(["x.log", *arguments])
    assert error.value.code == 2
    assert says in capsys.readouterr().err


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


# ---- the program
VIEW = [sys.executable, "-m", "libloc.programs.view"]


def rows_of(path):
    """Rows of each entity in an .rrd file."""
    text = subprocess.run(
        [*output.rerun_command(), "rrd", "print", path], capture_output=True, text=True, check=True
    ).stdout
    rows = {}
    for count, entity in re.findall(r"with (\d+) rows? .*? - (/\S+) - ", text):
        rows[entity] = rows.get(entity, 0) + int(count)
    return rows


@contextmanager
def started(*arguments):
    with subprocess.Popen(
        [*VIEW, *map(str, arguments)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
        # A test run in the background ignores Ctrl-C, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:  # fmt: skip
        try:
            yield process
        finally:
            process.terminate()


@contextmanager
def hub():
    command = [built_program("loc-hub"), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()


def test_a_log_becomes_a_recording(ride, rig, tmp_path, capsys):
    path = tmp_path / "out.rrd"
    assert view.main([str(ride), "--config", str(rig), "--save", str(path)]) == 0
    out = capsys.readouterr().out
    assert "pictures.drawn = 10" in out
    assert "gps.without_origin = 5" in out
    assert "aligned" in out or "alignment (se3)" in out
    assert list(tmp_path.glob("*.rrd")) == [path]
    rows = rows_of(path)
    assert rows["/plots/reprojection"] == 10 + 1  # and the names of the lines
    assert rows["/world/camera/image"] == 10 + 2  # lens, legend
    assert rows["/world/camera/image/features"] == rows["/world/camera/image/search"] == 10 + 1  # and how
    assert rows["/world/body"] == pytest.approx(30, abs=1)


def test_live_over_a_hub_until_ctrl_c(tmp_path):
    path = tmp_path / "live.rrd"
    with hub() as url, started("--lcm-url", url, "--save", path) as process:
        assert "listening" in wait_for(process, "listening")
        time.sleep(0.2)
        connection = lcm.LCM(url)
        for channel, m in messages():
            connection.publish(channel, m.encode())
            if channel == "LOC_IMAGE":
                time.sleep(0.05)
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate(timeout=30)
    assert process.returncode == 0, errors
    for count in (
        "LOC_IMAGE.received = 10",
        "LOC_ESTIMATE.received = 200",
        "pictures.drawn = 10",
        "frames.drawn = 10",
    ):
        assert count in out, out
    assert "dropped" not in out
    rows = rows_of(path)
    assert rows["/plots/reprojection"] == 10 + 1
    assert rows["/world/camera/image/features"] == 10 + 1


def wait_for(process, text):
    for line in process.stderr:
        if text in line:
            return line
    raise AssertionError(f"{text!r} was not said")


def test_a_full_disk(tmp_path, monkeypatch, capsys):
    """What was written by then stays; an error says which file."""

    class Full:
        def __getattr__(self, name):
            return getattr(self.stream, name)

        def __init__(self, *arguments):
            self.stream = rr.RecordingStream(*arguments)

        def flush(self, timeout_sec):
            self.stream.flush(timeout_sec=timeout_sec)
            raise RuntimeError("File-writer thread shut down prematurely")

    class Module:
        RecordingStream = Full

        def __getattr__(self, name):
            return getattr(rr, name)

    made = target.Target(Module(), tmp_path / "x.rrd", None, (800, 600), None)
    with pytest.raises(output.ViewerError, match=r"x\.part\.rrd: .*is the disk full"), made:
        made.keep_part = True
        made.stream.log("here", rr.TextLog("there"))
        made.check(time.monotonic())
    assert [one.name for one in tmp_path.iterdir()] == ["x.part.rrd"]
    assert rows_of(tmp_path / "x.part.rrd")["/here"] == 1


def test_nothing_to_hear(tmp_path, capsys):
    arguments = ["--save", str(tmp_path / "x.rrd"), "--duration", "0.3"]
    assert view.main(["--lcm-url", "tcpq://127.0.0.1:1", *arguments]) == 1
    assert "loc-hub" in capsys.readouterr().err
    assert view.main(["--lcm-url", "memq://", *arguments]) == 1
    assert "nothing to be drawn has come" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def listening_addresses(port):
    """Hexadecimal, as the kernel lists them."""
    out = set()
    for family in ("tcp", "tcp6"):
        for line in Path("/proc/net", family).read_text().splitlines()[1:]:
            local, state = line.split()[1], line.split()[3]
            if state == "0A" and int(local.rsplit(":", 1)[1], 16) == port:
                out.add(local.rsplit(":", 1)[0])
    return out


def test_in_the_browser_of_this_machine_alone(ride, tmp_path, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    ports = "--web-port", output.free_port(), "--data-port", output.free_port()
    with started(ride, "--memory", "100MB", *ports) as process:
        assert "no display" in wait_for(process, "no display")
        lines = []
        for line in process.stdout:
            lines.append(line)
            if "Ctrl-C" in line:
                break
        text = "".join(lines)
        page = re.search(r"open (http://127\.0\.0\.1:(\d+)\?url=\S+)", text)
        forwards = re.search(r"ssh -L (\d+):127\.0\.0\.1:\1 -L (\d+):127\.0\.0\.1:\2 ", text)
        assert page and forwards and page[2] == forwards[1]
        with urllib.request.urlopen(page[1], timeout=10) as answer:
            assert b"<html" in answer.read().lower()
        for port in forwards.groups():
            assert listening_addresses(int(port)) == {"0100007F"}
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
        assert process.returncode == 0, errors
        for port in forwards.groups():
            assert listening_addresses(int(port)) == set()


@pytest.mark.slow
def test_screenshot(ride, rig, tmp_path, capsys):
    try:
        output.check_screenshots()
    except output.ViewerError as error:
        pytest.skip(str(error))
    path = tmp_path / "x.png"
    assert view.main([str(ride), "--config", str(rig), "--screenshot", str(path), "--size", "800x600"]) == 0
    assert "the viewer says" not in capsys.readouterr().err
    picture = np.array(Image.open(path).convert("RGB")).astype(int)
    assert picture.shape[:2] == (600, 800)
    # The grey of the picture's pixels, on the left.
    assert (np.abs(picture[:, :400] - 128).max(axis=2) < 12).mean() > 0.1
