"""Pictures in, trajectory and map out: a recording with pictures through ImageSlam in one call."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from libloc import _core
from libloc._core import DataError, ImuArrays, MeasurementSource, Rig, SlamOptions, SlamRun
from libloc.recordings import file_format

PICTURES = frozenset((".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".webp"))
_AFTER_LAST_NS = 1_000_000_000  # of the IMU's samples that are used after the last picture


def picture_format(path: str | PathLike[str]) -> str | None:
    """One of euroc, folder (of pictures), video, lcm: what may hold pictures; None for everything else.

    Raises DataError when the path does not exist.
    """
    path = Path(path)
    if path.is_dir():
        if (path / "mav0").is_dir() or any(path.glob("cam[0-9]*/data.csv")) or (path / "imu0").is_dir():
            return "euroc"
        return "folder"
    if not path.is_file():
        raise DataError(f"{path}: no such file or folder")
    with path.open("rb") as file:
        head = file.read(64)
    # ISO media (MP4, MOV), Matroska and WebM, AVI, MPEG, Ogg.
    video = head[4:8] in (b"ftyp", b"moov", b"mdat", b"wide", b"free")
    video |= head.startswith((b"\x1aE\xdf\xa3", b"\0\0\1\xba", b"\0\0\1\xb3", b"OggS", b"FLV"))
    video |= head.startswith(b"RIFF") and head[8:12] == b"AVI "
    if video:
        return "video"
    return "lcm" if file_format(path) == "lcm" else None


def open_pictures(
    path: str | PathLike[str],
    *,
    camera: int = 0,
    rate_hz: float = 0.0,
    start_time_ns: int = 0,
    name_unit: str = "",
) -> MeasurementSource:
    """The pictures of a EuRoC recording, a folder, a video or an LCM log (which gives all else, too).

    rate_hz: of a folder of numbered pictures, or in place of a video's own times. start_time_ns: of the first
    picture then, and of a video. name_unit: ns, us, ms or s for pictures that are called by their times.
    Raises DataError when there are none, ValueError for times that the input has itself.
    """
    _require_vision()
    path, form = Path(path), picture_format(path)
    if form in ("euroc", "lcm") and (rate_hz or start_time_ns or name_unit):
        raise ValueError(f"{path}: has times of its own: rate_hz, start_time_ns and name_unit are for others")
    if form == "euroc":
        return _core.open_euroc_images(path, cameras=[camera], other=False)
    if form == "folder":
        return _core.open_image_folder(
            path, camera=camera, rate_hz=rate_hz, first_time_ns=start_time_ns, name_unit=name_unit
        )
    if form == "video":
        if name_unit:
            raise ValueError(f"{path}: is a video, name_unit is for folders")
        return _core.open_video(path, camera=camera, rate_hz=rate_hz, start_time_ns=start_time_ns)
    if form == "lcm":
        return _core.open_lcm_log(path)
    raise DataError(f"{path}: is no video, folder of pictures, EuRoC recording or LCM log")


def number_of_pictures(path: str | PathLike[str], camera: int = 0) -> int | None:
    """About how many there are, for a progress bar; None: nobody knows before the end."""
    path, form = Path(path), picture_format(path)
    if form == "folder":
        return sum(file.suffix.lower() in PICTURES for file in path.iterdir())
    if form == "euroc":
        for part in (path / "mav0", path):
            index = part / f"cam{camera}" / "data.csv"
            if index.is_file():
                lines = index.read_text(encoding="utf-8", errors="replace").splitlines()
                return sum(bool(line.strip()) and not line.startswith("#") for line in lines)
    return None


def pictures(
    source: MeasurementSource | str | PathLike[str], camera: int = 0, **how: Any
) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    """(time_ns, picture (height, width)) of one camera; how: as open_pictures.

    Raises DataError when they cannot be read, or one of them is damaged in an LCM log.
    """
    if not isinstance(source, MeasurementSource):
        source = open_pictures(source, camera=camera, **how)
    for measurement in source:
        if isinstance(measurement, _core.ImageMeasurement) and measurement.camera == camera:
            yield measurement.time_ns, _core.image_array(_core.decode_image(measurement))


@dataclass
class ImageSlamRun:
    """frames: a row for each frame that was used. front_end: {name: (P,)} with a row for each picture, see
    ImageSlam.recorded(). counts: of the source, and of pictures that could not be used, and why."""

    frames: SlamRun
    front_end: dict[str, NDArray[Any]]
    counts: dict[str, int] = field(default_factory=dict)


def _require_vision() -> None:
    if not _core.HAS_VISION:
        raise DataError("pictures: this libloc was built without OpenCV")


def _check_overlap(first_ns: int, last_ns: int, imu_times_ns: NDArray[np.int64]) -> None:
    if len(imu_times_ns) == 0:
        raise DataError("there are no IMU samples")
    begin_ns, end_ns = int(imu_times_ns[0]), int(imu_times_ns[-1])
    if last_ns < begin_ns or first_ns > end_ns:
        first, last, begin, end = map(_core.format_seconds, (first_ns, last_ns, begin_ns, end_ns))
        raise DataError(
            f"the pictures ({first} to {last} s) and the IMU ({begin} to {end} s) have no time in common"
        )


def run_image_slam(
    source: Iterable[Any] | str | PathLike[str],
    options: SlamOptions,
    *,
    front_end: Any = None,
    imu: ImuArrays | None = None,
    rig: Rig | None = None,
    watch: Callable[[Any, Any], None] | None = None,
    progress: Callable[[int], bool | None] | None = None,
    with_covariance: bool = True,
    with_features: bool = False,
) -> ImageSlamRun:
    """SLAM over the pictures of options.camera_index; options: see slam_options_for_images().

    source: what open_pictures() or another open_...() gives, or a path for it. front_end:
    FeatureTrackerOptions. imu: in place of the source's own. rig: its calibration is applied to the IMU.
    watch(slam, picture) is called after each measurement that was used, with None unless it was a picture.
    progress(pictures done) is called after each; when it returns False the run ends, with what there is.
    Raises DataError when the source cannot be read or pictures and IMU have no time in common, ValueError
    for pictures of another size than the camera's.
    """
    _require_vision()
    if isinstance(source, (str, PathLike)):
        source = open_pictures(source, camera=options.camera_index)
    slam = _core.ImageSlam(options, front_end or _core.FeatureTrackerOptions())
    slam.record(with_covariance, with_features)
    inertial = options.motion == _core.SlamMotion.INERTIAL
    calibration = None if rig is None or rig.imu is None else rig.imu
    offset_ns = round(options.camera.time_offset_s * 1e9)
    counts: dict[str, int] = {}
    own = 0  # samples of imu that were used
    done = 0
    first_ns: int | None = None
    last_ns: int | None = None
    stopped = False

    def feed(time_ns: int, gyro: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        if calibration is not None:
            gyro = calibration.gyroscope.matrix @ (gyro - calibration.gyroscope.bias)
            force = calibration.accelerometer.matrix @ (force - calibration.accelerometer.bias)
        slam.process_imu(time_ns, gyro, force)
        if watch is not None:
            watch(slam, None)

    def feed_until(time_ns: int) -> None:
        nonlocal own
        if imu is None or not inertial:
            return
        end = int(np.searchsorted(imu.times_ns, time_ns, side="right"))
        for i in range(own, end):
            feed(int(imu.times_ns[i]), imu.angular_velocity[i], imu.specific_force[i])
        own = max(own, end)

    for measurement in source:
        if isinstance(measurement, _core.ImuMeasurement):
            if inertial and imu is None:
                feed(measurement.time_ns, measurement.angular_velocity, measurement.specific_force)
            continue
        if not isinstance(measurement, _core.ImageMeasurement) or measurement.camera != options.camera_index:
            continue
        done += 1
        try:
            picture = _core.decode_image(measurement)
        except DataError:
            counts["image.skipped.damaged"] = counts.get("image.skipped.damaged", 0) + 1
            continue
        feed_until(picture.time_ns)
        slam.process(picture)
        last_ns = picture.time_ns
        first_ns = last_ns if first_ns is None else first_ns
        if watch is not None:
            watch(slam, picture)
        if progress is not None and progress(done) is False:
            stopped = True
            break
    if not stopped:
        if first_ns is not None and last_ns is not None:
            if inertial and imu is not None:
                _check_overlap(first_ns + offset_ns, last_ns + offset_ns, imu.times_ns)
            feed_until(last_ns + offset_ns + _AFTER_LAST_NS)
        slam.finish()
        if watch is not None:
            watch(slam, None)
    frames, columns = slam.recorded(stopped)
    if isinstance(source, MeasurementSource):
        for name, n in source.counts().items():
            counts[name] = counts.get(name, 0) + n
    return ImageSlamRun(frames, columns, counts)
