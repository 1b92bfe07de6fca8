"""Draws LCM logs. They are read twice: to know start and extent, and to draw. Memory does not grow with them.

Several logs are read together in the order of measurement, whenever they were logged: each in its own order,
and of those that come next the one that was measured first.
"""

from __future__ import annotations

import heapq
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import NO_TIME, DataError, EstimateStatus, EstimateValid
from libloc._core import LcmLogReader
from libloc.view.geometry import Floats
from libloc.view.intake import Intake, Item, Stamps, stamp_of
from libloc.view.matching import Matcher
from libloc.view.scene import Scene
from libloc.view.space import is_tied

_EXTENT = 0.95  # share of the points that the view is made for
_FEWEST = 3  # pairs for an alignment
# Pictures and frames that wait for each other: an estimator may be so far behind.
_WAITING_PICTURES, _WAITING_FRAMES, _PATIENCE_S = 150, 600, 5.0
_PAIR_NS = 20_000_000  # estimate and reference are not further apart


@dataclass
class Window:
    """Part of the logs, in measurement time since their start."""

    start_s: float = 0.0
    duration_s: float = float("inf")

    def holds(self, time_ns: int, start_ns: int) -> bool:
        return 0 <= 1e-9 * (time_ns - start_ns) - self.start_s <= self.duration_s


class Way:
    """Positions over time: when there are too many, every second one is left out from then on."""

    def __init__(self, most: int = 1_000_000) -> None:
        self._most, self._every, self._offered = most, 1, 0
        self._times, self._places = array("q"), array("d")

    def add(self, time_ns: int, position: Sequence[float]) -> None:
        self._offered += 1
        if (self._offered - 1) % self._every:
            return
        self._times.append(time_ns)
        self._places.extend(position)
        if len(self._times) > self._most:
            places = self.positions[::2]
            self._times, self._places = self._times[::2], array("d", places.tobytes())
            self._every *= 2

    def __len__(self) -> int:
        return len(self._times)

    @property
    def times_ns(self) -> NDArray[np.int64]:
        return np.array(self._times, dtype=np.int64)

    @property
    def positions(self) -> Floats:
        return np.array(self._places, dtype=float).reshape(-1, 3)

    @property
    def thinned(self) -> int:
        """So many were left out."""
        return self._offered - len(self)


@dataclass
class Survey:
    """What is in the logs, pictures aside."""

    start_ns: int = 0
    frames: int = 0  # of the camera
    maps: int = 0
    last_map: Any = None
    way: Way = field(default_factory=Way)  # of the estimates with position
    tied: bool = False  # to north, so that the positions are in the world that the log ends in
    became_tied: bool = False  # after others that were not
    reference: Way = field(default_factory=Way)
    origin: Any = None  # a fusion_t that tells it
    scale_unknown: bool = False
    method: str = ""
    has_latency: bool = False
    pictures: int = 0
    picture_px: tuple[int, int] | None = None


def _begin(path: Path) -> Stamps:
    """Stamps that know where a log begins: only two that agree tell, the first one may be damaged."""
    out = Stamps()
    for *_, data in LcmLogReader(path):
        time_ns = stamp_of(data)
        if time_ns is not None and out.judge(time_ns):
            break
    return out


def _timed(path: Path, damage: Counter[str]) -> Iterator[tuple[int, str, bytes]]:
    """With the time of measurement; what has none, or an absurd one, goes with what was before it."""
    stamps = _begin(path)
    log = LcmLogReader(path)
    for _, _, channel, data in log:
        time_ns = stamp_of(data)
        if time_ns is not None:
            stamps.judge(time_ns)
        yield NO_TIME if stamps.newest_ns is None else stamps.newest_ns, channel, data
    for name, count in log.damage().items():
        damage[f"log.{name}"] += count


def _events(paths: Sequence[Path], damage: Counter[str]) -> Iterator[tuple[str, bytes]]:
    for _, channel, data in heapq.merge(
        *(_timed(path, damage) for path in paths), key=lambda event: event[0]
    ):
        yield channel, data


def survey(
    paths: Sequence[Path], intake: Intake, camera: int, window: Window, counts: Counter[str]
) -> Survey:
    """Raises DataError for a file that is no LCM log, and when nothing in the logs can be drawn."""
    for path in paths:
        if path.is_file() and libloc.file_format(path) != "lcm":
            raise DataError(f"{path}: is not an LCM log")
    out = Survey()
    first: int | None = None
    for item in intake.items(_events(paths, counts)):
        if item.stream in ("statistics", "source", "status"):
            continue
        first = item.message.time_ns if first is None else min(first, item.message.time_ns)
        if window.holds(item.message.time_ns, first):
            _look(out, item, camera)
    if first is None:
        seen = intake.counts.keys() | intake.others.keys()
        channels = sorted({name.removesuffix(".received").removesuffix(".refused") for name in seen})
        raise DataError(
            f"{', '.join(map(str, paths))}: nothing to be drawn in it; "
            + (f"its channels: {', '.join(channels)} (--channel STREAM=NAME)" if channels else "it is empty")
        )
    out.start_ns = first
    counts["survey.estimates.thinned"] += out.way.thinned
    counts["survey.reference.thinned"] += out.reference.thinned
    return out


