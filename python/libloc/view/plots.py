"""Numbers over time, and what the estimator says about itself as lanes and lines of text."""

from __future__ import annotations

from collections import Counter
from typing import Any

import loc
import numpy as np

from libloc import NO_TIME, EstimateStatus, EstimateValid
from libloc.view.recorder import Recorder

_MESSAGES: Any = loc  # lcm-gen writes no types
_HOLD_NS = 200_000_000  # a flag that comes and goes with every sample is shown as one span
_BLUE, _ORANGE, _GREEN, _RED, _GREY = (
    (31, 119, 180), (255, 127, 14), (44, 160, 44), (214, 39, 40), (150, 150, 150),
)  # fmt: skip
#: Entity below plots/, title, names and colours of its lines.
SERIES: dict[str, tuple[str, tuple[tuple[str, tuple[int, int, int]], ...]]] = {
    "reprojection": (
        "reprojection rms [px]: before orange, after blue",
        (("before the update", _ORANGE), ("after the update", _BLUE)),
    ),
    "nis": (
        "NIS per number, 1 is right",
        (("normalised innovation squared per number", _BLUE), ("1", _GREY)),
    ),
    "features": (
        "features: map grey, seen orange, used blue",
        (
            ("in the map", _GREY),
            ("expected in view", _ORANGE),
            ("used", _BLUE),
            ("rejected", _RED),
            ("new", _GREEN),
        ),
    ),
    "time": ("time [ms]: latency orange, filter blue", (("filter, a frame", _BLUE),)),
    "latency": ("latency [ms]", (("arrival to estimate, worst", _ORANGE),)),
    "position_sigma": (
        "position sigma: x blue, y orange, z green",
        (("x", _BLUE), ("y", _ORANGE), ("z", _GREEN)),
    ),
    "heading_sigma": ("heading sigma [deg]", (("heading", _BLUE),)),
}
#: What is no trouble is not red.
_CALM = EstimateStatus.AT_REST | EstimateStatus.SCALE_UNKNOWN | EstimateStatus.INITIALISING
if hasattr(EstimateStatus, "REFOUND"):
    _CALM |= EstimateStatus.REFOUND
_LOSSES = ("imu.lost", "image.lost", "gps.lost", "magnetometer.lost")  # of statistics, as *.dropped
_FLAGS = {flag.value: str(flag.name).lower() for flag in EstimateStatus}


