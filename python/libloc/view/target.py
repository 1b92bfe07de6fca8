"""The recording with all places where it goes, and how it ends."""

from __future__ import annotations

import itertools
import os
import signal
import tempfile
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any

from libloc.view import output

_CHECK_S = 5.0
_FLUSH_S = 60.0


class Interrupt:
    """The first Ctrl-C, or a request to end, is only noted; the next one ends the program."""

    def __init__(self) -> None:
        self.asked = False

    def __enter__(self) -> Interrupt:
        self._before = {
            number: signal.signal(number, self._handle)
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN  # nohup
        }
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        signal.signal(number, signal.default_int_handler)


@dataclass(frozen=True)
class ViewerPlan:
    """As output.Viewer takes it."""

    kind: str
    memory: str
    web_port: int
    data_port: int


class Target:
    """A recording that goes into a file, to a viewer, or both.

    The file has its name when it is complete; until then it is NAME.PID.part.rrd, of this program alone.
    """

    def __init__(
        self,
        rr: Any,
        save: Path | None,
        screenshot: Path | None,
        size: tuple[int, int],
        viewer: ViewerPlan | None,
        *,
        overwrite: bool = False,
        buffer: str | None = None,
    ) -> None:
        """overwrite: replace a file that another program has written meanwhile. buffer: a screenshot alone is
        made of what fits into so much memory, the newest ("1GB"); None: of all, through a file.
        """
        self.keep_part = False  #: of the file, when it does not come to finish()
        self._rr, self._save, self._screenshot, self._size, self._plan = rr, save, screenshot, size, viewer
        self._overwrite, self._buffer_size = overwrite, buffer
        self._buffer: output.Viewer | None = None
        self.viewer: output.Viewer | None = None
        self.kept: Path | None = None  #: what was written by the time it failed
        self.complaints: list[str] = []  #: of the viewer about what is in the screenshot
        self._checked_s = 0.0
        self._stack = ExitStack()

    def __enter__(self) -> Target:
        with ExitStack() as stack:
            self._file: Path | None = None
            if self._save is not None:
                self._file = _own_part(self._save)
                stack.callback(self._tidy)
            elif self._screenshot is not None and self._buffer_size is not None:
                self._buffer = stack.enter_context(output.Viewer("buffer", self._buffer_size))
            elif self._screenshot is not None:
                folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="loc-view-"))
                self._file = Path(folder) / "view.rrd"
            if self._plan is not None:
                plan = self._plan
                viewer = output.Viewer(plan.kind, plan.memory, plan.web_port, plan.data_port)
                self.viewer = stack.enter_context(viewer)
            self.stream = self._rr.RecordingStream("libloc-view")
            try:
                sinks: list[Any] = [] if self._file is None else [self._rr.FileSink(str(self._file))]
                for viewer in (self.viewer, self._buffer):
                    if viewer is not None:
                        sinks.append(self._rr.GrpcSink(viewer.data_url))
                self.stream.set_sinks(*sinks)
            except RuntimeError as error:
                raise output.ViewerError(f"{self._file or 'the viewer'}: {error}") from None
            stack.callback(self.stream.disconnect)  # before the viewer ends
            self._stack = stack.pop_all()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._stack.close()

    def check(self, now_s: float) -> None:
        """Raises ViewerError when nothing can be written any more. Looks every few seconds."""
        if now_s - self._checked_s < _CHECK_S:
            return
        self._checked_s = now_s
        self._flush(_CHECK_S, patient=True)

    def finish(self) -> list[str]:
        """Writes the rest, and the screenshot; tells what was written. Raises ViewerError."""
        self._flush(_FLUSH_S)
        if self._buffer is not None and self._screenshot is not None:
            self.complaints = output.screenshot(self._buffer.data_url, self._screenshot, self._size)
            return [f"written: {self._screenshot}"]
        if self._file is None:
            return []
        self.stream.disconnect()  # its end is in the file then
        done = []
        if self._save is not None:
            if self._save.exists() and not self._overwrite:
                self.keep_part = True
                raise output.ViewerError(
                    f"{self._save}: another program has written it meanwhile; --overwrite replaces it"
                )
            self._file.replace(self._save)
            self._file = self._save
            done.append(f"written: {self._save} ({self._save.stat().st_size / 1e6:.1f} MB)")
        if self._screenshot is not None:
            self.complaints = output.screenshot(self._file, self._screenshot, self._size)
            done.append(f"written: {self._screenshot}")
        return done

    def _flush(self, timeout_s: float, patient: bool = False) -> None:
        """patient: that it takes longer than that, as on a busy machine, is no error."""
        try:
            self.stream.flush(timeout_sec=timeout_s)
        except (RuntimeError, ValueError, OSError) as error:
            disk = "shut down" in str(error)
            # A window that was closed takes nothing any more; the file is whole all the same.
            closed = self.viewer is not None and not self.viewer.running
            if not disk and (patient or closed):
                return
            where = f"{self._file}" if self._file is not None else "the viewer"
            raise output.ViewerError(
                f"{where}: cannot be written any more: {error} (is the disk full?)"
            ) from None

    def _tidy(self) -> None:
        if self._file is None or self._file == self._save or not self._file.exists():
            return
        if self.keep_part:
            self.kept = self._file
        else:
            self._file.unlink()


def _own_part(path: Path) -> Path:
    """A new, empty file beside path that no other program writes to; those of others are left alone."""
    for number in itertools.count():
        part = path.with_suffix(f".{os.getpid()}{f'-{number}' if number else ''}.part.rrd")
        try:
            part.open("xb").close()
        except FileExistsError:
            continue
        return part
    raise AssertionError
