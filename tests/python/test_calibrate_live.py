"""loc-calibrate magnetometer --live against the real hub and driver."""

import os
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import loc
import numpy as np
import pytest
from libloc.programs import calibrate, calibrate_live
from scipy.spatial.transform import Rotation
from support import FIELD_ENU, built_program, turning_body, write_csv

import libloc

CALIBRATE = [sys.executable, "-m", "libloc.programs.calibrate", "magnetometer"]
OFFSET = np.array([20e-6, -35e-6, 10e-6])


def tumbling(path, seconds=60, rate_hz=100):
    """A device that is turned so that it sees the field from all sides within half a minute."""
    count = seconds * rate_hz
    r = turning_body(count, rate_hz)
    t = np.arange(count) / rate_hz
    rotation = Rotation.from_euler("zy", np.stack([1.7 * t, np.pi * np.sin(0.21 * t)], axis=1))
    r.field = rotation.inv().apply(FIELD_ENU) + OFFSET
    r.field += 2e-7 * np.random.default_rng(3).normal(size=(count, 3))
    write_csv(path, r)


@contextmanager
def hub():
    with subprocess.Popen(
        [built_program("loc-hub"), "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()


def start(url, *arguments):
    return subprocess.Popen(
        [*CALIBRATE, "--live", "--lcm-url", url, *map(str, arguments)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
        # A test run in the background ignores Ctrl-C, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip


def wait_for(process, text):
    """Lines of stderr up to the one that holds text."""
    lines = []
    for line in process.stderr:
        lines.append(line)
        if text in line:
            return lines
    raise AssertionError("".join(lines))


def drive(url, recording, speed):
    return subprocess.Popen(
        [built_program("loc-driver"), "csv", recording, "--lcm-url", url, "--speed", str(speed)],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


def test_it_says_how_to_turn_and_ends_when_enough_was_seen(tmp_path, capsys):
    tumbling(tmp_path / "turn.csv")
    rig, report = tmp_path / "rig.yaml", tmp_path / "report"
    with hub() as url:
        live = start(url, "--out", rig, "--report", report)
        wait_for(live, "no ellipsoid yet")  # it listens
        driver = drive(url, tmp_path / "turn.csv", 4)
        out, progress = live.communicate(timeout=60)
        driver.terminate()
        driver.wait()
    assert live.returncode == 0, progress
    assert "verdict ok" in out
    assert "enough directions were seen" in progress
    assert (
        "until its" in progress
    )  # "Turn about the sensor's +z axis ... until its ... points along the field"
    cells = [int(n) for n in re.findall(r"(\d+) of 100 directions", progress)]
    assert cells[0] < 40 < cells[-1]
    assert np.abs(libloc.read_rig(rig).magnetometer.triad.bias - OFFSET).max() < 0.2e-6
    names = {p.name for p in report.iterdir()}
    assert {"progress.png", "report.html", "readings.csv", "spheres.png"} <= names
    assert (report / "progress.png").read_bytes().startswith(b"\x89PNG")

    # What was kept is a recording, and gives the same calibration.
    assert (
        calibrate.main(["magnetometer", str(report / "readings.csv"), "--out", str(tmp_path / "again.yaml")])
        == 0
    )
    first, second = rig.read_text(), (tmp_path / "again.yaml").read_text()
    assert first == second
    capsys.readouterr()


def test_the_end_of_the_source_ends_it(tmp_path):
    """Too little to be believed: refused."""
    tumbling(tmp_path / "turn.csv", seconds=2)
    with hub() as url:
        live = start(url, "--out", tmp_path / "rig.yaml")
        wait_for(live, "no ellipsoid yet")
        drive(url, tmp_path / "turn.csv", 1).wait(timeout=30)
        out, progress = live.communicate(timeout=30)
    assert "the source has ended" in progress
    assert live.returncode == 3, out
    assert not (tmp_path / "rig.yaml").exists()


def test_nothing_to_hear():
    code = subprocess.run(
        [*CALIBRATE, "--live", "--lcm-url", "tcpq://127.0.0.1:1"], capture_output=True, text=True, check=False
    )
    assert code.returncode == 1
    assert "loc-hub" in code.stderr
    assert "Traceback" not in code.stderr
    with hub() as url:
        live = start(url, "--patience", 1)
        _, progress = live.communicate(timeout=30)
    assert live.returncode == 1
    assert "no reading on LOC_MAGNETOMETER" in progress
    assert "loc-driver" in progress


def test_interrupted(tmp_path):
    tumbling(tmp_path / "turn.csv")
    with hub() as url:
        live = start(url, "--out", tmp_path / "rig.yaml")
        wait_for(live, "no ellipsoid yet")
        driver = drive(url, tmp_path / "turn.csv", 1)
        wait_for(live, "centre known to")
        live.send_signal(signal.SIGINT)
        _, errors = live.communicate(timeout=30)
        driver.terminate()
        driver.wait()
    assert live.returncode == 130
    assert "interrupted, nothing was written" in errors
    assert "Traceback" not in errors
    assert not (tmp_path / "rig.yaml").exists()


def test_a_hub_that_was_started_anew_is_found(tmp_path):
    tumbling(tmp_path / "turn.csv")
    program = built_program("loc-hub")
    first = subprocess.Popen(
        [program, "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    url = first.stdout.readline().strip()
    live = start(url, "--report", tmp_path / "report", "--duration", 20)
    wait_for(live, "no ellipsoid yet")
    first.kill()
    first.communicate()
    second = subprocess.Popen([program, "--port", url.rsplit(":", 1)[1]], stderr=subprocess.DEVNULL)
    time.sleep(1.5)
    driver = drive(url, tmp_path / "turn.csv", 4)
    out, progress = live.communicate(timeout=60)
    for process in (driver, second):
        process.terminate()
        process.wait()
    assert live.returncode == 0, progress
    assert re.search(r"connections\.lost: [1-9]", out)


def test_what_is_no_reading_is_counted():
    parser = calibrate.make_parser()
    options = parser.parse_args(["magnetometer", "--live"])
    collection = calibrate_live.Collection(libloc.EllipsoidCollector())
    m = loc.magnetometer_t()
    for sequence, x in ((0, 1e-5), (1, 2e-5), (5, float("nan"))):
        m.sequence, m.magnetic_field = sequence, [x, 0, 0]
        assert collection.take("LOC_MAGNETOMETER", m.encode(), options)
    for data in (b"garbage", m.encode()[:-1], loc.imu_t().encode()):
        assert not collection.take("LOC_MAGNETOMETER", data, options)
    assert collection.counts == {
        "magnetometer.received": 3,
        "magnetometer.lost": 3,
        "LOC_MAGNETOMETER.refused": 3,
    }
    assert len(collection.collector.kept) == 2  # without the NaN
    readings = collection.readings("here")
    assert readings.accelerometer is None
    assert np.isnan(readings.magnetometer.rows[2, 0])


def test_the_map_of_directions():
    coverage = np.zeros((10, 10), dtype=np.int32)
    coverage[9, 0], coverage[0, 9] = 1, 100
    lines = calibrate_live.coverage_map(coverage, "utf-8")
    assert len(lines) == 10
    assert lines[0] == "░░" + 18 * "·"  # up is +z
    assert lines[9] == 18 * "·" + "██"
    assert calibrate_live.coverage_map(coverage, "ascii")[9] == 18 * "." + "##"


@pytest.mark.parametrize("encoding", [None, "no-such-encoding"])
def test_the_map_on_odd_terminals(encoding):
    assert calibrate_live.coverage_map(np.zeros((10, 10), dtype=np.int32), encoding)[0] == 20 * "."
