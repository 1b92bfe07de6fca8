"""loc-calibrate magnetometer as a user runs it, up to the orientation that comes out with its rig file."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from libloc.programs import calibrate, evaluate
from support import built_program, data_folder, turning_body, write_csv

import libloc

IRON = np.array([[1.1, 0.05, -0.03], [0.05, 0.92, 0.04], [-0.03, 0.04, 1.02]])  # soft iron
OFFSET = np.array([20e-6, -35e-6, 10e-6])  # hard iron [T]
PROGRAM = Path(sys.executable).with_name("loc-calibrate")


def run(capsys, *arguments, code=0) -> str:
    """In this process. Gives what it printed; with another code than 0, what went to stderr too."""
    assert calibrate.main([str(a) for a in arguments]) == code
    out = capsys.readouterr()
    assert "Traceback" not in out.err
    return out.out + out.err


def distorted(path, count=12_000):
    """A recording whose magnetometer is beside iron, and the clean one."""
    clean = turning_body(count)
    write_csv(path.with_name("clean.csv"), clean)
    bent = turning_body(count)
    bent.field = clean.field @ IRON + OFFSET
    write_csv(path, bent)
    return clean


def test_block_and_report(tmp_path, capsys):
    clean = distorted(tmp_path / "bent.csv")
    rig = tmp_path / "rig.yaml"
    text = run(
        capsys,
        "magnetometer",
        tmp_path / "bent.csv",
        "--no-alignment",
        "--field-ut",
        48.332,
        "--out",
        rig,
        "--report",
        tmp_path / "report",
    )
    assert "verdict ok" in text
    assert "12000 of 12000 readings fit" in text
    triad = libloc.read_rig(rig).magnetometer.triad
    assert np.all(np.abs(triad.bias - OFFSET) < 5 * triad.quality.bias_sigma)
    assert np.all(np.abs(triad.matrix - np.linalg.inv(IRON)) < 5 * triad.quality.matrix_sigma)
    assert (triad.quality.verdict, triad.quality.method) == (libloc.Verdict.OK, "robust")
    corrected = (clean.field @ IRON + OFFSET - triad.bias) @ triad.matrix.T
    assert np.abs(corrected - clean.field).max() < 0.15e-6

    names = {p.name for p in (tmp_path / "report").iterdir()}
    assert names == {"report.html", "spheres.png", "residuals.png", "coverage.png"}
    for name in names:
        assert (tmp_path / "report" / name).stat().st_size > 15_000
    html = (tmp_path / "report/report.html").read_text()
    assert html.count("data:image/png;base64,") == 3
    assert 'src="http' not in html and "<script" not in html  # self-contained
    assert "ok: use it" in html and "0.41 % after" in html


def test_other_blocks_are_kept(tmp_path, capsys):
    distorted(tmp_path / "bent.csv")
    rig = libloc.Rig()
    rig.imu = libloc.ImuCalibration()
    rig.imu.gyroscope.bias = [1 / 3, 0, -0.02]
    rig.gps = libloc.GpsCalibration()
    rig.magnetometer = libloc.MagnetometerCalibration()
    rig.magnetometer.triad.bias = [1, 1, 1]
    path = tmp_path / "rig.yaml"
    libloc.write_rig(path, rig)
    run(capsys, "magnetometer", tmp_path / "bent.csv", "--out", path)
    back = libloc.read_rig(path)
    assert back.imu.gyroscope.bias.tolist() == [1 / 3, 0, -0.02]
    assert back.gps is not None
    assert np.allclose(back.magnetometer.triad.bias, OFFSET, atol=1e-7)
    assert [p.name for p in tmp_path.glob("*.tmp")] == []


def test_orientation_comes_back(tmp_path, capsys):
    """Distorted, calibrated, and estimated by the real program with the rig: as good as undistorted."""
    estimator = built_program("loc-estimator")
    distorted(tmp_path / "bent.csv")
    rig = tmp_path / "rig.yaml"
    run(capsys, "magnetometer", tmp_path / "bent.csv", "--out", rig)

    def heading_error(name, *options):
        estimate = tmp_path / f"{name}{len(options)}.csv"
        subprocess.run(
            [estimator, "--input", tmp_path / name, "--output", estimate, *options],
            check=True,
            capture_output=True,
        )
        parser = evaluate.make_parser()
        numbers = evaluate.run(
            parser.parse_args(
                [str(estimate), "--reference", str(tmp_path / "clean.csv"), "--only", "orientation"]
            )
        )
        return numbers["orientation"]["total_deg"]["rmse"]

    clean = heading_error("clean.csv")
    bent = heading_error("bent.csv")
    calibrated = heading_error("bent.csv", "--config", rig)
    assert clean < 1.5
    assert bent > 20
    assert calibrated < clean + 0.3


def test_what_is_refused_is_not_written(tmp_path, capsys):
    """Lying still: no ellipsoid, or none that can be believed."""
    rng = np.random.default_rng(1)
    still = turning_body(500)
    still.field = np.array([20e-6, 0, -40e-6]) + 2e-7 * rng.normal(size=(500, 3))
    write_csv(tmp_path / "still.csv", still)
    rig = tmp_path / "rig.yaml"
    text = run(
        capsys, "magnetometer", tmp_path / "still.csv", "--out", rig, "--report", tmp_path / "r", code=3
    )
    assert "verdict refused" in text
    assert re.search(r"^  - \w+", text, re.MULTILINE), "a reason"
    assert not rig.exists()
    assert "refused" in (tmp_path / "r/report.html").read_text()

    # Turned about one axis only, and little: there is an ellipsoid, but a poor one.
    poor = turning_body(2000)
    angle = np.linspace(0, 0.6, 2000)
    poor.field = 48e-6 * np.stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(5 * angle)], axis=1) + OFFSET
    poor.field += 4e-7 * rng.normal(size=(2000, 3))
    write_csv(tmp_path / "poor.csv", poor)
    text = run(capsys, "magnetometer", tmp_path / "poor.csv", "--method", "sphere", "--out", rig, code=3)
    assert "--force" in text
    assert not rig.exists()
    text = run(capsys, "magnetometer", tmp_path / "poor.csv", "--method", "sphere", "--out", rig, "--force")
    assert "although it was refused" in text
    assert libloc.read_rig(rig).magnetometer.triad.quality.verdict == libloc.Verdict.REFUSED
    ((block, _, _),) = libloc.read_rig(rig).doubts()
    assert block == "magnetometer"


@pytest.mark.parametrize(("unit", "said"), [("t", "uT read as T"), ("mgauss", "uT read as mgauss")])
def test_a_wrong_unit_is_refused(tmp_path, capsys, unit, said):
    distorted(tmp_path / "bent.csv", 4000)
    text = (tmp_path / "bent.csv").read_text()
    (tmp_path / "wrong.csv").write_text(text.replace("mx_ut,my_ut,mz_ut", f"mx_{unit},my_{unit},mz_{unit}"))
    rig = tmp_path / "rig.yaml"
    assert said in run(capsys, "magnetometer", tmp_path / "wrong.csv", "--out", rig, code=3)
    assert not rig.exists()


def test_counts_need_the_strength_of_the_field(tmp_path, capsys):
    distorted(tmp_path / "bent.csv", 6000)
    rows = np.loadtxt(tmp_path / "bent.csv", delimiter=",", skiprows=1)[:, 7:10]
    np.savetxt(tmp_path / "counts.csv", rows / 0.3, fmt="%d", delimiter=",", header="mx,my,mz", comments="")
    rig = tmp_path / "rig.yaml"
    arguments = ("magnetometer", tmp_path / "counts.csv", "--magnetometer-unit", "counts", "--out", rig)
    text = run(capsys, *arguments)
    assert "verdict warn" in text
    assert "Give --field-ut, or --latitude, --longitude and --date." in text
    ((block, verdict, _),) = libloc.read_rig(rig).doubts()
    assert (block, verdict) == ("magnetometer", libloc.Verdict.WARN)
    text = run(capsys, *arguments, "--field-ut", 48.3)
    assert "verdict ok" in text
    assert libloc.read_rig(rig).doubts() == []


def test_a_damaged_rig_is_not_overwritten(tmp_path, capsys):
    distorted(tmp_path / "bent.csv", 2000)
    rig = tmp_path / "rig.yaml"
    rig.write_text("format: libloc-rig-1\nimu: {rate_hz: fast}\n...\n")
    assert "rig.yaml:2" in run(capsys, "magnetometer", tmp_path / "bent.csv", "--out", rig, code=1)
    assert "fast" in rig.read_text()
    assert "cannot be written" in run(
        capsys, "magnetometer", tmp_path / "bent.csv", "--out", tmp_path / "no/such/folder.yaml", code=1
    )


def test_data_errors(tmp_path, capsys):
    assert "no such file" in run(capsys, "magnetometer", tmp_path / "absent.csv", code=1)
    (tmp_path / "imu.csv").write_text(
        "time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2\n0,1,2,3,4,5,6\n"
    )
    assert "no magnetometer in it; it holds gyroscope (1), accelerometer (1)" in run(
        capsys, "magnetometer", tmp_path / "imu.csv", code=1
    )


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["sonar"],
        ["magnetometer"],
        ["magnetometer", "x.csv", "--live"],
        ["magnetometer", "x.csv", "--method", "magic"],
        ["magnetometer", "x.csv", "--field-ut", "-3"],
        ["magnetometer", "x.csv", "--field-ut", "nan"],
        ["magnetometer", "x.csv", "--field-ut", "14"],
        ["magnetometer", "x.csv", "--field-ut", "48000"],
        ["magnetometer", "x.csv", "--rate", "0"],
        ["magnetometer", "x.csv", "--out", "/"],
        ["magnetometer", "--live", "--duration", "0"],
    ],
)
def test_wrong_options(capsys, arguments):
    with pytest.raises(SystemExit) as error:
        calibrate.main(arguments)
    assert error.value.code == 2


def test_real_magnetometers(tmp_path, capsys):
    folder = data_folder("magnetometer")
    rig = tmp_path / "rig.yaml"
    text = run(
        capsys, "magnetometer", folder / "ckexplorer_acc_mag.csv", "--accelerometer-unit", "g",
        "--magnetometer-unit", "gauss", "--out", rig,
    )  # fmt: skip
    before, after = map(float, re.search(r"([\d.]+) % before, ([\d.]+) % after", text).groups())
    assert before == pytest.approx(32, abs=1)
    assert after <= 1.26  # 1.2551 % is the least that any ellipsoid gives
    assert libloc.read_rig(rig).magnetometer.triad.quality.samples > 11_900

    text = run(
        capsys, "magnetometer", folder / "jremington_mag3_raw.csv", "--columns", "mx,my,mz",
        "--magnetometer-unit", "counts", "--field-ut", "53", "--out", rig,
    )  # fmt: skip
    assert "4.40 radii off zero" in text
    triad = libloc.read_rig(rig).magnetometer.triad
    counts = np.loadtxt(folder / "jremington_mag3_raw.csv", delimiter=",")
    norm = np.linalg.norm((counts - triad.bias) @ triad.matrix.T, axis=1)
    assert np.median(norm) == pytest.approx(53e-6, rel=0.01)


def test_installed_program(tmp_path):
    if not PROGRAM.is_file():
        pytest.skip(f"{PROGRAM} is not installed")
    distorted(tmp_path / "bent.csv", 6000)
    out = subprocess.run(
        [PROGRAM, "magnetometer", tmp_path / "bent.csv", "--out", tmp_path / "rig.yaml"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "Block magnetometer was written" in out.stdout
    assert subprocess.run([PROGRAM, "--help"], capture_output=True, check=True).stdout
