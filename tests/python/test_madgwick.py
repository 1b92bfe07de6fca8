"""The Madgwick filter: whole arrays against single steps, truth, errors, copies, threads, Ctrl-C."""

import re
import signal
import threading
import tracemalloc

import numpy as np
import pytest
from support import CHECKOUT, Recording, turning_body

import libloc
from libloc import EstimateStatus, MadgwickFilter, MadgwickOptions


def step_by_step(filter_: MadgwickFilter, r: Recording, field_at: dict[int, np.ndarray]):
    """The reference of run(): field_at[i] is given before IMU sample i."""
    q, bias, status = [], [], []
    for i, time_ns in enumerate(r.times_ns):
        if i in field_at:
            filter_.update_magnetometer(time_ns, field_at[i])
        status.append(int(filter_.update(time_ns, r.gyro[i], r.force[i])))
        q.append(filter_.q_world_body_wxyz)
        bias.append(filter_.gyroscope_bias)
    return np.array(q), np.array(bias), np.array(status, dtype=np.uint32)


def assert_same(result, expected):
    assert np.array_equal(result.q_world_body_wxyz, expected[0], equal_nan=True)
    assert np.array_equal(result.gyroscope_bias, expected[1], equal_nan=True)
    assert np.array_equal(result.status, expected[2])


def spoilt(r: Recording) -> Recording:
    """With what real recordings hold: NaN, a clock that steps back, a gap."""
    r.gyro[0] = np.nan
    r.force[50, 1] = np.inf
    r.times_ns[80] = r.times_ns[79]
    r.times_ns[300:] += 5_000_000_000
    return r


@pytest.mark.parametrize("options", [MadgwickOptions.report(), MadgwickOptions.robust()])
def test_run_is_step_by_step_bit_for_bit(options):
    r = spoilt(turning_body(500))
    every_third = {i: r.field[i] for i in range(0, 500, 3)}

    assert_same(
        MadgwickFilter(options).run(r.times_ns, r.gyro, r.force), step_by_step(MadgwickFilter(options), r, {})
    )
    with_field = step_by_step(MadgwickFilter(options), r, dict(enumerate(r.field)))
    assert_same(MadgwickFilter(options).run(r.times_ns, r.gyro, r.force, r.field), with_field)

    # A slower magnetometer, as rows of NaN and with time stamps of its own.
    slower = step_by_step(MadgwickFilter(options), r, every_third)
    sparse = np.full_like(r.field, np.nan)
    sparse[::3] = r.field[::3]
    assert_same(MadgwickFilter(options).run(r.times_ns, r.gyro, r.force, sparse), slower)
    assert not np.array_equal(slower[0], with_field[0])

    keep = np.arange(0, 500, 3)[np.arange(0, 500, 3) != 81]  # two samples of one time would be an error
    own = step_by_step(MadgwickFilter(options), r, {i: r.field[i] for i in keep})
    result = MadgwickFilter(options).run(
        r.times_ns, r.gyro, r.force, np.ascontiguousarray(r.field[keep]), r.times_ns[keep]
    )
    assert_same(result, own)
    assert result.magnetometer_used == len(keep)


def test_run_goes_on_where_it_stopped():
    r = turning_body(400)
    whole = MadgwickFilter(MadgwickOptions.robust()).run(r.times_ns, r.gyro, r.force, r.field)
    filter_ = MadgwickFilter(MadgwickOptions.robust())
    parts = [
        filter_.run(r.times_ns[s], r.gyro[s], r.force[s], r.field[s])
        for s in (slice(0, 150), slice(150, 400))
    ]
    assert np.array_equal(np.concatenate([p.q_world_body_wxyz for p in parts]), whole.q_world_body_wxyz)
    assert filter_.counts()["imu.used"] == 400
    filter_.reset()
    assert np.isnan(filter_.q_world_body_wxyz).all()


