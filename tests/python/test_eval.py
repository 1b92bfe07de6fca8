"""eval/ against NumPy's SVD, SciPy and evo, the latter on the trajectories in data/."""

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation
from support import CHECKOUT, to_wxyz

import libloc
from libloc import DataError, Trajectory

DATA = CHECKOUT / "tests/python/data"
RNG = np.random.default_rng(4)


def umeyama(estimate, reference, with_scale):
    """Umeyama 1991, with NumPy's SVD: the second opinion."""
    e, r = estimate - estimate.mean(0), reference - reference.mean(0)
    u, d, vt = np.linalg.svd(r.T @ e / len(e))
    s = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    rotation = u @ s @ vt
    scale = np.trace(np.diag(d) @ s) / (e**2).sum(1).mean() if with_scale else 1.0
    return rotation, scale, reference.mean(0) - scale * rotation @ estimate.mean(0)


@pytest.mark.parametrize(("mode", "with_scale"), [("se3", False), ("sim3", True)])
def test_alignment_is_umeyamas(mode, with_scale):
    estimate = RNG.normal(size=(40, 3))
    truth = Rotation.random(rng=9)
    reference = 2.5 * truth.apply(estimate) + [1, 2, 3] + 0.1 * RNG.normal(size=(40, 3))
    rotation, scale, translation = umeyama(estimate, reference, with_scale)
    alignment = libloc.align_points(estimate, reference, mode)
    assert alignment.ok
    assert np.allclose(alignment.T_reference_estimate.matrix()[:3, :3], rotation, atol=1e-12)
    assert np.allclose(alignment.T_reference_estimate.translation, translation, atol=1e-12)
    assert alignment.scale == pytest.approx(scale, rel=1e-12)
    residual = reference - (scale * estimate @ rotation.T + translation)
    assert alignment.rms_residual == pytest.approx(np.sqrt((residual**2).sum(1).mean()), rel=1e-12)


def test_alignment_that_the_points_do_not_determine():
    line = np.outer(np.arange(5.0), [1, 2, 3])
    alignment = libloc.align_points(line, line)
    assert not alignment.ok
    assert "line" in alignment.failure
    with pytest.raises(ValueError, match="alignment = 'affine': must be"):
        libloc.align_points(line, line, "affine")


@pytest.fixture(scope="module")
def pair():
    (estimate, _), (reference, _) = (
        libloc.read_tum(DATA / "estimate.tum"),
        libloc.read_tum(DATA / "reference.tum"),
    )
    return libloc.associate(estimate, reference)


@pytest.fixture(scope="module")
def evo_pair():
    from evo.core import sync
    from evo.tools import file_interface

    reference = file_interface.read_tum_trajectory_file(str(DATA / "reference.tum"))
    estimate = file_interface.read_tum_trajectory_file(str(DATA / "estimate.tum"))
    return sync.associate_trajectories(reference, estimate, max_diff=0.01)


def same_statistics(ours, evos, scale=1.0):
    for name in ("rmse", "mean", "median", "std", "min", "max"):
        assert scale * getattr(ours, name) == pytest.approx(evos[name], abs=1e-6), name
    assert scale**2 * ours.sse == pytest.approx(evos["sse"], abs=1e-6 * max(1, evos["sse"]))


@pytest.mark.parametrize("mode", ["none", "se3", "sim3"])
def test_absolute_error_is_evos(pair, evo_pair, mode):
    from evo.core import metrics

    reference, estimate = (__import__("copy").deepcopy(t) for t in evo_pair)
    if mode != "none":
        estimate.align(reference, correct_scale=mode == "sim3")
    ours = libloc.absolute_error(pair.estimate, pair.reference, mode)
    for relation, statistics, scale in (
        (metrics.PoseRelation.translation_part, ours.translation, 1.0),
        (metrics.PoseRelation.rotation_angle_deg, ours.rotation, np.rad2deg(1)),
    ):
        ape = metrics.APE(relation)
        ape.process_data((reference, estimate))
        same_statistics(statistics, ape.get_all_statistics(), scale)


