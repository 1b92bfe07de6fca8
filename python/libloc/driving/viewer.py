"""The drive for the rerun viewer: written to an .rrd file; the viewer is started only on request."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

import numpy as np

from libloc._core import so3
from libloc.driving.animation import ESTIMATE, ODOMETRY, TRUTH, VEHICLE_HIGH, VEHICLE_LOW
from libloc.driving.run import DrivingRun, Floats
from libloc.driving.scene import DrivingScene
from libloc.driving.video import MissingPackageError

_TIMELINE = "time"
_AXES = ("x", "y", "z")
_AXIS_COLOURS = [(31, 119, 180), (255, 127, 14), (44, 160, 44)]
_SIGMA_COLOURS = [(*colour, 110) for colour in _AXIS_COLOURS]


def _rerun(path: Path) -> Any:
    try:
        import rerun
    except ImportError:
        raise MissingPackageError(
            f"{path}: this needs the Python package rerun-sdk (pip install rerun-sdk)"
        ) from None
    return rerun


def save_rerun(
    run: DrivingRun, scene: DrivingScene, path: str | os.PathLike[str], overwrite: bool = False
) -> None:
    """Writes scene, both vehicles, trails, and errors with three deviations into an .rrd file, off screen.

    Raises MissingPackageError without rerun-sdk, FileExistsError unless overwrite, ValueError for another
    ending.
    """
    path = Path(path)
    if path.suffix != ".rrd":
        raise ValueError(f"{path}: the name of a rerun recording ends with .rrd")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path.parent}: no such folder")
    if path.exists() and not overwrite:
        raise FileExistsError(f"{path}: exists already")
    rr = _rerun(path)
    part = path.with_name(f".{path.stem}.part.rrd")
    recording = rr.RecordingStream("libloc-driving")
    try:
        recording.save(part, default_blueprint=_blueprint(rr, run))
        _log_scene(rr, recording, scene)
        _log_vehicles(rr, recording, run)
        _log_errors(rr, recording, run)
        recording.flush()
        recording.disconnect()
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def view_rerun(path: str | os.PathLike[str]) -> subprocess.Popen[bytes]:
    """Starts the rerun viewer with an .rrd file and returns its process.

    The viewer listens on 127.0.0.1 only. Its usage statistics are switched off for this user before.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    _rerun(path)
    program = shutil.which("rerun", path=sysconfig.get_path("scripts")) or shutil.which("rerun")
    command = [program] if program else [sys.executable, "-m", "rerun_cli"]
    subprocess.run([*command, "analytics", "disable"], check=True, stdout=subprocess.DEVNULL)
    return subprocess.Popen([*command, "--bind", "127.0.0.1", "--port", "auto", os.fspath(path)])


def _blueprint(rr: Any, run: DrivingRun) -> Any:
    rrb = rr.blueprint
    plots = []
    for name, title, values, sigma in _error_rows(run):
        # As in the summary: the range is that of what came after the start.
        later = run.times_s >= 0.1 * run.times_s[-1]
        middle = values[-1] if name == "scale" else np.zeros(values.shape[1])
        reach = np.abs(values[later] - middle) if sigma is None else 3 * sigma[later]
        limit = 1.5 * max(float(np.nanmax(reach, initial=0.0)), 1e-9)
        axis = rrb.ScalarAxis(range=(float(middle[0]) - limit, float(middle[0]) + limit))
        legend = rrb.PlotLegend(visible=False)
        plots.append(rrb.TimeSeriesView(origin=f"errors/{name}", name=title, axis_y=axis, plot_legend=legend))
    # Behind and above the true vehicle, and with it.
    heading = float(np.atleast_1d(so3.heading(run.true_q_world_body_wxyz[:1]))[0])
    behind = np.array([-45 * np.cos(heading), -45 * np.sin(heading), 30.0])
    eye = rrb.EyeControls3D(
        position=run.true_position[0] + behind,
        look_target=run.true_position[0],
        tracking_entity="world/truth",
    )
    scene = rrb.Spatial3DView(origin="world", name="drive", eye_controls=eye)
    return rrb.Blueprint(
        rrb.Horizontal(scene, rrb.Vertical(*plots), column_shares=[2, 1]), collapse_panels=True
    )


