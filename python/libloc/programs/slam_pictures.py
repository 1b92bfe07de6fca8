"""loc-slam on pictures: what it reads of them, a look at some, and a video."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import libloc
from libloc import DataError

_KEPT = 12  # pictures, of which the ones to be shown are chosen
_VIDEO_S = 30  # of the video that is written without being asked for
_NO_RATE_HZ = 20.0  # of a video, when the pictures' times do not tell


@dataclass
class PictureInput:
    """Where pictures come from; opened when they are wanted."""

    path: Path
    form: str  # as libloc.picture_format
    camera: int
    how: dict[str, Any] = field(default_factory=dict)  # of open_pictures
    total: int | None = None

    def open(self) -> libloc.MeasurementSource:
        return libloc.open_pictures(self.path, camera=self.camera, **self.how)


@dataclass
class Sample:
    """One picture with what was found in it; frame: what the filter made of it, when it has."""

    time_ns: int
    picture: NDArray[np.uint8]
    pixel_px: NDArray[np.float64]
    origin: NDArray[np.uint8]
    frame: Any = None  # SlamFeatureArrays


def find_pictures(path: Path, options: argparse.Namespace) -> PictureInput | None:
    """None when the file or folder holds none, or tracks are to be used.

    An LCM log is for whoever finds no features in it. Raises DataError.
    """
    form = libloc.picture_format(path)
    if form is None or options.tracks is not None:
        return None
    how: dict[str, Any] = {}
    if options.name_unit is not None:
        how["name_unit"] = options.name_unit
    if options.rate_hz is not None:
        how["rate_hz"] = options.rate_hz
    if options.start_time is not None:
        how["start_time_ns"] = options.start_time
    if form == "lcm":
        # Whoever reads a recording looks at these two.
        for name in ("rate_hz", "start_time_ns"):
            how.pop(name, None)
    if form in ("euroc", "lcm"):
        if how:
            raise DataError(f"{path}: has times of its own, {_option(next(iter(how)))} is for other inputs")
        if options.imu is not None:
            raise DataError(f"{path}: --imu is for videos and folders of pictures")
    if form == "euroc":
        cameras = libloc.euroc_cameras(path) if libloc.HAS_VISION else []
        if not cameras:
            return None
        if options.camera not in cameras:
            raise DataError(f"{path}: has pictures of cameras {cameras}, asked for is {options.camera}")
    if form == "folder" and "start_time_ns" in how and "rate_hz" not in how:
        raise DataError(f"{path}: --start-time is of pictures with --rate-hz, or of a video")
    total = libloc.images.number_of_pictures(path, options.camera)
    return PictureInput(path, form, options.camera, how, total)


def _option(name: str) -> str:
    return {"start_time_ns": "--start-time", "rate_hz": "--rate-hz", "name_unit": "--name-unit"}[name]


def rig_of_euroc(folder: Path, camera: int) -> libloc.Rig:
    """Calibration that lies beside the pictures: camN/sensor.yaml, and imu0/sensor.yaml where it is there.

    The camera has its number as index. Raises DataError when there is none.
    """
    for part in (folder / "mav0", folder):
        sensor = part / f"cam{camera}" / "sensor.yaml"
        if sensor.is_file():
            rig = libloc.read_any_rig(sensor)
            rig.cameras = [rig.cameras[0]] * (camera + 1)
            if (part / "imu0" / "sensor.yaml").is_file():
                rig.imu = libloc.read_any_rig(part / "imu0" / "sensor.yaml").imu
            return rig
    raise DataError(f"{folder}: no calibration in it (cam{camera}/sensor.yaml): give --config")


class Watcher:
    """Sees every picture with what was found in it: keeps some, and writes the video."""

    def __init__(self, video: Path | None, rate_hz: float, whole_video: bool) -> None:
        self.samples: list[Sample] = []
        self.video_path = video
        self.video_failure = ""
        self._waiting: dict[int, Sample] = {}
        self._step = 1
        self._seen = 0
        self._video: Any = None
        self._rate_hz = rate_hz if rate_hz > 0 else _NO_RATE_HZ
        self._most = None if whole_video else round(_VIDEO_S * self._rate_hz)

    def __call__(self, slam: Any, picture: Any) -> None:
        if picture is not None:
            if self._seen % self._step == 0:
                self._keep(slam, picture)
            self._add_to_video(slam, picture)
            self._seen += 1
        if self._waiting:
            for frame in slam.frames():
                sample = self._waiting.pop(frame.time_ns, None)
                if sample is not None:
                    sample.frame = frame.features

    def _keep(self, slam: Any, picture: Any) -> None:
        sample = Sample(
            picture.time_ns, libloc.image_array(picture), slam.features.pixel_px, slam.tracks.origin
        )
        self.samples.append(sample)
        self._waiting[picture.time_ns] = sample
        if len(self.samples) > _KEPT:
            for gone in self.samples[1::2]:
                self._waiting.pop(gone.time_ns, None)
            self.samples = self.samples[::2]
            self._step *= 2

    def _add_to_video(self, slam: Any, picture: Any) -> None:
        if self.video_path is None or self.video_failure:
            return
        if self._most is not None and self._seen >= self._most:
            return
        try:
            if self._video is None:
                self._video = libloc.FeatureVideo(
                    self.video_path, picture.width_px, picture.height_px, self._rate_hz, identities=False
                )
            self._video.add(slam.features, picture)
        except ValueError as error:  # a DataError, too
            self.video_failure = str(error)

    def finish(self) -> Path | None:
        """The video, when there is one; otherwise video_failure says why."""
        if self._video is None:
            return None
        if not self.video_failure:
            try:
                self._video.finish()
            except ValueError as error:
                self.video_failure = str(error)
        return None if self.video_failure else self.video_path

    def shown(self, count: int = 3) -> list[Sample]:
        """So many samples spread over the recording, if possible with what the filter made of them."""
        known = [sample for sample in self.samples if sample.frame is not None] or self.samples
        if len(known) <= count:
            return known
        rows = np.rint((np.arange(count) + 0.5) / count * (len(known) - 1)).astype(int)
        return [known[k] for k in rows]


def _figures(seconds: NDArray[np.float64]) -> dict[str, float] | None:
    ms = 1e3 * seconds[np.isfinite(seconds)]
    if len(ms) == 0:
        return None
    return {
        "mean": float(ms.mean()),
        "median": float(np.median(ms)),
        "p99": float(np.percentile(ms, 99)),
        "max": float(ms.max()),
    }


def at_frames(run: libloc.SlamRun, front_end: dict[str, NDArray[Any]], name: str) -> NDArray[np.float64]:
    """A column of the front end, a row for each frame; NaN where it is not known."""
    rows = np.searchsorted(front_end["time_ns"], run.time_ns)
    rows = np.minimum(rows, max(len(front_end["time_ns"]) - 1, 0))
    out = np.full(len(run), np.nan)
    if len(front_end["time_ns"]):
        same = front_end["time_ns"][rows] == run.time_ns
        out[same] = front_end[name][rows[same]]
    return out


def whole_s(run: libloc.SlamRun, front_end: dict[str, NDArray[Any]]) -> NDArray[np.float64]:
    """(N,) Time for a frame: front end, filter, and what lies between them; without the IMU's samples."""
    picture = at_frames(run, front_end, "picture_s")
    # With an IMU the filter takes the frame when the sample after it comes, not in the picture's own call.
    later = np.any(np.isfinite(run.gyroscope_bias))
    return picture + run.time_spent_s if later else picture


def profile(run: libloc.SlamRun, front_end: dict[str, NDArray[Any]]) -> dict[str, dict[str, float] | None]:
    """Milliseconds of a frame by part."""
    parts = {
        "pyramid": front_end["pyramid_s"],
        "search": front_end["search_s"],
        "klt": front_end["klt_s"],
        "detect": front_end["detect_s"],
        "front_end": front_end["front_end_s"],
        "filter": run.time_spent_s,
        "whole": whole_s(run, front_end),
    }
    return {name: _figures(np.asarray(seconds)) for name, seconds in parts.items()}
