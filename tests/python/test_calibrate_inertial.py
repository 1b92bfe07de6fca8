"""loc-calibrate accelerometer, gyroscope, imu-noise and clock, and the magnetometer's rotation to the IMU."""

import os
import re

import loc
import numpy as np
import pytest
from libloc.lcm_log import LogWriter
from libloc.programs import calibrate
from scipy.spatial.transform import Rotation, Slerp
from support import GRAVITY, data_folder, turning_body, write_csv

import libloc

SCALE = np.array([[1.01, 0.002, -0.004], [0.002, 0.985, 0.003], [-0.004, 0.003, 1.02]])
OFFSET = np.array([0.3, -0.2, 0.1])  # [m/s^2]
GYRO_BIAS = np.array([0.02, -0.01, 0.005])  # [rad/s]
GYRO_MATRIX = np.array([[1.03, 0.02, -0.03], [-0.015, 0.97, 0.01], [0.005, -0.025, 1.01]])  # not symmetric
RATE = 100


def run(capsys, *arguments, code=0) -> str:
    assert calibrate.main([str(a) for a in arguments]) == code, capsys.readouterr()
    out = capsys.readouterr()
    assert "Traceback" not in out.err
    return out.out + out.err


def poses(path, count=24, seed=5, gyro_matrix=GYRO_MATRIX):
    """A device that is put down in random poses; accelerometer and gyroscope distorted."""
    rng = np.random.default_rng(seed)
    still, turn = 2.0, 1.0
    t = np.arange(round(count * (still + turn) * RATE)) / RATE
    keys = np.repeat(np.arange(count) * (still + turn), 2)
    keys[1::2] += still
    phase = np.interp(t, keys, np.repeat(np.arange(count), 2))
    whole = np.minimum(np.floor(phase), count - 2)
    part = phase - whole
    smooth = whole + part**3 * (10 - 15 * part + 6 * part**2)
    rotation = Slerp(np.arange(count), Rotation.random(count, rng=rng))(np.clip(smooth, 0, count - 1))
    gyro = np.zeros((len(t), 3))
    gyro[1:] = (rotation[:-1].inv() * rotation[1:]).as_rotvec() * RATE
    force = rotation.inv().apply([0, 0, GRAVITY])
    gyro = np.linalg.solve(gyro_matrix, gyro.T).T + GYRO_BIAS + 1e-3 * rng.normal(size=gyro.shape)
    force = np.linalg.solve(SCALE, force.T).T + OFFSET + 1e-2 * rng.normal(size=force.shape)
    lines = ["time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2"]
    for i in range(len(t)):
        cells = ",".join(repr(float(v)) for v in (*gyro[i], *force[i]))
        lines.append(f"{round(t[i] * 1e9)},{cells}")
    path.write_text("\n".join(lines) + "\n")


def test_accelerometer_and_gyroscope_into_one_rig(tmp_path, capsys):
    poses(tmp_path / "poses.csv")
    rig, report = tmp_path / "rig.yaml", tmp_path / "report"
    text = run(capsys, "accelerometer", tmp_path / "poses.csv", "--out", rig, "--report", report)
    assert "24 still poses" in text
    assert "verdict ok" in text
    run(capsys, "gyroscope", tmp_path / "poses.csv", "--out", rig, "--report", tmp_path / "gyro")
    imu = libloc.read_rig(rig).imu
    assert imu.rate_hz == RATE
    a, g = imu.accelerometer, imu.gyroscope
    assert np.abs(a.bias - OFFSET).max() < 0.01
    assert np.all(np.abs(a.bias - OFFSET) < 5 * a.quality.bias_sigma)
    assert np.all(np.abs(a.matrix - SCALE) < 5 * a.quality.matrix_sigma)
    assert (a.quality.method, a.quality.samples) == ("still-poses", 24)
    assert np.abs(g.bias - GYRO_BIAS).max() < 5e-4
    assert np.abs(g.matrix - GYRO_MATRIX).max() < 5e-3  # a transposed one is off by 0.035
    assert np.all(np.abs(g.matrix - GYRO_MATRIX) < 5 * g.quality.matrix_sigma)
    names = {p.name for p in report.iterdir()}
    assert names == {"report.html", "stillness.png", "residuals.png", "spheres.png", "coverage.png"}
    names = {p.name for p in (tmp_path / "gyro").iterdir()}
    assert names == {"report.html", "stillness.png", "bias.png", "turns.png"}


