"""SLAM on real tracks that are spoilt: EuRoC V1_01_easy, 30 s of tracked features with IMU.

    python tests/bench/compare_slam_robustness.py [--data DIR] [--seeds N] [--json FILE]

Runs the inertial form and the camera alone on the tracks as they are, with 10 % of the observations anywhere
in the picture, with 20 % of the frames missing, and with 2 s without a feature (after the first 2 s; the last
one in the middle), and compares with the motion capture: position error after the best SE(3) (inertial) or
Sim(3) (camera alone) alignment, its largest value, and what it is in relation to the clean run, of which at
most 2 is required. The first two spoil at random: --seeds runs of each, of which the mean and the worst are
shown. flagged: share of the frames after which the estimator says FEW_FEATURES; of those without a feature.
"""

import argparse
import json
import os
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from libloc.programs.study_monoslam_cases import SPOILT
from libloc.programs.study_monoslam_worlds import Tracks, spoil

import libloc

CHECKOUT = Path(__file__).resolve().parents[2]
SIGMA_PX = 2.0  # what NIS says of these tracks
RATIO = 2.0


@dataclass
class Run:
    method: str
    spoilt: str
    seed: int
    estimates: int
    rmse_m: float
    max_m: float
    scale: float
    nis_per_dim: float
    flagged: float
    flagged_dark: float | None


def options_of(method: str, camera: libloc.CameraCalibration) -> libloc.SlamOptions:
    options = libloc.SlamOptions()
    options.camera = camera
    options.sigma_px = SIGMA_PX
    options.override_sigma = True
    options.motion = libloc.SlamMotion.INERTIAL
    if method == "camera":
        options.motion = libloc.SlamMotion.CONSTANT_VELOCITY
        options.acceleration_density, options.angular_acceleration_density = 2.0, 3.0  # of a small drone
    return options


def run_once(
    method: str,
    spoilt: str,
    seed: int,
    recording: libloc.Recording,
    camera: libloc.CameraCalibration,
    truth: libloc.Trajectory,
) -> Run:
    f, imu = recording.features, recording.imu
    tracks = spoil(Tracks(f.times_ns, f.first, f.id, f.pixel_px), camera, spoilt, seed)
    frames = (tracks.times_ns, tracks.first, tracks.id, tracks.pixel_px)
    options = options_of(method, camera)
    if method == "camera":
        result = libloc.MonoSlam(options).run(*frames)
    else:
        slam = libloc.InertialSlam(options)
        result = slam.run(*frames, imu.times_ns, imu.angular_velocity, imu.specific_force)
    estimate = libloc.Trajectory(result.time_ns, result.q_world_body_wxyz, result.position)
    pairs = libloc.associate(estimate, truth)
    error = libloc.absolute_error(pairs.estimate, pairs.reference, "sim3" if method == "camera" else "se3")
    similar = libloc.absolute_error(pairs.estimate, pairs.reference, "sim3")
    few = (np.asarray(result.status) & int(libloc.EstimateStatus.FEW_FEATURES)) != 0
    dark = np.asarray(result.counts["in_frame"]) == 0
    return Run(
        method,
        spoilt or "clean",
        seed,
        len(result.time_ns),
        error.translation.rmse,
        error.translation.max,
        similar.alignment.scale,
        float(np.sum(result.nis) / np.sum(result.nis_dim)),
        float(np.mean(few)),
        float(np.mean(few[dark])) if dark.any() else None,
    )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    default = Path(os.environ.get("LIBLOC_DATA", CHECKOUT.parent / "shared" / "data"))
    parser.add_argument("--data", type=Path, default=default / "euroc-v101-tracks", metavar="DIR")
    parser.add_argument("--seeds", type=int, default=5, metavar="N")
    parser.add_argument("--json", type=Path, metavar="FILE")
    arguments = parser.parse_args()
    try:
        source = libloc.open_eqvio(arguments.data / "tracks_and_imu.csv")
        camera = source.rig.cameras[0]
        recording = source.read_all()
        truth = libloc.read_tum(arguments.data / "groundtruth_20hz.tum")[0]
    except (libloc.DataError, OSError) as error:
        print(f"compare_slam_robustness: {error}", file=sys.stderr)
        return 1
    runs = []
    print(f"{'':10}{'':32}runs  error, m (worst)   largest, m  of clean (worst)  scale   flagged, dark")
    for method in ("inertial", "camera"):
        clean = float("nan")
        for spoilt, label in {"": "as it is", **SPOILT}.items():
            seeds = range(1, 1 + (arguments.seeds if spoilt in ("outliers", "dropped") else 1))
            group = [run_once(method, spoilt, seed, recording, camera, truth) for seed in seeds]
            runs += group
            rmse = np.array([one.rmse_m for one in group])
            if not spoilt:
                clean = float(rmse[0])
            dark = "" if group[0].flagged_dark is None else f", {100 * group[0].flagged_dark:.0f} %"
            verdict = "held    " if rmse.max() <= RATIO * clean else "NOT HELD"
            print(
                f"{method:10}{label:32}{len(group):4d}  {rmse.mean():.4f} ({rmse.max():.4f})    "
                f"{max(one.max_m for one in group):.4f}      {rmse.mean() / clean:.2f} "
                f"({rmse.max() / clean:.2f}) {verdict}  {group[0].scale:.4f}  "
                f"{100 * max(one.flagged for one in group):.0f} %{dark}"
            )
    if arguments.json:
        arguments.json.write_text(json.dumps([asdict(one) for one in runs], indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
