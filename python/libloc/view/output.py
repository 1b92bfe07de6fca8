"""Where the drawing goes: an .rrd file, a viewer in the browser or in a window, a screenshot.

Viewers are processes of their own that listen on 127.0.0.1 only. Their usage statistics are switched off.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import sysconfig
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.parse import quote

from libloc.driving.video import MissingPackageError
from libloc.view.recorder import TIMELINE

WEB_PORT, DATA_PORT = 9090, 9876
_START_S = 20.0
_SCREENSHOT_S = 60.0
_DRIVERS = (Path("/usr/share/vulkan/icd.d"), Path("/etc/vulkan/icd.d"), Path("/usr/local/share/vulkan/icd.d"))


class ViewerError(RuntimeError):
    """The viewer did not do what it was to do; the text is for the user."""


def import_rerun() -> Any:
    """Raises MissingPackageError without rerun-sdk."""
    try:
        import rerun
    except ImportError:
        raise MissingPackageError(
            "this needs the Python package rerun-sdk (pip install rerun-sdk, or libloc[view])"
        ) from None
    return rerun


def rerun_command() -> list[str]:
    program = shutil.which("rerun", path=sysconfig.get_path("scripts")) or shutil.which("rerun")
    return [program] if program else [sys.executable, "-m", "rerun_cli"]


def has_display() -> bool:
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _quiet() -> None:
    command = [*rerun_command(), "analytics", "disable"]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except subprocess.CalledProcessError as error:
        raise ViewerError(f"rerun does not start: {error.stderr.strip()}") from None


def check_screenshots() -> None:
    """Raises ViewerError where nothing can draw: without a Vulkan driver."""
    named = os.environ.get("VK_DRIVER_FILES") or os.environ.get("VK_ICD_FILENAMES")
    if not named and not any(any(folder.glob("*.json")) for folder in _DRIVERS):
        raise ViewerError(
            "--screenshot needs a Vulkan driver, and there is none. One that works without a graphics card: "
            "apt-get install mesa-vulkan-drivers"
        )


def screenshot(recording: Path | str, picture: Path, size: tuple[int, int]) -> list[str]:
    """Draws the end of a recording off screen into a .png, and returns what the views complained of.

    recording: an .rrd file, or the data_url of a viewer of kind "buffer". Raises ViewerError when it was not
    loaded, or is still changing on the screen after a minute.
    """
    check_screenshots()
    from rerun.experimental import ViewerClient

    with Viewer("headless", "75%", size=size) as viewer:
        try:
            client = ViewerClient.connect(viewer.data_url)
            end = time.monotonic() + _SCREENSHOT_S
            in_file = isinstance(recording, Path)
            opened = client.open(
                os.fspath(recording.absolute()) if isinstance(recording, Path) else recording
            )
            # Of a buffer nobody knows when it has come to its end.
            while time.monotonic() < end and (opened.store_ids or not in_file):
                state = client.get_state()
                if state.active_recording is not None and not state.loading:
                    break
                time.sleep(0.1)
            state = client.get_state()
            if (in_file and not opened.store_ids) or state.active_recording is None or state.loading:
                raise ViewerError(f"no screenshot: the viewer has not loaded {recording}")
            _follow(client, end if not in_file else 0.0)
            shot, same, wanted = client.take_screenshot(), 0, 1 if in_file else 4
            while same < wanted:  # until the views have found their ranges
                if time.monotonic() > end:
                    raise ViewerError(f"no screenshot: the picture is not steady after {_SCREENSHOT_S:g} s")
                if not in_file:
                    time.sleep(0.3)
                before, shot = shot, client.take_screenshot()
                same = same + 1 if shot == before else 0
            reports = [report for view in client.get_state().views for report in view.reports]
        except (RuntimeError, OSError, TimeoutError) as error:
            raise ViewerError(f"no screenshot: {error}") from None
    part = picture.with_name(f".{picture.stem}.{os.getpid()}.part.png")
    try:
        part.write_bytes(shot)
        part.replace(picture)
    finally:
        part.unlink(missing_ok=True)
    return [f"{report.severity}: {report.summary}" for report in reports]


def _follow(client: Any, end: float) -> None:
    """Until then it is waited for the first data: a recording that has come may have no time yet."""
    while True:
        try:
            client.set_time(TIMELINE, play_state="following")
            return
        except (RuntimeError, OSError, TimeoutError):
            if time.monotonic() > end:
                raise
        time.sleep(0.1)


def _last_lines(text: str, count: int = 5) -> str:
    return "\n".join(text.strip().splitlines()[-count:])


def free_port(wanted: int = 0) -> int:
    """wanted, or another one where that is taken. A program that is faster may take it after all."""
    for port in (wanted, 0):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return int(probe.getsockname()[1])
    raise ViewerError("no free port on 127.0.0.1")


class Viewer:
    """The viewer as a process: "web", in the browser; "window"; "headless", drawn off screen; or "buffer",
    which draws nothing and keeps the newest for a viewer that comes later.
    """

    def __init__(
        self,
        kind: str,
        memory: str,
        web_port: int = 0,
        data_port: int = 0,
        size: tuple[int, int] = (1600, 1000),
    ) -> None:
        """memory: most that may be buffered for those who come later, or used by the window:
        "512MB"; ports: 0 is any.

        Raises ViewerError when it does not start.
        """
        self.data_port = free_port(data_port)
        self.web_port = free_port(web_port) if kind == "web" else 0
        _quiet()
        command = [*rerun_command(), "--bind", "127.0.0.1", "--port", str(self.data_port)]
        if kind == "web":
            command += [
                "--serve-web",
                "--web-viewer-port",
                str(self.web_port),
                "--server-memory-limit",
                memory,
            ]
        elif kind == "buffer":
            command += ["--serve-grpc", "--server-memory-limit", memory]
        else:
            command += ["--memory-limit", memory, "--server-memory-limit", "64MB", "--hide-welcome-screen"]
        if kind == "headless":
            command += ["--headless", "--window-size", f"{size[0]}x{size[1]}"]
        environment = os.environ | (
            {"RUST_LOG": "error"} if kind == "headless" else {}
        )  # no notes on the picture
        self._said = tempfile.TemporaryFile("w+")  # a pipe that nobody reads would fill up
        self._process = subprocess.Popen(
            command,
            stdout=subprocess.DEVNULL,
            stderr=self._said,
            env=environment,
            # Ctrl-C is for this program, which ends the viewer when it has sent all.
            start_new_session=True,
        )
        try:
            self._wait()
        except BaseException:
            self.close()
            raise

    @property
    def data_url(self) -> str:
        return f"rerun+http://127.0.0.1:{self.data_port}/proxy"

    @property
    def page_url(self) -> str:
        return f"http://127.0.0.1:{self.web_port}?url={quote(self.data_url, safe='')}"

    @property
    def running(self) -> bool:
        return self._process.poll() is None

    def how_to_reach(self) -> str:
        ports = " ".join(f"-L {port}:127.0.0.1:{port}" for port in (self.web_port, self.data_port))
        return f"open {self.page_url}\nfrom another machine first: ssh {ports} THIS_MACHINE"

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        # The whole group: the program may be a script that has started the real one.
        self._signal(signal.SIGTERM)
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            pass
        self._signal(signal.SIGKILL)
        self._process.wait()
        self._said.close()

    def _signal(self, number: int) -> None:
        try:
            os.killpg(self._process.pid, number)
        except ProcessLookupError:
            pass  # none of it is left

    def _wait(self) -> None:
        """Until it listens. Raises ViewerError."""
        wanted = {self.data_port, self.web_port} - {0}
        end = time.monotonic() + _START_S
        while wanted:
            if not self.running:
                self._said.seek(0)
                said = self._said.read()
                self.close()
                raise ViewerError(f"the viewer did not start: {_last_lines(said)}")
            if time.monotonic() > end:
                self.close()
                raise ViewerError(f"the viewer does not listen on port {min(wanted)} after {_START_S:g} s")
            for port in sorted(wanted):
                with socket.socket() as probe:
                    probe.settimeout(0.2)
                    if probe.connect_ex(("127.0.0.1", port)) == 0:
                        wanted.discard(port)
            time.sleep(0.05)
