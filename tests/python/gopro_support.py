"""Writes small MP4 files with a GPMF track, after GoPro's public description of GPMF
(github.com/gopro/gpmf-parser): what a GoPro writes besides picture and sound."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

# Size in bytes, and NumPy type, of GPMF's type letters.
_TYPES = {"s": ">i2", "S": ">u2", "l": ">i4", "L": ">u4", "f": ">f4", "J": ">u8"}


def klv(key: str, kind: str, values, size: int | None = None, repeat: int | None = None) -> bytes:
    """Key, type, size of one structure, their number, data filled up to 4 bytes. Arrays: one a row."""
    if kind in ("c", "?", "U"):
        data = values if isinstance(values, bytes) else values.encode("latin-1")
        size = len(data) if size is None else size
        repeat = 1 if repeat is None else repeat
    else:
        array = np.asarray(values, dtype=_TYPES[kind])
        size = array.itemsize * (array.shape[1] if array.ndim == 2 else 1)
        repeat = len(array) if array.ndim else 1
        data = array.tobytes()
    return _filled(struct.pack(">4s1sBH", key.encode(), kind.encode(), size, repeat) + data)


def nest(key: str, *parts: bytes) -> bytes:
    data = b"".join(parts)
    return _filled(struct.pack(">4sBBH", key.encode(), 0, 1, len(data)) + data)


def _filled(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


@dataclass
class Gopro:
    """A recording in payloads of one second, as a GoPro makes it. Arrays hold one row per sample, in the
    order of `orientation` (empty: no such tag, as of a HERO5)."""

    accl: np.ndarray  # [m/s^2]
    gyro: np.ndarray  # [rad/s]
    accl_rate_hz: int = 200
    gyro_rate_hz: int = 200
    orientation: str = "YxZ"
    orientation_out: str = "ZXY"
    stamps: bool = True  # STMP, microseconds
    stamp_offset_us: int = 0
    gps5: np.ndarray | None = None  # rows: lat, lon [deg], alt [m], speed, speed 3-D [m/s]
    gps9: np.ndarray | None = None  # rows: the same, days, seconds, DOP, fix
    gps_fix: int = 3
    gps_dop: float = 1.5
    altitude_system: str = ""  # GPSA
    model: str = "HERO7 Black"
    second_s: float = 1.001  # how long a payload lasts in the file: 30000/1001 pictures a second
    accl_scale: int = 418
    gyro_scale: int = 939
    unit_accl: str = "m/s\xb2"
    unit_gyro: str = "rad/s"
    changed_stamps: dict[int, int] = field(default_factory=dict)  # payload -> STMP of the gyroscope

    def payloads(self) -> list[bytes]:
        count = len(self.gyro) // self.gyro_rate_hz
        return [self._payload(k) for k in range(count)]

    def _stream(self, k: int, key: str, rate: int, *tags: bytes, gyroscope: bool = False) -> bytes:
        stamp = b""
        if self.stamps:
            us = self.stamp_offset_us + round(k * self.second_s * 1e6)
            stamp = klv("STMP", "J", [self.changed_stamps.get(k, us) if gyroscope else us])
        return nest("STRM", stamp, klv("TSMP", "L", [(k + 1) * rate]), klv("STNM", "c", key), *tags)

    def _payload(self, k: int) -> bytes:
        axes = b""
        if self.orientation:
            axes = klv("ORIN", "c", self.orientation)
            if self.orientation_out:
                axes += klv("ORIO", "c", self.orientation_out)
        streams = []
        for key, rows, rate, scale, unit in (
            ("ACCL", self.accl, self.accl_rate_hz, self.accl_scale, self.unit_accl),
            ("GYRO", self.gyro, self.gyro_rate_hz, self.gyro_scale, self.unit_gyro),
        ):
            part = np.rint(rows[k * rate : (k + 1) * rate] * scale)
            tags = (klv("SIUN", "c", unit), klv("SCAL", "s", [scale]), axes, klv(key, "s", part))
            if len(part):
                streams.append(self._stream(k, key, rate, *tags, gyroscope=key == "GYRO"))
        if self.gps5 is not None:
            rate = 18
            scale = [10_000_000, 10_000_000, 1000, 1000, 100]
            part = np.rint(self.gps5[k * rate : (k + 1) * rate] * scale)
            tags = [klv("GPSF", "L", [self.gps_fix]), klv("GPSU", "U", "260102030405.678")]
            tags += [klv("GPSP", "S", [round(self.gps_dop * 100)])]
            if self.altitude_system:
                tags.append(klv("GPSA", "c", self.altitude_system))
            tags += [klv("SCAL", "l", scale), klv("GPS5", "l", part)]
            streams.append(self._stream(k, "GPS5", rate, *tags))
        if self.gps9 is not None:
            rate = 10
            scale = [10_000_000, 10_000_000, 1000, 1000, 100, 1, 1000, 100, 1]
            part = np.rint(self.gps9[k * rate : (k + 1) * rate] * scale).astype(int)
            data = b"".join(struct.pack(">lllllllHH", *row) for row in part.tolist())
            tags = [klv("TYPE", "c", "lllllllSS"), klv("SCAL", "l", scale)]
            tags.append(klv("GPS9", "?", data, size=32, repeat=len(part)))
            streams.append(self._stream(k, "GPS9", rate, *tags))
        return nest("DEVC", klv("DVID", "L", [1]), klv("DVNM", "c", self.model), *streams)

    def write(self, path: Path) -> Path:
        return write_mp4(path, self.payloads(), self.second_s, self.model)


def _box(kind: str, *parts: bytes) -> bytes:
    data = b"".join(parts)
    return struct.pack(">I4s", 8 + len(data), kind.encode()) + data


def _full(kind: str, *parts: bytes, flags: int = 0) -> bytes:
    return _box(kind, struct.pack(">I", flags), *parts)


def write_mp4(
    path: Path,
    payloads: list[bytes],
    second_s: float,
    model: str,
    format: str = "gpmd",
    video: Path | None = None,
) -> Path:
    """ftyp, mdat, moov with one track of metadata, every payload lasting second_s; after those of another
    file where one is given."""
    scale = 1000
    each = round(second_s * scale)
    total = each * len(payloads)
    matrix = struct.pack(">9I", 0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000)
    mvhd = struct.pack(">4IIH", 0, 0, scale, total, 0x10000, 0x100)
    tracks = _full("mvhd", mvhd, bytes(10), matrix, bytes(24), struct.pack(">I", 2))
    start = _box("ftyp", b"mp41", struct.pack(">I", 0x20131018), b"mp41")
    if video is not None:
        data = video.read_bytes()
        moov = data.rindex(b"moov") - 4  # the muxer writes it last
        start, tracks = data[:moov], data[moov + 8 :]
    offsets = np.cumsum([len(start) + 8, *map(len, payloads)])[:-1]
    count = len(payloads)
    table = _box(
        "stbl",
        _full("stsd", struct.pack(">I", 1), _box(format, bytes(6), struct.pack(">HI", 1, 0))),
        _full("stts", struct.pack(">3I", 1, count, each)),
        _full("stsc", struct.pack(">4I", 1, 1, 1, 1)),
        _full("stsz", struct.pack(">2I", 0, count), *(struct.pack(">I", len(p)) for p in payloads)),
        _full("stco", struct.pack(">I", count), *(struct.pack(">I", o) for o in offsets)),
    )
    name = b"\x0b  GoPro MET" if format == "gpmd" else b"\x05other"
    media = _box(
        "mdia",
        _full("mdhd", struct.pack(">4IHH", 0, 0, scale, total, 0x55C4, 0)),
        _full("hdlr", b"mhlr", b"meta", bytes(12), name),
        _box(
            "minf",
            _box("gmhd", _full("gmin", bytes(12))),
            _box("dinf", _full("dref", struct.pack(">I", 1), _full("url ", flags=1))),
            table,
        ),
    )
    identity = struct.pack(">5I", 0, 0, 9, 0, total)
    header = _full("tkhd", identity, bytes(16), matrix, struct.pack(">2I", 0, 0), flags=15)
    trak = _box("trak", header, media)
    movie = _box("moov", tracks, trak, _box("udta", _box("FIRM", model.encode())))
    path.write_bytes(start + _box("mdat", *payloads) + movie)
    return path
