"""loc-calibrate camera-imu --live: collects pictures and IMU from LCM while the rig is waved.

It says what is missing (turns about which axis, which part of the image, a target that is not seen) and ends
by itself when the deviations are small enough, after --duration, when the source has ended, or with Ctrl-C;
then what was collected goes the same way as a recording. With --report it is kept: corners.csv and imu.csv.
"""

from __future__ import annotations

import argparse
import queue
import sys
import time
from collections import Counter, deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

import loc
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import libloc
from libloc import DataError
from libloc.lcm_receiver import LcmReceiver
from libloc.programs.arguments import add_collecting, add_lcm_url
from libloc.programs.calibrate_camera_imu_turns import CameraTurns
from libloc.programs.calibrate_images import of_message
from libloc.programs.calibrate_live import Screen, map_of_cells
from libloc.programs.calibrate_plots import new_figure

_MESSAGES: Any = loc  # lcm-gen writes no types
_COLUMNS, _ROWS = 12, 9  # cells of the image
_LINE_S, _PICTURE_S = 1.0, 3.0
_FIT_EVERY_S = 8.0  # of data
_LEAST_S = 20.0  # of data, before it is enough
_LEAST_TURNING = 0.15  # rms of the turn rate along the weakest axis [rad/s]
_LEAST_COVERAGE = 0.4  # of the cells
_LEAST_SEEN = 0.5  # of the pictures
_RATES_S = 3.0  # over which samples a second are counted
_LATEST_S, _SLOW = 3.0, 0.15  # rms of the turn rate of the last seconds [rad/s]
_UNSEEN = 8  # pictures in a row
_ABOUT = (
    "that points to the right of the image: nod it up and down",
    "that points down the image: swing it left and right",
    "that points forward: roll it like a steering wheel",
)
_ENOUGH_DEG, _ENOUGH_MM, _ENOUGH_MS = 0.1, 2.0, 0.1
_CONFIRMATIONS = 2

Array = NDArray[np.float64]


def add_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("live")
    group.add_argument("--live", action="store_true", help="collect from LCM instead of reading INPUT")
    add_lcm_url(group)
    for name, channel, what in (
        ("image", libloc.IMAGE_CHANNEL, "pictures"),
        ("imu", libloc.IMU_CHANNEL, "IMU"),
    ):
        group.add_argument(
            f"--{name}-channel", default=channel, metavar="NAME", help=f"of the {what} (%(default)s)"
        )
    add_collecting(group, 180.0, "picture or no IMU sample")


class OtherSizeError(DataError):
    """A picture that the camera's intrinsics do not hold for. Where the first is one, all are."""


@dataclass
class Advice:
    text: str
    enough: bool = False


