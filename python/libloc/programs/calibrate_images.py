"""Pictures for loc-calibrate camera: files, folders, videos and LCM logs, and the corners found in them."""

from __future__ import annotations

import csv
import io
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

import libloc
from libloc import DataError
from libloc.lcm_log import LogReader

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".webp")
_WANTED_OF_VIDEO = 500  # pictures of a video that are searched when no --step is given

Grey = NDArray[np.uint8]


@dataclass
class Corners:
    """The target's corners in all pictures that were read."""

    names: list[str] = field(default_factory=list)
    views: list[libloc.TargetView] = field(default_factory=list)  # one for each picture, perhaps empty
    width_px: int = 0
    height_px: int = 0
    left_out: int = 0  # corners that were not sharp enough
    counts: dict[str, int] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)  # one sentence a picture that could not be read
    interrupted: bool = False

    def count(self, name: str) -> None:
        self.counts[name] = self.counts.get(name, 0) + 1


def _grey(image: Image.Image) -> Grey:
    """8 bits; of deeper pictures the upper ones. As stored: no tag turns the picture."""
    if image.mode.startswith("I"):
        values = np.asarray(image)
        return np.ascontiguousarray(np.clip(values >> 8, 0, 255).astype(np.uint8))
    return np.ascontiguousarray(np.asarray(image.convert("L")))


def _of_file(path: Path) -> Grey:
    try:
        with Image.open(path) as image:
            return _grey(image)
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        raise DataError(f"{path}: is no picture, or a damaged one: {error}") from None


def of_message(message: Any, where: str) -> Grey:
    """A loc.image_t."""
    data = bytes(message.data)
    if message.pixelformat == message.PIXEL_FORMAT_MJPEG:
        try:
            with Image.open(io.BytesIO(data)) as image:
                return _grey(image)
        except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
            raise DataError(f"{where}: damaged JPEG: {error}") from None
    channels = 1 if message.pixelformat == message.PIXEL_FORMAT_GRAY else 3
    row = message.width * channels
    if not 0 < row <= message.row_stride or len(data) < message.height * message.row_stride:
        raise DataError(
            f"{where}: {len(data)} bytes are too few for {message.width} x {message.height} pixels"
        )
    rows = np.frombuffer(data, np.uint8, message.height * message.row_stride)
    rows = rows.reshape(message.height, message.row_stride)[:, :row]
    if channels == 1:
        return np.ascontiguousarray(rows)
    colours = rows.reshape(message.height, message.width, 3)
    if message.pixelformat == message.PIXEL_FORMAT_BGR:
        colours = colours[..., ::-1]
    return _grey(Image.fromarray(np.ascontiguousarray(colours)))


def _of_folder(folder: Path, camera: int) -> list[Path]:
    for part in (folder / "mav0", folder):  # EuRoC
        data = part / f"cam{camera}" / "data"
        if data.is_dir():
            folder = data
            break
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() in PICTURES)
    if not files:
        raise DataError(f"{folder}: there are no pictures in it ({', '.join(PICTURES)})")
    return files


# A picture, or why it cannot be read.
Item = tuple[str, "Grey | DataError"]


