"""loc-evaluate as a user runs it."""

import json
import subprocess
import sys
from pathlib import Path

import loc
import numpy as np
import pytest
from libloc.programs import evaluate
from libloc.programs.evaluate_input import read_estimate
from scipy.spatial.transform import Rotation
from support import (
    CHECKOUT,
    built_program,
    data_folder,
    to_scipy,
    to_wxyz,
    turning_body,
    write_csv,
    write_log,
)

import libloc

DATA = CHECKOUT / "tests/python/data"
PROGRAM = Path(sys.executable).with_name("loc-evaluate")


def numbers(capsys, *arguments) -> dict:
    """Runs it in this process; gives the numbers that --json holds."""
    file = Path(arguments[0]).parent / "numbers.json" if "--json" not in arguments else None
    assert evaluate.main([str(a) for a in (*arguments, "--json", file)]) == 0, capsys.readouterr().err
    return json.loads(file.read_text())


def turned(r, degrees: float, noise: float = 0.0):
    """The truth turned about the vertical, with noise."""
    error = Rotation.from_rotvec(np.random.default_rng(8).normal(size=(len(r.times_ns), 3)) * noise)
    return to_wxyz(Rotation.from_euler("z", degrees, degrees=True) * error * to_scipy(r.q_true_wxyz))


