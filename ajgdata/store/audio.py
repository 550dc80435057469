"""The only opener of audio files: WAV, FLAC and Ogg in, 24-bit WAV out.

Nothing is altered silently. libsndfile reads a truncated WAV without complaint, so the size that
the header declares is compared with the bytes that are there; formats whose truncation cannot be
told are refused. Plain PCM16, PCM24 and float32 WAVs are decoded here with numpy, which is several
times faster than, and equal sample for sample to, libsndfile, which decodes all the others.
"""

from __future__ import annotations

import hashlib
import io
import math
import struct
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.store.files import write_bytes
from ajgdata.types import AudioSettings, DataError

if TYPE_CHECKING:
    import soundfile

Float32 = NDArray[np.float32]

_PCM, _FLOAT, _EXTENSIBLE = 1, 3, 0xFFFE
#: WAV encodings that are decoded here: (format code, bits) -> libsndfile's name.
_PLAIN = {(_PCM, 16): "PCM_16", (_PCM, 24): "PCM_24", (_FLOAT, 32): "FLOAT"}
#: libsndfile's names of the containers whose truncation is noticed.
_ACCEPTED = ("WAV", "WAVEX", "FLAC", "OGG")
#: What programs that write to a pipe put for "length unknown" (ffmpeg 0xFFFFFFFF, SoX 0x7FFFF000).
_UNKNOWN_SIZE = 0x7FFF_F000
_OTHER_AUDIO = (
    ".aac",
    ".aif",
    ".aiff",
    ".au",
    ".caf",
    ".m4a",
    ".mp3",
    ".mp4",
    ".opus",
    ".w64",
    ".wma",
)
_AGAIN = "record it again, or fetch a whole copy"


class Remark(NamedTuple):
    """A `Finding` that does not know yet which recording it is about."""

    level: Literal["error", "warning", "note"]
    code: str
    problem: str
    fix: str


class AudioError(DataError):
    """A recording that cannot be used; `code` is a stable slug, `remark` the same as a record."""

    def __init__(self, where: object, code: str, problem: str, fix: str) -> None:
        super().__init__(where, problem, fix)
        self.code = code
        self.remark = Remark("error", code, problem, fix)


@dataclass(frozen=True)
class AudioInfo:
    """What an audio file is. `format` and `subtype` are libsndfile's names.

    `declared_frames` is what the header says, None when it leaves the length open (a stream).
    """

    format: str
    subtype: str
    sample_rate_hz: int
    channels: int
    frames: int
    declared_frames: int | None


@dataclass(frozen=True)
class Audio:
    """A recording as the data set wants it.

    `samples` (n,) float32, full scale ±1 (float files may exceed it). `recorded` (frames, used
    channels) holds the samples before averaging and resampling: clipping shows only there.
    `remarks` tell what was converted or assumed.
    """

    samples: Float32
    recorded: Float32
    info: AudioInfo
    remarks: tuple[Remark, ...]


@dataclass(frozen=True)
class _Wave:
    """Layout of a WAV file: offsets and sizes in bytes."""

    code: int
    channels: int
    sample_rate_hz: int
    frame_bytes: int
    bits: int
    start: int
    stop: int
    declared: int | None

    @property
    def held(self) -> int:
        """Bytes of samples that are there."""
        return self.stop - self.start

    @property
    def subtype(self) -> str | None:
        """libsndfile's name of an encoding that is decoded here."""
        samples_fill_frame = self.frame_bytes * 8 == self.bits * self.channels
        return _PLAIN.get((self.code, self.bits)) if samples_fill_frame else None


