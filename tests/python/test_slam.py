"""SLAM from Python: a step against an independent one in NumPy, and step by step against whole recordings."""

import copy
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support import CHECKOUT, to_scipy, to_wxyz

import libloc

DT_NS = 50_000_000
THETA, POSITION, VELOCITY, TURN = (slice(k, k + 3) for k in (0, 3, 6, 9))
LEVER = np.array([0.1, -0.05, 0.02])
# Of the camera in body.
TILT = Rotation.from_rotvec([0.1, -0.2, 0.05])
K = (300.0, 310.0, 320.0, 240.0)
DISTORTION = (-0.2, 0.05, 1e-3, -5e-4)


def calibration() -> libloc.CameraCalibration:
    camera = libloc.CameraCalibration()
    camera.name = "cam0"
    camera.width_px, camera.height_px = 640, 480
    camera.intrinsics_px = K
    camera.distortion_model = libloc.DistortionModel.RADTAN
    camera.distortion = DISTORTION
    camera.T_body_camera = libloc.Pose3(to_wxyz(TILT), LEVER)
    return camera


def pinhole(u: np.ndarray) -> np.ndarray:
    """Pinhole and radtan; for complex numbers as well."""
    fx, fy, cx, cy = K
    k1, k2, p1, p2 = DISTORTION
    x, y = u[0] / u[2], u[1] / u[2]
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2 * r2
    return np.array(
        [
            fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx,
            fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy,
        ]
    )