def test_few_poses_are_refused_or_warned_of(tmp_path, capsys):
    rig = tmp_path / "rig.yaml"
    poses(tmp_path / "six.csv", count=6)
    text = run(capsys, "accelerometer", tmp_path / "six.csv", "--out", rig, code=3)
    assert "at least 9" in text
    assert not rig.exists()
    poses(tmp_path / "ten.csv", count=10)
    text = run(capsys, "accelerometer", tmp_path / "ten.csv", "--out", rig)
    assert "verdict warn" in text
    ((block, _, _),) = libloc.read_rig(rig).doubts()
    assert block == "imu.accelerometer"


@pytest.mark.parametrize(
    ("sensor", "heading", "wrong", "said"),
    [
        ("gyroscope", "wx_rad_s,wy_rad_s,wz_rad_s", "wx_deg_s,wy_deg_s,wz_deg_s", "rad/s read as deg/s"),
        ("accelerometer", "ax_m_s2,ay_m_s2,az_m_s2", "ax_g,ay_g,az_g", "m/s^2 read as g"),
        ("accelerometer", "ax_m_s2,ay_m_s2,az_m_s2", "ax_mg,ay_mg,az_mg", "m/s^2 read as mg"),
    ],
)
def test_a_wrong_unit_is_refused(tmp_path, capsys, sensor, heading, wrong, said):
    poses(tmp_path / "poses.csv")
    text = (tmp_path / "poses.csv").read_text()
    assert heading in text
    (tmp_path / "wrong.csv").write_text(text.replace(heading, wrong))
    rig = tmp_path / "rig.yaml"
    assert said in run(capsys, sensor, tmp_path / "wrong.csv", "--out", rig, code=3)
    assert not rig.exists()
    run(capsys, sensor, tmp_path / "wrong.csv", "--out", rig, "--force")
    ((block, verdict, _),) = libloc.read_rig(rig).doubts()
    assert (block, verdict) == (f"imu.{sensor}", libloc.Verdict.REFUSED)


def test_gyroscope_alone_gives_the_bias_and_keeps_the_scale(tmp_path, capsys):
    poses(tmp_path / "poses.csv", count=4)
    table = np.loadtxt(tmp_path / "poses.csv", delimiter=",", skiprows=1)
    lines = [f"{int(row[0])},{row[1]!r},{row[2]!r},{row[3]!r}" for row in table.astype(float).tolist()]
    (tmp_path / "gyro.csv").write_text("time_ns,wx_rad_s,wy_rad_s,wz_rad_s\n" + "\n".join(lines) + "\n")
    rig = tmp_path / "rig.yaml"

    def known_scale(r):
        r.imu = libloc.ImuCalibration()
        r.imu.gyroscope.matrix = np.diag([1.1, 1.2, 1.3])

    libloc.update_rig(rig, known_scale)
    text = run(capsys, "gyroscope", tmp_path / "gyro.csv", "--out", rig)
    assert "verdict fair" in text
    assert "Its axes" not in text
    gyroscope = libloc.read_rig(rig).imu.gyroscope
    assert np.abs(gyroscope.bias - GYRO_BIAS).max() < 3e-4
    assert np.array_equal(gyroscope.matrix, np.diag([1.1, 1.2, 1.3]))
    # In counts a bias alone is worth nothing.
    counts = "time_ns,wx,wy,wz\n" + "\n".join(lines) + "\n"
    (tmp_path / "counts.csv").write_text(counts)
    text = run(capsys, "gyroscope", tmp_path / "counts.csv", "--gyroscope-unit", "counts", code=1)
    assert "in counts" in text


