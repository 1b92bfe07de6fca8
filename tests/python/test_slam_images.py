"""SLAM from pictures in Python: step by step, in one call, as loc-slam; on rendered pictures and EuRoC's."""

import json
import shutil
import signal

import loc
import numpy as np
import pytest
from libloc.lcm_log import LogWriter
from libloc.programs import slam
from matplotlib.image import imread
from PIL import Image
from support import data_folder

import libloc

pytestmark = pytest.mark.skipif(not libloc.HAS_VISION, reason="libloc was built without OpenCV")

SECONDS, RATE_HZ = 4.0, 20
LIFT = np.array([0, 0, 2.0])  # of the circle over the room's floor [m]


class Ride:
    """At rest, then along a circle in a room: pictures, IMU and truth."""

    def __init__(self) -> None:
        scenario = libloc.Scenario("circle", duration_s=SECONDS)
        for stream in ("gps", "magnetometer", "odometry"):
            scenario.set(f"streams.{stream}", False)
        simulated = libloc.simulate(scenario, 5)
        self.imu, truth = simulated.recording.imu, simulated.truth
        self.rig = scenario.rig()
        self.camera = libloc.CameraCalibration()
        self.camera.name = "camera"
        self.camera.width_px, self.camera.height_px = 376, 240
        self.camera.intrinsics_px = [229, 229, 188, 120]
        self.camera.T_body_camera = self.rig.cameras[0].T_body_camera
        self.camera.rate_hz = RATE_HZ
        self.rig.cameras = [self.camera]
        self.times_ns = simulated.recording.features.times_ns
        rows = np.searchsorted(truth.times_ns, self.times_ns)
        assert (truth.times_ns[rows] == self.times_ns).all()
        self.body = libloc.Trajectory(
            self.times_ns, truth.q_world_body_wxyz[rows].copy(), truth.position[rows] + LIFT
        )
        room = libloc.box_room(libloc.Random(2), size_m=[30, 30, 8], cell_m=1.0)
        renderer = libloc.SceneRenderer(room, self.camera)
        poses = [
            libloc.Pose3(q, p) * self.camera.T_body_camera
            for q, p in zip(self.body.q_world_body_wxyz, self.body.position, strict=True)
        ]
        self.cameras = libloc.Trajectory(
            self.times_ns,
            np.array([pose.rotation_wxyz for pose in poses]),
            np.array([pose.translation for pose in poses]),
        )
        self.pictures = [renderer.render(pose) for pose in poses]

    def options(self, motion=libloc.SlamMotion.CONSTANT_VELOCITY) -> libloc.SlamOptions:
        options = libloc.SlamOptions(camera=self.camera, motion=motion, imu_noise=self.rig.imu.noise)
        return libloc.slam_options_for_images(options)

    def measurements(self) -> list[libloc.ImageMeasurement]:
        pairs = zip(self.times_ns, self.pictures, strict=True)
        return [libloc.image_measurement(int(time_ns), picture) for time_ns, picture in pairs]


@pytest.fixture(scope="module")
def ride() -> Ride:
    return Ride()


@pytest.fixture(scope="module")
def folder(ride, tmp_path_factory):
    """Pictures that are called by their times, with rig and truth beside the folder."""
    out = tmp_path_factory.mktemp("ride")
    (out / "pictures").mkdir()
    for time_ns, picture in zip(ride.times_ns, ride.pictures, strict=True):
        Image.fromarray(picture).save(out / f"pictures/{time_ns}.png")
    libloc.write_rig(out / "rig.yaml", ride.rig)
    libloc.write_tum(out / "truth.tum", ride.body)
    return out


def camera_error(run: libloc.SlamRun, truth: libloc.Trajectory, mode: str) -> libloc.AbsoluteError:
    estimate = libloc.Trajectory(run.time_ns, run.q_world_camera_wxyz, run.camera_position)
    pairs = libloc.associate(
        estimate, truth, max_difference_ns=10_000_000, interpolate_reference=True, one_to_one=False
    )
    assert len(pairs.estimate_index) == len(run)
    return libloc.absolute_error(pairs.estimate, pairs.reference, mode)


