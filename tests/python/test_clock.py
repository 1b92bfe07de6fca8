"""Clock models, GPS time and latency on arrays; peers in NumPy."""

import numpy as np
import pytest

import libloc
from libloc import ClockChain, ClockModel, CounterUnwrapper, DataError, GpsClock, Random, Verdict

SECOND = 1_000_000_000


def test_line_lies_under_the_samples_better_than_a_line_through_them():
    device, host, truth = libloc.simulate_clock("usb_imu", 300, Random(1))
    times, sigma = ClockModel().process(device, host)
    error = (times - truth)[device >= 120 * SECOND] * 1e-3
    assert error.std() < 2
    assert 0.3 < np.sqrt(np.mean((error * 1e3 / sigma[device >= 120 * SECOND]) ** 2)) < 2
    # NumPy's straight line through the same window is late by the mean jitter.
    x = (device - device[0]) * 1e-9
    y = (host - device - (host[0] - device[0])) * 1e-3
    through = np.polyval(np.polyfit(x, y, 1), x) + (host[0] - device[0] + device - truth) * 1e-3
    assert abs(through.mean()) > 100 * abs(error.mean())
    assert (np.diff(times) > 0).all()


def test_batches_do_not_matter():
    device, host, _ = libloc.simulate_clock("usb_imu", 60, Random(2))
    whole, pieces = ClockModel(), ClockModel()
    whole.update(device, host)
    for part in np.array_split(np.arange(len(device)), 7):
        pieces.update(device[part], host[part])
    assert whole.line.output_ref_ns == pieces.line.output_ref_ns
    assert whole.line.skew == pieces.line.skew
    assert whole.counts == pieces.counts
    assert whole.counts["samples"] == len(device)
    times, sigma = whole.convert(np.array([device[-1], device[-1] + 1000 * SECOND]))
    assert times[1] == libloc.NO_TIME and np.isnan(sigma[1])
    back, _ = whole.line.inverse().convert(times[:1])
    assert abs(back[0] - device[-1]) <= 1


def test_resets_are_counted():
    device, host, _ = libloc.simulate_clock("usb_imu", 100, Random(2))
    device = device.copy()
    device[10_000:] -= device[10_000]
    model = ClockModel(window_s=60)
    times, _ = model.process(device, host)
    assert model.counts["device_resets"] == 1 and model.epoch == 2
    assert (np.diff(times[times != libloc.NO_TIME]) > 0).all()


def test_wrong_arguments_are_named():
    with pytest.raises(ValueError, match="window_s = -1"):
        ClockModel(window_s=-1.0)
    with pytest.raises(TypeError, match="windows"):
        ClockModel(windows=1.0)
    with pytest.raises(TypeError, match="device_times_ns must have dtype int64, has float64"):
        ClockModel().update(np.zeros(3), np.zeros(3, np.int64))
    with pytest.raises(ValueError, match="host_times_ns must have as many rows as device_times_ns"):
        ClockModel().update(np.zeros(3, np.int64), np.zeros(2, np.int64))
    with pytest.raises(ValueError, match="label = 'last'"):
        GpsClock(label="last")
    with pytest.raises(TypeError, match="pulses"):
        GpsClock(pulses=True)
    with pytest.raises(ValueError, match="scenario = 'usb'"):
        libloc.simulate_clock("usb", 10, Random(1))


