"""loc-calibrate camera: focal lengths, principal point and distortion of a camera from pictures of a target.

INPUT: pictures, folders of pictures (or an EuRoC folder), one video, an LCM log, or a table of corners that
were found by another program (CSV, with --size). Take 20 pictures or more: the target in all corners of the
image, near and far, tilted by 30 to 45 degrees to all sides, sharp, with nothing moving.

--target checkerboard 9x6 0.025          inner corners (not squares) along x and y, side of a square [m]
--target aprilgrid 6x6 0.088 0.3         Kalibr's grid: tags along x and y, side of a tag [m], spacing ratio
--target target.yaml                     Kalibr's file

The rig's camera of that --name gets the result and keeps its pose and time offset; there is a new one when it
has none of that name. Ctrl-C during the search goes on with the pictures that were searched.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

import numpy as np

import libloc
from libloc import DataError, Verdict
from libloc.programs import calibrate_images as images
from libloc.programs import calibrate_plots_camera as plots
from libloc.programs.arguments import count
from libloc.programs.calibrate_report import Outcome, Picture, Table, with_sigma

MODELS = {
    "radtan": libloc.DistortionModel.RADTAN,
    "equidistant": libloc.DistortionModel.EQUIDISTANT,
    "none": libloc.DistortionModel.NONE,
}
_NAMES = {"radtan": ("k1", "k2", "p1", "p2"), "equidistant": ("k1", "k2", "k3", "k4"), "none": ()}
_ROWS_SHOWN = 12


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdigit() and height.isdigit() and int(width) > 0 and int(height) > 0):
        raise argparse.ArgumentTypeError(f"{text}: must be like 752x480")
    return int(width), int(height)


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "input", type=Path, nargs="+", metavar="INPUT", help="pictures, folder, video, LCM log"
    )
    group = parser.add_argument_group("target and camera")
    group.add_argument("--target", nargs="+", required=True, metavar="WORD", help="see above")
    group.add_argument("--model", choices=tuple(MODELS), default="radtan", help="of the lens (%(default)s)")
    group.add_argument("--name", default="cam0", help="of the camera in the rig (%(default)s)")
    group.add_argument(
        "--camera", type=int, default=0, metavar="N", help="of an EuRoC folder or a log (%(default)s)"
    )
    group.add_argument("--size", type=_size, metavar="WxH", help="of the image, for a table of corners [px]")
    group.add_argument(
        "--step", type=count, metavar="N", help="search every N-th picture (videos: 500 in all)"
    )
    group.add_argument(
        "--max-views",
        type=count,
        default=200,
        metavar="N",
        help="use so many, the most different ones (%(default)s)",
    )


def check_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    options.target = parse_target(parser, options.target)
    table = options.input[0].suffix.lower() == ".csv"
    if table and (len(options.input) > 1 or options.size is None):
        parser.error("a table of corners is the only INPUT, and --size WxH tells the image's size")
    if not table and not libloc.HAS_VISION:
        parser.error(
            "this libloc was built without OpenCV and cannot look at pictures (Debian: libopencv-calib3d-dev)"
        )


def parse_target(parser: argparse.ArgumentParser, words: list[str]) -> libloc.CalibrationTarget:
    """The words behind --target; a wrong one ends the program."""
    try:
        if len(words) == 1 and words[0].lower().endswith((".yaml", ".yml")):
            return libloc.CalibrationTarget.read_kalibr(Path(words[0]))
        return libloc.CalibrationTarget(" ".join(words))
    except DataError as error:
        parser.error(f"--target: {error}")
    except ValueError as error:
        parser.error(f"--{error}")


def _read(options: argparse.Namespace) -> images.Corners:
    if options.input[0].suffix.lower() == ".csv":
        return images.read_corner_table(options.input[0], options.target, *options.size)
    items, total = images.pictures(options.input, options.camera, options.step)
    return images.find_corners(options.target, items, total)


def _parameters(fit: libloc.CameraFit, model: str) -> Table:
    values = [*fit.camera.intrinsics_px, *fit.camera.distortion]
    by_corners = np.sqrt(np.diag(fit.covariance))
    rows = []
    for i, name in enumerate(("fx [px]", "fy [px]", "cx [px]", "cy [px]", *_NAMES[model])):
        scatter = fit.sigma_by_views[i]
        rows.append(
            [
                name,
                with_sigma(values[i], fit.sigma[i]),
                f"{by_corners[i]:.2g}",
                f"{scatter:.2g}" if np.isfinite(scatter) else "too few pictures",
            ]
        )
    return Table(
        "camera", ["", "value ± deviation", "from the corners' noise", "from the pictures' scatter"], rows
    )


def _pictures_table(fit: libloc.CameraFit, names: list[str]) -> Table:
    """Those that were dropped, then the worst."""
    order = sorted(range(len(names)), key=lambda i: (fit.views[i].used, -np.nan_to_num(fit.views[i].rms_px)))
    order = [i for i in order if fit.views[i].corners > 0]
    rows = [
        [
            names[i],
            f"{fit.views[i].rms_px:.3f}",
            f"{fit.views[i].worst_px:.2f}",
            f"{fit.views[i].corners - fit.views[i].corners_dropped} of {fit.views[i].corners}",
            f"{np.rad2deg(fit.views[i].tilt):.0f}",
            "" if fit.views[i].used else f"not used: {fit.views[i].reason}",
        ]
        for i in order[:_ROWS_SHOWN]
    ]
    more = f", {_ROWS_SHOWN} of {len(order)}" if len(order) > _ROWS_SHOWN else ""
    return Table(
        f"pictures, worst first{more}", ["", "rms [px]", "worst [px]", "corners", "tilt [deg]", ""], rows
    )


def calibrate(options: argparse.Namespace) -> Outcome:
    """Raises DataError when pictures cannot be read, or show too little of the target."""
    target = options.target
    corners = _read(options)
    chosen = libloc.choose_views(
        target, corners.views, corners.width_px, corners.height_px, options.max_views
    )
    names = [corners.names[i] for i in chosen]
    fit = libloc.calibrate_camera(
        target,
        [corners.views[i] for i in chosen],
        corners.width_px,
        corners.height_px,
        libloc.CameraFitOptions(model=MODELS[options.model]),
    )
    with_target = corners.counts["pictures.with_target"]
    other = {"radtan": "equidistant", "equidistant": "radtan"}.get(options.model)
    out = Outcome(
        block=f"cameras.{options.name}",
        summary=f"Camera {options.name}, {corners.width_px} x {corners.height_px} px, lens {options.model}: "
        f"{fit.views_used} pictures of {target}",
        verdict=Verdict(fit.quality.verdict),
        reasons=list(fit.quality.reasons),
        apply=partial(_apply, fit, options.name),
        facts=[
            ("residuals", f"rms {fit.rms_px:.3f} px; noise of a corner's coordinate {fit.noise_px:.3f} px"),
            (
                "used",
                f"{fit.views_used} of {with_target} pictures with the target, {fit.corners_used} corners "
                f"({fit.corners_dropped} did not fit)",
            ),
            (
                "coverage",
                f"{100 * fit.covered_share:.0f} % of the image, {100 * fit.radius_share:.0f} % of the way to "
                f"its corners, target tilted by {np.rad2deg(fit.tilt_range):.0f} deg in all",
            ),
            (
                "uncertainty",
                f"of a projected point {fit.median_uncertainty_px:.3f} px, "
                f"at most {fit.worst_uncertainty_px:.3f} px",
            ),
        ],
        tables=[_parameters(fit, options.model), _pictures_table(fit, names)],
        pictures=[
            Picture("coverage", "Where corners were found in the image.", partial(plots.plot_coverage, fit)),
            Picture(
                "residuals",
                "Found less projected, enlarged: no direction may prevail anywhere.",
                partial(plots.plot_residuals, fit),
            ),
            Picture("pictures", "Residuals of each picture.", partial(plots.plot_views, fit, names)),
            Picture(
                "uncertainty",
                "Deviation of the pixel of a given ray: large where no corner was seen.",
                partial(plots.plot_uncertainty, fit),
            ),
        ],
        counts=corners.counts,
    )
    if other and np.isfinite(fit.other_model_rms_px):
        out.facts.append(("other lens model", f"{other}: rms {fit.other_model_rms_px:.3f} px"))
    _add_notes(out, corners, options, len(chosen))
    return out


def _add_notes(out: Outcome, corners: images.Corners, options: argparse.Namespace, used: int) -> None:
    if corners.interrupted:
        out.notes.append(
            f"interrupted: {len(corners.names)} pictures were searched, the rest was not looked at"
        )
    out.notes += corners.skipped[:5]
    if len(corners.skipped) > 5:
        out.notes.append(f"{len(corners.skipped) - 5} more pictures could not be used")
    without = [name for name, view in zip(corners.names, corners.views, strict=True) if not len(view)]
    if without:
        shown = ", ".join(without[:6]) + (", …" if len(without) > 6 else "")
        out.notes.append(f"{len(without)} pictures without the target: {shown}")
    if corners.counts["pictures.with_target"] > used:
        out.notes.append(
            f"{used} pictures were chosen as the most different ones (--max-views {options.max_views})"
        )
    if corners.left_out:
        out.notes.append(f"{corners.left_out} corners were not sharp enough to be placed")


def _apply(fit: libloc.CameraFit, name: str, rig: libloc.Rig) -> None:
    camera = libloc.CameraCalibration()
    cameras = list(rig.cameras)
    at = next((i for i, c in enumerate(cameras) if c.name == name), None)
    if at is not None:
        camera = cameras[at]
    camera.name = name
    camera.width_px, camera.height_px = fit.camera.width_px, fit.camera.height_px
    camera.intrinsics_px = fit.camera.intrinsics_px
    camera.distortion_model = fit.camera.distortion_model
    camera.distortion = fit.camera.distortion
    quality = libloc.IntrinsicsQuality()
    quality.verdict, quality.reasons = fit.quality.verdict, list(fit.quality.reasons)
    quality.method, quality.pictures = "target", fit.views_used
    if np.isfinite(fit.sigma).all():  # otherwise the pictures do not determine them
        quality.intrinsics_sigma_px, quality.distortion_sigma = fit.sigma[:4], fit.sigma[4:]
    quality.reprojection_rms_px = fit.rms_px
    camera.intrinsics_quality = quality
    if at is None:
        cameras.append(camera)
    else:
        cameras[at] = camera
    rig.cameras = cameras
