"""core/ against NumPy and SciPy."""

import numpy as np
import pytest
from scipy import stats

import libloc


def test_random_repeats_and_forks_are_independent():
    assert np.array_equal(libloc.Random(7).normal3(5), libloc.Random(7).normal3(5))
    assert not np.array_equal(libloc.Random(7).normal3(5), libloc.Random(8).normal3(5))
    parent = libloc.Random(7)
    assert not np.array_equal(parent.fork(1).normal3(5), parent.fork(2).normal3(5))


def test_random_shapes_and_distributions():
    random = libloc.Random(3)
    assert random.normal3().shape == (3,)
    assert random.rotation().shape == (4,)
    samples = random.normal3(20000)
    assert samples.shape == (20000, 3)
    assert stats.kstest(samples.ravel(), "norm").pvalue > 1e-3
    directions = random.direction(5000)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1)
    assert stats.kstest(directions[:, 2], stats.uniform(-1, 2).cdf).pvalue > 1e-3
    uniform = np.array([random.uniform(2, 5) for _ in range(5000)])
    assert stats.kstest(uniform, stats.uniform(2, 3).cdf).pvalue > 1e-3
    with pytest.raises(ValueError, match="count = -1"):
        random.normal3(-1)


@pytest.mark.parametrize("dof", [1, 2, 3, 15, 400])
def test_chi_square_is_scipys(dof):
    for probability in (0.0, 1e-6, 0.05, 0.5, 0.95, 0.999):
        quantile = libloc.chi_square_quantile(probability, dof)
        assert quantile == pytest.approx(stats.chi2.ppf(probability, dof), rel=1e-9, abs=1e-12)
        assert libloc.chi_square_cdf(quantile, dof) == pytest.approx(probability, abs=1e-12)


def test_statistics_are_numpys():
    values = np.random.default_rng(1).normal(size=101)
    assert libloc.root_mean_square(values) == pytest.approx(np.sqrt(np.mean(values**2)), rel=1e-14)
    for probability in (0, 0.1, 0.5, 0.977, 1):
        assert libloc.quantile(values, probability) == pytest.approx(
            np.quantile(values, probability), rel=1e-14
        )


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: libloc.chi_square_quantile(1.5, 3), ValueError, "1.5"),
        (lambda: libloc.root_mean_square(np.empty(0)), ValueError, "no values"),
        (lambda: libloc.root_mean_square([1.0, 2.0]), TypeError, "values must be a NumPy array"),
        (
            lambda: libloc.root_mean_square(np.ones((2, 2))),
            ValueError,
            r"values must have shape \(N,\), has \(2, 2\)",
        ),
        (
            lambda: libloc.root_mean_square(np.ones(3, dtype=">f8")),
            TypeError,
            "values must have dtype float64",
        ),
        (lambda: libloc.parse_seconds("12 s"), ValueError, "12 s"),
    ],
)
def test_callers_mistakes(call, error, text):
    with pytest.raises(error, match=text):
        call()


def test_times_are_exact():
    assert libloc.parse_seconds("1403715274.302143123") == 1403715274302143123
    assert libloc.format_seconds(-1) == "-0.000000001"
