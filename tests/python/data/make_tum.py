"""Makes the trajectories that loc-evaluate and evo are compared on: python make_tum.py. Seeded; committed."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline


def write(path: Path, times: np.ndarray, position: np.ndarray, rotation: Rotation) -> None:
    rows = np.column_stack([times, position, rotation.as_quat()])
    lines = [f"{r[0]:.9f} " + " ".join(f"{v:.9f}" for v in r[1:]) for r in rows]
    path.write_text("# seconds tx ty tz qx qy qz qw\n" + "\n".join(lines) + "\n")


def main() -> None:
    folder = Path(__file__).parent
    rng = np.random.default_rng(20)
    t = 1403715274 + np.arange(0, 20, 0.05)
    s = t - t[0]
    position = np.stack([3 * np.sin(0.4 * s), 2 * np.sin(0.8 * s), 1 + 0.3 * np.sin(0.5 * s)], axis=1)
    knots = np.linspace(0, 20, 12)
    spline = RotationSpline(knots, Rotation.from_euler("zyx", rng.uniform(-1, 1, (12, 3)) * [2.5, 0.6, 0.6]))
    write(folder / "reference.tum", t, position, spline(s))

    # Another world, another scale, drift, noise, half the rate, times 2 ms off and every 17th pose missing.
    keep = np.arange(0, len(t), 2)
    keep = keep[keep % 17 != 0]
    world = Rotation.from_euler("zyx", [0.7, 0.02, -0.03])
    drift = np.cumsum(rng.normal(size=(len(t), 3)) * 0.004, axis=0)
    turn = Rotation.from_rotvec(np.cumsum(rng.normal(size=(len(t), 3)) * 0.003, axis=0))
    moved = world.apply(position + drift) * 1.05 + [1, -2, 0.5] + rng.normal(size=position.shape) * 0.01
    write(folder / "estimate.tum", t[keep] + 0.002, moved[keep], (world * spline(s) * turn)[keep])


if __name__ == "__main__":
    main()
