"""Pictures with what the filter made of them: features by state, search ellipses, residuals.

A picture and its slam_frame_t go together by camera and sequence, and are drawn at the time of the frame,
which is that of the estimates. Search ellipses: 3 deviations of measured less predicted, about the predicted
pixel.
"""

from __future__ import annotations

import io
from collections import Counter
from dataclasses import dataclass
from typing import Any

import loc
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from libloc.view.geometry import ellipses
from libloc.view.recorder import Recorder, Thinner

SEARCH_SIGMAS = 3.0  # FeatureTrackerOptions.search_sigmas
IMAGE = "world/camera/image"
_MATCH_NS = 1_000_000_000  # a picture and its frame are not further apart: a sequence may begin anew

_MESSAGES: Any = loc  # lcm-gen writes no types
_image_t, _slam_frame_t = _MESSAGES.image_t, _MESSAGES.slam_frame_t
#: State, its name for people, colour: colours that colour-blind readers tell apart, as in loc-slam's summary.
STATES = {
    _slam_frame_t.STATE_PREDICTED: ("expected, not used", (255, 127, 14)),
    _slam_frame_t.STATE_MEASURED: ("used", (23, 210, 230)),
    _slam_frame_t.STATE_RESCUED: ("used after the others", (60, 200, 60)),
    _slam_frame_t.STATE_REJECTED: ("not believed", (255, 40, 40)),
    _slam_frame_t.STATE_NEW: ("new in the map", (255, 235, 50)),
}
_RAW = {
    _image_t.PIXEL_FORMAT_GRAY: ("L", "L", 1),
    _image_t.PIXEL_FORMAT_RGB: ("RGB", "RGB", 3),
    _image_t.PIXEL_FORMAT_BGR: ("RGB", "BGR", 3),
}


class PictureError(ValueError):
    """A picture that cannot be shown; the text says why."""


