"""What tools/demo shows of SLAM from pictures: live and replayed run are the same, errors against the truth,
and one picture that sums up the run.

    demo_slam_report.py --live live.log --replay replay.log --picture summary.png --title TEXT

The logs hold the LCM types of msgs/ (Python package `loc`). The truth is LOC_REFERENCE in the log, or a TUM
file (poses of the body). Exit code 1 when the runs differ or pictures were lost.
"""

import io
import re
import sys
from dataclasses import dataclass, field
from pathlib import Path

import demo_runs
import loc
import matplotlib.pyplot as plt
import numpy as np
from demo_runs import (
    ReportError,
    check_logged,
    check_same,
    events,
    make_parser,
    published,
    save,
    without_host_times,
)
from PIL import Image

SHOWN_PICTURES = 3
# What became of a feature: bits of slam_frame_t, with colours that colour-blind readers tell apart.
STATES = (
    ((loc.slam_frame_t.STATE_MEASURED, loc.slam_frame_t.STATE_RESCUED), "used", "tab:cyan"),
    ((loc.slam_frame_t.STATE_NEW,), "new in the map", "yellow"),
    ((loc.slam_frame_t.STATE_REJECTED,), "not believed", "red"),
    ((loc.slam_frame_t.STATE_PREDICTED,), "expected, not used", "tab:orange"),
)
EARTH_RADIUS_M = 6_378_137.0
MOVING_M_S = 0.03  # a truth that is slower stands still
MAX_GAP_NS = 100_000_000
KNOWN_SHARE = 0.3  # a point's deviation over its distance


@dataclass
class Track:
    """Poses over time; q_wxyz takes body (or camera) to world."""

    time_ns: list[int] = field(default_factory=list)
    position: list = field(default_factory=list)
    q_wxyz: list = field(default_factory=list)

    def add(self, time_ns, position, q_wxyz) -> None:
        self.time_ns.append(time_ns)
        self.position.append(position)
        self.q_wxyz.append(q_wxyz)

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return (
            np.array(self.time_ns, dtype=np.int64),
            np.array(self.position, dtype=float).reshape(-1, 3),
            np.array(self.q_wxyz, dtype=float).reshape(-1, 4),
        )


@dataclass
class Run:
    method: str = ""
    body: Track = field(default_factory=Track)
    camera: Track = field(default_factory=Track)
    truth: Track = field(default_factory=Track)
    fixes: list = field(default_factory=list)  # time, latitude, longitude [rad], altitude [m]
    origin: tuple | None = None  # of world on the Earth: latitude, longitude, altitude
    anchored_ns: int | None = None  # since when
    frames: list = field(default_factory=list)  # slam_frame_t
    pictures: list = field(default_factory=list)  # LOC_IMAGE of camera 0, not decoded: its number and bytes
    map_points: dict = field(default_factory=dict)  # id: place, the last that was known to KNOWN_SHARE
    conditions: dict = field(default_factory=dict)  # word: number of messages
    same: list = field(default_factory=list)  # bytes that must be those of another run
    logged: int = 0  # pictures of all cameras
    published: int | None = None  # pictures of all cameras, as the driver says
    latency_ms: dict = field(default_factory=dict)

    def seconds(self, time_ns) -> np.ndarray:
        return (np.asarray(time_ns) - self.frames[0].time_ns) * 1e-9


