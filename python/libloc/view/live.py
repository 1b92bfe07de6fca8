"""Draws what comes over LCM, as it comes."""

from __future__ import annotations

from typing import Any

import loc
import numpy as np

from libloc.view.intake import Intake, Item
from libloc.view.matching import Matcher
from libloc.view.scene import Scene

_MESSAGES: Any = loc  # lcm-gen writes no types
_FLUSH_S = 0.1
_STEP_BACK_NS = 1_000_000_000  # in the time of measurement: the source has begun anew


class LiveDrawing:
    """Takes messages and draws them into a scene."""

    def __init__(self, scene: Scene, intake: Intake, align: str) -> None:
        """align: auto or none; of a reference in another world nothing can be drawn yet."""
        self.scene, self.intake = scene, intake
        self.pictures = Matcher(scene.pictures.draw, scene.pictures.offset_ns)
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