class PlotDrawing:
    """Series, lanes and text. Times that are the host's are put where the measurements are by then."""

    def __init__(self, out: Recorder) -> None:
        self.out = out
        self.counts: Counter[str] = Counter()
        self.now_ns: int | None = None  # newest time of measurement
        self._known: set[str] = set()
        self._flags_ns: dict[int, int] = {}  # bit that is shown as set, when it was set last
        self._valid = ""
        self._conditions: frozenset[str] | None = None
        self._source = ""
        self._lost: dict[str, float] = {}
        self._lanes: dict[str, dict[str, tuple[int, int, int]]] = {}

    def frame(self, m: Any) -> None:
        t = m.time_ns
        self._seen(t)
        self._row(t, "reprojection", m.reprojection_before_px, m.reprojection_after_px)
        self._row(t, "nis", m.nis / m.nis_dim if m.nis_dim > 0 else np.nan, 1.0)
        self._row(t, "features", m.map_size, m.visible, m.measured, m.rejected, m.added)
        self._row(t, "time", 1e3 * m.time_spent_s)

    def sigmas(self, time_ns: int, position: Any, heading_rad: float) -> None:
        """Deviations: position (3,) or None, heading, NaN where it is not known."""
        if position is not None:
            self._row(time_ns, "position_sigma", *position)
        if np.isfinite(heading_rad):
            self._row(time_ns, "heading_sigma", float(np.rad2deg(heading_rad)))

    def latency(self, time_ns: int, seconds: float) -> None:
        self._row(time_ns, "latency", 1e3 * seconds)

    def flags(self, time_ns: int, status: int, valid: int) -> None:
        """Bits of every estimate, also of those that are not drawn."""
        self._seen(time_ns)
        for bit, name in _FLAGS.items():
            if status & bit:
                if bit not in self._flags_ns:
                    self._lane(time_ns, name, "on", bool(bit & _CALM))
                self._flags_ns[bit] = time_ns
            elif bit in self._flags_ns and not 0 <= time_ns - self._flags_ns[bit] < _HOLD_NS:
                del self._flags_ns[bit]
                self._lane(time_ns, name, "", bool(bit & _CALM))
        oriented = valid & EstimateValid.ORIENTATION
        if valid & EstimateValid.POSITION:
            says = "pose" if oriented else "position"
        else:
            says = "orientation" if oriented else "nothing"
        if says != self._valid:
            self._valid = says
            self._lane(time_ns, "estimate", says, calm=says != "nothing")

    def status(self, m: Any) -> None:
        """estimator_status_t"""
        time_ns = self._measured(m.measurement_time_ns)
        now = frozenset(m.condition)
        if time_ns is None or now == self._conditions:
            return
        before = self._conditions or frozenset()
        for condition in sorted(now - before):
            self.text(time_ns, f"{m.method}: {condition}", "WARN")
        for condition in sorted(before - now):
            self.text(time_ns, f"{m.method}: no longer: {condition}", "INFO")
        if not now:
            self.text(time_ns, f"{m.method}: all is well", "INFO")
        self._conditions = now
        self._lane(time_ns, "says", ", ".join(sorted(now)) or "all is well", calm=not now)

    def statistics(self, m: Any) -> None:
        time_ns = self._measured(NO_TIME)
        if time_ns is None:
            return
        for name, value in zip(m.name, m.value, strict=True):
            key = f"{m.program} {name}"
            if name.endswith(".dropped") or name in _LOSSES:
                if value > self._lost.get(key, 0.0):
                    self.text(time_ns, f"{m.program}: {name} = {value:g}", "WARN")
                self._lost[key] = value
            if np.isfinite(value):
                path = self.out.rr.escape_entity_path_part  # a name may hold what an entity's path may not
                self.out.row(time_ns, f"statistics/{path(m.program)}/{path(name)}", value)

    def source(self, m: Any) -> None:
        """source_status_t"""
        states = {
            _MESSAGES.source_status_t.STATE_RUNNING: ("is read", "INFO"),
            _MESSAGES.source_status_t.STATE_ENDED: ("has ended", "INFO"),
            _MESSAGES.source_status_t.STATE_FAILED: ("has failed", "ERROR"),
        }
        says, level = states.get(m.state, (f"state {m.state}, which is not known", "WARN"))
        text = f"source {m.source!r} {says}" + (f": {m.message}" if m.message else "")
        time_ns = self._measured(NO_TIME)
        if time_ns is not None and text != self._source:
            self._source = text
            self.text(time_ns, text, level)

    def text(self, time_ns: int, text: str, level: str) -> None:
        self.out.log(time_ns, "messages", self.out.rr.TextLog(text, level=level))
        self.counts["messages"] += 1

    def finish(self) -> None:
        self.out.flush()

    def _seen(self, time_ns: int) -> None:
        if self.now_ns is None or time_ns > self.now_ns:
            self.now_ns = time_ns

    def _measured(self, time_ns: int) -> int | None:
        return self.now_ns if time_ns == NO_TIME else time_ns

    def _row(self, time_ns: int, name: str, *values: float) -> None:
        entity = f"plots/{name}"
        if entity not in self._known:
            self._known.add(entity)
            lines = SERIES[name][1]
            self.out.static(
                entity,
                self.out.rr.SeriesLines(
                    names=[line for line, _ in lines],
                    colors=[colour for _, colour in lines],
                    widths=[1.2] * len(lines),
                ),
            )
        self.out.row(time_ns, entity, *(float(value) for value in values))

    def _lane(self, time_ns: int, name: str, state: str, calm: bool) -> None:
        entity = f"status/{name}"
        key = f"{entity}\0{state}"
        if state and key not in self._known:
            self._known.add(key)
            self._states(entity, state, calm)
        self.out.log(time_ns, entity, self.out.rr.StateChange(state=state))
        self.counts["status.changes"] += 1

    def _states(self, entity: str, state: str, calm: bool) -> None:
        """Colours of all states of a lane so far: a static value replaces the one before."""
        states = self._lanes.setdefault(entity, {})
        states[state] = (90, 130, 90) if calm else (200, 60, 60)
        self.out.static(
            entity,
            self.out.rr.StateConfiguration(values=[*states], labels=[*states], colors=[*states.values()]),
        )