@dataclass
class Collected:
    """What has come so far. Readings are as they came: the rig's calibration is not applied."""

    target: libloc.CalibrationTarget
    camera: libloc.CameraCalibration
    name: str = "live"
    views: list[libloc.TargetView] = field(default_factory=list)
    cells: NDArray[np.int64] = field(default_factory=lambda: np.zeros((_ROWS, _COLUMNS), np.int64))
    reasons: Counter[str] = field(default_factory=Counter)  # why the target was not found
    counts: Counter[str] = field(default_factory=Counter)
    left_out: int = 0
    unseen: int = 0  # pictures in a row without the target
    turns: CameraTurns = field(init=False)
    _seen_ns: list[int] = field(default_factory=list)  # first and last with the target
    _times: list[int] = field(default_factory=list)
    _rows: list[tuple[float, ...]] = field(default_factory=list)
    _rates: int = 0  # turn rates that are finite: how many, their sum, and that of their products
    _sum: Array = field(default_factory=lambda: np.zeros(3))
    _products: Array = field(default_factory=lambda: np.zeros((3, 3)))
    _sequence: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.turns = CameraTurns(self.target, self.camera)

    def note_sequence(self, name: str, sequence: int) -> None:
        self.counts[f"{name}.received"] += 1
        last = self._sequence.get(name, -1)
        if 0 <= last < sequence - 1:
            self.counts[f"{name}.lost"] += sequence - last - 1
        self._sequence[name] = sequence

    def add_imu(self, time_ns: int, angular_velocity: list[float], specific_force: list[float]) -> None:
        self._times.append(time_ns)
        self._rows.append((*angular_velocity, *specific_force))
        rate = np.array(angular_velocity)
        if np.isfinite(rate).all():
            self._rates += 1
            self._sum += rate
            self._products += np.outer(rate, rate)

    def add_detection(self, time_ns: int, seen: libloc.TargetDetection) -> None:
        self.counts["images.searched"] += 1
        self.left_out += seen.corners_left_out
        pixels = np.asarray(seen.view.pixels_px)
        self.views.append(libloc.TargetView(seen.view.ids, pixels, time_ns))
        if len(seen.view) == 0:
            self.reasons[seen.reason] += 1
            self.unseen += 1
            return
        self.unseen = 0
        self._seen_ns = [*self._seen_ns[:1], time_ns]
        self.turns.add(self.views[-1])
        self.counts["images.with_target"] += 1
        size = (self.camera.width_px, self.camera.height_px)
        at = np.floor((pixels + 0.5) / size * (_COLUMNS, _ROWS)).astype(int)
        inside = (at >= 0).all(1) & (at < (_COLUMNS, _ROWS)).all(1)
        np.add.at(self.cells, (at[inside, 1], at[inside, 0]), 1)

    @property
    def imu_times_ns(self) -> NDArray[np.int64]:
        return np.array(self._times, dtype=np.int64)

    @property
    def angular_velocity(self) -> Array:
        return np.ascontiguousarray(np.array(self._rows, dtype=float).reshape(-1, 6)[:, :3])

    @property
    def specific_force(self) -> Array:
        return np.ascontiguousarray(np.array(self._rows, dtype=float).reshape(-1, 6)[:, 3:])

    def some_rates(self, count: int) -> tuple[NDArray[np.int64], Array]:
        """Times and turn rates of about so many samples, for a plot."""
        step = max(1, len(self._times) // count)
        rates = np.array([row[:3] for row in self._rows[::step]], dtype=float).reshape(-1, 3)
        return np.array(self._times[::step], dtype=np.int64), rates

    def seconds(self) -> float:
        """Of pictures that show the target, from the first to the last."""
        return (self._seen_ns[-1] - self._seen_ns[0]) * 1e-9 if self._seen_ns else 0.0

    def latest_turning(self) -> float:
        """Root mean square of the turn rate [rad/s] in the last seconds; NaN without samples."""
        first = len(self._times)
        while first > 0 and self._times[-1] - self._times[first - 1] < _LATEST_S * 1e9:
            first -= 1
        rates = np.array(self._rows[first:], dtype=float).reshape(-1, 6)[:, :3]
        rates = rates[np.isfinite(rates).all(axis=1)]
        return float(np.sqrt(np.sum(rates**2, axis=1).mean())) if len(rates) else np.nan

    def turning(self) -> tuple[Array, Array]:
        """Deviations of the turn rate [rad/s] about the IMU's axes, and the axis with the least."""
        if self._rates < 2:
            return np.zeros(3), np.zeros(3)
        mean = self._sum / self._rates
        covariance = self._products / self._rates - np.outer(mean, mean)
        values, vectors = np.linalg.eigh(covariance)
        return (
            np.sqrt(np.maximum(np.diag(covariance), 0.0)),
            vectors[:, 0] * np.sqrt(max(values[0], 0.0)),
        )

    def skipped(self) -> int:
        """Pictures of the camera that came and were not searched."""
        return sum(count for name, count in self.counts.items() if name.startswith("images.skipped."))

    def coverage(self) -> float:
        return float((self.cells > 0).mean())


def _axis_name(axis: Array) -> str:
    """ "x", or "x and z": what a unit vector mostly is."""
    share = np.abs(axis) / max(np.linalg.norm(axis), 1e-12)
    return " and ".join(name for name, s in zip("xyz", share, strict=True) if s > 0.5) or "x"


def _place_name(cells: NDArray[np.int64]) -> str:
    """Of nine parts of the image, the one with the fewest cells that have seen a corner."""
    seen = (cells > 0).reshape(3, _ROWS // 3, 3, _COLUMNS // 3).mean(axis=(1, 3))
    row, column = np.unravel_index(int(np.argmin(seen)), seen.shape)
    vertical, horizontal = ("upper", "", "lower")[row], ("left", "", "right")[column]
    return f"{vertical} {horizontal}".strip() + " part" if (row, column) != (1, 1) else "middle"


def advice_of(collected: Collected, fit: libloc.CameraImuFit | None, failure: str, confirmed: int) -> Advice:
    """What to do next."""
    found, searched = collected.counts["images.with_target"], collected.counts["images.searched"]
    if searched >= 10 and found < _LEAST_SEEN * searched:
        why = collected.reasons.most_common(1)
        return Advice(
            "the target is not seen in most pictures"
            + (f" ({why[0][0]})" if why else "")
            + ": keep it in view"
        )
    if collected.seconds() < 5:
        return Advice("wave the rig: turn it about all axes and move it, the target in view")
    if collected.unseen >= _UNSEEN:
        return Advice(f"the target is not seen any more ({collected.reasons.most_common(1)[0][0]}): show it")
    if collected.latest_turning() < _SLOW:
        return Advice("turn faster: it need not be held still")
    spread, weakest = collected.turning()
    if np.linalg.norm(weakest) < _LEAST_TURNING:
        named = collected.turns.weakest()
        if named is not None:
            return Advice(f"turn it briskly about the axis {_ABOUT[named]}")
        axis = _axis_name(weakest) if np.linalg.norm(weakest) > 0 else _axis_name(1 / (spread + 1e-9))
        return Advice(f"turn it about the IMU's {axis} axis too, and briskly")
    if collected.coverage() < _LEAST_COVERAGE:
        return Advice(f"bring the target into the {_place_name(collected.cells)} of the image")
    if failure:
        return Advice(failure)
    if fit is None:
        return Advice("go on")
    small = is_small(fit)
    if small and collected.seconds() >= _LEAST_S and confirmed >= _CONFIRMATIONS:
        return Advice("enough now", enough=True)
    if small:
        return Advice("nearly there, go on")
    return Advice("go on, more briskly" if np.linalg.norm(spread) < 0.6 else "go on")


def deviations(fit: libloc.CameraImuFit) -> tuple[float, float, float]:
    """Rotation [deg], translation [mm], offset [ms]."""
    camera = fit.cameras[0]
    # Without the part of the intrinsics: waving does not make that smaller.
    sigma = np.maximum(camera.sigma_by_noise, camera.sigma_by_blocks)
    return (
        float(np.rad2deg(np.linalg.norm(sigma[:3]))),
        float(1e3 * np.linalg.norm(sigma[3:6])),
        float(1e3 * sigma[6]),
    )


def is_small(fit: libloc.CameraImuFit) -> bool:
    """Deviations of a solution that is none mean nothing."""
    if not fit.converged or fit.quality.verdict == libloc.Verdict.REFUSED:
        return False
    turn, shift, offset = deviations(fit)
    return turn < _ENOUGH_DEG and shift < _ENOUGH_MM and offset < _ENOUGH_MS


class Rates:
    """How many pictures and IMU samples come in a second, on the computer's clock."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, int, int]] = deque()

    def add(self, now_s: float, counts: Counter[str]) -> tuple[float, float]:
        """The rates [Hz] over the last seconds; zero at the first call."""
        self._seen.append((now_s, counts["images.received"], counts["imu.received"]))
        while len(self._seen) > 2 and now_s - self._seen[1][0] >= _RATES_S:
            self._seen.popleft()
        since, images, imu = self._seen[0]
        elapsed = max(now_s - since, 1e-3)
        return (self._seen[-1][1] - images) / elapsed, (self._seen[-1][2] - imu) / elapsed


class _Display:
    """One line a second; on a terminal the image's cells that are drawn over and over."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._rates = Rates()
        self._terminal = stream.isatty()
        self._screen = Screen(stream)

    def show(self, collected: Collected, fit: libloc.CameraImuFit | None, advice: Advice) -> None:
        spread, weakest = collected.turning()
        camera_hz, imu_hz = self._rates.add(time.monotonic(), collected.counts)
        known = "not solved yet"
        if fit is not None:
            known = "known to {:.2g} deg, {:.2g} mm, {:.2g} ms".format(*deviations(fit))
        came = (
            f"{collected.seconds():4.0f} s  camera {camera_hz:.0f} Hz, IMU {imu_hz:.0f} Hz  "
            f"target in {collected.counts['images.with_target']} of {collected.counts['images.searched']} "
            f"pictures, {collected.skipped()} skipped"
        )
        turned = (
            f"turning {' '.join(f'{x:.2f}' for x in spread)} "
            f"(least {np.linalg.norm(weakest):.2f}) rad/s  {100 * collected.coverage():.0f} % of the image"
        )
        if not self._terminal:
            print(came, turned, known, advice.text, sep="  ", file=self._stream, flush=True)
            return
        cells = map_of_cells(collected.cells, (1, 10, 100), self._stream.encoding)
        self._screen.show([came, turned, known, *(f"  {line}" for line in cells), advice.text])


def plot_progress(collected: Collected, advice: Advice) -> Figure:
    figure = new_figure(11, 4.5)
    left, right = figure.subplots(1, 2)
    shown = left.imshow(
        np.log10(1 + collected.cells),
        cmap="viridis",
        extent=(-0.5, collected.camera.width_px - 0.5, collected.camera.height_px - 0.5, -0.5),
        aspect="equal",
    )
    figure.colorbar(shown, ax=left, label="corners [powers of ten]", shrink=0.7)
    left.set(title="where corners were seen", xlabel="u [px]", ylabel="v [px]")
    times, rates = collected.some_rates(3000)
    if len(times):
        for i, axis in enumerate("xyz"):
            right.plot((times - times[0]) * 1e-9, rates[:, i], label=axis, linewidth=0.8)
        right.legend(loc="upper right")
    right.set(title="turn rate", xlabel="time [s]", ylabel="rad/s")
    figure.suptitle(advice.text)
    return figure


def _write_picture(folder: Path, collected: Collected, advice: Advice) -> None:
    """progress.png, replaced as a whole: a viewer never sees half of it."""
    folder.mkdir(parents=True, exist_ok=True)
    temporary = folder / "progress.png.tmp"
    plot_progress(collected, advice).savefig(temporary, dpi=90, format="png")
    temporary.replace(folder / "progress.png")


def write_recording(folder: Path, collected: Collected) -> None:
    """corners.csv and imu.csv, which loc-calibrate camera-imu reads."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "corners.csv").open("w", encoding="ascii") as file:
        file.write("timestamp_ns,corner_id,u_px,v_px\n")
        for view in collected.views:
            for i, (u, v) in zip(view.ids, np.asarray(view.pixels_px).tolist(), strict=True):
                file.write(f"{view.time_ns},{i},{u!r},{v!r}\n")
    rows = np.hstack([collected.angular_velocity, collected.specific_force]).tolist()
    with (folder / "imu.csv").open("w", encoding="ascii") as file:
        file.write("time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2\n")
        for time_ns, row in zip(collected.imu_times_ns.tolist(), rows, strict=True):
            file.write(f"{time_ns},{','.join(repr(x) for x in row)}\n")


class _Session:
    """Messages in, guidance out. Detection and solution run in threads of their own."""

    def __init__(
        self,
        options: argparse.Namespace,
        collected: Collected,
        detect: Callable[[Any, str], libloc.TargetDetection],
        solve: Callable[[Collected], libloc.CameraImuFit],
    ) -> None:
        self._options, self._detect, self._solve = options, detect, solve
        self.collected = collected
        self.fit: libloc.CameraImuFit | None = None
        self.failure = ""
        self.confirmed = 0
        self.ended = ""  # what the source said
        self.last = {"images": time.monotonic(), "imu": time.monotonic()}
        self._workers = ThreadPoolExecutor(2)
        self._detection: tuple[int, Future[libloc.TargetDetection]] | None = None
        self._waiting: Any = None  # the newest picture that nobody looked at
        self._solution: Future[libloc.CameraImuFit] | None = None
        self._next_fit_s = _FIT_EVERY_S

    def close(self) -> None:
        self._workers.shutdown(wait=True, cancel_futures=True)

    def take(self, channel: str, data: bytes) -> None:
        options, collected = self._options, self.collected
        expected = {options.image_channel: "image_t", options.imu_channel: "imu_t"}.get(
            channel, "source_status_t"
        )
        try:
            name = libloc.message_type(data)
        except DataError:
            name = None
        if name != expected:
            collected.counts[f"{channel}.refused"] += 1
        elif name == "source_status_t":
            status = _MESSAGES.source_status_t.decode(data)
            if status.state != _MESSAGES.source_status_t.STATE_RUNNING:
                self.ended = status.message or "the source has ended"
        elif name == "imu_t":
            m = _MESSAGES.imu_t.decode(data)
            self.last["imu"] = time.monotonic()
            collected.note_sequence("imu", m.sequence)
            collected.add_imu(m.time_ns, list(m.angular_velocity), list(m.specific_force))
        else:
            picture = _MESSAGES.image_t.decode(data)
            if picture.camera != options.camera[0]:
                collected.counts["images.of_other_cameras"] += 1
                return
            self.last["images"] = time.monotonic()
            collected.note_sequence("images", picture.sequence)
            if self._waiting is not None:
                collected.counts["images.skipped.detector_busy"] += 1
            self._waiting = picture

    def work(self) -> None:
        """Starts what can be started, and takes what is ready."""
        collected = self.collected
        if self._detection is not None and self._detection[1].done():
            time_ns, found = self._detection
            self._detection = None
            try:
                collected.add_detection(time_ns, found.result())
            except OtherSizeError:
                if not collected.views:
                    raise
                collected.counts["images.skipped.other_size"] += 1
            except DataError:
                collected.counts["images.skipped.damaged"] += 1
        if self._detection is None and self._waiting is not None:
            picture, self._waiting = self._waiting, None
            where = f"picture {picture.sequence}"
            self._detection = (picture.time_ns, self._workers.submit(self._detect, picture, where))
        if self._solution is not None and self._solution.done():
            try:
                self.fit, self.failure = self._solution.result(), ""
            except DataError as error:
                self.failure = str(error)
            self._solution = None
            self.confirmed = self.confirmed + 1 if self._is_small() else 0
        if self._solution is None and collected.seconds() >= self._next_fit_s:
            self._next_fit_s = collected.seconds() + _FIT_EVERY_S
            self._solution = self._workers.submit(self._solve, _copy(collected))

    def finish(self) -> None:
        """Looks at the picture that is left; nothing more is solved."""
        self._next_fit_s = float("inf")
        while self._detection is not None or self._waiting is not None:
            self.work()
            time.sleep(0.002)

    def _is_small(self) -> bool:
        return self.fit is not None and not self.failure and is_small(self.fit)

    def advice(self) -> Advice:
        return advice_of(self.collected, self.fit, self.failure, self.confirmed)

    def silent(self) -> str:
        """Which stream has been silent for longer than the patience."""
        for name, what in (("images", self._options.image_channel), ("imu", self._options.imu_channel)):
            if time.monotonic() - self.last[name] > self._options.patience:
                return f"nothing came on {what} for {self._options.patience:g} s"
        return ""


def _copy(collected: Collected) -> Collected:
    """What a solution works on while more comes."""
    out = Collected(collected.target, collected.camera, views=list(collected.views))
    out._times, out._rows = list(collected._times), list(collected._rows)
    return out


def _detector(
    target: libloc.CalibrationTarget, camera: libloc.CameraCalibration
) -> Callable[[Any, str], libloc.TargetDetection]:
    detector = libloc.TargetDetector(target, thorough=False)

    def detect(picture: Any, where: str) -> libloc.TargetDetection:
        grey = of_message(picture, where)
        height, width = grey.shape
        if (width, height) != (camera.width_px, camera.height_px):
            raise OtherSizeError(
                f"pictures of {width} x {height} pixels come; {camera.name} of the rig has "
                f"{camera.width_px} x {camera.height_px}: intrinsics hold for one size only"
            )
        return detector.detect(grey)

    return detect


def collect(
    options: argparse.Namespace,
    target: libloc.CalibrationTarget,
    camera: libloc.CameraCalibration,
    solve: Callable[[Collected], libloc.CameraImuFit],
    stream: TextIO | None = None,
) -> Collected:
    """solve: a quick calibration of what there is.

    Raises DataError when nothing comes, or no connection can be made.
    """
    stream = stream or sys.stderr
    collected = Collected(target, camera, f"live on {options.lcm_url}")
    session = _Session(options, collected, _detector(target, camera), solve)
    display = _Display(stream)
    start = time.monotonic()
    next_line, next_picture = start, start + _PICTURE_S
    why = "the time given with --duration is over"
    # A queue, so that drawing loses none.
    messages: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
    channels = [options.image_channel, options.imu_channel, libloc.SOURCE_STATUS_CHANNEL]
    receiver = LcmReceiver(options.lcm_url, channels, lambda *message: messages.put(message))
    try:
        try:
            with receiver:
                while time.monotonic() - start < options.duration:
                    try:
                        session.take(*messages.get(timeout=0.01))
                        empty = False
                    except queue.Empty:
                        empty = True
                    session.work()
                    silent = session.silent()
                    if silent:
                        why = silent
                        break
                    if session.ended and empty:
                        why = session.ended
                        break
                    now = time.monotonic()
                    if now < next_line:
                        continue
                    next_line = now + _LINE_S
                    advice = session.advice()
                    display.show(collected, session.fit, advice)
                    if advice.enough:
                        why = advice.text
                        break
                    if options.report and now >= next_picture:
                        next_picture = now + _PICTURE_S
                        _write_picture(options.report, collected, advice)
        except KeyboardInterrupt:
            why = "interrupted"
        while not messages.empty():  # what came before the end counts
            session.take(*messages.get())
        session.finish()
    finally:
        session.close()
    if receiver.connections_lost:
        collected.counts["connections.lost"] = receiver.connections_lost
    for name, what in (("images.received", options.image_channel), ("imu.received", options.imu_channel)):
        if not collected.counts[name]:
            others = collected.counts["images.of_other_cameras"] if name == "images.received" else 0
            hint = f"{others} pictures of other cameras did (--camera)" if others else ""
            raise DataError(
                f"nothing came on {what} ({options.lcm_url}): {why}; "
                + (hint or "does loc-driver send both there?")
            )
    print(f"collecting ended: {why}", file=stream)
    if options.report:
        _write_picture(options.report, collected, session.advice())
        write_recording(options.report, collected)
    return collected
