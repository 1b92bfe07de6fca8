"""loc-view: what is drawn of messages."""

import io
import itertools
from collections import Counter

import loc
import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

rr = pytest.importorskip("rerun", reason="needs rerun-sdk")

from libloc.view import geometry, intake, logs, pictures  # noqa: E402
from libloc.view.plots import PlotDrawing  # noqa: E402
from libloc.view.recorder import Recorder, Thinner  # noqa: E402
from libloc.view.space import SpaceDrawing  # noqa: E402
from view_support import (  # noqa: E402
    HEIGHT,
    NAN,
    OFFSET_NS,
    START,
    WIDTH,
    Stream,
    drawn,
    elsewhere,
    estimate,
    fusion,
    image,
    jpeg,
    messages,
    ride_log,
    values,
    where,
    write,
)


@pytest.fixture
def ride(tmp_path):
    return ride_log(tmp_path)


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
