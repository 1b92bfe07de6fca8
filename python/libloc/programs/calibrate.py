"""loc-calibrate: from a recording to one block of the rig file, with a verdict and a report.

INPUT is a recording (EuRoC folder, CSV with a heading, BROAD trial, LCM log) or a table of numbers: CSV
without time or without heading (--columns), in physical units or in the sensor's counts, or a text table of
imu-tk (*.mat). More files add the sensors that the first one does not hold.

--out names the rig file (rig.yaml) that estimators read with --config. Its other blocks stay as they are;
comments in it are lost. A calibration that is refused is not written, unless --force is given.

Exit codes: 0 done, 1 the data cannot be calibrated (the message says why), 2 wrong options, 3 refused:
nothing was written, 130 interrupted: nothing was written.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import libloc
from libloc import DataError, Verdict
from libloc.programs import (
    calibrate_camera,
    calibrate_camera_imu,
    calibrate_clock,
    calibrate_gps,
    calibrate_inertial,
    calibrate_input,
    calibrate_live,
    calibrate_magnetometer,
    calibrate_noise,
)
from libloc.programs.arguments import positive
from libloc.programs.calibrate_input import InputOptions, Readings
from libloc.programs.calibrate_report import Outcome, text_of, write_report

EXIT_OK, EXIT_FAILED, EXIT_USAGE, EXIT_REFUSED, EXIT_INTERRUPTED = 0, 1, 2, 3, 130


def _add_output_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("result")
    group.add_argument(
        "--out",
        type=Path,
        metavar="RIG.yaml",
        help="rig file to update or create (default: nothing is written)",
    )
    group.add_argument(
        "--report", type=Path, metavar="DIR", help="write report.html and its pictures into this folder"
    )
    group.add_argument("--force", action="store_true", help="write the result even if it is refused")


def _add_input_options(parser: argparse.ArgumentParser, files: str = "+") -> None:
    parser.add_argument("input", type=Path, nargs=files, metavar="INPUT", help="recording or table")
    group = parser.add_argument_group("tables of numbers")
    group.add_argument(
        "--columns",
        metavar="NAMES",
        help="of a table without heading, for instance t_s,ax,ay,az,mx,my,mz; a column - is passed over",
    )
    group.add_argument(
        "--time-unit", choices=tuple(calibrate_input.TIME_UNITS), help="where the heading has none"
    )
    for triad in calibrate_input.TRIADS:
        group.add_argument(
            f"--{triad}-unit",
            choices=(*calibrate_input.UNITS[triad], calibrate_input.COUNTS),
            help="where the heading has none; counts: as the sensor gives them",
        )
    group.add_argument(
        "--rate", type=positive, metavar="HZ", help="readings a second, for tables without time"
    )


def _add_command(
    commands: argparse._SubParsersAction[argparse.ArgumentParser], name: str, text: str, details: str
) -> argparse.ArgumentParser:
    return commands.add_parser(
        name, help=text, description=details, formatter_class=argparse.RawDescriptionHelpFormatter
    )


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="loc-calibrate", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--version", action="version", version=libloc.__version__)
    commands = parser.add_subparsers(dest="command", required=True, metavar="SENSOR")
    magnetometer = _add_command(
        commands,
        "magnetometer",
        "hard and soft iron, from a device that is turned about",
        calibrate_magnetometer.__doc__ or "",
    )
    _add_input_options(magnetometer, files="*")
    calibrate_magnetometer.add_options(magnetometer)
    _add_output_options(magnetometer)
    for name, text in (
        ("accelerometer", "bias, scale and cross-axis, from still poses"),
        ("gyroscope", "bias at rest; scale and alignment, from turns between still poses"),
    ):
        command = _add_command(commands, name, text, calibrate_inertial.__doc__ or "")
        _add_input_options(command)
        calibrate_inertial.add_options(command)
        _add_output_options(command)
    noise = _add_command(
        commands, "imu-noise", "noise densities and random walks, from rest", calibrate_noise.__doc__ or ""
    )
    _add_input_options(noise)
    _add_output_options(noise)
    clock = _add_command(
        commands, "clock", "skew and jitter of the clock that stamps a stream", calibrate_clock.__doc__ or ""
    )
    _add_input_options(clock)
    calibrate_clock.add_options(clock)
    _add_output_options(clock)
    gps = _add_command(
        commands,
        "gps-latency",
        "how late a receiver's fixes are stamped, against a reference",
        calibrate_gps.__doc__ or "",
    )
    gps.add_argument("input", type=Path, nargs="+", metavar="INPUT", help="LCM log")
    calibrate_gps.add_options(gps)
    _add_output_options(gps)
    camera = _add_command(
        commands,
        "camera",
        "focal lengths and distortion, from pictures of a checkerboard or an AprilGrid",
        calibrate_camera.__doc__ or "",
    )
    calibrate_camera.add_options(camera)
    _add_output_options(camera)
    camera_imu = _add_command(
        commands,
        "camera-imu",
        "where cameras sit on the IMU and how their clocks differ, from a target that was waved before them",
        calibrate_camera_imu.__doc__ or "",
    )
    calibrate_camera_imu.add_options(camera_imu)
    _add_output_options(camera_imu)
    return parser


def _input_options(options: argparse.Namespace) -> InputOptions:
    return InputOptions(
        columns=options.columns,
        time_unit=options.time_unit,
        gyroscope_unit=options.gyroscope_unit,
        accelerometer_unit=options.accelerometer_unit,
        magnetometer_unit=options.magnetometer_unit,
        rate_hz=options.rate,
    )


# What a table without names holds, and who calibrates it.
_COMMANDS: dict[str, tuple[str, Callable[[Readings, argparse.Namespace], Outcome]]] = {
    "magnetometer": ("magnetometer", calibrate_magnetometer.calibrate),
    "accelerometer": ("accelerometer", calibrate_inertial.calibrate_accelerometer),
    "gyroscope": ("gyroscope", calibrate_inertial.calibrate_gyroscope),
    "imu-noise": ("gyroscope", calibrate_noise.calibrate),
}


def read_inputs(options: argparse.Namespace) -> Readings:
    sensor = _COMMANDS[options.command][0]
    if getattr(options, "live", False):
        return calibrate_live.collect(options)
    first, *more = options.input
    readings = calibrate_input.read_readings(first, sensor, _input_options(options))
    for path in more:
        other = "gyroscope" if sensor == "accelerometer" else "accelerometer"
        readings = calibrate_input.merged(
            readings, calibrate_input.read_readings(path, other, _input_options(options))
        )
    return readings


def calibrated(options: argparse.Namespace) -> Outcome:
    """Reads and calibrates. Raises DataError (ValueError) for data that cannot be calibrated."""
    if options.command == "clock":
        return calibrate_clock.calibrate(options, _input_options(options))
    if options.command == "gps-latency":
        return calibrate_gps.calibrate(options)
    if options.command == "camera":
        return calibrate_camera.calibrate(options)
    if options.command == "camera-imu":
        return calibrate_camera_imu.calibrate(options)
    return _COMMANDS[options.command][1](read_inputs(options), options)


def finish(outcome: Outcome, options: argparse.Namespace, command: list[str]) -> int:
    """Prints, writes the rig and the report. Returns the exit code."""
    print(text_of(outcome))
    code = EXIT_OK
    if outcome.apply is None:
        written, code = "There is no result to write.", EXIT_REFUSED
    elif outcome.verdict == Verdict.REFUSED and not options.force:
        written, code = "Refused: nothing was written. --force writes it all the same.", EXIT_REFUSED
    elif options.out is None:
        written = "No rig file was named with --out: nothing was written."
    else:
        libloc.update_rig(options.out, outcome.apply)
        forced = " although it was refused (--force)" if outcome.verdict == Verdict.REFUSED else ""
        written = (
            f"Block {outcome.block} was written to {options.out}{forced}; its other blocks stay as they were."
        )
    print(written)
    if options.report:
        print(f"Report: {write_report(options.report, outcome, command, written)}")
    return code


def main(arguments: list[str] | None = None) -> int:
    parser = make_parser()
    options = parser.parse_args(arguments)
    command = ["loc-calibrate", *(sys.argv[1:] if arguments is None else arguments)]
    if options.out is not None and options.out.is_dir():
        parser.error(f"--out {options.out}: is a folder, not a file")
    if options.command == "magnetometer":
        calibrate_magnetometer.check_options(parser, options)
    elif options.command in ("accelerometer", "gyroscope"):
        calibrate_inertial.check_options(parser, options)
    elif options.command == "gps-latency":
        calibrate_gps.check_options(parser, options)
    elif options.command == "camera":
        calibrate_camera.check_options(parser, options)
    elif options.command == "camera-imu":
        calibrate_camera_imu.check_options(parser, options)
    try:
        if options.out is not None and options.out.exists():
            libloc.read_rig(options.out)  # before the work, not after it
        outcome = calibrated(options)
        return finish(outcome, options, command)
    except KeyboardInterrupt:
        print("loc-calibrate: interrupted, nothing was written", file=sys.stderr)
        return EXIT_INTERRUPTED
    except (DataError, ValueError, OSError) as error:
        print(f"loc-calibrate: {error}", file=sys.stderr)
        return EXIT_FAILED


if __name__ == "__main__":
    sys.exit(main())
