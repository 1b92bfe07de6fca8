"""The table of spoilt real tracks: what it says of them, and of a folder that does not hold them."""

import json
import subprocess
import sys

import pytest
from support import CHECKOUT, data_folder

SCRIPT = CHECKOUT / "tests/bench/compare_slam_robustness.py"


@pytest.mark.slow
def test_table(tmp_path):
    folder = data_folder("euroc-v101-tracks")
    command = [sys.executable, SCRIPT, "--data", folder, "--seeds", "1", "--json", tmp_path / "t.json"]
    out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    runs = {(r["method"], r["spoilt"]): r for r in json.loads((tmp_path / "t.json").read_text())}
    assert len(runs) == 8
    clean = runs["inertial", "clean"]
    assert clean["rmse_m"] < 0.025 and clean["scale"] == pytest.approx(1, abs=0.01)
    assert clean["flagged"] == 0 and clean["flagged_dark"] is None
    for spoilt in ("outliers", "dropped", "dark"):
        assert runs["inertial", spoilt]["rmse_m"] < 2 * clean["rmse_m"]
    assert runs["inertial", "dark"]["flagged_dark"] > 0.7
    assert runs["camera", "clean"]["rmse_m"] < 0.06
    assert f"{clean['rmse_m']:.4f}" in out


def test_no_recording(tmp_path):
    run = subprocess.run(
        [sys.executable, SCRIPT, "--data", tmp_path], capture_output=True, text=True, check=False
    )
    assert run.returncode == 1
    assert "tracks_and_imu.csv" in run.stderr
