"""Decoding by FFmpeg: M4A and MP4 (AAC, Apple Lossless), AAC streams, and WMA.

`store.audio` opens the files, and calls this module for files that libsndfile does not decode. The
package `av` (extra `audio`) contains FFmpeg. FFmpeg removes the delay and the padding of the
encoder if the file states them, as M4A files do.
"""

from __future__ import annotations

import io
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Bytes at the beginning of a file that decide whether FFmpeg decodes it.
HEAD_BYTES = 16
#: First bytes of a WMA file: the identity of its container, ASF.
_ASF = bytes.fromhex("3026b2758e66cf11")


class DecodingError(Exception):
    """A file that FFmpeg does not decode; the text is the reason."""


@dataclass
class DecodedFile:
    """All samples (frames, channels) of a file, with the attributes of an open `SoundFile`."""

    format: str
    subtype: str
    samplerate: int
    samples: NDArray[np.float32]
    comment: str = ""
    extra_info: str = ""

    @property
    def frames(self) -> int:
        """Number of samples per channel."""
        return len(self.samples)

    @property
    def channels(self) -> int:
        """Number of channels."""
        return self.samples.shape[1]

    def read(self, frames: int = -1, dtype: str = "float32", always_2d: bool = True) -> Any:
        """Return the first samples (frames, channels), or all of them if `frames` is negative."""
        return self.samples.copy() if frames < 0 else self.samples[:frames].copy()


def is_decodable(head: bytes) -> bool:
    """Return True if the first bytes of a file are those of MP4, of an AAC stream or of WMA."""
    is_mp4 = head[4:8] == b"ftyp"
    is_aac_stream = len(head) > 1 and head[0] == 0xFF and head[1] & 0xF6 == 0xF0
    return is_mp4 or is_aac_stream or head.startswith(_ASF)


def declared_size(stream: io.FileIO, size: int) -> int:
    """Return the size of an MP4 file by the lengths of its boxes; `size` for other files.

    `size` is that of the file. A larger result shows that the end of the file is missing.
    """
    position = 0
    while position + 8 <= size:
        stream.seek(position)
        head = stream.read(HEAD_BYTES)
        if position == 0 and head[4:8] != b"ftyp":
            return size
        length = struct.unpack(">I", head[:4])[0]
        if length == 1 and len(head) == HEAD_BYTES:
            length = struct.unpack(">Q", head[8:])[0]
        if length < 8:  # 0: the box reaches to the end of the file
            return size
        position += length
    return max(position, size)


def decode(stream: io.FileIO) -> DecodedFile:
    """Return all samples of the first sound in a file, float32, full scale ±1.

    Raises DecodingError for a damaged file and for a file without sound, and ModuleNotFoundError if
    the extra `audio` is not installed.
    """
    import av

    stream.seek(0)
    try:
        with av.open(stream, "r") as container:
            sounds = container.streams.audio
            if not sounds:
                raise DecodingError("no sound in it")
            decoder = sounds[0].codec_context
            parts = [_samples(frame) for frame in container.decode(sounds[0])]
            rate = decoder.sample_rate
            subtype = decoder.name.upper()
            name = container.format.name.partition(",")[0].upper()
    except av.FFmpegError as error:
        raise DecodingError(error.strerror) from None
    if len({part.shape[1] for part in parts}) > 1:
        raise DecodingError("its number of channels changes")
    samples = np.concatenate(parts) if parts else np.zeros((0, 1), np.float32)
    samples.setflags(write=False)
    return DecodedFile(name, subtype, rate, samples)


def _samples(frame: Any) -> NDArray[np.float32]:
    """Return the samples (frames, channels) of a decoded frame."""
    values = frame.to_ndarray()
    if frame.format.is_packed:
        values = values.reshape(-1, frame.layout.nb_channels).T
    if values.dtype.kind == "i":
        return (values.T / 2.0 ** (8 * values.dtype.itemsize - 1)).astype(np.float32)
    return values.T.astype(np.float32)
