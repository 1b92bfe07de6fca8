"""Takes messages off LCM in a thread of its own, and connects anew when the hub goes away."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Collection
from types import TracebackType
from typing import Any

import lcm

from libloc._core import DataError

_POLL_MS = 50
_RETRY_S = 0.5


class LcmReceiver:
    """Hands channel and data of every message to a function, which must be quick: LCM loses what it cannot
    take in time. A context manager: the thread runs within it.
    """

    def __init__(self, url: str, channels: Collection[str], take: Callable[[str, bytes], None]) -> None:
        """Raises DataError when there is no connection to be had."""
        self._url, self._channels, self._take = url, channels, take
        self._stop = threading.Event()
        self.connections_lost = 0  #: connections, not attempts to get another one
        try:
            self._lcm = self._connect()
        except (RuntimeError, OSError) as error:
            raise DataError(
                f"cannot connect to {url}: {error} (tcpq needs loc-hub running there; udpm a route for "
                "multicast)"
            ) from None
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> LcmReceiver:
        self._thread.start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._stop.set()
        self._thread.join()

    def _connect(self) -> Any:
        connection = lcm.LCM(self._url)
        for channel in self._channels:
            # A channel is subscribed to as a regular expression; its name is meant literally.
            connection.subscribe(re.escape(channel), lambda name, data: self._take(name, bytes(data)))
        return connection

    def _run(self) -> None:
        connected = True
        while not self._stop.is_set():
            try:
                self._lcm.handle_timeout(_POLL_MS)
                connected = True
            except (RuntimeError, OSError):
                self.connections_lost += connected
                connected = False
                self._stop.wait(_RETRY_S)
                try:
                    self._lcm = self._connect()
                except (RuntimeError, OSError):
                    continue  # the hub may come back
