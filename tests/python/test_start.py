"""The installed programs, at the very beginning: Ctrl-C while they still import."""

import os
import signal
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import libloc_start
import pytest
from support import CHECKOUT

SCRIPTS = tomllib.loads((CHECKOUT / "python" / "pyproject.toml").read_text())["project"]["scripts"]

# As if Ctrl-C were pressed at the moment in which a module is looked for.
INTERRUPTING = """
import os, signal, sys
class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == os.environ["INTERRUPT_AT"]:
            sys.meta_path.remove(self)
            print("importing", name, flush=True)
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupting())
"""


def run(folder: Path, program: str, at: str, ctrl_c=signal.SIG_DFL) -> subprocess.CompletedProcess:
    """What the installer's script does, with --version."""
    (folder / "sitecustomize.py").write_text(INTERRUPTING)
    module, _, function = SCRIPTS[program].partition(":")
    script = (
        f"import sys; from {module} import {function} as main; sys.argv[0] = '{program}'; sys.exit(main())"
    )
    path = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "-c", script, "--version"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env=os.environ | {"PYTHONPATH": path, "INTERRUPT_AT": at},
        # A test run in the background ignores Ctrl-C, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, ctrl_c),
    )


@pytest.mark.parametrize("program", SCRIPTS)
def test_ctrl_c_while_importing_ends_it_without_a_word(tmp_path, program):
    done = run(tmp_path, program, "numpy")
    assert done.stdout == "importing numpy\n"
    assert (done.returncode, done.stderr) == (130, "")


@pytest.mark.parametrize("at", ["libloc._core", "matplotlib", "libloc.programs.calibrate_camera_imu"])
def test_wherever_it_is(tmp_path, at):
    done = run(tmp_path, "loc-calibrate", at)
    assert done.stdout == f"importing {at}\n"
    assert (done.returncode, done.stderr) == (130, "")


def test_afterwards_it_is_the_programs_own(monkeypatch, capsys):
    """It may end with a result; where it does not look after it, there is no traceback all the same."""
    handlers = []

    def main() -> int:
        handlers.append(signal.getsignal(signal.SIGINT))
        raise KeyboardInterrupt

    monkeypatch.setattr(libloc_start, "import_module", lambda name: SimpleNamespace(main=main))
    monkeypatch.setattr(sys, "argv", ["/usr/bin/loc-evaluate", "x"])
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        assert libloc_start.evaluate() == 130
    finally:
        signal.signal(signal.SIGINT, before)
    assert handlers == [signal.default_int_handler]
    assert capsys.readouterr().err == "loc-evaluate: interrupted\n"


def test_it_stays_ignored_for_who_wishes_so(tmp_path):
    done = run(tmp_path, "loc-calibrate", "numpy", signal.SIG_IGN)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("importing numpy\n")
