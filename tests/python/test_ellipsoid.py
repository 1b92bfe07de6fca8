"""Ellipsoid fits from Python, against NumPy and SciPy."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from support import data_folder

import libloc


def simulated(seed: int, count: int = 500, offset: float = 0.6, noise: float = 0.005, radius: float = 48e-6):
    rng = np.random.default_rng(seed)
    directions = rng.standard_normal((count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    soft = np.diag(1 + rng.uniform(-0.15, 0.15, 3))
    for i, j in ((0, 1), (0, 2), (1, 2)):
        soft[i, j] = soft[j, i] = rng.uniform(-0.05, 0.05)
    centre = rng.standard_normal(3)
    centre *= offset * radius / np.linalg.norm(centre)
    readings = centre + radius * (directions @ soft + noise * rng.standard_normal((count, 3)))
    return np.ascontiguousarray(readings), centre, soft, directions


def orthogonal_fit(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least squares of the norm by SciPy: centre, and matrix for norm 1."""

    def unpack(p):
        return p[:3], np.array([[p[3], p[6], p[7]], [p[6], p[4], p[8]], [p[7], p[8], p[5]]])

    scale = np.linalg.norm(x - x.mean(0), axis=1).mean()
    z = x / scale

    def residual(p):
        c, w = unpack(p)
        y = (z - c) @ w
        length = np.linalg.norm(y, axis=1)
        return (length - 1) * length / np.linalg.norm(y @ w, axis=1)

    solution = least_squares(residual, np.r_[z.mean(0), 1, 1, 1, 0, 0, 0], xtol=1e-14, ftol=1e-14)
    c, w = unpack(solution.x)
    return c * scale, w / scale


def test_without_loss_and_prior_it_is_the_least_squares_of_scipy():
    readings, *_ = simulated(1)
    centre, matrix = orthogonal_fit(readings)
    options = libloc.EllipsoidOptions(shape_prior_sigma=0, tukey_c=1e6, reference_norm=1)
    fit = libloc.fit_ellipsoid(readings, options)
    np.testing.assert_allclose(fit.centre, centre, atol=1e-6 * 48e-6)
    np.testing.assert_allclose(fit.matrix, matrix, rtol=1e-5, atol=1e-5 * matrix.max())


@pytest.mark.parametrize("method", ["lsq", "robust", "als"])
def test_truth_is_recovered_within_its_covariance(method):
    readings, centre, soft, _ = simulated(2)
    fit = libloc.fit_ellipsoid(readings, libloc.EllipsoidOptions(method=method, reference_norm=48e-6))
    assert fit.method == method
    assert fit.quality.verdict == libloc.Verdict.OK
    error = np.r_[
        fit.centre - centre, (fit.matrix - np.linalg.inv(soft))[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    ]
    sigma = np.sqrt(np.diag(fit.cov))
    assert np.all(np.abs(error) < 4 * sigma)
    corrected = (readings - fit.centre) @ fit.matrix.T
    np.testing.assert_allclose(
        np.std(np.linalg.norm(corrected, axis=1)) / np.mean(np.linalg.norm(corrected, axis=1)),
        fit.norm_variation_after,
        rtol=1e-9,
    )
    triad = fit.triad()
    np.testing.assert_array_equal(triad.bias, fit.centre)
    np.testing.assert_array_equal(triad.matrix, fit.matrix)
    assert triad.quality.method == method
    np.testing.assert_allclose(triad.quality.bias_sigma, sigma[:3])
    assert fit.coverage.sum() == 500
    assert fit.cells_hit == np.count_nonzero(fit.coverage)


def test_refusals_say_why():
    fit = libloc.fit_ellipsoid(np.zeros((100, 3)))
    assert not fit.is_ellipsoid
    assert fit.quality.verdict == libloc.Verdict.REFUSED
    assert fit.quality.reasons
    with pytest.raises(libloc.DataError, match="same"):
        fit.triad()
    with pytest.raises(ValueError, match="lsq, robust, als or sphere"):
        libloc.EllipsoidOptions(method="magic")
    with pytest.raises(TypeError, match="readings"):
        libloc.fit_ellipsoid([[1, 2, 3]])
    with pytest.raises(ValueError, match="weights"):
        libloc.fit_ellipsoid(np.zeros((100, 3)), weights=np.ones(99))


def test_collector_keeps_what_was_seen_and_advises():
    readings, *_ = simulated(3, count=3000)
    collector = libloc.EllipsoidCollector()
    assert collector.advice(collector.fit()).text == "No readings yet."
    for reading in readings[:1500]:
        assert collector.add(reading)
    for _ in range(10_000):
        collector.add(readings[0])  # the device is put down
    fit = collector.fit()
    assert collector.advice(fit).enough
    assert fit.cells_hit > 90
    assert len(collector.kept) <= 2000
    assert collector.received == 11_500
    assert not collector.add([np.nan, 0, 0])


def test_raw_magnetometer_far_off_centre():
    folder = data_folder("magnetometer")
    raw = np.loadtxt(folder / "jremington_mag3_raw.csv", delimiter=",")
    fit = libloc.fit_ellipsoid(np.ascontiguousarray(raw[:, :3]))
    assert fit.centre_over_radius == pytest.approx(4.4, abs=0.1)
    assert fit.norm_variation_after < 0.02 < fit.norm_variation_before
