"""Documents on embeddings -> the page on them, and one page for each on which they are heard."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ajgdata.paths import Paths
from ajgdata.pipeline.embed_documents import read_embedded
from ajgdata.pipeline.studies import EMBEDDING_CODE
from ajgdata.report.paper import parse_paper
from ajgdata.store.audio import AudioError, read_audio
from ajgdata.store.code_digest import code_digest
from ajgdata.store.conversion import BYTES_PER_SECOND, mp3_clip
from ajgdata.store.files import write_bytes
from ajgdata.store.manifest import read_manifest
from ajgdata.store.provenance import software
from ajgdata.store.report_files import read_paper
from ajgdata.store.sessions import read_dataset
from ajgdata.types import AudioSettings

#: All sounds of an explorer together, as text in the page; and the longest piece of one.
MOST_SOUND_MB, LONGEST_S, SHORTEST_S = 10.0, 3.0, 0.2
#: Peak of the loudest clip.
LOUDEST = 0.9


def build_embedding_page(
    paths: Paths, embeddings: Sequence[tuple[str, str]], pages: Sequence[str]
) -> None:
    """Write the page on `embeddings`, pairs of data set and name, linked with `pages`."""
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.embedding_page import PAGE, figures, render_embeddings
    from ajgdata.report.study_page import page_links

    shown = [read_embedded(paths, *one, measured=True) for one in embeddings]
    svgs = {}
    for name, illustration in figures(shown).items():
        svg, *_ = save_figure(illustration.draw(), paths.page_figure(PAGE, name))
        svgs[name] = svg.read_bytes()
    explorers = {
        one.id: str(paths.explorer(one.dataset, one.name).relative_to(paths.report.parent))
        for one in shown
        if one.pictured
    }
    html = render_embeddings(
        shown,
        svgs,
        parse_paper(read_paper(paths)),
        {**software(), "code": code_digest(EMBEDDING_CODE)},
        explorers,
        page_links(pages),
        paths,
    )
    paths.page_figures(PAGE).mkdir(parents=True, exist_ok=True)  # also if it holds none
    write_bytes(paths.page(PAGE), html.encode())


def build_explorer(paths: Paths, dataset: str, embedding: str, manifests: Sequence[Path]) -> None:
    """Write the page on which every recording is seen and heard."""
    from ajgdata.report.interactive import render_interactive

    one = read_embedded(paths, dataset, embedding, measured=False)
    audio = read_dataset(paths, dataset).audio
    recordings = one.pictured.recording.tolist() if one.pictured else []
    clips, told = sounds(paths.root, manifests, audio, set(recordings))
    html = render_interactive(one, clips, told, paths)
    write_bytes(paths.explorer(dataset, embedding), html.encode())


def sounds(
    root: Path, manifests: Sequence[Path], audio: AudioSettings, wanted: set[str]
) -> tuple[dict[str, bytes], str]:
    """MP3s by recording, and what was done to the sound, in words.

    Together they take MOST_SOUND_MB at most: the more there are, the shorter each is. One gain for
    all, so that loud things stay louder than quiet ones. Files that cannot be read are left out.
    """
    room_s = MOST_SOUND_MB * 1e6 * 3 / 4 / BYTES_PER_SECOND / max(len(wanted), 1)
    seconds = min(LONGEST_S, room_s)
    if seconds < SHORTEST_S:
        return {}, f"{len(wanted):,} recordings are too many for one file: none can be heard."
    files = dict(_files(root, manifests, wanted))
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


def _files(root: Path, manifests: Sequence[Path], wanted: set[str]) -> Iterator[tuple[str, Path]]:
    """Recordings (`<session>/<recording_id>`) with their files."""
    for manifest in manifests:
        content, _ = read_manifest(manifest)
        for entry in content["recordings"]:
            name = f"{content['session_id']}/{entry['recording_id']}"
            if name in wanted:
                yield name, root / entry["path"]