def test_a_bias_alone_has_no_axes_to_speak_of(tmp_path, capsys):
    """Too few turns for the matrix, although the accelerometer is there."""
    poses(tmp_path / "poses.csv", count=4)
    text = run(capsys, "gyroscope", tmp_path / "poses.csv")
    assert "turns used" not in text
    assert "Its axes" not in text
    poses(tmp_path / "poses.csv")
    assert "Its axes are those of the accelerometer" in run(capsys, "gyroscope", tmp_path / "poses.csv")


def test_real_xsens(tmp_path, capsys):
    folder = data_folder("imu-tk-xsens")
    counts = ("--accelerometer-unit", "counts", "--gyroscope-unit", "counts")
    rig = tmp_path / "rig.yaml"
    files = folder / "xsens_acc.mat", folder / "xsens_gyro.mat"
    text = run(capsys, "accelerometer", *files, *counts, "--out", rig)
    assert int(re.search(r"(\d+) still poses", text)[1]) >= 36
    assert float(re.search(r"fit +([\d.]+) mg", text)[1]) <= 0.11
    assert float(re.search(r"leave one out +([\d.]+) mg", text)[1]) <= 0.16
    text = run(capsys, "gyroscope", *reversed(files), *counts, "--out", rig)
    imu = libloc.read_rig(rig).imu
    counts_per_g = GRAVITY / np.cbrt(np.linalg.det(imu.accelerometer.matrix))
    assert counts_per_g == pytest.approx(4061, rel=0.01)
    assert np.rad2deg(np.cbrt(np.linalg.det(imu.gyroscope.matrix))) == pytest.approx(0.012, rel=0.01)


def write_still(path, seconds, seed=2):
    rng = np.random.default_rng(seed)
    n = seconds * RATE
    gyro = 2e-3 * rng.normal(size=(n, 3)) + np.cumsum(2e-5 * rng.normal(size=(n, 3)), axis=0)
    force = 2e-2 * rng.normal(size=(n, 3)) + [0, 0, GRAVITY]
    rows = (",".join(map(repr, row)) for row in np.hstack([gyro, force]).tolist())
    lines = [f"{i * 10_000_000},{row}" for i, row in enumerate(rows)]
    path.write_text("time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2\n" + "\n".join(lines) + "\n")


def test_noise(tmp_path, capsys):
    write_still(tmp_path / "still.csv", 600)
    rig = tmp_path / "rig.yaml"

    def known_walk(r):
        r.imu = libloc.ImuCalibration()
        r.imu.noise.accelerometer_random_walk = 1e-9
        r.imu.noise_measured = ["accelerometer_random_walk"]
        r.imu.gyroscope.bias = [1, 2, 3]

    libloc.update_rig(rig, known_walk)
    text = run(capsys, "imu-noise", tmp_path / "still.csv", "--out", rig, "--report", tmp_path / "r")
    imu = libloc.read_rig(rig).imu
    assert imu.noise.gyroscope_noise_density == pytest.approx(2e-4, rel=0.02)  # sigma / sqrt(rate)
    assert imu.noise.accelerometer_noise_density == pytest.approx(2e-3, rel=0.02)
    assert imu.noise.gyroscope_random_walk == pytest.approx(2e-4, rel=0.4)  # step * sqrt(rate)
    assert {"gyroscope_noise_density", "accelerometer_noise_density"} <= set(imu.noise_measured)
    # There is no walk in the accelerometer: what an earlier recording said stays.
    assert imu.noise.accelerometer_random_walk == 1e-9
    assert "accelerometer_random_walk" in imu.noise_measured
    assert imu.gyroscope.bias.tolist() == [1, 2, 3]
    assert imu.rate_hz == RATE
    assert "not measured" in text
    assert {p.name for p in (tmp_path / "r").iterdir()} == {"report.html", "allan.png"}


