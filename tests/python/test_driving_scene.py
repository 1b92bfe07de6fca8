"""Pictures, videos and rerun recordings of a drive: what is on them, and what bad input gives."""

import subprocess
import sys
from dataclasses import replace

import loc
import numpy as np
import pytest
from libloc.driving.painter import Camera
from libloc.driving.scene import _overlap
from libloc.driving.video import write_video
from libloc.lcm_log import LogWriter
from libloc.programs import animate
from PIL import Image
from support import built_program

import libloc
from libloc import driving

START_NS = 1_700_000_000_000_000_000
SMALL = driving.AnimationOptions(width=320, height=180, rate_hz=10, speed=10)
BLUE = np.array([0, 114, 189])


def make_run(duration_s=30.0, error_m=(1.0, -2.0, 0.5), rate_hz=20):
    """The drive of the example, an estimate that is off by a constant, odometry of scale 2."""
    t = np.arange(0, duration_s, 1 / rate_hz)
    motion = libloc.WaypointMotion(**libloc.example_drive()).sample(t)
    times = START_NS + np.rint(t * 1e9).astype(np.int64)
    n = len(t)
    truth = driving.Truth(
        times,
        motion.q_world_body_wxyz,
        motion.position,
        gyroscope_bias=np.full((n, 3), 0.03),
        accelerometer_bias=np.zeros((n, 3)),
        odometry_scale=np.full(n, 2.0),
    )
    estimate = driving.Estimate(
        times,
        libloc.so3.boxplus(motion.q_world_body_wxyz, np.tile([0.0, 0.0, 0.02], (n, 1))),
        motion.position + np.array(error_m),
        attitude_sigma=np.full((n, 3), 0.01),
        position_sigma=np.full((n, 3), 1.0),
        gyroscope_bias=np.full((n, 3), 0.031),
        gyroscope_bias_sigma=np.full((n, 3), 1e-3),
        accelerometer_bias=np.full((n, 3), 0.01),
        accelerometer_bias_sigma=np.full((n, 3), 0.01),
        scale=np.full(n, 2.02),
        scale_sigma=np.full(n, 0.02),
    )
    return driving.DrivingRun(truth, estimate, driving.Odometry(times[::2], 2 * motion.position[::2] + 0.6))


@pytest.fixture(scope="module")
def run():
    return make_run()


@pytest.fixture(scope="module")
def scene(run):
    return driving.scene_along(run.truth.position)


def test_errors_of_a_known_estimate(run):
    assert run.position_rmse == pytest.approx(np.sqrt(1 + 4 + 0.25))
    assert run.attitude_rmse == pytest.approx(0.02)
    np.testing.assert_allclose(run.attitude_error, np.tile([0, 0, 0.02], (600, 1)), atol=1e-12)
    np.testing.assert_allclose(run.position_error, np.tile([1, -2, 0.5], (600, 1)), atol=1e-12)
    assert run.scale_error == pytest.approx(0.01)
    assert run.odometry_rmse == pytest.approx(np.sqrt(3) * 0.3)
    assert run.odometry_in_metres[2] == "true scale"


