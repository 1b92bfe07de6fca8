"""What loc-calibrate camera-imu reads: the corners of a target in the pictures of cameras, and an IMU.

Corners come from pictures (EuRoC folder, Kalibr's dataset folder, folder of pictures, video, LCM log) or from
tables that another detector wrote; the IMU from the same recording or from a file of its own.
"""

from __future__ import annotations

import re
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import DataError
from libloc.images import PICTURES, number_of_pictures, picture_format
from libloc.programs import calibrate_input
from libloc.programs.calibrate_images import Progress, other_target, read_corner_table
from libloc.programs.calibrate_input import COUNTS, SI, InputOptions, same_times

_SHORTEST_NS = 100_000  # from one picture to the next: names that are closer are numbers, or in another unit
_FAR_NS = 3_600_000_000_000  # from 0 to the first IMU sample: they count from different moments
_ENOUGH_OF_OTHER_SIZE = 50  # pictures at the begin, to take all for such


@dataclass
class CameraInput:
    """The views of one camera, one for each picture that was searched (or that a table names)."""

    camera: libloc.CameraCalibration
    views: list[libloc.TargetView] = field(default_factory=list)
    left_out: int = 0  # corners that were not sharp enough
    reasons: dict[str, int] = field(default_factory=dict)  # why there were no corners
    damaged: list[str] = field(default_factory=list)  # a sentence for each picture that could not be read
    # How many had another size (width, height) than the camera [px].
    other_sizes: Counter[tuple[int, int]] = field(default_factory=Counter)

    def notes(self) -> list[str]:
        """What was left out, and why."""
        out = self.damaged[:3]
        if len(self.damaged) > 3:
            out.append(f"{len(self.damaged) - 3} more pictures could not be read")
        if self.other_sizes:
            out.append(f"left out: {_of_other_size(self)}")
        if self.left_out:
            out.append(f"{self.left_out} corners of {self.camera.name} were not sharp enough")
        return out + [
            f"{self.camera.name}: no target in {count} pictures: {reason}"
            for reason, count in sorted(self.reasons.items(), key=lambda item: -item[1])
        ]


@dataclass
class CameraImuInput:
    """All that is calibrated from, whether it was read or came live."""

    name: str
    cameras: list[CameraInput]
    times_ns: NDArray[np.int64]
    angular_velocity: NDArray[np.float64]  # (N, 3) [rad/s], corrected by the rig
    specific_force: NDArray[np.float64]  # (N, 3) [m/s²], likewise
    noise: libloc.ImuNoise
    noise_known: bool = True  # by the rig
    rate_hz: float = 0.0  # nominal; 0: unknown
    counts: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    detect_cpu_s: float = 0.0
    # Rates and forces as read, where the rig has corrected them: a sensor's limit shows in these only.
    as_read: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None

    def recordings(self) -> list[libloc.CameraRecording]:
        return [libloc.CameraRecording(c.camera, c.views) for c in self.cameras]


@dataclass
class PictureTimes:
    """What was asked for about the times of pictures; nothing: their names are nanoseconds."""

    name_unit: str | None = None  # ns, us, ms, s
    rate_hz: float | None = None  # of numbered pictures, or of a video in place of its own times
    start_time_ns: int | None = None  # of the first picture then, and of a video

    def asked(self) -> str:
        """An option that was given, or nothing."""
        given = {
            "--rate-hz": self.rate_hz,
            "--name-unit": self.name_unit,
            "--start-time": self.start_time_ns,
        }
        return next((name for name, value in given.items() if value is not None), "")

    def at_rate(self) -> dict[str, Any]:
        """As open_pictures() takes it, without what was not given."""
        how = {"rate_hz": self.rate_hz, "start_time_ns": self.start_time_ns}
        return {name: value for name, value in how.items() if value is not None}


@dataclass
class Sources:
    """INPUT, sorted by what it is."""

    tables: list[Path] = field(default_factory=list)  # of corners, one a camera
    pictures: list[tuple[Path, dict[str, Any]]] = field(
        default_factory=list
    )  # one a camera: open_pictures(...)
    imu: Path | None = None
    folder: Path | None = None  # EuRoC's, which may hold calibrations too


def _is_corner_table(path: Path) -> bool:
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        names = {name.strip() for name in file.readline(4096).split(",")}
    return bool(names & {"u_px", "v_px", "corner_id", "corner_index"})


