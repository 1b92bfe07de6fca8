"""Accuracy of orientation filters on the BROAD trials, side by side, in one command.

    python tests/bench/compare_broad.py [--data DIR] [--json FILE] [--png FILE]

Runs libloc's Madgwick filter (the report's form, with rest bias, preset robust, 6 axes), and beside it VQF,
BasicVQF and imufusion from PyPI (pip install vqf imufusion), on every *.mat trial it finds in DIR (default:
$LIBLOC_DATA/broad, or ../shared/data/broad beside the checkout). Prints the RMSE per trial, the means and the
time of each batch call.

The metric is BROAD's own (Laidig, Caruso, Cereatti, Seel, "BROAD - a benchmark for robust inertial
orientation estimation", Data 6(7), 2021): no alignment, world is ENU, samples count where `movement` is true
and both orientations are known. The error in world is e = q_estimate * q_truth^-1 = heading * inclination:
    total = 2 acos |e_w|     heading = 2 atan |e_z / e_w|     inclination = 2 acos sqrt(e_w^2 + e_z^2)
On BROAD's thirty trials VQF has a mean total RMSE of 2.43 degrees and BasicVQF of 3.50: the check of this
script.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.io

BETA_REPORT = 0.1  # [rad/s] best round value with the raw gyroscope
BETA_REST_BIAS = 0.041  # [rad/s] once the rest bias is removed
GRAVITY = 9.81


@dataclass
class Trial:
    """One recording: gyroscope [rad/s], specific force [m/s^2], field [uT], all (N, 3); truth (N, 4) wxyz."""

    name: str
    rate_hz: float
    gyro: np.ndarray
    force: np.ndarray
    field: np.ndarray
    q_true_wxyz: np.ndarray
    movement: np.ndarray


@dataclass
class Method:
    name: str
    run: Callable[[Trial], tuple[np.ndarray, float]]  # gives q_wxyz (N, 4) and the seconds that the call took
    has_heading: bool = True


def read_trial(path: Path) -> Trial:
    mat = scipy.io.loadmat(path)
    return Trial(
        name=path.stem,
        rate_hz=float(mat["sampling_rate"].item()),
        gyro=np.ascontiguousarray(mat["imu_gyr"], dtype=float),
        force=np.ascontiguousarray(mat["imu_acc"], dtype=float),
        field=np.ascontiguousarray(mat["imu_mag"], dtype=float),
        q_true_wxyz=np.asarray(mat["opt_quat"], dtype=float),
        movement=mat["movement"].ravel() > 0,
    )


def errors_deg(q_wxyz: np.ndarray, trial: Trial) -> dict[str, float]:
    """Root mean square of the three errors of BROAD [deg], and how many samples count."""
    w1, x1, y1, z1 = q_wxyz.T
    w2, x2, y2, z2 = (trial.q_true_wxyz * [1, -1, -1, -1]).T
    w = w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2
    z = w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2
    known = np.isfinite(trial.q_true_wxyz).all(axis=1) & trial.movement
    if not np.isfinite(q_wxyz[known]).all():
        raise ValueError(
            f"{trial.name}: the estimate is not finite at {np.sum(~np.isfinite(w[known]))} samples that count"
        )
    w, z = w[known], z[known]
    error = {
        "total": 2 * np.arccos(np.clip(np.abs(w), 0, 1)),
        "heading": 2 * np.arctan2(np.abs(z), np.abs(w)),
        "inclination": 2 * np.arccos(np.clip(np.hypot(w, z), 0, 1)),
    }
    rmse = {name: float(np.rad2deg(np.sqrt(np.mean(values**2)))) for name, values in error.items()}
    return rmse | {"samples": int(known.sum())}


def timed(call: Callable[[], np.ndarray]) -> tuple[np.ndarray, float]:
    start = time.perf_counter()
    result = call()
    return result, time.perf_counter() - start


def libloc_methods() -> list[Method]:
    import libloc

    def method(name: str, options: "libloc.MadgwickOptions", magnetometer: bool = True) -> Method:
        def run(trial: Trial) -> tuple[np.ndarray, float]:
            times_ns = np.rint(np.arange(len(trial.gyro)) * (1e9 / trial.rate_hz)).astype(np.int64)
            # BROAD's field is in microtesla; libloc takes tesla.
            field = trial.field * 1e-6 if magnetometer else None
            filter_ = libloc.MadgwickFilter(options)
            result, seconds = timed(lambda: filter_.run(times_ns, trial.gyro, trial.force, field))
            return result.q_world_body_wxyz, seconds

        return Method(name, run, magnetometer)

    robust = libloc.MadgwickOptions.robust()
    return [
        method(f"libloc report, beta {BETA_REPORT}", libloc.MadgwickOptions(beta=BETA_REPORT)),
        method(
            f"libloc report + rest bias, beta {BETA_REST_BIAS}",
            libloc.MadgwickOptions(beta=BETA_REST_BIAS, rest_bias=True),
        ),
        method(f"libloc robust, beta {robust.beta:g}", robust),
        method("libloc robust, 6 axes", robust, magnetometer=False),
    ]


def peer_methods() -> list[Method]:
    import imufusion
    import vqf

    def run_vqf(trial: Trial) -> tuple[np.ndarray, float]:
        return timed(
            lambda: vqf.VQF(1 / trial.rate_hz).updateBatch(trial.gyro, trial.force, trial.field)["quat9D"]
        )

    def run_vqf_6(trial: Trial) -> tuple[np.ndarray, float]:
        return timed(lambda: vqf.VQF(1 / trial.rate_hz).updateBatch(trial.gyro, trial.force)["quat6D"])

    def run_basic_vqf(trial: Trial) -> tuple[np.ndarray, float]:
        return timed(
            lambda: vqf.BasicVQF(1 / trial.rate_hz).updateBatch(trial.gyro, trial.force, trial.field)[
                "quat9D"
            ]
        )

    def run_imufusion(trial: Trial) -> tuple[np.ndarray, float]:
        settings = imufusion.AhrsSettings()
        settings.convention = imufusion.CONVENTION_ENU
        settings.sample_rate = trial.rate_hz
        ahrs = imufusion.Ahrs()
        ahrs.set_settings(settings)
        gyro_deg, force_g, field = np.rad2deg(trial.gyro), trial.force / GRAVITY, trial.field

        def call() -> np.ndarray:
            q = np.empty((len(gyro_deg), 4))
            for i in range(len(q)):
                ahrs.update(gyro_deg[i], force_g[i], field[i])
                q[i] = ahrs.get_quaternion()
            return q

        return timed(call)

    return [
        Method(f"vqf {package_version('vqf')} VQF", run_vqf),
        Method("vqf VQF, 6 axes", run_vqf_6, has_heading=False),
        Method("vqf BasicVQF", run_basic_vqf),
        Method(f"imufusion {package_version('imufusion')} (defaults)", run_imufusion),
    ]


def package_version(name: str) -> str:
    from importlib.metadata import version

    return version(name)


def summarise(method: Method, trials: list[Trial]) -> dict:
    per_trial, seconds, samples = {}, 0.0, 0
    for trial in trials:
        q_wxyz, took = method.run(trial)
        error = errors_deg(q_wxyz, trial)
        per_trial[trial.name] = error if method.has_heading else {"inclination": error["inclination"]}
        seconds += took
        samples += len(trial.gyro)
    names = ("total", "heading", "inclination") if method.has_heading else ("inclination",)
    mean = {name: float(np.mean([error[name] for error in per_trial.values()])) for name in names}
    worst = {name: float(np.max([error[name] for error in per_trial.values()])) for name in names}
    return {
        "method": method.name,
        "mean_deg": mean,
        "worst_deg": worst,
        "per_trial_deg": per_trial,
        "ns_per_sample": 1e9 * seconds / samples,
    }


def print_tables(results: list[dict], trials: list[Trial]) -> None:
    print(f"RMSE per trial [deg]: total, with 6 axes inclination; {len(trials)} trials")
    print(f"{'trial':44s}" + "".join(f"{chr(ord('a') + i):>8s}" for i in range(len(results))))
    for trial in trials:
        row = [r["per_trial_deg"][trial.name] for r in results]
        print(f"{trial.name:44s}" + "".join(f"{e.get('total', e['inclination']):8.2f}" for e in row))
    print()
    print(
        f"{'':3s}{'method':44s}{'mean total':>11s}{'heading':>9s}{'inclin.':>9s}{'worst':>8s}"
        f"{'ns/sample':>11s}"
    )
    for i, r in enumerate(results):
        mean, worst = r["mean_deg"], r["worst_deg"]
        cells = [f"{mean[n]:.2f}" if n in mean else "-" for n in ("total", "heading", "inclination")]
        print(
            f"{chr(ord('a') + i)}  {r['method']:44s}{cells[0]:>11s}{cells[1]:>9s}{cells[2]:>9s}"
            f"{worst.get('total', worst['inclination']):8.2f}{r['ns_per_sample']:11.0f}"
        )


def plot(results: list[dict], trials: list[Trial], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    shown = [r for r in results if "total" in r["mean_deg"]]
    figure, axes = plt.subplots(figsize=(12, 5), layout="constrained")
    width = 0.8 / len(shown)
    for i, r in enumerate(shown):
        heights = [r["per_trial_deg"][t.name]["total"] for t in trials]
        axes.bar(
            np.arange(len(trials)) + i * width,
            heights,
            width,
            label=f"{r['method']}: {r['mean_deg']['total']:.2f}",
        )
    axes.set_xticks(np.arange(len(trials)) + 0.4, [t.name[:2] for t in trials])
    axes.set(xlabel="BROAD trial", ylabel="total RMSE [deg]", ylim=(0, 15))
    axes.legend(fontsize="small")
    figure.savefig(path, dpi=110)


def default_data() -> Path:
    checkout = Path(__file__).resolve().parents[2]
    return Path(os.environ.get("LIBLOC_DATA", checkout.parent / "shared" / "data")) / "broad"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=default_data(), help="folder of BROAD's .mat files")
    parser.add_argument("--only", metavar="TEXT", help="only the methods whose name contains TEXT")
    parser.add_argument("--json", type=Path, help="write all figures to this file")
    parser.add_argument("--png", type=Path, help="draw the total RMSE of each trial")
    options = parser.parse_args(arguments)

    paths = sorted(options.data.glob("*.mat"))
    if not paths:
        print(f"compare_broad: no .mat file in {options.data}", file=sys.stderr)
        return 1
    trials = [read_trial(path) for path in paths]
    methods = libloc_methods() + peer_methods()
    if options.only:
        methods = [m for m in methods if options.only in m.name]
        if not methods:
            print(f"compare_broad: no method's name contains {options.only!r}", file=sys.stderr)
            return 2
    results = [summarise(method, trials) for method in methods]
    print_tables(results, trials)
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")
    if options.png:
        plot(results, trials, options.png)
    return 0


if __name__ == "__main__":
    sys.exit(main())
