"""calib/spline against SciPy: B-splines, products of rotations, differences."""

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation
from support import to_scipy, to_wxyz

import libloc
from libloc import DataError, EulerTrajectory, PoseSpline, RotationSpline, SplineGrid, VectorSpline

RNG = np.random.default_rng(7)


def scipy_spline(grid: SplineGrid, points: np.ndarray) -> BSpline:
    knots = grid.start_s + grid.spacing_s * (np.arange(len(points) + grid.order) - grid.order + 1)
    return BSpline(knots, points, grid.order - 1)


def random_rotations(n: int, step: float) -> Rotation:
    out = [Rotation.random(rng=3)]
    for theta in step * RNG.normal(size=(n - 1, 3)):
        out.append(out[-1] * Rotation.from_rotvec(theta))
    return Rotation.concatenate(out)


def waved(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Attitudes wxyz and places of something that is waved about one attitude."""
    mean = Rotation.from_euler("y", 85, degrees=True)
    angles = 0.4 * np.sin(np.outer(times, [2, 2.7, 3.1]) + np.arange(3))
    position = 0.2 * np.cos(np.outer(times, [1.5, 2.2, 1.1]))
    return to_wxyz(mean * Rotation.from_rotvec(angles)), position


@pytest.mark.parametrize("order", range(3, 9))
def test_vector_spline_is_scipys(order):
    grid = SplineGrid(5.0, 0.2, 7, order)
    points = RNG.normal(size=(grid.control_points, 2))
    assert grid.control_points == 7 + order - 1
    spline, expected = VectorSpline(grid, points), scipy_spline(grid, points)
    times = np.linspace(4.913, 6.507, 97)  # also a little outside; no knot, where order 3 has bends
    for derivative in range(3):
        value = spline.value(times, derivative)
        assert value.shape == (97, 2)
        np.testing.assert_allclose(value, expected(times, nu=derivative), rtol=1e-9, atol=1e-8)
    assert np.array_equal(spline.control_points, points)
    # Greville's abscissae: control points of a straight line lie on it.
    line = VectorSpline(grid, grid.abscissae_s[:, None])
    np.testing.assert_allclose(line.value(times)[:, 0], times, atol=1e-12)


@pytest.mark.parametrize("order", [3, 4, 6])
def test_rotation_spline_is_the_product_of_its_turns(order):
    grid = SplineGrid(0.0, 0.1, 6, order)
    points = random_rotations(grid.control_points, 0.4)
    spline = RotationSpline(grid, to_wxyz(points))
    times = np.linspace(0, 0.6, 50)[1:-1] + 1e-4
    states = spline.at(times)

    turns = (points[:-1].inv() * points[1:]).as_rotvec()
    # Cumulative weights: what each control point and all after it weigh together.
    weights = scipy_spline(grid, np.eye(grid.control_points))(times)
    cumulative = np.cumsum(weights[:, ::-1], axis=1)[:, ::-1]
    expected = Rotation.concatenate([points[0]] * len(times))
    for j, turn in enumerate(turns):
        expected = expected * Rotation.from_rotvec(cumulative[:, j + 1, None] * turn)
    np.testing.assert_allclose(
        (expected.inv() * to_scipy(states.q_world_body_wxyz)).magnitude(), 0, atol=1e-12
    )

    h = 1e-5
    ahead, behind = (to_scipy(spline.at(times + d).q_world_body_wxyz) for d in (h, -h))
    middle = to_scipy(states.q_world_body_wxyz)
    rate = ((middle.inv() * ahead).as_rotvec() - (middle.inv() * behind).as_rotvec()) / (2 * h)
    np.testing.assert_allclose(states.angular_velocity, rate, atol=1e-6)
    slope = (spline.at(times + h).angular_velocity - spline.at(times - h).angular_velocity) / (2 * h)
    np.testing.assert_allclose(states.angular_acceleration, slope, atol=1e-3)
    assert np.allclose(spline.control_points, to_wxyz(points))


@pytest.mark.parametrize("form", ["pose", "euler"])
def test_poses_are_fitted_and_resampled(form):
    times = np.arange(0, 6, 0.02)
    q, position = waved(times)
    if form == "pose":
        fit = libloc.fit_pose_spline(times, q, position, order=6, spacing_s=0.1)
        assert fit.converged
        spline = fit.spline
        assert isinstance(spline, PoseSpline)
    else:
        fit = libloc.fit_euler_trajectory(times, q, position, order=6, spacing_s=0.1)
        spline = fit.trajectory
        assert isinstance(spline, EulerTrajectory)
        assert abs(np.linalg.norm(spline.mean_wxyz) - 1) < 1e-12
    assert fit.rms_rotation < 1e-5
    assert fit.rms_position < 1e-6
    assert (spline.grid.order, spline.grid.start_s, spline.grid.segments) == (6, 0, 60)
    at = np.array([0.313, 2.2, 5.05])
    states = spline.at(at)
    true_q, true_position = waved(at)
    assert (to_scipy(true_q).inv() * to_scipy(states.q_world_body_wxyz)).magnitude().max() < 2e-5
    np.testing.assert_allclose(states.position, true_position, atol=1e-6)
    rates = 0.2 * np.array([1.5, 2.2, 1.1])
    np.testing.assert_allclose(states.velocity, -rates * np.sin(np.outer(at, [1.5, 2.2, 1.1])), atol=1e-4)
    np.testing.assert_allclose(
        states.acceleration,
        -rates * [1.5, 2.2, 1.1] * np.cos(np.outer(at, [1.5, 2.2, 1.1])),
        atol=1e-2,
    )
    h = 1e-4
    ahead, behind = (to_scipy(waved(at + d)[0]) for d in (h, -h))
    rate = (behind.inv() * ahead).as_rotvec() / (2 * h)
    np.testing.assert_allclose(states.angular_velocity, rate, atol=2e-3)

    origin = 1_700_000_000_000_000_000
    times_ns = origin + np.round(at * 1e9).astype(np.int64)
    trajectory = spline.resample(times_ns, origin_ns=origin)
    assert np.array_equal(trajectory.times_ns, times_ns)
    np.testing.assert_allclose(trajectory.position, states.position, atol=1e-9)
    np.testing.assert_allclose(trajectory.q_world_body_wxyz, states.q_world_body_wxyz, atol=1e-9)
    with pytest.raises(DataError, match="times_ns"):
        spline.resample(times_ns[::-1].copy(), origin_ns=origin)


def test_vectors_are_fitted():
    times = np.linspace(10, 13, 301)
    values = np.stack([np.sin(times), np.cos(times), times], axis=1)
    fit = libloc.fit_vector_spline(times, values, order=5, spacing_s=0.25)
    assert fit.rms < 1e-5
    np.testing.assert_allclose(fit.spline.value(times, 1)[:, 0], np.cos(times), atol=1e-3)
    np.testing.assert_allclose(fit.spline.value(times, 1)[:, 2], 1, atol=1e-6)
    assert fit.spline.grid.end_s >= 13


def test_parts_and_whole():
    grid = SplineGrid.over(1.0, 2.0, 0.3, 4)
    assert (grid.segments, grid.order, grid.start_s) == (4, 4, 1.0)
    assert grid.end_s == pytest.approx(2.2)
    q = to_wxyz(random_rotations(grid.control_points, 0.2))
    points = RNG.normal(size=(grid.control_points, 3))
    pose = PoseSpline(RotationSpline(grid, q), VectorSpline(grid, points))
    times = np.linspace(1, 2, 11)
    assert np.array_equal(pose.at(times).angular_velocity, pose.rotation.at(times).angular_velocity)
    assert np.array_equal(pose.at(times).acceleration, pose.position.value(times, 2))
    euler = EulerTrajectory([1, 0, 0, 0], grid, np.hstack([0.1 * points, points]))
    assert np.array_equal(euler.at(times).velocity, pose.at(times).velocity)
    angles = VectorSpline(grid, 0.1 * points).value(times)
    expected = Rotation.from_euler("ZYX", angles[:, ::-1])  # Rz Ry Rx
    np.testing.assert_allclose(
        (expected.inv() * to_scipy(euler.at(times).q_world_body_wxyz)).magnitude(), 0, atol=1e-12
    )


def test_mistakes_are_named():
    grid = SplineGrid(0, 0.1, 3)
    times = np.array([0.0, 0.1, 0.2])
    q = np.tile([1.0, 0, 0, 0], (3, 1))
    zero = np.zeros((3, 3))
    for call, error, text in [
        (lambda: SplineGrid(0, -1, 3), ValueError, "spacing_s"),
        (lambda: SplineGrid(0, 1, 3, 9), ValueError, "order"),
        (lambda: VectorSpline(grid, np.zeros((5, 2))), ValueError, "control"),
        (lambda: VectorSpline(grid, np.zeros(6)), ValueError, r"shape \(N, d\)"),
        (lambda: RotationSpline(grid, np.ones((6, 4))), ValueError, "norm"),
        (lambda: VectorSpline(grid, np.zeros((6, 2))).value(times, 3), ValueError, "derivative"),
        (lambda: VectorSpline(grid, np.zeros((6, 2))).value([0.1]), TypeError, "times_s"),
        (lambda: VectorSpline(grid, np.zeros((6, 2))).value(np.array([np.nan])), ValueError, "t_s"),
        (lambda: libloc.fit_vector_spline(times[::-1].copy(), zero), DataError, r"times_s\[1\]"),
        (lambda: libloc.fit_vector_spline(times, zero[:2]), DataError, "3 times but 2 values"),
        (lambda: libloc.fit_pose_spline(times, q, zero[:2]), ValueError, "position"),
        (lambda: libloc.fit_pose_spline(times, 2 * q, zero), DataError, r"poses\[0\]"),
        (lambda: libloc.fit_euler_trajectory(np.array([0, 0.1, 1e7]), q, zero), DataError, "control points"),
    ]:
        with pytest.raises(error, match=text):
            call()
