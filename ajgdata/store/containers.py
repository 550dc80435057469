"""Completeness of WAV and Ogg files, which libsndfile does not check."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace

#: First bytes of a WAV file -> how its numbers are written: big-endian, or with 64-bit sizes.
_WAVE_ORDERS = {b"RIFF": "<", b"RIFX": ">", b"RF64": "<", b"BW64": "<"}
#: What programs that write to a pipe put for "length unknown" (ffmpeg 0xFFFFFFFF, SoX 0x7FFFF000).
_UNKNOWN_SIZE = 0x7FFF_F000
#: Size of the samples that says: it stands in the `ds64` chunk (RF64).
_IN_DS64 = 0xFFFF_FFFF


@dataclass(frozen=True)
class DataChunk:
    """The first `data` chunk of a WAV file: where its samples begin and how many bytes of them are
    there; `declared` is their size by the header, None if that leaves it open (a stream)."""

    start: int
    held: int
    declared: int | None
    frame_bytes: int
    order: str
    count: int = 1
    is_followed: bool = False

    @property
    def is_cut(self) -> bool:
        """True if frames that the header declares are missing."""
        frames = self.held // self.frame_bytes
        return self.declared is not None and frames < self.declared // self.frame_bytes


def is_wave(content: bytes) -> bool:
    """Return True if a file begins as a WAV does: RIFF, or RIFX, RF64 and BW64 (EBU Tech 3306)."""
    return content[:4] in _WAVE_ORDERS and content[8:12] == b"WAVE"


def data_chunk(content: bytes, size_of_file: int) -> DataChunk | None:
    """Return the first `data` chunk of a WAV file of which `content` is the beginning, and the
    number of such chunks; None if there is none."""
    if not is_wave(content):
        return None
    order, at, frame_bytes, long_size = _WAVE_ORDERS[content[:4]], 12, 0, 0
    chunk: DataChunk | None = None
    while at + 8 <= len(content):
        name, size = struct.unpack_from(f"{order}4sI", content, at)
        at += 8
        if name == b"ds64" and at + 16 <= len(content):
            long_size = struct.unpack_from("<QQ", content, at)[1]
        if name == b"fmt " and at + 16 <= len(content):
            frame_bytes = struct.unpack_from(f"{order}HHIIHH", content, at)[4]
        if name == b"data" and chunk:
            chunk = replace(chunk, count=chunk.count + 1)
        elif name == b"data" and frame_bytes:
            size = long_size if long_size and size == _IN_DS64 else size
            riff_end = struct.unpack_from(f"{order}I", content, 4)[0] + 8
            is_unfinished = size == 0 and riff_end <= at  # nobody went back to fill in the sizes
            held = size_of_file - at if is_unfinished else min(size, size_of_file - at)
            is_open = is_unfinished or (not long_size and size >= _UNKNOWN_SIZE and size > held)
            is_followed = size_of_file - at - held >= 8
            declared = None if is_open else size
            chunk = DataChunk(at, held, declared, frame_bytes, order, 1, is_followed)
            if is_open:
                return chunk
        at += size + size % 2
    return chunk


def ogg_is_whole(content: bytes) -> bool:
    """Return True if all pages are complete and the last one is marked as the end of its stream
    (RFC 3533)."""
    at, is_end = 0, False
    while content[at : at + 4] == b"OggS" and at + 27 <= len(content):
        segments = content[at + 27 : at + 27 + content[at + 26]]
        is_end = bool(content[at + 5] & 4)
        at += 27 + content[at + 26] + sum(segments)
    return is_end and at <= len(content)
