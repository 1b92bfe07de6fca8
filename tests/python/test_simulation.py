"""Simulated recordings: scenarios, models and truth from Python."""

import hashlib
import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import libloc

NAMES = ["circle", "figure-eight", "hand-held", "pedestrian", "rest", "street-car", "vio-example"]


def digest(run):
    h = hashlib.sha256()
    r = run.recording
    for a in (r.imu.angular_velocity, r.imu.specific_force, r.odometry.position, r.gps.velocity_enu):
        h.update(a.tobytes())
    return h.hexdigest()


def test_names_and_unknown_ones():
    assert sorted(libloc.scenario_names()) == NAMES
    with pytest.raises(ValueError, match="'moon' is not known; there are vio-example, street-car"):
        libloc.Scenario("moon")
    with pytest.raises(ValueError, match="duration_s = 91: is longer than the motion, 90 s"):
        libloc.simulate("vio-example", 1, duration_s=91)


def test_example_as_arrays_with_truth():
    began = time.perf_counter()
    run = libloc.simulate("vio-example", seed=3)
    assert time.perf_counter() - began < 30
    imu, vo, truth = run.recording.imu, run.recording.odometry, run.truth
    assert imu.angular_velocity.shape == (6000, 3)
    assert vo.position.shape == (1500, 3)
    assert np.array_equal(imu.times_ns, truth.times_ns)
    assert np.array_equal(vo.times_ns, imu.times_ns[::4])
    assert np.all(vo.start_times_ns == np.iinfo(np.int64).min)
    assert np.array_equal(truth.position, run.recording.reference.position)

    # Specific force and rate of the readings against truth, through SciPy's rotations.
    to_world = Rotation.from_quat(truth.q_world_body_wxyz[:, [1, 2, 3, 0]])
    force = to_world.inv().apply(truth.acceleration + np.array([0, 0, 9.81]))
    noise = imu.specific_force - force
    assert np.allclose(noise.std(axis=0), np.sqrt(0.01**2 * 50 + 0.0024**2 / 12), rtol=0.05)
    assert np.allclose((imu.angular_velocity - truth.angular_velocity).mean(axis=0), np.deg2rad(2), atol=3e-4)
    assert np.allclose(truth.gyroscope_bias, np.deg2rad(2))
    # The model of the example: scale * position + drift + white noise.
    white = vo.position - 2 * truth.position[::4] - truth.odometry_drift[::4]
    assert np.allclose(white.std(), 0.139, rtol=0.05)
    step = truth.odometry_drift[4::4] - (1 - 1 / 232) * truth.odometry_drift[:-4:4]
    assert np.allclose(step.std(), np.sqrt(2 / 232 + 1 / 232**2) * np.sqrt(1.34), rtol=0.06)
    assert np.all(truth.odometry_scale == 2)
    assert np.all(np.isnan(truth.gps_error))


def test_same_seed_same_bytes():
    a = digest(libloc.simulate("street-car", 7, duration_s=3))
    assert a == digest(libloc.simulate(libloc.Scenario("street-car", duration_s=3), 7))
    assert a != digest(libloc.simulate("street-car", 8, duration_s=3))


def test_parameters_by_name_and_models_as_objects():
    s = libloc.Scenario("vio-example", duration_s=2, parameters={"imu.sampling": "interval-mean"})
    assert s.imu.sampling == libloc.ImuSampleModel.INTERVAL_MEAN
    s.set("gps.outages", [[0.5, 1.5]])
    assert s.gps.outages == [(0.5, 1.5)]
    s.set("streams.gps", True)
    s.set("imu.gyroscope.constant_bias", np.array([0.1, 0.2, 0.3]))
    assert np.array_equal(s.imu.gyroscope.constant_bias, [0.1, 0.2, 0.3])
    s.set("odometry.latency_s", 0.2)
    s.set("camera.max_features", 40)
    assert s.parameters()["camera.max_features"] == "40"
    s.gps = libloc.GpsModel.rtk()
    s.gps.outages = [(0.5, 1.5)]
    s.imu.accelerometer.noise_density = 0
    run = libloc.simulate(s, 1)
    assert np.all(
        np.isin(run.recording.gps.times_ns - s.start_time_ns, np.array([0, 2, 4, 16, 18]) * 100_000_000)
    )
    assert np.all(run.recording.gps.fix == libloc.GpsFixType.FIXED)
    assert run.recording.counts["gps.none"] == 5
    with pytest.raises(ValueError, match=r"did you mean odometry\.latency_s"):
        s.set("vo.latency_s", 1)
    with pytest.raises(TypeError, match="a parameter is a number"):
        s.set("odometry.latency_s", object())
    with pytest.raises(ValueError, match=r"imu\.rate_hz = 0"):
        s.imu.rate_hz = 0
        libloc.simulate(s, 1)


def test_own_models():
    s = libloc.Scenario("circle", duration_s=1)
    s.imu = libloc.ImuModel.perfect(100)
    s.odometry = libloc.VisualOdometryModel.perfect()
    s.odometry.relative = True
    s.magnetometer = libloc.MagnetometerModel()
    s.magnetometer.sigma = 0
    s.magnetometer.add_disturbance(0.5, 0.7, [1e-5, 0, 0])
    s.magnetometer.add_dipole([100, 0, 0], [0, 0, 1])
    run = libloc.simulate(s, 1)
    assert np.all(run.recording.odometry.times_ns - run.recording.odometry.start_times_ns == 40_000_000)
    assert np.allclose(run.truth.gyroscope_bias, 0)
    strength = np.linalg.norm(run.recording.magnetometer.magnetic_field, axis=1)
    disturbed = np.abs(strength - strength[0]) > 1e-7
    assert np.array_equal(np.flatnonzero(disturbed), np.arange(25, 35))


def test_one_by_one_in_order_of_arrival():
    s = libloc.Scenario("vio-example", duration_s=1, parameters={"odometry.latency_s": 0.1})
    source = libloc.Simulation(s, 1, order="arrival")
    got = list(source)
    arrivals = [m.host_time_ns for m in got]
    assert arrivals == sorted(arrivals)
    odometry = [m for m in got if isinstance(m, libloc.OdometryMeasurement)]
    assert all(m.host_time_ns - m.time_ns == 100_000_000 for m in odometry)
    assert len(source.truth().times_ns) == 100
    assert source.counts()["odometry.made"] == 25
    with pytest.raises(ValueError, match="order = 'size'"):
        libloc.Simulation(s, 1, order="size")


def test_rig_and_features():
    s = libloc.Scenario("street-car", duration_s=1)
    rig = s.rig()
    assert len(rig.cameras) == 1
    assert rig.imu.noise.gyroscope_noise_density == s.imu.gyroscope.noise_density
    run = libloc.simulate(s, 2)
    f = run.recording.features
    assert len(f.times_ns) == 20
    assert f.first[-1] == len(f.id) > 400
