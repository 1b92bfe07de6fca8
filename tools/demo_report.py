"""What tools/demo shows: live and replayed estimates are the same, errors against the reference, a picture.

    demo_report.py --live live.log --replay replay.log --picture orientation.png --title TEXT

The logs hold the LCM types of msgs/ (Python package `loc`). Exit code 1 when the estimates differ or messages
are missing.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

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
    run,
    save,
    without_host_times,
)


@dataclass
class Orientations:
    time_ns: np.ndarray  # (N,) int64
    q_world_body_wxyz: np.ndarray  # (N, 4)

    def seconds_since(self, start_ns: int) -> np.ndarray:
        return (self.time_ns - start_ns) * 1e-9


@dataclass
class Recording:
    estimates: Orientations
    reference: Orientations
    estimate_bytes: list[bytes]  # without the two host times, which differ from run to run
    imu_count: int
    published_imu: int | None  # as the driver says


def read(path: Path) -> Recording:
    estimate_rows, reference_rows, estimate_bytes, imu_count, sent = [], [], [], 0, None
    for event in events(path):
        if event.channel == "LOC_ESTIMATE":
            estimate_bytes.append(without_host_times(event.data))
            message = loc.estimate_t.decode(event.data)
            if message.valid & loc.estimate_t.VALID_ORIENTATION:
                estimate_rows.append((message.time_ns, message.q_world_body_wxyz))
        elif event.channel == "LOC_REFERENCE":
            message = loc.reference_t.decode(event.data)
            if message.score:
                reference_rows.append((message.time_ns, message.q_world_body_wxyz))
        elif event.channel == "LOC_IMU":
            imu_count += 1
        elif event.channel == "LOC_SOURCE_STATUS":
            sent = published(event.data, "imu")
    if not estimate_rows:
        raise ReportError(f"{path}: no estimate with an orientation in it")
    return Recording(
        orientations(estimate_rows), orientations(reference_rows), estimate_bytes, imu_count, sent
    )


def orientations(rows) -> Orientations:
    time_ns = np.array([row[0] for row in rows], dtype=np.int64)
    return Orientations(time_ns, np.array([row[1] for row in rows], dtype=float).reshape(-1, 4))


def check_replay(live: Recording, replay: Recording) -> str:
    """Same estimates, bit for bit, and nothing lost on the way. Returns a sentence for the user."""
    check_logged("IMU samples", live.published_imu, live.imu_count)
    return check_same(live.estimate_bytes, replay.estimate_bytes, f"{live.imu_count} IMU samples")


# Quaternions below are (N, 4) or (4,), w first, Hamilton.
def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    a, b = np.atleast_2d(a), np.atleast_2d(b)
    w, v, u, x = a[:, :1], a[:, 1:], b[:, :1], b[:, 1:]
    return np.hstack([w * u - np.sum(v * x, axis=1, keepdims=True), w * x + u * v + np.cross(v, x)])


def conjugate(q: np.ndarray) -> np.ndarray:
    return q * [1.0, -1.0, -1.0, -1.0]


def interpolate(reference: Orientations, time_ns: np.ndarray, max_gap_ns: int = 100_000_000):
    """Reference at the given times (normalised linear), and where there are samples within max_gap."""
    after = np.clip(np.searchsorted(reference.time_ns, time_ns), 1, len(reference.time_ns) - 1)
    t0, t1 = reference.time_ns[after - 1], reference.time_ns[after]
    inside = (time_ns >= t0) & (time_ns <= t1) & (t1 - t0 <= max_gap_ns)
    part = ((time_ns - t0) / (t1 - t0))[:, None]
    q0, q1 = reference.q_world_body_wxyz[after - 1], reference.q_world_body_wxyz[after]
    q1 = np.where(np.sum(q0 * q1, axis=1, keepdims=True) < 0, -q1, q1)
    q = (1 - part) * q0 + part * q1
    return q / np.linalg.norm(q, axis=1, keepdims=True), inside


def vertical_in_body(q: np.ndarray) -> np.ndarray:
    """The world's z axis in body axes, averaged."""
    z = multiply(multiply(conjugate(q), np.array([0.0, 0, 0, 1])), q)[:, 1:].mean(axis=0)
    return z / np.linalg.norm(z)


def rotation_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Smallest rotation that takes unit vector a to b."""
    q = np.hstack([1 + a @ b, np.cross(a, b)])
    return q / np.linalg.norm(q)


def errors(q_estimate: np.ndarray, q_reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Heading error (signed, unwrapped) and inclination error [rad], split as BROAD defines them."""
    e = multiply(q_estimate, conjugate(q_reference))
    heading = np.unwrap(2 * np.arctan2(e[:, 3], e[:, 0]))
    inclination = 2 * np.arccos(np.clip(np.hypot(e[:, 0], e[:, 3]), 0, 1))
    return heading, inclination