def _parse_wave(content: bytes) -> _Wave | None:
    """Walk the chunks up to `data`; None when that is not there (libsndfile then says why)."""
    fmt: tuple[int, ...] | None = None
    at = 12
    while at + 8 <= len(content):
        name, size = struct.unpack_from("<4sI", content, at)
        at += 8
        if name == b"fmt " and at + 16 <= len(content):
            fmt = struct.unpack_from("<HHIIHH", content, at)
        if name == b"data" and fmt:
            code, channels, rate, _, frame_bytes, bits = fmt
            if not (channels and rate and frame_bytes):
                return None
            riff_end = struct.unpack_from("<I", content, 4)[0] + 8
            unfinished = size == 0 and riff_end <= at  # nobody went back to fill in the sizes
            stop = len(content) if unfinished else min(at + size, len(content))
            is_open = unfinished or (size >= _UNKNOWN_SIZE and at + size > stop)
            declared = None if is_open else size
            return _Wave(code, channels, rate, frame_bytes, bits, at, stop, declared)
        at += size
        if size & 1 and content[at : at + 1] == b"\0":  # some writers forget the padding
            at += 1
    return None


def inspect_audio(path: Path) -> AudioInfo:
    """Say what an audio file is. Raises AudioError (a DataError), as `read_audio` does."""
    content = _content(path)
    return _layout(path, content)[0]


def read_audio(path: Path, audio: AudioSettings) -> Audio:
    """Read a recording, converting channel and rate only as far as `audio` allows.

    Raises AudioError with code `missing`, `unreadable`, `empty`, `lfs_pointer`, `not_audio`,
    `unsupported_format`, `damaged`, `truncated`, `no_samples`, `channels` or `other_rate`.
    """
    content = _content(path)
    info, wave = _layout(path, content)
    remarks = []
    if info.declared_frames is None:
        remarks.append(
            Remark(
                "note",
                "open_length",
                f"the header leaves the length open; all {info.frames} frames were read",
                "check that the recording was not interrupted",
            )
        )
    _check_rate(path, info, audio)
    taken, remark = _take_channel(path, _decode(path, content, info, wave), audio.channel)
    remarks += [remark] if remark else []
    samples = taken[:, 0] if taken.shape[1] == 1 else taken.mean(axis=1)
    if info.sample_rate_hz != audio.sample_rate_hz:
        samples = resample(samples, info.sample_rate_hz, audio.sample_rate_hz)
        remarks.append(
            Remark(
                "note",
                "resampled",
                f"resampled from {info.sample_rate_hz} to {audio.sample_rate_hz} Hz",
                "nothing to do: audio.other_rate is resample",
            )
        )
    return Audio(samples, taken, info, tuple(remarks))


def _content(path: Path) -> bytes:
    """Every byte of a file that may be audio."""
    try:
        content = path.read_bytes()
    except (FileNotFoundError, IsADirectoryError, NotADirectoryError):
        raise AudioError(
            path, "missing", "there is no such file", "restore it or remove its row"
        ) from None
    except OSError as error:
        raise AudioError(
            path, "unreadable", f"cannot be read ({error.strerror})", "check disk and permissions"
        ) from None
    if not content:
        raise AudioError(path, "empty", "the file is empty", _AGAIN)
    if content.startswith(b"version https://git-lfs"):
        problem = "a Git LFS pointer, not the audio itself"
        raise AudioError(path, "lfs_pointer", problem, "run `git lfs pull` where it came from")
    return content


def _layout(path: Path, content: bytes) -> tuple[AudioInfo, _Wave | None]:
    """Header of a file, checked against what the file holds."""
    is_wave = content[:4] == b"RIFF" and content[8:12] == b"WAVE"
    wave = _parse_wave(content) if is_wave else None
    if wave and wave.subtype:
        name, subtype, frames = "WAV", wave.subtype, wave.held // wave.frame_bytes
        rate, channels = wave.sample_rate_hz, wave.channels
    else:
        with _open(path, content, wave) as file:
            name, subtype, frames = file.format, file.subtype, file.frames
            rate, channels = file.samplerate, file.channels
    is_open = wave is not None and wave.declared is None
    if wave and wave.declared and wave.held // wave.frame_bytes < wave.declared // wave.frame_bytes:
        lost = f"holds {wave.held} of the {wave.declared} bytes of samples that its header declares"
        raise AudioError(path, "truncated", f"the file is cut short: {lost}", _AGAIN)
    if name == "OGG" and not _ogg_is_whole(content):
        problem = "the file is cut short: its last Ogg page is missing"
        raise AudioError(path, "truncated", problem, _AGAIN)
    if frames == 0:
        raise AudioError(path, "no_samples", "holds a header but no samples", _AGAIN)
    declared = None if is_open else frames
    return AudioInfo(name, subtype, rate, channels, frames, declared), wave


