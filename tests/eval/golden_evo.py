"""Writes two recordings and what evo 1.38 (PyPI) makes of them, for test_trajectory_error.cpp.

Run: python golden_evo.py
The estimate is scaled, turned, shifted, noisy, has times of its own and a gap.
"""

import copy
from pathlib import Path

import numpy as np
from evo.core import metrics, sync
from evo.core.sync_method import SyncMethod
from evo.core.trajectory import PoseTrajectory3D
from scipy.spatial.transform import Rotation

HERE = Path(__file__).parent
START_NS = 1_403_715_273_262_142_976


def position(t):
    return np.stack([4 * np.cos(0.5 * t), 3 * np.sin(0.7 * t), 0.4 * t - 0.02 * t**2], axis=-1)


def orientation(t):
    vector = np.stack([0.3 * np.sin(t), 0.4 * np.cos(0.6 * t), 0.5 * t], axis=-1)
    return Rotation.from_rotvec(vector)


def trajectory(times_ns, p, r):
    xyzw = r.as_quat()
    wxyz = np.column_stack([xyzw[:, 3], xyzw[:, :3]])
    # Relative to the first time: evo keeps seconds as doubles.
    return PoseTrajectory3D(p, wxyz, np.asarray(times_ns, dtype=float) * 1e-9)


def recordings():
    random = np.random.default_rng(7)
    reference_ns = np.arange(120) * 100_000_000
    estimate_ns = np.arange(70) * 142_857_143 + random.integers(-4_000_000, 4_000_001, 70) + 60_000_000
    estimate_ns = np.delete(estimate_ns, slice(30, 36))
    t = reference_ns * 1e-9
    reference = trajectory(reference_ns, position(t), orientation(t))
    t = estimate_ns * 1e-9
    world = Rotation.from_rotvec([0.1, -0.2, 1.1])
    noise = Rotation.from_rotvec(0.03 * random.standard_normal((len(t), 3)))
    p = world.apply(position(t)) * 1.25 + [10, -20, 3] + 0.05 * random.standard_normal((len(t), 3))
    estimate = trajectory(estimate_ns, p, world * orientation(t) * noise)
    return reference_ns, reference, estimate_ns, estimate


def write_poses(name, times_ns, t):
    lines = []
    for ns, p, q in zip(times_ns, t.positions_xyz, t.orientations_quat_wxyz, strict=True):
        values = ", ".join(repr(float(v)) for v in (*q, *p))
        lines.append(f"{{{START_NS + int(ns)}, {values}}},\n")
    (HERE / name).write_text("".join(lines))


def row(name, metric):
    s = metric.get_all_statistics()
    keys = ["rmse", "mean", "median", "std", "min", "max", "sse"]
    values = ", ".join(repr(float(s[k])) for k in keys)
    return f'{{"{name}", {len(metric.error)}, {values}}},\n'


def main():
    reference_ns, reference, estimate_ns, estimate = recordings()
    write_poses("golden_reference.inc", reference_ns, reference)
    write_poses("golden_estimate.inc", estimate_ns, estimate)

    parts = {
        "translation": metrics.PoseRelation.translation_part,
        "rotation": metrics.PoseRelation.rotation_angle_rad,
    }
    out = []
    alignments = []
    for how, method in [("nearest", SyncMethod.nearest_time), ("interpolated", SyncMethod.interpolation)]:
        ref, est = sync.associate_trajectories(reference, estimate, sync_method=method, max_diff=0.03)
        for mode in ["none", "se3", "sim3"]:
            aligned = copy.deepcopy(est)
            if mode != "none":
                r, t, s = aligned.align(ref, correct_scale=mode == "sim3")
                values = ", ".join(repr(float(v)) for v in (*r.flatten(), *t, s))
                alignments.append(f'{{"{how} {mode}", {{{values}}}}},\n')
            for part, relation in parts.items():
                ape = metrics.APE(relation)
                ape.process_data((ref, aligned))
                out.append(row(f"ape {how} {mode} {part}", ape))
        for delta, unit, all_pairs, from_reference in [
            (1, metrics.Unit.frames, False, False),
            (5, metrics.Unit.frames, False, False),
            (7, metrics.Unit.frames, True, False),
            (2.0, metrics.Unit.meters, False, False),
            (2.0, metrics.Unit.meters, False, True),
            (3.0, metrics.Unit.meters, True, False),
            (1.5, metrics.Unit.meters, True, True),
        ]:
            for part, relation in parts.items():
                rpe = metrics.RPE(relation, delta, unit, 0.1, all_pairs, from_reference)
                rpe.process_data((ref, est))
                kind = "all" if all_pairs else "consecutive"
                along = "reference" if from_reference else "estimate"
                out.append(row(f"rpe {how} {delta:g} {unit.name} {kind} {along} {part}", rpe))
    (HERE / "golden_evo.inc").write_text("".join(out))
    (HERE / "golden_evo_alignment.inc").write_text("".join(alignments))


if __name__ == "__main__":
    main()