def _kalibr_folder(folder: Path, cameras: list[int], times: PictureTimes) -> Sources | None:
    """Kalibr's dataset: cam0/NANOSECONDS.png … and imu0.csv."""
    if (folder / "mav0").is_dir() or not (folder / "cam0").is_dir() or (folder / "cam0" / "data").is_dir():
        return None
    out = Sources(folder=folder, imu=folder / "imu0.csv" if (folder / "imu0.csv").is_file() else None)
    for camera in cameras:
        own = folder / f"cam{camera}"
        if not own.is_dir():
            raise DataError(f"{folder}: there is no cam{camera} in it")
        out.pictures.append((own, _by_names(own, times)))
    return out


def _by_names(folder: Path, times: PictureTimes) -> dict[str, Any]:
    """How the names of its pictures tell their times. Raises DataError when nobody said how they do."""
    if times.rate_hz:
        return times.at_rate()
    if times.start_time_ns is not None:
        raise DataError(f"{folder}: --start-time is of pictures with --rate-hz, or of a video")
    if times.name_unit:
        return {"name_unit": times.name_unit}
    names = sorted(path.name for path in folder.iterdir() if path.suffix.lower() in PICTURES)
    stems = [Path(name).stem for name in names]
    no_time = next((name for name, stem in zip(names, stems, strict=True) if not stem.isdecimal()), None)
    why = f"{no_time} is no time in nanoseconds" if no_time else ""
    if len(stems) > 1 and not why:
        numbers = [int(stem) for stem in stems]
        if max(numbers) - min(numbers) < _SHORTEST_NS * (len(numbers) - 1):
            why = f"{names[0]} to {names[-1]} are no times in nanoseconds"
    if why:
        raise DataError(
            f"{folder}: when were its pictures taken? {why}: give --rate-hz for numbered pictures, "
            "--name-unit for names that are times, or a data.csv with the time and name of each"
        )
    return {"name_unit": "ns"}


def _times_of(folder: Path, times: PictureTimes) -> tuple[Path, dict[str, Any]]:
    """The folder that holds the pictures, and what tells their times (data.csv, a list, their names)."""
    found: tuple[Path, dict[str, Any]] | None = None
    if (folder / "data").is_dir() and (folder / "data.csv").is_file():
        found = folder / "data", {"times_file": folder / "data.csv"}
    elif (folder / "data.csv").is_file():
        found = folder, {"times_file": folder / "data.csv"}
    elif folder.name == "data" and (folder.parent / "data.csv").is_file():
        found = folder, {"times_file": folder.parent / "data.csv"}
    elif any((folder / name).is_file() for name in ("rgb.txt", "times.txt")):
        found = folder, {}
    if found is None:
        return folder, _by_names(folder, times)
    _need_no_times(folder, times)
    return found


def _need_no_times(path: Path, times: PictureTimes) -> None:
    if times.asked():
        raise DataError(f"{path}: has times of its own, {times.asked()} is for other inputs")


def sources_of(inputs: list[Path], cameras: list[int], imu: Path | None, times: PictureTimes) -> Sources:
    """Raises DataError naming what is missing or too much."""
    out = Sources(imu=imu)
    singles: list[tuple[Path, dict[str, Any]]] = []  # folders and videos of one camera
    beside: Path | None = None  # the IMU of a recording with pictures: only where no file gives it alone
    for path in inputs:
        if path.is_file() and path.suffix.lower() in PICTURES:
            raise DataError(f"{path}: single pictures have no times: give their folder")
        if path.is_file() and path.suffix.lower() == ".csv" and _is_corner_table(path):
            out.tables.append(path)
            continue
        form = picture_format(path)
        if form is None:
            if out.imu is not None:
                raise DataError(
                    f"{path}: {out.imu} gives the IMU already, and corners have columns u_px, v_px"
                )
            out.imu = path
            continue
        if out.pictures:
            raise DataError(f"{path}: {out.pictures[0][0]} gives the pictures already")
        kalibr = _kalibr_folder(path, cameras, times) if path.is_dir() else None
        if kalibr is not None:
            out.pictures, out.folder, beside = kalibr.pictures, path, kalibr.imu
        elif form == "folder":
            singles.append(_times_of(path, times))
        elif form == "video":
            if times.name_unit:
                raise DataError(f"{path}: is a video, --name-unit is for folders of pictures")
            singles.append((path, times.at_rate()))
        else:
            _need_no_times(path, times)
            out.folder = path if form == "euroc" else None
            out.pictures = [(path, {"camera": camera}) for camera in cameras]
            beside = path
    if singles and out.pictures:
        raise DataError(f"{singles[0][0]}: {out.pictures[0][0]} gives the pictures already")
    if singles and len(singles) != len(cameras):
        raise DataError(
            f"{singles[0][0]}: {len(singles)} folders or videos for {len(cameras)} cameras: name the cameras "
            "with --camera, in this order"
        )
    out.pictures = out.pictures or singles
    out.imu = out.imu or beside
    if out.tables and times.asked():
        raise DataError(f"{out.tables[0]}: has times of its own, {times.asked()} is for pictures")
    if out.tables and out.pictures:
        raise DataError(
            f"{out.tables[0]}: corners, and {out.pictures[0][0]} gives pictures: one of them (--imu takes "
            "the IMU of a recording alone)"
        )
    if not out.tables and not out.pictures:
        raise DataError("there are neither pictures nor a table of corners (CSV with u_px, v_px) in INPUT")
    if out.imu is None:
        raise DataError("there is no IMU in INPUT: name its CSV behind the pictures, or with --imu")
    if out.tables and len(out.tables) != len(cameras):
        raise DataError(
            f"{len(out.tables)} tables of corners for {len(cameras)} cameras: name the cameras with --camera"
        )
    return out


