"""What is required of SLAM with one camera on simulated tracks, and whether it holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from libloc.programs.study_monoslam_cases import SPOILT
from libloc.programs.study_monoslam_run import Outcome

NOISE_RATIO = 1.5  # error with 1 px of noise over that without, after the initial peak
CIRCLE_WORST_M = 0.5  # of any seed
CIRCLE_MEAN_M = 0.29  # the best of what Civera's prior gives in another implementation
SPOILT_RATIO = 2.0
Runs = dict[str, list[Outcome]]  # by case


@dataclass
class Requirement:
    text: str
    measured: str
    held: bool


def _pooled(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _noise(runs: Runs, name: str, label: str) -> list[Requirement]:
    without, with_noise = runs.get(f"{name}-0px"), runs.get(f"{name}-1px")
    if not without or not with_noise:
        return []
    a, b = (_pooled([one.settled_rms_m for one in group]) for group in (without, with_noise))
    return [
        Requirement(
            f"look-at path, {label}: error with 1 px at most {NOISE_RATIO:g} times that without, settled",
            f"{b:.4f} m / {a:.4f} m = {b / a:.2f}",
            b <= NOISE_RATIO * a,
        )
    ]


def _circle(runs: Runs, name: str) -> list[Requirement]:
    of_circle = runs.get(f"circle-{name}")
    if not of_circle:
        return []
    rms = [one.rms_m for one in of_circle]
    return [
        Requirement(
            f"circle, {name}: position RMS of every seed at most {CIRCLE_WORST_M:g} m",
            f"worst {max(rms):.3f} m of {len(rms)}",
            max(rms) <= CIRCLE_WORST_M,
        ),
        Requirement(
            f"circle, {name}: mean below {CIRCLE_MEAN_M:g} m",
            f"{np.mean(rms):.3f} m",
            float(np.mean(rms)) < CIRCLE_MEAN_M,
        ),
    ]


def _spoilt(runs: Runs, world: str) -> list[Requirement]:
    clean = runs.get(f"{world}-clean")
    out = []
    for spoilt, label in SPOILT.items():
        bad = runs.get(f"{world}-{spoilt}")
        if not clean or not bad:
            continue
        a, b = (_pooled([one.rms_m for one in group]) for group in (clean, bad))
        lost = sum(one.diverged for one in bad)
        out.append(
            Requirement(
                f"{world}, {label}: at most {SPOILT_RATIO:g} times the error of the clean run, none lost",
                f"{b:.4f} m / {a:.4f} m = {b / a:.2f}, {lost} lost",
                b <= SPOILT_RATIO * a and lost == 0,
            )
        )
        if spoilt != "dark":
            continue
        a, b = (_pooled([one.late_rms_m for one in group]) for group in (clean, bad))
        out.append(
            Requirement(
                f"{world}, {label}: the same from 1 s after it",
                f"{b:.4f} m / {a:.4f} m = {b / a:.2f}",
                b <= SPOILT_RATIO * a,
            )
        )
        said = min(one.flagged_dark for one in bad)
        quiet = max(one.flagged for one in clean)
        out.append(
            Requirement(
                f"{world}, {label}: said so in at least 70 % of the dark frames, never in the clean run",
                f"{100 * said:.0f} % and {100 * quiet:.0f} %",
                said >= 0.7 and quiet == 0,
            )
        )
    return out


def requirements(runs: Runs) -> list[Requirement]:
    """Those whose rows have been computed."""
    return [
        *_noise(runs, "document", "as published"),
        *_noise(runs, "prior", "default depth, no landmark"),
        *_noise(runs, "shape", "no landmark, after the best similarity"),
        *_noise(runs, "metric", "known landmarks"),
        *_noise(runs, "cautious", "known landmarks, R = 3 px"),
        *_circle(runs, "plain"),
        *_circle(runs, "first-estimate"),
        *_circle(runs, "invariant"),
        *_spoilt(runs, "circle"),
        *_spoilt(runs, "hand-held"),
    ]