def test_trajectories_in_numbers_and_pictures(tmp_path):
    """The installed program; the numbers are evo's."""
    from evo.core import metrics, sync
    from evo.tools import file_interface

    out = subprocess.run(
        [PROGRAM, DATA / "estimate.tum", "--reference", DATA / "reference.tum", "--align", "sim3",
         "--json", tmp_path / "n.json", "--plots", tmp_path / "plots"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "absolute error: 188 pairs, alignment sim3, scale" in out.stdout
    assert "heading is relative" in out.stdout
    got = json.loads((tmp_path / "n.json").read_text())

    reference = file_interface.read_tum_trajectory_file(str(DATA / "reference.tum"))
    estimate = file_interface.read_tum_trajectory_file(str(DATA / "estimate.tum"))
    reference, estimate = sync.associate_trajectories(reference, estimate, max_diff=0.01)
    rpe = metrics.RPE(metrics.PoseRelation.translation_part, 1, metrics.Unit.frames)
    rpe.process_data((reference, estimate))
    _, _, scale = estimate.align(reference, correct_scale=True)
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data((reference, estimate))
    assert got["absolute_error"]["scale"] == pytest.approx(scale, abs=1e-6)
    for name, value in ape.get_all_statistics().items():
        assert got["absolute_error"]["translation_m"][name] == pytest.approx(value, abs=1e-6), name
    for name, value in rpe.get_all_statistics().items():
        assert got["relative_error"]["translation_m"][name] == pytest.approx(value, abs=1e-6), name

    for name in ("orientation.png", "trajectory.png"):
        picture = (tmp_path / "plots" / name).read_bytes()
        assert picture.startswith(b"\x89PNG")
        assert len(picture) > 20_000


def test_log_with_estimate_and_reference(tmp_path, capsys):
    r = turning_body(600)
    write_log(tmp_path / "run.lcm", r, turned(r, 3.0, noise=0.01))
    got = numbers(capsys, tmp_path / "run.lcm")
    assert got["orientation"]["heading"] == "absolute"
    assert got["orientation"]["scored"] == 600
    assert got["orientation"]["heading_deg"]["mean"] == pytest.approx(3.0, abs=0.2)
    assert "absolute_error" not in got
    assert "heading compared as it is" in capsys.readouterr().out


def test_what_is_not_valid_is_left_out(tmp_path, capsys):
    r = turning_body(600)
    q = r.q_true_wxyz.copy()
    q[:150] = [1, 0, 0, 0]  # before the first estimate, and before the first field
    valid = np.full(600, loc.estimate_t.VALID_ORIENTATION | loc.estimate_t.VALID_HEADING)
    valid[:100], valid[100:150] = 0, loc.estimate_t.VALID_ORIENTATION
    write_log(tmp_path / "run.lcm", r, q, valid=valid)
    got = numbers(capsys, tmp_path / "run.lcm")
    assert (got["orientation"]["pairs"], got["orientation"]["scored"]) == (500, 450)
    assert got["orientation"]["total_deg"]["max"] < 1e-5
    assert got["estimate"]["counts"]["estimate.heading_relative"] == 50


def test_relative_heading_is_removed_and_said(tmp_path, capsys):
    r = turning_body(600)
    write_log(tmp_path / "run.lcm", r, turned(r, 40.0), valid=loc.estimate_t.VALID_ORIENTATION)
    got = numbers(capsys, tmp_path / "run.lcm")
    assert got["orientation"]["heading"] == "start"
    assert got["orientation"]["heading_offset_deg"] == pytest.approx(40.0, abs=1e-6)
    assert got["orientation"]["total_deg"]["max"] == pytest.approx(0, abs=1e-5)
    assert (
        "heading is relative: the offset of the first pair, 40.000 deg, was removed"
        in capsys.readouterr().out
    )
    assert (
        numbers(capsys, tmp_path / "run.lcm", "--heading", "absolute")["orientation"]["total_deg"]["rmse"]
        > 39
    )
    assert (
        numbers(capsys, tmp_path / "run.lcm", "--heading", "mean")["orientation"]["total_deg"]["rmse"] < 1e-5
    )


@pytest.mark.parametrize(("world", "to_world"), [("NED", [[0, 1, 0], [1, 0, 0], [0, 0, -1]]), ("NWU", None)])
def test_other_worlds_are_turned_into_the_references(tmp_path, capsys, world, to_world):
    r = turning_body(200)
    turn = Rotation.from_matrix(to_world or [[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    write_log(tmp_path / "run.lcm", r, to_wxyz(turn * to_scipy(r.q_true_wxyz)), world=world)
    assert numbers(capsys, tmp_path / "run.lcm")["orientation"]["total_deg"]["max"] < 1e-5


def test_estimate_in_a_log_against_another_file(tmp_path, capsys):
    r = turning_body(300)
    write_csv(tmp_path / "truth.csv", r)
    q = turned(r, 0.0)
    q[7] = np.nan
    write_log(tmp_path / "run.lcm", r, q, reference=False)
    got = numbers(capsys, tmp_path / "run.lcm", "--reference", tmp_path / "truth.csv")
    assert got["reference"]["format"] == "csv"
    assert got["orientation"]["scored"] == 299
    data = (tmp_path / "run.lcm").read_bytes()
    (tmp_path / "cut.lcm").write_bytes(data[: len(data) // 2 + 11])
    got = numbers(capsys, tmp_path / "cut.lcm", "--reference", tmp_path / "truth.csv")
    assert got["estimate"]["counts"]["log.truncated_bytes"] > 0
    assert "log.truncated_bytes" in capsys.readouterr().out


@pytest.mark.parametrize("form", ["lcm", "csv", "tum"])
def test_what_loc_estimator_writes(tmp_path, capsys, form):
    """The C++ program off line: its orientations are those of a batch call bit for bit."""
    estimator = built_program("loc-estimator")
    r = turning_body(500)
    write_csv(tmp_path / "own.csv", r)
    out = tmp_path / f"out.{form}"
    subprocess.run(
        [estimator, "--input", tmp_path / "own.csv", "--output", out], check=True, capture_output=True
    )
    got = numbers(capsys, out, "--reference", tmp_path / "own.csv", "--heading", "absolute")
    assert "position: not compared" in capsys.readouterr().out
    recording = libloc.read_recording(tmp_path / "own.csv")
    field = recording.magnetometer.magnetic_field
    batch = libloc.MadgwickFilter(libloc.MadgwickOptions.robust()).run(r.times_ns, r.gyro, r.force, field)
    q = batch.q_world_body_wxyz
    written = read_estimate(out, libloc.ESTIMATE_CHANNEL).q_wxyz
    assert np.array_equal(written, q) if form != "tum" else np.allclose(written, q, atol=1e-15)
    expected = libloc.orientation_error(q, recording.reference.q_world_body_wxyz)
    assert got["orientation"]["total_deg"]["rmse"] == pytest.approx(np.rad2deg(expected.total_rmse), abs=1e-9)
    assert got["orientation"]["scored"] == 500


def test_damaged_csv_of_estimates(tmp_path, capsys):
    path = tmp_path / "out.csv"
    heading = "time_ns,qw,qx,qy,qz,px_m,py_m,pz_m,valid"
    path.write_text(f"{heading}\n0,1,0,0,0,,,,1\n1000000,1,0,0,0,,,,1\n2000000,1,0,")
    estimate = read_estimate(path, "")
    assert estimate.counts == {"estimate.read": 2, "estimate.skipped.no_line_end": 1}
    assert estimate.heading_is_absolute is False
    for line, text in (
        ("0,1,0,0,0,,,,x", "'x'"),
        ("0,1,0,0,0,1", "6 cells"),
        ("0,2,0,0,0,,,,1", "norm is 2"),
    ):
        path.write_text(f"{heading}\n{line}\n")
        assert evaluate.main([str(path), "--reference", str(DATA / "reference.tum")]) == 1
        assert text in capsys.readouterr().err


def test_time_offset(tmp_path, capsys):
    r = turning_body(300)
    write_csv(tmp_path / "truth.csv", r)
    r.times_ns += 700_000_000
    write_log(tmp_path / "run.lcm", r, r.q_true_wxyz, reference=False)
    run = (tmp_path / "run.lcm", "--reference", tmp_path / "truth.csv")
    assert numbers(capsys, *run)["orientation"]["total_deg"]["rmse"] > 5
    assert numbers(capsys, *run, "--time-offset", "-0.7")["orientation"]["total_deg"]["rmse"] < 1e-5


def test_broad_trial_with_its_own_metric(tmp_path, capsys):
    trial = data_folder("broad") / "07_undisturbed_fast_rotation_B.mat"
    r = libloc.read_recording(trial)
    q = libloc.MadgwickFilter(libloc.MadgwickOptions.robust()).run(
        r.imu.times_ns, r.imu.angular_velocity, r.imu.specific_force, r.magnetometer.magnetic_field,
        r.magnetometer.times_ns).q_world_body_wxyz  # fmt: skip
    libloc.write_tum(tmp_path / "q.tum", libloc.Trajectory(r.imu.times_ns, q, np.zeros((len(q), 3))))
    got = numbers(capsys, tmp_path / "q.tum", "--reference", trial, "--heading", "absolute")
    error = to_scipy(q) * to_scipy(np.nan_to_num(r.reference.q_world_body_wxyz, nan=0.5)).inv()
    scored = r.reference.score & np.isfinite(r.reference.q_world_body_wxyz).all(axis=1)
    rmse = np.sqrt(np.mean(np.rad2deg(error.magnitude()[scored]) ** 2))
    assert got["orientation"]["scored"] == scored.sum()
    assert got["orientation"]["total_deg"]["rmse"] == pytest.approx(rmse, abs=1e-6)


def tum(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda d: [d / "absent", "--reference", DATA / "reference.tum"], "absent: no such file"),
        (lambda d: [DATA / "estimate.tum", "--reference", d / "absent"], "absent: no such file"),
        (
            lambda d: [
                tum(d / "late.tum", "5 0 0 0 0 0 0 1\n6 0 0 1 0 0 0 1\n"),
                "--reference",
                DATA / "reference.tum",
            ],
            "no overlap in time: the estimate covers 5.000000000 to 6.000000000 s",
        ),
        (
            lambda d: [tum(d / "nan.tum", "1 0 0 nan 0 0 0 1\n"), "--reference", DATA / "reference.tum"],
            "nan.tum",
        ),
        (
            lambda d: [
                tum(d / "still.tum", "".join(f"{1403715274 + i} 1 0 0 0 0 0 1\n" for i in range(9))),
                "--reference",
                DATA / "reference.tum",
            ],
            "all points are in one place",
        ),
        (lambda d: [d / "run.lcm", "--estimate-channel", "NONE"], "run.lcm: no message on channel NONE"),
        (lambda d: [d / "run.lcm", "--estimate-channel", "LOC_IMU"], "carries imu_t, not estimate_t"),
        (lambda d: [d / "run.lcm"], "no reference poses in it; it holds imu (50)"),
        (lambda d: [d / "run.lcm", "--reference", d / "truth.csv", "--only", "position"], "no position"),
    ],
)
def test_data_that_cannot_be_evaluated(tmp_path, capsys, make, text):
    r = turning_body(50)
    write_csv(tmp_path / "truth.csv", r)
    write_log(tmp_path / "run.lcm", r, r.q_true_wxyz, reference=False)
    assert evaluate.main([str(a) for a in make(tmp_path)]) == 1
    err = capsys.readouterr().err
    assert err.startswith("loc-evaluate: ")
    assert text in err
    assert "Traceback" not in err


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        [DATA / "estimate.tum"],
        [DATA / "estimate.tum", "--reference", DATA / "reference.tum", "--align", "affine"],
        [DATA / "estimate.tum", "--reference", DATA / "reference.tum", "--max-difference", "nan"],
        [DATA / "estimate.tum", "--reference", DATA / "reference.tum", "--rpe-delta", "0.5"],
    ],
)
def test_wrong_options(capsys, arguments):
    with pytest.raises(SystemExit) as error:
        evaluate.main([str(a) for a in arguments])
    assert error.value.code == 2
