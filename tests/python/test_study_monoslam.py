"""loc-study monoslam: its worlds, its figures against independent ones, and the study with few runs."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from libloc.programs import (
    study,
    study_monoslam,
    study_monoslam_cases,
    study_monoslam_plots,
    study_monoslam_run,
    study_monoslam_verdicts,
    study_monoslam_worlds,
)
from libloc.programs.study_monoslam_worlds import World
from scipy import stats
from scipy.spatial.transform import Rotation
from support import to_scipy, to_wxyz

import libloc

RNG = np.random.default_rng(5)
CASES = {case.name: case for case in study_monoslam_cases.all_cases(quick=True)}


def outcome(**fields) -> study_monoslam_run.Outcome:
    """A run that is right in all respects, but for the fields."""
    values = {
        "estimates": 100,
        "rms_m": 0.1,
        "settled_rms_m": 0.1,
        "late_rms_m": 0.1,
        "max_m": 0.2,
        "turned_rms_rad": 0.01,
        "map_rms_m": 0.1,
        "nis": 95.0,
        "nis_dim": 100,
        "gate": 0.95,
        "flagged": 0.0,
        "flagged_dark": float("nan"),
        "counts": {"rejected": 3},
        "times_s": np.arange(20) * 0.5,
        "error_m": np.full(20, 0.1),
        "reprojection_px": np.ones(20),
        "nees": RNG.chisquare(3, size=(20, 3)),
    }
    return study_monoslam_run.Outcome(**(values | fields))


def test_circle_is_civeras():
    simulated = study_monoslam_worlds.simulate(World("circle"), 1)
    tracks = simulated.tracks
    counts = np.diff(tracks.first)
    assert len(counts) == 1000 and 13 < counts.mean() < 17
    np.testing.assert_allclose(np.linalg.norm(simulated.position, axis=1), 3, atol=1e-9)
    turned = np.unwrap(np.arctan2(simulated.position[:, 1], simulated.position[:, 0]))
    assert turned[-1] - turned[0] == pytest.approx(4 * np.pi * 999 / 1000)
    distance = np.linalg.norm(simulated.points[:, :2], axis=1)
    assert len(distance) == 140 and distance.min() >= 4.5 and distance.max() <= 8
    # Measured is what a pinhole at the true pose sees, with noise of one pixel; the camera looks outward.
    T = simulated.camera.T_body_camera.matrix()
    errors = []
    for i in (0, 400, 999):
        world_camera = to_scipy(simulated.q_wxyz[i]).as_matrix() @ T[:3, :3]
        assert world_camera[:, 2] @ simulated.position[i] == pytest.approx(3)
        rows = slice(tracks.first[i], tracks.first[i + 1])
        seen = (simulated.points[tracks.id[rows]] - simulated.position[i]) @ world_camera
        errors.append(195 * seen[:, :2] / seen[:, 2:] + [159.5, 119.5] - tracks.pixel_px[rows])
    assert 0.7 < np.std(np.concatenate(errors)) < 1.3


def test_noise_is_the_only_thing_that_it_changes():
    quiet, noisy = (
        study_monoslam_worlds.simulate(World(sigma_px=sigma, duration_s=1.0), 4) for sigma in (1.0, 2.0)
    )
    np.testing.assert_array_equal(quiet.points, noisy.points)
    np.testing.assert_array_equal(quiet.position, noisy.position)
    other = study_monoslam_worlds.simulate(World(duration_s=1.0), 5)
    assert not np.array_equal(other.points, quiet.points)


def test_spoilt_tracks():
    clean = study_monoslam_worlds.simulate(World(duration_s=12.0), 2)
    tracks, camera = clean.tracks, clean.camera
    times_s = (tracks.times_ns - tracks.times_ns[0]) * 1e-9

    def spoilt(how: str) -> study_monoslam_worlds.Tracks:
        return study_monoslam_worlds.spoil(tracks, camera, how, 2)

    wrong = np.any(spoilt("outliers").pixel_px != tracks.pixel_px, axis=1)
    late = np.repeat(times_s > 2, np.diff(tracks.first))
    assert not wrong[~late].any() and np.mean(wrong[late]) == pytest.approx(0.1, abs=0.01)
    there = np.isin(tracks.times_ns, spoilt("dropped").times_ns)
    assert there[times_s <= 2].all() and np.mean(~there[times_s > 2]) == pytest.approx(0.2, abs=0.06)
    kept = spoilt("dropped")
    np.testing.assert_array_equal(np.diff(kept.first), np.diff(tracks.first)[there])
    np.testing.assert_array_equal(kept.id, tracks.id[np.repeat(there, np.diff(tracks.first))])
    dark = np.diff(spoilt("dark").first) == 0
    np.testing.assert_array_equal(dark, (times_s >= 5) & (times_s < 7))
    assert len(spoilt("dark").id) == spoilt("dark").first[-1]
    with pytest.raises(ValueError, match="spoilt 'fog'"):
        spoilt("fog")


def test_with_an_imu_errors_do_not_depend_on_place_and_heading_of_the_truth():
    case = replace(CASES["hand-held-plain"], world=World("hand-held", sigma_px=0.5, duration_s=4.0))
    simulated = study_monoslam_worlds.simulate(case.world, 3)
    first = study_monoslam_run.run_case(case, simulated)
    turn = Rotation.from_euler("z", 130, degrees=True)
    moved = replace(
        simulated,
        q_wxyz=to_wxyz(turn * to_scipy(simulated.q_wxyz)),
        position=turn.apply(simulated.position) + np.array([5, -3, 2]),
        velocity=turn.apply(simulated.velocity),
    )
    second = study_monoslam_run.run_case(case, moved)
    assert 0 < first.max_m < 0.1 and first.estimates == 80
    np.testing.assert_allclose(second.error_m, first.error_m, atol=1e-9)
    np.testing.assert_allclose(second.nees, first.nees, rtol=1e-5, atol=1e-6)
    # Tilt is not taken away.
    tilt = Rotation.from_euler("x", 3, degrees=True)
    tilted = replace(simulated, q_wxyz=to_wxyz(tilt * to_scipy(simulated.q_wxyz)))
    assert study_monoslam_run.run_case(case, tilted).turned_rms_rad > 0.04


def test_nees_of_a_run_is_that_of_numpy():
    case = replace(CASES["metric-1px"], world=World(duration_s=1.0))
    simulated = study_monoslam_worlds.simulate(case.world, 6)
    options = study_monoslam_run.options_of(case, simulated)
    assert [one.id for one in options.landmarks] == sorted(simulated.tracks.id[: simulated.tracks.first[1]])[
        :6
    ]
    t = simulated.tracks
    result = libloc.MonoSlam(options).run(t.times_ns, t.first, t.id, t.pixel_px)
    own = study_monoslam_run.run_case(case, simulated)
    i = 25
    e = simulated.position[i] - result.position[i]
    expected = e @ np.linalg.solve(result.covariance[i, 3:6, 3:6], e)
    assert own.nees[i // study_monoslam_run.EVERY, 0] == pytest.approx(expected, rel=1e-9)
    theta = (to_scipy(result.q_world_body_wxyz[i]).inv() * to_scipy(simulated.q_wxyz[i])).as_rotvec()
    expected = theta @ np.linalg.solve(result.covariance[i, :3, :3], theta)
    assert own.nees[i // study_monoslam_run.EVERY, 1] == pytest.approx(expected, rel=1e-4)
    errors = np.linalg.norm(simulated.position - result.position, axis=1)
    assert own.rms_m == pytest.approx(np.sqrt(np.mean(errors**2)))
    with pytest.raises(ValueError, match=r"map\.depth: is not a setting"):
        study_monoslam_run.options_of(replace(case, settings=(("map.depth", 1.0),)), simulated)


def test_nis_within_a_gate():
    gated = RNG.chisquare(2, size=200_000)
    gated = gated[gated < stats.chi2(2).ppf(0.95)]
    assert study_monoslam.expected_nis(0.95) == pytest.approx(gated.mean() / 2, abs=5e-3)
    assert study_monoslam.expected_nis(0.999999) == pytest.approx(1, abs=1e-4)
    # A gate of 0 is the default of the motion model.
    association = libloc.SlamAssociationOptions(gate_probability=0.9)
    assert association.gate(libloc.SlamMotion.INERTIAL) == 0.9
    association.gate_probability = 0
    gates = [association.gate(motion) for motion in libloc.SlamMotion]
    assert all(0.9 <= gate < 1 for gate in gates)


def test_distance_from_a_right_nees():
    def blocks(nees: float) -> dict[str, study_monoslam.Nees]:
        over_time = study_monoslam.consistency_over_time(np.full((5, 9), nees), 3)
        return {name: study_monoslam.Nees(over_time, nees) for name in ("position", "orientation")}

    table = {"a-plain": blocks(30.0), "a-first-estimate": blocks(3.0), "a-invariant": blocks(1.0)}
    expected = {"plain": np.log(10), "first-estimate": 0, "invariant": np.log(3)}
    assert study_monoslam.distances(table, ["a"]) == pytest.approx(expected)
    table |= {"b-plain": blocks(3.0), "b-first-estimate": blocks(300.0), "b-invariant": blocks(3.0)}
    expected = {"plain": np.log(10) / 2, "first-estimate": np.log(10), "invariant": np.log(3) / 2}
    assert study_monoslam.distances(table, ["a", "b"]) == pytest.approx(expected)
    del table["b-plain"]
    assert study_monoslam.distances(table, ["a", "b"]) == {}


def test_requirements_that_are_missed_are_said():
    runs = {
        "metric-0px": [outcome(settled_rms_m=0.1)],
        "metric-1px": [outcome(settled_rms_m=0.14)],
        "prior-0px": [outcome(settled_rms_m=0.1)],
        "prior-1px": [outcome(settled_rms_m=0.16)],
        "circle-plain": [outcome(rms_m=0.1), outcome(rms_m=0.6)],
        "circle-clean": [outcome()],
        "circle-outliers": [outcome(rms_m=0.19, max_m=5.0)],
        "circle-dropped": [outcome(rms_m=0.19)],
        "circle-dark": [outcome(rms_m=0.3, flagged_dark=0.9)],
    }
    held = [one.held for one in study_monoslam_verdicts.requirements(runs)]
    #       prior, metric, worst, mean, outliers: lost, dropped, dark, after it, said so
    assert held == [False, True, False, False, False, True, False, True, True]
    assert study_monoslam_verdicts.requirements({}) == []


def test_tables_and_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(study_monoslam_plots, "draw", lambda *_: [])
    rows = ["metric-0px", "metric-1px", "noise-2px", "circle-invariant", "circle-clean", "circle-dropped"]
    arguments = ["monoslam", "--quick", "--seeds", "2", "--jobs", "1", "--rows", *rows]
    assert study.main([*arguments, "--out", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    for name in rows:
        assert CASES[name].label in text
    result = json.loads((tmp_path / "monoslam.json").read_text())
    assert result["seeds"] == [1, 2] and result["quick"] and not result["interrupted"]
    by_name = {row["name"]: row for row in result["rows"]}
    assert by_name.keys() == set(rows)
    rms = {name: row["position_rms_m"]["mean"] for name, row in by_name.items()}
    assert rms["metric-0px"] < 0.2 * rms["metric-1px"] and rms["metric-1px"] < 0.05
    assert rms["circle-invariant"] < 0.5
    assert by_name["circle-clean"]["position_rms_m"] == by_name["circle-invariant"]["position_rms_m"]
    assert by_name["circle-invariant"]["orientation_rms_deg"] < 5
    assert 0.6 < by_name["circle-invariant"]["nis_per_dim"] < 1.1
    assert len(result["requirements"]) == 4
    assert result["consistency"]["circle-invariant"]["position"]["dof"] == 3
    assert len((tmp_path / "monoslam_runs.csv").read_text().splitlines()) == 1 + 2 * len(rows)


@pytest.mark.slow
def test_two_workers_give_the_same_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(study_monoslam_plots, "draw", lambda *_: [])
    arguments = ["monoslam", "--quick", "--seeds", "2", "--rows", "metric-1px", "circle-dark"]
    files = []
    for jobs in ("1", "2"):
        assert study.main([*arguments, "--jobs", jobs, "--out", str(tmp_path / jobs)]) == 0
        names = ("monoslam.json", "monoslam_rows.csv", "monoslam_runs.csv")
        files.append([(tmp_path / jobs / name).read_bytes() for name in names])
    assert files[0] == files[1]


@pytest.mark.slow
def test_pictures(tmp_path: Path) -> None:
    path, points = RNG.normal(size=(50, 3)), RNG.normal(size=(20, 3))
    rows = ["metric-0px", "metric-1px", "noise", "focal-200", "focal-1000", "consistency", "robustness"]
    options = study.make_parser().parse_args(["monoslam", "--rows", *rows])
    tasks = study_monoslam.tasks(options, range(1, 3))
    finished = []
    for task in tasks:
        runs = {}
        for case in task.cases:
            runs[case.name] = outcome(error_m=RNG.uniform(0.1, 0.2, 20), reprojection_px=np.full(20, np.nan))
            if case.picture:
                runs[case.name].trajectory = runs[case.name].true_trajectory = path
                runs[case.name].map_points = runs[case.name].true_points = points
        finished.append((task, runs))
    files = study_monoslam.write(study_monoslam.evaluate(finished, options, False), tmp_path)
    pictures = {file.name: file.stat().st_size for file in files if file.suffix == ".png"}
    names = ("errors", "reprojection", "maps", "sweeps", "consistency", "robustness")
    assert pictures.keys() == {f"monoslam_{name}.png" for name in names}
    assert min(pictures.values()) > 10_000


def test_rows_that_are_unknown_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert study.main(["monoslam", "--rows", "square"]) == 1
    assert "--rows square: must be one of document, noise" in capsys.readouterr().err