def _of_folder(folder: Path, name: str) -> Path | None:
    for part in (folder / "mav0", folder):
        if (part / name / "sensor.yaml").is_file():
            return part / name / "sensor.yaml"
    return None


def read_rig(paths: list[Path], folder: Path | None, cameras: list[int]) -> libloc.Rig:
    """The rig of all files that were named, or of an EuRoC folder itself. Raises DataError."""
    rig = libloc.Rig()
    if not paths and folder is not None:
        names = [*(f"cam{camera}" for camera in cameras), "imu0"]
        paths = [found for name in names if (found := _of_folder(folder, name)) is not None]
    found_cameras: list[libloc.CameraCalibration] = []
    for path in paths:
        part = libloc.read_any_rig(path)
        there = {camera.name for camera in found_cameras}
        twice = [camera.name for camera in part.cameras if camera.name in there]
        if twice:
            raise DataError(f"{path}: {twice[0]} is in another file already")
        found_cameras += part.cameras
        if part.imu is not None:
            if rig.imu is not None:
                raise DataError(f"{path}: the IMU is in another file already")
            rig.imu = part.imu
    rig.cameras = found_cameras
    return rig


def cameras_of(rig: libloc.Rig, numbers: list[int]) -> list[libloc.CameraCalibration]:
    """Those of the rig that are called cam0, cam1, ... as their numbers; others by their place in it.

    Raises DataError when there is none.
    """
    usual = re.compile(r"cam[0-9]+")
    cameras = list(rig.cameras)
    names = [camera.name for camera in cameras]
    out: list[libloc.CameraCalibration] = []
    for number in numbers:
        at = names.index(f"cam{number}") if f"cam{number}" in names else number
        # cam1 at the first place is not camera 0.
        if at >= len(cameras) or (usual.fullmatch(names[at]) and names[at] != f"cam{number}"):
            there = f" ({', '.join(names)})" if names else ""
            raise DataError(
                f"the rig has {len(cameras)} cameras{there}, none with number {number}: name a file with its "
                "intrinsics (--rig; loc-calibrate camera finds them)"
            )
        out.append(cameras[at])
    return out


def _of_other_size(found: CameraInput) -> str:
    """ "3 pictures of 320 x 200 pixels; cam0 of the rig has 640 x 400: ..." """
    sizes = [f"{width} x {height}" for (width, height), _ in found.other_sizes.most_common()]
    shown = ", ".join(sizes[:3]) + (", …" if len(sizes) > 3 else "")
    count = found.other_sizes.total()
    return (
        f"{count} picture{'s' if count > 1 else ''} of {shown} pixels; {found.camera.name} of the rig has "
        f"{found.camera.width_px} x {found.camera.height_px}: intrinsics hold for one size only"
    )