def hat(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def pixel_of(R, p, anchor, frame, rho, error=None):
    """What the camera sees of the point, with errors of pose (theta, p) and of the point. Turns are of first
    order: exact for the steps of complex differentiation."""
    error = np.zeros(12) if error is None else error
    R = R @ (np.eye(3) + hat(error[:3]))
    ray = frame @ (np.eye(3) + hat(np.array([-error[10], error[9], 0]))) @ [0, 0, 1]
    at = p + error[3:6] + R @ LEVER
    return pinhole(TILT.as_matrix().T @ R.T @ ((rho + error[11]) * (anchor + error[6:9] - at) + ray))


def derivative(function, size: int) -> np.ndarray:
    """Columns by complex steps: exact to rounding."""
    step = 1e-30
    return np.stack([function(1j * step * e).imag / step for e in np.eye(size)], axis=1)


def camera_path(count: int):
    """Times, and poses of body: sideways, with a little of everything."""
    t = np.arange(count) * DT_NS * 1e-9
    position = np.stack([0.3 * np.sin(0.5 * t), np.sin(0.5 * t), 0.3 * (1 - np.cos(0.7 * t))], axis=1)
    start = to_scipy([0.5, -0.5, 0.5, -0.5])
    turn = Rotation.from_euler("xyz", np.stack([0.1 * np.sin(t), 0.05 * t, 0.1 * np.cos(t) - 0.1], axis=1))
    return np.rint(t * 1e9).astype(np.int64) + 10**18, position, start * turn


def tracks(count: int, points: int, sigma_px: float, seed: int = 3) -> libloc.FrameFeatures:
    """Points in front of the path; those in the picture, with noise."""
    rng = np.random.default_rng(seed)
    times_ns, position, rotation = camera_path(count)
    scene = np.stack([rng.uniform(3, 7, points), *rng.uniform(-1.2, 1.2, (2, points))], axis=1)
    frame, identity, pixels = [], [], []
    for i in range(count):
        for k, point in enumerate(scene):
            in_body = rotation[i].inv().apply(point - position[i])
            pixel = pinhole(TILT.inv().apply(in_body - LEVER)) + sigma_px * rng.normal(size=2)
            if 10 < pixel[0] < 630 and 10 < pixel[1] < 470:
                frame.append(i)
                identity.append(100 + k)
                pixels.append(pixel)
    return libloc.features_of_frames(
        np.array(frame), np.array(identity), np.array(pixels), times_ns, sigma_px=sigma_px
    )


def plain_options(**fields) -> libloc.SlamOptions:
    """No choices: everything seen is used, nothing is added later, deleted or converted."""
    return libloc.SlamOptions(
        camera=calibration(),
        consistency=libloc.SlamConsistency.PLAIN,
        map=libloc.SlamMapOptions(min_visible=12, max_linearity_index=0, delete_below_ratio=0),
        association=libloc.SlamAssociationOptions(ransac=False, gate_probability=0.999999),
        **fields,
    )


def feed(slam: libloc.MonoSlam, features: libloc.FrameFeatures, i: int) -> bool:
    rows = slice(features.first[i], features.first[i + 1])
    return slam.process(
        features.times_ns[i], features.id[rows], features.pixel_px[rows], features.sigma_px[i]
    )


def test_a_step_is_that_of_numpy():
    features = tracks(21, 12, 0.7)
    options = plain_options(acceleration_density=0.8, angular_acceleration_density=0.6)
    slam = libloc.MonoSlam(options)
    for i in range(20):
        assert feed(slam, features, i)
    before = slam.snapshot()
    assert feed(slam, features, 20)
    frame, after = slam.frame(), slam.snapshot()
    points = before.landmarks
    count = len(points.id)
    assert count == 12
    assert np.array_equal(after.landmarks.id, points.id)
    assert np.array_equal(points.offset, 12 + 6 * np.arange(count))

    # Constant velocity; white acceleration of both kinds.
    dt = DT_NS * 1e-9
    w = before.angular_velocity
    turn = Rotation.from_rotvec(w * dt).as_matrix()
    R = to_scipy(before.q_world_body_wxyz).as_matrix() @ turn
    p = before.position + dt * before.velocity
    n = 12 + 6 * count
    F, Q = np.eye(n), np.zeros((n, n))
    F[THETA, THETA] = turn.T
    for k, e in enumerate(1e-6 * np.eye(3)):
        plus, minus = Rotation.from_rotvec((w + e) * dt), Rotation.from_rotvec((w - e) * dt)
        F[THETA, 9 + k] = (minus.inv() * plus).as_rotvec() / 2e-6
    F[POSITION, VELOCITY] = dt * np.eye(3)
    for place, rate, density in ((POSITION, VELOCITY, 0.8), (THETA, TURN, 0.6)):
        Q[place, place] = density**2 * dt**3 / 3 * np.eye(3)
        Q[place, rate] = Q[rate, place] = density**2 * dt**2 / 2 * np.eye(3)
        Q[rate, rate] = density**2 * dt * np.eye(3)
    P = F @ before.covariance @ F.T + Q

    frames = to_scipy(points.frame_wxyz).as_matrix()
    H, residual, predicted = np.zeros((2 * count, n)), np.zeros(2 * count), np.zeros((count, 2))
    measured = {i: px for i, px in zip(features.id[-count:], features.pixel_px[-count:], strict=True)}
    for k in range(count):
        point = (points.anchor[k], frames[k], points.inverse_depth[k])
        predicted[k] = pixel_of(R, p, *point)
        J = derivative(lambda e, point=point: pixel_of(R, p, *point, e), 12)
        rows = slice(2 * k, 2 * k + 2)
        H[rows, :6] = J[:, :6]
        H[rows, points.offset[k] : points.offset[k] + 6] = J[:, 6:]
        residual[rows] = measured[points.id[k]] - predicted[k]
    S = H @ P @ H.T + 0.7**2 * np.eye(2 * count)
    gain = np.linalg.solve(S, H @ P).T
    error = gain @ residual
    P -= gain @ H @ P

    got = frame.features
    assert np.array_equal(got.id, points.id)
    assert np.all(got.state == libloc.SlamFeatureState.MEASURED)
    assert np.allclose(got.predicted_px, predicted, rtol=0, atol=1e-9)
    for k in range(count):
        rows = slice(2 * k, 2 * k + 2)
        assert np.allclose(got.innovation_cov[k], S[rows, rows], rtol=1e-9)
    assert frame.nis_dim == 2 * count
    assert frame.nis == pytest.approx(residual @ np.linalg.solve(S, residual), rel=1e-9)
    assert frame.reprojection_before_px == pytest.approx(np.sqrt(residual @ residual / count), rel=1e-9)

    assert np.allclose(after.position, p + error[POSITION], rtol=0, atol=1e-10)
    assert np.allclose(after.velocity, before.velocity + error[VELOCITY], rtol=0, atol=1e-9)
    assert np.allclose(after.angular_velocity, w + error[TURN], rtol=0, atol=1e-9)
    R = R @ Rotation.from_rotvec(error[THETA]).as_matrix()
    assert np.allclose(to_scipy(after.q_world_body_wxyz).as_matrix(), R, rtol=0, atol=1e-10)
    for k, offset in enumerate(points.offset):
        e = error[offset : offset + 6]
        ray = frames[k] @ Rotation.from_rotvec([-e[4], e[3], 0]).as_matrix() @ [0, 0, 1]
        assert np.allclose(after.landmarks.anchor[k], points.anchor[k] + e[:3], rtol=0, atol=1e-10)
        assert np.allclose(to_scipy(after.landmarks.frame_wxyz[k]).apply([0, 0, 1]), ray, rtol=0, atol=1e-10)
        assert after.landmarks.inverse_depth[k] == pytest.approx(points.inverse_depth[k] + e[5], abs=1e-10)
    deviation = np.sqrt(np.diag(P))
    assert np.all(np.abs(after.covariance - P) < 1e-8 * np.outer(deviation, deviation) + 1e-14)
    assert np.allclose(slam.estimate().covariance, P[:9, :9], rtol=0, atol=1e-10)
    # What is reported of the state: pose of the camera, pixels and depths after the update.
    assert np.allclose(frame.camera_position, after.position + R @ LEVER, rtol=0, atol=1e-9)
    assert np.allclose(
        to_scipy(frame.q_world_camera_wxyz).as_matrix(), R @ TILT.as_matrix(), rtol=0, atol=1e-9
    )
    assert np.array_equal(got.inverse_depth, after.landmarks.inverse_depth)
    rho_rows = points.offset + 5
    assert np.allclose(got.sigma_inverse_depth, deviation[rho_rows], rtol=1e-7)
    frames = to_scipy(after.landmarks.frame_wxyz).as_matrix()
    for k in range(count):
        point = (after.landmarks.anchor[k], frames[k], after.landmarks.inverse_depth[k])
        assert np.allclose(got.estimated_px[k], pixel_of(R, after.position, *point), rtol=0, atol=1e-6)


def test_step_by_step_is_the_whole_recording():
    features = tracks(60, 70, 0.5)
    options = libloc.SlamOptions(camera=calibration())
    seen = []
    whole = libloc.run_slam(
        features, options, with_features=True, progress=lambda done, total: seen.append((done, total))
    )
    assert not whole.stopped
    assert seen[-1] == (60, 60)

    slam = libloc.MonoSlam(options)
    frames, estimates = [], []
    for i in range(60):
        rows = slice(features.first[i], features.first[i + 1])
        if i % 2:
            assert feed(slam, features, i)
        else:
            assert slam.process(
                libloc.FeaturesMeasurement(
                    features.times_ns[i], features.id[rows], features.pixel_px[rows], sigma_px=0.5, sequence=i
                )
            )
        frames.append(slam.frame())
        estimates.append(slam.estimate())
    assert len(whole) == 60
    assert np.array_equal(whole.time_ns, features.times_ns)
    assert np.array_equal(whole.sequence, np.arange(60))
    same = (
        "camera_position",
        "q_world_camera_wxyz",
        "reprojection_before_px",
        "reprojection_after_px",
        "nis",
        "nis_dim",
    )
    for name in same:
        assert np.array_equal(getattr(whole, name), [getattr(f, name) for f in frames], equal_nan=True), name
    same = (
        "valid", "status", "q_world_body_wxyz", "position", "velocity", "angular_velocity", "gyroscope_bias",
        "accelerometer_bias", "covariance",
    )  # fmt: skip
    for name in same:
        assert np.array_equal(getattr(whole, name), [getattr(e, name) for e in estimates], equal_nan=True), (
            name
        )
    for name, values in whole.counts.items():
        assert np.array_equal(values, [getattr(f.counts, name) for f in frames]), name
    assert whole.covariance.shape == (60, 9, 9)
    assert np.all(whole.status & libloc.EstimateStatus.SCALE_UNKNOWN)
    assert np.all(whole.time_spent_s > 0)
    for name in ("id", "state", "pixel_px", "predicted_px", "estimated_px", "innovation_cov", "inverse_depth",
                 "sigma_inverse_depth", "converted"):  # fmt: skip
        parts = np.concatenate([getattr(f.features, name) for f in frames])
        assert np.array_equal(getattr(whole.features, name), parts, equal_nan=True), name
    assert np.array_equal(np.diff(whole.first), [len(f.features.id) for f in frames])

    one, other = whole.map, slam.map()
    assert len(one) == frames[-1].counts.map > 20
    for name in ("id", "converted", "position", "position_cov", "anchor", "frame_wxyz", "inverse_depth",
                 "inverse_depth_cov", "measured", "last_measured_ns", "landmark"):  # fmt: skip
        assert np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True), name
    # Points by their inverse depth: place and covariance are those of InverseDepthPoint.
    flexible = np.flatnonzero(~one.converted & (one.inverse_depth > 0))
    assert len(flexible) > 5
    for k in flexible:
        ray = to_scipy(one.frame_wxyz[k]).apply([0, 0, 1])
        assert np.allclose(one.position[k], one.anchor[k] + ray / one.inverse_depth[k])
    assert slam.counts()["slam.frames"] == 60


