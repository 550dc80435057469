"""Audio that is not read as it is -> new WAV files, by libsndfile or an installed ffmpeg.

32-bit float, so that nothing that the decoder gives is rounded or clipped.
"""

from __future__ import annotations

import io
import shutil
import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ajgdata.store.audio import MAX_DURATION_S, AudioError

_TIMEOUT_S = 300


def decoded(path: Path) -> tuple[bytes, str]:
    """Return the sound of a file as a WAV, the same bytes each time, and what decoded it.

    Raises AudioError for a file that neither libsndfile nor ffmpeg can read.
    """
    import soundfile
    from scipy.io import wavfile

    try:
        with soundfile.SoundFile(path) as file:
            rate = file.samplerate
            if file.frames > MAX_DURATION_S * rate:
                problem = f"{file.frames / rate:.0f} s long; {MAX_DURATION_S} s at most can be used"
                raise AudioError(path, "implausible", problem, "cut it into recordings")
            samples = file.read(dtype="float32", always_2d=True)
        made_by = f"libsndfile {soundfile.__libsndfile_version__}"
    except soundfile.LibsndfileError:
        samples, rate, made_by = _by_ffmpeg(path)
    if not len(samples):
        raise AudioError(path, "no_samples", "holds no samples", "record it again")
    stream = io.BytesIO()
    wavfile.write(stream, rate, samples)  # libsndfile would write the time of day into the file
    return stream.getvalue(), made_by


def _by_ffmpeg(path: Path) -> tuple[NDArray[np.float32], int, str]:
    import soundfile

    program = shutil.which("ffmpeg")
    if program is None:
        problem = f"libsndfile cannot read {path.suffix.removeprefix('.').upper()} audio"
        raise AudioError(path, "unsupported_format", problem, "install ffmpeg, then import again")
    command = [program, "-nostdin", "-v", "error", "-protocol_whitelist", "file,pipe"]
    command += ["-i", f"file:{path.absolute()}", "-map", "0:a:0", "-c:a", "pcm_f32le"]
    command += ["-bitexact", "-f", "wav", "pipe:1"]
    try:
        done = subprocess.run(command, capture_output=True, timeout=_TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired:
        problem = f"ffmpeg did not decode it in {_TIMEOUT_S} s"
        raise AudioError(path, "unsupported_format", problem, "convert it yourself") from None
    if done.returncode or not done.stdout:
        said = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["no reason given"]
        problem = f"ffmpeg cannot decode it ({' '.join(said[0].split())})"
        raise AudioError(path, "damaged", problem, "fetch a whole copy, or leave it out")
    samples, rate = soundfile.read(io.BytesIO(done.stdout), dtype="float32", always_2d=True)
    return samples, rate, _version(program)


def _version(program: str) -> str:
    """Return name and version of an ffmpeg, as `ffmpeg 6.1.1`."""
    said = subprocess.run(
        [program, "-version"], capture_output=True, timeout=_TIMEOUT_S, check=False
    )
    words = said.stdout.decode(errors="replace").split()
    return f"ffmpeg {words[2]}" if words[:2] == ["ffmpeg", "version"] and words[2:] else "ffmpeg"
