"""What loc-slam makes of a run: errors against the truth, figures, and the files with them."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import EstimateStatus, EstimateValid, SlamRun
from libloc.programs.evaluate_input import Poses
from libloc.programs.slam_input import SlamInput
from libloc.programs.slam_pictures import Watcher, at_frames, profile, whole_s

_YEAR_1980_NS = 315_532_800_000_000_000  # a clock that says less counts from its own start
_FAR = 1e9  # [m]: what is farther is as good as at infinity


@dataclass
class TruthResult:
    """The estimates that have a true pose at their time, aligned with it."""

    absolute: libloc.AbsoluteError
    mode: str  # of the alignment: "none", "se3", "sim3", "yaw"
    rows: NDArray[np.intp]  # of the run
    times_ns: NDArray[np.int64]
    estimate: NDArray[np.float64]  # (N, 3), aligned [m]
    reference: NDArray[np.float64]  # (N, 3) [m]
    sigma: NDArray[np.float64]  # (N, 3), deviations that the filter states, in the reference's axes [m]
    without_partner: int
    length_m: float  # of the true path
    camera: bool = False  # poses of the camera are compared, not of body

    def to_reference(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        alignment = self.absolute.alignment
        return alignment.T_reference_estimate.transform(np.ascontiguousarray(alignment.scale * position))

    def covariance_to_reference(self, covariance: NDArray[np.float64]) -> NDArray[np.float64]:
        alignment = self.absolute.alignment
        rotation = alignment.T_reference_estimate.matrix()[:3, :3]
        return alignment.scale**2 * rotation @ covariance @ rotation.T


@dataclass
class SlamResult:
    given: SlamInput
    method: str
    options: libloc.SlamOptions
    run: SlamRun
    frames: int  # that were there for it
    truth: TruthResult | None
    truth_failure: str  # why there is none though there is a reference
    elapsed_s: float
    front_end: dict[str, NDArray[Any]] | None = (
        None  # from pictures: a row for each, see ImageSlam.recorded()
    )
    watcher: Watcher | None = None
    world: libloc.AnchoredRun | None = None  # where there is GPS

    @property
    def unit(self) -> str:
        """Of lengths as they are shown."""
        return "m" if self.metric or self.truth is not None else "unit of its own"

    @property
    def metric(self) -> bool:
        return not np.any(self.run.status & EstimateStatus.SCALE_UNKNOWN)


def known_rows(run: SlamRun) -> NDArray[np.bool]:
    wanted = EstimateValid.POSITION | EstimateValid.ORIENTATION
    return (run.valid & wanted) == wanted


def _cameras(body: libloc.Trajectory, T_body_camera: libloc.Pose3) -> libloc.Trajectory:
    """The camera's poses where body has these."""
    poses = [
        libloc.Pose3(q, p) * T_body_camera for q, p in zip(body.q_world_body_wxyz, body.position, strict=True)
    ]
    q = np.array([pose.rotation_wxyz for pose in poses])
    return libloc.Trajectory(body.times_ns, q, np.array([pose.translation for pose in poses]))


