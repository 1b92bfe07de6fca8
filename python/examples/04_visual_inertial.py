"""The example "Visual-Inertial Odometry Using Synthetic Data": a simulated drive, IMU and odometry fused.

Writes summary.png, drive.mp4 (needs the package av; --video drive.gif and --video none do not) and, with
--rerun, drive.rrd (package rerun-sdk) into the folder --output. The same from LCM logs: loc-animate.
"""

import argparse
import sys
from pathlib import Path

import libloc
from libloc import driving


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--duration", type=float, default=60.0)
    parser.add_argument("--preset", choices=("16", "19"), default="19")
    parser.add_argument("--output", type=Path, default=Path("visual_inertial"))
    parser.add_argument("--video", default="drive.mp4")
    parser.add_argument("--rerun", action="store_true")
    options = parser.parse_args()
    try:
        simulated = libloc.simulate("vio-example", options.seed, duration_s=options.duration)
        imu, vo, truth = simulated.recording.imu, simulated.recording.odometry, simulated.truth
        preset = libloc.FusionPreset.by_name(options.preset)
        fusion = libloc.ErrorStateFilter(preset.options)
        start = truth.q_world_body_wxyz[0], truth.position[0], truth.velocity[0]
        fusion.start(int(imu.times_ns[0]), preset.start_cov, *start)
        result = fusion.run(
            *(imu.times_ns, imu.angular_velocity, imu.specific_force),
            odometry_times_ns=vo.times_ns,
            odometry_position=vo.position,
            odometry_position_cov=preset.odometry_position_cov,
            odometry_wxyz=vo.q_wxyz,
            odometry_orientation_cov=preset.odometry_orientation_cov,
        )
        run = driving.run_of_filter(imu.times_ns, result, truth, vo)
        print(f"position rmse: fused {run.position_rmse:.3f} m, odometry / scale {run.odometry_rmse:.3f} m")
        print(f"scale: {result.scale[-1]:.4f}, error {100 * run.scale_error:.3f} %")
        options.output.mkdir(parents=True, exist_ok=True)
        driving.save_summary(run, options.output / "summary.png", f"preset {options.preset}")
        scene = driving.scene_along(run.truth.position)
        if options.rerun:
            driving.save_rerun(run, scene, options.output / "drive.rrd", overwrite=True)
        if options.video != "none":
            driving.animate(run, scene, options.output / options.video, overwrite=True)
        print(f"wrote {options.output}")
    except (ValueError, OSError, driving.MissingPackageError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
