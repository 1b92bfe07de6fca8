"""All of the drawing together: what each message changes."""

from __future__ import annotations

from collections import Counter
from typing import Any

from libloc import NO_TIME
from libloc.view.intake import Item
from libloc.view.pictures import Features, PictureDrawing
from libloc.view.plots import PlotDrawing
from libloc.view.recorder import Recorder, Thinner
from libloc.view.space import SpaceDrawing


class Scene:
    """Takes messages in the order in which they come, but for pictures: each is drawn with its frame."""

    def __init__(
        self, out: Recorder, space: SpaceDrawing, plots: PlotDrawing, pictures: PictureDrawing, rate_hz: float
    ) -> None:
        """rate_hz: so many estimates a second are drawn; of the others status and latency are kept."""
        self.out, self.space, self.plots, self.pictures = out, space, plots, pictures
        self._counts: Counter[str] = Counter()
        self._thinner = Thinner(rate_hz)
        self._latency_s = float("nan")
        self.frame_of: Features | None = None  # features of the frame that was taken last

    @property
    def counts(self) -> Counter[str]:
        return self._counts + self.space.counts + self.plots.counts + self.pictures.counts

    def take(self, item: Item) -> None:
        m = item.message
        match item.stream:
            case "estimate":
                self._estimate(m)
            case "frame":
                self._frame(m)
            case "map":
                self.space.map(m)
            case "fusion":
                self.space.fusion(m)
            case "gps":
                self.space.gps(m)
            case "reference":
                self.space.reference(m)
            case "status":
                self.plots.status(m)
            case "statistics":
                self.plots.statistics(m)
            case "source":
                self.plots.source(m)

    def finish(self) -> None:
        self.space.finish()
        self.plots.finish()

    def _frame(self, m: Any) -> None:
        self.frame_of = None
        if m.camera != self.pictures.camera:
            self._counts["frames.other_camera"] += 1
            return
        self.plots.frame(m)
        self.space.frame(m)
        try:
            self.frame_of = Features.of(m)
        except ValueError:
            self._counts["frames.refused"] += 1

    def _estimate(self, m: Any) -> None:
        t = m.time_ns
        self.plots.flags(t, m.status, m.valid)
        if m.host_time_ns != NO_TIME and m.publish_time_ns > m.host_time_ns:
            late = 1e-9 * (m.publish_time_ns - m.host_time_ns)
            self._latency_s = late if self._latency_s != self._latency_s else max(self._latency_s, late)
        if not self._thinner.due(t):
            return
        position, heading = self.space.estimate(m)
        self.plots.sigmas(t, position, heading)
        if self._latency_s == self._latency_s:
            self.plots.latency(t, self._latency_s)
            self._latency_s = float("nan")
