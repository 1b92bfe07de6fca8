"""loc-view: shows what an estimator does, live or from LCM logs, with the rerun viewer.

    loc-view run.log --config rig.yaml                a viewer window, or without a display in the browser
    loc-view run.log --save run.rrd --screenshot run.png
    loc-view pictures.log estimates.log               what belongs together may be in several logs
    loc-view --web                                    live, in the browser
    loc-view --lcm-url tcpq://127.0.0.1:7700 --save run.rrd --duration 60

It draws LOC_IMAGE with LOC_SLAM_FRAME (features by state, search ellipses of 3 sigma, residuals),
LOC_ESTIMATE (pose, way, ellipsoid of the position's uncertainty, deviations, status flags), LOC_MAP, LOC_GPS
about the origin that LOC_FUSION tells, LOC_REFERENCE, and what LOC_ESTIMATOR_STATUS, LOC_STATISTICS and
LOC_SOURCE_STATUS say. All ellipsoids hold 3 sigma. Points of the map are green where they are well known and
red where they are not; one whose 3 sigma are more than half its distance has no ellipsoid. Where GPS ties the
map to the Earth, the uncertainty that it shares with the pose is left out of them. The camera's frustum needs
--config; it is drawn without distortion, the picture in it as it is. The time line is that of the
measurements, from the first one on; what has only the host's time (statistics, sources) is put where the
measurements are by then.

Of estimates --rate-hz a second are drawn; status flags, latency (the worst) and the numbers of each frame
are complete. A flag is shown for at least 0.2 s. Live, pictures give way to newer ones when drawing is too
slow, all else is drawn; how many gave way is told. Several logs are read together in the order of
measurement, whenever they were logged. Messages that cannot be used are counted and told at the end, also
those whose stamps are a day or more off, unless two in a row agree.

Viewers listen on 127.0.0.1 only. Exit codes: 0 done (live: also by Ctrl-C), 1 the data cannot be used or the
viewer failed (the message says why), 2 wrong options, 130 interrupted: what was drawn by then is written.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import libloc
from libloc import DataError
from libloc.driving.video import MissingPackageError
from libloc.programs.arguments import add_lcm_url, positive
from libloc.view import logs, output
from libloc.view.blueprint import Layout, blueprint
from libloc.view.intake import Intake, channels_of
from libloc.view.live import LiveDrawing, scale_of
from libloc.view.pictures import PictureDrawing
from libloc.view.plots import PlotDrawing
from libloc.view.receiver import Receiver
from libloc.view.recorder import Recorder
from libloc.view.scene import Scene
from libloc.view.space import SpaceDrawing
from libloc.view.target import Interrupt, Target, ViewerPlan

EXIT_OK, EXIT_FAILED, EXIT_USAGE, EXIT_INTERRUPTED = 0, 1, 2, 130
_RESULTS = ("estimate", "frame", "map")  # what an estimator makes
_END_S = 1.5  # without any of these, after the source has ended
_SILENCE_S = 10.0  # after which it says that nothing comes
_AXIS_M = 0.3  # live, until there is a map to tell


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if match is None or not all(200 <= int(side) <= 8192 for side in match.groups()):
        raise argparse.ArgumentTypeError(f"{text}: must be WIDTHxHEIGHT, 200 to 8192 each")
    return int(match[1]), int(match[2])


def _memory(text: str) -> str:
    if re.fullmatch(r"\d+(MB|GB|MiB|GiB)", text) is None:
        raise argparse.ArgumentTypeError(f"{text}: must be like 500MB or 2GB")
    return text


def _port(text: str) -> int:
    value = int(text)
    if not 0 < value < 65536:
        raise argparse.ArgumentTypeError(f"{text}: is no port")
    return value


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="loc-view", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--version", action="version", version=libloc.__version__)
    parser.add_argument("log", type=Path, nargs="*", metavar="LOG", help="LCM logs; none: live over LCM")
    parser.add_argument(
        "--config", type=Path, metavar="RIG", help="calibration of the sensors (rig.yaml): for the frustum"
    )
    parser.add_argument("--camera", type=int, default=0, metavar="N", help="index in the rig (%(default)s)")
    parser.add_argument(
        "--channel", action="append", default=[], metavar="STREAM=NAME",
        help="channel of image, frame, map, estimate, fusion, status, gps, reference, statistics or source; "
        "may come several times",
    )  # fmt: skip
    parser.add_argument(
        "--rate-hz", type=positive, default=30.0, metavar="HZ", help="estimates drawn a second (%(default)g)"
    )
    parser.add_argument(
        "--picture-rate-hz", type=positive, metavar="HZ", help="pictures drawn a second (default: all)"
    )
    parser.add_argument(
        "--picture-quality", type=int, default=85, choices=range(1, 101), metavar="Q",
        help="1 to 100, of raw pictures, which are drawn as JPEG (%(default)s)",
    )  # fmt: skip

    group = parser.add_argument_group("logs")
    group.add_argument(
        "--start", type=float, default=0.0, metavar="S", help="leave out the first seconds (%(default)g)"
    )
    group.add_argument(
        "--align", choices=("auto", "none", "se3", "sim3", "yaw"), default="auto",
        help="of the reference with the estimates; auto: sim3 where the scale is not known, se3 for SLAM "
        "that is not tied to the Earth, otherwise none. Live, auto draws it only where none is right",
    )  # fmt: skip

    group = parser.add_argument_group("live")
    add_lcm_url(group)
    group.add_argument(
        "--exit-at-end", action="store_true", help="end when the source says that it has ended"
    )
    group.add_argument(
        "--window",
        type=positive,
        default=60.0,
        metavar="S",
        help="of the numbers that is seen (%(default)g)",
    )
    parser.add_argument(
        "--duration", type=positive, default=float("inf"), metavar="S", help="of a log, or of listening"
    )

    group = parser.add_argument_group(
        "where it goes (none: --spawn where there is a display, otherwise --web)"
    )
    group.add_argument("--save", type=Path, metavar="RRD", help="write a file for the rerun viewer")
    group.add_argument(
        "--screenshot", type=Path, metavar="PNG",
        help="write what is seen at the end, drawn off screen (needs a Vulkan driver, such as the Debian "
        "package mesa-vulkan-drivers)",
    )  # fmt: skip
    group.add_argument(
        "--size", type=_size, default=(1600, 1000), metavar="WxH", help="of the screenshot (1600x1000)"
    )
    group.add_argument("--web", action="store_true", help="serve it to a browser on this machine")
    group.add_argument("--spawn", action="store_true", help="open a viewer window")
    group.add_argument(
        "--web-port", type=_port, default=output.WEB_PORT, metavar="PORT",
        help="of the page; another one where it is taken (%(default)s)",
    )  # fmt: skip
    group.add_argument(
        "--data-port", type=_port, default=output.DATA_PORT, metavar="PORT",
        help="of the data; another one where it is taken (%(default)s)",
    )  # fmt: skip
    group.add_argument(
        "--memory", type=_memory, default="1GB", metavar="SIZE",
        help="what is kept for a browser that comes later, or live for a screenshot without --save, or used "
        "by the window; the oldest goes first (%(default)s)",
    )  # fmt: skip
    group.add_argument("--overwrite", action="store_true", help="replace files of an earlier run")
    return parser


def _say(text: str) -> None:
    print(f"loc-view: {text}", file=sys.stderr, flush=True)


def _camera_of(options: argparse.Namespace) -> Any | None:
    """Calibration of the camera that is drawn. Raises DataError."""
    if options.config is None:
        return None
    cameras = libloc.read_any_rig(options.config).cameras
    if options.camera >= len(cameras):
        raise DataError(f"{options.config}: has {len(cameras)} cameras, --camera is {options.camera}")
    return cameras[options.camera]


def _target(rr: Any, options: argparse.Namespace) -> Target:
    kind = "web" if options.web else "window" if options.spawn else None
    viewer = None if kind is None else ViewerPlan(kind, options.memory, options.web_port, options.data_port)
    # Nobody knows how long a live session gets.
    buffer = None if options.log else options.memory
    return Target(
        rr, options.save, options.screenshot, options.size, viewer, overwrite=options.overwrite, buffer=buffer
    )


@contextmanager
def _opened(target: Target) -> Iterator[Target]:
    """Tells what is left when it fails."""
    try:
        with target:
            yield target
    finally:
        if target.kept is not None:
            _say(f"what was drawn by then is in {target.kept}")


def _finish(target: Target) -> None:
    for line in target.finish():
        print(line, flush=True)
    for complaint in target.complaints:
        _say(f"warning: the viewer says: {complaint}")


def _scene(out: Recorder, camera: Any | None, options: argparse.Namespace, axis_m: float) -> Scene:
    offset_ns = 0 if camera is None else round(1e9 * camera.time_offset_s)
    return Scene(
        out,
        SpaceDrawing(out, camera, axis_m),
        PlotDrawing(out),
        PictureDrawing(out, options.camera, offset_ns, options.picture_rate_hz, options.picture_quality),
        options.rate_hz,
    )


def _show_logs(rr: Any, options: argparse.Namespace, camera: Any | None, interrupt: Interrupt) -> int:
    counts: Counter[str] = Counter()
    channels = channels_of(options.channel)
    window = logs.Window(options.start, options.duration)
    found = logs.survey(options.log, Intake(channels), options.camera, window, counts)
    seen = logs.extent(found)
    align, sentence = logs.alignment(found, options.align)
    layout = Layout(
        picture_px=found.picture_px, has_pictures=found.pictures > 0 or found.frames > 0,
        has_frames=found.frames > 0, has_latency=found.has_latency, hide_local=found.became_tied,
        in_frustum=camera is not None,
    )  # fmt: skip
    axis_m = _AXIS_M
    if seen is not None:
        layout.centre, layout.radius = seen
        axis_m = 0.07 * layout.radius
    with _opened(_target(rr, options)) as target:
        target.stream.send_blueprint(blueprint(rr, layout))
        scene = _scene(Recorder(rr, target.stream, found.start_ns), camera, options, axis_m)
        scene.space.align = align
        if sentence:
            scene.plots.text(found.start_ns, sentence, "INFO")
            print(sentence)
        intake = Intake(channels)
        logs.draw(options.log, intake, found, window, scene, lambda: interrupt.asked)
        _report(scene, intake, counts)
        _finish(target)
        interrupted = interrupt.asked
        if target.viewer is not None:
            if options.web:
                print(f"{target.viewer.how_to_reach()}\nCtrl-C ends it", flush=True)
            while target.viewer.running and not interrupt.asked:
                time.sleep(0.1)
    return EXIT_INTERRUPTED if interrupted else EXIT_OK


def _show_live(rr: Any, options: argparse.Namespace, camera: Any | None, interrupt: Interrupt) -> int:
    channels = channels_of(options.channel)
    intake = Intake(channels)
    picture_channel = next(name for name, stream in channels.items() if stream == "image")
    with (
        Receiver(options.lcm_url, channels, picture_channel) as receiver,
        _opened(_target(rr, options)) as target,
    ):
        if target.viewer is not None and options.web:
            print(target.viewer.how_to_reach(), flush=True)
        scene = _scene(Recorder(rr, target.stream), camera, options, _AXIS_M)
        layout = Layout(follow=True, window_s=options.window, in_frustum=camera is not None)
        target.stream.send_blueprint(blueprint(rr, layout))
        drawing = LiveDrawing(scene, intake, options.align)
        began = heard = result_came = time.monotonic()
        target.keep_part = True
        _say(f"listening on {options.lcm_url}, Ctrl-C ends it")
        while not interrupt.asked and (target.viewer is None or target.viewer.running):
            now = time.monotonic()
            # The source may have ended while the estimator still works on what it has.
            at_end = options.exit_at_end and drawing.ended and now - result_came > _END_S
            if now - began > options.duration or at_end:
                break
            for item in (item for event in receiver.take(0.02) for item in intake.take(*event)):
                heard = now
                if item.stream in _RESULTS:
                    result_came = now
                drawing.take(item, now)
                if _learn(layout, scene, item):
                    target.stream.send_blueprint(blueprint(rr, layout))
            drawing.tick(now)
            target.check(now)
            if now - heard > _SILENCE_S:
                heard = now
                _say(f"nothing has come on {options.lcm_url} for {_SILENCE_S:g} s")
        if target.viewer is not None and not target.viewer.running:
            _say("the viewer has ended")
        for item in intake.rest():
            drawing.take(item, time.monotonic())
        drawing.finish()
        _whole(layout, scene)
        target.stream.send_blueprint(blueprint(rr, layout))
        _report(scene, intake, receiver.counts)
        if not any(name.endswith(".received") for name in intake.counts):
            target.keep_part = False
            raise DataError(
                f"nothing to be drawn has come on {options.lcm_url}: is loc-estimator running there?"
            )
        _finish(target)
    return EXIT_OK


def _learn(layout: Layout, scene: Scene, item: Any) -> bool:
    """True when the layout is to be another one: the first picture, the first map, another world."""
    if scene.space.tied_ns is not None and not layout.hide_local:
        layout.hide_local, layout.centre = True, None  # the next map has another place, and perhaps unit
        text = "the map is tied to the Earth: the way until now was in the map's own world, it is not shown"
        scene.plots.text(scene.space.tied_ns, text, "INFO")
        return True
    if layout.picture_px is None and scene.pictures.size_px is not None:
        layout.picture_px = scene.pictures.size_px
        return True
    if item.stream == "map" and layout.centre is None and scene.space.where is not None:
        axis_m = scale_of(item.message, scene.space.where)
        if axis_m:
            layout.centre, layout.radius = scene.space.where, 10 * axis_m
            scene.space.set_scale(axis_m)
            return True
    return False


def _whole(layout: Layout, scene: Scene) -> None:
    """For whoever opens the file, and the screenshot: all of it, not the last minute."""
    layout.follow = False
    seen = scene.space.extent()
    if seen is not None:
        layout.centre, layout.radius = seen


def _report(scene: Scene, intake: Intake, more: Counter[str]) -> None:
    counts = scene.counts + intake.counts + more
    for name, count in sorted(counts.items()):
        print(f"{name} = {count}")
    if scene.pictures.why_damaged:
        _say(f"warning: {counts['pictures.damaged']} damaged, {scene.pictures.why_damaged}")


def _places(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Where it goes; ends the program for what cannot be."""
    if options.web and options.spawn:
        parser.error("--web and --spawn: one viewer at a time")
    if options.camera < 0:
        parser.error(f"--camera {options.camera}: must not be negative")
    if options.start < 0 or not np.isfinite(options.start):
        parser.error(f"--start {options.start}: must not be negative")
    try:
        channels_of(options.channel)
    except ValueError as error:
        parser.error(str(error))
    if options.spawn and not output.has_display():
        parser.error("--spawn: there is no display (DISPLAY, WAYLAND_DISPLAY); --web serves a browser")
    for path, ending in ((options.save, ".rrd"), (options.screenshot, ".png")):
        if path is not None and path.suffix != ending:
            parser.error(f"{path}: the name must end with {ending}")
    if options.save is None and options.screenshot is None and not options.web and not options.spawn:
        options.spawn = output.has_display()
        options.web = not options.spawn
        if options.web:
            _say("no display here: the viewer is served to a browser (--web)")


def _check_files(options: argparse.Namespace) -> None:
    for path in (options.save, options.screenshot):
        if path is None:
            continue
        if not path.absolute().parent.is_dir():
            raise FileNotFoundError(f"{path.absolute().parent}: no such folder")
        if path.exists() and not options.overwrite:
            raise FileExistsError(f"{path}: exists already; --overwrite replaces it")
    if options.screenshot is not None:
        output.check_screenshots()


def main(arguments: list[str] | None = None) -> int:
    parser = make_parser()
    options = parser.parse_args(arguments)
    _places(parser, options)
    try:
        _check_files(options)
        camera = _camera_of(options)
        rr = output.import_rerun()
        with Interrupt() as interrupt:
            show = _show_logs if options.log else _show_live
            return show(rr, options, camera, interrupt)
    except (DataError, ValueError, OSError, MissingPackageError, output.ViewerError) as error:
        print(f"loc-view: {error}", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt:
        print("loc-view: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