def test_features_of_single_pictures(ride):
    options = libloc.FeatureTrackerOptions(max_tracks=40)
    tracker = libloc.FeatureTracker(ride.camera, options)
    first = tracker.track(ride.pictures[0], 5)
    assert (first.time_ns, len(first.id)) == (5, 40)
    assert (tracker.last.origin == libloc.TrackOrigin.NEW).all()
    # At rest in the same picture, grey or in colour: every feature is where it was.
    colour = np.repeat(ride.pictures[0][..., None], 3, axis=2)
    second = tracker.track(colour, 6)
    same = {int(i): p for i, p in zip(second.id, second.pixel_px, strict=True)}
    moved = [np.linalg.norm(same[int(i)] - p) for i, p in zip(first.id, first.pixel_px, strict=True)]
    assert max(moved) < 0.1
    assert (tracker.last.id == second.id).all()
    assert tracker.counts()["pictures"] == 2
    assert 0 < tracker.times.klt_s < tracker.times.total_s
    tracker.reset()
    assert min(tracker.track(ride.pictures[0], 7).id) > max(second.id)


def test_what_is_wrong_with_a_picture_is_named(ride):
    tracker = libloc.FeatureTracker(ride.camera)
    with pytest.raises(TypeError, match="uint8"):
        tracker.track(np.zeros((240, 376)), 0)
    with pytest.raises(ValueError, match="shape"):
        tracker.track(np.zeros((240, 376, 2), dtype=np.uint8), 0)
    with pytest.raises(ValueError, match=r"100.*376|376.*100"):
        tracker.track(np.zeros((240, 100), dtype=np.uint8), 0)
    with pytest.raises(ValueError, match="klt_window_px"):
        libloc.FeatureTrackerOptions(klt_window_px=4)
    with pytest.raises(TypeError, match="max_trakcs"):
        libloc.FeatureTrackerOptions(max_trakcs=4)
    with pytest.raises(RuntimeError, match="record"):
        libloc.ImageSlam(ride.options()).recorded()


def test_step_by_step_is_the_same_as_in_one_call(ride):
    slam_ = libloc.ImageSlam(ride.options())
    position = []
    for time_ns, picture in zip(ride.times_ns, ride.pictures, strict=True):
        assert slam_.process_image(int(time_ns), picture)
        (frame,) = slam_.frames()
        position.append(frame.camera_position)
        assert len(slam_.tracks) == len(slam_.features.id)
    expected = slam_.prediction
    assert expected.valid
    assert expected.time_ns == ride.times_ns[-1]
    # The filter expected the features of its map where they were found.
    found = {int(i): p for i, p in zip(slam_.features.id, slam_.features.pixel_px, strict=True)}
    away = [
        np.linalg.norm(found[int(i)] - p)
        for i, p, seen in zip(expected.id, expected.pixel_px, expected.visible, strict=True)
        if seen and int(i) in found
    ]
    assert len(away) > 20
    assert np.median(away) < 3
    got = libloc.run_image_slam(ride.measurements(), ride.options())
    assert (got.frames.camera_position == np.array(position)).all()
    assert (got.frames.map.id == slam_.map().id).all()
    fe = got.front_end
    assert (fe["time_ns"] == ride.times_ns).all()
    of = fe["searched"] + fe["klt"] + fe["cut_anew"] + fe["refound"] + fe["new"]
    assert (of == fe["tracks"]).all()
    assert fe["lost"].sum() == got.frames.totals["tracks.lost"]
    assert (fe["front_end_s"] <= fe["picture_s"]).all()
    assert camera_error(got.frames, ride.cameras, "sim3").translation.rmse < 0.12


def test_with_imu(ride):
    options = ride.options(libloc.SlamMotion.INERTIAL)
    got = libloc.run_image_slam(ride.measurements(), options, imu=ride.imu, rig=ride.rig)
    assert len(got.frames) == len(ride.pictures)
    assert camera_error(got.frames, ride.cameras, "se3").translation.rmse < 0.02
    # The filter says where to look, so that most need not be tracked.
    assert got.frames.totals["tracks.searched"] > 0.1 * got.front_end["tracks"].sum()
    stopped = libloc.run_image_slam(
        ride.measurements(), options, imu=ride.imu, progress=lambda done: done < 30
    )
    assert stopped.frames.stopped
    assert len(stopped.front_end["time_ns"]) == 30


