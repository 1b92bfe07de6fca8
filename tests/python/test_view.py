"""loc-view, the program: what is written, served and refused."""

import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from contextlib import contextmanager
from pathlib import Path

import lcm
import loc
import numpy as np
import pytest
from libloc.programs import view
from PIL import Image
from support import built_program

rr = pytest.importorskip("rerun", reason="needs rerun-sdk")

from libloc.view import output, target  # noqa: E402
from view_support import START, camera_rig, image, messages, ride_log, stamped, write  # noqa: E402


@pytest.fixture
def ride(tmp_path):
    return ride_log(tmp_path)


@pytest.fixture
def rig(tmp_path):
    return camera_rig(tmp_path)


def test_wrong_input(tmp_path, capsys, ride, monkeypatch):
    def fails(*arguments):
        assert view.main([*map(str, arguments), "--save", str(tmp_path / "x.rrd")]) == 1
        assert not (tmp_path / "x.rrd").exists()
        assert not list(tmp_path.glob("*.rrd"))
        return capsys.readouterr().err

    assert "none.log" in fails(tmp_path / "none.log")
    (tmp_path / "text.log").write_text("time,x\n1,2\n" * 100)
    assert "is not an LCM log" in fails(tmp_path / "text.log")
    other = write(
        tmp_path / "other.log", [("LOC_IMU", stamped(loc.imu_t, START)), ("MY_IMAGES", image(START, 0))]
    )
    error = fails(other)
    assert "nothing to be drawn" in error
    assert "LOC_IMU, MY_IMAGES" in error
    assert view.main([str(ride), "--save", str(tmp_path / "none" / "x.rrd")]) == 1
    assert "none: no such folder" in capsys.readouterr().err
    assert "rig" in fails(ride, "--config", tmp_path / "rig.yaml")
    assert view.main([str(other), "--channel", "image=MY_IMAGES", "--save", str(tmp_path / "x.rrd")]) == 0
    assert "pictures.drawn = 1" in capsys.readouterr().out
    assert view.main([str(other), "--channel", "image=MY_IMAGES", "--save", str(tmp_path / "x.rrd")]) == 1
    assert "exists already" in capsys.readouterr().err

    monkeypatch.setattr(output, "_DRIVERS", ())
    monkeypatch.delenv("VK_DRIVER_FILES", raising=False)
    monkeypatch.delenv("VK_ICD_FILENAMES", raising=False)
    assert view.main([str(ride), "--screenshot", str(tmp_path / "x.png")]) == 1
    assert "apt-get install mesa-vulkan-drivers" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert view.main([str(ride), "--save", str(tmp_path / "y.rrd")]) == 1
    assert "pip install rerun-sdk" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--channel", "image"], "STREAM=NAME"),
        (["--channel", "no=X"], "no stream 'no'"),
        (["--channel", "gps=LOC_IMAGE"], "carries both"),
        (["--save", "x.txt"], "end with .rrd"),
        (["--screenshot", "x.jpg"], "end with .png"),
        (["--web", "--spawn"], "one viewer"),
        (["--spawn"], "no display"),
        (["--rate-hz", "0"], "positive"),
        (["--size", "10x10"], "200 to 8192"),
        (["--memory", "much"], "500MB"),
        (["--start", "-1"], "negative"),
        (["--camera", "-1"], "negative"),
    ],
)
def test_wrong_options(arguments, says, capsys, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(SystemExit) as error:
        view.main(["x.log", *arguments])
    assert error.value.code == 2
    assert says in capsys.readouterr().err


# ---- the program
VIEW = [sys.executable, "-m", "libloc.programs.view"]


def rows_of(path):
    """Rows of each entity in an .rrd file."""
    text = subprocess.run(
        [*output.rerun_command(), "rrd", "print", path], capture_output=True, text=True, check=True
    ).stdout
    rows = {}
    for count, entity in re.findall(r"with (\d+) rows? .*? - (/\S+) - ", text):
        rows[entity] = rows.get(entity, 0) + int(count)
    return rows


@contextmanager
def started(*arguments):
    with subprocess.Popen(
        [*VIEW, *map(str, arguments)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
        # A test run in the background ignores Ctrl-C, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:  # fmt: skip
        try:
            yield process
        finally:
            process.terminate()


@contextmanager
def hub():
    command = [built_program("loc-hub"), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()


def test_a_log_becomes_a_recording(ride, rig, tmp_path, capsys):
    path = tmp_path / "out.rrd"
    assert view.main([str(ride), "--config", str(rig), "--save", str(path)]) == 0
    out = capsys.readouterr().out
    assert "pictures.drawn = 10" in out
    assert "gps.without_origin = 5" in out
    assert "aligned" in out or "alignment (se3)" in out
    assert list(tmp_path.glob("*.rrd")) == [path]
    rows = rows_of(path)
    assert rows["/plots/reprojection"] == 10 + 1  # and the names of the lines
    assert rows["/world/camera/image"] == 10 + 2  # lens, legend
    assert rows["/world/camera/image/features"] == rows["/world/camera/image/search"] == 10 + 1  # and how
    assert rows["/world/body"] == pytest.approx(30, abs=1)


def test_live_over_a_hub_until_ctrl_c(tmp_path):
    path = tmp_path / "live.rrd"
    with hub() as url, started("--lcm-url", url, "--save", path) as process:
        assert "listening" in wait_for(process, "listening")
        time.sleep(0.2)
        connection = lcm.LCM(url)
        for channel, m in messages():
            connection.publish(channel, m.encode())
            if channel == "LOC_IMAGE":
                time.sleep(0.05)
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate(timeout=30)
    assert process.returncode == 0, errors
    for count in (
        "LOC_IMAGE.received = 10",
        "LOC_ESTIMATE.received = 200",
        "pictures.drawn = 10",
        "frames.drawn = 10",
    ):
        assert count in out, out
    assert "dropped" not in out
    rows = rows_of(path)
    assert rows["/plots/reprojection"] == 10 + 1
    assert rows["/world/camera/image/features"] == 10 + 1


def wait_for(process, text):
    for line in process.stderr:
        if text in line:
            return line
    raise AssertionError(f"{text!r} was not said")


def test_a_full_disk(tmp_path, monkeypatch, capsys):
    """What was written by then stays; an error says which file."""

    class Full:
        def __getattr__(self, name):
            return getattr(self.stream, name)

        def __init__(self, *arguments):
            self.stream = rr.RecordingStream(*arguments)

        def flush(self, timeout_sec):
            self.stream.flush(timeout_sec=timeout_sec)
            raise RuntimeError("File-writer thread shut down prematurely")

    class Module:
        RecordingStream = Full

        def __getattr__(self, name):
            return getattr(rr, name)

    made = target.Target(Module(), tmp_path / "x.rrd", None, (800, 600), None)
    with pytest.raises(output.ViewerError, match=r"x\.part\.rrd: .*is the disk full"), made:
        made.keep_part = True
        made.stream.log("here", rr.TextLog("there"))
        made.check(time.monotonic())
    assert [one.name for one in tmp_path.iterdir()] == ["x.part.rrd"]
    assert rows_of(tmp_path / "x.part.rrd")["/here"] == 1


def test_nothing_to_hear(tmp_path, capsys):
    arguments = ["--save", str(tmp_path / "x.rrd"), "--duration", "0.3"]
    assert view.main(["--lcm-url", "tcpq://127.0.0.1:1", *arguments]) == 1
    assert "loc-hub" in capsys.readouterr().err
    assert view.main(["--lcm-url", "memq://", *arguments]) == 1
    assert "nothing to be drawn has come" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def listening_addresses(port):
    """Hexadecimal, as the kernel lists them."""
    out = set()
    for family in ("tcp", "tcp6"):
        for line in Path("/proc/net", family).read_text().splitlines()[1:]:
            local, state = line.split()[1], line.split()[3]
            if state == "0A" and int(local.rsplit(":", 1)[1], 16) == port:
                out.add(local.rsplit(":", 1)[0])
    return out


def test_in_the_browser_of_this_machine_alone(ride, tmp_path, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    ports = "--web-port", output.free_port(), "--data-port", output.free_port()
    with started(ride, "--memory", "100MB", *ports) as process:
        assert "no display" in wait_for(process, "no display")
        lines = []
        for line in process.stdout:
            lines.append(line)
            if "Ctrl-C" in line:
                break
        text = "".join(lines)
        page = re.search(r"open (http://127\.0\.0\.1:(\d+)\?url=\S+)", text)
        forwards = re.search(r"ssh -L (\d+):127\.0\.0\.1:\1 -L (\d+):127\.0\.0\.1:\2 ", text)
        assert page and forwards and page[2] == forwards[1]
        with urllib.request.urlopen(page[1], timeout=10) as answer:
            assert b"<html" in answer.read().lower()
        for port in forwards.groups():
            assert listening_addresses(int(port)) == {"0100007F"}
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
        assert process.returncode == 0, errors
        for port in forwards.groups():
            assert listening_addresses(int(port)) == set()


@pytest.mark.slow
def test_screenshot(ride, rig, tmp_path, capsys):
    try:
        output.check_screenshots()
    except output.ViewerError as error:
        pytest.skip(str(error))
    path = tmp_path / "x.png"
    assert view.main([str(ride), "--config", str(rig), "--screenshot", str(path), "--size", "800x600"]) == 0
    assert "the viewer says" not in capsys.readouterr().err
    picture = np.array(Image.open(path).convert("RGB")).astype(int)
    assert picture.shape[:2] == (600, 800)
    # The grey of the picture's pixels, on the left.
    assert (np.abs(picture[:, :400] - 128).max(axis=2) < 12).mean() > 0.1
