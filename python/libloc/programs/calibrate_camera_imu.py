"""loc-calibrate camera-imu: where cameras sit on the IMU, and by how much their clocks differ.

INPUT: a recording of a calibration target before which the rig was waved (or that was waved before the rig):
an EuRoC folder, a dataset folder of Kalibr (cam0/NANOSECONDS.png, imu0.csv), an LCM log; or a folder of
pictures, or a video, with the IMU's CSV behind it; or tables of corners (CSV: timestamp_ns, tag_id and
corner_index or corner_id, u_px, v_px), one for each camera, with the IMU's CSV. Pictures are named by their
nanoseconds (by other times: --name-unit), have a data.csv, or are numbered (--rate-hz).
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
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np

import libloc
from libloc import DataError, Verdict
from libloc.programs import calibrate_camera_imu_input as reading
from libloc.programs import calibrate_camera_imu_live as live
from libloc.programs import calibrate_plots_camera_imu as plots
from libloc.programs.arguments import count, positive, seconds_ns
from libloc.programs.calibrate_camera import parse_target
from libloc.programs.calibrate_camera_imu_input import CameraImuInput, PictureTimes
from libloc.programs.calibrate_camera_imu_text import facts_of, tables_of
from libloc.programs.calibrate_input import InputOptions
from libloc.programs.calibrate_report import Outcome

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
# Options that tell how to read files; where they were not given they are None, --step is 1.
_OF_INPUT = (
    *("imu", "step", "name_unit", "rate_hz", "start_time"),
    *("time_unit", "gyroscope_unit", "accelerometer_unit"),
)
_QUICK_LIMIT_S = 20.0  # of a solution while more is collected


def _gravity(text: str) -> float | None:
    return None if text == "estimate" else positive(text)


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
    group.add_argument("--step", type=count, default=1, metavar="N", help="search every N-th picture")
    group.add_argument(
        "--name-unit",
        choices=("ns", "us", "ms", "s"),
        help="of pictures that are named by their times (default: ns)",
    )
    group.add_argument(
        "--rate-hz",
        type=positive,
        metavar="HZ",
        help="of numbered pictures, or of a video in place of its own times",
    )
    group.add_argument(
        "--start-time",
        type=seconds_ns,
        metavar="S",
        help="of the first picture with --rate-hz, or of a video, on the IMU's clock (default: 0, or that of "
        "the first IMU sample where the IMU counts from elsewhere)",
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
        "--knot-spacing", type=positive, metavar="S", help="[s] (default: by the IMU's spectrum)"
    )
    group.add_argument(
        "--corner-sigma", type=positive, default=0.3, metavar="PX", help="of a corner (%(default)s)"
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
        "--time-limit", type=positive, metavar="S", help="of the solution: the best so far then"
    )
    live.add_options(parser)
    parser.add_argument_group("result").add_argument(
        "--camchain", type=Path, metavar="FILE", help="also write Kalibr's camchain.yaml"
    )


def check_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    if options.live == bool(options.input):
        parser.error("INPUT or --live, one of them")
    if options.name_unit and options.rate_hz:
        parser.error("--name-unit, --rate-hz: only one of them tells the times of pictures")
    if options.live and (len(options.camera) > 1 or not options.rig):
        parser.error("--live is for one camera, and needs its intrinsics (--rig)")
    for name in _OF_INPUT if options.live else ():
        if getattr(options, name) not in (None, 1):
            parser.error(f"--{name.replace('_', '-')} is for INPUT, not for --live")
    options.target = parse_target(parser, options.target)
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
            self._shown = False


def _lint(data: CameraImuInput, options: argparse.Namespace) -> list[libloc.CameraImuFinding]:
    """What is to be known of the recording. Raises DataError for what cannot be calibrated."""
    findings = libloc.lint_camera_imu(
        options.target,
        data.recordings(),
        data.times_ns,
        data.angular_velocity,
        data.specific_force,
        data.noise,
        data.rate_hz,
    )
    if not data.noise_known:  # of which there is a note already
        findings = [f for f in findings if f.code != "noise.default"]
    if options.step > 1:  # fewer pictures a second than the rig says is what was asked for
        findings = [f for f in findings if f.code != "camera.rate_not_nominal"]
    if data.as_read is not None and not any(f.code == "imu.saturated" for f in findings):
        again = libloc.lint_camera_imu(
            options.target, [], data.times_ns, *data.as_read, data.noise, data.rate_hz
        )
        findings = [*findings, *(f for f in again if f.code == "imu.saturated")]
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
            quality = found.camera.intrinsics_quality
            quality.verdict, quality.reasons = verdict, reasons
            camera.intrinsics_quality = quality
        # The verdict of the solution and of the recording that it is from.
        mounting = found.camera.mounting_quality
        mounting.verdict, mounting.reasons = verdict, reasons
        camera.mounting_quality = mounting
        if at is None:
            cameras.append(camera)
        else:
            cameras[at] = camera
    rig.cameras = cameras


def write_camchain(path: Path, fit: libloc.CameraImuFit) -> None:
    """Kalibr's file, with the cameras of this calibration alone."""
    rig = libloc.Rig()
    rig.cameras = [camera.camera for camera in fit.cameras]
    libloc.write_kalibr_camchain(path, rig)


def outcome_of(
    data: CameraImuInput,
    fit: libloc.CameraImuFit,
    options: argparse.Namespace,
    findings: list[libloc.CameraImuFinding],
) -> Outcome:
    """What is said, drawn and written of a solution."""
    verdict, reasons = _judged(fit, findings)
    names = [camera.camera.name for camera in fit.cameras]
    notes = [f.text for f in findings if f.severity in (Verdict.OK, Verdict.FAIR)] + data.notes
    notes += [note for camera in data.cameras for note in camera.notes()]
    if fit.stopped:
        notes.append(f"the solution was stopped ({fit.stopped}): this is the best so far")
    return Outcome(
        block=", ".join(f"cameras.{name}" for name in names),
        summary=f"{', '.join(names)} on the IMU, from {options.target} in {data.name}",
        verdict=verdict,
        reasons=reasons,
        apply=partial(_apply, fit, verdict, reasons, options.refine_intrinsics),
        facts=facts_of(data, fit, verdict),
        tables=tables_of(fit, options.refine_intrinsics, options.imu_matrices),
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
        # Intrinsics that are refined are written, too.
        if not same or not (options.refine_intrinsics or np.allclose(*values, rtol=1e-9, atol=1e-12)):
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
        progress.end()
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
    (camera,) = reading.cameras_of(rig, options.camera)
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
            libloc.CameraImuOptions(adapt_noise=False, check_line_delay=False, time_limit_s=_QUICK_LIMIT_S),
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
        noise_known=rig.imu is not None,
        rate_hz=rig.imu.rate_hz if rig.imu is not None else 0.0,
        counts=dict(found.counts),
        notes=notes,
        as_read=None if rig.imu is None else (found.angular_velocity, found.specific_force),
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
        PictureTimes(options.name_unit, options.rate_hz, options.start_time),
        options.step,
    )


def calibrate(options: argparse.Namespace) -> Outcome:
    """Reads and calibrates. Raises DataError for data that cannot be calibrated."""
    begin = time.monotonic()
    data = _collect(options) if options.live else _read(options)
    outcome = solve(data, options)
    outcome.facts.append(("time", f"{time.monotonic() - begin:.1f} s until this result"))
    return outcome
