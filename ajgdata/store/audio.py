"""The only module that opens audio files. It reads recordings and segments, and writes 24-bit WAV.

libsndfile decodes all files that it can; FFmpeg (`store.ffmpeg`) decodes M4A, AAC and WMA. Each
change of the samples is reported. libsndfile reads a truncated file without an error, but its log
states the length that the header declares.
"""

from __future__ import annotations

import hashlib
import io
import math
import re
import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
import soundfile
from numpy.typing import NDArray

from ajgdata.store import ffmpeg
from ajgdata.store.files import write_bytes
from ajgdata.types import WHOLE_FILE, AudioSettings, DataError, Segment
from ajgdata.types.extras import optional_packages
from ajgdata.types.settings import (
    HIGHEST_RATE_HZ,
    LOWEST_RATE_HZ,
    Microphone,
    as_written,
    microphone_text,
    numbers_of,
)

Float32 = NDArray[np.float32]
#: An open file with the attributes that this module uses.
OpenFile: TypeAlias = soundfile.SoundFile | ffmpeg.DecodedFile

#: Comment in files with simulated samples.
SIMULATED = "simulated by ajgdata"
#: Largest number of channels and longest duration. A header with more is damaged, and its samples
#: would not fit in the memory.
MAX_CHANNELS = 256
MAX_DURATION_S = 3600
#: Lengths in libsndfile's log (WAV, RF64, AIFF, AU) that differ from the size of the file.
_LENGTHS = re.compile(r"(?:data|Riff size|SSND|Data Size) *: (\d+) \(should be (\d+)\)")
#: Least size that programs declare if they write to a pipe (ffmpeg 0xFFFFFFFF, SoX 0x7FFFF000).
_UNKNOWN_SIZE = 0x7FFF_F000
#: Whether libsndfile reads descriptors of open files. On Windows it has descriptors of its own, and
#: reads through Python, which is slower.
_READS_DESCRIPTORS = sys.platform != "win32"
#: Encodings of libsndfile in which a read from the middle of a file gives exactly the samples of a
#: read of the complete file. Other decoders depend on earlier samples.
_SEEKABLE = ("PCM_", "ALAC_", "FLOAT", "DOUBLE", "ULAW", "ALAW")
#: Encodings with integers that WAV files can have.
_WAV_INTEGERS = ("PCM_U8", "PCM_16", "PCM_24", "PCM_32")
_RECORD_AGAIN = "record it again, or fetch a whole copy"


class Remark(NamedTuple):
    """An issue of a recording; a `Finding` also names the recording."""

    level: Literal["error", "warning", "note"]
    code: str
    problem: str
    fix: str


class AudioError(DataError):
    """Error of a recording that cannot be used; `remark` is the same issue with a stable code."""

    def __init__(self, where: object, code: str, problem: str, fix: str) -> None:
        super().__init__(where, problem, fix)
        self.remark = Remark("error", code, problem, fix)


@dataclass(frozen=True)
class AudioInfo:
    """Container, encoding, rate, channels, length and comment of a file.

    Names of containers and encodings are those of libsndfile, or of FFmpeg (`MOV`, `AAC`). `frames`
    is the length of the segment if the recording is a segment of the file.
    """

    format: str
    subtype: str
    sample_rate_hz: int
    channels: int
    frames: int
    comment: str = ""


@dataclass(frozen=True)
class Audio:
    """A recording at the sample rate of its data set.

    - `samples`: (n,), or (channels, n) of a data set with several microphones, float32, full scale
      ±1 (float files can exceed it)
    - `recorded`: (frames, used channels), the samples before averaging and resampling, which would
      hide clipping
    - `remarks`: conversions
    - `levels_db`: levels of all channels of the file in dB of full scale, without offset; -inf for
      silence
    """

    samples: Float32
    recorded: Float32
    info: AudioInfo
    remarks: tuple[Remark, ...]
    levels_db: tuple[float, ...] = ()

    @property
    def columns(self) -> Float32:
        """Return `samples` as (n, channels)."""
        return np.atleast_2d(self.samples).T


