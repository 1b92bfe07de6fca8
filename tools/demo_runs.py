"""What demo_report.py and demo_slam_report.py share.

Reading a log, comparing a live run with its replay, options, and how they end.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import loc
from lcm import EventLog


class ReportError(RuntimeError):
    pass


def events(path: Path) -> Iterator:
    """With .channel and .data."""
    return iter(EventLog(str(path), "r"))


def without_host_times(data: bytes) -> bytes:
    """An encoded estimate_t without what differs from run to run."""
    # Fingerprint, time_ns, host_time_ns, sequence, publish_time_ns: 8 bytes each, then the rest.
    return data[:16] + data[24:32] + data[40:]


def published(data: bytes, stream: str) -> int | None:
    """So many of a stream the driver has sent, says its encoded source_status_t."""
    message = loc.source_status_t.decode(data)
    return dict(zip(message.stream_name, message.published, strict=True)).get(stream)


def check_logged(what: str, sent: int | None, logged: int) -> None:
    if sent is not None and logged != sent:
        raise ReportError(f"the driver sent {sent} {what}, {logged} were logged")


def check_same(live: list[bytes], replay: list[bytes], nothing_lost: str) -> str:
    """Estimates without_host_times must be the same, bit for bit. Returns a sentence for the user."""
    if len(live) != len(replay):
        raise ReportError(f"{len(live)} estimates live, {len(replay)} replayed: must be equal")
    for index, (first, second) in enumerate(zip(live, replay, strict=True)):
        if first != second:
            raise ReportError(f"estimate {index} of the replay differs from the live one")
    return f"replay: all {len(live)} estimates are the live ones bit for bit ({nothing_lost}, none lost)"


def save(figure, path: Path, dpi: int) -> None:
    """As a whole: nobody sees half of it."""
    partial = path.with_name(f".{path.name}")
    figure.savefig(partial, format="png", dpi=dpi)
    partial.replace(path)


def make_parser(doc: str | None) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--live", type=Path, required=True)
    parser.add_argument("--replay", type=Path, required=True)
    parser.add_argument("--picture", type=Path, required=True)
    parser.add_argument("--title", required=True)
    return parser


def run(report: Callable[[argparse.Namespace], None], parser: argparse.ArgumentParser) -> int:
    """Exit code."""
    arguments = parser.parse_args()
    try:
        report(arguments)
    except (ReportError, OSError, ValueError) as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 1
    return 0