def read(path: Path) -> Run:
    run = Run()
    for event in events(path):
        if event.channel == "LOC_ESTIMATE":
            run.same.append(without_host_times(event.data))
            message = loc.estimate_t.decode(event.data)
            run.method = message.method
            if message.valid & message.VALID_POSITION:
                run.body.add(message.time_ns, message.position, message.q_world_body_wxyz)
        elif event.channel == "LOC_SLAM_FRAME":
            frame = loc.slam_frame_t.decode(event.data)
            run.frames.append(frame)
            if np.isfinite(frame.camera_position).all():
                run.camera.add(frame.time_ns, frame.camera_position, frame.q_world_camera_wxyz)
        elif event.channel == "LOC_REFERENCE":
            message = loc.reference_t.decode(event.data)
            if message.score and np.isfinite(message.position).all():
                run.truth.add(message.time_ns, message.position, message.q_world_body_wxyz)
        elif event.channel == "LOC_GPS":
            fix = loc.gps_fix_t.decode(event.data)
            if fix.fix_type >= fix.FIX_2D:
                run.fixes.append((fix.time_ns, fix.latitude, fix.longitude, fix.altitude))
        elif event.channel == "LOC_FUSION":
            message = loc.fusion_t.decode(event.data)
            place = (message.origin_latitude, message.origin_longitude, message.origin_altitude)
            if np.isfinite(place).all():
                if run.origin is None:
                    run.anchored_ns = message.time_ns
                    run.map_points.clear()  # of another world
                run.origin = place
        elif event.channel == "LOC_MAP":
            add_known_points(run, loc.map_points_t.decode(event.data))
        elif event.channel == "LOC_IMAGE":
            run.logged += 1
            # Fingerprint, time_ns, host_time_ns, sequence, exposure_ns: 8 bytes each; the camera.
            if int.from_bytes(event.data[40:44], "big") == 0:
                run.pictures.append((int.from_bytes(event.data[24:32], "big"), event.data))
        elif event.channel == "LOC_ESTIMATOR_STATUS":
            for word in loc.estimator_status_t.decode(event.data).condition:
                run.conditions[word] = run.conditions.get(word, 0) + 1
        elif event.channel == "LOC_SOURCE_STATUS":
            run.published = published(event.data, "image")
        elif event.channel == "LOC_STATISTICS":
            message = loc.statistics_t.decode(event.data)
            if message.program == "loc-estimator":
                run.latency_ms = dict(zip(message.name, message.value, strict=True))
    if not run.frames:
        raise ReportError(f"{path}: no frame of SLAM in it")
    return run


def add_known_points(run: Run, message) -> None:
    if message.size == 0 or not run.camera.position:
        return
    points = np.array(message.position)
    covariance = np.array(message.position_cov).reshape(-1, 3, 3)
    sigma = np.sqrt(np.trace(covariance, axis1=1, axis2=2))
    known = sigma < KNOWN_SHARE * np.linalg.norm(points - run.camera.position[-1], axis=1)
    for index in np.flatnonzero(known):
        run.map_points[message.point_id[index]] = points[index]


def check_replay(live: Run, replay: Run) -> str:
    """Same estimates, bit for bit, and no picture lost. Returns a sentence for the user."""
    check_logged("pictures", live.published, live.logged)
    for name, run in (("live", live), ("the replay", replay)):
        if len(run.frames) != len(live.pictures):
            raise ReportError(
                f"{name}: {len(run.frames)} of {len(live.pictures)} pictures reached the filter:"
                " is the machine busy?"
            )
    return check_same(live.same, replay.same, f"{len(live.pictures)} pictures")


def rotate(q_wxyz: np.ndarray, vector: np.ndarray) -> np.ndarray:
    w, v = q_wxyz[:, :1], q_wxyz[:, 1:]
    cross = np.cross(v, np.broadcast_to(vector, v.shape))
    return vector + 2 * (w * cross + np.cross(v, cross))


def read_tum(path: Path) -> Track:
    track = Track()
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        words = line.split()
        if len(words) != 8:
            raise ReportError(f"{path}:{number}: {len(words)} columns, must be 8")
        t, x, y, z, qx, qy, qz, qw = (float(word) for word in words)
        track.add(round(t * 1e9), (x, y, z), (qw, qx, qy, qz))
    return track


def camera_in_body(path: Path) -> np.ndarray:
    """Where the camera is in the body: the last column of T_BS in a sensor.yaml of EuRoC."""
    found = re.search(r"T_BS:.*?data:\s*\[([^\]]*)\]", path.read_text(), re.DOTALL)
    values = [] if found is None else [float(x) for x in found.group(1).split(",")]
    if len(values) != 16:
        raise ReportError(f"{path}: no T_BS with 16 numbers")
    return np.array([values[3], values[7], values[11]])


