"""A pinhole camera and a canvas that draws polygons and lines of the world onto a picture.

Camera axes: x right, y down, z forward. Pixels: (0, 0) is the centre of the upper left one. What is drawn
later covers what was drawn before: the caller orders from far to near.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib import font_manager
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

Floats = NDArray[np.float64]
Rgb = tuple[int, int, int]
Rgba = tuple[int, int, int, int]

_NEAR_M = 0.5
_SUPERSAMPLING = 2  # smooth edges: drawn so many times larger, then reduced


@dataclass(frozen=True)
class Camera:
    eye: Floats  #: (3,) [m] in world
    target: Floats  #: (3,) [m], what is in the middle of the picture
    width: int
    height: int
    focal: float  #: [pixels]

    @property
    def axes(self) -> Floats:
        """(3, 3) rows: right, down, forward, in world. The picture is level."""
        forward = self.target - self.eye
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        norm = np.linalg.norm(right)
        if norm < 1e-6:
            raise ValueError("camera: looks straight up or down")
        right = right / norm
        return np.stack([right, np.cross(forward, right), forward])

    def in_camera(self, points: Floats) -> Floats:
        """(..., 3) world to camera axes [m]"""
        return (points - self.eye) @ self.axes.T

    def pixels(self, in_camera: Floats) -> Floats:
        """(..., 2) of points in camera axes that lie before it"""
        centre = np.array([(self.width - 1) / 2, (self.height - 1) / 2])
        return self.focal * in_camera[..., :2] / in_camera[..., 2:] + centre

    def project(self, points: Floats) -> Floats:
        """(..., 2) pixels of world points; NaN for those behind the camera."""
        p = self.in_camera(np.asarray(points, dtype=float))
        return np.where(p[..., 2:] > _NEAR_M, self.pixels(np.where(p[..., 2:] > _NEAR_M, p, 1.0)), np.nan)


def _clipped(p: Floats) -> Floats:
    """Of a polygon (N, 3) in camera axes, what is before the near plane."""
    if p[:, 2].min() > _NEAR_M:
        return p
    out = []
    for a, b in zip(p, np.roll(p, -1, axis=0), strict=True):
        if a[2] > _NEAR_M:
            out.append(a)
        if (a[2] > _NEAR_M) != (b[2] > _NEAR_M):
            out.append(a + (_NEAR_M - a[2]) / (b[2] - a[2]) * (b - a) + [0, 0, 1e-9])
    return np.array(out).reshape(-1, 3)


def mixed(colour: Rgb, other: Rgb, part: float) -> Rgb:
    """part = 0: colour, 1: other"""
    return tuple(round((1 - part) * a + part * b) for a, b in zip(colour, other, strict=True))  # type: ignore[return-value]


class Canvas:
    """One picture. Colours with a fourth value are transparent."""

    def __init__(self, camera: Camera, background: Image.Image) -> None:
        self.camera = camera
        self._axes_t = camera.axes.T
        self._image = background.copy()
        # Mixing with what is below takes four times as long: only for what is transparent.
        self._solid = ImageDraw.Draw(self._image)
        self._mixing = ImageDraw.Draw(self._image, "RGBA")
        self._limit = np.array(self._image.size) + 4.0

    def _on(self, colour: Rgb | Rgba) -> ImageDraw.ImageDraw:
        return self._mixing if len(colour) == 4 else self._solid

    @staticmethod
    def background(width: int, height: int, top: Rgb, bottom: Rgb) -> Image.Image:
        """A gradient, to begin with."""
        rows = np.linspace(0, 1, height * _SUPERSAMPLING)[:, None]
        colours = np.rint((1 - rows) * np.array(top) + rows * np.array(bottom)).astype(np.uint8)
        return Image.fromarray(np.repeat(colours[:, None], width * _SUPERSAMPLING, axis=1))

    @staticmethod
    def _points(pixels: Floats) -> list[float]:
        limited: list[float] = np.clip((pixels + 0.5) * _SUPERSAMPLING - 0.5, -1e5, 1e5).ravel().tolist()
        return limited

    def polygon(
        self, corners: Floats, fill: Rgb | Rgba | None, outline: Rgb | Rgba | None = None, width: float = 1
    ) -> bool:
        """corners (N, 3) in world, flat. False when it lies outside of the picture."""
        p = _clipped((corners - self.camera.eye) @ self._axes_t)
        if len(p) < 3:
            return False
        at = self.camera.pixels(p)
        if (at.max(axis=0) < -2).any() or (at.min(axis=0) * _SUPERSAMPLING > self._limit).any():
            return False
        pixels = self._points(at)
        if fill is not None:
            self._on(fill).polygon(pixels, fill=fill)
        if outline is not None:
            self._on(outline).line(pixels + pixels[:4], fill=outline, width=self._width(width), joint="curve")
        return True

    def line(self, points: Floats, colour: Rgb | Rgba, width: float) -> None:
        """points (N, 3) in world; what is behind the camera is left out."""
        p = (points - self.camera.eye) @ self._axes_t
        before = p[:, 2] > _NEAR_M
        edges = np.flatnonzero(np.diff(np.concatenate([[0], before.astype(np.int8), [0]])))
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            if end - begin > 1:
                pixels = self._points(self.camera.pixels(p[begin:end]))
                self._on(colour).line(pixels, fill=colour, width=self._width(width), joint="curve")

    # ---- in pixels of the picture
    def flat_polygon(self, pixels: Floats, fill: Rgb | Rgba) -> None:
        self._on(fill).polygon(self._points(pixels), fill=fill)

    def flat_line(self, pixels: Floats, colour: Rgb | Rgba, width: float) -> None:
        if len(pixels) > 1:
            self._on(colour).line(self._points(pixels), fill=colour, width=self._width(width), joint="curve")

    def flat_box(
        self, low: tuple[float, float], high: tuple[float, float], fill: Rgb | Rgba, radius: float
    ) -> None:
        corners = self._points(np.array([low, high]))
        self._on(fill).rounded_rectangle(corners, radius * _SUPERSAMPLING, fill=fill)

    def flat_dot(self, pixel: Floats, radius: float, fill: Rgb | Rgba, outline: Rgb | Rgba) -> None:
        (x, y), r = self._points(pixel), radius * _SUPERSAMPLING
        self._on(fill).ellipse([x - r, y - r, x + r, y + r], fill=fill, outline=outline, width=self._width(1))

    def text(
        self, pixel: tuple[float, float], text: str, size: float, colour: Rgb, bold: bool = False
    ) -> None:
        x, y = self._points(np.array(pixel))
        self._solid.text((x, y), text, fill=colour, font=_font(round(size * _SUPERSAMPLING), bold))

    def _width(self, width: float) -> int:
        return max(1, round(width * _SUPERSAMPLING))

    def picture(self) -> NDArray[np.uint8]:
        """(height, width, 3)"""
        return np.asarray(self._image.reduce(_SUPERSAMPLING))


_fonts: dict[tuple[int, bool], ImageFont.FreeTypeFont] = {}


def _font(size: int, bold: bool) -> ImageFont.FreeTypeFont:
    if (size, bold) not in _fonts:
        # The one that Matplotlib brings along: there is no other that every machine has.
        name = font_manager.FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal")
        _fonts[size, bold] = ImageFont.truetype(font_manager.findfont(name), size)
    return _fonts[size, bold]
