"""calib/ of inertial sensors from Python, against NumPy and SciPy."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from support import data_folder

import libloc
from libloc import DataError, Verdict

GRAVITY = 9.80665
RATE = 100.0


def numpy_stillness(times_s, gyro, accel, window=50):
    """Rows whose window is quieter than three times the quietest tenth: a rough second opinion."""
    still = np.ones(len(times_s), bool)
    for x in (gyro, accel):
        view = np.lib.stride_tricks.sliding_window_view(x, window, axis=0)
        variance = view.var(axis=-1).sum(axis=-1)
        quiet = variance < 3 * np.quantile(variance, 0.1)
        still &= np.pad(quiet, (window // 2, len(x) - len(quiet) - window // 2), mode="edge")
    return still


def poses_recording(seed=1, poses=16, rest=300, turn=200):
    """Raw counts of a device put down in poses, turned about constant axes in between."""
    rng = np.random.default_rng(seed)
    gyro_matrix = np.array([[1 / 4780, 2e-6, 0], [-1e-6, 1 / 4830, 2e-6], [1e-6, 0, 1 / 4750]])
    gyro_bias = np.array([32768.0, 32466.0, 32485.0])
    accel_matrix = np.diag([1 / 415, 1 / 413, 1 / 416])
    accel_bias = np.array([33124.0, 33275.0, 32364.0])
    q = Rotation.random(rng=rng)
    rates, attitudes = [], []
    phase = np.arange(turn) / turn
    profile = np.sin(np.pi * phase) ** 2
    for k in range(poses + 1):
        rates += [np.zeros(3)] * rest
        attitudes += [q] * rest
        if k == poses:
            break
        axis = rng.standard_normal(3)
        axis *= rng.uniform(1.5, 4) / np.linalg.norm(axis)
        for p, s in zip(phase, profile, strict=True):
            # Integral of the profile: exact, as the axis stays.
            angle = p / 2 - np.sin(2 * np.pi * p) / (4 * np.pi)
            rates.append(axis * s / (turn / RATE))
            attitudes.append(q * Rotation.from_rotvec(axis * angle))
        q = q * Rotation.from_rotvec(axis / 2)
    force = Rotation.concatenate(attitudes).inv().apply([0, 0, GRAVITY])
    rates = np.array(rates)
    gyro = rates @ np.linalg.inv(gyro_matrix).T + gyro_bias + 29 * rng.standard_normal(rates.shape)
    accel = force @ np.linalg.inv(accel_matrix).T + accel_bias + 3.5 * rng.standard_normal(rates.shape)
    times = (np.arange(len(rates)) * 10_000_000).astype(np.int64)
    truth = {"Mg": gyro_matrix, "bg": gyro_bias, "Ma": accel_matrix, "ba": accel_bias, "q": attitudes}
    return times, gyro, accel, truth


@pytest.fixture(scope="module")
def recording():
    return poses_recording()


@pytest.fixture(scope="module")
def stillness(recording):
    times, gyro, accel, _ = recording
    return libloc.find_stillness(times, gyro, accel)


def test_stillness(recording, stillness):
    times, gyro, accel, _ = recording
    assert len(stillness.segments) == 17
    assert stillness.quality.verdict == Verdict.OK
    assert stillness.rate_hz == pytest.approx(100)
    rough = numpy_stillness(times * 1e-9, gyro, accel)
    found = np.zeros(len(times), bool)
    for s in stillness.segments:
        found[s.begin : s.end] = True
        assert s.samples == s.end - s.begin
        assert s.start_ns == times[s.begin]
        assert s.end_ns == times[s.end - 1]
        assert np.allclose(s.accelerometer_mean, accel[s.begin : s.end].mean(0), rtol=1e-12)
        assert np.allclose(s.gyroscope_cov, np.cov(gyro[s.begin : s.end].T), rtol=1e-9)
    assert (rough == found).mean() > 0.97
    assert np.allclose(np.sqrt(stillness.gyroscope.variance), 29, rtol=0.1)
    alone = libloc.find_stillness(times, None, accel)
    assert np.isnan(alone.segments[0].gyroscope_mean).all()


def test_stillness_arguments(recording):
    times, gyro, _, _ = recording
    with pytest.raises(ValueError, match="accelerometer must have"):
        libloc.find_stillness(times, gyro, gyro[:5])
    with pytest.raises(TypeError, match="gyroscope must have dtype float64"):
        libloc.find_stillness(times, gyro.astype(np.float32), None)
    with pytest.raises(ValueError, match="both absent"):
        libloc.find_stillness(times, None, None)
    with pytest.raises(ValueError, match="window_s = -1"):
        libloc.StillnessOptions(window_s=-1)
    nothing = libloc.find_stillness(times[:0], gyro[:0], None)
    assert nothing.quality.verdict == Verdict.REFUSED


def test_detector_sample_by_sample(recording, stillness):
    times, gyro, accel, _ = recording
    detector = libloc.StillnessDetector(
        stillness.gyroscope, stillness.accelerometer, stillness.rate_hz, stillness.window_samples
    )
    states = [detector.update(int(times[i]), gyro[i], accel[i]) for i in range(1000)]
    assert states[280]
    assert not any(states[330:480])
    assert states[780]
    assert detector.rejected == 0
    assert detector.update(int(times[5]), gyro[5], accel[5]) == states[-1]
    assert detector.rejected == 1


def test_accelerometer_is_scipys_minimum(recording, stillness):
    *_, truth = recording
    fit = libloc.fit_accelerometer(stillness.segments)
    assert fit.solved
    assert fit.inlier.all()
    assert np.allclose(fit.triad.bias, truth["ba"], atol=4)
    assert np.allclose(fit.triad.matrix * 415, truth["Ma"] * 415, atol=2e-3)
    means = np.array([s.accelerometer_mean for s in stillness.segments])

    def residual(p):
        m = np.array([[p[3], p[6], p[7]], [p[6], p[4], p[8]], [p[7], p[8], p[5]]])
        return np.linalg.norm((means - 33000 - p[:3]) @ m / 400, axis=1) - GRAVITY

    start, scale = [0, 0, 0, 1, 1, 1, 0, 0, 0], [100] * 3 + [1] * 6
    scipy = least_squares(residual, start, x_scale=scale, xtol=1e-15, ftol=1e-15)
    # Equal weights: all poses have the same length here, to a few samples.
    plain = libloc.fit_accelerometer_poses(means)
    assert np.allclose(plain.triad.bias, 33000 + scipy.x[:3], atol=1e-3)
    assert np.allclose(np.diag(plain.triad.matrix), scipy.x[3:6] / 400, rtol=1e-7)
    assert np.allclose(plain.residuals, residual(scipy.x), atol=1e-7)
    assert plain.residual_rms == pytest.approx(np.sqrt(np.mean(plain.residuals**2)))
    assert plain.leave_one_out_rms > plain.residual_rms
    dof = len(means) - 9
    cov = np.linalg.inv(scipy.jac.T @ scipy.jac) * 2 * scipy.cost / dof
    assert np.allclose(np.sqrt(np.diag(plain.cov))[:3], np.sqrt(np.diag(cov))[:3], rtol=1e-2)
    assert plain.triad.quality.method == "still-poses"


def test_accelerometer_verdicts():
    rng = np.random.default_rng(5)
    directions = rng.standard_normal((8, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    few = libloc.fit_accelerometer_poses(directions)
    assert few.quality.verdict == Verdict.REFUSED
    assert not few.solved
    assert "at least 9" in few.quality.reasons[0]
    with pytest.raises(ValueError, match="gravity = 0"):
        libloc.AccelerometerOptions(gravity=0)
    with pytest.raises(ValueError, match="sigmas"):
        libloc.fit_accelerometer_poses(directions, np.ones(3))


def test_gyroscope(recording, stillness):
    times, gyro, _, truth = recording
    accelerometer = libloc.fit_accelerometer(stillness.segments)
    fit = libloc.fit_gyroscope(times, gyro, stillness.segments, accelerometer)
    assert fit.matrix_known
    assert len(fit.turn_residuals) == 16
    assert np.allclose(fit.triad.bias, truth["bg"], atol=4 * np.sqrt(fit.bias_cov.diagonal()))
    error = (fit.triad.matrix - truth["Mg"]).ravel()
    nees = error @ np.linalg.solve(fit.cov, error)
    assert nees < 27.9  # 99.9 % of chi-square with 9 degrees of freedom
    # The same carried by SciPy: gravity after each turn.
    segments = stillness.segments
    for k in range(3):
        a, b = segments[k], segments[k + 1]
        rate = (gyro[a.end - 1 : b.begin + 1] - fit.triad.bias) @ fit.triad.matrix.T
        turn = Rotation.identity()
        for step in (rate[:-1] + rate[1:]) / 2 / RATE:
            turn = turn * Rotation.from_rotvec(step)
        before, after = (
            accelerometer.triad.matrix @ (s.accelerometer_mean - accelerometer.triad.bias) for s in (a, b)
        )
        carried = turn.inv().apply(before)
        angle = np.arccos(carried @ after / np.linalg.norm(carried) / np.linalg.norm(after))
        assert angle == pytest.approx(fit.turn_residuals[k], abs=1e-3)
    bias = libloc.fit_gyroscope_bias(segments)
    assert not bias.matrix_known
    assert np.array_equal(bias.triad.bias, fit.triad.bias)


def overlapping_allan(x, m):
    """By the definition: half the mean square of the difference of neighbouring means."""
    means = np.convolve(x, np.full(m, 1 / m), mode="valid")
    return np.sqrt(0.5 * np.mean((means[m:] - means[:-m]) ** 2))


def test_allan_is_the_definition():
    rng = np.random.default_rng(3)
    x = 0.1 * rng.standard_normal(5000) + 5e-3 * np.cumsum(rng.standard_normal(5000))
    fit = libloc.allan_fit(x, 50.0)
    expected = [overlapping_allan(x, round(t * 50)) for t in fit.tau_s]
    assert np.allclose(fit.deviation, expected, rtol=1e-9)
    assert fit.noise_density.identified
    assert fit.noise_density.value == pytest.approx(0.1 / np.sqrt(50), rel=0.1)
    assert fit.random_walk.value == pytest.approx(5e-3 * np.sqrt(50), rel=0.4)


def test_allan_against_allantools():
    allantools = pytest.importorskip("allantools")
    rng = np.random.default_rng(4)
    x = rng.standard_normal(4000)
    fit = libloc.allan_fit(x, 20.0)
    taus, deviation, _, _ = allantools.oadev(x, rate=20.0, data_type="freq", taus=fit.tau_s)
    assert np.allclose(taus, fit.tau_s)
    assert np.allclose(deviation, fit.deviation, rtol=1e-9)


def test_noise_for_the_estimators():
    rng = np.random.default_rng(6)
    n = 30_000
    times = (np.arange(n) * 10_000_000).astype(np.int64)
    gyro = 2e-3 * rng.standard_normal((n, 3))
    accel = [0, 0, GRAVITY] + 2e-2 * rng.standard_normal((n, 3))
    allan = libloc.analyse_imu_noise(times, gyro, accel)
    assert (allan.begin, allan.end) == (0, n)
    fit = libloc.imu_noise_from(allan)
    assert fit.noise.gyroscope_noise_density == pytest.approx(2e-4, rel=0.02)
    assert fit.noise.accelerometer_noise_density == pytest.approx(2e-3, rel=0.02)
    assert fit.measured == ["gyroscope_noise_density", "accelerometer_noise_density"]
    assert fit.quality.verdict == Verdict.FAIR
    assert libloc.analyse_imu_noise(times, gyro, None).accelerometer == []
    with pytest.raises(DataError, match="value 7 = nan"):
        libloc.allan_fit(np.where(np.arange(100) == 7, np.nan, 1.0), 10.0)


def test_magnetometer_alignment(recording):
    times, gyro, accel, truth = recording
    rng = np.random.default_rng(8)
    rate = (gyro - truth["bg"]) @ truth["Mg"].T
    force = (accel - truth["ba"]) @ truth["Ma"].T
    field = Rotation.concatenate(truth["q"]).inv().apply([0.0, 20e-6, -44e-6])
    mount = Rotation.from_euler("xyz", [20, -40, 70], degrees=True)
    readings = np.ascontiguousarray(mount.apply(field) + 2e-7 * rng.standard_normal(field.shape))
    options = libloc.MagnetometerAlignmentOptions(expected_dip=1.1)
    a = libloc.align_magnetometer(times, rate, force, readings, options)
    assert a.solved
    assert a.mirror_checked
    assert not a.mirrored
    error = (Rotation.from_matrix(a.matrix) * mount).magnitude()
    assert error < 3 * a.sigma
    assert error < np.radians(0.3)
    assert a.dip == pytest.approx(np.arctan2(44, 20), abs=np.radians(0.2))
    calibration = libloc.aligned(libloc.TriadCalibration(), a)
    assert np.allclose(calibration.matrix, a.matrix)
    mirrored = libloc.align_magnetometer(times, rate, force, readings * [1, 1, -1], options)
    assert mirrored.mirrored
    assert np.linalg.det(mirrored.matrix) == pytest.approx(-1)
    still = libloc.align_magnetometer(times[:300], rate[:300], force[:300], readings[:300], options)
    assert still.quality.verdict == Verdict.REFUSED
    nothing = libloc.align_magnetometer(times[:5], rate[:5], None, readings[:5])
    with pytest.raises(DataError, match="not solved"):
        libloc.aligned(libloc.TriadCalibration(), nothing)


def test_xsens_raw_counts():
    folder = data_folder("imu-tk-xsens")
    a, g = np.loadtxt(folder / "xsens_acc.mat"), np.loadtxt(folder / "xsens_gyro.mat")
    times = np.rint(a[:, 0] * 1e9).astype(np.int64)
    gyro, accel = np.ascontiguousarray(g[:, 1:]), np.ascontiguousarray(a[:, 1:])
    still = libloc.find_stillness(times, gyro, accel)
    fit = libloc.fit_accelerometer(still.segments)
    milli_g = GRAVITY * 1e-3
    assert fit.residual_rms <= 0.11 * milli_g
    assert fit.leave_one_out_rms <= 0.16 * milli_g
    turns = libloc.fit_gyroscope(times, gyro, still.segments, fit)
    assert turns.matrix_known
    assert np.allclose(1 / np.diag(turns.triad.matrix), 4772, atol=24)
