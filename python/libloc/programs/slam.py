"""loc-slam: where a camera was and what it saw, from pictures or features with identities; off line.

INPUT is a video, a folder of pictures, a EuRoC recording, an LCM log with features or pictures, a tracks file
(rows `frame feature dimension value`) or EqVIO's file of tracks and IMU; its content tells. A recording
without features (EuRoC folder, CSV) gives IMU and truth where --tracks has the features. --config is the rig
file with the camera's calibration, which an EqVIO file and a EuRoC folder (cam0/sensor.yaml) bring along.

mono-slam needs nothing but the camera: lengths are in a unit of their own then, and the world is where the
camera began, which looks along x with z up. inertial-slam takes the recording's IMU as well: metres, and a
world with z up. --output gets the trajectory (TUM, see --pose), the map (PLY), a CSV with a line for each
frame, summary.txt and summary.json, the settings (slam.yaml), the state to go on from (state.slam, see
--map-in), and pictures; from pictures a video of the features, too. Where there is truth (--reference, or in
the recording) the trajectory is compared with it after an alignment: the camera's centre by a similarity for
a camera alone, body rigidly where lengths are metres.

Exit codes: 0 done, 1 the data cannot be used (the message says why), 2 wrong options, 130 interrupted: what
there was by then is written.
"""

from __future__ import annotations

import argparse
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import DataError
from libloc.programs.arguments import positive, seconds_ns
from libloc.programs.slam_input import (
    METHODS,
    SlamInput,
    front_end_options,
    method_of,
    read_input,
    saved_state,
    slam_options,
)
from libloc.programs.slam_pictures import Watcher
from libloc.programs.slam_result import SlamResult, against_truth, report, text_of, write

EXIT_OK, EXIT_FAILED, EXIT_USAGE, EXIT_INTERRUPTED = 0, 1, 2, 130


def _index(text: str) -> int:
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text}: must not be negative")
    return value


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="loc-slam", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--version", action="version", version=libloc.__version__)
    parser.add_argument(
        "input", type=Path, metavar="INPUT", help="video, folder of pictures, recording or tracks file"
    )
    parser.add_argument(
        "--config",
        type=Path,
        metavar="RIG",
        help="calibration of the sensors: rig.yaml, Kalibr's camchain, EuRoC's sensor.yaml",
    )
    parser.add_argument(
        "--method", choices=tuple(METHODS), help="(default: as --slam-config says, else mono-slam)"
    )
    parser.add_argument(
        "--slam-config", type=Path, metavar="YAML", help="settings, names as in SlamOptions (slam.yaml)"
    )
    parser.add_argument(
        "--camera", type=_index, metavar="N", help="index in the rig (default: that of --slam-config, else 0)"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a field of SlamOptions, may come several times: --set map.max_features=60",
    )
    parser.add_argument(
        "--sigma-px",
        type=positive,
        metavar="PX",
        help="deviation of a measured coordinate (default: what the recording or else the settings say)",
    )
    parser.add_argument(
        "--tracks", type=Path, metavar="FILE", help="tracks file with the features of a recording"
    )
    parser.add_argument(
        "--rate-hz",
        type=positive,
        metavar="HZ",
        help="frames a second of a tracks file (default: rate_hz of the camera in --config), of a folder of "
        "numbered pictures, or of a video in place of its own times",
    )
    parser.add_argument(
        "--start-time",
        type=seconds_ns,
        metavar="S",
        help="of frame 0 of a tracks file or the first picture of a folder or video, on the clock of the "
        "recording, --imu or --reference (default: 0)",
    )
    group = parser.add_argument_group("pictures")
    group.add_argument(
        "--name-unit",
        choices=("ns", "us", "ms", "s"),
        help="of the times that the pictures of a folder are called by",
    )
    group.add_argument(
        "--imu", type=Path, metavar="FILE", help="recording with the IMU of a video or folder (inertial-slam)"
    )
    group.add_argument(
        "--front-end",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a field of FeatureTrackerOptions, may come several times: --front-end max_tracks=150",
    )
    group.add_argument(
        "--video",
        type=Path,
        metavar="FILE",
        help="features over all pictures, .mp4 or .avi (default: the first half minute, as features.mp4)",
    )
    parser.add_argument(
        "--map-in", type=Path, metavar="FILE", help="go on from the map and state (state.slam) of another run"
    )
    group = parser.add_argument_group("truth")
    group.add_argument(
        "--reference",
        type=Path,
        metavar="FILE",
        help="TUM trajectory or recording (default: INPUT's own, if any)",
    )
    group.add_argument(
        "--align",
        choices=("auto", "none", "se3", "sim3", "yaw"),
        default="auto",
        help="before the comparison; auto: sim3 where the scale is not known, otherwise se3",
    )
    group = parser.add_argument_group("result")
    group.add_argument("--output", type=Path, metavar="DIR", help="write everything into this folder")
    group.add_argument(
        "--pose",
        choices=("body", "camera"),
        default="body",
        help="of the trajectory that is written (%(default)s)",
    )
    group.add_argument(
        "--no-plots", action="store_true", help="no pictures, and no video that was not asked for"
    )
    return parser