def test_pictures_of_a_folder(ride, folder):
    got = list(libloc.pictures(folder / "pictures", name_unit="ns"))
    assert [time_ns for time_ns, _ in got] == ride.times_ns.tolist()
    assert all((a == b).all() for (_, a), b in zip(got, ride.pictures, strict=True))
    with pytest.raises(libloc.DataError, match="pictures"):
        libloc.open_pictures(folder / "pictures")
    with pytest.raises(libloc.DataError, match="no such"):
        libloc.open_pictures(folder / "absent")
    assert libloc.picture_format(folder / "truth.tum") is None


def call(*arguments) -> int:
    return slam.main([str(a) for a in arguments])


def test_the_program_on_a_folder(ride, folder, tmp_path, capsys):
    arguments = [folder / "pictures", "--name-unit", "ns", "--config", folder / "rig.yaml"]
    out = tmp_path / "out"
    assert call(*arguments, "--reference", folder / "truth.tum", "--output", out) == 0
    text = capsys.readouterr().out
    assert f"frames         {len(ride.pictures)} used of {len(ride.pictures)}" in text
    summary = json.loads((out / "summary.json").read_text())
    assert summary["truth"]["pose"] == "camera"
    got = libloc.run_image_slam(ride.measurements(), ride.options())
    assert summary["truth"]["rmse_m"] == pytest.approx(
        camera_error(got.frames, ride.cameras, "sim3").translation.rmse, rel=1e-6
    )
    assert summary["pictures"]["tracks"] == got.front_end["tracks"].sum()
    profile = summary["profile_ms"]
    assert 0 < profile["klt"]["median"] < profile["front_end"]["median"] < profile["whole"]["median"]
    header, *lines = [line.split(",") for line in (out / "frames.csv").read_text().splitlines()]
    rows = [dict(zip(header, line, strict=True)) for line in lines]
    assert [int(row["tracks"]) for row in rows] == got.front_end["tracks"].tolist()
    assert [int(row["tracks_new"]) for row in rows] == got.front_end["new"].tolist()
    assert all(float(row["whole_s"]) >= float(row["front_end_s"]) for row in rows)
    picture = imread(out / "summary.png")
    coloured = np.ptp(picture[..., :3], axis=2) > 0.2
    assert 1000 < coloured.sum() < 0.5 * coloured.size
    # The video holds all pictures, and can be read again, as a source, too.
    assert f"written: {out / 'features.mp4'}" in text
    frames = list(libloc.pictures(out / "features.mp4"))
    assert [frame.shape for _, frame in frames] == [ride.pictures[0].shape] * len(ride.pictures)
    again = tmp_path / "again"
    assert call(out / "features.mp4", "--config", folder / "rig.yaml", "--output", again, "--no-plots") == 0
    assert sorted(p.suffix for p in again.iterdir()) == [
        ".csv", ".json", ".ply", ".slam", ".tum", ".txt", ".yaml",
    ]  # fmt: skip


