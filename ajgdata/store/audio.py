"""The only opener of audio files: WAV, FLAC and Ogg in, 24-bit WAV out, by libsndfile.

Nothing is altered silently. libsndfile reads a truncated WAV without complaint, so the size that
the header declares is compared with the bytes that are there; formats whose truncation cannot be
detected are refused.
"""

from __future__ import annotations

import hashlib
import io
import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.store.containers import DataChunk, data_chunk, is_wave, ogg_is_whole
from ajgdata.store.conversion import resample
from ajgdata.store.files import why_no_file, write_bytes
from ajgdata.types import AudioSettings, DataError
from ajgdata.types.settings import HIGHEST_RATE_HZ, LOWEST_RATE_HZ

if TYPE_CHECKING:
    import soundfile

Float32 = NDArray[np.float32]

#: libsndfile's names of the containers whose truncation is noticed.
_ACCEPTED = ("WAV", "WAVEX", "RF64", "FLAC", "OGG")
#: Endings of audio files that are read after a conversion only.
UNREADABLE_SUFFIXES = (
    *(".aac", ".aif", ".aiff", ".au", ".caf", ".m4a", ".mp3", ".mp4"),
    *(".opus", ".w64", ".webm", ".wma"),
)
#: Beyond these a header is taken for damaged: reading would ask for memory that nobody has.
MAX_CHANNELS, MAX_DURATION_S = 256, 3600
_AGAIN = "record it again, or fetch a whole copy"
#: Bytes in which the header of most WAV files ends.
_HEAD_BYTES = 4096


class Remark(NamedTuple):
    """A `Finding` that does not know yet which recording it is about."""

    level: Literal["error", "warning", "note"]
    code: str
    problem: str
    fix: str


class AudioError(DataError):
    """A recording that cannot be used; `code` is a stable slug, `remark` the same as a record.

    `remarks` are all that speaks against it, as far as was looked; `remark` is the first.
    """

    def __init__(self, where: object, code: str, problem: str, fix: str) -> None:
        super().__init__(where, problem, fix)
        self.code = code
        self.remark = Remark("error", code, problem, fix)
        self.remarks: tuple[Remark, ...] = (self.remark,)

    def __reduce__(self) -> tuple[type[AudioError], tuple[str, str, str, str]]:  # type: ignore[override]
        """Comes back whole from another process."""
        return type(self), (self.where, self.code, self.problem, self.fix)


@dataclass(frozen=True)
class AudioInfo:
    """Container, encoding, rate, channels and length of an audio file. `format` and `subtype` are
    libsndfile's names; `is_open` if the header does not state the length (a stream)."""

    format: str
    subtype: str
    sample_rate_hz: int
    channels: int
    frames: int
    is_open: bool = False


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


def inspect_audio(path: Path) -> AudioInfo:
    """Return the header of an audio file. Raises AudioError (a DataError) as `read_audio` does."""
    return _layout(path, _content(path))[0]


def inspect_header(path: Path) -> AudioInfo:
    """Return what `inspect_audio` does; of a complete WAV, only the header is read."""
    import soundfile

    try:
        with path.open("rb") as stream:
            head, size = stream.read(_HEAD_BYTES), os.fstat(stream.fileno()).st_size
        chunk = data_chunk(head, size)
        if chunk is None or chunk.declared is None or chunk.is_cut or chunk.is_followed:
            return inspect_audio(path)
        with soundfile.SoundFile(path) as file:
            info = _info(file)
    except (OSError, soundfile.LibsndfileError):
        return inspect_audio(path)  # which names the problem
    _check_plausible(path, info)
    return info


