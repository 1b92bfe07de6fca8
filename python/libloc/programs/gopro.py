"""Takes the IMU and the GPS out of a GoPro's video, as a recording for the other programs.

    loc-gopro GX010042.MP4 --out recording.csv
    loc-slam GX010042.MP4 --imu recording.csv --config rig.yaml --method inertial-slam --output run
    loc-driver video GX010042.MP4 --imu recording.csv

Times are the video's: its beginning is 0, or what --start-time says (give the video the same). Axes are those
of the picture, x right, y down, z forward. Needs the Python package telemetry-parser.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import libloc
from libloc import DataError, gopro
from libloc.programs.arguments import seconds_ns


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="loc-gopro", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--version", action="version", version=libloc.__version__)
    parser.add_argument("video", type=Path, help="of a GoPro: .MP4 or .360, as the camera wrote it")
    parser.add_argument("--out", type=Path, required=True, metavar="CSV", help="the recording to write")
    parser.add_argument(
        "--start-time",
        type=seconds_ns,
        default=0,
        metavar="S",
        help="time of the video's beginning (%(default)s)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace the file of an earlier run")
    return parser


def run(options: argparse.Namespace) -> None:
    """Raises DataError, ValueError, OSError or MissingTelemetryParser; its text is for the user."""
    if options.out.exists() and not options.overwrite:
        raise FileExistsError(f"{options.out}: exists already; --overwrite replaces it")
    got = gopro.read_telemetry(options.video, start_time_ns=options.start_time)
    for name, count in got.counts.items():
        print(f"{name} = {count}")
    if not got.axes_known:
        _warn(f"{got.model} does not tell the order of the IMU's axes; that of the HERO5 is taken: check it")
    if not got.stamped:
        _warn("the IMU's samples have no times; they are spread evenly over the video")
    if got.gps.above_sea_level:
        _warn("altitudes are above mean sea level: tens of metres off from those above the ellipsoid")
    gopro.write_csv(got, options.out)
    times = got.imu.times_ns
    seconds = (times[-1] - times[0]) / 1e9
    rate = f", {(len(times) - 1) / seconds:.2f} Hz" if seconds > 0 else ""
    force = np.linalg.norm(got.imu.specific_force, axis=1).mean()
    print(f"{got.model}: IMU over {seconds:.2f} s{rate}, mean specific force {force:.2f} m/s^2")
    if len(got.gps.times_ns):
        dop = got.gps.dop[np.isfinite(got.gps.dop)]
        precision = f", median DOP {np.median(dop):.2f}" if len(dop) else ""
        print(f"{len(got.gps.times_ns)} GPS fixes{precision}")
    print(f"wrote {options.out}")


def _warn(text: str) -> None:
    print(f"loc-gopro: {text}", file=sys.stderr)


def main(arguments: list[str] | None = None) -> int:
    options = make_parser().parse_args(arguments)
    try:
        run(options)
    except (DataError, ValueError, OSError, gopro.MissingTelemetryParser) as error:
        print(f"loc-gopro: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("loc-gopro: interrupted", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
