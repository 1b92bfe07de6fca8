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
        # A test run in the background or under nohup ignores these, and children inherit that.
        preexec_fn=lambda: [signal.signal(n, signal.SIG_DFL) for n in (signal.SIGINT, signal.SIGHUP)],
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
    (tmp_path / "x.part.rrd").write_text("of another run")
    with pytest.raises(output.ViewerError, match=r"x\.\d+\.part\.rrd: .*is the disk full"), made:
        made.keep_part = True
        made.stream.log("here", rr.TextLog("there"))
        made.check(time.monotonic())
    part = tmp_path / f"x.{os.getpid()}.part.rrd"
    assert set(tmp_path.iterdir()) == {part, tmp_path / "x.part.rrd"}
    assert made.kept == part
    assert rows_of(part)["/here"] == 1


def test_two_write_one_file(tmp_path):
    """Each has a file of its own until it is whole; that of the other is not replaced unasked."""
    path = tmp_path / "x.rrd"
    with target.Target(rr, path, None, (800, 600), None) as one:
        one.stream.log("one", rr.TextLog("1"))
        with target.Target(rr, path, None, (800, 600), None) as two:
            two.stream.log("two", rr.TextLog("2"))
            assert len(list(tmp_path.glob("x.*.part.rrd"))) == 2
            two.finish()
        with pytest.raises(output.ViewerError, match="another program has written it"):
            one.finish()
    assert rows_of(path)["/two"] == 1
    assert rows_of(one.kept)["/one"] == 1
    one.kept.unlink()
    with pytest.raises(KeyError), target.Target(rr, path, None, (800, 600), None):
        raise KeyError
    with target.Target(rr, path, None, (800, 600), None, overwrite=True) as one:
        one.stream.log("one", rr.TextLog("1"))
        one.finish()
    assert "/one" in rows_of(path)
    assert list(tmp_path.iterdir()) == [path]


def test_requests_to_end(monkeypatch):
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # ignored when all this runs under nohup
    try:
        with target.Interrupt() as interrupt:
            assert not interrupt.asked
            signal.raise_signal(signal.SIGHUP)
            assert interrupt.asked
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_DFL
        signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as under nohup
        with target.Interrupt() as interrupt:
            signal.raise_signal(signal.SIGHUP)
            assert not interrupt.asked
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.slow
def test_the_end_of_the_source_and_a_viewer_that_was_closed(tmp_path):
    """Live: either ends it, and the file is whole."""
    ended, closed = tmp_path / "ended.rrd", tmp_path / "closed.rrd"
    ports = "--web-port", output.free_port(), "--data-port", output.free_port()
    with (
        hub() as url,
        started("--lcm-url", url, "--save", ended, "--exit-at-end") as first,
        started("--lcm-url", url, "--save", closed, "--web", *ports) as second,
    ):
        wait_for(first, "listening")
        wait_for(second, "listening")
        time.sleep(0.2)
        connection = lcm.LCM(url)
        for channel, m in messages(0.3):
            connection.publish(channel, m.encode())
        status = loc.source_status_t()
        status.source, status.state = "here", status.STATE_ENDED
        connection.publish("LOC_SOURCE_STATUS", status.encode())
        out, errors = first.communicate(timeout=30)
        assert first.returncode == 0, errors
        assert "LOC_ESTIMATE.received = 60" in out
        assert second.poll() is None  # it was not asked to
        viewers = [pid for pid in children_of(second.pid) if "--serve-web" in command_of(pid)]
        assert viewers
        for pid in viewers:
            os.kill(pid, signal.SIGKILL)
        out, errors = second.communicate(timeout=30)
        assert second.returncode == 0, errors
        assert "the viewer has ended" in errors
    for path in (ended, closed):
        assert rows_of(path)["/plots/reprojection"] == 3 + 1
    assert set(tmp_path.iterdir()) == {ended, closed}


def children_of(pid):
    """With theirs."""
    out = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(stat.read_text().rsplit(")", 1)[1].split()[1])
        except OSError:
            continue  # it has ended
        if parent == pid:
            child = int(stat.parent.name)
            out += [child, *children_of(child)]
    return out


def command_of(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_text().split("\0")
    except OSError:
        return []


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
        direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))  # whatever http_proxy says
        with direct.open(page[1], timeout=10) as answer:
            assert b"<html" in answer.read().lower()
        for port in forwards.groups():
            assert listening_addresses(int(port)) == {"0100007F"}
        process.send_signal(signal.SIGHUP)  # the terminal was closed
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


@pytest.mark.slow
def test_a_live_screenshot_needs_no_room_on_the_disk(tmp_path):
    try:
        output.check_screenshots()
    except output.ViewerError as error:
        pytest.skip(str(error))
    path = tmp_path / "x.png"
    with hub() as url, started("--lcm-url", url, "--screenshot", path, "--size", "800x600") as process:
        wait_for(process, "listening")
        time.sleep(0.2)
        connection = lcm.LCM(url)
        for channel, m in messages():
            connection.publish(channel, m.encode())
            if channel == "LOC_IMAGE":
                time.sleep(0.02)
        time.sleep(0.3)
        held = {os.path.realpath(link) for link in Path(f"/proc/{process.pid}/fd").iterdir()}
        assert not [name for name in held if name.endswith(".rrd")]
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    picture = np.array(Image.open(path).convert("RGB")).astype(int)
    assert picture.shape[:2] == (600, 800)
    assert (np.abs(picture[:, :400] - 128).max(axis=2) < 12).mean() > 0.1
    assert list(tmp_path.iterdir()) == [path]