@pytest.mark.parametrize("options", [MadgwickOptions.report(), MadgwickOptions.robust()])
def test_estimates_the_truth(options):
    r = turning_body(4000)
    result = MadgwickFilter(options).run(r.times_ns, r.gyro, r.force, r.field)
    error = np.rad2deg(libloc.so3.angle_between(result.q_world_body_wxyz[400:], r.q_true_wxyz[400:]))
    assert error.max() < 1.5
    assert np.count_nonzero(result.status[1:]) == 0

    # The same motion in another world frame.
    ned = MadgwickOptions(world="NED", beta=options.beta)
    q_ned = MadgwickFilter(ned).run(r.times_ns, r.gyro, r.force, r.field).q_world_body_wxyz
    ned_enu = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]])
    from support import to_scipy

    truth = ned_enu @ to_scipy(r.q_true_wxyz).as_matrix()
    turn = np.linalg.norm(to_scipy(q_ned).as_matrix() - truth, axis=(1, 2))
    assert turn[400:].max() < 0.04


def test_six_axes_say_that_the_heading_is_relative():
    r = turning_body(200)
    filter_ = MadgwickFilter()
    status = filter_.run(r.times_ns, r.gyro, r.force).status
    assert np.all(status & EstimateStatus.MAGNETOMETER_MISSING)
    valid = filter_.estimate().valid
    assert libloc.EstimateValid.ORIENTATION in valid
    assert libloc.EstimateValid.HEADING not in valid


def test_skipped_samples_are_flagged_and_counted():
    r = spoilt(turning_body(500))
    r.field[10] = [np.nan, 1, 2]
    filter_ = MadgwickFilter()
    result = filter_.run(r.times_ns, r.gyro, r.force, r.field)
    assert np.isnan(result.q_world_body_wxyz[0]).all()
    assert result.status[0] & EstimateStatus.NOT_FINITE
    assert np.isfinite(result.q_world_body_wxyz[1:]).all()
    assert result.status[50] & EstimateStatus.NOT_FINITE
    assert result.status[80] & EstimateStatus.TIME_NOT_INCREASING
    assert result.status[300] & (EstimateStatus.GAP | EstimateStatus.REINITIALISED)
    counts = filter_.counts()
    assert {k: v for k, v in counts.items() if "not_finite" in k} == {
        "imu.skipped.not_finite": 2,
        "magnetometer.skipped.not_finite": 1,
    }


N = 10
GOOD = {
    "times_ns": np.arange(N) * 5_000_000,
    "gyro": np.zeros((N, 3)),
    "force": np.ones((N, 3)),
    "magnetometer": np.ones((N, 3)),
}


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        ({"times_ns": np.arange(N, dtype=float)}, TypeError, "times_ns must have dtype int64, has float64"),
        ({"times_ns": list(range(N))}, TypeError, "times_ns must be a NumPy array of int64, not list"),
        ({"times_ns": np.arange(2 * N)[::2]}, ValueError, "times_ns must be C-contiguous"),
        ({"times_ns": np.zeros((N, 1), int)}, ValueError, r"times_ns must have shape \(N,\), has \(10, 1\)"),
        ({"gyro": np.zeros((N, 3), np.float32)}, TypeError, "gyro must have dtype float64, has float32"),
        ({"gyro": np.zeros((N, 4))}, ValueError, r"gyro must have shape \(N, 3\), has \(10, 4\)"),
        ({"gyro": np.zeros(3 * N)}, ValueError, r"gyro must have shape \(N, 3\), has \(30,\)"),
        ({"force": np.zeros((3, N)).T}, ValueError, "force must be C-contiguous"),
        (
            {"force": np.zeros((N - 1, 3))},
            ValueError,
            r"force must have as many rows as times_ns \(10\), has 9",
        ),
        (
            {"magnetometer": np.zeros((3, 3))},
            ValueError,
            r"magnetometer must have as many rows as times_ns \(10\)",
        ),
        (
            {"magnetometer_times_ns": np.arange(3)},
            ValueError,
            r"magnetometer must have as many rows as magnetometer_times_ns \(3\), has 10",
        ),
        (
            {"magnetometer_times_ns": np.array([0, 1, 2, 2, 4, 5, 6, 7, 8, 9])},
            ValueError,
            r"magnetometer_times_ns\[3\] = 2: must be after",
        ),
        ({"magnetometer": None, "magnetometer_times_ns": np.arange(3)}, ValueError, "without magnetometer"),
    ],
)
def test_run_names_what_is_wrong(change, error, text):
    filter_ = MadgwickFilter()
    with pytest.raises(error, match=text):
        filter_.run(**(GOOD | change))
    assert filter_.counts()["imu.used"] == 0
    filter_.run(**GOOD)