def euler_deg(q: np.ndarray, z_down: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch, heading (unwrapped), Rz Ry Rx; with the world turned to north-east-down for z_down."""
    if z_down:
        q = multiply(np.array([0, 0.5**0.5, 0.5**0.5, 0]), q)  # east-north-up to north-east-down
    w, x, y, z = q.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    yaw = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    return np.degrees(roll), np.degrees(pitch), np.degrees(yaw)


def draw(path: Path, title: str, t, q_estimate, q_reference, heading, inclination) -> None:
    z_down = vertical_in_body(q_reference[:1])[2] < 0
    estimated, truth = euler_deg(q_estimate, z_down), euler_deg(q_reference, z_down)
    figure, axes = plt.subplots(4, 1, sharex=True, figsize=(9.5, 8), layout="constrained")
    every = max(1, len(t) // 4000)
    for axis, name, a, b in zip(axes, ("roll", "pitch", "heading"), estimated, truth, strict=False):
        b = b + 360 * np.round((a - b).mean() / 360)
        axis.plot(t[::every], b[::every], color="0.6", linewidth=2.5, label="reference")
        axis.plot(t[::every], a[::every], color="tab:blue", linewidth=0.9, label="estimate")
        axis.set_ylabel(f"{name} [deg]")
    axes[0].legend(loc="upper left", ncols=2)
    axes[3].plot(
        t[::every], np.degrees(inclination[::every]), color="tab:red", linewidth=0.9, label="inclination"
    )
    axes[3].plot(t[::every], np.degrees(heading[::every]), color="tab:green", linewidth=0.9, label="heading")
    axes[3].set_ylabel("error [deg]")
    axes[3].set_xlabel("time [s]")
    axes[3].legend(loc="upper left", ncols=2)
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.margins(x=0.01)
    figure.suptitle(title)
    save(figure, path, dpi=100)


def report(arguments) -> None:
    live, replay = read(arguments.live), read(arguments.replay)
    print(check_replay(live, replay))
    if len(live.reference.time_ns) < 2:
        raise ReportError(f"{arguments.live}: no reference to compare with")
    q_reference, inside = interpolate(live.reference, live.estimates.time_ns)
    start_ns = live.estimates.time_ns[0]
    t = live.estimates.seconds_since(start_ns)[inside]
    q_estimate, q_reference = live.estimates.q_world_body_wxyz[inside], q_reference[inside]

    if arguments.mounting:
        first, last = arguments.mounting
        still = (t >= first) & (t <= last)
        mounting = rotation_between(vertical_in_body(q_reference[still]), vertical_in_body(q_estimate[still]))
        q_estimate = multiply(q_estimate, mounting)
        angle = np.degrees(2 * np.arccos(min(1.0, abs(mounting[0]))))
        print(
            f"mounting: the reference's box is tilted {angle:.2f} deg against the IMU's;"
            f" measured while parked ({first:.0f} to {last:.0f} s) and taken out"
        )
    heading, _ = errors(q_estimate, q_reference)
    # Six axes know no north: the heading is relative, so it is set equal over the first seconds.
    offset = heading[t < t[0] + 5].mean()
    q_estimate = multiply(np.array([np.cos(offset / 2), 0, 0, -np.sin(offset / 2)]), q_estimate)
    heading, inclination = errors(q_estimate, q_reference)
    heading -= heading[t < t[0] + 5].mean()

    rows = [
        ("inclination error, rms", np.degrees(np.sqrt(np.mean(inclination**2))), "deg"),
        ("inclination error, largest", np.degrees(inclination.max()), "deg"),
        ("heading error, rms", np.degrees(np.sqrt(np.mean(heading**2))), "deg"),
        (
            f"heading drift at the end ({(t[-1] - t[0]) / 60:.1f} min)",
            np.degrees(heading[-100:].mean()),
            "deg",
        ),
    ]
    draw(arguments.picture, arguments.title, t, q_estimate, q_reference, heading, inclination)
    print("No magnetometer in this recording: the heading is relative to the start and drifts.")
    for name, value, unit in rows:
        print(f"  {name:<42}{value:8.2f} {unit}")


def main() -> int:
    parser = make_parser(__doc__)
    parser.add_argument(
        "--mounting",
        type=float,
        nargs=2,
        metavar=("FROM", "TO"),
        help="standstill [s] from which the tilt between IMU and reference is taken",
    )
    return run(report, parser)


if __name__ == "__main__":
    sys.exit(main())
