"""loc-slam as a user runs it, on simulated recordings."""

import io
import json
import re
import signal
import sys
from contextlib import contextmanager
from pathlib import Path

import loc
import numpy as np
import pytest
from libloc.lcm_log import LogWriter
from libloc.programs import slam
from libloc.programs.evaluate_input import read_estimate
from matplotlib.image import imread

import libloc

START_NS = 1_700_000_000_000_000_000
FRAMES = 160


class Case:
    """A walk in three forms, with its rig and its truth."""

    def __init__(self, folder: Path) -> None:
        scenario = libloc.Scenario("circle", duration_s=8, parameters={"camera.max_features": 60})
        for stream in ("gps", "magnetometer", "odometry"):
            scenario.set(f"streams.{stream}", False)
        self.recording = libloc.simulate(scenario, 5).recording
        self.rig = folder / "rig.yaml"
        libloc.write_rig(self.rig, scenario.rig())
        features, truth = self.recording.features, self.recording.reference
        frame = np.repeat(np.arange(len(features.times_ns)), np.diff(features.first))
        self.tracks = folder / "walk.tracks"
        libloc.write_tracks(self.tracks, frame, features.id, features.pixel_px)
        self.truth = folder / "truth.tum"
        libloc.write_tum(
            self.truth, libloc.Trajectory(truth.times_ns, truth.q_world_body_wxyz, truth.position)
        )
        self.log = folder / "walk.lcm"
        self.write_log(self.log)

    def write_log(self, path: Path, begin_s: float = 0, end_s: float = np.inf) -> None:
        """What was measured in this part of the walk."""
        r = self.recording
        begin_ns, end_ns = START_NS + begin_s * 1e9, START_NS + end_s * 1e9
        with LogWriter(path) as log:

            def write(channel, m, i, time_ns):
                m.time_ns, m.host_time_ns, m.sequence = int(time_ns), int(time_ns), i
                if begin_ns <= time_ns < end_ns:
                    log.write(channel, m, int(time_ns) // 1000)

            for i, time_ns in enumerate(r.features.times_ns):
                m = loc.tracks_t()
                rows = slice(r.features.first[i], r.features.first[i + 1])
                m.sigma_px = 0.5
                m.feature_id = r.features.id[rows].tolist()
                m.u_px, m.v_px = r.features.pixel_px[rows].T.tolist()
                m.size = len(m.feature_id)
                write("LOC_TRACKS", m, i, time_ns)
                truth = loc.reference_t()
                k = int(np.searchsorted(r.reference.times_ns, time_ns))
                truth.score = True
                truth.q_world_body_wxyz = r.reference.q_world_body_wxyz[k].tolist()
                truth.position = r.reference.position[k].tolist()
                truth.velocity = r.reference.velocity[k].tolist()
                write("LOC_REFERENCE", truth, i, time_ns)
            for i, time_ns in enumerate(r.imu.times_ns):
                sample = loc.imu_t()
                sample.angular_velocity = r.imu.angular_velocity[i].tolist()
                sample.specific_force = r.imu.specific_force[i].tolist()
                write("LOC_IMU", sample, i, time_ns)


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Case:
    return Case(tmp_path_factory.mktemp("walk"))


def call(*arguments) -> int:
    return slam.main([str(a) for a in arguments])


def table(path: Path) -> dict[str, np.ndarray]:
    names, *rows = [line.split(",") for line in path.read_text().splitlines()]
    return {name: np.array([float(row[k] or "nan") for row in rows]) for k, name in enumerate(names)}


def test_all_files_from_a_tracks_file(case, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = [case.tracks, "--config", case.rig, "--sigma-px", 0.5, "--start-time", START_NS // 10**9]
    assert call(*arguments, "--reference", case.truth, "--output", out, "--no-plots") == 0
    text = capsys.readouterr().out
    assert f"frames         {FRAMES} used of {FRAMES}" in text
    assert "units of its own: one camera cannot tell metres" in text
    names = [
        "summary.json",
        "summary.txt",
        "trajectory.tum",
        "frames.csv",
        "map.ply",
        "slam.yaml",
        "state.slam",
    ]
    assert sorted(p.name for p in out.iterdir()) == sorted(names)
    for name in names:
        assert f"written: {out / name}" in text
    assert (out / "summary.txt").read_text() in text

    # The same run from Python: every file holds it.
    options = libloc.SlamOptions(
        camera=libloc.read_rig(case.rig).cameras[0], sigma_px=0.5, override_sigma=True
    )
    # The rig's camera looks along body's x, and so does the program's world.
    options.q_world_body_wxyz = [1, 0, 0, 0]
    features = case.recording.features
    run = libloc.run_slam(features, options)
    trajectory, _ = libloc.read_tum(out / "trajectory.tum")
    assert np.array_equal(trajectory.times_ns, run.time_ns)
    assert np.allclose(trajectory.position, run.position, rtol=0, atol=1e-9)
    assert "body to world" in (out / "trajectory.tum").read_text().splitlines()[0]
    columns = table(out / "frames.csv")
    assert np.array_equal(columns["time_ns"], run.time_ns.astype(float))
    for name, values in (
        ("pz_m", run.position[:, 2]),
        ("camera_px_m", run.camera_position[:, 0]),
        ("vy_m_s", run.velocity[:, 1]),
        ("sigma_px_m", np.sqrt(run.covariance[:, 3, 3])),
        ("sigma_thetaz_rad", np.sqrt(run.covariance[:, 2, 2])),
        ("nis", run.nis),
        ("reprojection_after_px", run.reprojection_after_px),
    ):
        assert np.allclose(columns[name], values, rtol=0, atol=1e-9, equal_nan=True), name
    assert np.isnan(columns["reprojection_before_px"][0])
    assert np.isnan(columns["bax_m_s2"]).all()
    for name, values in run.counts.items():
        assert np.array_equal(columns[name], values), name
    assert len(read_estimate(out / "frames.csv", "").times_ns) == FRAMES  # loc-evaluate takes it

    header, body = (out / "map.ply").read_text().split("end_header\n")
    points = np.array([[float(x) for x in line.split()] for line in body.splitlines()])
    assert f"element vertex {len(points)}" in header
    known = np.isfinite(run.map.position).all(axis=1)
    assert len(points) == known.sum() > 40
    assert np.allclose(points[:, :3], run.map.position[known], rtol=1e-6)
    assert np.array_equal(points[:, 3], run.map.id[known])
    largest = np.sqrt(np.linalg.norm(run.map.position_cov[known], ord=2, axis=(1, 2)))
    assert np.allclose(points[:, 4], largest, rtol=1e-5)

    summary = json.loads((out / "summary.json").read_text())
    assert summary["method"] == "mono-slam"
    assert summary["finished"]
    assert summary["frames"] == {"in_input": FRAMES, "used": FRAMES}
    assert summary["estimator"]["slam.measured"] == run.counts["measured"].sum()
    assert summary["reprojection_px"]["after"] == pytest.approx(
        np.sqrt(np.nanmean(run.reprojection_after_px**2)), rel=1e-6
    )
    assert libloc.read_slam_options(out / "slam.yaml").sigma_px == 0.5
    # The error is that of SciPy's alignment of the centred paths, with the least-squares scale.
    from scipy.spatial.transform import Rotation

    truth = case.recording.reference
    rows = np.searchsorted(truth.times_ns, run.time_ns)
    # A camera alone is compared by its own centre.
    turn = Rotation.from_quat(np.roll(truth.q_world_body_wxyz[rows], -1, axis=1))
    cameras = truth.position[rows] + turn.apply(options.camera.T_body_camera.translation)
    a, b = (x - x.mean(axis=0) for x in (run.camera_position, cameras))
    turned = Rotation.align_vectors(b, a)[0].apply(a)
    scale = np.sum(turned * b) / np.sum(a * a)
    expected = np.sqrt(np.mean(np.sum((scale * turned - b) ** 2, axis=1)))
    assert summary["truth"]["alignment"] == "sim3"
    assert summary["truth"]["rmse_m"] == pytest.approx(expected, rel=1e-5)
    assert summary["truth"]["scale"] == pytest.approx(scale, rel=1e-5)
    length = np.linalg.norm(np.diff(cameras, axis=0), axis=1).sum()
    assert summary["truth"]["path_length_m"] == pytest.approx(length)
    assert expected < 0.02 * length


def test_a_log_brings_its_own_truth(case, tmp_path, capsys):
    out = tmp_path / "out"
    assert call(case.log, "--config", case.rig, "--output", out, "--pose", "camera", "--no-plots") == 0
    summary = json.loads((out / "summary.json").read_text())
    assert summary["input"]["format"] == "lcm"
    assert summary["truth"]["file"] == str(case.log)
    assert summary["truth"]["pairs"] == FRAMES
    assert not list(out.glob("*.png"))
    trajectory, _ = libloc.read_tum(out / "trajectory.tum")
    columns = table(out / "frames.csv")
    camera = np.stack([columns[f"camera_p{axis}_m"] for axis in "xyz"], axis=1)
    assert np.allclose(trajectory.position, camera, rtol=0, atol=1e-9)
    assert not np.allclose(camera, np.stack([columns[f"p{axis}_m"] for axis in "xyz"], axis=1), atol=0.01)
    assert "camera to world" in (out / "trajectory.tum").read_text().splitlines()[0]
    capsys.readouterr()
    # Settings by name; the rigid alignment cannot take up the unit.
    settings = [
        "--set",
        "map.max_features=40",
        "--set",
        "consistency=plain",
        "--set",
        "association.ransac=false",
    ]
    assert call(case.log, "--config", case.rig, "--align", "se3", *settings) == 0
    assert "map            40 points" in capsys.readouterr().out


def test_what_the_pictures_show(case):
    """The aligned path and its deviations, which figures draw, are those of the error."""
    options = slam.make_parser().parse_args([str(case.log), "--config", str(case.rig)])
    truth = slam.run(options).truth
    distance = np.linalg.norm(truth.estimate - truth.reference, axis=1)
    assert np.allclose(distance, truth.absolute.translation_m, rtol=0, atol=1e-9)
    run = slam.run(options).run
    stated = np.trace(run.covariance[truth.rows, 3:6, 3:6], axis1=1, axis2=2)
    scale = truth.absolute.alignment.scale
    assert scale > 1.5
    assert np.allclose(np.sum(truth.sigma**2, axis=1), scale**2 * stated, rtol=1e-9, atol=1e-12)


def test_settings_of_a_file_and_a_map_to_go_on_from(case, tmp_path, capsys):
    settings = tmp_path / "slam.yaml"
    settings.write_text("format: libloc-slam-1\nmotion: inertial\nmap:\n  max_features: 64\n")
    runs = []
    base = ["--config", case.rig, "--slam-config", settings, "--no-plots"]
    for name, begin_s, end_s in (("first", 0, 6), ("second", 6, 9)):
        log, out = tmp_path / f"{name}.lcm", tmp_path / name
        case.write_log(log, begin_s, end_s)
        go_on = ["--map-in", tmp_path / "first/state.slam"] if runs else []
        assert call(log, *base, *go_on, "--output", out) == 0
        summary = json.loads((out / "summary.json").read_text())
        assert summary["method"] == "inertial-slam"
        assert summary["map"]["points"] <= 64
        assert libloc.read_slam_options(out / "slam.yaml").map.max_features == 64
        runs.append(table(out / "frames.csv"))
    saved = libloc.load_slam(tmp_path / "first/state.slam")
    assert libloc.format_seconds(saved.snapshot.time_ns)[:12] == "1700000005.9"

    # Both halves are in one world: what takes the first to the truth takes the second there, too.
    truth = case.recording.reference

    def places(run):
        rows = np.searchsorted(truth.times_ns, START_NS + np.rint((run["time_ns"] - START_NS) / 1e6) * 1e6)
        return np.stack([run[f"p{axis}_m"] for axis in "xyz"], axis=1), truth.position[rows]

    to_truth = libloc.align_points(*places(runs[0]), "yaw").T_reference_estimate
    place, true_place = places(runs[1])
    assert len(place) > 35
    assert np.linalg.norm(to_truth.transform(place) - true_place, axis=1).max() < 0.5
    capsys.readouterr()
    for arguments, message in (
        (["--method", "mono-slam"], "slam.yaml: motion is another one than that of --method mono-slam"),
        (["--map-in", case.rig], "rig.yaml"),
        (["--map-in", tmp_path / "first/state.slam", "--set", "motion=constant-velocity"], "state.slam: "),
    ):
        assert call(case.log, *base, *arguments) == 1
        assert message in capsys.readouterr().err
    settings.write_text("format: libloc-slam-1\ncamera_index: 1\n")
    assert call(case.log, "--config", case.rig, "--slam-config", settings) == 1
    assert "rig.yaml: has 1 cameras, the one asked for is 1" in capsys.readouterr().err
    settings.write_text("format: libloc-slam-1\nmap:\n  most_features: 44\n")
    assert call(case.log, "--config", case.rig, "--slam-config", settings) == 1
    error = capsys.readouterr().err
    assert "slam.yaml:3" in error
    assert "most_features" in error


def test_tracks_beside_a_recording_without_features(case, tmp_path, capsys):
    imu, out = case.recording.imu, tmp_path / "out"
    path = tmp_path / "imu.csv"
    rows = ["time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2"]
    for time_ns, w, f in zip(imu.times_ns, imu.angular_velocity, imu.specific_force, strict=True):
        rows.append(f"{time_ns}," + ",".join(repr(x) for x in (*w.tolist(), *f.tolist())))
    path.write_text("\n".join(rows) + "\n")
    base = [path, "--config", case.rig, "--method", "inertial-slam", "--sigma-px", 0.5, "--no-plots"]
    tracks = ["--tracks", case.tracks, "--start-time", START_NS // 10**9]
    assert call(*base, *tracks, "--reference", case.truth, "--output", out) == 0
    beside = table(out / "frames.csv")
    assert call(case.log, *base[1:], "--output", out) == 0
    log = table(out / "frames.csv")
    assert np.allclose(beside["px_m"], log["px_m"], rtol=0, atol=1e-6)
    capsys.readouterr()
    for arguments, message in (
        (base, "imu.csv: no features of camera 0 in it; it holds none at all (--tracks takes"),
        ([*base, "--tracks", case.tracks], "walk.tracks: a tracks file has no times: give --start-time"),
        ([case.tracks, *base[1:], *tracks], "walk.tracks: is a tracks file, --tracks is for recordings"),
    ):
        assert call(*arguments) == 1
        assert message in capsys.readouterr().err


def test_a_file_that_brings_its_camera(case, tmp_path, capsys):
    """An EqVIO file needs no rig: the same tracks as points without distortion."""
    features, imu = case.recording.features, case.recording.imu
    camera = libloc.read_rig(case.rig).cameras[0]
    rays = libloc.Camera(camera).unproject(features.pixel_px)
    uv = rays[:, :2] / rays[:, 2:]
    pose = camera.T_body_camera
    meta = {"format_version": 1, "measurement_space": "normalized", "camera_fx": 458, "camera_fy": 457,
            "camera_cx": 367, "camera_cy": 248}  # fmt: skip
    meta |= {f"T_ci_t{axis}": repr(float(v)) for axis, v in zip("xyz", pose.translation, strict=True)}
    meta |= {f"T_ci_q{axis}": repr(float(v)) for axis, v in zip("wxyz", pose.rotation_wxyz, strict=True)}
    rows = ["row_type,t_abs,frame_idx,landmark_id,gx,gy,gz,ax,ay,az,u_norm,v_norm,key,value"]
    rows += [f"meta,,,,,,,,,,,,{key},{value}" for key, value in meta.items()]
    timed = [(t, 0, k) for k, t in enumerate(imu.times_ns)] + [
        (t, 1, k) for k, t in enumerate(features.times_ns)
    ]
    for time_ns, kind, k in sorted(timed):
        t = libloc.format_seconds(time_ns)
        if kind == 0:
            values = [*imu.angular_velocity[k].tolist(), *imu.specific_force[k].tolist()]
            rows.append(f"imu,{t},,,{','.join(map(repr, values))},,,,")
            continue
        for m in range(features.first[k], features.first[k + 1]):
            u, v = uv[m].tolist()
            rows.append(f"vision_feature,{t},{k},{features.id[m]},,,,,,,{u!r},{v!r},,")
    path = tmp_path / "eqvio.csv"
    path.write_text("\n".join(rows) + "\n")
    assert libloc.file_format(path) == "eqvio"
    assert len(libloc.read_recording(path).imu.times_ns) == len(imu.times_ns)
    out = tmp_path / "out"
    truth = ["--reference", case.truth, "--output", out, "--no-plots", "--sigma-px", 0.5]
    assert call(path, "--method", "inertial-slam", *truth) == 0
    assert "eqvio.csv: no calibration of the IMU in it, its noise is a guess" in capsys.readouterr().err
    summary = json.loads((out / "summary.json").read_text())
    assert summary["truth"]["rmse_m"] < 0.01 * summary["truth"]["path_length_m"]
    assert call(path, "--config", case.rig, "--method", "inertial-slam", *truth) == 0
    assert "guess" not in capsys.readouterr().err
    with_lens = json.loads((out / "summary.json").read_text())
    assert with_lens["truth"]["rmse_m"] < 0.01 * with_lens["truth"]["path_length_m"]
    assert call(path, "--camera", 1) == 1
    assert "no features of camera 1" in capsys.readouterr().err


def test_with_an_imu(case, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = [case.log, "--config", case.rig, "--method", "inertial-slam"]
    assert call(*arguments, "--output", out, "--no-plots") == 0
    assert "units of its own" not in capsys.readouterr().out
    summary = json.loads((out / "summary.json").read_text())
    assert summary["metric"]
    assert summary["truth"]["alignment"] == "se3"
    assert summary["truth"]["rmse_m"] < 0.005 * summary["truth"]["path_length_m"]
    assert summary["path_length"] == pytest.approx(summary["truth"]["path_length_m"], rel=0.01)
    columns = table(out / "frames.csv")
    assert np.isfinite(columns["bax_m_s2"]).all()
    assert (columns["sigma_baz_m_s2"][-1:] > 0).all()
    capsys.readouterr()
    camera_only = libloc.read_rig(case.rig)
    camera_only.imu = None
    libloc.write_rig(tmp_path / "camera.yaml", camera_only)
    assert call(*arguments, "--config", tmp_path / "camera.yaml") == 0
    assert "camera.yaml: no calibration of the IMU in it, its noise is a guess" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(("method", "own"), [("mono-slam", []), ("inertial-slam", ["inertial.png"])])
def test_pictures(case, tmp_path, capsys, method, own):
    """Drawn without a warning, and something is in them."""
    assert call(case.log, "--config", case.rig, "--method", method, "--output", tmp_path) == 0
    names = [
        "trajectory.png",
        "trajectory_3d.png",
        "reprojection.png",
        "features.png",
        "nis.png",
        "error.png",
        *own,
    ]
    assert sorted(p.name for p in tmp_path.glob("*.png")) == sorted(names)
    text = capsys.readouterr().out
    for name in names:
        assert f"written: {tmp_path / name}" in text
        picture = imread(tmp_path / name)
        assert min(picture.shape[:2]) > 400
        coloured = np.ptp(picture[..., :3], axis=2) > 0.2
        assert 100 < coloured.sum() < 0.5 * coloured.size


def test_what_was_left_out_is_said(case, tmp_path, capsys):
    """A pause of a second and a half, and a line that was cut."""
    lines = [x for x in case.tracks.read_text().splitlines(keepends=True) if not x.startswith("#")]
    kept = [line for line in lines if not 60 <= int(line.split()[0]) < 90]
    path = tmp_path / "gap.tracks"
    path.write_text("".join(kept)[:-2])
    assert call(path, "--config", case.rig, "--output", tmp_path / "out", "--no-plots") == 0
    text = capsys.readouterr().out
    assert f"{FRAMES - 30} used of {FRAMES - 30}" in text
    assert "tracks.skipped.no_line_end 1" in text
    assert "gaps 1" in text
    line = next(x for x in text.splitlines() if x.startswith("status"))
    assert re.search(r"\bgap 1,", line)
    assert f"scale_unknown {FRAMES - 30}" in line
    status = table(tmp_path / "out/frames.csv")["status"].astype(int)
    assert list(np.flatnonzero(status & libloc.EstimateStatus.GAP)) == [60]


def test_what_is_wrong_is_named(case, tmp_path, capsys):
    rig = ["--config", case.rig]
    without_camera = tmp_path / "imu.yaml"
    other = libloc.read_rig(case.rig)
    other.cameras = []
    libloc.write_rig(without_camera, other)
    slow = tmp_path / "slow.yaml"
    other = libloc.read_rig(case.rig)
    camera = other.cameras[0]
    camera.rate_hz = 0
    other.cameras = [camera]
    libloc.write_rig(slow, other)
    broken = tmp_path / "broken.tracks"
    broken.write_text("0 1 0 10\n0 1 1 nan\n")
    imu_only = tmp_path / "imu.csv"
    imu_only.write_text("time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2\n0,0,0,0,0,0,9.8\n")
    for arguments, message in (
        ([tmp_path / "none", *rig], "none: no such file or folder"),
        ([case.tracks, "--config", tmp_path / "no.yaml"], "no.yaml"),
        ([case.tracks, "--config", without_camera], "imu.yaml: has 0 cameras, the one asked for is 0"),
        ([case.log], "walk.lcm: does not tell the camera's calibration: give --config"),
        ([case.tracks, *rig, "--camera", 1], "rig.yaml: has 1 cameras, the one asked for is 1"),
        ([case.tracks, "--config", slow], "walk.tracks: a tracks file has no times: give --rate-hz"),
        ([broken, *rig], "broken.tracks:2"),
        ([case.truth, *rig], "holds no measurements"),
        ([imu_only, *rig], "imu.csv: no features of camera 0 in it; it holds none at all"),
        ([case.tracks, *rig, "--method", "inertial-slam"], "walk.tracks: no IMU samples in it"),
        ([case.log, *rig, "--rate-hz", 20], "walk.lcm: is a recording with times of its own, --rate-hz"),
        ([case.log, *rig, "--set", "map.max_feature=3"], "--set map.max_feature=3: must be NAME=VALUE"),
        ([case.log, *rig, "--set", "map.max_features=many"], "--set map.max_features=many: invalid literal"),
        ([case.log, *rig, "--set", "map.max_features=1"], "map.max_features = 1: must be at least 4"),
        ([case.log, *rig, "--set", "consistency=best"], "must be one of plain, first-estimate, invariant"),
        # Times that have nothing in common, though a truth was asked for.
        ([case.tracks, *rig, "--reference", case.truth], "truth.tum: no pose of the estimate"),
        ([case.log, *rig, "--reference", imu_only], "imu.csv: no reference poses in it"),
    ):
        assert call(*arguments) == 1, message
        error = capsys.readouterr().err
        assert message in error, (message, error)
        assert error.startswith("loc-slam: ")
    for arguments, message in (
        ([case.log, *rig, "--output", case.rig], "is not a folder"),
        ([case.log, *rig, "--sigma-px", 0], "0: must be a positive number"),
        ([case.log, *rig, "--camera", -1], "-1: must not be negative"),
        ([case.log, *rig, "--start-time", "noon"], "noon: must be seconds"),
    ):
        with pytest.raises(SystemExit) as ended:
            call(*arguments)
        assert ended.value.code == 2
        assert message in capsys.readouterr().err


def test_interrupted_it_writes_what_there_is(case, tmp_path, capsys, monkeypatch):
    @contextmanager
    def progress():
        # As if Ctrl-C were pressed while the filter is at work.
        yield lambda done, total: signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(slam, "_progress", progress)
    before = signal.getsignal(signal.SIGINT)
    out = tmp_path / "out"
    assert call(case.log, "--config", case.rig, "--output", out, "--no-plots") == 130
    assert signal.getsignal(signal.SIGINT) == before
    captured = capsys.readouterr()
    summary = json.loads((out / "summary.json").read_text())
    used = summary["frames"]["used"]
    assert 0 < used < FRAMES
    assert not summary["finished"]
    assert f"loc-slam: interrupted after {used} of {FRAMES} frames" in captured.err
    assert f"{used} used of {FRAMES}: interrupted" in captured.out
    assert len(table(out / "frames.csv")["time_ns"]) == used
    assert libloc.read_tum(out / "trajectory.tum")[0].times_ns.size == used


def test_progress_without_rich(case, capsys, monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setitem(sys.modules, "rich.console", None)
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    assert call(case.log, "--config", case.rig) == 0
    assert f"\rloc-slam: {FRAMES} of {FRAMES} frames, 0 s left" in terminal.getvalue()
    assert terminal.getvalue().endswith("\n")