def find_views(
    target: libloc.CalibrationTarget,
    source: tuple[Path, dict[str, Any]],
    camera: libloc.CameraCalibration,
    step: int,
    counts: dict[str, int],
    stream: TextIO | None = None,
) -> tuple[CameraInput, bool]:
    """Searches the pictures of one camera; Ctrl-C goes on with those that were searched (True).

    Pictures of another size than the camera are left out and counted. Raises DataError when all of them have
    one, or none shows the target.
    """
    if not libloc.HAS_VISION:
        raise DataError("this libloc was built without OpenCV and cannot look at pictures")
    path, how = source
    detector = libloc.TargetDetector(target)
    out = CameraInput(camera)
    listed = "times_file" in how
    opened = libloc.open_image_folder(path, **how) if listed else libloc.open_pictures(path, **how)
    number = how.get("camera", 0)
    progress = Progress(number_of_pictures(path, number), stream or sys.stderr)
    first: list[NDArray[np.uint8]] = []
    interrupted = False
    done = hits = 0
    try:
        for measurement in opened:
            if not isinstance(measurement, libloc.ImageMeasurement) or measurement.camera != number:
                continue
            done += 1
            if (done - 1) % step:
                continue
            try:
                picture = libloc.image_array(libloc.decode_image(measurement))
            except DataError as error:
                out.damaged.append(f"{camera.name}, picture of {measurement.time_ns}: {error}")
                continue
            height, width = picture.shape
            if (width, height) != (camera.width_px, camera.height_px):
                out.other_sizes[width, height] += 1
                if not out.views and out.other_sizes.total() == _ENOUGH_OF_OTHER_SIZE:
                    break
                continue
            seen = detector.detect(picture)
            out.left_out += seen.corners_left_out
            if len(seen.view):
                hits += 1
            else:
                out.reasons[seen.reason] = out.reasons.get(seen.reason, 0) + 1
            out.views.append(libloc.TargetView(seen.view.ids, seen.view.pixels_px, measurement.time_ns))
            if len(first) < 4:
                first.append(picture)
            progress.show(done, hits)
    except KeyboardInterrupt:
        interrupted = True
    progress.end()
    if out.other_sizes and not out.views:
        # A source of files goes by the size of its first picture.
        others = opened.counts().get("image.skipped.other_size", 0)
        hint = f" ({others} more have another size than the first: take that one away)" if others else ""
        raise DataError(f"{path}: {_of_other_size(out)}{hint}")
    counts[f"{camera.name}.pictures.searched"] = len(out.views)
    counts[f"{camera.name}.pictures.with_target"] = hits
    if out.damaged:
        counts[f"{camera.name}.pictures.skipped.damaged"] = len(out.damaged)
    if out.other_sizes:
        counts[f"{camera.name}.pictures.skipped.other_size"] = out.other_sizes.total()
    for name, count in opened.counts().items():
        if count and ("skip" in name or "missing" in name):
            counts[f"{camera.name}.{name}"] = count
    if hits == 0:
        if not out.views:
            why = f" that can be read: {out.damaged[0]}" if out.damaged else " in it"
            raise DataError(f"{path}: there are no pictures of camera {number}{why}")
        hint = other_target(target, first)
        raise DataError(
            f"{path}: the target ({target}) is in none of {len(out.views)} pictures: "
            f"{max(out.reasons, key=lambda r: out.reasons[r])}." + (f" {hint}" if hint else "")
        )
    return out, interrupted


def _begin_with(imu_ns: int, sources: Sources, notes: list[str]) -> None:
    """Pictures that are counted from 0 begin with the first IMU sample where the IMU counts from elsewhere.

    The offset that is found is then no larger than what lies between the two beginnings.
    """
    for path, how in sources.pictures:
        counted = "rate_hz" in how or picture_format(path) == "video"
        if counted and "start_time_ns" not in how and abs(imu_ns) > _FAR_NS:
            how["start_time_ns"] = imu_ns
            notes.append(
                f"{path.name}: the first picture was given the time of the first IMU sample (--start-time "
                "names another): the offset of the clocks holds for this recording alone"
            )
        elif "rate_hz" in how:
            notes.append(
                f"{path.name}: the times of the pictures were counted at --rate-hz: the offset of the clocks "
                "holds for this recording alone"
            )


