"""The error-state filter from Python: against an independent recording of the example, and step by step."""

import csv
import lzma
from pathlib import Path

import numpy as np
import pytest
import support

import libloc

DT_NS = 10_000_000


def reference_folder() -> Path:
    folder = support.data_folder("..") / "reference" / "vio" / "seed1"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not there")
    return folder


def table(path: Path) -> dict[str, np.ndarray]:
    opened = lzma.open(path, "rt") if path.suffix == ".xz" else path.open()
    with opened as file:
        rows = csv.reader(file)
        names = next(rows)
        values = np.array([[float(x) for x in row] for row in rows])
    return {name: values[:, i].copy() for i, name in enumerate(names)}


def columns(data: dict[str, np.ndarray], *names: str) -> np.ndarray:
    return np.ascontiguousarray(np.stack([data[name] for name in names], axis=1))


@pytest.mark.parametrize(("name", "tolerance"), [("16", 1e-9), ("19", 1e-9), ("as_published", 1e-5)])
def test_agrees_with_the_independent_recording(name: str, tolerance: float) -> None:
    folder = reference_folder()
    truth, imu, vo = (table(folder / f"{x}.csv") for x in ("truth", "imu", "vo"))
    expected = table(folder / f"estimate_{name}.csv.xz")
    preset = libloc.FusionPreset.by_name(name)
    preset.options.gate = False
    run_filter = libloc.ErrorStateFilter(preset.options)
    run_filter.start(
        # The published order predicts at the first sample too.
        -DT_NS if name == "as_published" else 0,
        preset.start_cov,
        q_world_body_wxyz=[truth[c][0] for c in ("qw", "qx", "qy", "qz")],
        position=[truth[c][0] for c in ("px", "py", "pz")],
        velocity=[truth[c][0] for c in ("vx", "vy", "vz")],
    )
    result = run_filter.run(
        np.arange(len(imu["t"]), dtype=np.int64) * DT_NS,
        columns(imu, "wx", "wy", "wz"),
        columns(imu, "fx", "fy", "fz"),
        odometry_times_ns=vo["imu_index"].astype(np.int64) * DT_NS,
        odometry_position=columns(vo, "zx", "zy", "zz"),
        odometry_position_cov=preset.odometry_position_cov,
        odometry_wxyz=columns(vo, "qw", "qx", "qy", "qz"),
        odometry_orientation_cov=preset.odometry_orientation_cov,
    )
    assert np.all(result.odometry_outcome == libloc.FusionOutcome.ACCEPTED)
    q = columns(expected, "qw", "qx", "qy", "qz")
    q *= np.sign(np.sum(q * result.q_world_body_wxyz, axis=1))[:, None]
    pairs = {
        "q": (result.q_world_body_wxyz, q),
        "p": (result.position, columns(expected, "px", "py", "pz")),
        "v": (result.velocity, columns(expected, "vx", "vy", "vz")),
        "bg": (result.gyroscope_bias, columns(expected, "bgx", "bgy", "bgz")),
        "ba": (result.accelerometer_bias, columns(expected, "bax", "bay", "baz")),
        "s": (result.scale, expected["s"]),
        "c": (result.drift, columns(expected, "cx", "cy", "cz")),
        "P": (result.variances, columns(expected, *[f"P{i}" for i in range(result.variances.shape[1])])),
    }
    for what, (actual, wanted) in pairs.items():
        np.testing.assert_allclose(actual, wanted, rtol=0, atol=tolerance, err_msg=f"{name}: {what}")


def small_recording(samples: int = 400) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(4)
    times = np.arange(samples, dtype=np.int64) * DT_NS
    gyro = 0.1 * rng.standard_normal((samples, 3))
    force = np.array([0, 0, 9.81]) + 0.2 * rng.standard_normal((samples, 3))
    vo = np.arange(0, samples, 4)
    return {
        "times": times,
        "gyro": gyro,
        "force": force,
        "vo_times": times[vo],
        "vo_position": 0.05 * rng.standard_normal((len(vo), 3)),
    }


def started(**options: object) -> libloc.ErrorStateFilter:
    result = libloc.ErrorStateFilter(libloc.ErrorStateOptions(gravity=[0, 0, -9.81], gate=False, **options))
    size = 15 + 1 + 6 * int(str(options.get("clones", 0)))
    result.start(0, 0.01 * np.eye(size))
    return result


def test_run_is_the_steps_one_by_one() -> None:
    data = small_recording()
    identity = np.tile([1.0, 0, 0, 0], (len(data["vo_times"]), 1))
    whole = started()
    result = whole.run(
        data["times"],
        data["gyro"],
        data["force"],
        odometry_times_ns=data["vo_times"],
        odometry_position=data["vo_position"],
        odometry_position_cov=np.eye(3) * 0.01,
        odometry_wxyz=identity,
        odometry_orientation_cov=np.eye(3) * 1e-2,
        with_covariance=True,
    )
    steps = started()
    row = 0
    for i, time in enumerate(data["times"]):
        steps.predict(int(time), data["gyro"][i], data["force"][i])
        if i % 4 == 0:
            fused = steps.fuse_vo(
                int(time), data["vo_position"][row], np.eye(3) * 0.01, [1, 0, 0, 0], np.eye(3) * 1e-2
            )
            assert fused.accepted and fused.dof == 6 and fused.nis == result.odometry_nis[row]
            assert fused.nis == pytest.approx(
                fused.residual @ np.linalg.solve(fused.innovation_cov, fused.residual)
            )
            row += 1
        np.testing.assert_array_equal(steps.position, result.position[i])
        np.testing.assert_array_equal(steps.q_world_body_wxyz, result.q_world_body_wxyz[i])
        np.testing.assert_array_equal(steps.covariance, result.covariance[i])
    assert steps.counts() == whole.counts() == {"odometry.accepted": len(identity)}


