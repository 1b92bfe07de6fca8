"""Brings pictures and the frames that were made of them together."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from libloc.view.pictures import Features, Frames


class Matcher:
    """Pictures and frames may come in any order; none is held up for long, nor are many kept."""

    def __init__(
        self,
        draw: Callable[[Any | None, Features | None], None],
        offset_ns: int,
        waiting_pictures: int = 15,
        waiting_frames: int = 60,
    ) -> None:
        """offset_ns takes the pictures' clock to that of the frames.

        waiting_pictures: for their frames; 15 is half a second at 30 per second. waiting_frames: for
        pictures; one that came too late, or was dropped, is not waited for any longer.
        """
        self._draw, self._offset_ns = draw, offset_ns
        self._most_pictures, self._most_frames = waiting_pictures, waiting_frames
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
            if len(self._frames) > self._most_frames:
                for old in self._frames.rest(keep=self._most_frames // 2):
                    self._draw(None, old)
            return
        m, _ = self._pictures.pop((frame.camera, frame.sequence))
        self._draw(m, frame)

    def give_up(self, now_s: float, patience_s: float = 0.5) -> None:
        """Draws pictures that have waited long enough."""
        while self._pictures:
            m, came_s = next(iter(self._pictures.values()))
            waits = len(self._pictures) <= self._most_pictures and now_s - came_s < patience_s
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