def corrected(
    rig: libloc.Rig, gyro: NDArray[np.float64], accel: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Readings as the rig's calibration of the IMU corrects them."""
    if rig.imu is None:
        return np.ascontiguousarray(gyro), np.ascontiguousarray(accel)
    g, a = rig.imu.gyroscope, rig.imu.accelerometer
    return (
        np.ascontiguousarray((gyro - g.bias) @ np.asarray(g.matrix).T),
        np.ascontiguousarray((accel - a.bias) @ np.asarray(a.matrix).T),
    )


def _read_imu(path: Path, options: InputOptions, notes: list[str]) -> calibrate_input.Readings:
    try:
        return calibrate_input.read_readings(path, "gyroscope", options)
    except DataError as error:
        if "has no unit" not in str(error) and "state it in the options" not in str(error):
            raise
    # Kalibr's files name no units. They are looked at against the pictures before anything is solved.
    usual = InputOptions(
        columns=options.columns,
        time_unit=options.time_unit or "ns",
        gyroscope_unit=options.gyroscope_unit or "rad/s",
        accelerometer_unit=options.accelerometer_unit or "m/s^2",
        rate_hz=options.rate_hz,
    )
    readings = calibrate_input.read_readings(path, "gyroscope", usual)
    notes.append(
        f"{path.name} names not all units: {usual.time_unit}, {usual.gyroscope_unit} and "
        f"{usual.accelerometer_unit} were taken"
    )
    return readings


def noise_of(rig: libloc.Rig, notes: list[str]) -> libloc.ImuNoise:
    """That of the rig; without one the usual noise, and a note that says so."""
    if rig.imu is None:
        notes.append(
            "the rig says nothing of the IMU's noise: that of a usual MEMS IMU was taken "
            "(--rig with an imu block, or Kalibr's imu.yaml beside it; loc-calibrate imu-noise measures it)"
        )
        return libloc.ImuNoise()
    return rig.imu.noise


def read_input(
    inputs: list[Path],
    cameras: list[int],
    rigs: list[Path],
    imu: Path | None,
    target: libloc.CalibrationTarget,
    text: InputOptions,
    picture_times: PictureTimes | None = None,
    step: int = 1,
    stream: TextIO | None = None,
) -> CameraImuInput:
    """Reads and searches everything. Raises DataError naming file, line, field and value."""
    sources = sources_of(inputs, cameras, imu, picture_times or PictureTimes())
    rig = read_rig(rigs, sources.folder, cameras)
    calibrations = cameras_of(rig, cameras)
    notes: list[str] = []
    counts: dict[str, int] = {}
    assert sources.imu is not None
    readings = _read_imu(sources.imu, text, notes)
    gyro, times = readings.need_times("gyroscope")
    accel = readings.need("accelerometer")
    for kind, triad in (("gyroscope", gyro), ("accelerometer", accel)):
        if triad.unit == COUNTS:
            raise DataError(
                f"{sources.imu}: the {kind} is in the sensor's own counts: it must be calibrated "
                f"(loc-calibrate {kind}) and written in {SI[kind]}"
            )
    if not same_times(gyro, accel):
        raise DataError(
            f"{sources.imu}: {len(gyro)} readings of the gyroscope and {len(accel)} of the accelerometer, "
            "not at the same times: both are needed in each line"
        )
    _begin_with(int(times[0]), sources, notes)
    begin = time.process_time()
    found: list[CameraInput] = []
    interrupted = False
    if sources.tables:
        for path, camera in zip(sources.tables, calibrations, strict=True):
            table = read_corner_table(path, target, camera.width_px, camera.height_px)
            found.append(CameraInput(camera, table.views))
            counts |= {f"{camera.name}.{name}": n for name, n in table.counts.items()}
    else:
        for source, camera in zip(sources.pictures, calibrations, strict=True):
            views, stopped = find_views(target, source, camera, step, counts, stream)
            found.append(views)
            interrupted = interrupted or stopped
    if interrupted:
        notes.append("interrupted: the rest of the pictures was not searched")
    # Of a log, what concerns other streams is left away.
    own = ("imu.", "rows.", "gyroscope.", "accelerometer.")
    counts |= {
        name: n for name, n in readings.counts.items() if n and (name.startswith(own) or "skip" in name)
    }
    rates, forces = corrected(rig, gyro.rows, accel.rows)
    return CameraImuInput(
        name=", ".join(path.name for path in inputs),
        cameras=found,
        times_ns=times,
        angular_velocity=rates,
        specific_force=forces,
        as_read=None
        if rig.imu is None
        else (np.ascontiguousarray(gyro.rows), np.ascontiguousarray(accel.rows)),
        noise=noise_of(rig, notes),
        noise_known=rig.imu is not None,
        rate_hz=rig.imu.rate_hz if rig.imu is not None else 0.0,
        counts=counts,
        notes=notes,
        detect_cpu_s=time.process_time() - begin,
    )
