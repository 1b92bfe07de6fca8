"""Orientation from a recording, and how good it is.

    python 01_orientation.py RECORDING [--preset report] [--world ENU] [--output DIR]

RECORDING: a BROAD trial (.mat), a EuRoC folder, an LCM log, or a CSV file of your own whose first line names
columns and units: time_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2 and, if there is a magnetometer,
mx_ut,my_ut,mz_ut. With a reference orientation in it (qw,qx,qy,qz) the error is computed, too.
"""

import argparse
import sys
from pathlib import Path

import matplotlib

import libloc

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot as plt


def compare(recording: libloc.Recording, q_wxyz: np.ndarray, magnetic: bool):
    """Times and errors where the reference has a pose at the time of an IMU sample; None when nowhere."""
    reference = recording.reference
    times_ns, i, j = np.intersect1d(recording.imu.times_ns, reference.times_ns, return_indices=True)
    if not len(i):
        return None
    error = libloc.orientation_error(
        np.ascontiguousarray(q_wxyz[i]),
        np.ascontiguousarray(reference.q_world_body_wxyz[j]),
        np.ascontiguousarray(reference.score[j]),
        # Without magnetometer the heading is relative to the start: take out what it differs by on average.
        align_heading=not magnetic,
    )
    return times_ns, error


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=Path)
    parser.add_argument("--preset", choices=("robust", "report"), default="robust")
    parser.add_argument("--world", choices=("ENU", "NWU", "NED"), default="ENU")
    parser.add_argument("--output", type=Path, default=Path(), help="folder for orientation.png")
    options = parser.parse_args()

    try:
        recording = libloc.read_recording(options.recording)
    except libloc.DataError as error:
        print(error, file=sys.stderr)
        return 1
    imu, magnetometer = recording.imu, recording.magnetometer
    if not len(imu.times_ns):
        print(f"{options.recording}: no IMU samples in it", file=sys.stderr)
        return 1
    filter_ = libloc.MadgwickFilter(libloc.MadgwickOptions.preset(options.preset, world=options.world))
    result = filter_.run(
        imu.times_ns,
        imu.angular_velocity,
        imu.specific_force,
        magnetometer.magnetic_field,
        magnetometer.times_ns,
    )
    magnetic = len(magnetometer.times_ns) > 0
    print(f"{len(imu.times_ns)} IMU and {len(magnetometer.times_ns)} magnetometer samples")
    for name, count in filter_.counts().items():
        print(f"  {name}: {count}")
    bias = np.rad2deg(filter_.gyroscope_bias)
    print(f"gyroscope bias at the end: {bias[0]:.3f} {bias[1]:.3f} {bias[2]:.3f} deg/s")

    def seconds(times_ns: np.ndarray) -> np.ndarray:
        return (times_ns - imu.times_ns[0]) * 1e-9

    compared = compare(recording, result.q_world_body_wxyz, magnetic)
    figure, axes = plt.subplots(
        2 if compared else 1, 1, figsize=(11, 6), sharex=True, squeeze=False, layout="constrained"
    )
    top, bottom = axes[0, 0], axes[-1, 0]
    top.plot(seconds(imu.times_ns), result.q_world_body_wxyz, lw=0.8, label=["qw", "qx", "qy", "qz"])
    top.set_ylabel("q_world_body")
    top.legend(loc="upper right", ncols=4)
    if compared:
        times_ns, error = compared
        removed = "" if magnetic else f" (heading offset {np.rad2deg(error.heading_offset):.2f} deg removed)"
        print(f"rmse over {error.scored} samples{removed}:")
        for name in ("total", "heading", "inclination"):
            print(f"  {name}: {np.rad2deg(getattr(error, f'{name}_rmse')):.3f} deg")
        for name in ("heading", "inclination"):
            bottom.plot(seconds(times_ns), np.rad2deg(getattr(error, name)), lw=0.8, label=name)
        bottom.set_ylabel("error [deg]")
        bottom.legend(loc="upper right", ncols=2)
    else:
        print("no reference orientation at the times of the IMU: nothing to compare with")
    bottom.set_xlabel("time [s]")
    options.output.mkdir(parents=True, exist_ok=True)
    figure.savefig(options.output / "orientation.png", dpi=110)
    print(f"wrote {options.output / 'orientation.png'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