def test_truth_is_interpolated_and_gaps_in_it_are_left_out(run):
    t = run.truth
    keep = np.r_[0:100, 140:400:3]
    columns = {
        name: getattr(t, name)[keep]
        for name in ("times_ns", "q_world_body_wxyz", "position", "gyroscope_bias", "odometry_scale")
    }
    sparse = driving.DrivingRun(driving.Truth(**columns), run.estimate, run.odometry)
    assert sparse.without_truth == 40 + (600 - 399)
    assert np.abs(sparse.position_error - [1, -2, 0.5]).max() < 0.03
    assert np.abs(sparse.attitude_error - [0, 0, 0.02]).max() < 2e-3
    # Without a true scale the estimated one is taken.
    unknown = driving.DrivingRun(replace(t, odometry_scale=np.full(600, np.nan)), run.estimate, run.odometry)
    assert unknown.odometry_in_metres[2] == "estimated scale"
    assert unknown.scale_error is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda e: {"position": e.position[:-1]},
            r"estimate.position: has shape \(599, 3\), must be \(600, 3\)",
        ),
        (
            lambda e: {"position": np.where(np.arange(600)[:, None] == 7, np.nan, e.position)},
            r"\[7, 0\] = nan",
        ),
        (lambda e: {"scale": e.scale[:3]}, r"estimate.scale: has shape \(3,\)"),
        (lambda e: {"times_ns": e.times_ns[::-1]}, r"estimate.times_ns\[1\] = .*: times must increase"),
        (lambda e: {"times_ns": e.times_ns * 1e-9}, "must be integers"),
        (lambda e: {"q_world_body_wxyz": 2 * e.q_world_body_wxyz}, r"\[0\]: has norm 2.0"),
        (lambda e: {"position_sigma": -e.position_sigma}, r"\[0, 0\] = -1.0: must not be negative"),
        (lambda e: {"position": None}, "estimate.position: is missing"),
    ],
)
def test_bad_arrays_are_named(run, change, message):
    with pytest.raises(ValueError, match=message):
        replace(run.estimate, **change(run.estimate))


def test_a_truth_of_another_time_is_an_error(run):
    with pytest.raises(ValueError, match="share no time"):
        driving.DrivingRun(replace(run.truth, times_ns=run.truth.times_ns + 10**12), run.estimate)


def test_scene_is_the_same_again_and_off_the_road(run, scene):
    again = driving.scene_along(run.truth.position)
    assert len(scene.buildings) == len(again.buildings) > 20
    assert all(
        np.array_equal(a.corners, b.corners) for a, b in zip(scene.buildings, again.buildings, strict=True)
    )
    other = driving.scene_along(run.truth.position, seed=3)
    assert not np.array_equal(scene.buildings[0].corners, other.buildings[0].corners)
    left = 0
    for i, building in enumerate(scene.buildings):
        c = building.corners
        edges = np.roll(c, -1, axis=0) - c
        assert np.all(edges[:, 0] * np.roll(edges[:, 1], -1) > edges[:, 1] * np.roll(edges[:, 0], -1))
        # Every place of the road is at least half its width away: points of the outline, one a metre.
        outline = np.concatenate(
            [a + np.linspace(0, 1, 25)[:, None] * d for a, d in zip(c, edges, strict=True)]
        )
        distance = np.linalg.norm(outline[:, None] - scene.road[None, :, :2], axis=2)
        assert distance.min() > scene.road_width_m / 2
        nearest = int(np.argmin(distance.min(axis=0)))
        along = scene.road[min(nearest + 1, len(scene.road) - 1)] - scene.road[max(nearest - 1, 0)]
        to = c.mean(axis=0) - scene.road[nearest, :2]
        left += along[0] * to[1] > along[1] * to[0]
        assert not any(_overlap(c, other.corners) for other in scene.buildings[:i])
    assert 0.25 < left / len(scene.buildings) < 0.75


def test_paths_without_a_road_are_errors():
    with pytest.raises(ValueError, match=r"path: is 0 m long"):
        driving.scene_along(np.zeros((5, 3)))
    with pytest.raises(ValueError, match=r"path\[1, 2\] = nan"):
        driving.scene_along(np.array([[0, 0, 0], [9, 0, np.nan]]))
    with pytest.raises(ValueError, match=r"must be \(N, 3\)"):
        driving.scene_along(np.zeros((5, 2)))
    with pytest.raises(ValueError, match=r"scene\.min_width_m = 30\.0: is more than"):
        driving.scene_along(np.eye(3) * 40, options=driving.SceneOptions(min_width_m=30.0))