def test_noise_in_a_wrong_unit_is_warned_of(tmp_path, capsys):
    write_still(tmp_path / "still.csv", 120)
    text = (tmp_path / "still.csv").read_text()
    assert "verdict fair" in run(capsys, "imu-noise", tmp_path / "still.csv")
    (tmp_path / "g.csv").write_text(text.replace("ax_m_s2,ay_m_s2,az_m_s2", "ax_g,ay_g,az_g"))
    said = run(capsys, "imu-noise", tmp_path / "g.csv")
    assert "verdict warn" in said
    assert "shows 96.17 m/s^2, gravity is 9.81 m/s^2. A wrong unit? It looks like m/s^2 read as g." in said
    table = np.loadtxt(tmp_path / "still.csv", delimiter=",", skiprows=1)
    lines = [f"{int(row[0])},{','.join(repr(v) for v in np.rad2deg(row[1:4]).tolist())}" for row in table]
    (tmp_path / "deg.csv").write_text("time_ns,wx_rad_s,wy_rad_s,wz_rad_s\n" + "\n".join(lines) + "\n")
    said = run(capsys, "imu-noise", tmp_path / "deg.csv")
    assert "verdict warn" in said
    assert "no gyroscope is so noisy. A wrong unit? It looks like deg/s read as rad/s." in said


def test_noise_of_a_moving_device_is_refused(tmp_path, capsys):
    write_csv(tmp_path / "moving.csv", turning_body(4000))
    run(capsys, "imu-noise", tmp_path / "moving.csv", "--out", tmp_path / "rig.yaml", code=3)
    assert not (tmp_path / "rig.yaml").exists()


def test_clock(tmp_path, capsys):
    device, host, _ = libloc.simulate_clock("usb_imu", 600.0, libloc.Random(3))
    rows = "\n".join(f"{d},{h}" for d, h in zip(device.tolist(), host.tolist(), strict=True))
    (tmp_path / "clock.csv").write_text("device_ns,host_ns\n" + rows + "\n")
    rig = tmp_path / "rig.yaml"

    def other_clocks(r):
        r.clocks = [libloc.ClockCalibration("imu", "host"), libloc.ClockCalibration("imu", "gps")]

    libloc.update_rig(rig, other_clocks)
    text = run(capsys, "clock", tmp_path / "clock.csv", "--out", rig, "--report", tmp_path / "r")
    assert "verdict ok" in text
    gps, imu = libloc.read_rig(rig).clocks
    assert (gps.reference, gps.skew_ppm) == ("gps", 0)
    assert (imu.stream, imu.reference) == ("imu", "host")
    assert imu.skew_ppm == pytest.approx(50, abs=1)
    assert imu.offset_sigma_s < 5e-6
    assert 4e-3 < imu.jitter_p99_s < 8e-3
    assert {p.name for p in (tmp_path / "r").iterdir()} == {"report.html", "arrivals.png"}

    # The same as messages in a log.
    with LogWriter(tmp_path / "clock.lcm") as log:
        for i, (d, h) in enumerate(zip(device.tolist(), host.tolist(), strict=True)):
            m = loc.imu_t()
            m.time_ns, m.host_time_ns, m.sequence = d, h, i
            log.write("LOC_IMU", m, max(h // 1000, 0))
    again = tmp_path / "again.yaml"
    run(capsys, "clock", tmp_path / "clock.lcm", "--out", again)
    assert libloc.read_rig(again).clocks[0].skew_ppm == imu.skew_ppm
    text = run(capsys, "clock", tmp_path / "clock.lcm", "--stream", "gps", code=1)
    assert "no message of the stream gps" in text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2\n", "--columns device_ns,host_ns"),
        ("device_ns,arrival\n1,2\n", "'arrival' is not known"),
        ("device_ns,host\n1,2\n", "give its unit"),
        ("device_ns,-\n1,2\n", "one of the host's are needed"),
        ("device_ns,host_ns\n1,2\n1,x\n", "clock.csv:3: 'x' is no time"),
        ("device_ns,host_ns\n1,2\n1\n", "clock.csv:3: 1 cells, not 2"),
    ],
)
def test_stamps_that_cannot_be_read(tmp_path, capsys, text, message):
    (tmp_path / "clock.csv").write_text(text)
    assert message in run(capsys, "clock", tmp_path / "clock.csv", code=1)