def at_times(known_ns, position: np.ndarray, time_ns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions at other times (linear), and where there are samples on both sides."""
    after = np.clip(np.searchsorted(known_ns, time_ns), 1, len(known_ns) - 1)
    t0, t1 = known_ns[after - 1], known_ns[after]
    inside = (time_ns >= t0) & (time_ns <= t1) & (t1 - t0 <= MAX_GAP_NS)
    part = ((time_ns - t0) / np.maximum(t1 - t0, 1))[:, None]
    return (1 - part) * position[after - 1] + part * position[after], inside


@dataclass
class Alignment:
    """to = scale R from + shift, in the least-squares sense (Umeyama 1991; upright: R is a turn about z)."""

    scale: float
    R: np.ndarray
    shift: np.ndarray

    def __call__(self, points: np.ndarray) -> np.ndarray:
        return self.scale * points @ self.R.T + self.shift


def align(source: np.ndarray, target: np.ndarray, metric: bool) -> Alignment:
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    if metric:  # gravity is known: heading and place are free
        sine = np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        angle = np.arctan2(sine, np.sum(a[:, :2] * b[:, :2]))
        c, s = np.cos(angle), np.sin(angle)
        R, scale = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), 1.0
    else:
        u, d, vt = np.linalg.svd(b.T @ a)
        sign = np.array([1, 1, np.linalg.det(u) * np.linalg.det(vt)])
        R = (u * sign) @ vt
        scale = float(np.sum(d * sign) / np.sum(a**2))
    return Alignment(scale, R, target.mean(axis=0) - scale * R @ source.mean(axis=0))


def rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))


@dataclass
class Comparison:
    time_ns: np.ndarray
    estimate: np.ndarray  # laid over the truth [m]; as it is where there is no truth
    truth: np.ndarray | None
    alignment: Alignment  # of the estimates' world with that of the truth
    moving: np.ndarray

    @property
    def error(self) -> np.ndarray:
        return np.linalg.norm(self.estimate - self.truth, axis=1)


def compare(run: Run, truth: Track, arm: np.ndarray, metric: bool) -> Comparison:
    """The body with an IMU, otherwise camera centres: an arm in metres does not fit an unknown scale."""
    time_ns, position, _ = (run.body if metric else run.camera).arrays()
    if run.anchored_ns is not None:  # before, the world was another one
        time_ns, position = time_ns[time_ns >= run.anchored_ns], position[time_ns >= run.anchored_ns]
    if len(truth.time_ns) < 2:
        identity = Alignment(1.0, np.eye(3), np.zeros(3))
        return Comparison(time_ns, position, None, identity, np.ones(len(time_ns), dtype=bool))
    truth_ns, truth_position, q_wxyz = truth.arrays()
    if not metric:
        truth_position = truth_position + rotate(q_wxyz, arm)
    wanted, inside = at_times(truth_ns, truth_position, time_ns)
    time_ns, position, wanted = time_ns[inside], position[inside], wanted[inside]
    if len(time_ns) < 10:
        raise ReportError(f"{len(time_ns)} estimates at times of the truth: too few to compare")
    speed = np.linalg.norm(np.gradient(wanted, axis=0), axis=1) / np.gradient(time_ns * 1e-9)
    width = max(1, round(0.5e9 / np.median(np.diff(time_ns))))
    moving = np.convolve(speed, np.ones(width) / width, mode="same") > MOVING_M_S
    fitted = moving if moving.sum() > 10 else np.ones_like(moving)
    alignment = align(position[fitted], wanted[fitted], metric)
    return Comparison(time_ns, alignment(position), wanted, alignment, moving)


def fixes_in_world(run: Run) -> np.ndarray:
    """East, north, up of the world's origin, or of the first fix; good to centimetres within a kilometre."""
    fixes = np.array(run.fixes)[:, 1:]
    latitude, longitude, altitude = fixes[0] if run.origin is None else run.origin
    east = (fixes[:, 1] - longitude) * np.cos(latitude) * EARTH_RADIUS_M
    flattening = 1 / 298.257223563
    e2 = flattening * (2 - flattening)
    w = 1 - e2 * np.sin(latitude) ** 2
    meridian = EARTH_RADIUS_M * (1 - e2) / w**1.5
    return np.column_stack([east / np.sqrt(w), (fixes[:, 0] - latitude) * meridian, fixes[:, 2] - altitude])


def decode(data: bytes) -> np.ndarray:
    message = loc.image_t.decode(data)
    if message.pixelformat == message.PIXEL_FORMAT_MJPEG:
        return np.asarray(Image.open(io.BytesIO(message.data)).convert("L"))
    channels = 1 if message.pixelformat == message.PIXEL_FORMAT_GRAY else 3
    rows = np.frombuffer(message.data, np.uint8).reshape(message.height, message.row_stride)
    rows = rows[:, : message.width * channels]
    return rows if channels == 1 else rows.reshape(message.height, message.width, 3)[..., 1]


def draw_picture(axes, run: Run, index: int) -> None:
    frame = run.frames[index]
    data = next((data for number, data in run.pictures if number == frame.sequence), None)
    if data is not None:
        axes.imshow(decode(data), cmap="gray", vmin=0, vmax=255)
    state = np.frombuffer(bytes(x & 0xFF for x in frame.feature_state), np.int8)
    measured = np.column_stack([frame.u_px, frame.v_px]).reshape(-1, 2)
    at = np.where(
        np.isfinite(measured),
        measured,
        np.column_stack([frame.predicted_u_px, frame.predicted_v_px]).reshape(-1, 2),
    )
    for values, label, colour in STATES:
        rows = np.isin(state, values)
        axes.scatter(*at[rows].T, s=22, facecolors="none", edgecolors=colour, lw=1.1, label=label)
    axes.set(xticks=[], yticks=[])
    axes.set_title(
        f"{run.seconds(frame.time_ns):.1f} s: {frame.measured} of {frame.visible} features used", fontsize=10
    )


def draw_from_above(axes, run: Run, comparison: Comparison) -> None:
    if comparison.truth is not None:
        axes.plot(*comparison.truth[:, :2].T, color="0.65", lw=4, label="truth")
    axes.plot(*comparison.estimate[:, :2].T, color="tab:blue", lw=1.3, label="estimate")
    low, high = comparison.estimate.min(axis=0), comparison.estimate.max(axis=0)
    if run.fixes and run.origin is not None:
        fixes = comparison.alignment(fixes_in_world(run))
        axes.plot(*fixes[:, :2].T, ".", color="tab:orange", ms=3, label="GPS", zorder=1)
    points = comparison.alignment(np.array(list(run.map_points.values())).reshape(-1, 3))
    reach = 0.5 * max(high - low)  # what is farther away would set the scale
    near = np.all((points > low - reach) & (points < high + reach), axis=1)
    if near.any():
        axes.plot(*points[near, :2].T, ".", color="tab:purple", ms=3, label="map")
    axes.set_aspect("equal", adjustable="datalim")
    unit = "" if comparison.truth is None and run.method != "inertial-slam" else " [m]"
    axes.set(xlabel=f"x{unit}", ylabel=f"y{unit}")
    axes.legend(fontsize=8, loc="best")
    axes.set_title("from above", fontsize=10)
    axes.grid(alpha=0.3)


def draw_over_time(axes, run: Run, comparison: Comparison) -> None:
    t = run.seconds(comparison.time_ns)
    if comparison.truth is not None:
        axes[0].plot(t, 100 * comparison.error, color="tab:red", lw=1)
        axes[0].set(ylabel="error [cm]", ylim=(0, None))
    else:
        axes[0].plot(t, comparison.estimate[:, 2], color="tab:blue", lw=1)
        axes[0].set(ylabel="z")
    frame_t = run.seconds([frame.time_ns for frame in run.frames])
    for name, label, colour in (
        ("map_size", "in the map", "k"),
        ("measured", "used", "tab:blue"),
        ("rejected", "not believed", "tab:red"),
    ):
        axes[1].plot(
            frame_t, [getattr(frame, name) for frame in run.frames], color=colour, lw=0.9, label=label
        )
    axes[1].set(ylabel="features", ylim=(0, None))
    axes[1].legend(fontsize=8, ncols=3, loc="upper left")
    spent = 1e3 * np.array([frame.time_spent_s for frame in run.frames])
    axes[2].plot(frame_t, spent, color="tab:green", lw=0.8)
    axes[2].set(ylabel="filter [ms]", xlabel="time [s]", ylim=(0, 1.2 * np.percentile(spent, 99.5)))
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.margins(x=0.01)


def errors(comparison: Comparison, metric: bool) -> list[tuple[str, str]]:
    moving, error = comparison.moving, comparison.error
    way = np.linalg.norm(np.diff(comparison.truth[:: max(1, len(error) // 500)], axis=0), axis=1).sum()
    seconds = (comparison.time_ns[-1] - comparison.time_ns[0]) * 1e-9
    fit = (
        "turned about the vertical, shifted" if metric else "turned, shifted, scaled: no metre without an IMU"
    )
    rows = [
        ("way, by the truth", f"{way:.2f} m in {seconds:.1f} s"),
        ("estimate laid over the truth", fit),
        ("position error, rms", f"{np.sqrt(np.mean(error**2)):.4f} m"),
    ]
    if 0.02 < moving.mean() < 0.98:
        share = f"{100 * moving.mean():.0f} % of the time"
        rows.append((f"  while it moves ({share})", f"{np.sqrt(np.mean(error[moving] ** 2)):.4f} m"))
    rows.append(("position error, largest", f"{error.max():.4f} m"))
    return rows


def sums(run: Run, comparison: Comparison, metric: bool) -> list[tuple[str, str]]:
    spent = 1e3 * np.array([frame.time_spent_s for frame in run.frames])
    rows = (
        errors(comparison, metric)
        if comparison.truth is not None
        else [("truth", "none, nothing to compare with")]
    )
    if run.fixes:
        if run.origin is None:
            rows.append(("GPS", f"{len(run.fixes)} fixes, not used"))
        else:
            known_ns, position, _ = run.body.arrays()
            since = known_ns >= run.anchored_ns
            times = np.array([fix[0] for fix in run.fixes], dtype=np.int64)
            here, inside = at_times(known_ns[since], position[since], times)
            fixes = fixes_in_world(run)
            rows.append(("GPS fixes against the estimate, rms", f"{rms(fixes[inside] - here[inside]):.2f} m"))
    rows.append(
        ("filter, median / 99 %", f"{np.median(spent):.2f} / {np.percentile(spent, 99):.2f} ms a frame")
    )
    if not metric and "latency.p50_ms" in run.latency_ms:  # sent at the camera's own pace
        latency = [run.latency_ms[f"latency.{name}_ms"] for name in ("p50", "p99")]
        rows.append(("picture to estimate, median / 99 %", f"{latency[0]:.1f} / {latency[1]:.1f} ms"))
    words = ", ".join(f"{word} ({count} s)" for word, count in sorted(run.conditions.items()))
    rows.append(("conditions while it ran", words or "none"))
    return rows


def draw(path: Path, title: str, run: Run, comparison: Comparison, rows) -> None:
    figure = plt.figure(figsize=(15, 10), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=(1, 1.5))
    panels = upper.subplots(1, SHOWN_PICTURES)
    places = np.linspace(0.15, 0.95, SHOWN_PICTURES)
    for axes, place in zip(panels, places, strict=True):
        draw_picture(axes, run, int(place * (len(run.frames) - 1)))
    upper.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(STATES), fontsize=9
    )
    left, right = lower.subfigures(1, 2, width_ratios=(1, 1.15))
    draw_from_above(left.subplots(), run, comparison)
    axes = right.subplots(4, 1, height_ratios=(1, 1, 1, 1.15))
    draw_over_time(axes[:3], run, comparison)
    axes[3].axis("off")
    axes[3].text(
        0,
        1,
        "\n".join(f"{name:<36}{text}" for name, text in rows),
        family="monospace",
        fontsize=8.5,
        va="top",
    )
    axes[0].sharex(axes[2])
    axes[1].sharex(axes[2])
    figure.suptitle(title)
    save(figure, path, dpi=90)


def report(arguments) -> None:
    live, replay = read(arguments.live), read(arguments.replay)
    print(check_replay(live, replay))
    metric = live.method == "inertial-slam"
    truth = live.truth if arguments.truth is None else read_tum(arguments.truth)
    arm = np.zeros(3) if arguments.camera is None else camera_in_body(arguments.camera)
    comparison = compare(live, truth, arm, metric)
    rows = sums(live, comparison, metric)
    draw(arguments.picture, arguments.title, live, comparison, rows)
    for name, text in rows:
        print(f"  {name:<42}{text}")


def main() -> int:
    parser = make_parser(__doc__)
    parser.add_argument("--truth", type=Path, help="TUM file with poses of the body, where the log has none")
    parser.add_argument(
        "--camera", type=Path, help="sensor.yaml of the camera (EuRoC): where it is in the body"
    )
    return demo_runs.run(report, parser)


if __name__ == "__main__":
    sys.exit(main())
