"""loc-calibrate camera-imu: where cameras sit on the IMU, and by how much their clocks differ.

INPUT: a recording of a calibration target before which the rig was waved (or that was waved before the rig):
an EuRoC folder, a dataset folder of Kalibr (cam0/NANOSECONDS.png, imu0.csv), an LCM log; or a folder of
pictures named by their nanoseconds, or a video, with the IMU's CSV behind it; or tables of corners (CSV:
timestamp_ns, tag_id and corner_index or corner_id, u_px, v_px), one for each camera, with the IMU's CSV.
30 to 60 seconds: turn the rig briskly about all three axes and move it, the target sharp and mostly in view.
Not still, and not slowly: what does not turn tells nothing. Any offset between the clocks is found.

--rig names the intrinsics and the IMU's noise (rig.yaml, Kalibr's camchain and imu.yaml, EuRoC's
sensor.yaml; an EuRoC folder has them itself). Deviations of the intrinsics, as loc-calibrate camera writes
them, take part.

--target checkerboard 9x6 0.025          inner corners (not squares) along x and y, side of a square [m]
--target aprilgrid 6x6 0.088 0.3         Kalibr's grid: tags along x and y, side of a tag [m], spacing ratio
--target target.yaml                     Kalibr's file

The rig file (--out) gets pose, time offset and their deviations for each camera. Ctrl-C during the search
goes on with the pictures that were searched; during the solution it keeps the best so far.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np

import libloc
from libloc import DataError, Verdict
from libloc.programs import calibrate_camera_imu_input as reading
from libloc.programs import calibrate_camera_imu_live as live
from libloc.programs import calibrate_plots_camera_imu as plots
from libloc.programs.calibrate_camera import count_of, target_of
from libloc.programs.calibrate_camera_imu_input import CameraImuInput
from libloc.programs.calibrate_input import InputOptions
from libloc.programs.calibrate_report import Outcome, Table, with_sigma

_INTRINSICS = ("fx [px]", "fy [px]", "cx [px]", "cy [px]", "d1", "d2", "d3", "d4")
_ROTATIONS = {
    "cumulative": libloc.RotationForm.CUMULATIVE,
    "three-angles": libloc.RotationForm.THREE_ANGLES,
}
_SEVERITIES = {
    Verdict.OK: "note",
    Verdict.FAIR: "hint",
    Verdict.WARN: "warning",
    Verdict.REFUSED: "error",
}


def _positive(text: str) -> float:
    value = float(text)
    if not (np.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f"{text}: must be a positive number")
    return value


def _gravity(text: str) -> float | None:
    return None if text == "estimate" else _positive(text)


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("input", type=Path, nargs="*", metavar="INPUT", help="see above")
    group = parser.add_argument_group("target, cameras, IMU")
    group.add_argument("--target", nargs="+", required=True, metavar="WORD", help="see above")
    group.add_argument(
        "--rig",
        type=Path,
        nargs="+",
        default=[],
        metavar="FILE",
        help="intrinsics and IMU: rig.yaml, or camchain and imu.yaml, or sensor.yaml of each",
    )
    group.add_argument(
        "--camera",
        type=int,
        nargs="+",
        default=[0],
        metavar="N",
        help="numbers in recording and rig, several for a rig of several (%(default)s)",
    )
    group.add_argument("--imu", type=Path, metavar="FILE", help="IMU, where INPUT has none or another")
    group.add_argument("--step", type=count_of, default=1, metavar="N", help="search every N-th picture")
    group.add_argument(
        "--name-unit",
        choices=("ns", "us", "ms", "s"),
        default="ns",
        help="of pictures that are named by their times (%(default)s)",
    )
    for name, choices in (
        ("time", ("ns", "us", "ms", "s")),
        ("gyroscope", ("rad/s", "deg/s")),
        ("accelerometer", ("m/s^2", "g", "mg")),
    ):
        group.add_argument(f"--{name}-unit", choices=choices, help="of the IMU's CSV, where it has none")
    group = parser.add_argument_group("solution")
    group.add_argument("--order", type=int, default=6, help="of the spline, 4 or 6 are usual (%(default)s)")
    group.add_argument(
        "--rotation", choices=tuple(_ROTATIONS), default="cumulative", help="form of the spline (%(default)s)"
    )
    group.add_argument(
        "--knot-spacing", type=_positive, metavar="S", help="[s] (default: by the IMU's spectrum)"
    )
    group.add_argument(
        "--corner-sigma", type=_positive, default=0.3, metavar="PX", help="of a corner (%(default)s)"
    )
    group.add_argument("--time-offset", type=float, metavar="S", help="t_imu - t_camera, known to 0.5 s")
    group.add_argument(
        "--gravity",
        type=_gravity,
        default=9.80665,
        metavar="VALUE",
        help="[m/s²], or the word estimate (%(default)s)",
    )
    group.add_argument("--no-adapt-noise", action="store_true", help="take all noise as it is given")
    group.add_argument("--refine-intrinsics", action="store_true", help="of all cameras, from this recording")
    group.add_argument("--line-delay", action="store_true", help="estimate it: rolling shutter")
    group.add_argument("--drift", action="store_true", help="estimate how the clocks drift apart")
    group.add_argument(
        "--imu-matrices", action="store_true", help="estimate the IMU's scales and misalignment"
    )
    group.add_argument(
        "--time-limit", type=_positive, metavar="S", help="of the solution: the best so far then"
    )
    live.add_options(parser)
    parser.add_argument_group("result").add_argument(
        "--camchain", type=Path, metavar="FILE", help="also write Kalibr's camchain.yaml"
    )


def check_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    if options.live == bool(options.input):
        parser.error("INPUT or --live, one of them")
    if options.live and (len(options.camera) > 1 or not options.rig):
        parser.error("--live is for one camera, and needs its intrinsics (--rig)")
    try:
        options.target = target_of(options.target)
    except DataError as error:
        parser.error(f"--target: {error}")
    except ValueError as error:
        parser.error(f"--{error}")
    if min(options.camera) < 0 or len(set(options.camera)) < len(options.camera):
        parser.error(f"--camera {' '.join(map(str, options.camera))}: each camera once, counted from 0")
    if options.camchain is not None and options.camchain.is_dir():
        parser.error(f"--camchain {options.camchain}: is a folder, not a file")
    try:
        options.solver = _solver_options(options)
    except ValueError as error:
        parser.error(f"--{error}")


def _solver_options(options: argparse.Namespace) -> libloc.CameraImuOptions:
    return libloc.CameraImuOptions(
        order=options.order,
        rotation=_ROTATIONS[options.rotation],
        knot_spacing_s=options.knot_spacing or 0.0,
        corner_sigma_px=options.corner_sigma,
        time_offset_s=options.time_offset,
        gravity=options.gravity or 9.80665,
        estimate_gravity=options.gravity is None,
        adapt_noise=not options.no_adapt_noise,
        refine_intrinsics=options.refine_intrinsics,
        estimate_line_delay=options.line_delay,
        estimate_drift=options.drift,
        estimate_imu_matrices=options.imu_matrices,
        time_limit_s=options.time_limit or 0.0,
    )


class _SolverProgress:
    """One line that is written over; nothing where no one looks on."""

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._shown = False

    def __call__(self, at: libloc.CameraImuProgress) -> bool:
        try:
            if self._terminal:
                self._shown = True
                sys.stderr.write(
                    f"\rsolving: step {at.iteration}, cost {at.cost:.6g}, offset "
                    f"{1e3 * at.time_offset_s:.4f} ms, {at.elapsed_s:.1f} s (Ctrl-C: the best so far) "
                )
                sys.stderr.flush()
        except KeyboardInterrupt:  # within this line instead of within the solver
            return False
        return True

    def end(self) -> None:
        if self._shown:
            sys.stderr.write("\n")


def _lint(data: CameraImuInput, options: argparse.Namespace) -> list[libloc.CameraImuFinding]:
    """What is to be known of the recording. Raises DataError for what cannot be calibrated."""
    rates, forces = data.as_read or (data.angular_velocity, data.specific_force)
    findings = libloc.lint_camera_imu(
        options.target, data.recordings(), data.times_ns, rates, forces, data.noise, data.rate_hz
    )
    if not options.force and any(f.severity == Verdict.REFUSED for f in findings):
        _print(findings)
        raise DataError(
            f"{data.name}: cannot be calibrated as it is, see the errors above (--force tries all the same)"
        )
    return findings


def _print(findings: list[libloc.CameraImuFinding]) -> None:
    """Where there will be no result that names them."""
    for finding in findings:
        print(f"{_SEVERITIES[finding.severity]}: {finding.text}", file=sys.stderr)


def _judged(fit: libloc.CameraImuFit, findings: list[libloc.CameraImuFinding]) -> tuple[Verdict, list[str]]:
    """The solution cannot be better than the recording that it is from."""
    doubts = [f for f in findings if f.severity in (Verdict.WARN, Verdict.REFUSED)]
    verdict = Verdict(fit.quality.verdict)
    if doubts and verdict != Verdict.REFUSED:
        verdict = Verdict.WARN
    return verdict, [*fit.quality.reasons, *(f.text for f in doubts)]


def _mounting_table(camera: libloc.CameraImuCamera) -> Table:
    T = camera.camera.T_body_camera
    quality = libloc.MountingQuality()
    quality.set_deviations(T, camera.covariance)
    rows = [
        [f"camera in IMU, {axis} [mm]", with_sigma(T.translation[i], quality.translation_sigma[i], 1e3)]
        for i, axis in enumerate("xyz")
    ]
    parts = (camera.sigma_by_noise, camera.sigma_by_blocks, camera.sigma_by_intrinsics)
    for row in rows:
        row += ["", "", ""]
    rows += [
        [
            f"IMU in camera, {axis} [mm]",
            with_sigma(camera.T_camera_imu.translation[i], camera.sigma[3 + i], 1e3),
            *(f"{1e3 * part[3 + i]:.2g}" for part in parts),
        ]
        for i, axis in enumerate("xyz")
    ]
    rows += [
        [
            f"rotation about the IMU's {axis} [deg]",
            f"± {np.rad2deg(camera.sigma[i]):.2g}",
            *(f"{np.rad2deg(part[i]):.2g}" for part in parts),
        ]
        for i, axis in enumerate("xyz")
    ]
    rows.append(
        [
            "clocks: t_imu - t_camera [ms]",
            with_sigma(camera.time_offset_s, camera.sigma[6], 1e3),
            *(f"{1e3 * part[6]:.2g}" for part in parts),
        ]
    )
    return Table(
        f"mounting of {camera.camera.name}",
        ["", "value ± deviation", "by noise", "by pieces", "by intrinsics"],
        rows,
    )


def _correlation_table(camera: libloc.CameraImuCamera) -> Table:
    """The covariance, with the deviations taken out: those stand above."""
    names = ["turn x", "turn y", "turn z", "t x", "t y", "t z", "offset"]
    correlation = camera.covariance / np.outer(camera.sigma, camera.sigma)
    return Table(
        f"correlations of the errors of {camera.camera.name} (turn about the IMU's axes, IMU in camera)",
        ["", *names],
        [[name, *(f"{x:.2f}" for x in row)] for name, row in zip(names, correlation, strict=True)],
    )


def _intrinsics_table(camera: libloc.CameraImuCamera, refined: bool) -> Table:
    values = [*camera.camera.intrinsics_px, *camera.camera.distortion]
    rows = [
        [name, with_sigma(value, sigma if refined else None), f"{sigma:.2g}", f"{change:+.3g}"]
        for name, value, sigma, change in zip(
            _INTRINSICS, values, camera.intrinsics_sigma, camera.intrinsics_change, strict=True
        )
    ]
    kind = "refined" if refined else "held"
    change = "changed by" if refined else "the recording would change it by"
    return Table(
        f"intrinsics of {camera.camera.name} ({kind})",
        ["", "value", "deviation" if refined else "deviation that was taken", change],
        rows,
    )


def _dropped_table(camera: libloc.CameraImuCamera) -> Table | None:
    reasons = Counter(view.reason for view in camera.views if not view.used)
    if not reasons:
        return None
    rows = [[reason, str(count)] for reason, count in reasons.most_common()]
    return Table(f"pictures of {camera.camera.name} that were not used", ["why", "pictures"], rows)


def _matrix_rows(name: str, matrix: np.ndarray, sigma: np.ndarray) -> list[list[str]]:
    return [
        [f"{name}, row {axis}", *(with_sigma(matrix[i, j], sigma[i, j] or None) for j in range(3))]
        for i, axis in enumerate("xyz")
    ]


def sentence_of(fit: libloc.CameraImuFit, verdict: Verdict) -> str:
    """The verdict for somebody who does this for the first time."""
    worst = max(fit.cameras, key=lambda c: float(np.linalg.norm(c.sigma[3:6])))
    turn = np.rad2deg(np.linalg.norm(worst.sigma[:3]))
    shift = 1e3 * np.linalg.norm(worst.sigma[3:6])
    known = (
        f"where {worst.camera.name} sits is known to {shift:.2g} mm and {turn:.2g} deg, "
        f"and the offset of the clocks to {1e3 * worst.sigma[6]:.2g} ms"
    )
    if verdict == Verdict.OK:
        return f"Good: {known}."
    if verdict == Verdict.FAIR:
        return f"Usable: {known}; see below what would make it better."
    if verdict == Verdict.WARN:
        return f"Doubtful: {known}, but something does not fit; see below before you use it."
    return "Do not use this result: record once more as said below."


def _check_text(check: libloc.CameraImuCheck, scale: float, unit: str) -> str:
    text = f"{with_sigma(check.value, check.sigma, scale)} {unit}"
    return text if check.estimated else f"held; one step from there says {text}"


def _facts(data: CameraImuInput, fit: libloc.CameraImuFit, verdict: Verdict) -> list[tuple[str, str]]:
    facts = [("in one sentence", sentence_of(fit, verdict))]
    for camera in fit.cameras:
        name, T = camera.camera.name, camera.camera.T_body_camera
        q = " ".join(f"{x:.8f}" for x in T.rotation_wxyz)
        facts.append(
            (f"{name} in IMU", f"q_wxyz {q}, translation [m] {np.array2string(T.translation, precision=6)}")
        )
        used = sum(view.used for view in camera.views)
        start = camera.start
        facts += [
            (
                f"{name}: pictures",
                f"{used} of {len(camera.views)} used, {len(camera.corner_id)} corners, residuals "
                f"{np.sqrt(np.nanmean(np.sum(camera.corner_residual_px**2, axis=1))):.3f} px rms, "
                f"{camera.corner_chi:.2f} of their deviation",
            ),
            (
                f"{name}: start",
                f"offset {1e3 * start.time_offset_s:.3f} ms at a correlation of {start.correlation:.3f} "
                f"(next best {start.second_correlation:.2f}); turn rates along the main axes "
                + ", ".join(f"{x:.2f}" for x in start.excitation)
                + " rad/s",
            ),
            (f"{name}: drift of the clocks", _check_text(camera.offset_drift, 1e6, "us/s")),
        ]
        if np.isfinite(camera.line_delay_s.value):
            facts.append((f"{name}: line delay", _check_text(camera.line_delay_s, 1e6, "us a row")))
    gravity = ", ".join(f"{x:.4f}" for x in fit.gravity_target)
    bias = np.mean(fit.biases, axis=0)
    facts += [
        (
            "gravity in target",
            f"({gravity}) m/s², direction ± {np.rad2deg(fit.gravity_direction_sigma):.2g} deg; size "
            + _check_text(fit.gravity_size, 1, "m/s²"),
        ),
        ("bias of the gyroscope", " ".join(f"{x:.5f}" for x in bias[:3]) + " rad/s (mean)"),
        ("bias of the accelerometer", " ".join(f"{x:.4f}" for x in bias[3:]) + " m/s² (mean)"),
        (
            "IMU residuals",
            f"{fit.gyroscope_chi:.2f} and {fit.accelerometer_chi:.2f} of their deviation; suggested noise: "
            f"densities of the gyroscope × {fit.gyroscope_noise_scale:.2f}, of the accelerometer × "
            f"{fit.accelerometer_noise_scale:.2f}",
        ),
        ("knots", f"{1e3 * fit.knot_spacing_s:.2f} ms apart; {fit.knot_reason}"),
        (
            "CPU time",
            f"reading and search {data.detect_cpu_s:.1f} s, start {fit.start_cpu_s:.2f} s, "
            f"solution {fit.solve_cpu_s:.2f} s ({fit.iterations} steps); memory at most "
            f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB",
        ),
    ]
    return facts


def _apply(
    fit: libloc.CameraImuFit, verdict: Verdict, reasons: list[str], refined: bool, rig: libloc.Rig
) -> None:
    cameras = list(rig.cameras)
    for found in fit.cameras:
        name = found.camera.name
        at = next((i for i, c in enumerate(cameras) if c.name == name), None)
        camera = found.camera if at is None else cameras[at]
        camera.T_body_camera = found.camera.T_body_camera
        camera.time_offset_s = found.time_offset_s
        if refined:
            camera.intrinsics_px, camera.distortion = found.camera.intrinsics_px, found.camera.distortion
            quality = libloc.IntrinsicsQuality()
            quality.verdict, quality.reasons = verdict, reasons
            quality.method, quality.pictures = "camera-imu", sum(view.used for view in found.views)
            quality.intrinsics_sigma_px, quality.distortion_sigma = (
                found.intrinsics_sigma[:4],
                found.intrinsics_sigma[4:],
            )
            camera.intrinsics_quality = quality
        mounting = libloc.MountingQuality()
        mounting.verdict, mounting.reasons = verdict, reasons
        mounting.method, mounting.pictures = "camera-imu", sum(view.used for view in found.views)
        mounting.set_deviations(found.camera.T_body_camera, found.covariance)
        if found.line_delay_s.estimated:
            mounting.line_delay_s = found.line_delay_s.value
            mounting.line_delay_sigma_s = found.line_delay_s.sigma
        camera.mounting_quality = mounting
        if at is None:
            cameras.append(camera)
        else:
            cameras[at] = camera
    rig.cameras = cameras


def write_camchain(path: Path, fit: libloc.CameraImuFit) -> None:
    rig = libloc.Rig()
    rig.cameras = [camera.camera for camera in fit.cameras]
    libloc.write_kalibr_camchain(path, rig)


def outcome_of(
    data: CameraImuInput,
    fit: libloc.CameraImuFit,
    options: argparse.Namespace,
    findings: list[libloc.CameraImuFinding],
) -> Outcome:
    verdict, reasons = _judged(fit, findings)
    names = [camera.camera.name for camera in fit.cameras]
    tables: list[Table] = []
    for camera in fit.cameras:
        tables += [
            _mounting_table(camera),
            _correlation_table(camera),
            _intrinsics_table(camera, options.refine_intrinsics),
        ]
        dropped = _dropped_table(camera)
        if dropped is not None:
            tables.append(dropped)
    if options.imu_matrices:
        tables.append(
            Table(
                "IMU: reading = matrix * what the sensor feels + bias",
                ["", "x", "y", "z"],
                _matrix_rows("gyroscope", fit.gyroscope_matrix, fit.gyroscope_matrix_sigma)
                + _matrix_rows("accelerometer", fit.accelerometer_matrix, fit.accelerometer_matrix_sigma),
            )
        )
    notes = [f.text for f in findings if f.severity in (Verdict.OK, Verdict.FAIR)] + data.notes
    if fit.stopped:
        notes.append(f"the solution was stopped ({fit.stopped}): this is the best so far")
    return Outcome(
        block=", ".join(f"cameras.{name}" for name in names),
        summary=f"{', '.join(names)} on the IMU, from {options.target} in {data.name}",
        verdict=verdict,
        reasons=reasons,
        apply=partial(_apply, fit, verdict, reasons, options.refine_intrinsics),
        facts=_facts(data, fit, verdict),
        tables=tables,
        pictures=plots.pictures(
            fit, data.recordings(), (data.times_ns, data.angular_velocity, data.specific_force)
        ),
        notes=notes,
        counts=data.counts | {name: count for name, count in fit.counts.items() if count},
    )


def _check_out(data: CameraImuInput, options: argparse.Namespace) -> None:
    """The mounting holds for the intrinsics that it was found with: the rig that gets it must have the same.

    Raises DataError.
    """
    if options.out is None or not options.out.exists():
        return
    of_name = {camera.name: camera for camera in libloc.read_rig(options.out).cameras}
    for used in (c.camera for c in data.cameras):
        there = of_name.get(used.name)
        if there is None:
            continue
        same = there.distortion_model == used.distortion_model and (there.width_px, there.height_px) == (
            used.width_px,
            used.height_px,
        )
        values = [np.array([*c.intrinsics_px, *c.distortion]) for c in (there, used)]
        if not same or not np.allclose(*values, rtol=1e-9, atol=1e-12):
            raise DataError(
                f"{options.out}: {used.name} has other intrinsics there than those of this calibration, "
                "which the mounting would not fit: give this file with --rig, or name another with --out"
            )


def solve(data: CameraImuInput, options: argparse.Namespace) -> Outcome:
    """Raises DataError for what cannot be calibrated, with the reason."""
    _check_out(data, options)
    findings = _lint(data, options)
    progress = _SolverProgress()
    try:
        fit = libloc.calibrate_camera_imu(
            options.target,
            data.recordings(),
            data.times_ns,
            data.angular_velocity,
            data.specific_force,
            data.noise,
            options.solver,
            progress,
        )
    except DataError:
        _print(findings)  # the cause may be among them
        raise
    finally:
        progress.end()
    outcome = outcome_of(data, fit, options, findings)
    if options.camchain is not None:
        if options.force or outcome.verdict != Verdict.REFUSED:
            write_camchain(options.camchain, fit)
            outcome.notes.append(f"Kalibr's camchain was written to {options.camchain}")
        else:
            outcome.notes.append(f"{options.camchain} was not written, because the result is refused")
    return outcome


def _collect(options: argparse.Namespace) -> CameraImuInput:
    rig = reading.read_rig(options.rig, None, options.camera)
    (camera,) = reading.cameras_of(rig, options.camera, from_folder=False)
    notes: list[str] = []
    noise = reading.noise_of(rig, notes)

    def quick(so_far: live.Collected) -> libloc.CameraImuFit:
        rates, forces = reading.corrected(rig, so_far.angular_velocity, so_far.specific_force)
        return libloc.calibrate_camera_imu(
            options.target,
            [libloc.CameraRecording(camera, so_far.views)],
            so_far.imu_times_ns,
            rates,
            forces,
            noise,
            libloc.CameraImuOptions(adapt_noise=False, check_line_delay=False),
        )

    found = live.collect(options, options.target, camera, quick)
    rates, forces = reading.corrected(rig, found.angular_velocity, found.specific_force)
    return CameraImuInput(
        name=found.name,
        cameras=[reading.CameraInput(camera, found.views, found.left_out, dict(found.reasons))],
        times_ns=found.imu_times_ns,
        angular_velocity=rates,
        specific_force=forces,
        noise=noise,
        rate_hz=rig.imu.rate_hz if rig.imu is not None else 0.0,
        counts=dict(found.counts),
        notes=notes,
    )


def _read(options: argparse.Namespace) -> CameraImuInput:
    return reading.read_input(
        options.input,
        options.camera,
        options.rig,
        options.imu,
        options.target,
        InputOptions(
            time_unit=options.time_unit,
            gyroscope_unit=options.gyroscope_unit,
            accelerometer_unit=options.accelerometer_unit,
        ),
        options.name_unit,
        options.step,
    )


def calibrate(options: argparse.Namespace) -> Outcome:
    """Reads and calibrates. Raises DataError for data that cannot be calibrated."""
    begin = time.monotonic()
    data = _collect(options) if options.live else _read(options)
    outcome = solve(data, options)
    outcome.facts.append(("time", f"{time.monotonic() - begin:.1f} s in all"))
    return outcome
