"""Layout of WAV files: where the samples are, and decoding those that need no library.

Plain PCM16, PCM24 and float32 are decoded with numpy, several times faster than by libsndfile and
equal to it sample for sample.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

_PCM, _FLOAT = 1, 3
#: Encodings that are decoded here: (format code, bits) -> libsndfile's name.
_PLAIN = {(_PCM, 16): "PCM_16", (_PCM, 24): "PCM_24", (_FLOAT, 32): "FLOAT"}
#: First bytes of a WAV file -> how its numbers are written: big-endian, or with 64-bit sizes.
_ORDERS = {b"RIFF": "<", b"RIFX": ">", b"RF64": "<", b"BW64": "<"}
#: What programs that write to a pipe put for "length unknown" (ffmpeg 0xFFFFFFFF, SoX 0x7FFFF000).
_UNKNOWN_SIZE = 0x7FFF_F000
#: Size of the samples that says: it stands in the `ds64` chunk (RF64).
_IN_DS64 = 0xFFFF_FFFF


@dataclass(frozen=True)
class Wave:
    """Layout of a WAV file: offsets and sizes in bytes.

    `declared` is the size of the samples by the header, None when that leaves it open (a stream).
    `order` is that of the bytes of a number, as `struct` writes it.
    """

    code: int
    channels: int
    sample_rate_hz: int
    frame_bytes: int
    bits: int
    start: int
    stop: int
    declared: int | None
    order: str = "<"
    data_chunks: int = 1

    @property
    def held(self) -> int:
        """Bytes of samples that are there."""
        return self.stop - self.start

    @property
    def frames(self) -> int:
        """Whole frames (or blocks, of compressed encodings) that are there."""
        return self.held // self.frame_bytes

    @property
    def is_cut(self) -> bool:
        """True if frames that the header declares are missing."""
        return self.declared is not None and self.frames < self.declared // self.frame_bytes

    @property
    def subtype(self) -> str | None:
        """libsndfile's name of an encoding that is decoded here."""
        samples_fill_frame = self.frame_bytes * 8 == self.bits * self.channels
        is_plain = samples_fill_frame and self.order == "<"
        return _PLAIN.get((self.code, self.bits)) if is_plain else None


def is_wave(content: bytes) -> bool:
    """Return True if a file begins as a WAV does: RIFF, or RIFX, RF64 and BW64 (EBU Tech 3306)."""
    return content[:4] in _ORDERS and content[8:12] == b"WAVE"


def parse_wave(content: bytes, size_of_file: int | None = None) -> Wave | None:
    """Return the layout of the first `data` chunk and the number of these chunks; None if there is
    none.

    `content` may be the beginning of a file of `size_of_file` bytes.
    """
    whole = len(content) if size_of_file is None else size_of_file
    order = _ORDERS.get(content[:4], "<")
    fmt: tuple[int, ...] | None = None
    long_sizes: tuple[int, ...] = ()
    wave: Wave | None = None
    at = 12
    while at + 8 <= len(content):
        name, size = struct.unpack_from(f"{order}4sI", content, at)
        at += 8
        if name == b"ds64" and at + 16 <= len(content):
            long_sizes = struct.unpack_from("<QQ", content, at)
        if name == b"fmt " and at + 16 <= len(content):
            fmt = struct.unpack_from(f"{order}HHIIHH", content, at)
        if name == b"data" and wave:
            wave = replace(wave, data_chunks=wave.data_chunks + 1)
        elif name == b"data" and fmt:
            if long_sizes and size == _IN_DS64:
                size = long_sizes[1]
            riff_end = struct.unpack_from(f"{order}I", content, 4)[0] + 8
            unfinished = size == 0 and riff_end <= at  # nobody went back to fill in the sizes
            stop = whole if unfinished else min(at + size, whole)
            is_open = unfinished or (not long_sizes and size >= _UNKNOWN_SIZE and at + size > stop)
            wave = _wave(fmt, at, stop, None if is_open else size, order)
            if wave is None or is_open:
                return wave
        at += size
        if size & 1 and content[at : at + 1] == b"\0":  # some writers forget the padding
            at += 1
    return wave


def _wave(
    fmt: tuple[int, ...], start: int, stop: int, declared: int | None, order: str
) -> Wave | None:
    code, channels, rate, _, frame_bytes, bits = fmt
    if not (channels and rate and frame_bytes):
        return None
    return Wave(code, channels, rate, frame_bytes, bits, start, stop, declared, order)


def decode(content: bytes, wave: Wave) -> NDArray[np.float32]:
    """Return samples (frames, channels), full scale +-1, of a wave whose `subtype` is not None."""
    count = wave.frames * wave.channels
    if wave.subtype == "FLOAT":
        flat = np.frombuffer(content, "<f4", count, wave.start).astype(np.float32)
    elif wave.subtype == "PCM_16":
        flat = np.frombuffer(content, "<i2", count, wave.start).astype(np.float32)
        flat *= np.float32(2.0**-15)
    else:
        # Each sample with the byte before it (there always is one) is an int32 whose upper three
        # bytes are the sample.
        wide: NDArray[np.int32] = np.ndarray(
            (count,), "<i4", content, offset=wave.start - 1, strides=(3,)
        )
        flat = (wide >> 8).astype(np.float32)
        flat *= np.float32(2.0**-23)
    return flat.reshape(wave.frames, wave.channels)


def encode_float32(samples: NDArray[Any], sample_rate_hz: int) -> bytes:
    """Return a 32-bit float file of samples (frames, channels), and always the same bytes."""
    frames, channels = samples.shape
    data = np.ascontiguousarray(samples, "<f4").tobytes()
    header = struct.pack(
        "<4sI4s4sIHHIIHHH4sII4sI",
        *(b"RIFF", 50 + len(data), b"WAVE"),
        *(b"fmt ", 18, _FLOAT, channels, sample_rate_hz),
        *(4 * channels * sample_rate_hz, 4 * channels, 32, 0),
        *(b"fact", 4, frames),
        *(b"data", len(data)),
    )
    return header + data


def encode_pcm24(samples: NDArray[Any], sample_rate_hz: int) -> bytes:
    """Return a mono 24-bit file of samples (n,) within +-1, rounded to the nearest code."""
    codes = np.rint(samples.astype(np.float64) * 2**23).clip(-(2**23), 2**23 - 1).astype("<i4")
    data = codes.view(np.uint8).reshape(-1, 4)[:, :3].tobytes()
    padding = b"\0" * (len(data) & 1)
    header = struct.pack(
        "<4sI4s4sIHHIIHH4sI",
        *(b"RIFF", 36 + len(data) + len(padding), b"WAVE"),
        *(b"fmt ", 16, _PCM, 1, sample_rate_hz, 3 * sample_rate_hz, 3, 24),
        *(b"data", len(data)),
    )
    return header + data + padding
