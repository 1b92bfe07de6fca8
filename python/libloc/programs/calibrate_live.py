"""loc-calibrate magnetometer --live: collects readings from LCM while a person turns the device.

It says how to turn, and ends by itself when the centre is known well enough, after --duration, or when the
source has ended; then the readings go the same way as those of a recording. With --report they are kept as
readings.csv.
"""

from __future__ import annotations

import argparse
import queue
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

import loc
import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import DataError
from libloc.lcm_receiver import LcmReceiver
from libloc.programs import calibrate_plots as plots
from libloc.programs.arguments import add_collecting, add_lcm_url
from libloc.programs.calibrate_input import SI, Readings, Triad

_EVALUATE_S, _PICTURE_S, _LINE_S = 0.5, 3.0, 1.0
_MESSAGES: Any = loc  # lcm-gen writes no types
_CONFIRMATIONS = 2  # evaluations in a row that must say "enough"


def add_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("live")
    group.add_argument("--live", action="store_true", help="collect from LCM instead of reading INPUT")
    add_lcm_url(group)
    group.add_argument(
        "--channel", default=libloc.MAGNETOMETER_CHANNEL, metavar="NAME", help="of the readings (%(default)s)"
    )
    group.add_argument(
        "--imu-channel", default=libloc.IMU_CHANNEL, metavar="NAME", help="of the IMU (%(default)s)"
    )
    add_collecting(group, 300.0, "reading")


@dataclass
class _Stream:
    times_ns: list[int] = field(default_factory=list)
    rows: list[tuple[float, ...]] = field(default_factory=list)
    last_sequence: int = -1


@dataclass
class Collection:
    """What has come so far."""

    collector: libloc.EllipsoidCollector
    magnetometer: _Stream = field(default_factory=_Stream)
    imu: _Stream = field(default_factory=_Stream)  # angular velocity and specific force
    counts: Counter[str] = field(default_factory=Counter)
    ended: str = ""  # what the source said

    def take(self, channel: str, data: bytes, options: argparse.Namespace) -> bool:
        """True for a reading of the magnetometer."""
        try:
            name = libloc.message_type(data)
        except DataError:
            name = None
        expected = {options.channel: "magnetometer_t", options.imu_channel: "imu_t"}.get(
            channel, "source_status_t"
        )
        if name != expected:
            self.counts[f"{channel}.refused"] += 1
            return False
        if name == "source_status_t":
            status = _MESSAGES.source_status_t.decode(data)
            if status.state != _MESSAGES.source_status_t.STATE_RUNNING:
                self.ended = status.message or "the source has ended"
            return False
        if name == "imu_t":
            m = _MESSAGES.imu_t.decode(data)
            self._append("imu", self.imu, m.time_ns, m.sequence, (*m.angular_velocity, *m.specific_force))
            return False
        m = _MESSAGES.magnetometer_t.decode(data)
        self._append("magnetometer", self.magnetometer, m.time_ns, m.sequence, tuple(m.magnetic_field))
        self.collector.add(list(m.magnetic_field))
        return True

    def _append(
        self, name: str, stream: _Stream, time_ns: int, sequence: int, row: tuple[float, ...]
    ) -> None:
        self.counts[f"{name}.received"] += 1
        if 0 <= stream.last_sequence < sequence - 1:
            self.counts[f"{name}.lost"] += sequence - stream.last_sequence - 1
        stream.last_sequence = sequence
        stream.times_ns.append(time_ns)
        stream.rows.append(row)

    def readings(self, name: str) -> Readings:
        out = Readings(name, "live", counts=dict(self.counts))
        rows = np.array(self.magnetometer.rows, dtype=float).reshape(-1, 3)
        out.magnetometer = Triad(
            rows, np.array(self.magnetometer.times_ns, dtype=np.int64), SI["magnetometer"]
        )
        if self.imu.rows:
            both = np.array(self.imu.rows, dtype=float)
            times = np.array(self.imu.times_ns, dtype=np.int64)
            out.gyroscope = Triad(np.ascontiguousarray(both[:, :3]), times, SI["gyroscope"])
            out.accelerometer = Triad(np.ascontiguousarray(both[:, 3:]), times, SI["accelerometer"])
        return out


