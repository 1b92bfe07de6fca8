"""The error-state filter on real recordings: fixes held out, and how far the covariance can be trusted.

    python tests/bench/compare_fusion.py --programs build/test/tools [--data DIR] [--log FILE] [--out DIR]

Goes the way of a user: each recording becomes a CSV file (or is an LCM log), `loc-estimator --method
error-state` makes a trajectory of it with its default preset, which is compared with what it has not seen:

    kitti   KITTI drive of GTSAM's examples, IMU 100 Hz, GPS 1 Hz: every second fix is held out
    euroc   EuRoC V1_01_easy, 30 s: real IMU 200 Hz; the fixes are the motion capture's positions, one a
            second, with 5 cm of seeded noise; compared with the motion capture at 20 Hz
    pntos   a drive of 43 minutes, VN-100 and ZED-F9T as recorded (--log; rig: the receiver's latency,
            -0.201 s); compared with the reference INS, whose world is another by a constant

Printed: errors of position (after the first 30 s; euroc 10 s; pntos 200 s, it is parked before), the
normalised error squared of position (of kitti the NIS of the fixes held out; 3 where the covariance is
right), and the estimator's counts.
"""

import argparse
import csv
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import libloc

CHECKOUT = Path(__file__).resolve().parents[2]
ORIGIN = (0.8556, 0.1467, 115.0)  # [rad, rad, m] anywhere: for fixes in local metres, which pass for RTK
KITTI_SIGMA = 0.5  # [m] of one component of a fix: with it the residuals fit, see the NIS
RIG = """format: libloc-rig-1
{imu}gps:
  antenna_in_body: [0, 0, 0]
  time_offset_s: {gps_offset_s}
  time_offset_sigma_s: {gps_offset_sigma_s}
...
"""
RIG_IMU = """imu:
  rate_hz: 0
  noise:
    gyroscope_noise_density: {0}
    gyroscope_random_walk: {1}
    accelerometer_noise_density: {2}
    accelerometer_random_walk: {3}
    gyroscope_bias_sigma: {4}
    accelerometer_bias_sigma: 0.2
    measured: [gyroscope_noise_density, gyroscope_random_walk, accelerometer_noise_density,
               accelerometer_random_walk, gyroscope_bias_sigma]
  gyroscope: {{bias: [0, 0, 0], matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}
  accelerometer: {{bias: [0, 0, 0], matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}
"""


@dataclass
class Case:
    """A recording for the estimator, and the positions in its world that it is to be compared with."""

    name: str
    recording: Path
    rig: str
    times_ns: np.ndarray
    positions: np.ndarray  # (N, 3) [m]
    skip_s: float = 30
    free_offset: bool = False  # the truth's world is another by a constant
    fix_sigma: float = 0  # deviation of the positions themselves, where they are fixes that were held out [m]


def write_csv(path: Path, imu: np.ndarray, fixes: np.ndarray, sigma: float) -> None:
    """imu: rows of time_ns, gyro, force; fixes: rows of time_ns, local metres."""
    world = libloc.LocalFrame(*ORIGIN)
    names = [
        "time_ns",
        *("gx [rad/s]", "gy [rad/s]", "gz [rad/s]", "ax [m/s^2]", "ay [m/s^2]", "az [m/s^2]"),
        *("latitude [rad]", "longitude [rad]", "altitude [m]"),
        *("sigma_e [m]", "sigma_n [m]", "sigma_u [m]", "fix"),
    ]
    rows: list[tuple[int, list[str]]] = [
        (int(r[0]), [str(int(r[0])), *(repr(float(x)) for x in r[1:]), "", "", "", "", "", "", ""])
        for r in imu
    ]
    for fix in fixes:
        place = world.to_geodetic(np.ascontiguousarray(fix[None, 1:], dtype=float))[0]
        cells = [
            str(int(fix[0])),
            "",
            "",
            "",
            "",
            "",
            "",
            *(repr(float(x)) for x in place),
            *[repr(sigma)] * 3,
            "6",
        ]
        rows.append((int(fix[0]), cells))
    rows.sort(key=lambda row: row[0])
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(cells for _, cells in rows)