def against_truth(
    run: SlamRun, reference: Poses, mode: str, metric: bool, T_body_camera: libloc.Pose3
) -> TruthResult:
    """reference: poses of body. Where lengths are not metres the camera is compared: how far it is from body
    is then known in metres only.

    Raises DataError when nothing pairs, or the poses do not determine the alignment.
    """
    if mode == "auto":
        mode = "se3" if metric else "sim3"
    rows = np.flatnonzero(known_rows(run))
    truth = reference.has_position() & reference.has_orientation() & reference.score
    if len(rows) < 3 or not truth.any():
        raise libloc.DataError(
            f"{len(rows)} estimates and {truth.sum()} true poses are too few to be compared"
        )
    true_path = reference.trajectory(truth)
    if metric:
        estimate = libloc.Trajectory(run.time_ns[rows], run.q_world_body_wxyz[rows], run.position[rows])
    else:
        estimate = libloc.Trajectory(
            run.time_ns[rows], run.q_world_camera_wxyz[rows], run.camera_position[rows]
        )
        true_path = _cameras(true_path, T_body_camera)
    spacing_ns = int(np.median(np.diff(true_path.times_ns))) if len(true_path) > 1 else 0
    pairs = libloc.associate(
        estimate,
        true_path,
        max_difference_ns=max(10_000_000, spacing_ns),
        interpolate_reference=True,
        one_to_one=False,
    )
    absolute = libloc.absolute_error(pairs.estimate, pairs.reference, mode)
    rows = rows[pairs.estimate_index]
    out = TruthResult(
        absolute=absolute,
        mode=mode,
        rows=rows,
        times_ns=pairs.estimate.times_ns,
        estimate=np.empty(0),
        reference=pairs.reference.position,
        sigma=np.empty(0),
        without_partner=pairs.without_partner,
        length_m=float(np.linalg.norm(np.diff(pairs.reference.position, axis=0), axis=1).sum()),
        camera=not metric,
    )
    out.estimate = out.to_reference(pairs.estimate.position)
    covariance = out.covariance_to_reference(run.covariance[rows, 3:6, 3:6])
    out.sigma = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0))
    return out


