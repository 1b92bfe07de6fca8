"""Reading and writing LCM logs with libloc's message types (package loc, generated for PyPI's lcm).

Logs are written by PyPI's lcm. They are read by libloc's own reader, because that one reports damage and goes
on behind it, where lcm.EventLog stops in silence; and the C++ decoder checks every message before it is
unpacked. Recordings as arrays: libloc.read_recording.
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

from libloc._core import DataError, LcmLogReader, message_type


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
    """Iterates once over the messages of package loc in a log, in the order of the file.

        log = LogReader("run.lcm", channels=["LOC_ESTIMATE"])
        for m in log:
            print(m.channel, m.message.time_ns)

    Messages of other types are skipped and counted per channel in `skipped`. A log that is damaged, or whose
    last event is cut because its writer was killed, is read as far as possible; `damage` tells what was not.

    Raises DataError for a file that is missing or no LCM log, and for a message that cannot be decoded.
    """

    def __init__(self, path: str | PathLike[str], channels: Collection[str] | None = None) -> None:
        self.path = Path(path)
        self.channels = None if channels is None else frozenset(channels)
        self.skipped: dict[str, int] = {}
        self._events = LcmLogReader(self.path)

    @property
    def damage(self) -> dict[str, int]:
        """What was not readable so far, {"truncated_bytes": 61, ...}; empty when all was."""
        return self._events.damage()

    def __iter__(self) -> Iterator[LogMessage]:
        for number, log_time_us, channel, data in self._events:
            if self.channels is not None and channel not in self.channels:
                continue
            try:
                name = message_type(data)
            except DataError as error:
                raise DataError(f"{self.path}: event {number}, channel {channel}: {error}") from None
            if name is None:
                self.skipped[channel] = self.skipped.get(channel, 0) + 1
                continue
            yield LogMessage(channel, log_time_us, number, getattr(loc, name).decode(data))


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