def kitti(folder: Path, out: Path) -> Case:
    imu = np.loadtxt(folder / "KittiEquivBiasedImu.txt", skiprows=1)[1:]  # the first row is no sample
    gps = np.loadtxt(folder / "KittiGps_converted.txt", skiprows=1, delimiter=",")
    times = np.round(imu[:, 0] * 1e9)
    table = np.column_stack([times, imu[:, 5:8], imu[:, 2:5]])
    fixes = np.column_stack([np.round(gps[:, 0] * 1e9), gps[:, 1:]])
    fixes = fixes[(fixes[:, 0] > times[0]) & (fixes[:, 0] < times[-1])]
    used, held = fixes[::2], fixes[1::2]
    write_csv(out / "kitti.csv", table, used, KITTI_SIGMA)
    rig = RIG.format(
        imu=RIG_IMU.format(3e-3, 1e-5, 0.1, 1e-3, 0.01), gps_offset_s=0, gps_offset_sigma_s=0.001
    )
    return Case(
        "kitti", out / "kitti.csv", rig, held[:, 0].astype(np.int64), held[:, 1:], fix_sigma=KITTI_SIGMA
    )


def euroc(folder: Path, out: Path) -> Case:
    times, table = [], []
    with (folder / "tracks_and_imu.csv").open() as file:
        for row in csv.DictReader(file):
            if row["row_type"] == "imu":
                times.append(row["t_abs"])
                table.append([float(row[c]) for c in ("gx", "gy", "gz", "ax", "ay", "az")])
    times_ns = np.array([round(float(t) * 1e9) for t in times], dtype=np.int64)
    truth = np.loadtxt(folder / "groundtruth_20hz.tum")
    truth_ns = np.round(truth[:, 0] * 1e9).astype(np.int64)
    inside = (truth_ns > times_ns[0]) & (truth_ns < times_ns[-1])
    truth, truth_ns = truth[inside], truth_ns[inside]
    rng = np.random.default_rng(1)
    fixes = truth[::20, 1:4] + 0.05 * rng.standard_normal((len(truth[::20]), 3))
    write_csv(
        out / "euroc.csv",
        np.column_stack([times_ns, np.array(table)]),
        np.column_stack([truth_ns[::20], fixes]),
        0.05,
    )
    rig = RIG.format(
        imu=RIG_IMU.format(1.7e-4, 2e-5, 2e-3, 3e-3, 0.1), gps_offset_s=0, gps_offset_sigma_s=0.001
    )  # EuRoC's sensor.yaml
    return Case("euroc", out / "euroc.csv", rig, truth_ns, truth[:, 1:4], skip_s=10)


def pntos(log: Path) -> Case:
    reference = libloc.read_recording(str(log)).reference
    every = slice(None, None, 20)
    rig = RIG.format(imu="", gps_offset_s=-0.201, gps_offset_sigma_s=0.02)
    return Case(
        "pntos", log, rig, reference.times_ns[every], reference.position[every], skip_s=200, free_offset=True
    )