def test_a_camera_that_moves_is_found():
    """Landmarks of known place tie the scale; without them the shape alone is right."""
    features = tracks(200, 70, 0.5)
    _, truth, _ = camera_path(200)
    options = libloc.SlamOptions(
        camera=calibration(), q_world_body_wxyz=to_wxyz(camera_path(1)[2][0]), sigma_px=0.5
    )
    run = libloc.run_slam(features, options)
    free = libloc.align_points(run.position, truth, "sim3")
    assert free.rms_residual < 0.03
    rng = np.random.default_rng(3)
    scene = np.stack([rng.uniform(3, 7, 70), *rng.uniform(-1.2, 1.2, (2, 70))], axis=1)
    options.landmarks = [libloc.KnownLandmark(100 + k, scene[k]) for k in range(10)]
    run = libloc.run_slam(features, options)
    assert not np.any(run.status & libloc.EstimateStatus.SCALE_UNKNOWN)
    assert np.sqrt(np.mean(np.sum((run.position - truth) ** 2, axis=1))) < 0.03
    known = run.map.landmark
    assert set(run.map.id[known]) == set(range(100, 110))
    assert np.allclose(run.map.position[known], scene[run.map.id[known] - 100], atol=0.005)


@pytest.fixture(scope="module")
def walk() -> tuple[libloc.Recording, libloc.Rig]:
    """Somebody stands, then walks: IMU, features, truth."""
    scenario = libloc.Scenario("pedestrian", duration_s=9, parameters={"camera.max_features": 60})
    for stream in ("gps", "magnetometer", "odometry"):
        scenario.set(f"streams.{stream}", False)
    return libloc.simulate(scenario, 2).recording, scenario.rig()


