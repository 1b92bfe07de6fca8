"""What loc-slam reads: features with identities from a tracks file or a recording, or pictures; rig, options,
truth."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np

import libloc
from libloc import DataError, SlamMotion, SlamOptions
from libloc.programs.evaluate_input import Poses, normalised, read_reference
from libloc.programs.slam_pictures import PictureInput, find_pictures, rig_of_euroc

# The methods as loc-estimator calls them.
METHODS = {"mono-slam": SlamMotion.CONSTANT_VELOCITY, "inertial-slam": SlamMotion.INERTIAL}


@dataclass
class SlamInput:
    path: Path
    form: str  # "tracks", or as libloc.file_format or libloc.picture_format names it
    features: libloc.FeaturesArrays | libloc.FrameFeatures | None
    imu: libloc.ImuArrays | None
    rig: libloc.Rig
    reference: Poses | None
    counts: dict[str, int] = field(default_factory=dict)  # what was read and skipped, and why
    images: int = 0  # pictures in a recording
    pictures: PictureInput | None = None  # in place of features
    gps: libloc.GpsArrays | None = None


def _is_tracks_file(path: Path) -> bool:
    """Four numbers a line; a TUM trajectory has eight."""
    with path.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            data = line.split("#", 1)[0].split()
            if data:
                return len(data) == 4
    return False


def _read_tracks(
    path: Path, options: argparse.Namespace, rig: libloc.Rig
) -> tuple[libloc.FrameFeatures, dict[str, int]]:
    rate_hz = options.rate_hz or rig.cameras[options.camera].rate_hz
    if not rate_hz > 0:
        raise DataError(
            f"{path}: a tracks file has no times: give --rate-hz, or rate_hz of the camera in --config"
        )
    frame, feature, pixel_px, counts = libloc.read_tracks(path)
    features = libloc.features_of_tracks(
        frame,
        feature,
        pixel_px,
        rate_hz=rate_hz,
        start_time_ns=options.start_time or 0,
        camera=options.camera,
    )
    return features, counts


def _own_reference(path: Path, form: str, recording: libloc.Recording) -> Poses | None:
    """The truth in the recording, if it has places."""
    r = recording.reference
    if not np.isfinite(r.position).all(axis=1).any():
        return None
    keep = np.ones(len(r.times_ns), dtype=bool)
    keep[1:] = r.times_ns[1:] > np.maximum.accumulate(r.times_ns)[:-1]
    return Poses(
        path,
        form,
        r.times_ns[keep],
        normalised(r.q_world_body_wxyz, path)[keep],
        r.position[keep],
        r.score[keep],
    )


def _read_recording(
    path: Path, form: str, rig: libloc.Rig | None, camera: int
) -> tuple[libloc.Recording, libloc.Rig]:
    """With the file's own camera where it has one and no rig is given."""
    if form != "eqvio":
        assert rig is not None
        return libloc.read_recording(path), rig
    source = libloc.open_eqvio(path, camera=None if rig is None else rig.cameras[camera])
    return source.read_all(), source.rig if rig is None else rig


def read_input(options: argparse.Namespace) -> SlamInput:
    """Raises DataError naming file, line, field and value."""
    path: Path = options.input
    rig = None
    if options.config is not None:
        rig = libloc.read_any_rig(options.config)
        if options.camera >= len(rig.cameras):
            raise DataError(
                f"{options.config}: has {len(rig.cameras)} cameras, the one asked for is {options.camera}"
            )
    pictures = find_pictures(path, options)
    if pictures is not None and pictures.form != "lcm":
        given = _read_pictures(pictures, rig, options)
    else:
        given = _read_features(path, rig, options)
        if not np.any(np.asarray(given.features.camera) == options.camera):
            if pictures is None or not given.images:
                raise DataError(_no_features(path, given, options.camera))
            given.features, given.pictures = None, pictures
    if given.pictures is None:
        for name in ("imu", "name_unit", "video"):
            if getattr(options, name) is not None:
                raise DataError(f"{path}: holds no pictures, --{name.replace('_', '-')} is for them")
    if options.reference:
        given.reference = read_reference(options.reference)
        if not given.reference.has_position().any():
            raise DataError(f"{options.reference}: no positions in it")
    return given


def _read_pictures(pictures: PictureInput, rig: libloc.Rig | None, options: argparse.Namespace) -> SlamInput:
    """All but the pictures themselves."""
    path = pictures.path
    recording = None
    if pictures.form == "euroc":
        if rig is None:
            rig = rig_of_euroc(path, options.camera)
        recording = libloc.read_recording(path)
    elif options.imu is not None:
        recording = libloc.read_recording(options.imu)
        if len(recording.imu.times_ns) == 0:
            raise DataError(f"{options.imu}: no IMU samples in it")
    if rig is None:
        raise DataError(f"{path}: does not tell the camera's calibration: give --config")
    imu = None if recording is None else recording.imu
    reference = None
    if recording is not None and not options.reference:
        reference = _own_reference(options.imu or path, pictures.form, recording)
    counts = {} if recording is None else dict(recording.counts)
    gps = None if recording is None else recording.gps
    return SlamInput(path, pictures.form, None, imu, rig, reference, counts, pictures=pictures, gps=gps)


