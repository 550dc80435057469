"""Projections of an embedding and its recordings -> the page on which they are seen and heard."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ajgdata.paths import Paths
from ajgdata.report.navigation import Group, experiment_link
from ajgdata.store.audio import AudioError, read_audio
from ajgdata.store.conversion import BYTES_PER_SECOND, mp3_clip
from ajgdata.store.files import write_bytes
from ajgdata.store.sessions import read_dataset, recording_paths
from ajgdata.store.tables import read_tables
from ajgdata.types import AudioSettings

#: All sounds of an explorer together, as text in the page; and the longest piece of one.
MOST_SOUND_MB, LONGEST_S, SHORTEST_S = 10.0, 3.0, 0.2
#: Of more recordings, this many are shown: a page is to open at once, and to stay below a megabyte.
MOST_SHOWN = 2000
#: Peak of the loudest clip.
LOUDEST = 0.9


def build_explorer(
    projections: Path,
    *,
    dataset: str,
    embedding: str,
    paths: Paths,
    page: Path,
    nav: Sequence[Group] = (),
) -> None:
    """Write the page on which every recording of an embedding is seen and heard.

    `projections` are the tables of experiment `embedding_projections`.
    """
    from ajgdata.experiments.embedding_projections import NAME as PROJECTIONS
    from ajgdata.experiments.embedding_projections import projections_of
    from ajgdata.report.explorer import Explored, render_explorer
    from ajgdata.report.projections import thinned

    spec, (about, tables) = read_dataset(paths, dataset), read_tables(projections)
    shown = None if "skipped" in about else projections_of({one.name: one for one in tables})
    recordings = shown.recording.tolist() if shown else []
    available = about.get("available", len(recordings))
    clips, told = dict[str, bytes](), "There are too many to be heard."
    if shown and len(recordings) > MOST_SHOWN:
        shown = thinned(shown, MOST_SHOWN)
    else:
        clips, told = sounds(paths, dataset, spec.audio, set(recordings))
    if shown and len(shown.recording) < available:
        count = f"{len(shown.recording):,} of {available:,} recordings"
        told = f"{count} are shown, drawn evenly. {told}"
    place = paths.explorer(dataset, embedding)
    here = place.relative_to(paths.report.parent).as_posix()
    one = Explored(
        title=f"{spec.title or spec.name} · {embedding.replace('_', ' ')}",
        source="simulated" if about["provenance"]["source"] == "simulated" else "recorded",
        supervision=spec.embeddings[embedding].supervision,
        more=f"../../{experiment_link(PROJECTIONS)}",
        shown=shown,
        skipped=about.get("skipped", ""),
    )
    write_bytes(page, render_explorer(one, clips, told, here=here, nav=nav, project=paths).encode())


def sounds(
    paths: Paths, dataset: str, audio: AudioSettings, wanted: set[str]
) -> tuple[dict[str, bytes], str]:
    """Return MP3s by recording, and what was done to the sound, in words.

    Together they take MOST_SOUND_MB at most: the more there are, the shorter each is. One gain for
    all, so that loud things stay louder than quiet ones. Files that cannot be read are left out.
    """
    room_s = MOST_SOUND_MB * 1e6 * 3 / 4 / BYTES_PER_SECOND / max(len(wanted), 1)
    seconds = min(LONGEST_S, room_s)
    if seconds < SHORTEST_S:
        return {}, f"{len(wanted):,} recordings are too many for one file: none can be heard."
    files = dict(_files(paths, dataset, wanted))
    count = round(seconds * audio.sample_rate_hz)

    def beginning(path: Path) -> np.ndarray | None:
        try:
            return np.nan_to_num(read_audio(path, audio).samples[:count])
        except AudioError:
            return None

    # Read twice, rather than hold all: reading is a thousandth of the cost of encoding.
    peak = max(
        (np.abs(x).max() for f in files.values() if (x := beginning(f)) is not None), default=0
    )
    gain = LOUDEST / float(peak) if peak > 0 else 1.0
    clips = {
        name: mp3_clip(samples, audio.sample_rate_hz, gain)
        for name, path in files.items()
        if (samples := beginning(path)) is not None
    }
    return clips, (
        f"The sound is that of the recordings, at most {seconds:.1f} s of each, made louder by one "
        f"gain for all ({20 * np.log10(gain):+.0f} dB) and packed as MP3 (56 kbit/s), which loses "
        "detail above some 16 kHz: it is to be listened to, not to be measured."
    )


def _files(paths: Paths, dataset: str, wanted: set[str]) -> Iterator[tuple[str, Path]]:
    """Yield recordings (`<session>/<recording_id>`) with their files."""
    for session in sorted({name.partition("/")[0] for name in wanted}):
        for recording_id, path in recording_paths(paths.session(dataset, session)).items():
            if (name := f"{session}/{recording_id}") in wanted:
                yield name, path