def read_audio(path: Path, audio: AudioSettings) -> Audio:
    """Read a recording, converting channel and rate only as far as `audio` allows.

    Raises AudioError; its `code` is a slug such as `truncated`.

    >>> from pathlib import Path
    >>> import numpy as np
    >>> from ajgdata.store.audio import read_audio, write_pcm24
    >>> from ajgdata.types import AudioSettings
    >>> write_pcm24(Path("click.wav"), np.array([0.0, 0.5, -0.25]), 44_100)
    >>> read_audio(Path("click.wav"), AudioSettings()).samples  # (n,), full scale ±1
    array([ 0.  ,  0.5 , -0.25], dtype=float32)
    """
    content = _content(path)
    info, chunk = _layout(path, content)
    remarks = []
    if info.is_open:
        remarks.append(
            Remark(
                "note",
                "open_length",
                f"the header leaves the length open; all {info.frames} frames were read",
                "check that the recording was not interrupted",
            )
        )
    check_layout(path, info, audio)
    samples = _decode(path, content, info, chunk)
    taken, remark = _take_channel(samples, audio.channel)
    remarks += [remark] if remark else []
    with np.errstate(invalid="ignore", over="ignore"):  # NaN and infinity are for the checks
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
    """Return every byte of a file that may be audio."""
    if wrong := why_no_file(path):
        raise AudioError(path, "missing", *wrong)
    try:
        content = path.read_bytes()
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


def _info(file: soundfile.SoundFile, *, is_open: bool = False) -> AudioInfo:
    numbers = file.samplerate, file.channels, file.frames
    return AudioInfo(file.format, file.subtype, *numbers, is_open)


def _layout(path: Path, content: bytes) -> tuple[AudioInfo, DataChunk | None]:
    """Return the header of a file, checked against what the file holds."""
    chunk = data_chunk(content, len(content))
    with _open(path, content, chunk) as file:
        info = _info(file, is_open=chunk is not None and chunk.declared is None)
    if chunk and chunk.count > 1:
        problem = f"has {chunk.count} `data` chunks: which of them is the recording is unknown"
        raise AudioError(path, "severaldata_chunks", problem, "save each as a file of its own")
    if chunk and chunk.is_cut:
        lost = (
            f"holds {chunk.held} of the {chunk.declared} bytes of samples that its header declares"
        )
        raise AudioError(path, "truncated", f"the file is cut short: {lost}", _AGAIN)
    if info.format == "OGG" and not ogg_is_whole(content):
        problem = "the file is cut short: its last Ogg page is missing"
        raise AudioError(path, "truncated", problem, _AGAIN)
    if info.frames == 0:
        raise AudioError(path, "no_samples", "holds a header but no samples", _AGAIN)
    _check_plausible(path, info)
    return info, chunk


def _check_plausible(path: Path, info: AudioInfo) -> None:
    """Raise AudioError for a header that no recording of this kind has."""
    rate, again = info.sample_rate_hz, "correct what wrote the header, or record it again"
    if not LOWEST_RATE_HZ <= rate <= HIGHEST_RATE_HZ:
        bounds = f"{LOWEST_RATE_HZ} to {HIGHEST_RATE_HZ} Hz can be used"
        problem = f"its header says {rate} Hz; {bounds}"
    elif info.channels > MAX_CHANNELS:
        problem = f"its header says {info.channels} channels; {MAX_CHANNELS} at most can be used"
    elif info.frames > MAX_DURATION_S * rate:
        problem = f"{info.frames / rate:.0f} s long; {MAX_DURATION_S} s at most can be used"
        again = "cut it into recordings"
    else:
        return
    raise AudioError(path, "implausible", problem, again)


def _open(path: Path, content: bytes, chunk: DataChunk | None) -> soundfile.SoundFile:
    """Hand the bytes to libsndfile."""
    import soundfile

    if chunk and chunk.declared is None:  # libsndfile takes a length of 0 at its word
        size = struct.pack(f"{chunk.order}I", chunk.held & 0xFFFF_FFFF)
        content = content[: chunk.start - 4] + size + content[chunk.start :]
    suffix = path.suffix.lower()
    try:
        file = soundfile.SoundFile(io.BytesIO(content))
    except soundfile.LibsndfileError as error:
        if suffix in UNREADABLE_SUFFIXES:
            raise unsupported(path) from None
        if is_wave(content) or content[:4] in (b"RIFF", b"fLaC", b"OggS"):
            problem = f"its header is damaged ({error.error_string.rstrip('.')})"
            raise AudioError(path, "damaged", problem, _AGAIN) from None
        raise AudioError(
            path, "not_audio", "not an audio file", "replace it by the recording or remove its row"
        ) from None
    unchecked = file.format in ("WAV", "WAVEX", "RF64") and chunk is None
    if file.format not in _ACCEPTED or file.subtype.startswith("MPEG") or unchecked:
        file.close()
        what = "MP3" if file.subtype.startswith("MPEG") else file.format
        raise unsupported(path, what if suffix not in UNREADABLE_SUFFIXES else "")
    return file