def run(case: Case, programs: Path, out: Path, options: list[str]) -> None:
    rig, result = out / f"{case.name}.yaml", out / f"{case.name}_estimate.csv"
    rig.write_text(case.rig)
    command = [
        programs / "loc-estimator",
        "--method",
        "error-state",
        "--config",
        rig,
        "--input",
        case.recording,
    ]
    done = subprocess.run(
        [*command, "--output", result, *options], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        sys.exit(f"{case.name}: loc-estimator failed\n{done.stderr}")
    with result.open() as file:
        names = file.readline().strip().split(",")
    estimate = np.loadtxt(result, delimiter=",", skiprows=1, converters=lambda x: float(x or "nan"))
    column = {name: i for i, name in enumerate(names)}
    times = np.loadtxt(result, delimiter=",", skiprows=1, usecols=0, dtype=np.int64)
    position = estimate[:, [column["px_m"], column["py_m"], column["pz_m"]]]
    sigma = estimate[:, [column["sigma_px_m"], column["sigma_py_m"], column["sigma_pz_m"]]]
    origin = [estimate[-1, column[f"origin_{n}"]] for n in ("latitude_rad", "longitude_rad", "altitude_m")]

    begin = times[0] + round(case.skip_s * 1e9)
    wanted = (case.times_ns >= begin) & (case.times_ns <= times[-1])
    at = (case.times_ns[wanted] - times[0]).astype(float)
    seconds = (times - times[0]).astype(float)
    found = np.stack([np.interp(at, seconds, position[:, i]) for i in range(3)], axis=1)
    deviation = np.stack([np.interp(at, seconds, sigma[:, i]) for i in range(3)], axis=1)
    truth = case.positions[wanted]
    if not case.free_offset:  # metres of ORIGIN to metres of the estimate's world
        geodetic = libloc.LocalFrame(*ORIGIN).to_geodetic(np.ascontiguousarray(truth))
        truth = libloc.LocalFrame(*origin).to_local(np.ascontiguousarray(geodetic))
    error = found - truth
    if case.free_offset:
        shift = np.median(error, axis=0)
        error -= shift
        print(f"{case.name}: constant between the worlds (median) {np.round(shift, 2)} m, taken out")
    horizontal = np.linalg.norm(error[:, :2], axis=1)
    rms = np.sqrt(np.mean(horizontal**2))
    middle, most, worst = np.quantile(horizontal, (0.5, 0.95, 1))
    print(f"{case.name}: {len(error)} positions; vertical rms {np.sqrt(np.mean(error[:, 2] ** 2)):.3f} m")
    print(
        f"{case.name}: horizontal rms {rms:.3f}, median {middle:.3f}, 95 % {most:.3f}, largest {worst:.3f} m"
    )
    # Of the diagonal: the CSV has no correlations.
    normalised = np.sum(error**2 / (deviation**2 + case.fix_sigma**2), axis=1)
    name = "NIS of the fixes held out" if case.fix_sigma else "normalised error squared"
    print(f"{case.name}: {name}, of 3: mean {normalised.mean():.2f}, median {np.median(normalised):.2f}")
    counts = re.search(r"imu\.used=.*", done.stderr)
    print(f"{case.name}: {counts.group(0) if counts else done.stderr}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    default = Path(os.environ.get("LIBLOC_DATA", CHECKOUT.parent / "shared" / "data"))
    parser.add_argument("--data", type=Path, default=default, help="folder of the recordings")
    parser.add_argument(
        "--log", type=Path, default=os.environ.get("LIBLOC_PNTOS_LOG"), help="pntOS's LCM log"
    )
    parser.add_argument("--programs", type=Path, default=CHECKOUT / "build" / "test" / "tools")
    parser.add_argument(
        "--out", type=Path, default=CHECKOUT / "build" / "compare_fusion", help="folder for files"
    )
    parser.add_argument("options", nargs="*", help="further options of loc-estimator, after --")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    found = 0
    for name, make in (("kitti-imu-gps", kitti), ("euroc-v101-tracks", euroc)):
        if (arguments.data / name).is_dir():
            run(
                make(arguments.data / name, arguments.out),
                arguments.programs,
                arguments.out,
                arguments.options,
            )
            found += 1
        else:
            print(f"{name}: not in {arguments.data}")
    if arguments.log and arguments.log.is_file():
        run(pntos(arguments.log), arguments.programs, arguments.out, arguments.options)
        found += 1
    else:
        print("pntos: no log (--log, LIBLOC_PNTOS_LOG)")
    if not found:
        sys.exit("none of the recordings is there")


if __name__ == "__main__":
    main()
