"""Motions of the simulator, against SciPy."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad, simpson, solve_ivp
from scipy.interpolate import CubicHermiteSpline, CubicSpline, PchipInterpolator
from scipy.optimize import least_squares
from scipy.signal import welch
from support import CHECKOUT, to_scipy

import libloc
from libloc import (
    CarMotion,
    CircleMotion,
    FigureEightMotion,
    HandHeldMotion,
    LookAtMotion,
    MountedMotion,
    PedestrianMotion,
    Pose3,
    Random,
    RestFirstMotion,
    RestMotion,
    WaypointMotion,
)


def yaw_of(q_wxyz):
    return np.unwrap(2 * np.arctan2(q_wxyz[:, 3], q_wxyz[:, 0]))


def test_example_drive_is_the_reference_recording():
    data = Path(os.environ.get("LIBLOC_DATA", CHECKOUT.parent / "shared" / "data"))
    file = data.parent / "reference" / "vio" / "seed1" / "truth.csv"
    if not file.is_file():
        pytest.skip(f"no recording {file} (set LIBLOC_DATA)")
    truth = np.loadtxt(file, delimiter=",", skiprows=1)
    states = WaypointMotion(**libloc.example_drive()).sample(np.ascontiguousarray(truth[:, 0]))
    sign = np.sign(np.sum(states.q_world_body_wxyz * truth[:, 4:8], axis=1, keepdims=True))
    for ours, theirs in [
        (states.position, truth[:, 1:4]),
        (sign * states.q_world_body_wxyz, truth[:, 4:8]),
        (states.velocity, truth[:, 8:11]),
        (states.acceleration, truth[:, 11:14]),
        (states.angular_velocity, truth[:, 14:17]),
    ]:
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12)


def test_path_is_the_clothoid_that_scipy_finds():
    start, end, courses, speeds = np.array([2.0, -1.0]), np.array([41.0, 18.0]), (0.9, -0.4), (7.0, 11.0)

    def place(p, s):
        def integral(f):
            angle = np.polynomial.Polynomial([courses[0], p[0], 0.5 * p[1]])
            return quad(lambda u: f(angle(u)), 0, s, epsabs=1e-13, epsrel=1e-13)[0]

        return start + np.array([integral(np.cos), integral(np.sin)])

    def miss(p):
        turn = p[0] * p[2] + 0.5 * p[1] * p[2] ** 2 - (courses[1] - courses[0])
        return np.append(place(p, p[2]) - end, 10 * turn)

    p = least_squares(miss, [0, 0, np.linalg.norm(end - start)], xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    motion = WaypointMotion(
        [0.0, 5.0],
        [[*start, 0], [*end, 3]],
        [[v * np.cos(c), v * np.sin(c), 0] for v, c in zip(speeds, courses, strict=True)],
    )
    assert motion.length == pytest.approx(p[2], abs=1e-9)
    times = np.linspace(0, 5, 41)
    states = motion.sample(times)
    s = CubicHermiteSpline([0, 5], [0, p[2]], speeds)
    np.testing.assert_allclose(states.position[:, :2], [place(p, u) for u in s(times)], rtol=0, atol=1e-8)
    np.testing.assert_allclose(
        yaw_of(states.q_world_body_wxyz), 0.9 + p[0] * s(times) + 0.5 * p[1] * s(times) ** 2, atol=1e-8
    )
    np.testing.assert_allclose(np.linalg.norm(states.velocity[:, :2], axis=1), s(times, 1), atol=1e-8)
    np.testing.assert_allclose(
        states.position[:, 2], CubicHermiteSpline([0, 5], [0, 3], [0, 0])(times), atol=1e-12
    )


def test_attitude_and_place_follow_from_the_rates():
    """SciPy integrates velocity's size, height's rate and the yaw rate from the start."""
    motion = WaypointMotion(**libloc.example_drive())
    state = np.array([200.0, 0, 0])

    def rates(t, x):
        s = motion.sample(np.array([t]))
        speed = np.linalg.norm(s.velocity[0, :2])
        return [speed * np.cos(x[2]), speed * np.sin(x[2]), s.angular_velocity[0, 2]]

    # Between way-points: the rate jumps there.
    for begin, end in [(20, 25), (25, 44), (44, 46)]:
        eps = 1e-9
        state = solve_ivp(rates, (begin, end - eps), state, rtol=1e-10, atol=1e-10).y[:, -1]
        reached = motion.sample(np.array([end - eps]))
        np.testing.assert_allclose(state[:2], reached.position[0, :2], atol=1e-6)
        np.testing.assert_allclose(state[2], yaw_of(reached.q_world_body_wxyz)[0], atol=1e-7)


def test_without_velocities_distance_and_height_are_pchip():
    times = np.array([0.0, 3, 4, 9, 12, 20])
    angle = np.array([0.0, 0.4, 0.6, 2, 2.1, 4])
    height = np.array([0.0, 2, 2, -1, 3, 3.5])
    motion = WaypointMotion(times, np.column_stack([20 * np.cos(angle), 20 * np.sin(angle), height]))
    t = np.linspace(0, 20, 333)
    states = motion.sample(t)
    pchip = PchipInterpolator(times, height)
    np.testing.assert_allclose(states.position[:, 2], pchip(t), atol=1e-12)
    np.testing.assert_allclose(states.velocity[:, 2], pchip(t, 1), atol=1e-12)
    # Points on a circle: the estimated courses are its tangents, the distance is 20 times the angle.
    pchip = PchipInterpolator(times, 20 * angle)
    np.testing.assert_allclose(yaw_of(states.q_world_body_wxyz) - np.pi / 2, pchip(t) / 20, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(states.velocity[:, :2], axis=1), pchip(t, 1), atol=1e-9)
    np.testing.assert_allclose(motion.courses_rad, angle + np.pi / 2, atol=1e-9)


def test_look_at_is_scipys_not_a_knot_spline():
    rng = np.random.default_rng(1)
    times = np.array([0.0, 1, 1.7, 3, 4.2, 5])
    positions = rng.normal(size=(6, 3))
    look_at = rng.normal(size=(6, 3)) + np.array([8, 2, 0])
    motion = LookAtMotion(times, positions, look_at)
    t = np.linspace(0, 5, 2001)
    states = motion.sample(t)
    camera, point = CubicSpline(times, positions), CubicSpline(times, look_at)
    np.testing.assert_allclose(states.position, camera(t), atol=1e-12)
    np.testing.assert_allclose(states.velocity, camera(t, 1), atol=1e-11)
    np.testing.assert_allclose(states.acceleration, camera(t, 2), atol=1e-10)
    z = point(t) - camera(t)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross(z, [0, 0, 1])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    rotation = to_scipy(states.q_world_body_wxyz)
    np.testing.assert_allclose(rotation.as_matrix(), np.stack([x, np.cross(z, x), z], axis=2), atol=1e-12)
    mean_rate = (rotation[:-2].inv() * rotation[2:]).as_rotvec() / (t[2] - t[0])
    np.testing.assert_allclose(states.angular_velocity[1:-1], mean_rate, atol=1e-4)
    with pytest.raises(ValueError, match=r"at 0\.98.* s: angle between the look direction and up or down = "):
        LookAtMotion([0, 2], [[0, 0, 0], [0, 0, 0]], [[-1, 0, 1], [1, 0, 1]])
    LookAtMotion([0, 2], [[0, 0, 0], [0, 0, 0]], [[-1, 0, 1], [1, 0, 1]], up=[0, 1, 0])


def test_hand_held_stays_in_its_band_and_repeats():
    t = np.arange(0, 200, 0.02)
    mean = Pose3(translation=[1, 2, 3])
    states = HandHeldMotion(Random(5), T_world_mean=mean, scale=0.3).sample(t)
    frequency, power = welch(states.angular_velocity, 50, nperseg=2048, axis=0)
    inside = (frequency > 0.25) & (frequency < 2.1)
    assert power[inside].sum() > 0.99 * power.sum()
    assert np.sqrt(np.mean(np.sum(states.angular_velocity**2, axis=1))) == pytest.approx(0.27, rel=0.05)
    np.testing.assert_allclose(states.position.mean(axis=0), [1, 2, 3], atol=0.02)
    again = HandHeldMotion(Random(5), T_world_mean=mean, scale=0.3).sample(t)
    np.testing.assert_array_equal(states.position, again.position)
    flat = HandHeldMotion(Random(5), rotates=[False, False, True], moves=[True, True, False]).sample(t)
    assert not flat.angular_velocity[:, :2].any() and not flat.position[:, 2].any()
    assert flat.angular_velocity[:, 2].any() and flat.position[:, 0].any()


@pytest.mark.parametrize(
    "motion",
    [
        CarMotion(),
        CarMotion([[4, 8, 1], [2, 8, -1.5], [3, 0, 0.5]], start=[1, 2, 3], course_rad=2, speed_mps=3),
        PedestrianMotion(),
        PedestrianMotion(head_turn_rad=0, bob_m=0.05),
        FigureEightMotion(height_m=3),
        CircleMotion(speed_mps=-3),
        RestFirstMotion(CircleMotion(), rest_s=1, ease_s=2),
        MountedMotion(HandHeldMotion(Random(3)), Pose3(translation=[1, 2, 3])),
    ],
    ids=lambda motion: type(motion).__name__,
)
def test_integrals_of_velocity_and_acceleration(motion):
    end = min(motion.duration_s, 120)
    t = np.linspace(0, end, 60_001)
    states = motion.sample(t)
    for value, rate in [
        (states.position, states.velocity),
        (states.velocity, states.acceleration),
        (states.angular_velocity, states.angular_acceleration),
    ]:
        np.testing.assert_allclose(value[-1] - value[0], simpson(rate, x=t, axis=0), atol=1e-5)
    rotation = to_scipy(states.q_world_body_wxyz)
    step = (rotation[:-1].inv() * rotation[1:]).as_rotvec()
    mean = 0.5 * (states.angular_velocity[1:] + states.angular_velocity[:-1]) * (t[1] - t[0])
    np.testing.assert_allclose(step, mean, atol=1e-7)


def test_car_and_rest():
    car = CarMotion()
    states = car.sample(np.linspace(0, 3, 31))
    for array in (states.velocity, states.acceleration, states.angular_velocity, states.angular_acceleration):
        assert not array.any()
    assert car.duration_s == pytest.approx(91)
    assert RestMotion().duration_s == np.inf
    pose = Pose3([0.6, 0, 0.8, 0], [1, 2, 3])
    states = RestMotion(pose).sample(np.array([0.0, 1e9]))
    np.testing.assert_array_equal(states.position, [[1, 2, 3]] * 2)
    np.testing.assert_allclose(states.q_world_body_wxyz, [[0.6, 0, 0.8, 0]] * 2)


def test_stop_with_a_given_course():
    motion = WaypointMotion(
        [0, 10, 15, 25],
        [[0, 0, 0], [40, 0, 0], [40, 0, 0], [80, 30, 0]],
        courses_rad=[None, 0.3, None, None],
    )
    states = motion.sample(np.array([10.0, 12, 14.9]))
    assert not states.velocity.any() and not states.angular_velocity.any()
    np.testing.assert_allclose(yaw_of(states.q_world_body_wxyz), 0.3)


def test_bad_input():
    drive = libloc.example_drive()
    motion = WaypointMotion(**drive)
    with pytest.raises(ValueError, match=r"time_s = 90\.5: must be in \[0, 90\]"):
        motion.sample(np.array([0.0, 90.5]))
    with pytest.raises(ValueError, match="time_s = nan"):
        motion.sample(np.array([np.nan]))
    with pytest.raises(TypeError, match="times_s must be a NumPy array of float64, not list"):
        motion.sample([0, 1])
    with pytest.raises(ValueError, match=r"positions must have shape \(N, 3\), has \(11, 2\)"):
        WaypointMotion(drive["times_s"], drive["positions"][:, :2])
    with pytest.raises(ValueError, match="number of times_s = 10: must be the number of positions, 11"):
        WaypointMotion(drive["times_s"][:-1], drive["positions"])
    drive["times_s"][4] = 40
    with pytest.raises(ValueError, match=r"times_s\[4\] = 40: must be greater than the one before"):
        WaypointMotion(**drive)
    with pytest.raises(ValueError, match="radius_m = -1"):
        CircleMotion(radius_m=-1)
    with pytest.raises(ValueError, match=r"phases must have shape \(N, 3\), has \(1, 2\)"):
        CarMotion([[1, 2]])
    with pytest.raises(ValueError, match="ease_s = 0: must be positive: the motion does not begin at rest"):
        RestFirstMotion(CircleMotion(), ease_s=0)
    with pytest.raises(TypeError):
        MountedMotion(None, Pose3())
    assert motion.sample(np.empty(0)).position.shape == (0, 3)
