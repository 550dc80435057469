"""Recordings of several data sets, each read as its own declaration says."""

import shutil

import numpy as np
import pytest
import soundfile as sf
from worlds import AUDIO, RATE_HZ, tone, write_tone

from ajgdata.pipeline.recordings import RecordingReader
from ajgdata.types import AudioSettings, NotPossibleError


def microphone(number: int | str | None) -> AudioSettings:
    return AudioSettings(sample_rate_hz=RATE_HZ, microphone=number)


def test_each_data_set_is_heard_on_its_own_channel(project):
    (row,) = project.session(tones={"a": 500.0})
    both = np.column_stack([tone(500.0), tone(1000.0)])
    sf.write(project.folder() / row.file, both, RATE_HZ, subtype="PCM_24")
    project.write([row.model_copy(update={"sha256": ""})])
    for name in "em":
        shutil.copytree(project.folder(), project.paths.session(name, "s1"))
    settings = {"d": microphone(1), "e": microphone(2), "m": microphone(None)}
    reader = RecordingReader(project.paths, settings)
    for dataset, expected in (("d", both[:, 0]), ("e", both[:, 1])):
        (samples,) = reader.samples(dataset, ["s1/a"], 256)
        np.testing.assert_allclose(samples, expected, atol=2.0**-23)
    with pytest.raises(NotPossibleError, match="recording 's1/a' cannot be used"):
        list(reader.samples("m", ["s1/a"], 256))


def test_a_recording_that_was_edited_is_not_used(project):
    project.session(tones={"a": 500.0})
    reader = RecordingReader(project.paths, {"d": AUDIO})
    assert len(list(reader.samples("d", ["s1/a"], 256))) == 1
    write_tone(project.folder() / "audio" / "a.wav", 501)
    with pytest.raises(NotPossibleError, match="recording 's1/a': its bytes are not those"):
        list(reader.samples("d", ["s1/a"], 256))