def inertial_options(rig: libloc.Rig) -> libloc.SlamOptions:
    return libloc.SlamOptions(
        motion=libloc.SlamMotion.INERTIAL, camera=rig.cameras[0], imu_noise=rig.imu.noise
    )


def test_with_an_imu_step_by_step_is_the_whole_recording(walk):
    recording, rig = walk
    features, imu = recording.features, recording.imu
    whole = libloc.run_slam(recording, inertial_options(rig), with_features=True)
    slam = libloc.InertialSlam(inertial_options(rig))
    frames, used, waited = [], 0, 0
    for i in range(len(features.times_ns)):
        while used < len(imu.times_ns) and imu.times_ns[used] <= features.times_ns[i]:
            slam.process(
                libloc.ImuMeasurement(
                    imu.times_ns[used], imu.angular_velocity[used], imu.specific_force[used]
                )
            )
            waited = max(waited, len(slam.frames()))
            frames += slam.frames()
            used += 1
        assert not feed(slam, features, i)  # a frame waits for the IMU
        assert slam.frames() == []
    for k in range(used, len(imu.times_ns)):
        slam.process(libloc.ImuMeasurement(imu.times_ns[k], imu.angular_velocity[k], imu.specific_force[k]))
        frames += slam.frames()
    assert not slam.finish()  # nothing that is newer than the last sample's estimate
    frames += slam.frames()
    assert waited > 5  # those of before the start
    assert len(frames) == len(whole) > 170
    assert np.array_equal(whole.time_ns, [f.time_ns for f in frames])
    for name in (
        "position",
        "velocity",
        "q_world_body_wxyz",
        "gyroscope_bias",
        "accelerometer_bias",
        "covariance",
    ):
        got = [getattr(f.estimate, name) for f in frames]
        assert np.array_equal(getattr(whole, name), got), name
    assert np.array_equal(whole.features.id, np.concatenate([f.features.id for f in frames]))
    assert whole.covariance.shape == (len(frames), 15, 15)
    assert not np.any(whole.status & libloc.EstimateStatus.SCALE_UNKNOWN)
    assert whole.totals["imu.used"] > 1000

    # Metres, and the world is level: against the truth without any scale.
    truth = recording.reference
    rows = np.searchsorted(truth.times_ns, whole.time_ns)
    assert libloc.align_points(whole.position, truth.position[rows], "yaw").rms_residual < 0.1
    up = to_scipy(whole.q_world_body_wxyz).inv().apply([0, 0, 1])
    true_up = to_scipy(truth.q_world_body_wxyz[rows]).inv().apply([0, 0, 1])
    assert np.rad2deg(np.arccos(np.clip(np.sum(up * true_up, axis=1), -1, 1))).max() < 1


