"""Writes pictures one after the other: H.264 video (.mp4, .mkv), animated .gif, or a folder of .png."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Frame = NDArray[np.uint8]

_VIDEO, _GIF = (".mp4", ".mkv"), ".gif"


class MissingPackageError(RuntimeError):
    """An optional package is needed for what was asked for; the text says which, and what works without."""


def check_video_path(path: Path, overwrite: bool) -> None:
    """Raises what write_video() would raise for this path, before any picture is drawn."""
    if path.suffix not in ("", _GIF, *_VIDEO):
        raise ValueError(
            f"{path}: a video's name ends with .mp4, .mkv or .gif; without an ending it is a folder of .png"
        )
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path.parent}: no such folder")
    if path.exists() and not overwrite:
        raise FileExistsError(f"{path}: exists already")
    if path.suffix == "" and path.exists() and (not path.is_dir() or _others(path)):
        raise FileExistsError(f"{path}: holds more than pictures of an earlier run, and is left alone")
    if path.suffix in _VIDEO:
        _av(path)


def _others(folder: Path) -> bool:
    return any(not one.match("frame_*.png") for one in folder.iterdir())


def _av(path: Path):  # type: ignore[no-untyped-def]
    try:
        import av
    except ImportError:
        raise MissingPackageError(
            f"{path}: videos need the Python package av (pip install av); {path.with_suffix(_GIF).name}, "
            f"or {path.with_suffix('').name} (a folder of .png), needs nothing more"
        ) from None
    if "libx264" not in av.codecs_available:
        raise MissingPackageError(
            f"{path}: this build of the Python package av cannot write H.264, that of PyPI can; "
            f"{path.with_suffix(_GIF).name}, or {path.with_suffix('').name} (a folder of .png), needs nothing"
        )
    return av


def write_video(
    path: str | os.PathLike[str], frames: Iterable[Frame], rate_hz: float, overwrite: bool = False
) -> int:
    """Writes frames (height, width, 3) and returns how many. The file is there only when it is complete.

    Raises ValueError for another ending, a rate that is not positive, frames that differ in size or none at
    all; FileExistsError unless overwrite; MissingPackageError when the ending needs one.
    """
    path = Path(path)
    if not 0 < rate_hz <= 240:
        raise ValueError(f"rate_hz = {rate_hz}: must be positive, at most 240")
    check_video_path(path, overwrite)
    checked = _checked(frames)
    if path.suffix == "":
        return _write_folder(path, checked)
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        count = (_write_gif if path.suffix == _GIF else _write_h264)(part, checked, rate_hz)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
    return count


def _checked(frames: Iterable[Frame]) -> Iterator[Frame]:
    shape = None
    for i, frame in enumerate(frames):
        if frame.ndim != 3 or frame.shape[2] != 3 or frame.dtype != np.uint8:
            raise ValueError(f"frame {i}: is {frame.dtype} {frame.shape}, must be uint8 (height, width, 3)")
        if shape is not None and frame.shape != shape:
            raise ValueError(f"frame {i}: has shape {frame.shape}, the first has {shape}")
        shape = frame.shape
        yield frame
    if shape is None:
        raise ValueError("frames: there are none")


def _write_folder(path: Path, frames: Iterator[Frame]) -> int:
    path.mkdir(exist_ok=True)
    for old in path.glob("frame_*.png"):
        old.unlink()
    count = 0
    for frame in frames:
        Image.fromarray(frame).save(path / f"frame_{count:05d}.png")
        count += 1
    return count


def _write_gif(path: Path, frames: Iterator[Frame], rate_hz: float) -> int:
    # One palette for all, of the first picture: otherwise colours flicker. GIF counts in 1/100 s.
    first = Image.fromarray(next(frames)).quantize(256, dither=Image.Dither.NONE)
    count = 1

    def rest() -> Iterator[Image.Image]:
        nonlocal count
        for frame in frames:
            count += 1
            yield Image.fromarray(frame).quantize(palette=first, dither=Image.Dither.NONE)

    duration_ms = max(20, 10 * round(100 / rate_hz))
    first.save(path, save_all=True, append_images=rest(), duration=duration_ms, loop=0, optimize=False)
    return count


def _write_h264(path: Path, frames: Iterator[Frame], rate_hz: float) -> int:
    av = _av(path)
    count = 0
    with av.open(os.fspath(path), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(rate_hz).limit_denominator(1000))
        # What every browser plays; the index in front, so that it begins before it is loaded.
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": "23", "preset": "veryfast"}
        for frame in frames:
            if count == 0:
                stream.height, stream.width = frame.shape[0] // 2 * 2, frame.shape[1] // 2 * 2
            even = np.ascontiguousarray(frame[: stream.height, : stream.width])
            container.mux(stream.encode(av.VideoFrame.from_ndarray(even, format="rgb24")))
            count += 1
        container.mux(stream.encode(None))
    return count
