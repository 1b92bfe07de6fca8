"""geometry/ against SciPy's Rotation."""

import copy
import pickle

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from support import to_scipy, to_wxyz

import libloc
from libloc import Pose3, so3

RNG = np.random.default_rng(5)
THETA = np.concatenate(
    [RNG.normal(size=(50, 3)), np.zeros((1, 3)), 1e-9 * np.ones((1, 3)), [[np.pi - 1e-9, 0, 0]]]
)
Q0 = to_wxyz(Rotation.random(50, rng=1))
Q1 = to_wxyz(Rotation.random(50, rng=2))


def test_so3_is_scipys():
    q = so3.exp(THETA)
    assert q.shape == (len(THETA), 4)
    assert np.allclose(to_scipy(q).as_matrix(), Rotation.from_rotvec(THETA).as_matrix(), atol=1e-14)
    assert np.allclose(so3.log(q), Rotation.from_rotvec(THETA).as_rotvec(), atol=1e-9)
    assert np.allclose(so3.boxminus(Q1, Q0), (to_scipy(Q0).inv() * to_scipy(Q1)).as_rotvec(), atol=1e-12)
    plus = to_scipy(so3.boxplus(Q0, THETA[:50]))
    assert np.allclose(
        plus.as_matrix(), (to_scipy(Q0) * Rotation.from_rotvec(THETA[:50])).as_matrix(), atol=1e-12
    )
    assert np.allclose(so3.angle_between(Q1, Q0), (to_scipy(Q0).inv() * to_scipy(Q1)).magnitude(), atol=1e-12)


def test_heading_is_the_nearest_turn_about_z():
    angles = np.linspace(-np.pi, np.pi, 20001)
    for q in Q0[:10]:
        distance = so3.angle_between(so3.exp(np.outer(angles, [0, 0, 1.0])), q)
        nearest = angles[np.argmin(distance)]
        assert abs(np.angle(np.exp(1j * (so3.heading(q) - nearest)))) < 4e-4


def test_one_row_and_many():
    assert so3.exp([0.1, 0, 0]).shape == (4,)
    assert so3.log([1, 0, 0, 0]).shape == (3,)
    assert isinstance(so3.heading([1, 0, 0, 0]), float)
    assert so3.heading(Q0).shape == (50,)
    # One row meets many.
    assert np.array_equal(so3.angle_between(Q0, Q1[0]), so3.angle_between(Q0, np.tile(Q1[0], (50, 1))))
    assert so3.exp(np.empty((0, 3))).shape == (0, 4)


def test_jacobians_are_derivatives():
    theta, step = np.array([0.3, -1.1, 0.7]), 1e-6
    right, left = so3.right_jacobian(theta), so3.left_jacobian(theta)
    for axis in np.eye(3):
        d = axis * step
        numeric = so3.boxminus(so3.exp(theta + d), so3.exp(theta - d)) / (2 * step)
        assert np.allclose(right @ axis, numeric, atol=1e-9)
    assert np.allclose(left, right.T, atol=1e-14)


def test_pose_is_the_matrix_group():
    xi = np.array([0.4, -2.0, 1.0, 0.3, 0.9, -0.5])
    generator = np.zeros((4, 4))
    generator[:3, 3] = xi[:3]
    generator[:3, :3] = [[0, -xi[5], xi[4]], [xi[5], 0, -xi[3]], [-xi[4], xi[3], 0]]
    pose = Pose3.exp(xi)
    assert np.allclose(pose.matrix(), expm(generator), atol=1e-13)
    assert np.allclose(pose.log(), xi, atol=1e-13)
    other = Pose3(Q0[0], [1, 2, 3])
    assert np.allclose((other * pose).matrix(), other.matrix() @ pose.matrix(), atol=1e-13)
    assert np.allclose((other * other.inverse()).matrix(), np.eye(4), atol=1e-14)
    assert np.allclose(other.boxplus(xi).boxminus(other), xi, atol=1e-13)
    adjoint = Pose3.exp(other.adjoint() @ xi) * other
    assert np.allclose((other * pose).matrix(), adjoint.matrix(), atol=1e-12)
    points = RNG.normal(size=(7, 3))
    expected = points @ other.matrix()[:3, :3].T + other.translation
    assert np.allclose(other.transform(points), expected, atol=1e-13)
    assert np.allclose(other.transform(points[0]), expected[0], atol=1e-13)
    for twin in (copy.deepcopy(other), pickle.loads(pickle.dumps(other))):
        assert np.array_equal(twin.matrix(), other.matrix())


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: so3.exp([1, 2]), ValueError, r"theta must have shape \(3,\) or \(N, 3\), has \(2,\)"),
        (lambda: so3.exp("abc"), TypeError, "theta must be numbers, not 'abc'"),
        (lambda: so3.log([2, 0, 0, 0]), ValueError, r"q_wxyz\[0\] must be a unit quaternion, its norm is 2"),
        (lambda: so3.log([np.nan, 0, 0, 0]), ValueError, "must be a unit quaternion"),
        (
            lambda: so3.boxminus(Q0, Q1[:3]),
            ValueError,
            r"q0_wxyz must have as many rows as q1_wxyz \(50\), has 3",
        ),
        (lambda: Pose3(translation=[1, 2]), ValueError, r"translation must have shape \(3,\), has \(2,\)"),
        (lambda: Pose3([1, 1, 0, 0]), ValueError, "rotation_wxyz must be a unit quaternion"),
        (
            lambda: Pose3.from_matrix(np.ones((3, 4))),
            ValueError,
            r"matrix must have shape \(4, 4\), has \(3, 4\)",
        ),
        (lambda: Pose3.from_matrix(2 * np.eye(4)), ValueError, "orthogonality"),
        (lambda: Pose3.exp(np.ones(5)), ValueError, r"xi must have shape \(6,\), has \(5,\)"),
    ],
)
def test_callers_mistakes(call, error, text):
    with pytest.raises(error, match=text):
        call()


def test_properties_are_copies():
    pose = Pose3()
    pose.translation[0] = 5
    assert np.array_equal(pose.translation, [0, 0, 0])
    pose.translation = [1, 2, 3]
    assert np.array_equal(pose.translation, [1, 2, 3])
    assert "translation=[1.0, 2.0, 3.0]" in repr(pose)
    assert isinstance(libloc.so3.exp([0, 0, 0]), np.ndarray)


def test_local_frame():
    origin = np.array([0.7610, 0.0251, 150.0])
    frame = libloc.LocalFrame(*origin)
    assert np.allclose(frame.to_local(origin), 0, atol=1e-8)
    # Radii of curvature of WGS 84 at the origin; small steps, so that the plane is the surface.
    a, e2 = 6378137.0, 0.00669437999014
    w = np.sqrt(1 - e2 * np.sin(origin[0]) ** 2)
    meridian, prime = a * (1 - e2) / w**3, a / w
    step = np.array([2e-6, -3e-6, 4.0])
    expected = [step[1] * (prime + 150) * np.cos(origin[0]), step[0] * (meridian + 150), step[2]]
    assert np.allclose(frame.to_local(origin + step), expected, atol=1e-3)
    positions = RNG.normal(scale=500.0, size=(20, 3))
    assert np.allclose(frame.to_local(frame.to_geodetic(positions)), positions, atol=1e-7)
    with pytest.raises(ValueError, match="latitude"):
        libloc.LocalFrame(2.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="latitude_longitude_altitude"):
        frame.to_local([0.0, 0.0])