def test_the_last_frame_waits_for_the_imu_until_the_end(walk):
    recording, rig = walk
    f, imu = recording.features, recording.imu
    there = imu.times_ns <= f.times_ns[-1]
    runs = [
        libloc.InertialSlam(inertial_options(rig)).run(
            f.times_ns, f.first, f.id, f.pixel_px, imu.times_ns[there], imu.angular_velocity[there],
            imu.specific_force[there], sigma_px=f.sigma_px, finish=finish,
        )
        for finish in (False, True)
    ]  # fmt: skip
    assert len(runs[1]) == len(runs[0]) + 1
    assert runs[1].time_ns[-1] == f.times_ns[-1]
    assert np.array_equal(runs[1].position[:-1], runs[0].position)
    assert runs[0].totals["features.waiting"] == 1
    assert runs[1].totals["features.waiting"] == 0


def test_the_rig_corrects_the_imu(walk):
    recording, rig = walk
    options = inertial_options(rig)
    plain = libloc.run_slam(recording, options)
    imu = libloc.ImuCalibration()
    imu.noise = rig.imu.noise
    imu.gyroscope = libloc.TriadCalibration()
    imu.gyroscope.bias = [0.01, -0.02, 0.03]
    other = libloc.Rig()
    other.imu = imu
    slam = libloc.InertialSlam(options)
    f = recording.features
    by_hand = slam.run(
        f.times_ns, f.first, f.id, f.pixel_px, recording.imu.times_ns,
        recording.imu.angular_velocity - imu.gyroscope.bias, recording.imu.specific_force,
        sigma_px=f.sigma_px, finish=True,
    )  # fmt: skip
    corrected = libloc.run_slam(recording, options, rig=other)
    assert np.array_equal(corrected.position, by_hand.position)
    difference = plain.gyroscope_bias[-1] - corrected.gyroscope_bias[-1]
    assert np.allclose(difference, imu.gyroscope.bias, atol=1e-3)
    with pytest.raises(ValueError, match="no IMU samples"):
        libloc.run_slam(f, options)