def _ogg_is_whole(content: bytes) -> bool:
    """Whether the last page is complete and marked as the end of the stream (RFC 3533)."""
    at = content.rfind(b"OggS")
    if at + 27 > len(content):
        return False
    segments = content[at + 27 : at + 27 + content[at + 26]]
    return bool(content[at + 5] & 4) and at + 27 + len(segments) + sum(segments) <= len(content)


def _open(path: Path, content: bytes, wave: _Wave | None) -> soundfile.SoundFile:
    """Hand the bytes to libsndfile."""
    import soundfile

    if wave and wave.declared is None:  # libsndfile takes a length of 0 at its word
        size = struct.pack("<I", wave.held)
        content = content[: wave.start - 4] + size + content[wave.start :]
    suffix = path.suffix.lower()
    try:
        file = soundfile.SoundFile(io.BytesIO(content))
    except soundfile.LibsndfileError as error:
        if suffix in _OTHER_AUDIO:
            raise _unsupported(path, suffix.removeprefix(".")) from None
        if content[:4] in (b"RIFF", b"fLaC", b"OggS"):
            problem = f"its header is damaged ({error.error_string.rstrip('.')})"
            raise AudioError(path, "damaged", problem, _AGAIN) from None
        raise AudioError(
            path, "not_audio", "not an audio file", "replace it by the recording or remove its row"
        ) from None
    unchecked = file.format in ("WAV", "WAVEX") and wave is None  # such as big-endian RIFX
    if file.format not in _ACCEPTED or file.subtype.startswith("MPEG") or unchecked:
        file.close()
        raise _unsupported(path, file.format)
    return file


def _unsupported(path: Path, what: str) -> AudioError:
    command = f'convert with ffmpeg -i "{path.name}" "{path.stem}.wav"'
    return AudioError(path, "unsupported_format", f"{what} audio is not supported", command)


def _decode(path: Path, content: bytes, info: AudioInfo, wave: _Wave | None) -> Float32:
    """Samples (frames, channels), full scale ±1."""
    if not (wave and wave.subtype):
        import soundfile

        try:
            with _open(path, content, wave) as file:
                samples: Float32 = file.read(dtype="float32", always_2d=True)
        except soundfile.LibsndfileError as error:
            raise AudioError(
                path, "damaged", f"cannot be decoded ({error.error_string.rstrip('.')})", _AGAIN
            ) from None
        if len(samples) < info.frames:
            lost = f"holds {len(samples)} of the {info.frames} frames that its header declares"
            raise AudioError(path, "truncated", f"the file is cut short: {lost}", _AGAIN)
        return samples
    count = info.frames * info.channels
    if wave.subtype == "PCM_16":
        flat = np.frombuffer(content, "<i2", count, wave.start) * np.float32(2.0**-15)
    elif wave.subtype == "FLOAT":
        flat = np.frombuffer(content, "<f4", count, wave.start).astype(np.float32)
    else:
        # Each sample with the byte before it (there always is one) is an int32 whose upper three
        # bytes are the sample.
        wide: NDArray[np.int32] = np.ndarray(
            (count,), "<i4", content, offset=wave.start - 1, strides=(3,)
        )
        flat = (wide >> 8) * np.float32(2.0**-23)
    return flat.astype(np.float32, copy=False).reshape(info.frames, info.channels)