def test_arrivals_that_are_late_change_nothing_in_the_end() -> None:
    data = small_recording()
    identity = np.tile([1.0, 0, 0, 0], (len(data["vo_times"]), 1))
    ends = []
    for delay in (0, 120_000_000, 600_000_000):
        filter_ = started()
        result = filter_.run(
            data["times"],
            data["gyro"],
            data["force"],
            odometry_times_ns=data["vo_times"][:80],
            odometry_position=data["vo_position"][:80],
            odometry_position_cov=np.eye(3) * 0.01,
            odometry_wxyz=identity[:80],
            odometry_orientation_cov=np.eye(3) * 1e-2,
            odometry_arrivals_ns=data["vo_times"][:80] + delay,
        )
        late = delay > 500_000_000
        wanted = libloc.FusionOutcome.TOO_LATE if late else libloc.FusionOutcome.ACCEPTED
        assert np.all(result.odometry_outcome == wanted)
        ends.append(filter_.position)
    np.testing.assert_allclose(ends[1], ends[0], rtol=0, atol=1e-12)
    assert np.linalg.norm(ends[2] - ends[0]) > 1e-3


def test_gps_in_one_call_and_a_lever_arm() -> None:
    data = small_recording()
    gps = data["times"][::50].copy()
    result = started().run(
        data["times"],
        data["gyro"],
        data["force"],
        gps_times_ns=gps,
        gps_position=np.tile([0.5, 0.0, 1.0], (len(gps), 1)),
        gps_position_cov=np.tile(np.eye(3) * 0.04, (len(gps), 1, 1)),
        antenna=[0.5, 0, 1],
    )
    assert np.all(result.gps_outcome == libloc.FusionOutcome.ACCEPTED)
    assert np.linalg.norm(result.position[-1]) < 0.6


def test_mistakes_are_named() -> None:
    with pytest.raises(TypeError, match="no field clone"):
        libloc.ErrorStateOptions(clone=1)
    with pytest.raises(ValueError, match="clones = 9"):
        libloc.ErrorStateOptions(clones=9)
    with pytest.raises(ValueError, match="'17' is not"):
        libloc.FusionPreset.by_name("17")
    filter_ = libloc.ErrorStateFilter()
    data = small_recording(8)
    with pytest.raises(ValueError, match="not started"):
        filter_.run(data["times"], data["gyro"], data["force"])
    with pytest.raises(ValueError, match="16"):
        filter_.start(0, np.eye(15))
    bad = np.eye(16)
    bad[0, 1] = bad[1, 0] = 2
    with pytest.raises(ValueError, match="semidefinite"):
        filter_.start(0, bad)
    filter_.start(0, np.eye(16))
    with pytest.raises(ValueError, match="odometry_wxyz"):
        filter_.run(
            data["times"],
            data["gyro"],
            data["force"],
            odometry_times_ns=data["vo_times"],
            odometry_position=data["vo_position"],
            odometry_position_cov=np.eye(3),
        )
    with pytest.raises((TypeError, ValueError), match="gyro"):
        filter_.run(data["times"], data["gyro"][:-1], data["force"])
    with pytest.raises(ValueError, match="clones"):
        filter_.fuse_vo_relative(0, 1, [0, 0, 0], np.eye(3), [1, 0, 0, 0], np.eye(3))
    assert filter_.predict(0, [np.nan, 0, 0], [0, 0, 9.81]) == libloc.PredictOutcome.NOT_FINITE


def test_a_model_of_ones_own() -> None:
    filter_ = started()
    filter_.predict(0, [0, 0, 0], [0, 0, 9.81])

    def speed_is_one(state: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        jacobian = np.zeros((1, 16))
        jacobian[0, 6] = 1
        return np.array([1 - state["velocity"][0]]), jacobian, np.array([[1e-4]])

    foreseen = filter_.residual(speed_is_one)
    assert filter_.velocity[0] == 0
    done = filter_.correct(0, speed_is_one)
    assert done.accepted and done.nis == foreseen.nis == pytest.approx(1 / (0.01 + 1e-4))
    assert filter_.velocity[0] == pytest.approx(0.01 / (0.01 + 1e-4))
    with pytest.raises(ValueError, match="jacobian"):
        filter_.correct(0, lambda state: (np.zeros(1), np.zeros((1, 15)), np.eye(1)))
    with pytest.raises(ZeroDivisionError):
        filter_.correct(0, lambda state: 1 / 0)
    variances = filter_.covariance.diagonal().copy()
    filter_.widen(np.ones(16))
    np.testing.assert_allclose(filter_.covariance.diagonal(), variances + 1)
