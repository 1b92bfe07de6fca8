"""Takes messages off LCM in a thread of its own: of pictures the newest, of all else everything."""

from __future__ import annotations

import re
import threading
from collections import Counter, deque
from collections.abc import Collection
from types import TracebackType
from typing import Any

import lcm

from libloc import DataError

_PICTURES = 4  # that wait; an older one gives way
_OTHERS = 50_000  # messages that wait, minutes of them: more means that nobody takes them


class Receiver:
    """Connects anew when the hub goes away.

    counts: pictures.dropped (a newer one came before it was taken), messages.dropped, connections.lost.
    """

    def __init__(self, url: str, channels: Collection[str], picture_channel: str) -> None:
        """Raises DataError when there is no connection to be had."""
        self._url, self._channels, self._pictures_on = url, channels, picture_channel
        self._pictures: deque[tuple[str, bytes]] = deque()
        self._others: deque[tuple[str, bytes]] = deque()
        self._ready = threading.Condition()
        self._stop = threading.Event()
        self.counts: Counter[str] = Counter()
        try:
            self._lcm = self._connect()
        except (RuntimeError, OSError) as error:
            raise DataError(
                f"cannot connect to {url}: {error} (tcpq needs loc-hub running there; udpm a route for "
                "multicast)"
            ) from None
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Receiver:
        self._thread.start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._stop.set()
        self._thread.join()

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
                    self.counts["pictures.dropped"] += 1
                self._pictures.append((channel, bytes(data)))
            elif len(self._others) >= _OTHERS:
                self.counts["messages.dropped"] += 1
            else:
                self._others.append((channel, bytes(data)))
            self._ready.notify()

    def _connect(self) -> Any:
        connection = lcm.LCM(self._url)
        for channel in self._channels:
            # A channel is subscribed to as a regular expression; its name is meant literally.
            connection.subscribe(re.escape(channel), self._handle)
        return connection

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                self._lcm.handle_timeout(50)
            except (RuntimeError, OSError):
                self.counts["connections.lost"] += 1
                self._stop.wait(0.5)
                try:
                    self._lcm = self._connect()
                except (RuntimeError, OSError):
                    continue  # the hub may come back