def _check_rate(path: Path, info: AudioInfo, audio: AudioSettings) -> None:
    if info.sample_rate_hz != audio.sample_rate_hz and audio.other_rate == "reject":
        raise AudioError(
            path,
            "other_rate",
            f"sampled at {info.sample_rate_hz} Hz, the data set declares {audio.sample_rate_hz} Hz",
            "set audio.other_rate: resample (or audio.sample_rate_hz) in dataset.yaml",
        )


def _take_channel(
    path: Path, samples: Float32, channel: str | int
) -> tuple[Float32, Remark | None]:
    """The channels (frames, used) that a data set uses."""
    count = samples.shape[1]
    if channel == "mono":
        if count != 1:
            raise AudioError(
                path,
                "channels",
                f"has {count} channels, the data set declares mono",
                "set audio.channel: mean, or to the number of a channel, in dataset.yaml",
            )
        return samples, None
    if isinstance(channel, int):
        if channel >= count:
            raise AudioError(
                path,
                "channels",
                f"has {count} channels (0 to {count - 1}), the data set asks for {channel}",
                "correct audio.channel in dataset.yaml",
            )
        samples = np.ascontiguousarray(samples[:, channel : channel + 1])
    if count == 1:
        return samples, None
    done = f"averaged {count} channels" if channel == "mean" else f"took channel {channel}"
    fix = f"nothing to do: audio.channel is {channel}"
    return samples, Remark("note", "channel_converted", f"{done} of {count}", fix)


@lru_cache(maxsize=8)
def _lowpass(up: int, down: int) -> NDArray[np.float64]:
    """`scipy.signal.resample_poly`'s default filter, kept: 44,101 Hz needs 882,021 taps."""
    from scipy.signal import firwin

    widest = max(up, down)
    return firwin(20 * widest + 1, 1 / widest, window=("kaiser", 5.0))


def resample(samples: Float32, from_hz: int, to_hz: int) -> Float32:
    """Polyphase resampling of (n,) samples to ceil(n to/from); zeros are assumed outside."""
    from scipy.signal import resample_poly

    common = math.gcd(from_hz, to_hz)
    up, down = to_hz // common, from_hz // common
    return resample_poly(samples, up, down, window=_lowpass(up, down)).astype(np.float32)


def write_pcm24(path: Path, samples: NDArray[Any], sample_rate_hz: int) -> None:
    """Write mono samples (n,) within ±1 as a 24-bit WAV, atomically and always the same bytes.

    Raises ValueError for NaN and for samples beyond full scale: nothing is clipped silently.
    """
    samples = np.asarray(samples)
    if samples.ndim != 1 or not samples.size:
        raise ValueError(f"{path}: need samples of shape (n,) with n > 0, got {samples.shape}")
    peak = float(np.abs(samples).max())
    if not peak <= 1:
        raise ValueError(f"{path}: peak {peak:g} exceeds full scale 1; scale the samples down")
    codes = np.rint(samples.astype(np.float64) * 2**23).clip(-(2**23), 2**23 - 1).astype("<i4")
    data = codes.view(np.uint8).reshape(-1, 4)[:, :3].tobytes()
    padding = b"\0" * (len(data) & 1)
    header = struct.pack(
        "<4sI4s4sIHHIIHH4sI",
        *(b"RIFF", 36 + len(data) + len(padding), b"WAVE"),
        *(b"fmt ", 16, _PCM, 1, sample_rate_hz, 3 * sample_rate_hz, 3, 24),
        *(b"data", len(data)),
    )
    write_bytes(path, header + data + padding)


def file_sha256(path: Path) -> str:
    """Hexadecimal SHA-256 of a file's bytes. Raises AudioError when it is missing."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except (FileNotFoundError, IsADirectoryError):
        raise AudioError(
            path, "missing", "there is no such file", "restore it or remove its row"
        ) from None