@pytest.mark.parametrize(
    ("delta", "unit", "all_pairs"), [(1, "frames", False), (7, "frames", True), (1.5, "metres", False)]
)
def test_relative_error_is_evos(pair, evo_pair, delta, unit, all_pairs):
    from evo.core import metrics

    ours = libloc.relative_error(pair.estimate, pair.reference, delta=delta, unit=unit, all_pairs=all_pairs)
    evo_unit = {"frames": metrics.Unit.frames, "metres": metrics.Unit.meters}[unit]
    for relation, statistics, scale in (
        (metrics.PoseRelation.translation_part, ours.translation, 1.0),
        (metrics.PoseRelation.rotation_angle_deg, ours.rotation, np.rad2deg(1)),
    ):
        rpe = metrics.RPE(relation, delta, evo_unit, all_pairs=all_pairs)
        rpe.process_data(evo_pair)
        same_statistics(statistics, rpe.get_all_statistics(), scale)


def test_orientation_error_is_broads():
    truth, error = Rotation.random(100, rng=3), Rotation.from_rotvec(RNG.normal(size=(100, 3)) * 0.1)
    mask = RNG.random(100) < 0.7
    e = libloc.orientation_error(to_wxyz(error * truth), to_wxyz(truth), mask)
    w, z = np.abs(error.as_quat()[:, 3]), error.as_quat()[:, 2]
    assert np.allclose(e.total, error.magnitude(), atol=1e-12)
    assert np.allclose(e.heading, 2 * np.arctan2(np.abs(z), w), atol=1e-12)
    assert np.allclose(e.inclination, 2 * np.arccos(np.sqrt(w**2 + z**2)), atol=1e-7)
    assert e.total_rmse == pytest.approx(np.sqrt(np.mean(error.magnitude()[mask] ** 2)), rel=1e-12)
    assert (e.scored, e.masked) == (mask.sum(), (~mask).sum())
    # A common turn about z is what align_heading removes.
    turned = Rotation.from_rotvec([0, 0, 1.0]) * error * truth
    aligned = libloc.orientation_error(to_wxyz(turned), to_wxyz(truth), mask, align_heading=True)
    assert aligned.heading_offset == pytest.approx(1.0, abs=0.05)
    assert aligned.heading_rmse <= e.heading_rmse + 1e-12


def test_unknown_orientations_are_left_out_and_counted():
    q = to_wxyz(Rotation.random(10, rng=3))
    hole = q.copy()
    hole[3] = np.nan
    e = libloc.orientation_error(hole, q)
    assert (e.scored, e.estimate_not_finite) == (9, 1)
    assert np.isnan(e.total[3])
    with pytest.raises(DataError):
        libloc.orientation_error(hole, q, np.arange(10) == 3)
    with pytest.raises(TypeError, match="mask must have dtype bool, has int64"):
        libloc.orientation_error(q, q, np.ones(10, int))
    with pytest.raises(ValueError, match=r"mask must have as many rows as estimate_wxyz \(10\), has 3"):
        libloc.orientation_error(q, q, np.ones(3, bool))


def test_consistency_is_chi_square():
    covariance = np.array([[2, 0.5, 0], [0.5, 1, 0.1], [0, 0.1, 3]])
    errors = RNG.multivariate_normal(np.zeros(3), covariance, 200)
    values = np.array([libloc.normalised_error_squared(e, covariance) for e in errors])
    assert np.allclose(
        values, np.einsum("ni,ij,nj->n", errors, np.linalg.inv(covariance), errors), rtol=1e-12
    )
    c = libloc.average_consistency(values, 3)
    assert c.lower == pytest.approx(stats.chi2.ppf(0.025, 600) / 200, rel=1e-9)
    assert c.upper == pytest.approx(stats.chi2.ppf(0.975, 600) / 200, rel=1e-9)
    assert c.consistent
    assert libloc.average_consistency(2 * values, 3).optimistic
    with pytest.raises(ValueError):
        libloc.normalised_error_squared([1, 2, 3], -covariance)


def test_trajectory_checks_its_poses():
    times, q, p = np.arange(3), np.tile([1.0, 0, 0, 0], (3, 1)), np.zeros((3, 3))
    trajectory = Trajectory(times, q, p)
    assert len(trajectory) == 3
    assert trajectory.pose_at(1).translation.tolist() == [0, 0, 0]
    assert trajectory.pose_at(7) is None
    with pytest.raises(DataError, match="2"):
        Trajectory(np.array([0, 2, 2]), q, p)
    with pytest.raises(DataError, match="1"):
        Trajectory(times, q * [[1], [2], [1]], p)
    with pytest.raises(ValueError, match=r"position must have as many rows as times_ns \(3\), has 2"):
        Trajectory(times, q, p[:2])
