"""Reading and writing LCM logs with libloc's message types (package loc), through PyPI's lcm.

Every message is checked by libloc's C++ decoder before it is unpacked: lengths that cannot be, a cut message
or one of the wrong size raise DataError naming file, channel and event. Recordings as arrays:
libloc.read_recording.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

import lcm
import loc

from libloc._core import DataError, message_type

_EVENT_HEADER_BYTES = 28


class Message(Protocol):
    """What lcm-gen makes for each type."""

    def encode(self) -> bytes: ...


@dataclass(frozen=True)
class LogMessage:
    """One event of a log."""

    channel: str
    log_time_us: (
        int  #: when the logger received it [us since 1970]; for the time of measurement see the message
    )
    event_number: int
    message: Any  #: loc.imu_t, loc.estimate_t, ...


class LogReader:
    """Iterates over the messages of package loc in a log, in the order of the file.

        with LogReader("run.lcm", channels=["LOC_ESTIMATE"]) as log:
            for m in log:
                print(m.channel, m.message.time_ns)

    Messages of other types are skipped and counted per channel in `skipped`. A log whose last event is cut
    (its writer was killed) is read up to there; `truncated_bytes` says how many bytes are left. Damage inside
    the file, where LCM searches for the next event, is counted in `damaged_bytes`.

    Raises FileNotFoundError, or DataError for a file that is no LCM log and for a message that cannot be
    decoded.
    """

    def __init__(self, path: str | PathLike[str], channels: Collection[str] | None = None) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise FileNotFoundError(f"{self.path}: no such file")
        self.channels = None if channels is None else frozenset(channels)
        self.skipped: dict[str, int] = {}
        self.truncated_bytes = 0
        self.damaged_bytes = 0
        self._log = lcm.EventLog(str(self.path), "r")

    def __enter__(self) -> LogReader:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        self._log.close()

    def __iter__(self) -> Iterator[LogMessage]:
        size = self.path.stat().st_size
        end = self._log.tell()
        number = 0
        while (event := self._log.read_next_event()) is not None:
            length = _EVENT_HEADER_BYTES + len(event.channel.encode()) + len(event.data)
            self.damaged_bytes += self._log.tell() - end - length
            end = self._log.tell()
            number += 1
            if self.channels is not None and event.channel not in self.channels:
                continue
            try:
                name = message_type(event.data)
            except DataError as error:
                raise DataError(
                    f"{self.path}: event {event.eventnum}, channel {event.channel}: {error}"
                ) from None
            if name is None:
                self.skipped[event.channel] = self.skipped.get(event.channel, 0) + 1
                continue
            message = getattr(loc, name).decode(event.data)
            yield LogMessage(event.channel, event.timestamp, event.eventnum, message)
        self.truncated_bytes = size - end
        if number == 0 and size > 0:
            raise DataError(f"{self.path}: no LCM event in {size} bytes: not an LCM log")


class LogWriter:
    """Writes a log that lcm-logplayer, libloc's programs and LogReader read.

        with LogWriter("run.lcm") as log:
            log.write("LOC_IMU", message, log_time_us=message.time_ns // 1000)

    Raises FileExistsError when the file is there, unless overwrite is true.
    """

    def __init__(self, path: str | PathLike[str], overwrite: bool = False) -> None:
        self.path = Path(path)
        if self.path.exists() and not overwrite:
            raise FileExistsError(f"{self.path}: exists already")
        if not self.path.parent.is_dir():
            raise FileNotFoundError(f"{self.path.parent}: no such folder")
        self._log = lcm.EventLog(str(self.path), "w", overwrite=True)

    def __enter__(self) -> LogWriter:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        self._log.close()

    def write(self, channel: str, message: Message, log_time_us: int) -> None:
        """Appends one event. log_time_us: when it was received [us since 1970]; a player paces by it."""
        if not channel or len(channel.encode()) > 62:
            raise ValueError(f"channel = {channel!r}: must have 1 to 62 bytes")
        if log_time_us < 0:
            raise ValueError(f"log_time_us = {log_time_us}: must not be negative")
        self._log.write_event(log_time_us, channel, message.encode())
