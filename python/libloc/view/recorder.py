"""Writes into a rerun recording: one time line, that of the measurements, and rows of numbers in columns."""

from __future__ import annotations

from typing import Any

import numpy as np

TIMELINE = "time"  #: since the start of the recording
STAMP = "stamp_ns"  #: the same instants as the messages have them, int64 nanoseconds
_JITTER = 0.1  # of the gap, by which one may be early
_ROWS = 4096  # of a series that are kept before they are sent


class Thinner:
    """Lets so many a second through, evenly, whatever the rate at which they come; all when it is None."""

    def __init__(self, rate_hz: float | None) -> None:
        self._gap_ns = 0 if rate_hz is None else round(1e9 / rate_hz)
        self._due_ns: int | None = None

    def due(self, time_ns: int) -> bool:
        if self._gap_ns == 0:
            return True
        if self._due_ns is None or not -self._gap_ns <= time_ns - self._due_ns < self._gap_ns:
            # The first one, after a gap, or time has stepped back.
            self._due_ns = time_ns + self._gap_ns
            return True
        if time_ns < self._due_ns - _JITTER * self._gap_ns:
            return False
        self._due_ns += self._gap_ns
        return True


class _Rows:
    def __init__(self) -> None:
        self.times_ns: list[int] = []
        self.values: list[tuple[float, ...]] = []


class Recorder:
    """A rerun.RecordingStream by measurement time."""

    def __init__(self, rr: Any, stream: Any, start_ns: int | None = None) -> None:
        """start_ns: where the time line begins; None: at the first time that is drawn."""
        self.rr = rr
        self.stream = stream
        self.start_ns = start_ns
        self._rows: dict[str, _Rows] = {}
        self._styled: set[str] = set()
        # The time at which it was drawn is of no use, and a second time line to choose from confuses.
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)

    def static(self, entity: str, *what: Any) -> None:
        """Holds at all times; replaces what was said before."""
        self.stream.log(entity, *what, static=True)

    def style(self, entity: str, kind: str, **what: Any) -> None:
        """Fields of an archetype (Points2D, ...) that never change: cheaper than with every log()."""
        if entity not in self._styled:
            self._styled.add(entity)
            self.static(entity, getattr(self.rr, kind).from_fields(**what))

    def log(self, time_ns: int, entity: str, *what: Any) -> None:
        if self.start_ns is None:
            self.start_ns = time_ns
        self.stream.set_time(TIMELINE, duration=np.timedelta64(time_ns - self.start_ns, "ns"))
        self.stream.set_time(STAMP, sequence=time_ns)
        self.stream.log(entity, *what)

    def row(self, time_ns: int, entity: str, *values: float) -> None:
        """A row of a series of numbers, always as many; sent at the next flush(), or when there are many."""
        if self.start_ns is None:
            self.start_ns = time_ns
        rows = self._rows.setdefault(entity, _Rows())
        rows.times_ns.append(time_ns)
        rows.values.append(values)
        if len(rows.times_ns) >= _ROWS:
            self._send(entity, rows)

    def flush(self) -> None:
        """Sends all rows."""
        for entity, rows in self._rows.items():
            if rows.times_ns:
                self._send(entity, rows)

    def _send(self, entity: str, rows: _Rows) -> None:
        rr = self.rr
        times = np.array(rows.times_ns, dtype=np.int64)
        indexes = [
            rr.TimeColumn(TIMELINE, duration=(times - (self.start_ns or 0)).astype("timedelta64[ns]")),
            rr.TimeColumn(STAMP, sequence=times),
        ]
        values = np.array(rows.values, dtype=float)
        columns = rr.Scalars.columns(scalars=values.ravel()).partition(np.full(len(values), values.shape[1]))
        self.stream.send_columns(entity, indexes=indexes, columns=columns)
        rows.times_ns.clear()
        rows.values.clear()
