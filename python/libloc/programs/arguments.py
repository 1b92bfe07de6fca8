"""What the command lines of several programs have in common."""

from __future__ import annotations

import argparse
import math
import os
from decimal import Decimal, InvalidOperation

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"


def positive(text: str) -> float:
    value = float(text)
    if not (math.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f"{text}: must be a positive number")
    return value


def count(text: str) -> int:
    if not (text.isdigit() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"{text}: must be a positive whole number")
    return int(text)


def seconds_ns(text: str) -> int:
    """Seconds as int64 nanoseconds, exactly."""
    try:
        time_ns = int((Decimal(text) * 1_000_000_000).to_integral_value())
    except (InvalidOperation, ValueError, OverflowError):
        raise argparse.ArgumentTypeError(f"{text}: must be seconds") from None
    if abs(time_ns) >= 2**62:
        raise argparse.ArgumentTypeError(f"{text}: is out of range")
    return time_ns


def add_lcm_url(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--lcm-url",
        default=os.environ.get("LCM_DEFAULT_URL") or DEFAULT_URL,
        metavar="URL",
        help="transport: udpm://GROUP:PORT?ttl=0 or tcpq://ADDRESS:PORT, where loc-hub runs (%(default)s)",
    )


def add_collecting(group: argparse._ArgumentGroup, duration_s: float, what: str) -> None:
    """When to end what is collected live."""
    group.add_argument(
        "--duration",
        type=positive,
        default=duration_s,
        metavar="S",
        help="collect no longer than this [s] (%(default)s)",
    )
    group.add_argument(
        "--patience",
        type=positive,
        default=10.0,
        metavar="S",
        help=f"give up when no {what} came for this long [s] (%(default)s)",
    )
