"""The package as installed: types, stubs, entry points."""

import importlib.metadata
import subprocess
import sys
from pathlib import Path

import pytest
from support import CHECKOUT

import libloc

INSTALLED = Path(libloc.__file__).parent


def test_versions_agree():
    assert importlib.metadata.version("libloc") == libloc.__version__
    cmake = (CHECKOUT / "CMakeLists.txt").read_text()
    assert f"VERSION {libloc.__version__} " in cmake


def test_every_name_has_a_docstring():
    for name in dir(libloc._core):
        value = getattr(libloc._core, name)
        if not name.startswith("_") and not isinstance(value, str):
            assert value.__doc__, name


def test_stubs_are_up_to_date(tmp_path):
    pytest.importorskip("pybind11_stubgen")
    command = [sys.executable, "-m", "pybind11_stubgen", "--exit-code", "libloc._core", "-o", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True)
    made = {p.relative_to(tmp_path): p.read_text() for p in tmp_path.rglob("*.pyi")}
    assert len(made) == 2
    for path, text in made.items():
        committed = (CHECKOUT / "python" / path).read_text()
        assert committed == text, f"{path}: renew it: python -m pybind11_stubgen libloc._core -o python"
        assert (INSTALLED.parent / path).read_text() == text, f"{path}: install the package anew"
    assert (INSTALLED / "py.typed").is_file()


def test_a_typed_program_passes_mypy(tmp_path):
    pytest.importorskip("mypy")
    good = """
import numpy as np
import libloc
r = libloc.read_recording("x.csv")
result = libloc.MadgwickFilter(libloc.MadgwickOptions.robust(beta=0.02)).run(
    r.imu.times_ns, r.imu.angular_velocity, r.imu.specific_force)
error: float = libloc.orientation_error(result.q_world_body_wxyz, r.reference.q_world_body_wxyz).total_rmse
"""
    (tmp_path / "good.py").write_text(good)
    (tmp_path / "bad.py").write_text(good + "libloc.MadgwickFilter().run(1, 2, 3)\nlibloc.no_such_name\n")

    def mypy(name: str) -> str:
        command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache"), name]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False).stdout

    assert "Success: no issues" in mypy("good.py")
    bad = mypy("bad.py")
    assert 'Argument 1 to "run"' in bad
    assert '"no_such_name"' in bad