def test_projection_is_that_of_a_pinhole():
    # 10 m above and 10 m behind the origin, looking at it: 45 degrees down along x.
    camera = Camera(np.array([-10.0, 0, 10]), np.zeros(3), 201, 101, 100.0)
    root2 = np.sqrt(2)
    # A metre to the left (y), a metre up, a metre ahead.
    np.testing.assert_allclose(camera.project([0, 0, 0]), [100, 50], atol=1e-9)
    np.testing.assert_allclose(camera.project([0, 1, 0]), [100 - 100 / (10 * root2), 50], atol=1e-9)
    np.testing.assert_allclose(
        camera.project([0, 0, 1]), [100, 50 - 100 * (1 / root2) / (10 * root2 - 1 / root2)], atol=1e-9
    )
    np.testing.assert_allclose(
        camera.project([1, 0, 0]), [100, 50 - 100 * (1 / root2) / (10 * root2 + 1 / root2)], atol=1e-9
    )
    assert np.isnan(camera.project([-30, 0, 0])).all()


def is_blue(pixel):
    """Of the solid box: its colour, lit or in shade."""
    rest = np.asarray(pixel, dtype=float)
    return rest[0] < 30 and rest[2] > 1.3 * rest[1] > 50


def test_the_true_vehicle_is_drawn_where_it_is(run, scene):
    # The estimate is far off, so that it covers nothing.
    away = driving.DrivingRun(
        run.truth, replace(run.estimate, position=run.position + np.array([0, 0, 60.0]))
    )
    animation = driving.DrivingAnimation(away, scene, replace(SMALL, width=640, height=360))
    for t in (2.0, 14.3, 27.0):
        picture = animation.frame(t)
        camera = animation.camera(t)
        motion = libloc.WaypointMotion(**libloc.example_drive()).sample(np.array([t]))
        position, heading = motion.position[0], libloc.so3.heading(motion.q_world_body_wxyz[0])
        ahead = np.array([np.cos(heading), np.sin(heading), 0])
        left = np.array([-ahead[1], ahead[0], 0])
        roof = position + 1.35 * ahead + [0, 0, 1.5]
        for place, inside in (
            (roof, True),
            (roof + 1.9 * ahead + 0.6 * left, True),
            (roof - 1.9 * ahead - 0.6 * left, True),
            (roof + 3.5 * ahead, False),
            (position + 1.35 * ahead + 2.2 * left, False),
            (position + 1.35 * ahead - 2.2 * left, False),
        ):
            column, row = np.rint(camera.project(place)).astype(int)
            assert is_blue(picture[row, column]) == inside, (t, place - position, picture[row, column])


def test_the_estimated_vehicle_is_transparent_and_apart(run, scene):
    same = replace(run.estimate, position=run.true_position, q_world_body_wxyz=run.true_q_world_body_wxyz)
    apart = driving.DrivingAnimation(run, scene, replace(SMALL, width=640, height=360))
    together = driving.DrivingAnimation(driving.DrivingRun(run.truth, same), scene, apart.options)
    t = 10.0
    place = run.position[200] + [1.35, -0.4, 1.5]  # drives along x here
    column, row = np.rint(apart.camera(t).project(place)).astype(int)
    with_box, without = apart.frame(t)[row, column], together.frame(t)[row, column]
    assert not is_blue(without)
    # Towards blue, but what is below still shines through.
    assert 0.2 < 1 - np.linalg.norm(with_box - BLUE) / np.linalg.norm(without - BLUE) < 0.8


def test_the_horizon_is_level():
    # An empty plain, looked at in all directions: sky above the horizon, ground below.
    whole = make_run(60.0, rate_hz=5)
    empty = driving.DrivingScene(driving.scene_along(whole.truth.position).road, 8.0, ())
    low = driving.DrivingAnimation(whole, empty, replace(SMALL, behind_m=60.0, above_m=12.0))
    high = driving.DrivingAnimation(whole, empty, SMALL)
    for t in (3.0, 23.5, 29.0, 55.2, 57.6):
        picture, camera = low.frame(t).astype(int), low.camera(t)
        ahead = camera.axes[2] * [1, 1, 0] / np.hypot(*camera.axes[2, :2])
        row = round(float(camera.project(camera.eye + 1e6 * ahead)[1]))
        assert 5 < row < 60
        # The panels cover the outer columns.
        assert np.all(picture[row - 2, 95:236, 2] > picture[row - 2, 95:236, 0] + 5)
        assert np.all(picture[row + 4, 95:236, 1] > picture[row + 4, 95:236, 2])
        # From higher up it lies above the picture.
        top = high.frame(t)[1, 95:236].astype(int)
        assert np.all(top[:, 1] > top[:, 2])


