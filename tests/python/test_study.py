"""loc-study: its statistics against SciPy, and the visual-inertial study with few seeds and seconds."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from libloc.programs import study, study_statistics, study_vio_plots, study_vio_rows, study_vio_run
from scipy import stats
from scipy.spatial.transform import Rotation
from support import to_scipy, to_wxyz

import libloc

RNG = np.random.default_rng(3)
SMALL = ["vio", "--seeds", "2", "--duration", "4"]


def test_normalised_squares_are_chi_square() -> None:
    covariance = np.array([np.cov(RNG.normal(size=(4, 50))) for _ in range(3000)])
    errors = np.array([RNG.multivariate_normal(np.zeros(4), c) for c in covariance])
    values = study_statistics.normalised_squares(errors, covariance)
    expected = [e @ np.linalg.solve(c, e) for e, c in zip(errors, covariance, strict=True)]
    np.testing.assert_allclose(values, expected, rtol=1e-9)
    assert stats.kstest(values, stats.chi2(4).cdf).pvalue > 1e-3
    with pytest.raises(ValueError, match="positive definite"):
        study_statistics.normalised_squares(np.ones((1, 2)), np.array([[[1.0, 2], [2, 1]]]))


def test_consistency_over_time() -> None:
    runs, dof = 30, 19
    values = RNG.chisquare(dof, size=(runs, 400))
    result = study_statistics.consistency_over_time(values, dof)
    lower, upper = stats.chi2(runs * dof).ppf([0.025, 0.975]) / runs
    assert result.lower == pytest.approx(lower, rel=1e-9) and result.upper == pytest.approx(upper, rel=1e-9)
    average = values.mean(axis=0)
    np.testing.assert_allclose(result.average, average)
    assert result.share_inside == np.mean((average >= lower) & (average <= upper))
    assert 0.9 < result.share_inside < 0.99
    assert result.inside and result.overall == pytest.approx(values.mean())
    assert result.overall_standard_error == pytest.approx(stats.sem(values.mean(axis=1)))
    too_small = study_statistics.consistency_over_time(1.3 * values, dof)
    assert not too_small.inside and too_small.share_inside < 0.2


def test_summaries() -> None:
    values = np.array([3.0, np.nan, 1.0, 2.0])
    result = study_statistics.summarise(values)
    assert result is not None
    assert (result.runs, result.mean, result.minimum, result.maximum) == (3, 2, 1, 3)
    assert result.standard_error == pytest.approx(stats.sem([3, 1, 2]))
    assert study_statistics.summarise(np.array([np.nan])) is None
    one = study_statistics.summarise(np.array([5.0]))
    assert one is not None and one.standard_error is None


def test_correlation_of_successive_values() -> None:
    white = [RNG.normal(size=2000) for _ in range(3)]
    correlation, bound = study_statistics.lag_one_correlation(white)
    assert abs(correlation) < 2 * bound and bound == pytest.approx(1.96 / np.sqrt(3 * 1999))
    walk = [np.convolve(x, [1, 1], "valid") for x in white]
    assert study_statistics.lag_one_correlation(walk)[0] == pytest.approx(0.5, abs=0.05)
    with pytest.raises(ValueError, match="too few"):
        study_statistics.lag_one_correlation([np.ones(1)])


class _Poses:
    def __init__(self, count: int) -> None:
        self.times_ns = np.arange(count, dtype=np.int64) * 40_000_000
        self.position = RNG.normal(scale=50.0, size=(count, 3))  # an attitude error must tell
        self.q_wxyz = to_wxyz(Rotation.random(count, rng=7))


def test_key_frames_chain_to_the_absolute_poses() -> None:
    poses = _Poses(60)
    sensors = libloc.FusionPresetSensors()
    steps = study_vio_run.key_frames(poses, 1_000_000_000, sensors)
    assert steps.start_times_ns is not None
    np.testing.assert_array_equal(steps.start_times_ns, [0, 1_000_000_000])
    np.testing.assert_array_equal(steps.times_ns, [1_000_000_000, 2_000_000_000])
    for step, (begin, end) in enumerate(((0, 25), (25, 50))):
        back = to_scipy(poses.q_wxyz[begin]).inv()
        expected = back.apply(poses.position[end] - poses.position[begin])
        np.testing.assert_allclose(steps.position[step], expected, atol=1e-10)
        difference = to_scipy(steps.wxyz[step]).inv() * (back * to_scipy(poses.q_wxyz[end]))
        assert difference.magnitude() < 1e-7
    # By sampling: two white errors, the drift's change over 25 frames, an attitude error of the start.
    phi = 1 - 1 / 232
    step_sigma = np.sqrt((2 / 232 + 1 / 232**2) * 1.34)
    drift = np.zeros((20000, 3))
    start = RNG.normal(size=drift.shape) * step_sigma / np.sqrt(1 - phi**2)
    drift += start
    for _ in range(25):
        drift = phi * drift + step_sigma * RNG.normal(size=drift.shape)
    error = drift - start + 0.139 * np.sqrt(2) * RNG.normal(size=drift.shape)
    error -= np.cross(0.01 * RNG.normal(size=drift.shape), steps.position[0])
    np.testing.assert_allclose(steps.position_cov[0], np.cov(error.T), atol=0.05 * np.trace(np.cov(error.T)))


def test_start_that_is_drawn_has_the_covariance() -> None:
    truth = libloc.simulate("vio-example", 1, duration_s=1.0).truth
    row = next(r for r in study_vio_rows.all_rows(4.0) if r.name == "nees-drawn")
    covariance = libloc.FusionPreset.by_name("19").start_cov
    starts = [study_vio_run.start_of(row, truth, covariance, seed) for seed in range(400)]
    scale = np.array([start.scale for start in starts])
    assert np.mean(scale) == pytest.approx(2, abs=0.3) and np.std(scale) == pytest.approx(1.5, rel=0.15)
    theta = libloc.so3.boxminus(truth.q_world_body_wxyz[0], np.array([start.q_wxyz for start in starts]))
    np.testing.assert_allclose(np.std(theta, axis=0), np.deg2rad(1), rtol=0.15)
    exact = study_vio_run.start_of(study_vio_rows.all_rows(4.0)[5], truth, covariance, 1)
    np.testing.assert_array_equal(exact.position, truth.position[0])
    assert exact.scale == 1 and not exact.gyroscope_bias.any()


def test_all_rows_in_tables_and_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(study_vio_plots, "draw", lambda *_: [])
    assert study.main([*SMALL, "--jobs", "1", "--out", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    rows = study_vio_rows.all_rows(4.0)
    assert len({row.name for row in rows}) == len(rows)
    for row in rows:
        assert row.label in text
    result = json.loads((tmp_path / "vio.json").read_text())
    assert result["seeds"] == [1, 2] and not result["interrupted"]
    by_name = {row["name"]: row for row in result["rows"]}
    assert by_name.keys() == {row.name for row in rows}
    rmse = {name: row["position_rmse_m"]["mean"] for name, row in by_name.items()}
    assert rmse["imu-unknown"] > 5 * rmse["imu-known"]
    assert rmse["rtk"] < rmse["gps"] < 3
    # Late measurements are replayed: the end is the same, only the way there is not.
    assert rmse["late-200-replayed"] == pytest.approx(rmse["19-mean"], abs=0.3)
    assert by_name["late-200-replayed"]["counts"]["odometry.accepted"] == 2 * (100 - 5)
    assert by_name["outliers-gated"]["counts"]["odometry.gated"] > 0
    assert by_name["wander-cloned"]["counts"]["relative_odometry.accepted"] == 2 * 3
    assert by_name["oracle"]["final_scale_error"] is None
    for consistency in result["consistency"].values():
        assert consistency["nis"]["dof"] == 6 and consistency["nis"]["innovations"] == 200
        assert 5 < consistency["nis"]["average"] < 7
        assert consistency["nees"]["state"]["dof"] == 19
    with (tmp_path / "vio_runs.csv").open() as file:
        runs = list(csv.DictReader(file))
    assert len(runs) == 2 * len(rows)
    mean = np.mean([float(run["position_rmse_m"]) for run in runs if run["row"] == "19"])
    assert mean == pytest.approx(rmse["19"], rel=1e-12)


def test_pictures(tmp_path: Path) -> None:
    rows = ["--rows", "19", "gps", "nees-drawn"]
    assert study.main([*SMALL, "--jobs", "1", *rows, "--out", str(tmp_path)]) == 0
    pictures = {path.name: path.stat().st_size for path in tmp_path.glob("*.png")}
    assert pictures.keys() == {f"vio_{x}.png" for x in ("comparison", "extensions", "errors", "nees-drawn")}
    assert min(pictures.values()) > 10_000


def test_two_workers_give_the_same_table(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    options = [*SMALL, "--rows", "oracle", "19", "gps"]
    files = []
    for jobs in ("1", "2"):
        assert study.main([*options, "--jobs", jobs, "--out", str(tmp_path / jobs)]) == 0
        files.append([(tmp_path / jobs / name).read_bytes() for name in ("vio.json", "vio_runs.csv")])
    assert files[0] == files[1]


def test_interrupted_study_shows_what_is_finished(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    calls = []

    def run(task: study_vio_run.Task) -> dict[str, study_vio_run.Outcome]:
        if len(calls) == 2:
            raise KeyboardInterrupt
        calls.append(task.seed)
        return study_vio_run.run(task)

    monkeypatch.setattr(study.study_vio, "run", run)
    arguments = ["vio", "--seeds", "5", "--duration", "2", "--jobs", "1", "--rows", "19"]
    assert study.main(arguments) == 130
    output = capsys.readouterr()
    assert "2 of 5 runs" in output.err and "INTERRUPTED" in output.out and "2 seeds" in output.out


def test_dask_that_is_missing_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "dask.distributed", None)
    assert study.main([*SMALL, "--rows", "19", "--jobs", "2"]) == 1
    assert "pip install 'libloc[study]', or use --jobs 1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--rows", "17"], 1, "--rows 17: must be one of comparison"),
        (["--duration", "nan"], 1, "--duration nan"),
        (["--duration", "91"], 1, "--duration 91"),
        (["--seeds", "0"], 2, "must be at least 1"),
        (["--jobs", "1", "--scheduler", "tcp://x"], 2, "not allowed with"),
        (["--out", __file__], 2, "is not a folder"),
    ],
)
def test_mistakes_are_named(
    arguments: list[str], code: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        assert study.main(["vio", *arguments]) == code
    except SystemExit as error:
        assert error.code == code
    assert message in capsys.readouterr().err
