"""GTSAM's EqVIO filter on a recording of tracks and IMU in its own form: the peer of compare_slam.py.

    python tests/bench/peer_eqvio.py tracks_and_imu.csv trajectory.tum [--begin SECONDS]

Needs gtsam 4.3 and NumPy alone, so that it can run in an environment of its own (gtsam is particular about
NumPy's version). The filter gets what GTSAM's own example gives it: parameters and covariances of the meta
rows, the camera's pose as the start of its estimate, every frame's features in normalised coordinates,
readings held until the next one. It takes the attitude from the first reading, as of a body at rest. The
frame at the time of that reading is used; the example leaves it out (--without-first), for in the file it
stands before the reading.

The trajectory has the time as the file writes it and the position of the IMU; GTSAM's bindings do not give
the attitude, its quaternion is the unit one. Printed: one line of JSON with the number of frames and the CPU
time of predict() and update() together. Exit code 3: gtsam, or what it needs, cannot be imported.
"""

import argparse
import csv
import json
import sys
import time
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

NOT_IMPORTABLE = 3
PARAMETERS = {
    "initialPointDepth": "initial_point_depth",
    "initialPointVariance": "initial_point_variance",
    "outlierThresholdAbs": "outlier_threshold_abs_norm",
    "featureRetention": "feature_retention",
    "biasOmegaProcessVariance": "process_var_bias_omega",
    "biasAccelProcessVariance": "process_var_bias_accel",
    "attitudeProcessVariance": "process_var_attitude",
    "positionProcessVariance": "process_var_position",
    "velocityProcessVariance": "process_var_velocity",
    "cameraAttitudeProcessVariance": "process_var_cam_attitude",
    "cameraPositionProcessVariance": "process_var_cam_position",
    "pointProcessVariance": "process_var_point",
}
INPUT_NOISE = ("input_var_gyr", "input_var_acc", "input_var_gyr_bias_walk", "input_var_acc_bias_walk")
START = (
    *("initial_var_bias_omega", "initial_var_bias_accel", "initial_var_attitude", "initial_var_position"),
    *("initial_var_velocity", "initial_var_cam_attitude", "initial_var_cam_position"),
)


@dataclass
class Frame:
    time: str  # as it is written
    features: dict[int, tuple[float, float]] = field(default_factory=dict)


@dataclass
class Recording:
    meta: dict[str, str]
    imu: list[tuple[float, list[float], list[float]]]  # time [s], gyro [rad/s], force [m/s^2]
    frames: list[Frame]

    def number(self, key: str) -> float:
        return float(self.meta[key])

    def eqf(self, key: str) -> float:
        return self.number(f"eqf.{key}")


def read(path: Path, begin_s: float) -> Recording:
    """What is begin_s or more after the first time. Raises KeyError, ValueError for another form of file."""
    out = Recording({}, [], [])
    first, number = None, None
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            if row["row_type"] == "meta":
                out.meta[row["key"]] = row["value"]
                continue
            t = float(row["t_abs"])
            first = t if first is None else first
            if t < first + begin_s - 1e-6:
                continue
            if row["row_type"] == "imu":
                gyro, force = ([float(row[s + axis]) for axis in "xyz"] for s in "ga")
                out.imu.append((t, gyro, force))
                continue
            if row["frame_idx"] != number:
                number = row["frame_idx"]
                out.frames.append(Frame(row["t_abs"]))
            pixel = (float(row["u_norm"]), float(row["v_norm"]))
            out.frames[-1].features[int(row["landmark_id"])] = pixel
    return out


def run(recording: Recording, without_first: bool) -> tuple[list[tuple[str, list[float]]], float]:
    """Times with positions, and the CPU seconds of the filter."""
    import gtsam
    import numpy as np
    from gtsam_unstable import eqvio

    parameters = eqvio.EqVIOFilterParams()
    for name, key in PARAMETERS.items():
        setattr(parameters, name, recording.eqf(key))
    parameters.inputNoise = np.diag(np.repeat([recording.eqf(key) for key in INPUT_NOISE], 3))
    reference = eqvio.State()
    rotation = gtsam.Rot3.Quaternion(*(recording.number(f"T_ci_q{axis}") for axis in "wxyz"))
    translation = np.array([recording.number(f"T_ci_t{axis}") for axis in "xyz"])
    reference.cameraOffset = gtsam.Pose3(rotation, translation)
    covariance = np.diag(np.repeat([recording.eqf(key) for key in START], 3))
    filter_ = eqvio.EqVIOFilter(reference, covariance, [], parameters)
    camera = gtsam.PinholeCameraCal3_S2(gtsam.Pose3(), gtsam.Cal3_S2(1, 1, 0, 0, 0))
    variance = recording.eqf("measurement_noise_variance_norm")

    inputs = []
    for t, gyro, force in recording.imu:
        one = eqvio.IMUInput()
        one.stamp, one.gyr, one.acc = t, np.array(gyro), np.array(force)
        inputs.append(one)
    times = [t for t, _, _ in recording.imu]
    filter_.initializeFromIMU(inputs[0])
    now, held = times[0], 0  # inputs[held] is the reading that holds at time now
    positions, seconds = [], 0.0
    for frame in recording.frames:
        t = float(frame.time)
        if t < times[0] or (without_first and t == times[0]):
            continue
        steps = []
        while now < t:
            end = min(t, times[held + 1]) if held + 1 < len(times) else t
            if end > now:
                steps.append((inputs[held], end - now))
                now = end
            if held + 1 < len(times) and times[held + 1] <= now:
                held += 1
        features = {id_: np.array(pixel) for id_, pixel in frame.features.items()}
        noise = variance * np.eye(2 * len(features))
        began = time.process_time()
        for one, dt in steps:
            filter_.predict(one, dt)
        filter_.update(features, camera, noise)
        seconds += time.process_time() - began
        positions.append((frame.time, [float(x) for x in filter_.position()]))
    return positions, seconds


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("input", type=Path, metavar="CSV")
    parser.add_argument("output", type=Path, metavar="TUM")
    parser.add_argument(
        "--begin", type=float, default=0, metavar="SECONDS", help="after the file's first time"
    )
    parser.add_argument("--without-first", action="store_true", help="frame")
    arguments = parser.parse_args()
    try:
        from gtsam_unstable import eqvio  # noqa: F401
    except ImportError as error:
        print(f"peer_eqvio: {error}: needs the PyPI package gtsam, 4.3.0 or newer", file=sys.stderr)
        return NOT_IMPORTABLE
    positions, seconds = run(read(arguments.input, arguments.begin), arguments.without_first)
    lines = [" ".join([t, *(repr(x) for x in p), "0 0 0 1"]) for t, p in positions]
    arguments.output.write_text("\n".join(lines) + "\n")
    print(json.dumps({"version": version("gtsam"), "frames": len(positions), "cpu_s": seconds}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