def test_a_recording_without_arrivals(tmp_path, capsys):
    path = data_folder("broad") / "01_undisturbed_slow_rotation_A.mat"
    assert "does not say when its samples arrived" in run(capsys, "clock", path, code=1)


def test_gps_latency_of_the_pntos_drive(tmp_path, capsys):
    if "LIBLOC_PNTOS_LOG" not in os.environ:
        pytest.skip("LIBLOC_PNTOS_LOG does not name cobra_gps_ins_example_data.log")
    rig = tmp_path / "rig.yaml"

    def lever_arm(r):
        r.gps = libloc.GpsCalibration()
        r.gps.antenna_in_body = [0.1, 0.2, 0.3]

    libloc.update_rig(rig, lever_arm)
    text = run(
        capsys, "gps-latency", os.environ["LIBLOC_PNTOS_LOG"], "--out", rig, "--report", tmp_path / "r"
    )
    gps = libloc.read_rig(rig).gps
    assert gps.time_offset_s == pytest.approx(-0.20, abs=0.02)
    assert 0 < gps.time_offset_sigma_s < 0.03
    assert gps.antenna_in_body.tolist() == [0.1, 0.2, 0.3]
    before, after = map(float, re.search(r"([\d.]+) m as stamped, ([\d.]+) m with", text).groups())
    assert (before, after) == (pytest.approx(2.48, abs=0.02), pytest.approx(1.62, abs=0.02))
    assert {p.name for p in (tmp_path / "r").iterdir()} == {"report.html", "latency.png"}


def test_gps_latency_needs_fixes_and_a_reference(tmp_path, capsys):
    r = turning_body(50)
    write_csv(tmp_path / "own.csv", r)
    assert "no GPS fix" in run(capsys, "gps-latency", tmp_path / "own.csv", code=1)
    with LogWriter(tmp_path / "gps.lcm") as log:
        fix = loc.gps_fix_t()
        fix.time_ns, fix.fix_type = 10**18, 3
        log.write("LOC_GPS", fix, 10**15)
    assert "no reference trajectory" in run(capsys, "gps-latency", tmp_path / "gps.lcm", code=1)


def test_local_positions():
    """Against the formulas of the ellipsoid."""
    origin = np.array([0.8, 0.2, 100.0])
    points = np.array([origin, [0.8001, 0.2, 100.0], [0.8, 0.2001, 100.0], [0.8, 0.2, 350.0], [np.nan] * 3])
    got = libloc.local_positions(points, origin)
    a, e2 = 6378137.0, 6.69437999014e-3
    w = 1 - e2 * np.sin(0.8) ** 2
    meridian, normal = a * (1 - e2) / w**1.5, a / np.sqrt(w)
    assert np.allclose(got[0], 0, atol=1e-8)
    assert got[1, :2] == pytest.approx([0, 1e-4 * (meridian + 100)], abs=0.05)
    assert got[2, :2] == pytest.approx([1e-4 * (normal + 100) * np.cos(0.8), 0], abs=0.05)
    assert got[3] == pytest.approx([0, 0, 250], abs=1e-8)
    assert np.isnan(got[4]).all()
    with pytest.raises(ValueError, match="origin"):
        libloc.local_positions(points, [2, 0, 0])