def test_summary_shows_all_rows(run, tmp_path):
    figure = driving.plot_summary(run, "title")
    assert [a.get_ylabel().split("\n")[0] for a in figure.axes] == [
        *("y, north [m]", "position [m]", "attitude [°]", "scale", "gyro bias", "acc. bias")
    ]
    errors = figure.axes[1].get_lines()
    np.testing.assert_allclose(errors[0].get_ydata(), 1.0, atol=1e-12)
    assert sorted({float(line.get_ydata()[-1]) for line in errors[1:3]}) == [-3.0, 3.0]
    driving.save_summary(run, tmp_path / "summary.png")
    with Image.open(tmp_path / "summary.png") as image:
        picture = np.asarray(image.convert("RGB"))
    assert picture.shape == (760, 1300, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100
    plain = driving.Estimate(run.times_ns, run.q_world_body_wxyz, run.position)
    assert len(driving.plot_summary(driving.DrivingRun(run.truth, plain)).axes) == 3


def test_video_has_all_pictures_and_can_be_read(run, scene, tmp_path):
    av = pytest.importorskip("av")
    seen = []
    count = driving.animate(run, scene, tmp_path / "x.mp4", SMALL, progress=lambda *done: seen.append(done))
    assert count == 30 and seen[-1] == (30, 30)
    with av.open(str(tmp_path / "x.mp4")) as video:
        frames = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
        assert float(video.streams.video[0].average_rate) == 10
    assert len(frames) == 30
    drawn = driving.DrivingAnimation(run, scene, SMALL).frame(12.0).astype(float)
    # H.264 changes colours a little; another time of the drive differs far more.
    assert np.abs(frames[12] - drawn).mean() < 6 < np.abs(frames[20] - drawn).mean()
    with pytest.raises(FileExistsError, match=r"x\.mp4: exists already"):
        driving.animate(run, scene, tmp_path / "x.mp4", SMALL)
    assert [path.name for path in tmp_path.iterdir()] == ["x.mp4"]


def test_gif_and_folder_need_no_package(run, scene, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)  # as if it were not installed
    monkeypatch.setitem(sys.modules, "rerun", None)
    few = replace(SMALL, speed=100)
    assert driving.animate(run, scene, tmp_path / "x.gif", few) == 3
    with Image.open(tmp_path / "x.gif") as gif:
        assert (gif.n_frames, gif.size, gif.info["duration"]) == (3, (320, 180), 100)
    assert driving.animate(run, scene, tmp_path / "frames", few) == 3
    assert sorted(path.name for path in (tmp_path / "frames").iterdir()) == [
        f"frame_{i:05d}.png" for i in range(3)
    ]
    # A shorter run leaves no pictures of the longer one, and a folder with other things is left alone.
    assert driving.animate(run, scene, tmp_path / "frames", replace(few, speed=200), overwrite=True) == 2
    assert len(list((tmp_path / "frames").iterdir())) == 2
    (tmp_path / "frames" / "mine.txt").write_text("x")
    with pytest.raises(FileExistsError, match="holds more than pictures"):
        driving.animate(run, scene, tmp_path / "frames", few, overwrite=True)
    with pytest.raises(driving.MissingPackageError, match=r"pip install av.*x\.gif.*needs nothing more"):
        driving.animate(run, scene, tmp_path / "x.mp4", few)
    with pytest.raises(driving.MissingPackageError, match="pip install rerun-sdk"):
        driving.save_rerun(run, scene, tmp_path / "x.rrd")
    with pytest.raises(ValueError, match=r"\.mp4, \.mkv or \.gif"):
        driving.animate(run, scene, tmp_path / "x.avi", few)
    with pytest.raises(FileNotFoundError, match="no such folder"):
        driving.animate(run, scene, tmp_path / "absent" / "x.gif", few)
    with pytest.raises(ValueError, match=r"animation\.speed = 0: must be positive"):
        driving.animate(run, scene, tmp_path / "y.gif", replace(few, speed=0))


def test_a_video_that_breaks_off_leaves_no_file(tmp_path):
    def frames():
        for _ in range(100):  # enough that some are in the file already
            yield np.zeros((32, 32, 3), np.uint8)
        yield np.zeros((16, 32, 3), np.uint8)

    with pytest.raises(ValueError, match=r"frame 100: has shape \(16, 32, 3\), the first has \(32, 32, 3\)"):
        write_video(tmp_path / "x.gif", frames(), 10)
    pytest.importorskip("av")
    with pytest.raises(ValueError, match="frame 100: has shape"):
        write_video(tmp_path / "x.mp4", frames(), 10)
    with pytest.raises(ValueError, match="there are none"):
        write_video(tmp_path / "x.mkv", iter(()), 10)
    assert not list(tmp_path.iterdir())


def test_rerun_recording(run, scene, tmp_path):
    pytest.importorskip("rerun")
    path = tmp_path / "x.rrd"
    driving.save_rerun(run, scene, path)
    assert [one.name for one in tmp_path.iterdir()] == ["x.rrd"]
    out = subprocess.run(
        [sys.executable, "-m", "rerun_cli", "rrd", "print", path],
        capture_output=True,
        text=True,
        check=True,
        env={"HOME": str(tmp_path), "PATH": ""},
    ).stdout
    for entity in ("world/road", "world/buildings", "world/truth", "world/estimate", "world/trail/odometry"):
        assert f"/{entity}" in out
    assert "/errors/position/upper" in out
    with pytest.raises(FileExistsError):
        driving.save_rerun(run, scene, path)


def write_log(path, run, with_truth=True, world="ENU", covariance=True):
    """The drive as loc-estimator's log: estimates, scale, truth, odometry."""
    e = run.estimate
    with LogWriter(path) as log:
        for i, time_ns in enumerate(int(t) for t in e.times_ns):
            m, scale = loc.estimate_t(), loc.fusion_t()
            m.time_ns = m.host_time_ns = m.publish_time_ns = time_ns
            scale.time_ns = scale.host_time_ns = time_ns
            m.sequence = scale.sequence = i
            m.method, m.world = "error-state", world
            m.valid = 1 | 4 | 16 | 32 | (64 if covariance else 0)
            if i == 3:
                m.valid = 1  # no position yet
            m.q_world_body_wxyz, m.position = list(e.q_world_body_wxyz[i]), list(e.position[i])
            m.velocity = m.angular_velocity = [float("nan")] * 3
            m.gyroscope_bias, m.accelerometer_bias = list(e.gyroscope_bias[i]), list(e.accelerometer_bias[i])
            sigma = np.concatenate(
                [e.attitude_sigma[i], e.position_sigma[i], [1] * 3, e.gyroscope_bias_sigma[i], [0.01] * 3]
            )
            m.covariance_dim = 15 if covariance else 0
            m.covariance = np.diag(sigma**2).tolist() if covariance else []
            scale.scale, scale.scale_sigma = float(e.scale[i]), float(e.scale_sigma[i])
            scale.origin_latitude = scale.origin_longitude = scale.origin_altitude = float("nan")
            if with_truth:
                truth = loc.reference_t()
                truth.time_ns = truth.host_time_ns = time_ns
                truth.sequence, truth.score = i, True
                truth.q_world_body_wxyz = list(run.truth.q_world_body_wxyz[i])
                truth.position, truth.velocity = list(run.truth.position[i]), [float("nan")] * 3
                log.write(libloc.REFERENCE_CHANNEL, truth, time_ns // 1000)
            if i % 2 == 0:
                vo = loc.odometry_t()
                vo.time_ns = vo.host_time_ns = time_ns
                vo.sequence, vo.start_time_ns = i, libloc.NO_TIME
                vo.position, vo.q_wxyz = list(run.odometry.position[i // 2]), [1.0, 0, 0, 0]
                vo.position_cov = vo.orientation_cov = np.eye(3).tolist()
                log.write(libloc.ODOMETRY_CHANNEL, vo, time_ns // 1000)
            log.write(libloc.ESTIMATE_CHANNEL, m, time_ns // 1000)
            log.write(libloc.FUSION_CHANNEL, scale, time_ns // 1000)


def write_truth_csv(path, run):
    t = run.truth
    names = ["time_ns", *(f"q_world_body_{a}" for a in "wxyz"), *(f"position_{a}_m" for a in "xyz")]
    names += [f"gyroscope_bias_{a}_rad_s" for a in "xyz"] + [f"accelerometer_bias_{a}_m_s2" for a in "xyz"]
    lines = [",".join([*names, "odometry_scale", "gps_error_e_m"])]
    rows = zip(
        t.times_ns, t.q_world_body_wxyz, t.position, t.gyroscope_bias, t.accelerometer_bias, strict=True
    )
    for time, *values in rows:
        lines.append(",".join([str(time), *(repr(float(v)) for v in np.concatenate(values)), "2", ""]))
    path.write_text("\n".join(lines) + "\n")


def test_a_log_gives_the_same_drive(run, tmp_path):
    write_log(tmp_path / "run.log", run)
    back, counts = driving.run_of_log(tmp_path / "run.log")
    assert counts == {"estimate.without_pose": 1}
    keep = np.arange(600) != 3
    np.testing.assert_array_equal(back.times_ns, run.times_ns[keep])
    np.testing.assert_allclose(back.position_error, run.position_error[keep], atol=1e-12)
    for name in ("attitude_sigma", "position_sigma", "gyroscope_bias", "gyroscope_bias_sigma", "scale_sigma"):
        np.testing.assert_allclose(back.estimated(name), run.estimated(name)[keep], rtol=1e-12)
    np.testing.assert_array_equal(back.odometry.position, run.odometry.position)
    assert back.odometry_in_metres[2] == "estimated scale" and back.scale_error is None

    write_truth_csv(tmp_path / "truth.csv", run)
    known, _ = driving.run_of_log(tmp_path / "run.log", truth_csv=tmp_path / "truth.csv")
    assert known.scale_error == pytest.approx(0.01)
    np.testing.assert_array_equal(known.truth.gyroscope_bias, run.truth.gyroscope_bias)
    assert known.position_rmse == pytest.approx(run.position_rmse)


def test_program(run, tmp_path, capsys):
    write_log(tmp_path / "run.log", run)
    out = tmp_path / "out"
    arguments = [str(tmp_path / "run.log"), "--output", str(out), "--video", "x.gif", "--speed", "100"]
    arguments += ["--fps", "10", "--width", "160", "--height", "160"]
    assert animate.main(arguments) == 0
    text = capsys.readouterr().out
    assert "position rmse 2.291 m" in text and "estimate.without_pose = 1" in text and "3 pictures" in text
    assert sorted(path.name for path in out.iterdir()) == ["summary.png", "x.gif"]
    assert animate.main(arguments) == 1
    assert "--overwrite" in capsys.readouterr().err

    def refused(*more) -> str:
        assert animate.main([*map(str, more), "--output", str(out), "--video", "none", "--overwrite"]) == 1
        text = capsys.readouterr().err
        assert text.startswith("loc-animate: ") and text.count("\n") == 1
        return text

    assert "no such file" in refused(tmp_path / "absent.log")
    (tmp_path / "text.csv").write_text("a,b\n1,2\n")
    assert "is not an LCM log" in refused(tmp_path / "text.csv")
    write_log(tmp_path / "ned.log", run, world="NED")
    assert "world of the estimates is 'NED'" in refused(tmp_path / "ned.log")
    write_log(tmp_path / "alone.log", run, with_truth=False)
    assert "0 reference poses" in refused(tmp_path / "alone.log")
    assert "no estimate with position" in refused(tmp_path / "run.log", "--channel", "LOC_OTHER")
    assert "animation.width = 5" in refused(tmp_path / "run.log", "--width", 5)
    write_truth_csv(tmp_path / "truth.csv", run)
    text = (tmp_path / "truth.csv").read_text()
    (tmp_path / "cut.csv").write_text(text[:-20])
    assert "cut.csv:601: " in refused(tmp_path / "run.log", "--truth", tmp_path / "cut.csv")
    (tmp_path / "other.csv").write_text("time_ns,x\n1,2\n")
    assert "no column q_world_body_w" in refused(tmp_path / "run.log", "--truth", tmp_path / "other.csv")


def test_simulator_estimator_and_picture_end_to_end(tmp_path):
    simulate, estimator = built_program("loc-simulate"), built_program("loc-estimator")
    log, out = tmp_path / "run.log", tmp_path / "est.lcm"

    def run_program(*command) -> None:
        done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr

    run_program(simulate, "--scenario", "vio-example", "--seed", 1, "--duration", "12s", "--out", log)
    run_program(
        *(estimator, "--method", "error-state", "--preset", "19", "--start", "reference"),
        *("--input", log, "--output", out),
    )
    drive, _ = driving.run_of_log(out, log, truth_csv=tmp_path / "run.log.truth.csv")
    assert drive.times_s[-1] > 11.9 and len(drive.times_s) > 1190
    assert drive.position_rmse < 4
    assert drive.odometry_in_metres[2] == "true scale" and drive.odometry_rmse < 2
    assert abs(drive.scale_error) < 0.1
    # The errors are what the filter says: nearly all within three deviations.
    inside = np.abs(drive.position_error) < 3 * drive.estimated("position_sigma")
    assert inside.mean() > 0.95

    # The same simulator and filter called from Python give the same drive.
    simulated = libloc.simulate("vio-example", 1, duration_s=12.0)
    imu, vo, truth = simulated.recording.imu, simulated.recording.odometry, simulated.truth
    preset = libloc.FusionPreset.by_name("19")
    fusion = libloc.ErrorStateFilter(preset.options)
    start = truth.q_world_body_wxyz[0], truth.position[0], truth.velocity[0]
    fusion.start(int(imu.times_ns[0]), preset.start_cov, *start)
    result = fusion.run(
        *(imu.times_ns, imu.angular_velocity, imu.specific_force),
        odometry_times_ns=vo.times_ns,
        odometry_position=vo.position,
        odometry_position_cov=preset.odometry_position_cov,
        odometry_wxyz=vo.q_wxyz,
        odometry_orientation_cov=preset.odometry_orientation_cov,
    )
    same = driving.run_of_filter(imu.times_ns, result, truth, vo)
    np.testing.assert_allclose(drive.position, same.position[-len(drive.position) :], atol=1e-9)
    for name in ("position_sigma", "attitude_sigma", "scale", "scale_sigma", "gyroscope_bias"):
        np.testing.assert_allclose(
            drive.estimated(name)[-1], same.estimated(name)[-1], rtol=1e-9, err_msg=name
        )
    assert same.position_rmse == pytest.approx(drive.position_rmse)

    arguments = [str(out), "--reference", str(log), "--output", str(tmp_path), "--video", "none"]
    assert animate.main(arguments) == 0
    assert (tmp_path / "summary.png").stat().st_size > 50_000