def test_options():
    options = MadgwickOptions.robust(beta=0.03, world="ned")
    assert (options.beta, options.world) == (0.03, "NED")
    assert options.rest_bias == MadgwickOptions.preset("robust").rest_bias
    assert MadgwickFilter(options).options.beta == 0.03
    assert MadgwickOptions().beta == MadgwickOptions.report().beta == 0.1
    assert "beta=0.03" in repr(options)
    with pytest.raises(ValueError, match="beta = -1"):
        MadgwickOptions(beta=-1)
    with pytest.raises(TypeError, match="MadgwickOptions has no field betta; it has: world, beta"):
        MadgwickOptions(betta=1)
    with pytest.raises(TypeError, match="beta must be a float, not 'a'"):
        MadgwickOptions(beta="a")
    with pytest.raises(ValueError, match="fast"):
        MadgwickOptions.preset("fast")
    with pytest.raises(ValueError, match="ESU"):
        MadgwickOptions(world="ESU")
    options.beta = float("nan")
    with pytest.raises(ValueError, match="beta"):
        MadgwickFilter(options)


def test_python_has_every_option_of_the_header():
    header = (CHECKOUT / "libloc/estimators/madgwick.hpp").read_text()
    struct = header[header.index("struct MadgwickOptions {") : header.index("static MadgwickOptions report")]
    fields = set(re.findall(r"^  (?:WorldFrame|double|bool) (\w+) =", struct, re.MULTILINE))
    assert len(fields) > 15
    assert fields == {name for name, value in vars(MadgwickOptions).items() if isinstance(value, property)}


def test_beta_from_gyro():
    noise = libloc.ImuNoise()
    assert libloc.beta_from_gyro(noise, 0.02, 0, 0, 0.01) > np.sqrt(3 / 4) * 0.02
    assert libloc.beta_from_gyro(noise, 0.02, 0.01, 2.0, 0.01) > libloc.beta_from_gyro(
        noise, 0.02, 0, 0, 0.01
    )
    with pytest.raises(ValueError, match="dt"):
        libloc.beta_from_gyro(noise, 0.02, 0, 0, -1)


def test_run_copies_nothing():
    n = 200_000
    r = turning_body(n, noise=0)
    for array in (r.times_ns, r.gyro, r.force, r.field):
        array.flags.writeable = False
    filter_ = MadgwickFilter()
    tracemalloc.start()
    try:
        result = filter_.run(r.times_ns, r.gyro, r.force, r.field)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    output = result.q_world_body_wxyz.nbytes + result.gyroscope_bias.nbytes + result.status.nbytes
    assert output == n * (32 + 24 + 4)
    assert peak < output + 100_000  # a copy of one input would add 4.8 MB
    assert result.q_world_body_wxyz is result.q_world_body_wxyz
    assert result.q_world_body_wxyz.flags.c_contiguous


def is_running(filter_: MadgwickFilter) -> bool:
    try:
        filter_.counts()
    except RuntimeError as error:
        assert "running in another thread" in str(error)
        return True
    return False


LONG = 1_500_000


def long_run(filter_: MadgwickFilter) -> None:
    force = np.zeros((LONG, 3))
    force[:, 2] = 9.81
    filter_.run(np.arange(LONG) * 1_000_000, np.zeros((LONG, 3)), force)


def test_other_threads_run_meanwhile():
    filter_ = MadgwickFilter()
    thread = threading.Thread(target=long_run, args=(filter_,))
    thread.start()
    seen = False
    while thread.is_alive() and not seen:
        seen = is_running(filter_)
    thread.join()
    assert seen, "run() kept the GIL from its start to its end"
    assert filter_.counts()["imu.used"] == LONG


def test_ctrl_c_ends_a_long_run():
    filter_ = MadgwickFilter()
    main_thread, over = threading.get_ident(), threading.Event()

    def interrupt():
        while not is_running(filter_):
            if over.is_set():
                return
        signal.pthread_kill(main_thread, signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    with pytest.raises(KeyboardInterrupt):
        thread.start()
        try:
            long_run(filter_)
        finally:
            over.set()
            thread.join()
    assert 0 < filter_.counts()["imu.used"] < LONG