def _look(out: Survey, item: Item, camera: int) -> None:
    m = item.message
    match item.stream:
        case "image":
            if m.camera == camera:
                out.pictures += 1
                out.picture_px = out.picture_px or (m.width, m.height)
        case "frame":
            out.frames += m.camera == camera
        case "map":
            out.maps += 1
            out.last_map = m
        case "estimate":
            out.method = m.method
            out.has_latency |= m.host_time_ns != NO_TIME and m.publish_time_ns > m.host_time_ns
            out.scale_unknown |= bool(m.status & EstimateStatus.SCALE_UNKNOWN)
            if m.valid & EstimateValid.POSITION and np.isfinite(m.position).all():
                tied = is_tied(m)
                if tied and not out.tied and len(out.way):
                    out.became_tied = True
                    out.way = Way()
                out.tied = tied
                out.way.add(m.time_ns, m.position)
        case "reference":
            if np.isfinite(m.position).all():
                out.reference.add(m.time_ns, m.position)
        case "fusion":
            if out.origin is None and np.isfinite(m.origin_latitude):
                out.origin = m


def extent(found: Survey) -> tuple[Floats, float] | None:
    """Centre and radius of what the view is to show: the way, and the part of the map that is well known."""
    points = [found.way.positions]
    if found.last_map is not None:
        p = np.array(found.last_map.position, dtype=float).reshape(-1, 3)
        cov = np.array(found.last_map.position_cov, dtype=float).reshape(-1, 9)
        with np.errstate(invalid="ignore"):
            spread = 3 * np.sqrt(cov[:, [0, 4, 8]].sum(axis=1))
        eye = points[0][-1] if len(points[0]) else np.zeros(3)
        points.append(p[spread < 0.5 * np.linalg.norm(p - eye, axis=1)])
    both = np.concatenate(points)
    both = both[np.isfinite(both).all(axis=1)]
    if len(both) == 0:
        return None
    low, high = np.quantile(both, [1 - _EXTENT, _EXTENT], axis=0)
    if len(points[0]):
        low, high = np.minimum(low, points[0].min(axis=0)), np.maximum(high, points[0].max(axis=0))
    return (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-3)


def alignment(found: Survey, how: str) -> tuple[Callable[[Floats], Floats] | None, str]:
    """Takes the reference to the estimates' world, and a sentence about it; None: it cannot be drawn there.

    how: auto, none, se3, sim3, yaw. auto: as far as the method does not know the world by itself.
    """
    if not len(found.reference):
        return None, ""
    if how == "auto":
        slam = found.method.endswith("slam")
        how = "sim3" if found.scale_unknown else "se3" if slam and found.origin is None else "none"
    if how == "none":
        return (lambda points: points), "the reference is drawn as it is"
    times, rows = np.unique(found.reference.times_ns, return_index=True)
    reference = found.reference.positions[rows]
    mine = found.way.times_ns
    at = np.clip(np.searchsorted(times, mine), 1, max(len(times) - 1, 1))
    at = np.minimum(at, len(times) - 1)
    at = np.where(np.abs(times[at - 1] - mine) < np.abs(times[at] - mine), at - 1, at)
    near = np.abs(times[at] - mine) <= _PAIR_NS
    if near.sum() < _FEWEST:
        return None, f"the reference is not drawn: {near.sum()} estimates are as late as one of its poses"
    fit = libloc.align_points(reference[at[near]], found.way.positions[near], how)
    if not fit.ok:
        return None, f"the reference is not drawn: {fit.failure}"
    T, scale = fit.T_reference_estimate, fit.scale

    def apply(points: Floats) -> Floats:
        return T.transform(scale * points)

    return apply, f"the reference is drawn after an alignment ({how}) with the estimates"


def draw(
    paths: Sequence[Path],
    intake: Intake,
    found: Survey,
    window: Window,
    scene: Scene,
    stop: Callable[[], bool] = lambda: False,
) -> None:
    """Draws all that is in the window, each picture with its frame, until stop() says so."""
    if found.origin is not None:
        scene.space.fusion(found.origin)
    scene.space.camera_from_frames = found.frames > 0
    matcher = Matcher(scene.pictures.draw, scene.pictures.offset_ns, _WAITING_PICTURES, _WAITING_FRAMES)
    started = False
    for item in intake.items(_events(paths, Counter())):
        if stop():
            break
        if item.stream in ("statistics", "source", "status"):
            # Of the host's clock: they belong where the messages about them are.
            if started:
                scene.take(item)
            continue
        time_ns = item.message.time_ns
        started = window.holds(time_ns, found.start_ns)
        if not started:
            continue
        now_s = 1e-9 * (time_ns - found.start_ns)
        if item.stream == "image":
            if found.frames:
                matcher.picture(item.message, now_s)
            else:
                scene.pictures.draw(item.message, None)
        elif item.stream == "map" and found.maps == 1:
            # An estimator off line writes its map at the end: it is of use from the start.
            scene.space.map(item.message, found.start_ns + round(1e9 * window.start_s))
        else:
            scene.take(item)
            if item.stream == "frame" and scene.frame_of is not None:
                matcher.frame(scene.frame_of, now_s)
        matcher.give_up(now_s, _PATIENCE_S)
    matcher.finish()
    scene.finish()
