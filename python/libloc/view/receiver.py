"""Messages from LCM that wait to be drawn: of pictures the newest, of all else everything."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Collection
from types import TracebackType

from libloc.lcm_receiver import LcmReceiver

_PICTURES = 4  # that wait; an older one gives way
_OTHERS = 50_000  # messages that wait, minutes of them: more means that nobody takes them


class Receiver:
    """counts: pictures.dropped (a newer one came before it was taken), messages.dropped, connections.lost."""

    def __init__(self, url: str, channels: Collection[str], picture_channel: str) -> None:
        """Raises DataError when there is no connection to be had."""
        self._pictures_on = picture_channel
        self._pictures: deque[tuple[str, bytes]] = deque()
        self._others: deque[tuple[str, bytes]] = deque()
        self._ready = threading.Condition()
        self._counts: Counter[str] = Counter()
        self._receiver = LcmReceiver(url, channels, self._handle)

    def __enter__(self) -> Receiver:
        self._receiver.__enter__()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._receiver.__exit__(kind, error, trace)

    @property
    def counts(self) -> Counter[str]:
        lost = self._receiver.connections_lost
        return self._counts + Counter({"connections.lost": lost})

    def take(self, timeout_s: float) -> list[tuple[str, bytes]]:
        """All that waits, channel and data, pictures last; empty when nothing came in that time."""
        with self._ready:
            if not (self._others or self._pictures):
                self._ready.wait(timeout_s)
            out = [*self._others, *self._pictures]
            self._others.clear()
            self._pictures.clear()
            return out

    def _handle(self, channel: str, data: bytes) -> None:
        with self._ready:
            if channel == self._pictures_on:
                if len(self._pictures) >= _PICTURES:
                    self._pictures.popleft()
                    self._counts["pictures.dropped"] += 1
                self._pictures.append((channel, data))
            elif len(self._others) >= _OTHERS:
                self._counts["messages.dropped"] += 1
            else:
                self._others.append((channel, data))
            self._ready.notify()
