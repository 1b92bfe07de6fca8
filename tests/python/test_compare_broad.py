"""The accuracy table: its metric gives the peers' published figures, and its files hold what it prints."""

import json
import subprocess
import sys

import pytest
from support import CHECKOUT, data_folder

SCRIPT = CHECKOUT / "tests/bench/compare_broad.py"


def test_table(tmp_path):
    pytest.importorskip("vqf")
    pytest.importorskip("imufusion")
    folder = data_folder("broad")
    command = [sys.executable, SCRIPT, "--data", folder, "--only", "VQF", "--json", tmp_path / "t.json"]
    out = subprocess.run(
        [*command, "--png", tmp_path / "t.png"], capture_output=True, text=True, check=True
    ).stdout
    results = {r["method"].split()[-1]: r for r in json.loads((tmp_path / "t.json").read_text())}
    # On these ten trials; on all thirty the published means are 2.43 and 3.50.
    assert len(results["VQF"]["per_trial_deg"]) == 10
    assert results["VQF"]["mean_deg"]["total"] == pytest.approx(2.39, abs=0.03)
    assert results["BasicVQF"]["mean_deg"]["total"] == pytest.approx(3.37, abs=0.03)
    assert f"{results['VQF']['mean_deg']['total']:.2f}" in out
    assert (tmp_path / "t.png").stat().st_size > 10_000


def test_no_trials(tmp_path):
    pytest.importorskip("vqf")
    command = [sys.executable, SCRIPT, "--data", tmp_path]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 1
    assert "no .mat file" in run.stderr