def inspect_audio(path: Path, segment: Segment = WHOLE_FILE) -> AudioInfo:
    """Return the header of an audio file; `frames` is the length of `segment`.

    Raises AudioError (a DataError) as `read_audio` does.
    """
    with _bytes(path) as stream, _decoded(path, stream) as file:
        info = _info(path, file)
    first, end = _frames(path, info, segment)
    return replace(info, frames=end - first)


def hash_and_inspect(path: Path) -> tuple[str, AudioInfo | AudioError]:
    """Return SHA-256 and header of a file, or AudioError instead of the header if the file is not
    usable audio. Raises AudioError for a file that cannot be read."""
    with _bytes(path) as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
        try:
            with _decoded(path, stream) as file:
                return digest, _info(path, file)
        except AudioError as error:
            return digest, error


def read_audio(path: Path, audio: AudioSettings, segment: Segment = WHOLE_FILE) -> Audio:
    """Return a recording; channels and rate are converted only if `audio` allows it.

    A segment has the samples from round(start · rate) to round(end · rate) of the complete file,
    without the last one. Its samples are resampled without those of its neighbours. Raises
    AudioError, whose `remark` has a code such as `truncated`.

    >>> from pathlib import Path
    >>> import numpy as np
    >>> from ajgdata.store.audio import read_audio, write_pcm24
    >>> from ajgdata.types import AudioSettings
    >>> write_pcm24(Path("click.wav"), np.array([0.0, 0.5, -0.25]), 44_100)
    >>> read_audio(Path("click.wav"), AudioSettings()).samples  # (n,), full scale ±1
    array([ 0.  ,  0.5 , -0.25], dtype=float32)
    """
    with _bytes(path) as stream, _decoded(path, stream) as file:
        info = _info(path, file)
        check_layout(path, info, audio)
        if segment == WHOLE_FILE:
            channels: Float32 = file.read(dtype="float32", always_2d=True)
        else:
            first, end = _frames(path, info, segment)
            info = replace(info, frames=end - first)
            channels = _segment_samples(path, file, first, end)
    if len(channels) < info.frames:
        raise _truncated(path, len(channels), info.frames, "frames")
    levels_db = _levels_db(channels)
    recorded, remarks = _used_channels(channels, audio.microphone)
    samples = _samples(recorded, audio.microphone)
    if info.sample_rate_hz != audio.sample_rate_hz:
        samples = resample(samples, info.sample_rate_hz, audio.sample_rate_hz)
        problem = f"resampled from {info.sample_rate_hz} to {audio.sample_rate_hz} Hz"
        fix = "nothing to do: audio.other_rate is resample"
        remarks.append(Remark("note", "resampled", problem, fix))
    return Audio(samples, recorded, info, tuple(remarks), levels_db)


