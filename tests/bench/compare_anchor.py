"""SLAM whose map GPS ties to the Earth, on simulated drives: how far off, and what the covariance says of it.

A car goes round a block (scenario street-car, 90 s, tracks of one camera, IMU, GPS at 5 Hz); from 40 to 60 s
there is no GPS. Fixes have 0.5 m of white noise and share an error of 1.5 m that wanders within minutes, and
that nobody can see: the position cannot be better. It is compared with the true one without any alignment.

    python tests/bench/compare_anchor.py [--seeds 10]
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

import libloc

ORIGIN = (0.761, 0.0251, 150.0)  # of the simulated world
SPANS = {"first 10 s": (0, 10), "GPS, 10 to 40 s": (10, 40), "without GPS, 40 to 60 s": (40, 60)}
SPANS |= {"its last second": (59, 60), "GPS again, from 62 s": (62, 90)}


def drive(seed: int, inertial: bool) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Times [s], horizontal errors [m], and errors squared over what the covariance says (2 is right)."""
    run = libloc.simulate("street-car", seed, duration_s=90, parameters={"gps.outages": "40:60"})
    recording = run.recording
    rig = libloc.Scenario("street-car").rig()
    motion = libloc.SlamMotion.INERTIAL if inertial else libloc.SlamMotion.CONSTANT_VELOCITY
    slam = libloc.run_slam(recording, libloc.SlamOptions(camera=rig.cameras[0], motion=motion))
    options = libloc.MapAnchorOptions(inertial, origin=ORIGIN)
    world = libloc.anchor_slam(slam, recording.gps, options, inertial=inertial, rig=rig)
    truth = recording.reference
    true = np.stack(
        [np.interp(world.time_ns, truth.times_ns.astype(float), truth.position[:, i]) for i in range(2)],
        axis=1,
    )
    off = world.position[:, :2] - true
    cov = world.covariance[:, 3:5, 3:5]
    normalised = np.einsum("ni,nij,nj->n", off, np.linalg.inv(cov), off)
    return 1e-9 * (world.time_ns - world.time_ns[0]), np.linalg.norm(off, axis=1), normalised


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    seeds = parser.parse_args().seeds
    print(f"{seeds} drives; horizontal error [m]: rms, worst of all; normalised error squared (2 is right)")
    for inertial in (True, False):
        print("camera and IMU" if inertial else "camera alone")
        drives = [drive(seed, inertial) for seed in range(1, seeds + 1)]
        for name, (begin, end) in SPANS.items():
            errors = np.concatenate([error[(t >= begin) & (t < end)] for t, error, _ in drives])
            normalised = np.concatenate([n[(t >= begin) & (t < end)] for t, _, n in drives])
            rms = np.sqrt(np.mean(errors**2))
            print(f"  {name:26s} {rms:6.2f} {errors.max():7.2f} {normalised.mean():8.2f}")


if __name__ == "__main__":
    main()