def test_counter():
    counter = CounterUnwrapper(bits=16, tick_numerator_ns=SECOND, tick_denominator=32768)
    ticks = np.arange(0, 500_000, 1000)
    assert (counter.unwrap(ticks & 0xFFFF) == ticks * SECOND // 32768).all()
    assert counter.wraps == 7


@pytest.mark.parametrize(("label", "label_next"), [("previous", False), ("next", True)])
def test_gps_time(label, label_next):
    pulse, host, gps, truth_host, truth_gps = libloc.simulate_gps_time(400, Random(1), label_next=label_next)
    clock = GpsClock(label=label)
    assert clock.line is None and clock.basis == "none"
    clock.update(pulse, host, gps)
    times, sigma = clock.convert(truth_host[-20:])
    assert np.abs(times - truth_gps[-20:]).max() < 20_000
    assert clock.basis == "pulses" and clock.counts["pulses_used"] == 400
    assert (sigma < 5_000).all()


def test_labels_only_say_so():
    pulse, host, gps, truth_host, truth_gps = libloc.simulate_gps_time(400, Random(1), with_pulses=False)
    clock = GpsClock()
    clock.update(pulse, host, gps)
    times, sigma = clock.convert(truth_host[-20:])
    assert clock.basis == "labels"
    assert (sigma > 30e6).all() and (np.abs(times - truth_gps[-20:]) < 3 * sigma).all()


def test_chain():
    device, host, truth = libloc.simulate_clock("usb_imu", 150, Random(3))
    pulse, event_host, gps, truth_host, truth_gps = libloc.simulate_gps_time(150, Random(4))
    chain = ClockChain()
    assert chain.convert(device[:1])[0][0] == libloc.NO_TIME
    chain.update(device, host)
    chain.update_gps(pulse, event_host, gps)
    part = slice(-1000, -400)  # the truth ends a second before the last sample
    times, sigma = chain.convert(device[part])
    expected = np.interp(truth[part] - truth_host[0], truth_host - truth_host[0], truth_gps - truth_gps[0])
    assert (np.abs(times - truth_gps[0] - expected) < 5 * sigma).all()
    assert (sigma < 10_000).all()
    assert chain.device_counts["used"] > 29_000 and chain.gps_counts["pulse_locks"] == 1


def test_calibrate_clock():
    device, host, _ = libloc.simulate_clock("usb_imu", 600, Random(1))
    result = libloc.calibrate_clock(device, host)
    assert result.quality.verdict == Verdict.OK
    assert result.skew_ppm == pytest.approx(50, abs=1)
    assert result.jitter_median_ns < result.jitter_p90_ns < result.jitter_p99_ns < result.jitter_max_ns
    assert result.rate_hz == pytest.approx(200)
    assert libloc.calibrate_clock(device[:10], host[:10]).quality.verdict == Verdict.REFUSED


def drive(offset_s):
    """Car on a plane, 50 Hz reference and 1 Hz stream whose stamps are off."""
    t = np.arange(0, 600, 0.02)
    speed = 10 + 6 * np.sin(0.3 * t)
    heading = 0.8 * np.sin(0.1 * t)
    velocity = np.column_stack([speed * np.cos(heading), speed * np.sin(heading), 0 * t])
    position = np.cumsum(velocity, axis=0) * 0.02
    start = 1_700_000_000 * SECOND
    reference_ns = start + (t * 1e9).astype(np.int64)
    at = np.arange(1000, len(t) - 1000, 50)
    noise = np.random.default_rng(1).normal(scale=0.3, size=(len(at), 3))
    return reference_ns[at] - int(offset_s * 1e9), position[at] + noise, reference_ns, position


def test_time_offset():
    times, positions, reference_ns, reference = drive(-0.2)
    result = libloc.estimate_time_offset(times, positions, reference_ns, reference, bias_sigma_m=0)
    assert result.offset_s == pytest.approx(-0.2, abs=5 * result.sigma_s)
    assert result.sigma_s < 0.02 and result.converged
    assert result.rms_after_m < result.rms_before_m
    assert result.quality.usable
    # A short drive in one direction: a constant error of the positions looks like an offset.
    doubted = libloc.estimate_time_offset(times, positions, reference_ns, reference)
    assert doubted.offset_s == result.offset_s
    assert doubted.sigma_s > 3 * result.sigma_s
    with pytest.raises(DataError, match=r"reference: times_ns\[1\]"):
        libloc.estimate_time_offset(times, positions, reference_ns[::-1].copy(), reference)
    with pytest.raises(ValueError, match="reference_positions must have as many rows"):
        libloc.estimate_time_offset(times, positions, reference_ns, reference[:-1])
    with pytest.raises(ValueError, match="max_offset_s = -1"):
        libloc.estimate_time_offset(times, positions, reference_ns, reference, max_offset_s=-1)
