"""What is in an LCM log: the first messages, a table of its channels, and a picture of the IMU.

    python 02_read_lcm_log.py LOG [--first N] [--plot FILE.png]

Reads libloc's own types (package loc). Make a log with loc-live, or with loc-driver and lcm-logger, or write
one yourself: see libloc.lcm_log.LogWriter.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from libloc.lcm_log import LogReader

import libloc

matplotlib.use("Agg")
from matplotlib import pyplot as plt


@dataclass
class Channel:
    type_name: str
    first_ns: int
    last_ns: int
    count: int = 0


def print_table(channels: dict[str, Channel], log: LogReader) -> None:
    print(f"{'channel':24s}{'type':20s}{'messages':>10s}{'seconds':>12s}{'rate [Hz]':>12s}")
    for name, c in channels.items():
        seconds = (c.last_ns - c.first_ns) * 1e-9
        rate = f"{(c.count - 1) / seconds:12.2f}" if seconds > 0 else f"{'-':>12s}"
        print(f"{name:24s}{c.type_name:20s}{c.count:10d}{seconds:12.3f}{rate}")
    for name, count in log.skipped.items():
        print(f"{name:24s}{'(not ours)':20s}{count:10d}")
    for name, value in log.damage.items():
        print(f"damaged: {name} = {value}")


def plot(messages: list, path: Path) -> None:
    figure, axes = plt.subplots(2, 1, sharex=True, figsize=(11, 5), layout="constrained")
    t = np.array([m.time_ns - messages[0].time_ns for m in messages]) * 1e-9
    for one, name, unit in ((axes[0], "angular_velocity", "rad/s"), (axes[1], "specific_force", "m/s²")):
        one.plot(t, np.array([getattr(m, name) for m in messages]), lw=0.8, label=list("xyz"))
        one.set_ylabel(f"{name} [{unit}]")
        one.legend(loc="upper right", ncols=3)
    axes[1].set_xlabel("time [s]")
    figure.savefig(path, dpi=110)
    print(f"wrote {path}")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("log", type=Path)
    parser.add_argument(
        "--first", type=int, default=2, help="messages to print of each channel (%(default)s)"
    )
    parser.add_argument("--plot", type=Path, help="draw the IMU's samples into this file")
    options = parser.parse_args()

    channels: dict[str, Channel] = {}
    imu = []
    try:
        log = LogReader(options.log)
        for event in log:
            m = event.message
            name = type(m).__name__
            channel = channels.setdefault(event.channel, Channel(name, m.time_ns, m.time_ns))
            channel.count += 1
            channel.last_ns = m.time_ns
            if channel.count <= options.first:
                print(event.channel, *(f"{field}={getattr(m, field)!r:.70}" for field in m.__slots__))
            if name == "imu_t":
                imu.append(m)
    except libloc.DataError as error:
        print(error, file=sys.stderr)
        return 1
    print_table(channels, log)
    if options.plot and not imu:
        print(f"{options.log}: no IMU in it, nothing to draw", file=sys.stderr)
        return 1
    if options.plot:
        plot(imu, options.plot)
    return 0


if __name__ == "__main__":
    sys.exit(main())