def sigma_of_points(position_cov: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K,) largest deviation in any direction; NaN where it is not known, or beyond all measure."""
    out = np.full(len(position_cov), np.nan)
    good = np.isfinite(position_cov).all(axis=(1, 2))
    good[good] = np.abs(position_cov[good]).max(axis=(1, 2)) < _FAR**2
    if good.any():
        out[good] = np.sqrt(np.maximum(np.linalg.eigvalsh(position_cov[good])[:, -1], 0))
    return out


def _mean_square(values: NDArray[np.float64]) -> float | None:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else None


def _world_sigma(world: libloc.AnchoredRun) -> float | None:
    """Of the last position on the Earth, horizontal [m]."""
    rows = np.flatnonzero(world.georeferenced)
    if len(world.covariance) == 0 or len(rows) == 0:
        return None
    return float(np.sqrt(np.trace(world.covariance[rows[-1]][3:5, 3:5])))


def report(result: SlamResult) -> dict[str, Any]:
    """All figures; what is not known is None."""
    run, given = result.run, result.given
    used = run.nis_dim > 0
    out: dict[str, Any] = {
        "input": {"file": str(given.path), "format": given.form, "counts": given.counts},
        "method": result.method,
        "finished": not run.stopped,
        "frames": {"in_input": result.frames, "used": len(run)},
        "metric": result.metric,
        "estimator": run.totals,
        "elapsed_s": result.elapsed_s,
    }
    if len(run) == 0:
        return out
    ms = 1e3 * run.time_spent_s
    steps = np.diff(run.position[known_rows(run)], axis=0)
    out |= {
        "first_time_s": libloc.format_seconds(run.time_ns[0]),
        "last_time_s": libloc.format_seconds(run.time_ns[-1]),
        "path_length": float(np.linalg.norm(steps, axis=1).sum()),
        "filter_ms_per_frame": {
            "mean": float(ms.mean()),
            "p95": float(np.percentile(ms, 95)),
            "max": float(ms.max()),
        },
        "reprojection_px": {
            "before": _mean_square(run.reprojection_before_px),
            "after": _mean_square(run.reprojection_after_px),
        },
        "nis_per_dimension": float(run.nis[used].sum() / run.nis_dim[used].sum()) if used.any() else None,
        "map": {
            "points": len(run.map),
            "xyz": int(run.map.converted.sum()),
            "with_position": int(np.isfinite(run.map.position).all(axis=1).sum()),
        },
        "status": {
            flag.name.lower(): int(np.sum(run.status & flag != 0))
            for flag in EstimateStatus
            if np.any(run.status & flag)
        },
    }
    if result.front_end is not None:
        pictures = result.front_end
        out["pictures"] = {
            name: int(pictures[name].sum())
            for name in ("tracks", "searched", "klt", "cut_anew", "refound", "new", "lost")
        } | {"count": len(pictures["time_ns"])}
        out["profile_ms"] = profile(run, pictures)
    if result.world is not None:
        out["world"] = {"origin": result.world.origin, "counts": result.world.counts}
        if result.world.origin is not None:
            out["world"] |= {
                "frames": int(result.world.georeferenced.sum()),
                "metres_per_unit": result.world.scale,
                "sigma_m": _world_sigma(result.world),
            }
    if result.truth is not None:
        truth = result.truth
        error = truth.absolute
        sigmas = np.abs(truth.estimate - truth.reference) / np.where(truth.sigma > 0, truth.sigma, np.nan)
        sigmas = sigmas[np.isfinite(sigmas)]
        out["truth"] = {
            "file": str(given.reference.path) if given.reference else None,
            "alignment": truth.mode,
            "pose": "camera" if truth.camera else "body",
            "scale": error.alignment.scale,
            "pairs": len(truth.rows),
            "without_partner": truth.without_partner,
            "path_length_m": truth.length_m,
            "rmse_m": error.translation.rmse,
            "max_m": error.translation.max,
            "rotation_rmse_deg": float(np.rad2deg(error.rotation.rmse)),
            "share_within_3_sigma": float(np.mean(sigmas < 3)) if len(sigmas) else None,
        }
    elif result.truth_failure:
        out["truth_failure"] = result.truth_failure
    return out


# Of what was read and of what the estimator did: what somebody should know of when it is not zero.
_TROUBLE = (
    "skipped",
    "not_increasing",
    "not_usable",
    "ambiguous",
    "failed",
    "gap",
    "set_back",
    "cut",
    "damage",
)


def _troubles(out: dict[str, Any]) -> list[str]:
    counts = out["input"]["counts"] | out["estimator"]
    return [
        f"{name} {n}"
        for name, n in counts.items()
        if n and name != "tracks.cut_anew" and any(word in name for word in _TROUBLE)
    ]


def _lines_of_pictures(out: dict[str, Any]) -> list[str]:
    p = out["pictures"]
    n = max(p["count"], 1)
    lines = [
        f"{'features':14s} {p['tracks'] / n:.1f} in a picture: {p['searched'] / n:.1f} where expected, "
        f"{(p['klt'] + p['cut_anew']) / n:.1f} from the last picture, {p['refound'] / n:.1f} found again, "
        f"{p['new'] / n:.1f} new; {p['lost'] / n:.1f} lost"
    ]
    lines += [f"{'time [ms]':14s} {'':10s} {'median':>8s} {'99 %':>8s} {'longest':>8s}"]
    for name, ms in out["profile_ms"].items():
        if ms is not None:
            part = name.replace("_", " ") if name in ("front_end", "filter", "whole") else f"  {name}"
            lines.append(f"{'':14s} {part:10s} {ms['median']:8.2f} {ms['p99']:8.2f} {ms['max']:8.2f}")
    return lines


def text_of(out: dict[str, Any]) -> str:
    lines = []

    def line(label: str, text: str) -> None:
        lines.append(f"{label:14s} {text}")

    frames = out["frames"]
    line("input", f"{out['input']['file']} ({out['input']['format']})")
    ending = "" if out["finished"] else ": interrupted, this is what there was"
    line("frames", f"{frames['used']} used of {frames['in_input']}{ending}")
    if _troubles(out):
        line("", ", ".join(_troubles(out)))
    if "map" not in out:
        return "\n".join(lines)
    unit = "m" if out["metric"] else "units of its own: one camera cannot tell metres"
    line("method", f"{out['method']}, {out['first_time_s']} to {out['last_time_s']} s")
    line("path", f"{out['path_length']:.3f} {unit}")
    if "pictures" in out:
        lines += _lines_of_pictures(out)
    ms = out["filter_ms_per_frame"]
    line("filter", f"{ms['mean']:.3f} ms a frame, 95 % below {ms['p95']:.3f}, longest {ms['max']:.3f}")
    px = out["reprojection_px"]
    if px["before"] is not None:
        line("reprojection", f"{px['before']:.3f} px before the update, {px['after']:.3f} px after it (rms)")
        line("NIS", f"{out['nis_per_dimension']:.3f} per dimension (1 is right)")
    m = out["map"]
    line("map", f"{m['points']} points, {m['xyz']} of them as XYZ")
    if out["status"]:
        line("status", ", ".join(f"{name} {count}" for name, count in out["status"].items()) + " (frames)")
    if "world" in out:
        w = out["world"]
        fixes = w["counts"].get("gps.accepted", 0)
        if w["origin"] is None:
            line("world", "GPS did not tell where the map is (too few fixes, or too short a way)")
        else:
            latitude, longitude = np.rad2deg(w["origin"][:2])
            sigma = "" if w["sigma_m"] is None else f", at the end within {w['sigma_m']:.2f} m (1 sigma)"
            line("world", f"by GPS: origin {latitude:.7f}, {longitude:.7f} deg, {fixes} fixes{sigma}")
            line("", f"{w['metres_per_unit']:.4f} metres a unit of the map")
    if "truth" in out:
        t = out["truth"]
        scale = f", scale {t['scale']:.6f}" if t["alignment"] == "sim3" else ""
        line(
            "truth",
            f"{t['rmse_m']:.4f} m rmse, {t['max_m']:.4f} m at most, {t['rotation_rmse_deg']:.3f} deg; "
            f"{t['pairs']} poses over {t['path_length_m']:.2f} m, alignment {t['alignment']}{scale}",
        )
        if t["share_within_3_sigma"] is not None:
            line(
                "",
                f"{100 * t['share_within_3_sigma']:.1f} % of the aligned errors are within 3 sigma",
            )
    elif "truth_failure" in out:
        line("truth", f"not compared: {out['truth_failure']}")
    return "\n".join(lines)


def _vector(prefix: str, unit: str, axes: str = "xyz") -> list[str]:
    return [f"{prefix}{axis}{unit}" for axis in axes]


def frame_columns(run: SlamRun, front_end: dict[str, NDArray[Any]] | None = None) -> dict[str, NDArray[Any]]:
    """Everything that SlamFrame says, by the names of the columns; those of the pose are loc-estimator's.

    From pictures those of the front end follow.
    """
    out: dict[str, NDArray[Any]] = {
        "time_ns": run.time_ns,
        "sequence": run.sequence,
        "valid": run.valid,
        "status": run.status,
    }

    def add(names: list[str], values: NDArray[Any]) -> None:
        out.update(zip(names, values.T, strict=True))

    add(["qw", "qx", "qy", "qz"], run.q_world_body_wxyz)
    add(_vector("p", "_m"), run.position)
    add(_vector("v", "_m_s"), run.velocity)
    add(_vector("w", "_rad_s"), run.angular_velocity)
    add(_vector("bg", "_rad_s"), run.gyroscope_bias)
    add(_vector("ba", "_m_s2"), run.accelerometer_bias)
    sigma = np.full((len(run), 15), np.nan)
    dim = run.covariance.shape[1]
    sigma[:, :dim] = np.sqrt(np.maximum(np.diagonal(run.covariance, axis1=1, axis2=2), 0))
    units = {"theta": "_rad", "p": "_m", "v": "_m_s", "bg": "_rad_s", "ba": "_m_s2"}
    for k, (name, unit) in enumerate(units.items()):
        add(_vector(f"sigma_{name}", unit), sigma[:, 3 * k : 3 * k + 3])
    add([f"camera_{name}" for name in ("qw", "qx", "qy", "qz")], run.q_world_camera_wxyz)
    add(_vector("camera_p", "_m"), run.camera_position)
    for name in ("reprojection_before_px", "reprojection_after_px", "nis", "nis_dim"):
        out[name] = getattr(run, name)
    out.update(run.counts)
    out["time_spent_s"] = run.time_spent_s
    if front_end is not None:
        for name in ("tracks", "searched", "klt", "cut_anew", "refound", "new", "lost"):
            # Every frame has its picture, so that this is exact.
            out[f"tracks_{name}" if name != "tracks" else name] = at_frames(run, front_end, name).astype(
                np.int64
            )
        out["front_end_s"] = at_frames(run, front_end, "front_end_s")
        out["whole_s"] = whole_s(run, front_end)
    return out


def write_frames(run: SlamRun, path: Path, front_end: dict[str, NDArray[Any]] | None = None) -> None:
    """CSV, a line for each frame; every number reads back as the same one, an empty cell is not known."""
    columns = frame_columns(run, front_end)
    cells = [
        [str(v) for v in values.tolist()]
        if values.dtype.kind in "iu"
        else [repr(v) if math.isfinite(v) else "" for v in values.tolist()]
        for values in columns.values()
    ]
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(columns) + "\n")
        file.writelines(",".join(row) + "\n" for row in zip(*cells, strict=True))


def write_map(result: SlamResult, path: Path) -> int:
    """PLY: x y z, id, sigma (largest deviation in any direction).

    Returns how many were left out: those of which the place is not known.
    """
    map_ = result.run.map
    fits = np.abs(map_.id) < 2**31
    comments = ["world, z up [m]" if result.metric else "world of the start, unit of its own"]
    if not fits.all():
        comments.append("identities of more than 32 bit are -1")
    sigma = sigma_of_points(map_.position_cov)
    return libloc.write_ply(
        path, map_.position, np.where(fits, map_.id, -1), sigma, comments=comments, ascii=True
    )


def write_trajectory(run: SlamRun, pose: str, path: Path) -> None:
    """TUM; pose of body or of camera, in the world of the estimate."""
    rows = known_rows(run)
    if pose == "body":
        trajectory = libloc.Trajectory(run.time_ns[rows], run.q_world_body_wxyz[rows], run.position[rows])
    else:
        trajectory = libloc.Trajectory(
            run.time_ns[rows], run.q_world_camera_wxyz[rows], run.camera_position[rows]
        )
    libloc.write_tum(path, trajectory, pose)


def write_world(world: libloc.AnchoredRun, folder: Path) -> list[Path]:
    """The path on the Earth: east, north, up of the origin as TUM, and GPX."""
    rows = world.georeferenced
    trajectory = libloc.Trajectory(world.time_ns[rows], world.q_world_body_wxyz[rows], world.position[rows])
    paths = [folder / "world.tum", folder / "world.gpx"]
    libloc.write_tum(paths[0], trajectory, "body")
    places = libloc.LocalFrame(*world.origin).to_geodetic(np.ascontiguousarray(world.position[rows]))
    utc_ns = np.ascontiguousarray(world.time_ns[rows])
    time_of_day = len(utc_ns) > 0 and utc_ns[0] >= _YEAR_1980_NS
    libloc.write_gpx(paths[1], places, utc_ns=utc_ns if time_of_day else None, name="libloc")
    return paths


def write(result: SlamResult, out: dict[str, Any], pose: str, pictures: bool, folder: Path) -> list[Path]:
    """Writes everything into the folder; gives the paths."""
    paths = [folder / "summary.json", folder / "summary.txt"]
    paths[0].write_text(json.dumps(out, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    paths[1].write_text(text_of(out) + "\n", encoding="utf-8")
    if len(result.run) == 0:
        return paths
    for name, function in (
        ("trajectory.tum", lambda path: write_trajectory(result.run, pose, path)),
        ("frames.csv", lambda path: write_frames(result.run, path, result.front_end)),
        ("map.ply", lambda path: write_map(result, path)),
        ("slam.yaml", lambda path: libloc.write_slam_options(path, result.options)),
        ("state.slam", lambda path: libloc.save_slam(path, result.run.snapshot, result.options)),
    ):
        function(folder / name)
        paths.append(folder / name)
    if result.world is not None and result.world.origin is not None:
        paths += write_world(result.world, folder)
    if pictures:
        from libloc.programs import slam_plots

        paths += slam_plots.write_pictures(result, folder)
    if result.watcher is not None and result.watcher.video_path is not None:
        paths.append(result.watcher.video_path)
    return paths
