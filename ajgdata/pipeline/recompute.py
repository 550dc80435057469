"""Published spectra are made once more from the published recordings, and compared."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import chain

import numpy as np

from ajgdata.features.align import shift
from ajgdata.features.maker import feature_maker
from ajgdata.paths import SESSION_FILE, Tree
from ajgdata.pipeline.recordings import examine
from ajgdata.store.features import Shard, read_labels, spectra_blocks
from ajgdata.store.publishing.checks import Defect
from ajgdata.store.publishing.table import FILE_NAME, read_table
from ajgdata.store.sessions import inside, read_session
from ajgdata.types import AudioSettings, DataError, FeatureSettings

#: Of the largest value of a spectrum. Sums of some hundred float32 magnitudes by another FFT err
#: by some 1e-5 (hundreds of roundings of 2**-24); other recordings differ by tenths.
TOLERANCE = 1e-3


def spectrum_defects(tree: Tree) -> Iterator[Defect]:
    """A defect if a spectrum of features.nc is not that of its recording, or is damaged. Nothing is
    said of other things that cannot be read: that is found elsewhere."""
    try:
        store = read_labels(tree / tree.FEATURES)
        files = {row["recording"]: row[FILE_NAME] for _, row in read_table(tree)[1]}
        settings = json.loads(str(store.attrs["settings"]))
        audio = AudioSettings(**settings["audio"])
        features = FeatureSettings(**settings["features"])
        played = _played(tree, store, audio) if features.needs_excitation else {}
    except (DataError, LookupError, TypeError, ValueError):
        return
    names = [str(name) for name in store.columns["recording"].values]
    spectra = zip(names, chain.from_iterable(spectra_blocks(tree / tree.FEATURES)), strict=True)
    try:
        odd = _odd(tree, spectra, files, audio, features, played)
    except DataError as error:
        yield Defect(tree.FEATURES, error.problem)
        return
    if odd:
        more = f" (nor are {len(odd) - 1} others)" if odd[1:] else ""
        yield Defect(tree.FEATURES, f"its spectrum of {odd[0]} is not that of the file{more}")


def _odd(
    tree: Tree,
    spectra: Iterable[tuple[str, np.ndarray]],
    files: Mapping[str, str],
    audio: AudioSettings,
    features: FeatureSettings,
    played: Mapping[str, np.ndarray],
) -> list[str]:
    """Return the files whose spectrum is not the one that is stored, of recordings by name."""
    odd, makers = [], dict[str, Callable[[np.ndarray], np.ndarray]]()
    for name, stored in spectra:
        if name not in files or not (tree / files[name]).is_file():
            continue
        session = name.partition("/")[0]
        excitation = played.get(session) if features.align else None
        found = examine(tree / files[name], audio, features.window, excitation)
        if found.samples is None:
            odd.append(files[name])
            continue
        samples = found.samples if found.delay is None else shift(found.samples, found.delay)
        try:
            if session not in makers:
                sound = played.get(session)
                makers[session] = feature_maker(features, audio.sample_rate_hz, sound)
            expected = makers[session](samples)
        except ValueError:  # a sound that is missing or silent
            odd.append(files[name])
            continue
        same = expected.shape == stored.shape
        if not same or np.abs(expected - stored).max() > TOLERANCE * np.abs(expected).max():
            odd.append(files[name])
    return odd


def _played(tree: Tree, store: Shard, audio: AudioSettings) -> dict[str, np.ndarray]:
    """The played sound of each session that has one."""
    sounds = {}
    for session in sorted({str(name) for name in store.columns["session_id"].values}):
        folder = (tree / tree.session(session)).parent
        if declared := read_session(folder).excitation:
            sound = examine(inside(folder, declared.file), audio, window=1).samples
            if sound is None:
                raise DataError(folder / SESSION_FILE, "its sound cannot be read", "")
            sounds[session] = sound
    return sounds