def jpeg_of(m: Any, quality: int) -> bytes:
    """The picture of an image_t as a JPEG file: its own, or one that is made of raw pixels.

    Raises PictureError when it cannot be decoded, or is not what the message says.
    """
    if m.width <= 0 or m.height <= 0:
        raise PictureError(f"{m.width} x {m.height} pixels")
    data = bytes(m.data)
    if m.pixelformat == _image_t.PIXEL_FORMAT_MJPEG:
        try:
            with Image.open(io.BytesIO(data), formats=["JPEG"]) as picture:
                if picture.size != (m.width, m.height):
                    raise PictureError(f"a JPEG of {picture.size}, the message says {m.width, m.height}")
                # The cheapest way through all of the data.
                picture.draft("L", (max(m.width // 8, 1), max(m.height // 8, 1)))
                picture.load()
        except (OSError, SyntaxError, Image.DecompressionBombError) as error:
            raise PictureError(str(error)) from None
        return data
    if m.pixelformat not in _RAW:
        raise PictureError(f"pixel format {m.pixelformat:#x} is not known")
    mode, layout, channels = _RAW[m.pixelformat]
    if m.row_stride < m.width * channels or len(data) < m.row_stride * (m.height - 1) + m.width * channels:
        raise PictureError(f"{len(data)} bytes, rows of {m.row_stride}: too few for its pixels")
    pixels = Image.frombuffer(mode, (m.width, m.height), data, "raw", layout, m.row_stride, 1)
    file = io.BytesIO()
    pixels.save(file, "JPEG", quality=quality)
    return file.getvalue()


@dataclass(frozen=True)
class Features:
    """A slam_frame_t as arrays of N features."""

    time_ns: int
    camera: int
    sequence: int
    state: NDArray[np.int8]
    pixel_px: NDArray[np.float64]  # (N, 2) measured, NaN where it was not
    predicted_px: NDArray[np.float64]  # (N, 2)
    innovation_cov: NDArray[np.float64]  # (N, 2, 2)

    @staticmethod
    def of(m: Any) -> Features:
        """Raises ValueError for a state that is not known."""
        state = np.array(m.feature_state, dtype=np.int8)
        if len(state) and (state.min() < 0 or state.max() >= len(STATES)):
            raise ValueError("feature_state: is not known")
        cov = np.array(m.innovation_cov, dtype=float).reshape(-1, 3)
        return Features(
            m.time_ns,
            m.camera,
            m.sequence,
            state,
            np.column_stack([m.u_px, m.v_px]).astype(float).reshape(-1, 2),
            np.column_stack([m.predicted_u_px, m.predicted_v_px]).astype(float).reshape(-1, 2),
            cov[:, [0, 1, 1, 2]].reshape(-1, 2, 2),
        )

    @property
    def with_ellipse(self) -> NDArray[np.bool_]:
        finite = np.isfinite(self.innovation_cov).all(axis=(1, 2))
        return np.asarray(finite & np.isfinite(self.predicted_px).all(axis=1))


class Frames:
    """Frames to be found by the picture that they were made of."""

    def __init__(self) -> None:
        self._frames: dict[tuple[int, int], list[Features]] = {}

    def __len__(self) -> int:
        return sum(len(frames) for frames in self._frames.values())

    def add(self, frame: Features) -> None:
        self._frames.setdefault((frame.camera, frame.sequence), []).append(frame)

    def pop(self, picture: Any, offset_ns: int) -> Features | None:
        """The frame of an image_t; offset_ns takes its clock to that of the frames."""
        key = (picture.camera, picture.sequence)
        time_ns = picture.time_ns + offset_ns
        frames = self._frames.get(key, [])
        near = [frame for frame in frames if abs(frame.time_ns - time_ns) <= _MATCH_NS]
        if not near:
            return None
        best = min(near, key=lambda frame: abs(frame.time_ns - time_ns))
        frames.remove(best)
        if not frames:
            del self._frames[key]
        return best

    def rest(self, keep: int = 0) -> list[Features]:
        """Takes out what no picture has asked for, but for the newest keep; in the order of time."""
        frames = [frame for frames in self._frames.values() for frame in frames]
        frames.sort(key=lambda frame: frame.time_ns)
        self._frames.clear()
        split = max(len(frames) - keep, 0)
        for frame in frames[split:]:
            self.add(frame)
        return frames[:split]


class PictureDrawing:
    """Draws the pictures of one camera; those of others are counted."""

    def __init__(
        self, out: Recorder, camera: int, offset_ns: int, rate_hz: float | None, quality: int
    ) -> None:
        self.out, self.camera, self.offset_ns, self.quality = out, camera, offset_ns, quality
        self.counts: Counter[str] = Counter()
        self.size_px: tuple[int, int] | None = None
        self._legend_px: tuple[int, int] | None = None
        self.why_damaged = ""  # the first one
        self._thinner = Thinner(rate_hz)

    def draw(self, picture: Any | None, frame: Features | None) -> None:
        """An image_t with its frame, or one of them without the other."""
        if picture is not None and picture.camera != self.camera:
            self.counts["pictures.other_camera"] += 1
            return
        if frame is not None and frame.camera != self.camera:
            self.counts["frames.other_camera"] += 1
            return
        if frame is not None:
            time_ns = frame.time_ns
        elif picture is not None:
            time_ns = picture.time_ns + self.offset_ns
        else:
            return
        if not self._thinner.due(time_ns):
            self.counts["pictures.thinned"] += 1
            return
        if picture is not None:
            self._picture(time_ns, picture)
        if frame is not None:
            self._features(frame)
            self.counts["frames.drawn"] += 1
            if picture is None:
                self.counts["frames.without_picture"] += 1
        else:
            self.counts["pictures.without_frame"] += 1
            for part in ("features", "search", "residuals"):
                self.out.log(time_ns, f"{IMAGE}/{part}", self.out.rr.Clear(recursive=False))

    def _picture(self, time_ns: int, picture: Any) -> None:
        try:
            jpeg = jpeg_of(picture, self.quality)
        except PictureError as error:
            self.counts["pictures.damaged"] += 1
            self.why_damaged = self.why_damaged or f"picture {picture.sequence}: {error}"
            return
        self.out.log(time_ns, IMAGE, self.out.rr.EncodedImage(contents=jpeg, media_type="image/jpeg"))
        self.counts["pictures.drawn"] += 1
        self.size_px = (picture.width, picture.height)

    def _features(self, frame: Features) -> None:
        rr, out = self.out.rr, self.out
        if self.size_px is not None and self.size_px != self._legend_px:
            self._legend_px = self.size_px
            self._legend(*self.size_px)
        measured = np.asarray(np.isfinite(frame.pixel_px).all(axis=1))
        at = np.where(measured[:, None], frame.pixel_px, frame.predicted_px)
        shown = np.isfinite(at).all(axis=1)
        state = frame.state.astype(np.uint16)
        entity = f"{IMAGE}/features"
        out.style(entity, "Points2D", radii=rr.Radius.ui_points(3.0))
        out.log(frame.time_ns, entity, rr.Points2D(_centred(at[shown]), class_ids=state[shown]))
        rows = frame.with_ellipse
        outlines = _centred(ellipses(frame.predicted_px[rows], frame.innovation_cov[rows], SEARCH_SIGMAS))
        entity = f"{IMAGE}/search"
        out.style(entity, "LineStrips2D", radii=rr.Radius.ui_points(0.7))
        out.log(frame.time_ns, entity, rr.LineStrips2D(outlines, class_ids=state[rows]))
        rows = np.asarray(measured & np.isfinite(frame.predicted_px).all(axis=1))
        lines = _centred(np.stack([frame.predicted_px[rows], frame.pixel_px[rows]], axis=1))
        entity = f"{IMAGE}/residuals"
        out.style(entity, "LineStrips2D", colors=(255, 255, 255), radii=rr.Radius.ui_points(0.8))
        out.log(frame.time_ns, entity, rr.LineStrips2D(lines))

    def _legend(self, width: int, height: int) -> None:
        """Below the picture, where nothing is."""
        rr = self.out.rr
        self.out.static(
            IMAGE,
            rr.AnnotationContext(
                [
                    rr.AnnotationInfo(id=int(k), label=name, color=colour)
                    for k, (name, colour) in STATES.items()
                ]
            ),
        )
        columns = np.array([0.1, 0.42, 0.74])
        row, column = np.divmod(np.arange(len(STATES) + 1), 3)
        at = np.column_stack([width * columns[column], height * (1.035 + 0.065 * row)])
        self.out.static(
            f"{IMAGE}/legend",
            rr.Points2D(
                at,
                colors=[*(colour for _, colour in STATES.values()), (255, 255, 255)],
                labels=[*(name for name, _ in STATES.values()), f"ellipse: {SEARCH_SIGMAS:g} sigma"],
                show_labels=True,
                radii=rr.Radius.ui_points(4.0),
            ),
        )


def _centred(pixels: NDArray[Any]) -> NDArray[np.float32]:
    """libloc's pixel (0, 0) is the centre of the first pixel, rerun's is its corner."""
    return (pixels + 0.5).astype(np.float32)
