"""Shows a drive out of an LCM log: a picture of truth, odometry and fusion with their errors, and a video.

    loc-animate run.log --output show
    loc-animate estimates.log --reference run.log --truth run.log.truth.csv --output show --rerun

The log holds estimates with positions (of loc-estimator); truth and odometry are in the same log, or in the
recording that --reference names. Writes summary.png, drive.mp4, and with --rerun drive.rrd.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import libloc
from libloc import DataError, driving


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="loc-animate", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    preset = driving.AnimationOptions()
    parser.add_argument("--version", action="version", version=libloc.__version__)
    parser.add_argument("log", type=Path, help="LCM log with estimates")
    parser.add_argument(
        "--reference", type=Path, metavar="RECORDING", help="where truth and odometry are (default: the log)"
    )
    parser.add_argument(
        "--truth", type=Path, metavar="CSV", help="LOG.truth.csv of loc-simulate: true biases and scale, too"
    )
    parser.add_argument(
        "--channel", default=libloc.ESTIMATE_CHANNEL, metavar="NAME", help="of the estimates (%(default)s)"
    )
    parser.add_argument("--output", type=Path, default=Path(), metavar="DIR", help="folder, made when absent")
    parser.add_argument(
        "--video",
        default="drive.mp4",
        metavar="NAME",
        help="file in DIR: .mp4 or .mkv (Python package av), .gif; without ending a folder of .png; none: "
        "no video (%(default)s)",
    )
    parser.add_argument("--rerun", action="store_true", help="write drive.rrd (Python package rerun-sdk)")
    parser.add_argument(
        "--view", action="store_true", help="write drive.rrd and start the rerun viewer with it"
    )
    parser.add_argument(
        "--speed", type=float, default=preset.speed, help="times as fast as it was (%(default)s)"
    )
    parser.add_argument("--fps", type=float, default=preset.rate_hz, help="pictures a second (%(default)s)")
    parser.add_argument("--width", type=int, default=preset.width, help="pixels (%(default)s)")
    parser.add_argument("--height", type=int, default=preset.height, help="pixels (%(default)s)")
    parser.add_argument("--title", default="", help="over the picture")
    parser.add_argument("--overwrite", action="store_true", help="replace files of an earlier run")
    return parser


def _progress(done: int, total: int) -> None:
    if sys.stderr.isatty():
        end = "\n" if done == total else ""
        print(f"\r\033[Kvideo: picture {done} of {total}", end=end, file=sys.stderr, flush=True)


def run(options: argparse.Namespace) -> None:
    """Raises DataError, ValueError, OSError or MissingPackageError; its text is for the user."""
    animation = driving.AnimationOptions(
        width=options.width, height=options.height, rate_hz=options.fps, speed=options.speed
    )
    animation.check()
    drive, counts = driving.run_of_log(options.log, options.reference, options.channel, options.truth)
    for name, count in counts.items():
        print(f"{name} = {count}")
    print(f"{len(drive.times_s)} estimates over {drive.times_s[-1]:.2f} s")
    print(f"position rmse {drive.position_rmse:.3f} m, attitude {np.rad2deg(drive.attitude_rmse):.3f} deg")
    if drive.odometry_rmse is not None and drive.odometry_in_metres is not None:
        print(f"odometry divided by the {drive.odometry_in_metres[2]}: rmse {drive.odometry_rmse:.3f} m")

    options.output.mkdir(parents=True, exist_ok=True)
    summary = options.output / "summary.png"
    video = None if options.video == "none" else options.output / options.video
    recording = options.output / "drive.rrd" if options.rerun or options.view else None
    for path in (summary, video, recording):
        if path is not None and path.exists() and not options.overwrite:
            raise FileExistsError(f"{path}: exists already; --overwrite replaces it")
    driving.save_summary(drive, summary, options.title)
    print(f"wrote {summary}")
    if video is None and recording is None:
        return
    scene = driving.scene_along(drive.truth.position)
    if recording is not None:
        driving.save_rerun(drive, scene, recording, overwrite=True)
        print(f"wrote {recording}")
    if options.view and recording is not None:
        driving.view_rerun(recording)
    if video is not None:
        count = driving.animate(drive, scene, video, animation, overwrite=True, progress=_progress)
        print(f"wrote {video}, {count} pictures")


def main(arguments: list[str] | None = None) -> int:
    options = make_parser().parse_args(arguments)
    try:
        run(options)
    except (DataError, ValueError, OSError, driving.MissingPackageError) as error:
        print(f"loc-animate: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("loc-animate: interrupted", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