def _read_features(path: Path, rig: libloc.Rig | None, options: argparse.Namespace) -> SlamInput:
    form = libloc.file_format(path)
    if rig is None and form != "eqvio":
        raise DataError(f"{path}: does not tell the camera's calibration: give --config")
    if form == "tum" and _is_tracks_file(path):
        assert rig is not None
        if options.tracks is not None:
            raise DataError(f"{path}: is a tracks file, --tracks is for recordings")
        features, counts = _read_tracks(path, options, rig)
        return SlamInput(path, "tracks", features, None, rig, None, counts)
    recording, rig = _read_recording(path, form, rig, options.camera)
    reference = None if options.reference else _own_reference(path, form, recording)
    given = SlamInput(path, form, recording.features, recording.imu, rig, reference, recording.counts)
    given.images = recording.images
    given.gps = recording.gps
    if options.tracks is not None:
        if options.start_time is None:
            raise DataError(
                f"{options.tracks}: a tracks file has no times: give --start-time, on the clock of {path}"
            )
        given.features, counts = _read_tracks(options.tracks, options, rig)
        given.counts |= counts
    else:
        for name in ("rate_hz", "start_time"):
            if getattr(options, name) is not None:
                option = f"--{name.replace('_', '-')}"
                raise DataError(f"{path}: is a recording with times of its own, {option} is for tracks files")
    return given


def _no_features(path: Path, given: SlamInput, camera: int) -> str:
    cameras = sorted(set(given.features.camera.tolist()))
    held = f"those of cameras {cameras}" if cameras else "none at all (--tracks takes them from another file)"
    if given.images:
        held += f", and {given.images} pictures, which are not searched for features"
    return f"{path}: no features of camera {camera} in it; it holds {held}"


def _parsed(old: Any, text: str) -> Any:
    """Text as a value of the same type as the old one."""
    if isinstance(old, bool):
        if text not in ("true", "false"):
            raise ValueError("must be true or false")
        return text == "true"
    if isinstance(old, IntEnum):
        names = {name.lower().replace("_", "-"): value for name, value in type(old).__members__.items()}
        if text not in names:
            raise ValueError(f"must be one of {', '.join(names)}")
        return names[text]
    if isinstance(old, int):
        return int(text)
    if isinstance(old, float):
        return float(text)
    if isinstance(old, np.ndarray):
        values = [float(x) for x in text.split(",")]
        if len(values) != len(old):
            raise ValueError(f"must be {len(old)} numbers with commas between them")
        return values
    if old is None:
        return [float(x) for x in text.split(",")] if "," in text else float(text)
    raise ValueError("cannot be set here")


def set_option(options: Any, setting: str, argument: str = "--set", kind: str = "SlamOptions") -> None:
    """NAME=VALUE, with names as in SlamOptions: map.max_features=60. Raises ValueError naming it."""
    name, separator, text = setting.partition("=")
    *outer, last = name.split(".")
    target: Any = options
    for part in outer:
        target = getattr(target, part, None)
    if not separator or not hasattr(target, last) or callable(getattr(target, last)):
        raise ValueError(f"{argument} {setting}: must be NAME=VALUE, with a field of {kind}")
    try:
        setattr(target, last, _parsed(getattr(target, last), text))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{argument} {setting}: {error}") from None


def slam_options(options: argparse.Namespace, given: SlamInput) -> SlamOptions:
    """Noise of the rig, then the file of settings, then the command line; the camera is the rig's.

    Raises DataError and ValueError naming a field.
    """
    out = SlamOptions()
    if given.rig.imu is not None:
        out.imu_noise = given.rig.imu.noise
    if options.method is not None:
        out.motion = METHODS[options.method]
    elif given.pictures is not None and options.slam_config is not None:
        out.motion = libloc.read_slam_options(options.slam_config).motion
    if given.pictures is not None:
        out = libloc.slam_options_for_images(out)
    if options.slam_config is not None:
        out = libloc.read_slam_options(options.slam_config, out)
        if options.method is not None and out.motion != METHODS[options.method]:
            raise DataError(
                f"{options.slam_config}: motion is another one than that of --method {options.method}"
            )
    out.camera = given.rig.cameras[options.camera]
    out.camera_index = options.camera
    if options.sigma_px is not None:
        out.sigma_px = options.sigma_px
        out.override_sigma = True
    for setting in options.set:
        set_option(out, setting)
    out.check()
    if out.motion == SlamMotion.INERTIAL and (given.imu is None or len(given.imu.times_ns) == 0):
        raise DataError(f"{given.path}: no IMU samples in it, which inertial-slam needs")
    return out


def front_end_options(settings: list[str]) -> Any:
    """FeatureTrackerOptions of NAME=VALUE. Raises ValueError naming one."""
    out = libloc.FeatureTrackerOptions()
    for setting in settings:
        set_option(out, setting, "--front-end", "FeatureTrackerOptions")
    out.check()
    return out


def method_of(options: SlamOptions) -> str:
    return next(name for name, motion in METHODS.items() if motion == options.motion)


def saved_state(path: Path, options: SlamOptions) -> libloc.SlamSnapshot:
    """Raises DataError when it cannot be read, or was made with another camera or motion."""
    file = libloc.load_slam(path)
    why = file.why_not_restorable(options)
    if why:
        raise DataError(f"--map-in {path}: {why}")
    return file.snapshot
