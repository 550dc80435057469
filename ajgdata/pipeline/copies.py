"""Changed copies of recordings for training: their samples, their noise and their features."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ajgdata.evaluate.task_data import TrainingCopies
from ajgdata.features.augment import Noise, changed_copy, mean_power
from ajgdata.features.compute import FeatureComputer
from ajgdata.paths import Paths
from ajgdata.pipeline.recordings import RecordingReader
from ajgdata.store.audio import FileHashes
from ajgdata.store.features import FeatureRows, read_store
from ajgdata.types import AudioSettings, DataError, FeatureKind, NotPossibleError
from ajgdata.types.augment import Augment

#: Number of segments of noise that are drawn before an error, if each one is silent.
MAX_SILENT = 100


def copy_maker(
    augment: Augment | None,
    table: FeatureRows,
    paths: Paths,
    audio: Mapping[str, AudioSettings],
    features: FeatureKind,
    *,
    dataset: str,
    seed: int,
) -> RecordingCopies | None:
    """Return the copies of a task with `augment`; None without this setting.

    `table` are the features of the data set `dataset`, whose task it is. `audio` has the settings
    of the data sets whose recordings are copied; they have one sample rate. Recordings of the noise
    are resampled to this rate. Raises DataError if they are also recordings of `dataset`.
    """
    if augment is None:
        return None
    own = audio[dataset]
    read_audio = dict(audio)
    noise_names: tuple[str, ...] = ()
    if augment.noise_set:
        file = paths.features(augment.noise_set)
        noise = read_store(file)
        tested = set(table.columns["sha256"].values) - {""}
        if not tested.isdisjoint(noise.columns["sha256"].values):
            problem = f"has recordings of {dataset}, which models are tested on"
            raise DataError(file, problem, "use other recordings as noise")
        noise_names = tuple(noise.columns["recording"].values.tolist())
        settings = noise.settings["audio"]
        same_rate = {"sample_rate_hz": own.sample_rate_hz, "other_rate": "resample"}
        read_audio[augment.noise_set] = AudioSettings.model_validate(settings | same_rate)
    reader = RecordingReader(paths, read_audio)
    compute = FeatureComputer(own, features, paths.dataset(dataset).parent)
    return RecordingCopies(augment, reader, compute, noise_names, seed)


@dataclass(frozen=True, eq=False)
class RecordingCopies:
    """Changed copies of recordings by the settings of a task. Each copy is computed once.

    `noise_names` are the recordings of the data set whose recordings are the noise, if any.
    """

    settings: Augment
    recordings: RecordingReader
    compute: FeatureComputer
    noise_names: Sequence[str]
    seed: int
    #: Features (copies, f) of the copies, by data set and name of the recording.
    _computed: dict[tuple[str, str], np.ndarray] = field(default_factory=dict)

    def copies(self, dataset: str, names: Sequence[str]) -> TrainingCopies:
        """Return the copies of recordings of a data set; `names` (n,) are those of the rows.

        The copies of a recording do not depend on the other recordings. Raises NotPossibleError for
        a recording that cannot be used, and for noise that is silent.
        """
        new = [name for name in names if (dataset, name) not in self._computed]
        sounds = self.recordings.samples(dataset, new, self.compute.least_samples)
        noise: Noise | None = None
        if self.settings.noise_set:
            noise = partial(self._recorded_noise, hashes=FileHashes())
        for name, samples in zip(new, sounds, strict=True):
            self._computed[dataset, name] = np.array(
                [
                    self._feature(samples, dataset, name, number, noise)
                    for number in range(self.settings.copies)
                ]
            )
        rows = np.repeat(np.arange(len(names)), self.settings.copies)
        return TrainingCopies(rows, np.concatenate([self._computed[dataset, n] for n in names]))

    def _feature(
        self, samples: np.ndarray, dataset: str, name: str, number: int, noise: Noise | None
    ) -> np.ndarray:
        """Return the feature (f,) of one copy of a recording with samples (n,) or (channels, n).

        The played sound of the session does not change.
        """
        digest = hashlib.sha256(f"{dataset}/{name}".encode()).digest()
        generator = np.random.default_rng([self.seed, int.from_bytes(digest[:8], "big"), number])
        rate_hz = self.compute.audio.sample_rate_hz
        copy = changed_copy(samples, rate_hz, self.settings, generator, noise)
        played = None
        if self.compute.needs_played:
            played = self.recordings.played(dataset, name)
        try:
            return self.compute(copy.astype(np.float32), played).values.ravel()
        except ValueError as error:
            raise NotPossibleError(f"augment: a copy of recording {name!r}: {error}") from None

    def _recorded_noise(
        self, generator: np.random.Generator, shape: tuple[int, ...], hashes: FileHashes
    ) -> np.ndarray:
        """Return a random segment of a random recording of the noise, of a `shape` (..., n).

        `hashes` are those of files that were already read for other copies.
        All channels have the same noise, that of the first microphone. A shorter recording is
        repeated. A silent segment is drawn again.
        """
        length = shape[-1]
        noise_set = self.settings.noise_set
        if not self.noise_names:
            raise NotPossibleError(f"augment.noise: {noise_set} has no usable recording")
        for _ in range(MAX_SILENT):
            name = self.noise_names[int(generator.integers(len(self.noise_names)))]
            (recorded,) = self.recordings.samples(noise_set, [name], 1, hashes)
            first = np.atleast_2d(recorded)[0].astype(np.float64)
            repeats = -(-length // len(first))
            noise = np.tile(first, repeats)
            start = generator.integers(len(noise) - length + 1)
            segment = noise[start : start + length]
            if mean_power(segment):
                return np.broadcast_to(segment, shape)
        raise NotPossibleError(f"augment.noise: {MAX_SILENT} segments of {noise_set} are silent")
