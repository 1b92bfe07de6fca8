"""Hard and soft iron of a magnetometer from readings of a device that was turned about, and a picture of it.

    python 03_calibrate_magnetometer.py [RECORDING] [--method robust] [--field-ut UT] [--output DIR]

RECORDING: anything that holds a magnetometer (see 01_orientation.py); without it, readings are made up, with
outliers among them, and the result is compared with the truth. Writes spheres.png and rig.yaml, which
estimators read: loc-estimator --config rig.yaml. The program for daily use, with units, reports and live
collecting: loc-calibrate.
"""

import argparse
import sys
from pathlib import Path

import matplotlib

import libloc

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot as plt

FIELD = 48e-6  # [T], what the made-up readings have


def made_up_readings() -> tuple[np.ndarray, np.ndarray]:
    """Readings (N, 3) [T] over 60 % of the sphere, one in twenty disturbed; and the true centre."""
    random = libloc.Random(3)
    directions = random.direction(2000)
    directions = directions[directions[:, 2] > -0.2]
    soft_iron = np.array([[1.12, 0.04, -0.02], [0.04, 0.95, 0.03], [-0.02, 0.03, 0.9]])
    centre = np.array([18e-6, -25e-6, 9e-6])
    readings = centre + FIELD * (directions @ soft_iron + 0.005 * random.normal3(len(directions)))
    readings[::20] += 0.3 * FIELD * random.normal3(len(readings[::20]))
    return readings, centre


def print_result(fit: libloc.EllipsoidFit, triad: libloc.TriadCalibration) -> None:
    print(f"{fit.readings} readings, {fit.inliers} of them fit; {fit.cells_hit} of 100 directions seen")
    bias, sigma = 1e6 * triad.bias, 1e6 * triad.quality.bias_sigma
    for axis, b, s in zip("xyz", bias, sigma, strict=True):
        print(f"  bias {axis}: {b:.3f} +- {s:.3f} uT")
    for row in triad.matrix:
        print("  matrix: " + " ".join(f"{value:8.4f}" for value in row))
    before, after = 100 * fit.norm_variation_before, 100 * fit.norm_variation_after
    print(f"  norm varies by {before:.2f} % before, {after:.2f} % after, all readings")


def plot(readings: np.ndarray, corrected: np.ndarray, path: Path) -> None:
    figure, axes = plt.subplots(1, 3, figsize=(12, 4.4), layout="constrained")
    for one, (i, j) in zip(axes, ((0, 1), (0, 2), (1, 2)), strict=True):
        one.plot(1e6 * readings[:, i], 1e6 * readings[:, j], ".", ms=2, label="readings")
        one.plot(1e6 * corrected[:, i], 1e6 * corrected[:, j], ".", ms=2, label="corrected")
        one.plot(0, 0, "k+", ms=10)
        one.set(xlabel=f"{'xyz'[i]} [uT]", ylabel=f"{'xyz'[j]} [uT]", aspect="equal")
        one.grid(alpha=0.3)
    axes[0].legend(loc="upper left")
    figure.savefig(path, dpi=110)
    print(f"wrote {path}")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=Path, nargs="?")
    parser.add_argument("--method", choices=("robust", "als", "lsq", "sphere"), default="robust")
    parser.add_argument("--field-ut", type=float, default=0.0, help="strength of the earth's field here [uT]")
    parser.add_argument("--output", type=Path, default=Path(), help="folder for spheres.png and rig.yaml")
    options = parser.parse_args()

    truth = None
    if options.recording is None:
        readings, truth = made_up_readings()
    else:
        try:
            readings = libloc.read_recording(options.recording).magnetometer.magnetic_field
        except libloc.DataError as error:
            print(error, file=sys.stderr)
            return 1
        if not len(readings):
            print(f"{options.recording}: no magnetometer in it", file=sys.stderr)
            return 1

    fit = libloc.fit_ellipsoid(
        readings,
        libloc.EllipsoidOptions(method=options.method, reference_norm=1e-6 * options.field_ut),
    )
    print(f"verdict: {fit.quality.verdict.name.lower()}")
    for reason in fit.quality.reasons:
        print(f"  {reason}")
    if not fit.quality.usable:
        print("refused: nothing is written", file=sys.stderr)
        return 1
    triad = fit.triad()
    print_result(fit, triad)
    if truth is not None:
        print(f"error of the centre: {100 * np.linalg.norm(triad.bias - truth) / FIELD:.3f} % of the field")

    options.output.mkdir(parents=True, exist_ok=True)
    plot(readings, (readings - triad.bias) @ triad.matrix.T, options.output / "spheres.png")

    def set_magnetometer(rig: libloc.Rig) -> None:
        rig.magnetometer = libloc.MagnetometerCalibration()
        rig.magnetometer.triad = triad

    libloc.update_rig(options.output / "rig.yaml", set_magnetometer)  # what else is in it stays
    print(f"wrote {options.output / 'rig.yaml'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