def _log_scene(rr: Any, recording: Any, scene: DrivingScene) -> None:
    recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    half = scene.road_width_m / 2
    vertices = np.stack([scene.edges(half), scene.edges(-half)], axis=1).reshape(-1, 3)
    i = 2 * np.arange(len(scene.road) - 1)[:, None]
    triangles = np.concatenate([i + np.array([0, 1, 2]), i + np.array([1, 3, 2])])
    recording.log(
        "world/road",
        rr.Mesh3D(
            vertex_positions=vertices - [0, 0, 0.02],
            triangle_indices=triangles,
            vertex_colors=np.tile(np.array([95, 97, 100], dtype=np.uint8), (len(vertices), 1)),
        ),
        static=True,
    )
    if not scene.buildings:
        return
    corners = np.array([building.corners for building in scene.buildings])
    along, across = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    height = np.array([building.height for building in scene.buildings])
    ground = np.array([building.ground for building in scene.buildings])
    yaw = np.arctan2(along[:, 1], along[:, 0])
    zero = np.zeros(len(yaw))
    recording.log(
        "world/buildings",
        rr.Boxes3D(
            centers=np.column_stack([corners.mean(axis=1), ground + height / 2]),
            half_sizes=0.5
            * np.column_stack([np.linalg.norm(along, axis=1), np.linalg.norm(across, axis=1), height]),
            quaternions=np.column_stack([zero, zero, np.sin(yaw / 2), np.cos(yaw / 2)]),
            colors=[building.colour for building in scene.buildings],
            fill_mode="solid",
        ),
        static=True,
    )


def _log_vehicles(rr: Any, recording: Any, run: DrivingRun) -> None:
    time = rr.TimeColumn(_TIMELINE, duration=run.times_s)
    middle, half = (VEHICLE_LOW + VEHICLE_HIGH) / 2, (VEHICLE_HIGH - VEHICLE_LOW) / 2
    for name, colour, fill, position, q_wxyz in (
        ("truth", TRUTH, "solid", run.true_position, run.true_q_world_body_wxyz),
        ("estimate", (*ESTIMATE, 90), "transparentfillmajorwireframe", run.position, run.q_world_body_wxyz),
    ):
        box = rr.Boxes3D(centers=[middle], half_sizes=[half], colors=[colour], fill_mode=fill)
        recording.log(f"world/{name}", box, static=True)
        poses = rr.Transform3D.columns(translation=position, quaternion=np.roll(q_wxyz, -1, axis=1))
        recording.send_columns(f"world/{name}", indexes=[time], columns=poses)
    trails = [("truth", (60, 60, 60), run.true_position), ("estimate", ESTIMATE, run.position)]
    if run.odometry_in_metres is not None:
        trails.append(("odometry", ODOMETRY, run.odometry_in_metres[1]))
    for name, colour, points in trails:
        line = rr.LineStrips3D([points], colors=[colour], radii=[0.15])
        recording.log(f"world/trail/{name}", line, static=True)


def _error_rows(run: DrivingRun) -> list[tuple[str, str, Floats, Floats | None]]:
    """Name, title, errors (N, 3), deviations (N, 3)"""
    sigma = run.estimated("attitude_sigma")
    rows = [
        (
            "position",
            "position error x y z, ±3σ [m]",
            run.position_error,
            run.estimated("position_sigma"),
        ),
        (
            "attitude",
            "attitude error x y z, ±3σ [°]",
            np.rad2deg(run.attitude_error),
            None if sigma is None else np.rad2deg(sigma),
        ),
    ]
    scale = run.estimated("scale")
    if scale is not None and np.isfinite(scale).any():
        deviation = run.estimated("scale_sigma")
        rows.append(
            (
                "scale",
                "odometry scale, ±3σ [unit/m]",
                scale[:, None],
                None if deviation is None else deviation[:, None],
            )
        )
    return rows


def _log_errors(rr: Any, recording: Any, run: DrivingRun) -> None:
    time = rr.TimeColumn(_TIMELINE, duration=run.times_s)
    for name, _, values, sigma in _error_rows(run):
        width = values.shape[1]
        labels = _AXES[:width] if width > 1 else (name,)
        # The band of the scale lies about the scale, that of an error about zero.
        middle = values if name == "scale" else 0.0
        series = [("value", values, _AXIS_COLOURS, labels)]
        if sigma is not None:
            for which, side in (("upper", 3.0), ("lower", -3.0)):
                names = [f"{label} {side:+.0f}σ" for label in labels]
                series.append((which, middle + side * sigma, _SIGMA_COLOURS, names))
        for which, rows, colours, names in series:
            entity = f"errors/{name}/{which}"
            recording.log(entity, rr.SeriesLines(colors=colours[:width], names=list(names)), static=True)
            columns = rr.Scalars.columns(scalars=rows.ravel()).partition(np.full(len(rows), width))
            recording.send_columns(entity, indexes=[time], columns=columns)