def test_the_program_on_a_log(ride, folder, tmp_path, capsys):
    """Pictures and IMU in one log, pictures arriving 40 ms late; one of them is a damaged JPEG."""
    path = tmp_path / "ride.lcm"
    events = [(int(t), int(t), "imu", i) for i, t in enumerate(ride.imu.times_ns)]
    events += [(int(t) + 40_000_000, int(t), "picture", i) for i, t in enumerate(ride.times_ns)]
    with LogWriter(path) as log:
        for arrived_ns, time_ns, kind, i in sorted(events):
            if kind == "imu":
                m = loc.imu_t()
                m.angular_velocity = ride.imu.angular_velocity[i].tolist()
                m.specific_force = ride.imu.specific_force[i].tolist()
            else:
                m = loc.image_t()
                m.width, m.height, m.row_stride = 376, 240, 376
                m.pixelformat = m.PIXEL_FORMAT_GRAY
                m.data = ride.pictures[i].tobytes()
                if i == 50:
                    m.pixelformat, m.row_stride = m.PIXEL_FORMAT_MJPEG, 0
                    m.data = b"\xff\xd8\xff\xe0" + bytes(200) + b"\xff\xd9"
                m.size = len(m.data)
            m.time_ns, m.host_time_ns, m.sequence = time_ns, arrived_ns, i
            log.write("LOC_IMU" if kind == "imu" else "LOC_IMAGE", m, arrived_ns // 1000)
    out = tmp_path / "out"
    arguments = [path, "--config", folder / "rig.yaml", "--method", "inertial-slam", "--no-plots"]
    assert call(*arguments, "--reference", folder / "truth.tum", "--output", out) == 0
    text = capsys.readouterr().out
    assert "image.skipped.damaged 1" in text
    summary = json.loads((out / "summary.json").read_text())
    assert summary["metric"]
    assert summary["frames"]["used"] == len(ride.pictures) - 1
    assert summary["truth"]["pose"] == "body"
    assert summary["truth"]["rmse_m"] < 0.02


def test_the_program_on_numbered_pictures_with_an_imu(ride, folder, tmp_path, capsys):
    (tmp_path / "pictures").mkdir()
    for i, picture in enumerate(ride.pictures):
        Image.fromarray(picture).save(tmp_path / f"pictures/{i}.png")
    lines = ["time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2"]
    for time_ns, gyro, force in zip(
        ride.imu.times_ns, ride.imu.angular_velocity, ride.imu.specific_force, strict=True
    ):
        lines.append(f"{time_ns}," + ",".join(repr(float(x)) for x in (*gyro, *force)))
    (tmp_path / "imu.csv").write_text("\n".join(lines) + "\n")
    start_s = int(ride.times_ns[0]) // 10**9
    arguments = [tmp_path / "pictures", "--rate-hz", RATE_HZ, "--start-time", start_s]
    arguments += ["--config", folder / "rig.yaml", "--imu", tmp_path / "imu.csv", "--method", "inertial-slam"]
    out = tmp_path / "out"
    assert call(*arguments, "--reference", folder / "truth.tum", "--output", out) == 0
    summary = json.loads((out / "summary.json").read_text())
    assert summary["frames"]["used"] == len(ride.pictures)
    assert summary["truth"]["rmse_m"] < 0.01
    assert {"summary.png", "inertial.png", "features.mp4"} <= {p.name for p in out.iterdir()}
    # Another clock: no picture has IMU samples around it.
    for other_s in (start_s + 1000, start_s - 1000):
        arguments[4] = other_s
        assert call(*arguments) == 1
        assert "no time in common" in capsys.readouterr().err


def test_what_is_wrong_is_named(folder, tmp_path, capsys):
    rig = ["--config", folder / "rig.yaml"]
    pictures = [folder / "pictures", "--name-unit", "ns"]
    (tmp_path / "empty").mkdir()
    large = libloc.read_rig(folder / "rig.yaml")
    camera = large.cameras[0]
    camera.width_px += 10
    large.cameras = [camera]
    libloc.write_rig(tmp_path / "large.yaml", large)
    for arguments, wanted in (
        ([*pictures], "--config"),
        ([folder / "pictures", *rig], "pictures"),
        ([tmp_path / "empty", *rig], "empty"),
        ([*pictures, *rig, "--method", "inertial-slam"], "no IMU samples"),
        ([*pictures, *rig, "--imu", folder / "truth.tum"], "truth.tum"),
        ([*pictures, *rig, "--map-in", folder / "rig.yaml"], "rig.yaml"),
        ([*pictures, *rig, "--front-end", "max_tracks=-1"], "max_tracks"),
        ([*pictures, *rig, "--front-end", "tracks=1"], "FeatureTrackerOptions"),
        ([*pictures, "--config", tmp_path / "large.yaml"], "386"),
    ):
        assert call(*arguments) == 1, arguments
        assert wanted in capsys.readouterr().err, arguments


def test_ctrl_c_leaves_what_there_was(ride, folder, tmp_path, capsys, monkeypatch):
    seen = 0
    keep = slam.Watcher.__call__

    def press(self, slam_, picture):
        nonlocal seen
        keep(self, slam_, picture)
        seen += picture is not None
        if picture is not None and seen == 40:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(slam.Watcher, "__call__", press)
    arguments = [folder / "pictures", "--name-unit", "ns", "--config", folder / "rig.yaml", "--no-plots"]
    assert call(*arguments, "--output", tmp_path) == 130
    assert f"40 of {len(ride.pictures)} frames" in capsys.readouterr().err
    assert len((tmp_path / "frames.csv").read_text().splitlines()) == 41
    assert len(libloc.read_tum(tmp_path / "trajectory.tum")[0]) == 40


@pytest.fixture(scope="module")
def euroc(tmp_path_factory):
    """The program on all 600 pictures of EuRoC's MH_01 that are there; the camera by itself."""
    folder = data_folder("euroc-mh01-images")
    out = tmp_path_factory.mktemp("euroc")
    assert call(folder, "--reference", folder / "groundtruth.tum", "--output", out, "--no-plots") == 0
    options = libloc.slam_options_for_images(libloc.SlamOptions(camera=slam_camera(folder)))
    return folder, out, options


def slam_camera(folder):
    return libloc.read_any_rig(folder / "mav0/cam0/sensor.yaml").cameras[0]


def true_cameras(folder):
    body = libloc.read_tum(folder / "groundtruth.tum")[0]
    T_body_camera = slam_camera(folder).T_body_camera
    poses = [
        libloc.Pose3(q / np.linalg.norm(q), p) * T_body_camera
        for q, p in zip(body.q_world_body_wxyz, body.position, strict=True)
    ]
    q = np.array([pose.rotation_wxyz for pose in poses])
    return libloc.Trajectory(body.times_ns, q, np.array([pose.translation for pose in poses]))


def test_euroc(euroc):
    folder, out, _ = euroc
    summary = json.loads((out / "summary.json").read_text())
    assert summary["frames"] == {"in_input": 600, "used": 600}
    assert summary["truth"]["pairs"] == 600
    assert summary["truth"]["alignment"] == "sim3"
    assert summary["truth"]["rmse_m"] <= 0.025
    cells = [line.split(",") for line in (out / "frames.csv").read_text().splitlines()]
    column = {
        name: np.array([float(row[k] or "nan") for row in cells[1:]]) for k, name in enumerate(cells[0])
    }
    position = np.stack([column[f"camera_p{axis}_m"] for axis in "xyz"], axis=1)
    q = np.stack([column[f"camera_q{part}"] for part in "wxyz"], axis=1)
    times_ns = np.array([int(row[cells[0].index("time_ns")]) for row in cells[1:]])

    def error_of(rows):
        estimate = libloc.Trajectory(times_ns[rows], q[rows].copy(), position[rows].copy())
        pairs = libloc.associate(
            estimate, true_cameras(folder), max_difference_ns=10_000_000, interpolate_reference=True,
            one_to_one=False,
        )  # fmt: skip
        return libloc.absolute_error(pairs.estimate, pairs.reference, "sim3")

    # The first half moves, the second stands on the ground.
    moving = error_of(slice(0, 300))
    assert moving.translation.rmse <= 0.025
    still = moving.alignment.scale * position[320:]
    assert np.linalg.norm(still - still.mean(axis=0), axis=1).max() < 0.005


def test_euroc_needs_the_calibration(euroc, tmp_path, capsys):
    folder, _, _ = euroc
    shutil.copytree(folder / "mav0/cam0", tmp_path / "mav0/cam0", ignore=lambda *_: ["data", "sensor.yaml"])
    assert call(tmp_path) == 1
    assert "cam0/sensor.yaml" in capsys.readouterr().err
    assert call(folder, "--camera", 1) == 1
    assert "asked for is 1" in capsys.readouterr().err