class _PlainBar:
    """Progress as a line of text that is written over."""

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._began = time.monotonic()

    def __call__(self, done: int, total: int | None) -> None:
        text = f"{done} frames"
        if total is not None:
            left = (time.monotonic() - self._began) * max(total - done, 0) / max(done, 1)
            text = f"{done} of {total} frames, {left:.0f} s left"
        print(f"\rloc-slam: {text} ", end="", file=self._file, flush=True)


@contextmanager
def _progress() -> Iterator[Callable[[int, int | None], None]]:
    """Tells how far it is on the error stream, where that is a terminal: a bar with rich, text without it."""
    if not sys.stderr.isatty():
        yield lambda done, total: None
        return
    try:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
    except ImportError:
        yield _PlainBar(sys.stderr)
        print(file=sys.stderr)
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("loc-slam", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def _interrupt() -> Iterator[Callable[[], bool]]:
    """The first Ctrl-C within only sets what the given function tells; the next one ends the program."""
    asked = False

    def handler(signum: int, frame: FrameType | None) -> None:
        nonlocal asked
        asked = True
        signal.signal(signal.SIGINT, signal.default_int_handler)

    before = signal.signal(signal.SIGINT, handler)
    try:
        yield lambda: asked
    finally:
        signal.signal(signal.SIGINT, before)


def run(options: argparse.Namespace) -> SlamResult:
    """Raises DataError (ValueError) for data or options that cannot be used."""
    if options.camera is None:
        settings = libloc.SlamOptions()
        if options.slam_config is not None:
            settings = libloc.read_slam_options(options.slam_config)
        options.camera = settings.camera_index
    given = read_input(options)
    for block, verdict, sentence in given.rig.doubts():
        print(
            f"loc-slam: warning: {options.config}: {block} ({verdict.name.lower()}): {sentence}",
            file=sys.stderr,
        )
    slam = slam_options(options, given)
    start_from = None if options.map_in is None else saved_state(options.map_in, slam)
    if slam.motion == libloc.SlamMotion.INERTIAL and given.rig.imu is None:
        print(
            f"loc-slam: warning: {options.config or given.path}: no calibration of the IMU in it, "
            "its noise is a guess",
            file=sys.stderr,
        )
    began = time.monotonic()
    watcher, front_end = None, None
    if given.pictures is not None:
        ran, front_end, watcher = _run_pictures(options, given, slam)
    else:
        with _interrupt() as interrupted, _progress() as progress:

            def go_on(done: int, total: int) -> bool:
                progress(done, total)
                return not interrupted()

            ran = libloc.run_slam(
                given.features, slam, imu=given.imu, rig=given.rig, start_from=start_from, progress=go_on
            )
    elapsed_s = time.monotonic() - began
    truth, failure = None, ""
    if given.reference is not None:
        try:
            truth = against_truth(
                ran, given.reference, options.align, not _scale_unknown(ran), slam.camera.T_body_camera
            )
        except DataError as error:
            failure = str(error)
    if front_end is None:
        frames = int(np.sum(np.asarray(given.features.camera) == options.camera))
    else:
        frames = len(front_end["time_ns"])
        if ran.stopped and given.pictures.total is not None:
            frames = given.pictures.total
    world = None
    if given.gps is not None and len(given.gps.times_ns) > 0 and len(ran) > 0:
        inertial = slam.motion == libloc.SlamMotion.INERTIAL
        world = libloc.anchor_slam(ran, given.gps, inertial=inertial, rig=given.rig)
    return SlamResult(
        given, method_of(slam), slam, ran, frames, truth, failure, elapsed_s, front_end, watcher, world
    )


def _run_pictures(
    options: argparse.Namespace, given: SlamInput, slam: libloc.SlamOptions
) -> tuple[libloc.SlamRun, dict[str, NDArray[Any]], Watcher]:
    if options.map_in is not None:
        raise DataError(f"--map-in {options.map_in}: from pictures the identities of features begin anew")
    front_end = front_end_options(options.front_end)
    video = options.video
    if video is None and options.output is not None and not options.no_plots:
        video = options.output / "features.mp4"
    watcher = Watcher(video, slam.camera.rate_hz, whole_video=options.video is not None)
    with _interrupt() as interrupted, _progress() as progress:
        shown_at = 0.0

        def go_on(done: int) -> bool:
            nonlocal shown_at
            if time.monotonic() - shown_at > 0.1 or done == given.pictures.total:
                shown_at = time.monotonic()
                progress(done, given.pictures.total)
            return not interrupted()

        ran = libloc.run_image_slam(
            given.pictures.open(),
            slam,
            front_end=front_end,
            # In a log pictures stand where they arrived, after samples that are later than they are.
            imu=given.imu,
            rig=given.rig,
            watch=watcher,
            progress=go_on,
        )
    watcher.video_path = watcher.finish()
    if watcher.video_failure:
        print(f"loc-slam: warning: no video: {watcher.video_failure}", file=sys.stderr)
    given.counts |= ran.counts
    return ran.frames, ran.front_end, watcher


def _scale_unknown(ran: libloc.SlamRun) -> bool:
    return bool(np.any(ran.status & libloc.EstimateStatus.SCALE_UNKNOWN))


def main(arguments: list[str] | None = None) -> int:
    parser = make_parser()
    options = parser.parse_args(arguments)
    if options.output is not None and options.output.exists() and not options.output.is_dir():
        parser.error(f"--output {options.output}: is not a folder")
    try:
        if options.output is not None:
            options.output.mkdir(parents=True, exist_ok=True)  # before the work, not after it
        result = run(options)
        out = report(result)
        print(text_of(out))
        if options.output is not None:
            for path in write(result, out, options.pose, not options.no_plots, options.output):
                print(f"written: {path}")
    except (DataError, ValueError, OSError) as error:
        print(f"loc-slam: {error}", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt:
        print("loc-slam: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    if result.run.stopped:
        print(
            f"loc-slam: interrupted after {len(result.run)} of {result.frames} frames: all figures and files "
            "are of these",
            file=sys.stderr,
        )
        return EXIT_INTERRUPTED
    if len(result.run) == 0:
        print("loc-slam: no frame could be used", file=sys.stderr)
        return EXIT_FAILED
    if options.reference and result.truth_failure:
        print(f"loc-slam: --reference {options.reference}: {result.truth_failure}", file=sys.stderr)
        return EXIT_FAILED
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
