"""Messages for the viewer: which channel carries what, decoding, and counts of what cannot be used."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import loc

import libloc
from libloc import NO_TIME, DataError

#: What is drawn: stream, its channel unless another is named, its type.
STREAMS = {
    "image": (libloc.IMAGE_CHANNEL, "image_t"),
    "frame": ("LOC_SLAM_FRAME", "slam_frame_t"),
    "map": ("LOC_MAP", "map_points_t"),
    "estimate": (libloc.ESTIMATE_CHANNEL, "estimate_t"),
    "fusion": (libloc.FUSION_CHANNEL, "fusion_t"),
    "status": ("LOC_ESTIMATOR_STATUS", "estimator_status_t"),
    "gps": (libloc.GPS_CHANNEL, "gps_fix_t"),
    "reference": (libloc.REFERENCE_CHANNEL, "reference_t"),
    "statistics": (libloc.STATISTICS_CHANNEL, "statistics_t"),
    "source": (libloc.SOURCE_STATUS_CHANNEL, "source_status_t"),
}
_LONGEST_CHANNEL = 63
_MEASURED = ("image", "frame", "map", "estimate", "fusion", "gps", "reference")
#: A stamp is not followed this far at once [ns], a day: damage, not a measurement.
_FAR_NS = 86_400 * 10**9


def channels_of(assignments: list[str]) -> dict[str, str]:
    """Channel to stream, with STREAM=NAME as on the command line. Raises ValueError."""
    names = {stream: channel for stream, (channel, _) in STREAMS.items()}
    for assignment in assignments:
        stream, _, channel = assignment.partition("=")
        if not channel or len(channel.encode()) > _LONGEST_CHANNEL:
            raise ValueError(
                f"--channel {assignment!r}: must be STREAM=NAME, the name 1 to {_LONGEST_CHANNEL} "
                "characters long"
            )
        if stream not in names:
            raise ValueError(
                f"--channel {assignment!r}: there is no stream {stream!r}, only {', '.join(names)}"
            )
        names[stream] = channel
    out: dict[str, str] = {}
    for stream, channel in names.items():
        if channel in out:
            raise ValueError(f"--channel: {channel} carries both {out[channel]} and {stream}")
        out[channel] = stream
    return out


@dataclass(frozen=True)
class Item:
    """A message that can be used."""

    stream: str
    message: Any  # loc.image_t, ...


class Stamps:
    """Which stamps can be followed: those near the newest one, and two in a row that agree with each other.

    The first one of all is not believed by itself either.
    """

    def __init__(self) -> None:
        self.newest_ns: int | None = None  #: that was believed
        self._odd_ns: int | None = None

    def near(self, time_ns: int) -> bool:
        return self.newest_ns is not None and abs(time_ns - self.newest_ns) <= _FAR_NS

    def judge(self, time_ns: int) -> bool:
        """True when it can be followed."""
        odd_ns = self._odd_ns
        if self.near(time_ns) or (odd_ns is not None and abs(time_ns - odd_ns) <= _FAR_NS):
            self.newest_ns, self._odd_ns = time_ns, None
            return True
        self._odd_ns = time_ns
        return False


class Intake:
    """Decodes what is on the channels of interest.

    counts has CHANNEL.received and, of these, .refused (cannot be decoded, or another type), .without_time
    and .absurd_time; time.jumped: so often the clock was set, from then on its new time is followed.
    """

    def __init__(self, channels: dict[str, str]) -> None:
        self.channels = channels
        self.counts: Counter[str] = Counter()
        self.others: Counter[str] = Counter()  #: messages on other channels
        self._stamps = Stamps()
        self._first: tuple[str, Item] | None = None  # until another stamp agrees

    def items(self, events: Iterable[tuple[str, bytes]]) -> Iterator[Item]:
        """Of all messages, channel and data, to the end."""
        for channel, data in events:
            yield from self.take(channel, data)
        yield from self.rest()

    def take(self, channel: str, data: bytes) -> list[Item]:
        """What can be used by now: the first message with a time waits for a second one that agrees."""
        stream = self.channels.get(channel)
        if stream is None:
            self.others[channel] += 1
            return []
        self.counts[f"{channel}.received"] += 1
        wanted = STREAMS[stream][1]
        try:
            known = libloc.message_type(data)
        except DataError:
            known = None
        if known != wanted:
            self.counts[f"{channel}.refused"] += 1
            return []
        message = getattr(loc, wanted).decode(data)
        item = Item(stream, message)
        if stream == "status":
            self._check_status(channel, message)
        if stream not in _MEASURED:
            return [item]
        if message.time_ns == NO_TIME:
            self.counts[f"{channel}.without_time"] += 1
            return []
        return self._believe(channel, item)

    def rest(self) -> list[Item]:
        """At the end: the only one with a time, which nothing has contradicted."""
        first, self._first = self._first, None
        return [] if first is None else [first[1]]

    def _believe(self, channel: str, item: Item) -> list[Item]:
        known = self._stamps.newest_ns is not None
        jumped = not self._stamps.near(item.message.time_ns)
        if self._stamps.judge(item.message.time_ns):
            if known:
                self.counts["time.jumped"] += jumped
                return [item]
            return [*self.rest(), item]
        if known:
            self.counts[f"{channel}.absurd_time"] += 1
            return []
        if self._first is not None:  # neither is known to be right
            self.counts[f"{self._first[0]}.absurd_time"] += 1
        self._first = (channel, item)
        return []

    def _check_status(self, channel: str, message: Any) -> None:
        """An absurd time of measurement is taken out: it belongs where the measurements are by then."""
        if message.measurement_time_ns == NO_TIME or self._stamps.near(message.measurement_time_ns):
            return
        if self._stamps.newest_ns is not None:
            self.counts[f"{channel}.absurd_time"] += 1
        message.measurement_time_ns = NO_TIME


#: Types that begin with the time of measurement, by fingerprint.
_STAMPED = frozenset(
    getattr(loc, STREAMS[stream][1])._get_packed_fingerprint() for stream in _MEASURED
)  # fmt: skip


def stamp_of(data: bytes) -> int | None:
    """Time of measurement of a message that is not decoded [ns]; None where it has none that is drawn."""
    if data[:8] not in _STAMPED or len(data) < 16:
        return None
    time_ns = int.from_bytes(data[8:16], "big", signed=True)
    return None if time_ns == NO_TIME else time_ns