def test_snapshot_and_reset():
    features = tracks(30, 40, 0.5)
    options = libloc.SlamOptions(camera=calibration())
    slam, other = libloc.MonoSlam(options), libloc.MonoSlam(options)
    assert not slam.running
    for i in range(20):
        feed(slam, features, i)
    kept = slam.snapshot()
    assert kept.time_ns == features.times_ns[19]
    other.restore(kept)
    assert other.running
    assert np.array_equal(other.map().id, slam.map().id)
    assert np.array_equal(other.snapshot().covariance, kept.covariance)
    feed(slam, features, 20)  # what was kept does not change with the filter
    assert kept.time_ns == features.times_ns[19]
    for i in range(20, 30):
        assert feed(other, features, i)
    feed(slam, features, 29)
    assert np.linalg.norm(other.estimate().position - slam.estimate().position) < 0.1
    assert set(other.map().id) >= set(kept.landmarks.id[:5])
    slam.reset()
    assert not slam.running
    assert len(slam.map()) == 0
    wrong = copy.deepcopy(options)
    wrong.estimate_extrinsics = True
    with pytest.raises(ValueError, match="snapshot"):
        libloc.MonoSlam(wrong).restore(kept)


def test_every_option_is_there():
    files = ("slam_options", "fusion_start", "stand_still", "slam_start")
    header = "".join((CHECKOUT / f"libloc/estimators/{name}.hpp").read_text() for name in files)
    for name in ("SlamMapOptions", "SlamAssociationOptions", "SlamOptions", "KnownLandmark",
                 "FusionStartOptions", "StandStillOptions", "SlamStartOptions"):  # fmt: skip
        body = re.search(rf"struct {name} \{{(.*?)\n\}};", header, re.S)[1]
        fields = re.findall(r"^  [\w:]+(?:<[\w:]+>)? (\w+)(?:\s+=[^;]*|\{[^}]*\})?;", body, re.M)
        assert len(fields) >= 3, name
        for field in fields:
            field = "q_world_body_wxyz" if field == "q_world_body" else field
            assert hasattr(getattr(libloc, name), field), f"{name}.{field}"


def test_options():
    options = libloc.SlamOptions(
        camera=calibration(),
        sigma_px=0.5,
        position=[1, 2, 3],
        q_world_body_wxyz=[1, 0, 0, 0],
        landmarks=[libloc.KnownLandmark(7, [1, 2, 3], sigma=0.01)],
        motion=libloc.SlamMotion.CONSTANT_VELOCITY,
    )
    assert options.sigma_px == 0.5
    assert np.array_equal(options.position, [1, 2, 3])
    assert np.array_equal(options.landmarks[0].position, [1, 2, 3])
    options.map.max_features = 60
    options.association.gate_probability = 0.99
    other = copy.deepcopy(options)
    assert other.map.max_features == 60
    other.map.max_features = 70
    assert options.map.max_features == 60
    assert libloc.MonoSlam(options).options.association.gate_probability == 0.99
    with pytest.raises(TypeError, match="SlamOptions has no field sigma"):
        libloc.SlamOptions(sigma=1)
    with pytest.raises(ValueError, match="sigma_px = -1"):
        libloc.SlamOptions(camera=calibration(), sigma_px=-1)
    with pytest.raises(ValueError, match=r"map\.max_features = 1:"):
        libloc.SlamMapOptions(max_features=1)
    with pytest.raises(ValueError, match="resolution"):
        libloc.MonoSlam(libloc.SlamOptions())
    with pytest.raises(ValueError, match="motion"):
        libloc.MonoSlam(libloc.SlamOptions(camera=calibration(), motion=libloc.SlamMotion.INERTIAL))


