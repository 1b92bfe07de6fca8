"""Cameras, scenes, simulated features and pictures, tracks: arrays from Python, against formulas in NumPy."""

import numpy as np
import pytest

import libloc
from libloc import (
    Camera,
    CameraCalibration,
    CameraModel,
    CircleMotion,
    DataError,
    DistortionModel,
    Pose3,
    Random,
    Scene,
    SceneRenderer,
    StreetModel,
)

INTRINSICS = np.array([458.654, 457.296, 367.215, 248.375])
RADTAN = np.array([-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05])
# Looks along the body's x, upright.
BODY_CAMERA = Pose3.from_matrix(np.array([[0, 0, 1, 0.1], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]]))


def calibration(model=DistortionModel.RADTAN, distortion=RADTAN):
    c = CameraCalibration()
    c.name, c.width_px, c.height_px = "cam0", 752, 480
    c.intrinsics_px, c.distortion_model, c.distortion = INTRINSICS, model, distortion
    c.T_body_camera = BODY_CAMERA
    return c


def radtan(points):
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    k1, k2, p1, p2 = RADTAN
    r2 = x**2 + y**2
    d = 1 + k1 * r2 + k2 * r2**2
    u = x * d + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    v = y * d + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    return np.column_stack([u, v]) * INTRINSICS[:2] + INTRINSICS[2:]


def random_points(count=500):
    rng = np.random.default_rng(1)
    return np.column_stack([rng.uniform(-0.8, 0.8, count), rng.uniform(-0.5, 0.5, count), np.ones(count)]) * (
        rng.uniform(0.5, 20, (count, 1))
    )


def test_projection_and_back():
    camera = Camera(calibration())
    points = random_points()
    pixels = camera.project(points)
    np.testing.assert_allclose(pixels, radtan(points), atol=1e-9)
    rays = camera.unproject(pixels)
    np.testing.assert_allclose(rays, points / np.linalg.norm(points, axis=1, keepdims=True), atol=1e-10)
    assert camera.in_image(pixels).sum() == ((pixels >= -0.5) & (pixels <= [751.5, 479.5])).all(axis=1).sum()
    assert np.isnan(camera.project(np.array([[0.0, 0, -1], [np.nan, 0, 1]]))).all()


def test_jacobians():
    camera = Camera(calibration())
    points = random_points(50)
    pixels, d_point, d_parameters = camera.project_with_jacobians(points)
    np.testing.assert_array_equal(pixels, camera.project(points))
    for axis in range(3):
        step = 1e-6 * np.eye(3)[axis]
        numeric = (camera.project(points + step) - camera.project(points - step)) / 2e-6
        np.testing.assert_allclose(d_point[:, :, axis], numeric, rtol=1e-6, atol=1e-5)
    for i in range(8):
        moved = []
        for sign in (1, -1):
            c = calibration()
            parameters = np.concatenate([INTRINSICS, RADTAN])
            parameters[i] += sign * 1e-6
            c.intrinsics_px, c.distortion = parameters[:4], parameters[4:]
            moved.append(Camera(c).project(points))
        np.testing.assert_allclose(d_parameters[:, :, i], (moved[0] - moved[1]) / 2e-6, rtol=1e-5, atol=1e-5)


def test_fisheye_sees_sideways():
    camera = Camera(calibration(DistortionModel.EQUIDISTANT, np.zeros(4)))
    assert camera.max_angle == pytest.approx(np.pi, abs=1e-6)
    pixel = camera.project(np.array([[1.0, 0, 0]]))
    np.testing.assert_allclose(pixel, [[INTRINSICS[2] + INTRINSICS[0] * np.pi / 2, INTRINSICS[3]]])


def test_simulated_features_are_the_projected_points():
    motion = CircleMotion(radius_m=1.0, speed_mps=1.0, center=[0, 0, 1.2])
    room = libloc.box_room(Random(1))
    c = calibration()
    c.time_offset_s = 0.005
    model = CameraModel(sigma_px=0.4, outlier_rate=0.05, start_time_ns=10**12)
    run = libloc.simulate_camera(motion, c, room, Random(2), model, duration_s=5.0)
    assert len(run.time_ns) == 101
    np.testing.assert_allclose((run.time_ns - 10**12) * 1e-9, run.true_time_s - 0.005, atol=1e-9)
    points = room.points
    assert points.shape == (720, 3)
    for f in range(0, 101, 20):
        pose = Pose3(run.q_world_camera_wxyz[f], run.position[f])
        mine = run.frame == f
        seen = pose.inverse().transform(points[run.point[mine]])
        np.testing.assert_allclose(run.true_pixel_px[mine], radtan(seen), atol=1e-9)
        np.testing.assert_allclose(run.depth_m[mine], seen[:, 2], atol=1e-12)
    assert (run.feature == run.point).all() and not run.wrong_id.any()
    error = (run.pixel_px - run.true_pixel_px)[~run.outlier]
    assert error.std() == pytest.approx(0.4, rel=0.05)
    assert run.outlier.mean() == pytest.approx(0.05, abs=0.015)
    again = libloc.simulate_camera(motion, c, room, Random(2), model, duration_s=5.0)
    np.testing.assert_array_equal(run.pixel_px, again.pixel_px)
    assert room.visible_from([0, 0, 1.2]).all()