def unsupported(path: Path, what: str = "") -> AudioError:
    """Return the refusal of audio that has to be converted; `what` it is, "" if its suffix says.

    A command that converts is not given: it might write over the file, or over its neighbour.
    """
    name = what or path.suffix.removeprefix(".").upper()
    fix = "`ajgdata import --convert` decodes it into a new file"
    return AudioError(path, "unsupported_format", f"{name} audio is not read as it is", fix)


def _decode(path: Path, content: bytes, info: AudioInfo, chunk: DataChunk | None) -> Float32:
    """Return samples (frames, channels), full scale ±1."""
    import soundfile

    try:
        with _open(path, content, chunk) as file:
            samples: Float32 = file.read(dtype="float32", always_2d=True)
    except soundfile.LibsndfileError as error:
        problem = f"cannot be decoded ({error.error_string.rstrip('.')})"
        raise AudioError(path, "damaged", problem, _AGAIN) from None
    if len(samples) < info.frames:
        lost = f"holds {len(samples)} of the {info.frames} frames that its header declares"
        raise AudioError(path, "truncated", f"the file is cut short: {lost}", _AGAIN)
    return samples


def check_layout(path: Path, info: AudioInfo, audio: AudioSettings) -> None:
    """Raise AudioError when a file is not what `audio` declares, nor may be converted to it.

    Its `remarks` name everything that differs.
    """
    told = []
    if info.sample_rate_hz != audio.sample_rate_hz and audio.other_rate == "reject":
        problem = f"sampled at {info.sample_rate_hz} Hz, not {audio.sample_rate_hz} Hz"
        fix = "set audio.other_rate: resample (or audio.sample_rate_hz) in dataset.yaml"
        told.append(AudioError(path, "other_rate", problem, fix))
    count, channel = info.channels, audio.channel
    if channel == "mono" and count != 1:
        problem = f"has {count} channels, not one"
        fix = "set audio.channel: mean, or to the number of a channel, in dataset.yaml"
        told.append(AudioError(path, "channels", problem, fix))
    if isinstance(channel, int) and channel >= count:
        problem = f"has {count} channels (0 to {count - 1}), the data set asks for {channel}"
        told.append(AudioError(path, "channels", problem, "correct audio.channel in dataset.yaml"))
    if told:
        told[0].remarks = tuple(error.remark for error in told)
        raise told[0]


def _take_channel(samples: Float32, channel: str | int) -> tuple[Float32, Remark | None]:
    """Return the channels (frames, used) that a data set uses."""
    count = samples.shape[1]
    if isinstance(channel, int):
        samples = np.ascontiguousarray(samples[:, channel : channel + 1])
    if count == 1:
        return samples, None
    done = f"averaged {count} channels" if channel == "mean" else f"took channel {channel}"
    fix = f"nothing to do: audio.channel is {channel}"
    return samples, Remark("note", "channel_converted", f"{done} of {count}", fix)


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
    write_bytes(path, pcm24_bytes(samples, sample_rate_hz))


def pcm24_bytes(samples: NDArray[Any], sample_rate_hz: int) -> bytes:
    """Return a mono 24-bit WAV of samples (n,) within ±1, rounded to the nearest code."""
    import soundfile

    codes = np.rint(samples.astype(np.float64) * 2**23).clip(-(2**23), 2**23 - 1)
    stream = io.BytesIO()
    # libsndfile takes the upper 24 of 32 bits
    soundfile.write(stream, codes.astype(np.int32) << 8, sample_rate_hz, "PCM_24", format="WAV")
    return stream.getvalue()


def file_sha256(path: Path) -> str:
    """Return the hexadecimal SHA-256 of a file's bytes. Raises AudioError when it is missing."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except (FileNotFoundError, IsADirectoryError):
        raise AudioError(
            path, "missing", "there is no such file", "restore it or remove its row"
        ) from None
