"""Messages for the viewer: which channel carries what, decoding, and counts of what cannot be used."""

from __future__ import annotations

from collections import Counter
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
#: Of another time than this from the first one [ns], three years: damage, not a measurement.
_LONGEST_NS = 10**17


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


class Intake:
    """Decodes what is on the channels of interest.

    counts has CHANNEL.received and, of these, .refused (cannot be decoded, or another type), .without_time
    and .absurd_time.
    """

    def __init__(self, channels: dict[str, str]) -> None:
        self.channels = channels
        self.counts: Counter[str] = Counter()
        self.others: Counter[str] = Counter()  #: messages on other channels
        self.start_ns: int | None = None  #: of the first message with a time

    def take(self, channel: str, data: bytes) -> Item | None:
        stream = self.channels.get(channel)
        if stream is None:
            self.others[channel] += 1
            return None
        self.counts[f"{channel}.received"] += 1
        wanted = STREAMS[stream][1]
        try:
            known = libloc.message_type(data)
        except DataError:
            known = None
        if known != wanted:
            self.counts[f"{channel}.refused"] += 1
            return None
        message = getattr(loc, wanted).decode(data)
        if stream in _MEASURED:
            if message.time_ns == NO_TIME:
                self.counts[f"{channel}.without_time"] += 1
                return None
            if self.start_ns is None:
                self.start_ns = message.time_ns
            if abs(message.time_ns - self.start_ns) > _LONGEST_NS:
                self.counts[f"{channel}.absurd_time"] += 1
                return None
        return Item(stream, message)