def test_wrong_input_is_named():
    features = tracks(5, 10, 0.5)
    slam = libloc.MonoSlam(libloc.SlamOptions(camera=calibration()))
    good = [features.times_ns, features.first, features.id, features.pixel_px]
    for k, wrong, message in (
        (1, features.first[:-1], "first, less the last, must have as many rows as time_ns"),
        (1, features.first[::-1].copy(), "first must ascend from 0 to the number of features"),
        (2, features.id[:-1], "first must ascend from 0"),
        (3, features.pixel_px[:-1], "pixel_px must have as many rows as id"),
    ):
        with pytest.raises(ValueError, match=message):
            slam.run(*good[:k], wrong, *good[k + 1 :])
    with pytest.raises(TypeError, match="id"):
        slam.run(*good[:2], features.id.astype(float), good[3])
    with pytest.raises(
        ValueError, match="sigma_px must be one value, or one for each of the 5 frames; has 2"
    ):
        slam.run(*good, sigma_px=[1, 2])
    with pytest.raises(ValueError, match=r"camera = 0\.5"):
        slam.run(*good, camera=0.5)
    with pytest.raises(ValueError, match="no features of camera 3"):
        libloc.run_slam(features, libloc.SlamOptions(camera=calibration(), camera_index=3))
    with pytest.raises(ValueError, match="frame: must ascend"):
        libloc.features_of_frames([1, 0], [1, 2], [[0, 0], [1, 1]], [0, 1])
    with pytest.raises(ValueError, match="rate_hz = 0"):
        libloc.features_of_tracks([0], [1], [[0, 0]], rate_hz=0)
    assert not slam.running


def test_a_run_can_be_stopped():
    features = tracks(40, 10, 0.5)
    options = libloc.SlamOptions(camera=calibration())
    run = libloc.run_slam(features, options, progress=lambda done, total: False)
    assert run.stopped
    assert len(run) == 1
    assert len(run.map) == 10

    def fail(done: int, total: int) -> None:
        raise KeyboardInterrupt

    slam = libloc.MonoSlam(options)
    with pytest.raises(KeyboardInterrupt):
        slam.run(features.times_ns, features.first, features.id, features.pixel_px, progress=fail)
    assert slam.running
    assert feed(slam, features, 10)  # not busy any more


def test_tracks_of_a_file_have_times():
    got = libloc.features_of_tracks(
        np.array([2, 2, 5]), np.array([1, 4, 1]), np.array([[1.0, 2], [3, 4], [5, 6]]),
        rate_hz=10, start_time_ns=1000, sigma_px=0.3, camera=2,
    )  # fmt: skip
    assert np.array_equal(got.times_ns, [200_001_000, 500_001_000])
    assert np.array_equal(got.first, [0, 2, 3])
    assert np.array_equal(got.camera, [2, 2])
    assert np.array_equal(got.sigma_px, [0.3, 0.3])


def test_inverse_depth_point():
    point = libloc.InverseDepthPoint([1, 2, 3], [0.2, -0.4, 2], 0.25)
    ray = np.array([0.2, -0.4, 2]) / np.linalg.norm([0.2, -0.4, 2])
    assert np.allclose(point.ray, ray)
    assert np.allclose(point.xyz(), np.array([1, 2, 3]) + 4 * ray)
    for k in range(6):
        e = np.eye(6)[k] * 1e-6
        column = (point.boxplus(e).xyz() - point.boxplus(-e).xyz()) / 2e-6
        assert np.allclose(point.xyz_jacobian()[:, k], column, rtol=0, atol=1e-8)
        if k in (3, 4):
            turned = (point.boxplus(e).ray - point.boxplus(-e).ray) / 2e-6
            assert np.allclose(point.ray_basis()[:, k - 3], turned, atol=1e-9)
    # As in the source, where y is down.
    az, el = point.azimuth, point.elevation
    assert np.allclose(ray, [np.cos(el) * np.sin(az), -np.sin(el), np.cos(el) * np.cos(az)])
    camera = np.array([0.0, 1, 0])
    line = point.xyz() - camera
    cosine = line @ ray / np.linalg.norm(line)
    expected = 4 * 0.01 * abs(cosine) / (0.25**2 * np.linalg.norm(line))
    assert point.linearity_index(0.01, camera) == pytest.approx(expected)
    assert libloc.InverseDepthPoint([0, 0, 0], [0, 0, 1], -0.1).linearity_index(0.01, camera) == np.inf
    with pytest.raises(ValueError, match="ray must be finite and not zero"):
        libloc.InverseDepthPoint([0, 0, 0], [0, 0, 0], 1)