def read_channels(path: Path, max_s: float, max_values: int) -> Float32:
    """Return the beginning of a file with all channels (frames, channels), full scale ±1: up to
    `max_s` seconds and `max_values` values. Raises AudioError as `read_audio` does."""
    with _bytes(path) as stream, _decoded(path, stream) as file:
        info = _info(path, file)
        frames = min(math.ceil(max_s * info.sample_rate_hz), max_values // info.channels)
        samples: Float32 = file.read(frames, dtype="float32", always_2d=True)
    return samples


def segment_bytes(path: Path, segment: Segment) -> bytes:
    """Return a segment as a WAV file with all channels and unchanged samples.

    Samples of integers keep their encoding, and all other samples are 32-bit floats. Raises
    AudioError as `read_audio` does.
    """
    with _bytes(path) as stream, _decoded(path, stream) as file:
        info = _info(path, file)
        first, end = _frames(path, info, segment)
        if not isinstance(file, soundfile.SoundFile) or info.subtype not in _WAV_INTEGERS:
            return _float_wav(_segment_samples(path, file, first, end), info.sample_rate_hz)
        file.seek(first)
        codes = file.read(end - first, dtype="int32", always_2d=True)
    content = io.BytesIO()
    kind: dict[str, Any] = {"subtype": info.subtype, "format": "WAV"}
    with soundfile.SoundFile(content, "w", info.sample_rate_hz, info.channels, **kind) as new:
        if info.comment:
            new.comment = info.comment
        new.write(codes)
    return content.getvalue()


def _float_wav(samples: Float32, sample_rate_hz: int) -> bytes:
    """Return samples (frames, channels) as a WAV file of 32-bit floats.

    libsndfile would write the present time into the file.
    """
    channels = samples.shape[1]
    frame_bytes = 4 * channels
    rates = (sample_rate_hz, sample_rate_hz * frame_bytes)
    layout = struct.pack("<HHIIHHH", 3, channels, *rates, frame_bytes, 32, 0)  # 3: floats
    data = np.ascontiguousarray(samples, "<f4").tobytes()
    chunks = {b"fmt ": layout, b"fact": struct.pack("<I", len(samples)), b"data": data}
    parts = [name + struct.pack("<I", len(content)) + content for name, content in chunks.items()]
    body = b"WAVE" + b"".join(parts)
    return b"RIFF" + struct.pack("<I", len(body)) + body


def check_decodable(path: Path) -> None:
    """Raise AudioError for a file with samples that cannot be decoded, for any rate and channels.

    All samples are read.
    """
    info = inspect_audio(path)
    read_audio(path, AudioSettings(sample_rate_hz=info.sample_rate_hz, microphone="mean"))


def _frames(path: Path, info: AudioInfo, segment: Segment) -> tuple[int, int]:
    """Return the first sample of a segment, and the sample after its last one.

    Raises AudioError for a segment that is empty or ends after the file.
    """
    first, end = segment.frames(info.sample_rate_hz, info.frames)
    fix = "correct start_s and end_s in recordings.csv"
    if end > info.frames or first >= info.frames:
        length = f"{info.frames / info.sample_rate_hz:g} s"
        problem = f"the segment {segment} is not within the file, which has {length}"
        raise AudioError(path, "beyond_end", problem, fix)
    if first >= end:
        raise AudioError(path, "no_samples", f"the segment {segment} has no samples", fix)
    return first, end


def _segment_samples(path: Path, file: OpenFile, first: int, end: int) -> Float32:
    """Return the samples of a segment with all channels (frames, channels)."""
    if isinstance(file, soundfile.SoundFile) and file.subtype.startswith(_SEEKABLE):
        file.seek(first)
        samples: Float32 = file.read(end - first, dtype="float32", always_2d=True)
        return samples
    if isinstance(file, ffmpeg.DecodedFile):
        return file.samples[first:end]
    return _all_samples(path, *_state(path))[first:end]


def _state(path: Path) -> tuple[int, int]:
    """Return time of change and size of a file, which distinguish the contents of a path."""
    state = path.stat()
    return state.st_mtime_ns, state.st_size


@lru_cache(maxsize=1)
def _all_samples(path: Path, changed_ns: int, size: int) -> Float32:
    """Return all samples of a compressed file (frames, channels).

    The file of the last call stays in memory, because its other segments usually follow.
    """
    with _bytes(path) as stream, _decoded(path, stream) as file:
        samples: Float32 = file.read(dtype="float32", always_2d=True)
    samples.setflags(write=False)
    return samples


@contextmanager
def _decoded(path: Path, stream: io.FileIO) -> Iterator[OpenFile]:
    """Decode an open file by libsndfile or FFmpeg. Errors of both become AudioError."""
    size = stream.seek(0, io.SEEK_END)
    if not size:
        raise AudioError(path, "empty", "the file is empty", _RECORD_AGAIN)
    stream.seek(0)
    if ffmpeg.is_decodable(stream.read(ffmpeg.HEAD_BYTES)):  # libsndfile decodes none of these
        yield _decoded_by_ffmpeg(path, *_state(path))
        return
    stream.seek(0)
    try:
        source = stream.fileno() if _READS_DESCRIPTORS else stream
        with soundfile.SoundFile(source, closefd=False) as file:
            yield file
    except soundfile.LibsndfileError as error:
        reason = error.error_string.rstrip(".") or f"libsndfile error {error.code}"
        raise _damaged(path, f"no audio that libsndfile reads ({reason})") from None


def _damaged(path: Path, alternative: str) -> AudioError:
    """Return the error of a file that is damaged, or that is the `alternative`."""
    problem = f"cannot be decoded: damaged, or {alternative}"
    return AudioError(path, "damaged", problem, "record it again, or convert it to WAV")


@lru_cache(maxsize=1)
def _decoded_by_ffmpeg(path: Path, changed_ns: int, size: int) -> ffmpeg.DecodedFile:
    """Return a file that FFmpeg decodes. The file of the last call stays in memory."""
    with _bytes(path) as stream:
        declared = ffmpeg.declared_size(stream, size)
        if declared > size:
            raise _truncated(path, size, declared, "bytes")
        try:
            with optional_packages(path):
                return ffmpeg.decode(stream)
        except ffmpeg.DecodingError as error:
            raise _damaged(path, f"no audio that FFmpeg reads ({error})") from None


@contextmanager
def _bytes(path: Path) -> Iterator[io.FileIO]:
    """Open a file without a buffer. A named pipe is an error, because a read could wait forever."""
    if not path.is_file():
        problem = "no such file, or a broken link"
        raise AudioError(path, "missing", problem, "restore it or remove its row")
    try:
        with path.open("rb", buffering=0) as stream:
            yield stream
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
        raise AudioError(path, "unreadable", problem, "check disk and permissions") from None


def _info(path: Path, file: OpenFile) -> AudioInfo:
    """Return the header of an open file. Raises AudioError if the file does not agree with it."""
    rate = file.samplerate
    for declared, present in _LENGTHS.findall(file.extra_info):
        if int(present) < int(declared) < _UNKNOWN_SIZE:
            raise _truncated(path, int(present), int(declared), "bytes")
    if file.frames == 0:
        raise AudioError(path, "no_samples", "holds a header but no samples", _RECORD_AGAIN)
    is_plausible = LOWEST_RATE_HZ <= rate <= HIGHEST_RATE_HZ and file.channels <= MAX_CHANNELS
    if not is_plausible or file.frames > MAX_DURATION_S * rate:
        problem = (
            f"{rate} Hz, {file.channels} channels, {file.frames / max(rate, 1):.0f} s; possible are"
            f" {LOWEST_RATE_HZ} to {HIGHEST_RATE_HZ} Hz, {MAX_CHANNELS} channels and"
            f" {MAX_DURATION_S} s"
        )
        raise AudioError(path, "implausible", problem, "correct its header, or cut it")
    return AudioInfo(file.format, file.subtype, rate, file.channels, file.frames, file.comment)


def _truncated(path: Path, present: int, declared: int, unit: str) -> AudioError:
    """Return the error of a file that is shorter than its header declares."""
    problem = f"the file is cut short: {present} of the {declared} {unit} that its header declares"
    return AudioError(path, "truncated", problem, _RECORD_AGAIN)


def check_layout(path: Path, info: AudioInfo, audio: AudioSettings) -> None:
    """Raise AudioError if the rate or the channels of a file are not those of `audio`, and `audio`
    does not allow a conversion."""
    if info.sample_rate_hz != audio.sample_rate_hz and audio.other_rate == "reject":
        problem = f"sampled at {info.sample_rate_hz} Hz, not {audio.sample_rate_hz} Hz"
        fix = "set audio.other_rate: resample (or audio.sample_rate_hz) in dataset.yaml"
        raise AudioError(path, "other_rate", problem, fix)
    check_channels(path, info.channels, audio.microphone)


def check_channels(path: Path, count: int, microphone: Microphone) -> None:
    """Raise AudioError if a file with `count` channels lacks the microphone of its data set, or if
    the data set does not specify which of several channels is used."""
    if microphone is None and count != 1:
        problem = f"has {count} channels, and the data set does not specify a microphone"
        fix = (
            "set audio.microphone in dataset.yaml to the number of a channel (from 1), to a list "
            "of numbers, or to mean"
        )
        raise AudioError(path, "channels", problem, fix)
    largest = max(numbers_of(microphone), default=1)
    if largest > count:
        channels = "1 channel" if count == 1 else f"{count} channels"
        problem = f"has {channels}, and the data set uses microphone {largest}"
        fix = f"use a file with at least {largest} channels, or correct audio.microphone"
        raise AudioError(path, "channels", problem, fix)


def _samples(recorded: Float32, microphone: Microphone) -> Float32:
    """Return the used channels (frames, used) as samples (n,), or (channels, n) of a list."""
    if isinstance(microphone, tuple):
        return np.ascontiguousarray(recorded.T)
    if recorded.shape[1] == 1:
        return recorded[:, 0]
    with np.errstate(invalid="ignore", over="ignore"):  # the checks report NaN and infinity
        return recorded.mean(axis=1)


def _used_channels(samples: Float32, microphone: Microphone) -> tuple[Float32, list[Remark]]:
    """Return the channels (frames, used) that a data set uses, and a note if a file has more.

    `microphone` is `AudioSettings.microphone`: channel 1 is the first column.
    """
    count = samples.shape[1]
    numbers = numbers_of(microphone)
    if numbers:
        samples = np.ascontiguousarray(samples[:, [number - 1 for number in numbers]])
    if count == 1 or numbers == tuple(range(1, count + 1)):
        return samples, []
    problem = f"uses {microphone_text(microphone)} of {count} channels"
    fix = f"nothing to do: audio.microphone is {as_written(microphone)}"
    return samples, [Remark("note", "channel_converted", problem, fix)]


def _levels_db(channels: Float32) -> tuple[float, ...]:
    """Return the level of each channel (frames, channels) in dB of full scale, without offset.

    Levels have two decimals, as in the feature file, so that a reused row equals a new one.
    """
    levels = []
    with np.errstate(over="ignore", invalid="ignore"):  # the checks report NaN and infinity
        for row in channels.T:  # the row of a single channel is contiguous
            offset = float(np.add.reduce(row)) / len(row)
            power = float(np.dot(row, row)) / len(row) - offset**2
            levels.append(round(10 * math.log10(power), 2) if power > 0 else -math.inf)
    return tuple(levels)


def resample(samples: Float32, from_hz: int, to_hz: int) -> Float32:
    """Return samples (..., n) at another rate, (..., ceil(n to_hz / from_hz)).

    The method is a polyphase filter, and samples outside are zero.
    """
    from scipy.signal import resample_poly  # half a second, and few recordings need it

    common = math.gcd(from_hz, to_hz)
    resampled = resample_poly(samples, to_hz // common, from_hz // common, axis=-1)
    return resampled.astype(np.float32)


def write_pcm24(path: Path, samples: NDArray[Any], sample_rate_hz: int, comment: str = "") -> None:
    """Write mono samples (n,) within ±1 as a 24-bit WAV, atomically and always with equal bytes.

    Raises ValueError for NaN and for samples beyond full scale, which would clip.
    """
    samples = np.asarray(samples)
    if samples.ndim != 1 or not samples.size:
        raise ValueError(f"{path}: need samples of shape (n,) with n > 0, got {samples.shape}")
    peak = float(np.abs(samples).max())
    if not peak <= 1:
        raise ValueError(f"{path}: peak {peak:g} exceeds full scale 1; scale the samples down")
    write_bytes(path, pcm24_bytes(samples, sample_rate_hz, comment))


def pcm24_bytes(samples: NDArray[Any], sample_rate_hz: int, comment: str = "") -> bytes:
    """Return a mono 24-bit WAV of samples (n,) within ±1, rounded to the nearest code."""
    codes = np.rint(samples.astype(np.float64) * 2**23).clip(-(2**23), 2**23 - 1)
    stream = io.BytesIO()
    with soundfile.SoundFile(stream, "w", sample_rate_hz, 1, "PCM_24", format="WAV") as file:
        if comment:
            file.comment = comment
        file.write(codes.astype(np.int32) << 8)  # libsndfile takes the upper 24 of 32 bits
    return stream.getvalue()


def mp3_bytes(samples: NDArray[Any], sample_rate_hz: int) -> bytes:
    """Return mono samples (n,) within ±1 as MP3, for listening; the samples change slightly."""
    stream = io.BytesIO()
    with soundfile.SoundFile(stream, "w", sample_rate_hz, 1, format="MP3") as file:
        file.write(samples)
    return stream.getvalue()


class FileHashes(dict[Path, str]):
    """The sha256 of files by path. Each file is read when its hash is first used.

    Raises AudioError if the file cannot be read.
    """

    def __missing__(self, path: Path) -> str:
        """Read the file, and store its hash."""
        self[path] = file_sha256(path)
        return self[path]


def file_sha256(path: Path) -> str:
    """Return the hexadecimal SHA-256 of a file's bytes. Raises AudioError if it cannot be read."""
    with _bytes(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