def map_of_cells(
    cells: NDArray[np.integer[Any]], steps: tuple[int, int, int], encoding: str | None
) -> list[str]:
    """Counts as lines of text, darker from each of the steps on; two marks a cell."""
    marks = "·░▒█"
    try:
        marks.encode(encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        marks = ".-+#"
    return ["".join(2 * marks[i] for i in row) for row in np.digitize(cells, steps)]


def coverage_map(coverage: NDArray[np.int32], encoding: str | None) -> list[str]:
    """The sphere of directions as ten lines of text: up is +z, to the right the azimuth from x towards y."""
    return map_of_cells(coverage[::-1], (1, 5, 20), encoding)


class Screen:
    """Lines of a terminal that are written over and over."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._height = 0

    def show(self, lines: list[str]) -> None:
        up = f"\x1b[{self._height}A" if self._height else ""
        self._height = len(lines)
        # Long lines are cut off, not wrapped: the cursor goes up by lines of the screen.
        text = "\n".join(f"\x1b[2K{line}" for line in lines)
        print(f"{up}\x1b[?7l{text}\x1b[?7h", file=self._stream, flush=True)


class Progress:
    """One line a second; on a terminal a map of the directions that is drawn over and over."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._terminal = stream.isatty()
        self._screen = Screen(stream)
        self._next = 0.0

    def show(
        self, elapsed_s: float, received: int, fit: libloc.EllipsoidFit, advice: libloc.EllipsoidAdvice
    ) -> None:
        now = time.monotonic()
        if not self._terminal and now < self._next:
            return
        self._next = now + _LINE_S
        known = (
            f"centre known to {100 * fit.centre_sigma:.2f} % of the field"
            if fit.is_ellipsoid
            else "no ellipsoid yet"
        )
        head = f"{elapsed_s:4.0f} s  {received} readings  {fit.cells_hit} of 100 directions  {known}"
        if not self._terminal:
            print(f"{head}  {advice.text}", file=self._stream, flush=True)
            return
        cells = coverage_map(fit.coverage, self._stream.encoding)
        self._screen.show([head, *(f"  {line}" for line in cells), advice.text])


def write_picture(
    folder: Path,
    elapsed_s: float,
    collection: Collection,
    fit: libloc.EllipsoidFit,
    advice: libloc.EllipsoidAdvice,
) -> None:
    """progress.png, replaced as a whole: a viewer never sees half of it."""
    folder.mkdir(parents=True, exist_ok=True)
    known = f"{100 * fit.centre_sigma:.2f} %" if fit.is_ellipsoid else "not yet"
    received = collection.counts["magnetometer.received"]
    text = f"{elapsed_s:.0f} s, {received} readings, centre known to {known}\n{advice.text}"
    figure = plots.plot_progress(collection.collector.kept, fit, advice.missing_direction, text)
    temporary = folder / "progress.png.tmp"
    figure.savefig(temporary, dpi=90, format="png")
    temporary.replace(folder / "progress.png")


def collect(options: argparse.Namespace, stream: TextIO | None = None) -> Readings:
    """Raises DataError when nothing comes, or no connection can be made."""
    ellipsoid = libloc.EllipsoidOptions(method="robust")
    collection = Collection(libloc.EllipsoidCollector(ellipsoid))
    progress = Progress(stream or sys.stderr)
    name = f"{options.channel} on {options.lcm_url}"
    start = last_reading = time.monotonic()
    next_evaluation, next_picture = start + _EVALUATE_S, start + _PICTURE_S
    enough, why = 0, "the time given with --duration is over"
    channels = [options.channel, options.imu_channel, libloc.SOURCE_STATUS_CHANNEL]
    # A queue, so that drawing loses none.
    messages: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
    with LcmReceiver(options.lcm_url, channels, lambda *message: messages.put(message)) as receiver:
        while time.monotonic() - start < options.duration:
            try:
                message = messages.get(timeout=0.05)
            except queue.Empty:
                message = None
            now = time.monotonic()
            if message is not None and collection.take(*message, options):
                last_reading = now
            if now - last_reading > options.patience:
                if not collection.magnetometer.rows:
                    raise DataError(
                        f"no reading on {name} within {options.patience:g} s: is loc-driver running there?"
                    )
                why = f"no reading came for {options.patience:g} s"
                break
            if collection.ended and message is None:
                why = collection.ended
                break
            if now < next_evaluation:
                continue
            next_evaluation = now + _EVALUATE_S
            fit = collection.collector.fit()
            advice = collection.collector.advice(fit)
            progress.show(now - start, collection.counts["magnetometer.received"], fit, advice)
            if options.report and now >= next_picture:
                next_picture = now + _PICTURE_S
                write_picture(options.report, now - start, collection, fit, advice)
            enough = enough + 1 if advice.enough else 0
            if enough >= _CONFIRMATIONS:
                why = "enough directions were seen"
                break
    if not collection.magnetometer.rows:
        raise DataError(f"no reading on {name}")
    fit = collection.collector.fit()
    if options.report:
        write_picture(
            options.report, time.monotonic() - start, collection, fit, collection.collector.advice(fit)
        )
        write_readings(options.report / "readings.csv", collection)
    print(f"collecting ended: {why}", file=stream or sys.stderr)
    if receiver.connections_lost:
        collection.counts["connections.lost"] = receiver.connections_lost
    return collection.readings(name)


def write_readings(path: Path, collection: Collection) -> None:
    """As a recording that libloc reads: each sensor at its own times."""
    imu, magnetometer = collection.imu, collection.magnetometer
    lines = [
        (time, 0, f"{time},,,,,,,{','.join(repr(v) for v in row)}\n")
        for time, row in zip(magnetometer.times_ns, magnetometer.rows, strict=True)
    ] + [
        (time, 1, f"{time},{','.join(repr(v) for v in row)},,,\n")
        for time, row in zip(imu.times_ns, imu.rows, strict=True)
    ]
    lines.sort(key=lambda line: line[:2])
    with path.open("w", encoding="ascii") as file:
        file.write("time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2,mx_T,my_T,mz_T\n")
        file.writelines(line for _, _, line in lines)
