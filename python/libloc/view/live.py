"""Draws what comes over LCM, as it comes."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

import loc
import numpy as np

from libloc.view.intake import Intake, Item
from libloc.view.pictures import Features, Frames
from libloc.view.scene import Scene

_MESSAGES: Any = loc  # lcm-gen writes no types
_FLUSH_S = 0.1
_WAITING_PICTURES = 15  # for their frames: half a second at 30 per second
_WAITING_FRAMES = 60  # for pictures: one that came too late, or was dropped, is not waited for any longer
_STEP_BACK_NS = 1_000_000_000  # in the time of measurement: the source has begun anew


class LivePictures:
    """Brings pictures and frames together that come in any order; a picture is not held up for long."""

    def __init__(self, draw: Callable[[Any | None, Features | None], None], offset_ns: int) -> None:
        self._draw, self._offset_ns = draw, offset_ns
        self._frames = Frames()
        self._pictures: OrderedDict[tuple[int, int], tuple[Any, float]] = OrderedDict()
        self._expects_frames, self._had_frames = True, False

    def picture(self, m: Any, now_s: float) -> None:
        frame = self._frames.pop(m, self._offset_ns)
        if frame is not None:
            self._draw(m, frame)
        else:
            before = self._pictures.pop((m.camera, m.sequence), None)
            if before is not None:  # the source has begun anew
                self._draw(before[0], None)
            self._pictures[m.camera, m.sequence] = (m, now_s)

    def frame(self, frame: Features, now_s: float) -> None:
        self._expects_frames = self._had_frames = True
        if (frame.camera, frame.sequence) not in self._pictures:
            self._frames.add(frame)
            if len(self._frames) > _WAITING_FRAMES:
                for old in self._frames.rest(keep=_WAITING_FRAMES // 2):
                    self._draw(None, old)
            return
        m, _ = self._pictures.pop((frame.camera, frame.sequence))
        self._draw(m, frame)

    def give_up(self, now_s: float, patience_s: float = 0.5) -> None:
        """Draws pictures that have waited long enough."""
        while self._pictures:
            m, came_s = next(iter(self._pictures.values()))
            waits = len(self._pictures) <= _WAITING_PICTURES and now_s - came_s < patience_s
            if self._expects_frames and waits:
                return
            # Where there are no frames at all, only the first pictures wait for them.
            self._expects_frames = self._had_frames
            self._pictures.popitem(last=False)
            self._draw(m, None)

    def finish(self) -> None:
        self.give_up(float("inf"))
        for frame in self._frames.rest():
            self._draw(None, frame)


class LiveDrawing:
    """Takes messages and draws them into a scene."""

    def __init__(self, scene: Scene, intake: Intake, align: str) -> None:
        """align: auto or none; of a reference in another world nothing can be drawn yet."""
        self.scene, self.intake = scene, intake
        self.pictures = LivePictures(scene.pictures.draw, scene.pictures.offset_ns)
        self.ended = False  # the source has said so
        self._align = align
        self._flushed_s = 0.0
        self._tell_align("" if align == "auto" else "known")

    def _tell_align(self, method: str) -> None:
        if method and (self._align == "none" or not method.endswith("slam")):
            self.scene.space.align = lambda points: points

    def take(self, item: Item, now_s: float) -> None:
        m = item.message
        if item.stream == "image":
            self.pictures.picture(m, now_s)
            return
        if item.stream == "source":
            self.ended = m.state != _MESSAGES.source_status_t.STATE_RUNNING
        if item.stream == "estimate":
            if self.scene.space.align is None:
                self._tell_align(m.method)
            before = self.scene.plots.now_ns
            if before is not None and m.time_ns < before - _STEP_BACK_NS:
                self.intake.counts["time.stepped_back"] += 1
                text = f"time of measurement stepped back by {1e-9 * (before - m.time_ns):.2f} s"
                self.scene.plots.text(m.time_ns, text, "WARN")
                self.scene.plots.now_ns = m.time_ns
        self.scene.take(item)
        if item.stream == "frame" and self.scene.frame_of is not None:
            self.pictures.frame(self.scene.frame_of, now_s)

    def tick(self, now_s: float) -> None:
        """To be called many times a second."""
        self.pictures.give_up(now_s)
        if now_s - self._flushed_s >= _FLUSH_S:
            self._flushed_s = now_s
            self.scene.out.flush()

    def finish(self) -> None:
        self.pictures.finish()
        self.scene.finish()


def scale_of(map_points: Any, eye: Any) -> float | None:
    """Length of axes that suits a map_points_t: a twentieth of the middle distance of its points."""
    p = np.array(map_points.position, dtype=float).reshape(-1, 3)
    distance = np.linalg.norm(p - eye, axis=1)
    distance = distance[np.isfinite(distance)]
    return float(np.median(distance)) / 20 if len(distance) else None