def test_magnetometer_is_turned_to_the_imu(tmp_path, capsys):
    """Mounted at an angle: the rig's matrix holds the rotation, and the field comes out in body axes."""
    r = turning_body(8000)
    clean = r.field.copy()
    mounted = Rotation.from_euler("zyx", [90, 10, -5], degrees=True)
    r.field = mounted.apply(clean) + np.array([20e-6, -35e-6, 10e-6])
    write_csv(tmp_path / "own.csv", r)
    rig = tmp_path / "rig.yaml"
    text = run(capsys, "magnetometer", tmp_path / "own.csv", "--field-ut", 48.332, "--out", rig)
    dip = float(re.search(r"dip +([\d.]+) ±", text)[1])
    assert dip == pytest.approx(65.556, abs=0.3)
    triad = libloc.read_rig(rig).magnetometer.triad
    corrected = (r.field - triad.bias) @ triad.matrix.T
    angle = np.arccos(
        np.clip(
            (corrected * clean).sum(1) / np.linalg.norm(corrected, axis=1) / np.linalg.norm(clean, axis=1),
            -1,
            1,
        )
    )
    assert np.rad2deg(np.sqrt(np.mean(angle**2))) < 0.5
    # Without it the matrix is symmetric.
    text = run(capsys, "magnetometer", tmp_path / "own.csv", "--out", rig, "--no-alignment")
    assert "keep the magnetometer's own axes" in text
    matrix = libloc.read_rig(rig).magnetometer.triad.matrix
    assert np.array_equal(matrix, matrix.T)


def test_magnetometer_is_turned_to_the_calibrated_imu(tmp_path, capsys):
    """The rig's IMU decides where body's axes are: here its chip is turned by 25 deg, scaled and offset."""
    r = turning_body(8000)
    clean = r.field.copy()
    chip = Rotation.from_euler("zyx", [25, -10, 5], degrees=True).as_matrix()
    r.field = Rotation.from_euler("zyx", [90, 10, -5], degrees=True).apply(clean)
    gyro, force = chip @ GYRO_MATRIX, chip @ SCALE
    r.gyro = np.linalg.solve(gyro, r.gyro.T).T + GYRO_BIAS
    r.force = np.linalg.solve(force, r.force.T).T + OFFSET
    write_csv(tmp_path / "own.csv", r)

    def calibrated(rig):
        rig.imu = libloc.ImuCalibration()
        rig.imu.gyroscope.matrix, rig.imu.gyroscope.bias = gyro, GYRO_BIAS
        rig.imu.accelerometer.matrix, rig.imu.accelerometer.bias = force, OFFSET

    def error_deg(path):
        triad = libloc.read_rig(path).magnetometer.triad
        corrected = (r.field - triad.bias) @ triad.matrix.T
        length = np.linalg.norm(corrected, axis=1) * np.linalg.norm(clean, axis=1)
        return np.rad2deg(np.arccos(np.clip((corrected * clean).sum(1) / length, -1, 1))).mean()

    libloc.update_rig(tmp_path / "rig.yaml", calibrated)
    run(capsys, "magnetometer", tmp_path / "own.csv", "--out", tmp_path / "rig.yaml")
    assert error_deg(tmp_path / "rig.yaml") < 0.5
    run(capsys, "magnetometer", tmp_path / "own.csv", "--out", tmp_path / "new.yaml")
    assert error_deg(tmp_path / "new.yaml") > 10


def test_the_altitude_is_heeded(tmp_path, capsys):
    """The field of a dipole falls with the cube of the distance: by 1.4 % in 30 km."""
    pytest.importorskip("pygeomag")
    write_csv(tmp_path / "own.csv", turning_body(4000))
    place = ("--latitude", 48.9, "--longitude", 2.4, "--date", "2024-06-01", "--no-alignment")
    expected, norms = [], []
    for altitude in (0, 30_000):
        rig = tmp_path / f"{altitude}.yaml"
        text = run(capsys, "magnetometer", tmp_path / "own.csv", *place, "--altitude", altitude, "--out", rig)
        expected.append(float(re.search(r"expected here +([\d.]+)", text)[1]))
        norms.append(np.cbrt(np.linalg.det(libloc.read_rig(rig).magnetometer.triad.matrix)))
    fallen = (6371 / 6401) ** 3
    assert expected[1] / expected[0] == pytest.approx(fallen, abs=2e-3)
    assert norms[1] / norms[0] == pytest.approx(fallen, abs=2e-3)