def test_street_and_its_pictures():
    angle = np.linspace(0, 3, 200)
    path = np.column_stack([60 * np.cos(angle), 60 * np.sin(angle), np.zeros(200)])
    scene = libloc.street(path, Random(3), StreetModel(road_width_m=7.0))
    assert scene.faces > 30
    camera_pose = Pose3.from_matrix(np.array([[1, 0, 0, 60.0], [0, 0, 1, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]]))
    picture = SceneRenderer(scene, calibration(), format="rgb", texel_m=0.05).render(camera_pose)
    assert picture.shape == (480, 752, 3) and picture.dtype == np.uint8
    assert tuple(picture[20, 376]) == (170, 190, 215)  # sky between the houses
    grey = SceneRenderer(scene, calibration(), texel_m=0.05)
    assert grey.render(camera_pose).std() > 20
    blurred = grey.render([camera_pose, Pose3.exp([0.1, 0, 0, 0, 0, 0]) * camera_pose])
    assert np.abs(blurred.astype(int) - grey.render(camera_pose)).max() > 20
    with pytest.raises(ValueError, match="format = 'cmyk'"):
        SceneRenderer(scene, calibration(), format="cmyk")


def test_targets():
    board = libloc.checkerboard(columns=4, rows=3, square_m=0.1)
    np.testing.assert_allclose(board.points[5], [0.1, 0.1, 0])
    grid = libloc.april_grid()
    np.testing.assert_allclose(grid.points[4 * 7 + 2], [0.1144 + 0.088, 0.1144 + 0.088, 0])
    room = libloc.box_room(Random(1))
    assert room.add(grid, Pose3(translation=[1, 0, 1])) == 720
    assert room.points.shape == (720 + 144, 3)


def test_tracks_file(tmp_path):
    frame = np.repeat(np.arange(5), 3)
    feature = np.tile(np.array([4, 1, 900]), 5)
    pixel = np.random.default_rng(1).normal(size=(15, 2)) * 1e3
    libloc.write_tracks(tmp_path / "tracks.txt", frame, feature, pixel)
    read_frame, read_feature, read_pixel, counts = libloc.read_tracks(tmp_path / "tracks.txt")
    order = np.lexsort((feature, frame))
    np.testing.assert_array_equal(read_frame, frame)
    np.testing.assert_array_equal(read_feature, feature[order])
    np.testing.assert_array_equal(read_pixel, pixel[order])
    assert counts == {"tracks.frames": 5, "tracks.read": 15}
    # As NumPy writes it.
    rows = np.column_stack([np.repeat(frame, 2), np.repeat(feature, 2), np.tile([0, 1], 15), pixel.ravel()])
    np.savetxt(tmp_path / "numpy.txt", rows)
    np.testing.assert_array_equal(libloc.read_tracks(tmp_path / "numpy.txt")[2], pixel[order])
    (tmp_path / "bad.txt").write_text("0 1 0 5\n0 1 2 5\n")
    with pytest.raises(DataError, match=r"bad.txt:2: dimension = '2'"):
        libloc.read_tracks(tmp_path / "bad.txt")
    with pytest.raises(ValueError, match="feature must have as many rows as frame"):
        libloc.write_tracks(tmp_path / "x.txt", frame, feature[:-1], pixel)


def test_points_file(tmp_path):
    points = np.random.default_rng(2).normal(size=(7, 3))
    libloc.write_points(tmp_path / "points.txt", points)
    read, counts = libloc.read_points(tmp_path / "points.txt")
    np.testing.assert_array_equal(read, points)
    assert counts == {"points.read": 7}
    np.testing.assert_array_equal(Scene(read).points, points)


def test_wrong_arguments_are_named():
    bad = calibration()
    bad.width_px = 0
    with pytest.raises(ValueError, match=r"cam0\.resolution"):
        Camera(bad)
    with pytest.raises(ValueError, match="points must have shape"):
        Camera(calibration()).project(np.zeros((3, 2)))
    with pytest.raises(TypeError, match="CameraModel has no field sigma"):
        CameraModel(sigma=1.0)
    with pytest.raises(ValueError, match="loss_rate = 2"):
        CameraModel(loss_rate=2.0)
    with pytest.raises(ValueError, match="path: must have two"):
        libloc.street(np.zeros((1, 3)), Random(1))
    with pytest.raises(ValueError, match="random: must be given"):
        SceneRenderer(libloc.checkerboard(), calibration(), noise_sigma=2.0).render(Pose3())
