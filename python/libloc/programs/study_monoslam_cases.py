"""Rows of the study of SLAM with one camera: what is simulated, which settings the filter has.

Tables:
  document     the look-at path with 0 and 1 px of noise, the filter told 1 px in both: with known landmarks
               (metres), and without any, where the unit of lengths is that of the prior of depths: as it is,
               and after the best similarity transform
  noise        the same path, known landmarks, several levels of noise; the filter is told what is true
  sweep        one setting at a time away from the base of the look-at path
  consistency  Civera's circle, the look-at path, and a device in the hand with an IMU: the three treatments
               of SlamOptions.consistency, and the default one without gate and RANSAC (the simulated
               associations are all right)
  robustness   circle and hand-held as they are, with 10 % of the observations anywhere, 20 % of the frames
               missing, and 2 s without a feature
Rows of one seed see the same noise but for what their worlds change.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import libloc
from libloc.programs.study_monoslam_worlds import World
from libloc.programs.study_runner import StudyError

TABLES = ("document", "noise", "sweep", "consistency", "robustness")
SETTLED_S = 5.0  # the initial peak is over
CIRCLE_LANDMARKS = 15  # features of the first frame whose depth is known
LOOK_AT_LANDMARKS = 6
QUICK_S = 10.0

Settings = tuple[tuple[str, object], ...]

CONSISTENCY = {
    "plain": libloc.SlamConsistency.PLAIN,
    "first-estimate": libloc.SlamConsistency.FIRST_ESTIMATE,
    "invariant": libloc.SlamConsistency.INVARIANT,
}
SPOILT = {
    "outliers": "10 % of observations anywhere",
    "dropped": "20 % of frames missing",
    "dark": "2 s without a feature",
}


_LOOK_AT_WORLD = World()


@dataclass(frozen=True)
class Case:
    name: str  # for --rows and files
    label: str
    table: str
    world: World = _LOOK_AT_WORLD
    settings: Settings = ()  # of SlamOptions, away from its defaults
    landmarks: int = LOOK_AT_LANDMARKS  # known features of the first frame
    motion_known: bool = False  # the filter is told the true velocities of the start
    aligned: bool = False  # errors are of the positions moved, turned and scaled onto the truth
    picture: bool = False  # trajectory and map are kept
    group: str = ""  # rows to be compared with each other: the parameter of a sweep, the world of the others


# Noise that is told but not there: the filter cannot be told that there is none.
_FLOOR_PX = 0.5
_LOOK_AT: Settings = (("sigma_px", 1.0),)
# Civera's prior and conversion, and a motion model for a camera on wheels.
_CIRCLE: Settings = (
    ("sigma_px", 1.0),
    ("sigma_velocity", 0.1),
    ("sigma_angular_velocity", 0.1),
    ("acceleration_density", 0.5),
    ("angular_acceleration_density", 0.5),
    ("map.max_features", 200),
    ("map.max_measured", 40),
    ("map.min_visible", 15),
    ("map.inverse_depth", 0.1),
    ("map.sigma_inverse_depth", 0.5),
    ("map.depth_from_neighbours", False),
    ("map.max_linearity_index", 0.1),
    ("association.gate_probability", 0.99),
)
_HAND_HELD: Settings = (("sigma_px", 0.5),)
_NO_GATE: Settings = (("association.gate_probability", 0.999999), ("association.ransac", False))
_DOCUMENT_PRIOR: Settings = (("map.inverse_depth", 1.0), ("map.sigma_inverse_depth", 1.0))


def _document() -> list[Case]:
    out = []
    for name, label, settings, landmarks in (
        ("document", "as published: no landmark, depth 1", _DOCUMENT_PRIOR, 0),
        ("prior", "no landmark, default depth", (), 0),
        ("shape", "the same after the best similarity", (), 0),
        ("metric", f"{LOOK_AT_LANDMARKS} known landmarks", (), LOOK_AT_LANDMARKS),
        (
            "cautious",
            f"{LOOK_AT_LANDMARKS} known landmarks, R = 3 px",
            (("sigma_px", 3.0),),
            LOOK_AT_LANDMARKS,
        ),
    ):
        for sigma_px in (0.0, 1.0):
            out.append(
                Case(
                    f"{name}-{sigma_px:g}px",
                    f"{label}; noise {sigma_px:g} px",
                    "document",
                    World(sigma_px=sigma_px),
                    _LOOK_AT + settings,
                    landmarks,
                    motion_known=True,
                    aligned=name == "shape",
                    picture=name == "metric",
                    group=name,
                )
            )
    return out


def _noise() -> list[Case]:
    return [
        Case(
            f"noise-{sigma_px:g}px",
            f"noise {sigma_px:g} px, told {max(sigma_px, _FLOOR_PX):g} px",
            "noise",
            World(sigma_px=sigma_px),
            (("sigma_px", max(sigma_px, _FLOOR_PX)),),
            group="noise [px]",
        )
        for sigma_px in (0.0, 0.5, 1.0, 2.0)
    ]


# Setting, what it is called in figures, values; the base is the default of SlamOptions but for sigma_px = 1.
_SWEEPS: tuple[tuple[str, str, tuple[float, ...]], ...] = (
    ("sigma_velocity", "root of P_velocity [m/s]", (0.05, 0.2, 0.5, 1.0, 2.0)),
    ("sigma_angular_velocity", "root of P_angular [rad/s]", (0.05, 0.2, 0.5, 1.0, 2.0)),
    ("acceleration_density", "Q: acceleration [m/s^2/sqrt(Hz)]", (0.1, 0.3, 1.0, 3.0, 10.0)),
    ("angular_acceleration_density", "Q: angular [rad/s^2/sqrt(Hz)]", (0.1, 0.3, 1.0, 3.0, 10.0)),
    ("sigma_px", "R: root, noise is 1 px [px]", (0.3, 0.5, 1.0, 2.0, 4.0)),
    ("map.inverse_depth", "rho0, true ones 0.1 to 0.3 [1/m]", (0.05, 0.1, 0.3, 0.6, 1.0)),
    ("map.sigma_inverse_depth", "sigma_rho [1/m]", (0.05, 0.1, 0.2, 0.5, 1.0)),
    ("max_iterations", "iterations of an update", (1, 2, 3, 5, 8)),
    ("association.gate_probability", "gate", (0.9, 0.95, 0.99, 0.999)),
)
_FOCAL_PX = (200.0, 300.0, 450.0, 700.0, 1000.0)
_SIZES = ((160, 120), (320, 240), (640, 480), (1280, 960))  # of the same field of view


def _sweep(quick: bool) -> list[Case]:
    base = Case("base", "base", "sweep", settings=_LOOK_AT)

    def ends(values: tuple) -> tuple:  # type: ignore[type-arg]
        return (values[0], values[-1]) if quick else values

    out = []
    for f in ends(_FOCAL_PX):
        out.append(
            replace(
                base,
                name=f"focal-{f:g}",
                label=f"{f:g}",
                world=World(focal_px=f),
                group="focal length, 640 x 480 [px]",
            )
        )
    for size in ends(_SIZES):
        world = World(size_px=size, focal_px=450.0 * size[0] / 640)
        group = "width, same field of view [px]"
        out.append(replace(base, name=f"width-{size[0]}", label=f"{size[0]}", world=world, group=group))
    for setting, group, values in _SWEEPS:
        for value in ends(values):
            name = f"{setting.rpartition('.')[2].replace('_', '-')}-{value:g}"
            changed = (*(one for one in base.settings if one[0] != setting), (setting, value))
            out.append(replace(base, name=name, label=f"{value:g}", settings=changed, group=group))
    return out


def _worlds() -> dict[str, Case]:
    return {
        "circle": Case(
            "circle",
            "circle, camera alone",
            "",
            World("circle"),
            _CIRCLE,
            CIRCLE_LANDMARKS,
            motion_known=True,
            group="circle",
        ),
        "look-at": Case("look-at", "look-at path, camera alone", "", World(), _LOOK_AT, group="look-at"),
        "hand-held": Case(
            "hand-held",
            "in the hand, with IMU",
            "",
            World("hand-held", sigma_px=0.5),
            _HAND_HELD,
            group="hand-held",
        ),
    }


def _consistency() -> list[Case]:
    out = []
    for world, case in _worlds().items():
        for name, value in CONSISTENCY.items():
            out.append(
                replace(
                    case,
                    name=f"{world}-{name}",
                    label=f"{case.label}: {name}",
                    table="consistency",
                    settings=(*case.settings, ("consistency", value)),
                    picture=world == "circle",
                )
            )
        out.append(
            replace(
                case,
                name=f"{world}-no-gate",
                label=f"{case.label}: default, no gate",
                table="consistency",
                settings=case.settings + _NO_GATE,
            )
        )
    return out


def _robustness() -> list[Case]:
    out = []
    for world, case in _worlds().items():
        if world == "look-at":
            continue
        out.append(replace(case, name=f"{world}-clean", label=f"{case.label}: clean", table="robustness"))
        for spoilt, label in SPOILT.items():
            out.append(
                replace(
                    case,
                    name=f"{world}-{spoilt}",
                    label=f"{case.label}: {label}",
                    table="robustness",
                    world=replace(case.world, spoilt=spoilt),
                )
            )
    return out


def all_cases(quick: bool = False) -> list[Case]:
    out = [*_document(), *_noise(), *_sweep(quick), *_consistency(), *_robustness()]
    if quick:
        out = [replace(case, world=replace(case.world, duration_s=QUICK_S)) for case in out]
    return out


def selected(names: list[str], quick: bool = False) -> list[Case]:
    """Rows by their names or those of their tables; all for none. Raises StudyError naming an unknown one."""
    cases = all_cases(quick)
    for name in names:
        if name not in TABLES and all(case.name != name for case in cases):
            known = ", ".join([*TABLES, *(case.name for case in cases)])
            raise StudyError(f"--rows {name}: must be one of {known}")
    return [case for case in cases if not names or case.name in names or case.table in names]