def _video(path: Path, step: int | None) -> Iterator[Item]:
    try:
        import av
    except ImportError:
        raise DataError(f"{path}: videos need the Python package av: pip install 'libloc[video]'") from None
    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                raise DataError(f"{path}: there is no video in it")
            stream = container.streams.video[0]
            step = step or max(1, stream.frames // _WANTED_OF_VIDEO)
            for i, frame in enumerate(container.decode(stream)):
                if i % step == 0:
                    yield f"{path.name}:{i}", np.ascontiguousarray(frame.to_ndarray(format="gray"))
    except av.error.FFmpegError as error:
        raise DataError(f"{path}: cannot be read as pictures, video or LCM log: {error}") from None


def _log(path: Path, camera: int, step: int) -> Iterator[Item]:
    number = 0
    for event in LogReader(path):
        if type(event.message).__name__ != "image_t" or event.message.camera != camera:
            continue
        if number % step == 0:
            name = f"{path.name}:{event.event_number}"
            try:
                yield name, of_message(event.message, f"{path}: event {event.event_number}")
            except DataError as error:
                yield name, error
        number += 1
    if number == 0:
        raise DataError(f"{path}: there are no pictures of camera {camera} in it")


def pictures(inputs: list[Path], camera: int, step: int | None) -> tuple[Iterator[Item], int | None]:
    """The pictures of all inputs in order, and how many when that is known.

    camera: of a log or an EuRoC folder.
    """
    files: list[Path] = []
    streams: list[Path] = []
    for path in inputs:
        if path.is_dir():
            files += _of_folder(path, camera)
        elif not path.is_file():
            raise DataError(f"{path}: no such file or folder")
        elif path.suffix.lower() in PICTURES:
            files.append(path)
        else:
            streams.append(path)
    if files and streams:
        raise DataError(f"{streams[0]}: is no picture: pictures, videos and logs cannot be mixed")
    if files:
        files = files[:: step or 1]

        def read() -> Iterator[Item]:
            for path in files:
                try:
                    yield path.name, _of_file(path)
                except DataError as error:
                    yield path.name, error

        return read(), len(files)

    def stream() -> Iterator[Item]:
        for path in streams:
            with path.open("rb") as file:
                is_log = file.read(4) == bytes.fromhex("eda1da01")
            yield from _log(path, camera, step or 1) if is_log else _video(path, step)

    return stream(), None


class Progress:
    """One line that is written over; nothing where no one looks on."""

    def __init__(self, total: int | None, stream: TextIO) -> None:
        self._total = total
        self._stream = stream
        self._terminal = stream.isatty()

    def show(self, done: int, found: int) -> None:
        if not self._terminal:
            return
        bar = ""
        if self._total:
            full = 30 * done // self._total
            bar = f"[{'#' * full}{'.' * (30 - full)}] "
        total = f" of {self._total}" if self._total else ""
        self._stream.write(f"\r{bar}picture {done}{total}, target in {found} (Ctrl-C: go on with these) ")
        self._stream.flush()

    def end(self) -> None:
        if self._terminal:
            self._stream.write("\n")


def find_corners(
    target: libloc.CalibrationTarget, items: Iterator[Item], total: int | None, stream: TextIO | None = None
) -> Corners:
    """Searches all pictures; Ctrl-C ends the search and keeps what was found.

    Pictures that cannot be read, or have another size than most that show the target, are left out and named.
    Raises DataError when nothing can be read, or the target is in none of the pictures.
    """
    detector = libloc.TargetDetector(target)
    out = Corners()
    progress = Progress(total, stream or sys.stderr)
    found: dict[tuple[int, int], list[tuple[str, libloc.TargetDetection]]] = {}
    first: list[Grey] = []
    searched = hits = 0
    try:
        for name, picture in items:
            if isinstance(picture, DataError):
                out.count("pictures.skipped.unreadable")
                out.skipped.append(str(picture))
                continue
            seen = detector.detect(picture)
            height, width = picture.shape
            found.setdefault((width, height), []).append((name, seen))
            searched += 1
            hits += len(seen.view) > 0
            if len(first) < 4:
                first.append(picture)
            progress.show(searched, hits)
    except KeyboardInterrupt:
        out.interrupted = True
    progress.end()
    if not found:
        why = f": {out.skipped[0]}" if out.skipped else ""
        raise DataError(f"not one picture could be read{why}")
    if hits == 0:
        reasons = [seen.reason for group in found.values() for _, seen in group]
        hint = other_target(target, first)
        raise DataError(
            f"the target ({target}) is in none of {searched} pictures: "
            f"{max(set(reasons), key=reasons.count)}." + (f" {hint}" if hint else "")
        )
    size = max(found, key=lambda s: sum(len(seen.view) > 0 for _, seen in found[s]))
    out.width_px, out.height_px = size
    for name, seen in found.pop(size):
        out.names.append(name)
        out.views.append(seen.view)
        out.left_out += seen.corners_left_out
    for (width, height), group in found.items():
        for name, _ in group:
            out.count("pictures.skipped.other_size")
            out.skipped.append(f"{name} has {width} x {height} pixels, the others {size[0]} x {size[1]}")
    out.counts["pictures.searched"] = searched
    out.counts["pictures.with_target"] = sum(len(view) > 0 for view in out.views)
    return out


def other_target(target: libloc.CalibrationTarget, some: list[Grey]) -> str:
    """The usual mistakes."""
    if target.is_april_grid:
        detector = libloc.TargetDetector(target)
        if any(len(detector.detect(np.ascontiguousarray(p[:, ::-1])).view) for p in some):
            return "It is in the mirrored pictures: they must not be mirrored."
        return ""
    for dx, dy in ((-1, -1), (1, 1), (-1, 0), (0, -1), (1, 0), (0, 1)):
        columns, rows = target.columns + dx, target.rows + dy
        if min(columns, rows) < 3:
            continue
        other = libloc.CalibrationTarget(f"checkerboard {columns}x{rows} {target.size_m}")
        if any(len(libloc.TargetDetector(other, thorough=False).detect(p).view) for p in some):
            return f"A board of {columns}x{rows} is: inner corners are counted, not squares."
    return ""


def read_corner_table(path: Path, target: libloc.CalibrationTarget, width_px: int, height_px: int) -> Corners:
    """Corners of any detector (CSV: timestamp_ns, tag_id and corner_index or corner_id, u_px, v_px).

    The pictures come in the order in which the table names them first. A last line that was cut while it was
    written is left out and counted. Raises DataError naming file, line and value.
    """
    out = Corners(width_px=width_px, height_px=height_px)
    pictures_of: dict[int, dict[int, tuple[float, float]]] = {}
    corner_count = len(target.corners())
    with path.open("rb") as binary:
        binary.seek(0, io.SEEK_END)
        binary.seek(max(0, binary.tell() - 1))
        cut = binary.read(1) not in (b"\n", b"\r")
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
        reader = csv.reader(file)
        names = [name.strip() for name in next(reader, [])]
        by_tag = {"tag_id", "corner_index"} <= set(names)
        if not {"timestamp_ns", "u_px", "v_px"} <= set(names) or not (by_tag or "corner_id" in names):
            raise DataError(
                f"{path}:1: the heading must name timestamp_ns, u_px, v_px, "
                "and tag_id and corner_index or corner_id"
            )
        time, u, v = (names.index(name) for name in ("timestamp_ns", "u_px", "v_px"))
        tag, index = (
            names.index(name) for name in (("tag_id", "corner_index") if by_tag else ("corner_id",) * 2)
        )
        rows = ((reader.line_num, row) for row in reader if row)
        line, row = next(rows, (0, []))
        while row:
            at, cells = line, row
            line, row = next(rows, (0, []))
            if not row and cut:
                out.counts["rows.skipped.no_line_end"] = 1  # its last number may have lost digits
                break
            where = f"{path}:{at}"
            if len(cells) != len(names):
                raise DataError(f"{where}: {len(cells)} cells, not {len(names)}")
            try:
                stamp = int(cells[time])
            except ValueError:
                raise DataError(
                    f"{where}: timestamp_ns '{cells[time]}' is no number of nanoseconds"
                ) from None
            if not -(2**63) < stamp < 2**63:
                raise DataError(f"{where}: timestamp_ns {stamp} is out of range")
            try:
                if by_tag:
                    corner = int(cells[index])
                    number = 4 * (int(cells[tag]) - target.first_tag) + corner
                    known = 0 <= corner < 4
                else:
                    number, known = int(cells[index]), True
                pixel = (float(cells[u]), float(cells[v]))
            except ValueError as error:
                raise DataError(f"{where}: {error}") from None
            known = known and 0 <= number < corner_count
            if not (known and math.isfinite(pixel[0]) and math.isfinite(pixel[1])):
                what = f"{corner} of tag {cells[tag]}" if by_tag else f"{number}"
                raise DataError(f"{where}: corner {what} at {pixel} is none of {target}")
            picture = pictures_of.setdefault(stamp, {})
            if number in picture:
                raise DataError(f"{where}: corner {number} comes twice in the picture of {stamp}")
            picture[number] = pixel
    for stamp, corners in pictures_of.items():
        out.names.append(str(stamp))
        ids = np.array(sorted(corners), dtype=np.int64)
        out.views.append(libloc.TargetView(ids, np.array([corners[i] for i in ids.tolist()]), stamp))
    out.counts["pictures.with_target"] = len(out.names)
    if not out.names:
        raise DataError(f"{path}: there are no corners in it")
    return out