def test_the_magnetic_model(tmp_path, capsys):
    pytest.importorskip("pygeomag")
    r = turning_body(8000)
    write_csv(tmp_path / "own.csv", r)
    # Dip 65.6 deg and 48.3 uT: central Europe. In Singapore the field is level.
    rig = tmp_path / "rig.yaml"
    place = ("--latitude", 48.9, "--longitude", 2.4, "--date", "2024-06-01")
    text = run(capsys, "magnetometer", tmp_path / "own.csv", *place, "--out", rig)
    assert re.search(r"expected here +48\.\d+ uT, dip 6\d\.\d+ deg.*WMM", text)
    triad = libloc.read_rig(rig).magnetometer.triad
    assert triad.quality.verdict <= libloc.Verdict.FAIR
    norm = np.linalg.norm((r.field - triad.bias) @ triad.matrix.T, axis=1).mean()
    expected = float(re.search(r"expected here +([\d.]+)", text)[1])
    assert norm * 1e6 == pytest.approx(expected, rel=1e-3)
    singapore = ("--latitude", 1.35, "--longitude", 103.8, "--date", "2024-06-01")
    text = run(capsys, "magnetometer", tmp_path / "own.csv", *singapore)
    assert "verdict warn" in text
    assert "the model says" in text
    # What is said of the field is compared with the model, too.
    text = run(capsys, "magnetometer", tmp_path / "own.csv", *place, "--field-ut", 30)
    assert "verdict warn" in text
    assert "--field-ut: The field is 30 uT, the model says 48." in text


def test_the_order_of_calibrations_is_told(tmp_path, capsys):
    """The magnetometer is turned to the IMU's calibrated axes: what comes too early or too late is said."""
    write_csv(tmp_path / "own.csv", turning_body(8000))
    poses(tmp_path / "poses.csv")
    own, table, rig = tmp_path / "own.csv", tmp_path / "poses.csv", tmp_path / "rig.yaml"
    early, late = "No rig with a calibrated", "run loc-calibrate magnetometer again"
    assert f"{early} gyroscope and accelerometer" in run(capsys, "magnetometer", own, "--out", rig)
    assert late in run(capsys, "accelerometer", table, "--out", rig)
    assert f"{early} gyroscope was" in run(capsys, "magnetometer", own, "--out", rig)
    assert late in run(capsys, "gyroscope", table, "--out", rig)
    assert early not in run(capsys, "magnetometer", own, "--out", rig)
    # One that keeps its own axes does not depend on the IMU.
    text = run(capsys, "magnetometer", own, "--out", rig, "--no-alignment")
    assert early not in text
    assert late not in run(capsys, "accelerometer", table, "--out", rig)
    assert late not in run(capsys, "accelerometer", table, "--out", tmp_path / "new.yaml")


@pytest.mark.parametrize(
    "arguments",
    [
        ["accelerometer"],
        ["accelerometer", "x.csv", "--gravity", "1"],
        ["gyroscope", "x.csv", "--min-still", "0"],
        ["clock", "x.csv", "--stream", "sonar"],
        ["magnetometer", "x.csv", "--latitude", "50"],
        ["magnetometer", "x.csv", "--latitude", "95", "--longitude", "0", "--date", "2024-01-01"],
        ["magnetometer", "x.csv", "--latitude", "50", "--longitude", "0", "--date", "1990-01-01"],
        ["magnetometer", "x.csv", "--date", "yesterday"],
    ],
)
def test_wrong_options(capsys, arguments):
    with pytest.raises(SystemExit) as error:
        calibrate.main(arguments)
    assert error.value.code == 2
